"""The benchmark scenes by every method against solutions that share no code with the product (tests/oracle/coupling.py).

Errors are the largest of all states at 20 equal samples; limits are the accepted ones, in brackets what a separate program
reached. Components step by RK4, one inner step per H.
"""

import numpy as np
import pytest
from koppel import library, scenes
from koppel.scene import Diverged, SceneError
from koppel.scene.study import raw_variant
from koppel.work_precision import fitted_order
from oracle import coupling

SAMPLES = 20
# end values as published with the benchmark: phi from hanging, w
ENDS = {
    "two_mass": [-0.580718202062, 2.072636041198, -0.330066656350, -2.847414264006],
    "double_pendulum": [-0.08275830682, -0.96114544454, 0.40736207491, 11.89895505304],
    "four_bar": [-1.59026744657, 0.17757237712, 2.02485673583, 0.05814387203, -2.21155536299, 0.06073698443],
}


def reference(name, stop, **options):
    """States at the samples."""
    columns, whole, solution, angles, _ = coupling.CASES[name]
    t = whole * np.arange(SAMPLES + 1) / SAMPLES
    values = solution(t, **options)
    if angles:
        values[:, 0::2] -= 0.5 * np.pi
    return values[t <= stop * (1.0 + 1e-9)]


@pytest.fixture(scope="session")
def states():
    """References by scene and options, each solved once."""
    solved = {}

    def of(name, stop, **options):
        key = (name, tuple(options.items()))
        if key not in solved:
            solved[key] = reference(name, coupling.CASES[name][1], **options)
        return solved[key][: round(stop / coupling.CASES[name][1] * SAMPLES) + 1]

    return of


@pytest.fixture(scope="session")
def error(fmu, states):
    """Largest error of a scene's run."""

    def of(name, H, stop=None, scene_options=None, **how):
        stop = stop or coupling.CASES[name][1]
        options = scene_options or {}
        inner = {} if how["method"] == "common" else {"values": scenes.fixed("rk4", H)}
        scene = library.scene(name, fmu, **options)
        result = scene.run(H=H, stop=stop, interval=coupling.CASES[name][1] / SAMPLES, **inner, **how)
        assert result.names == coupling.CASES[name][0]
        return np.abs(result.values - states(name, stop, **options)).max()

    return of


@pytest.mark.parametrize("name", ENDS)
def test_references_end_at_the_published_values(states, name):
    end = states(name, coupling.CASES[name][1])[-1].copy()
    if coupling.CASES[name][3]:
        end[0::2] += 0.5 * np.pi
    assert np.abs(end - ENDS[name]).max() <= 1e-10


RK4 = {"method": "common", "integrator": "rk4"}
JACOBI = {"method": "jacobi", "order": 1}
PREDICT = {"method": "cs-predict", "order": 1}
PECE1, PECE2 = ({"method": "cs-pece", "order": k} for k in (1, 2))

ROWS = [
    ("two_mass", JACOBI, 5e-3, 2e-2),  # (1.3e-2)
    ("two_mass", JACOBI, 1.25e-3, 1.2e-3),  # (7.8e-4)
    ("two_mass", PECE1, 5e-3, 1.2e-4),  # (7.8e-5)
    ("double_pendulum", JACOBI, 5e-3, 6e-2),  # (4.2e-2)
    ("double_pendulum", JACOBI, 1.25e-3, 4e-3),  # (2.6e-3)
    ("double_pendulum", PREDICT, 1.25e-3, 3e-3),  # (1.9e-3)
    ("double_pendulum", PECE1, 5e-3, 1e-3),  # (5.9e-4)
    ("double_pendulum", PECE2, 5e-3, 5e-5),  # (2.9e-5)
    ("double_pendulum", RK4, 5e-3, 3e-6),  # (1.8e-6)
    ("four_bar", {**RK4, "alpha": 0.0}, 10e-3, 8e-6),  # (5.0e-6)
    ("four_bar", {**PECE2, "alpha": 0.0}, 10e-3, 2e-2),  # (1.0e-2; a second program 2.5e-3)
    ("four_bar", {**PECE2, "alpha": 0.0}, 2.5e-3, 8e-5),  # (5.1e-5; a second program 1.6e-5)
]


@pytest.mark.parametrize(("name", "how", "H", "limit"), ROWS, ids=lambda value: str(value))
def test_error(error, record_property, name, how, H, limit):
    reached = error(name, H, **how)
    record_property("error", reached)
    assert reached <= limit


@pytest.mark.parametrize("root_mass", [0.1, 1.0, 10.0, 100.0])
@pytest.mark.parametrize("how", [JACOBI, PREDICT, PECE1, PECE2, RK4], ids=lambda how: "-".join(map(str, how.values())))
def test_any_ratio_of_masses(error, how, root_mass):
    assert error("two_mass", 2e-3, scene_options={"root_mass": root_mass}, **how) <= 1e-2


@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.parametrize("method", ["jacobi", "seidel"])
def test_raw_exchange_of_heavy_followers_diverges(fmu, method, order):
    """It must: this shows that the inertial connections are needed and that divergence is seen."""
    scene = raw_variant(library.scene("two_mass", fmu))
    with pytest.raises(Diverged, match=r"diverged at t = 0\.\d+ s: leader.P.a") as diverged:
        scene.run(method=method, order=order, H=5e-3, values=scenes.fixed("rk4", 5e-3), raw=True)
    assert 0.0 < diverged.value.time < 2.0


def test_raw_loop_is_solved_where_the_host_may(fmu, states):
    """The true force of a heavy follower under `common`: one affine loop per stage, the numbers of the inertial ports."""
    options = {**RK4, "H": 5e-3, "interval": 0.1}
    scene = library.scene("two_mass", fmu)
    raw, inertial = (one.run(**options).values for one in (raw_variant(scene), scene))
    assert np.abs(raw - inertial).max() <= 1e-10
    assert np.abs(raw - states("two_mass", 2.0)).max() <= 1e-4


def test_gap_of_the_four_bar_stays_closed(fmu):
    """alpha = 2 over 30 s: below 2e-7 m at the end (9.5e-8)."""
    result = library.scene("four_bar", fmu).run(**RK4, H=10e-3, alpha=2.0, stop=30.0, interval=0.5)
    assert result.gap[-1] <= 2e-7
    assert result.gap.max() > 0.0


# order, scene, H, until when: later or with a start at which forces jump the leading term of the error is another
ORDERS = {
    "common heun": ({"method": "common", "integrator": "heun"}, 2.0, (10e-3, 5e-3, 2.5e-3)),
    "common rk4": (RK4, 4.0, (20e-3, 10e-3, 5e-3)),
    "cs predict order 0": ({**PREDICT, "order": 0}, 1.0, (5e-3, 2.5e-3, 1.25e-3)),
    "cs predict order 1": (PREDICT, 2.0, (5e-3, 2.5e-3, 1.25e-3)),
    "cs predict order 2": ({**PREDICT, "order": 2}, 3.0, (5e-3, 2.5e-3, 1.25e-3)),
    "cs pece k = 1": (PECE1, 3.0, (10e-3, 5e-3, 2.5e-3)),
    "cs pece k = 2": (PECE2, 4.0, (10e-3, 5e-3, 2.5e-3)),
    "jacobi order 0": ({**JACOBI, "order": 0}, 1.0, (5e-3, 2.5e-3, 1.25e-3)),
    "jacobi order 1": (JACOBI, 2.0, (5e-3, 2.5e-3, 1.25e-3)),
    "jacobi order 2": ({**JACOBI, "order": 2}, 3.0, (5e-3, 2.5e-3, 1.25e-3)),
}


@pytest.mark.parametrize("row", ORDERS)
def test_order_is_the_promised_one(error, row):
    """Slope of the error over two halvings of H, in the first second: later the leading terms of the error change sign
    and pass zero, so that slopes of single halvings run from 3.3 to 5.6 for order 4."""
    how, order, steps = ORDERS[row]
    errors = [error("double_pendulum", H, stop=1.0, **how) for H in steps]
    assert fitted_order([1.0 / H for H in steps], errors) == pytest.approx(order, abs=0.2), errors


@pytest.mark.parametrize("integrator", ["dopri5", "dop853"])
def test_adaptive_integrators_meet_their_tolerance(error, integrator):
    """Ten times smaller tolerance, about ten times smaller error; the end of an unstable motion is no multiple of rtol."""
    errors = [
        error("double_pendulum", 0.1, method="common", integrator=integrator, rtol=rtol, atol=rtol)
        for rtol in (1e-6, 1e-9)
    ]
    assert errors[1] <= 1e-6 and errors[1] < 1e-2 * errors[0], errors


@pytest.mark.parametrize("inner", [scenes.fixed("rk4", 5e-3), scenes.adaptive("dopri5", 1e-9)], ids=["rk4", "dopri5"])
def test_step_size_follows_the_error(fmu, states, inner):
    """cs pece with error control: 100 times smaller tolerance, more steps, and an error smaller by nearly as much. (The
    pendulum turns at up to 12 rad/s and multiplies what is left of each step.) With fixed inner steps every new H has the
    components look at their eigenvalues, at states where two of them are equal to rounding among others."""
    scene = library.scene("double_pendulum", fmu)
    runs = [
        scene.run(method="cs-pece", order=2, rtol=tol, atol=tol, interval=0.1, values=inner)
        for tol in (1e-4, 1e-6)
    ]
    errors = [np.abs(run.values - states("double_pendulum", 2.0)).max() for run in runs]
    assert errors[1] <= errors[0] / 30.0 and errors[1] <= 1e-3, errors
    assert runs[0].counts["steps"] < runs[1].counts["steps"]
    assert runs[0].counts["rejected"] > 0


@pytest.mark.parametrize(
    ("how", "limit"), [(JACOBI, 30e-3), (PECE1, 120e-3), (RK4, 120e-3)], ids=["jacobi", "pece", "rk4"]
)
def test_cpu_time_of_the_loop(fmu, how, limit):
    """Double pendulum, 2 s at H = 5 ms, nothing recorded (6, 30, 28 ms with C FMUs): the best of five."""
    scene = library.scene("double_pendulum", fmu)
    inner = {} if how is RK4 else {"values": scenes.fixed("rk4", 5e-3)}
    assert min(scene.run(**how, H=5e-3, record=False, **inner).cpu for _ in range(5)) <= limit
