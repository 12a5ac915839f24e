"""The measuring tools themselves, on data whose answer is known."""

import numpy as np
import pytest
from koppel import Reference, Result
from koppel.fmu import grid
from koppel.reference import BadReference
from koppel.work_precision import (
    SATURATED,
    Setting,
    energy_balance,
    fitted_order,
    settings,
)


def result(t, **columns):
    """A run with these recorded columns (dots written as __)."""
    names = [name.replace("__", ".") for name in columns]
    return Result(np.asarray(t), names, np.column_stack(list(columns.values())), {name: 1.0 for name in names}, {})


@pytest.fixture
def reference(tmp_path):
    path = tmp_path / "case.csv"
    path.write_text("# source: made up\nt,theta1,A.F.x\n0,1,0\n0.1,2,-40\n0.2,3,10\n", encoding="utf-8")
    return Reference(path)


def test_error_is_taken_at_the_samples_and_scaled(reference):
    error = reference.error_of(
        result([0.0, 0.1, 0.2], lower__angle__theta=[1.0, 2.3, 2.9], A__F__x=[0.0, -40.0, 12.0], x=[0, 0, 0])
    )
    theta, force = error["lower.angle.theta"], error["A.F.x"]
    assert (theta.largest, theta.at, theta.scale) == pytest.approx((0.3, 0.1, 3.0))
    assert theta.rms == pytest.approx(np.sqrt((0.3**2 + 0.1**2) / 3))
    assert (force.largest, force.at, force.scale) == pytest.approx((2.0, 0.2, 40.0))
    assert error.worst().name == "lower.angle.theta" and error.e_max == pytest.approx(0.1)
    assert error.worst("force").name == "A.F.x"
    assert "A.F.x" in error.table()


def test_small_references_are_scaled_by_the_nominal_value(tmp_path):
    path = tmp_path / "small.csv"
    path.write_text("# source: made up\nt,A.F.x\n0,0\n1,1e-12\n", encoding="utf-8")
    error = Reference(path).error_of(result([0.0, 1.0], A__F__x=[0.0, 0.5]))
    assert error["A.F.x"].scale == 1.0


def test_a_nan_in_the_run_is_an_infinite_error(reference):
    error = reference.error_of(result([0.0, 0.1, 0.2], A__F__x=[0.0, float("nan"), 10.0]))
    assert error.e_max == float("inf")


def test_finer_and_coarser_runs_meet_the_reference_at_common_samples(reference):
    fine = np.arange(5) * 0.05
    assert reference.error_of(result(fine, A__F__x=np.interp(fine, [0.0, 0.1, 0.2], [0.0, -40.0, 10.0]))).samples == 3
    assert reference.error_of(result([0.0, 0.2], A__F__x=[0.0, 10.0])).samples == 2


def test_samples_are_never_interpolated(reference):
    with pytest.raises(BadReference, match="fall on communication points"):
        reference.error_of(result([0.0, 0.07, 0.14, 0.21], A__F__x=[0.0] * 4))


def test_a_run_without_common_signals_is_refused(reference):
    with pytest.raises(BadReference, match="recorded nothing"):
        reference.error_of(result([0.0, 0.1, 0.2], P__r__x=[0.0] * 3))


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("t,theta1\n0,1\n", "where it comes from"),
        ("# source: x\nt,theta1\n0,1,2\n", "not a table"),
        ("# source: x\nt,theta1\n0,nan\n", "not finite"),
    ],
)
def test_bad_reference_files_are_refused(tmp_path, text, match):
    path = tmp_path / "bad.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(BadReference, match=match):
        Reference(path)
    with pytest.raises(BadReference, match="missing"):
        Reference(tmp_path / "none.csv")


def test_order_is_fitted_to_the_last_points_above_saturation():
    steps = np.array([200, 400, 1000, 2000, 5000, 10000])
    error = 5.0 * (10.0 / steps) ** 4
    assert fitted_order(steps, error) == pytest.approx(4.0)
    bent = error + 1.0 * (10.0 / steps) ** 6  # not in the asymptotic range yet at the coarse end
    assert fitted_order(steps, bent) == pytest.approx(4.0, abs=0.01)
    flat = np.where(steps > 2000, 0.5 * SATURATED, error)
    assert fitted_order(steps, flat) == pytest.approx(4.0)
    assert fitted_order(steps[:2], error[:2]) is None


def test_communication_points_end_exactly():
    t = grid(0.0, 10.0, 0.05)
    assert len(t) == 201 and t[-1] == 10.0 and t[37] == 37 * 0.05
    t = grid(0.0, 1.0, 0.3)
    assert np.allclose(np.diff(t), [0.3, 0.3, 0.3, 0.1]) and t[-1] == 1.0
    assert len(grid(0.0, 0.7, 0.1)) == 8  # 7 * 0.1 > 0.7 in the last bit
    with pytest.raises(ValueError, match="H > 0"):
        grid(0.0, 1.0, 0.0)


def test_energy_balance_of_a_lossless_exchange_has_a_scale():
    phase = np.linspace(0.0, 6.0, 50)
    run = result(
        phase,
        energy__kinetic=np.sin(phase) ** 2,
        energy__potential=7.0 + np.cos(phase) ** 2 + 1e-6 * (phase > 3.0),
        energy__dissipated=0.0 * phase,
        energy__supplied=0.0 * phase,
    )
    assert energy_balance(run) == pytest.approx(1e-6, rel=1e-2)


def test_the_study_has_at_least_five_points_per_method():
    methods = [setting.method for setting in settings()]
    assert {method: methods.count(method) >= 5 for method in methods} == {"heun": True, "rk4": True, "dopri5": True}
    assert Setting("heun", step=0.05).start_values == {"solver.method": "heun", "solver.step": 0.05}
    adaptive = Setting("dopri5", rtol=1e-6).start_values
    assert adaptive["solver.method"] == "dopri5"
    assert (adaptive["solver.rtol"], adaptive["solver.atol"]) == pytest.approx((1e-6, 1e-9))
