"""The compiled loader and the fmpy loop run the same FMU; the loader's times are the FMU's."""

import pytest
from koppel import LoaderError, Reference, scenes, work_precision

THETA = "lower.angle.theta"


@pytest.mark.parametrize(
    "setting",
    [
        scenes.fixed("heun", 0.05),
        scenes.fixed("rk4", 0.01),
        scenes.adaptive("dopri5", 1e-8),
        {**scenes.SPATIAL, **scenes.adaptive("dopri5", 1e-6)},
        # values that need all 17 digits on their way through JSON
        {**scenes.adaptive("dopri5", 1e-8), "solver.atol": 1.0000000000000001e-11, "carrier.mass": 25.000000000000004},
    ],
    ids=["heun", "rk4", "dopri5", "spatial", "digits"],
)
def test_loader_and_fmpy_give_the_same_samples(wishbone, loader, setting):
    outputs = [THETA, "P.r.z", "A.F.x", "energy.supplied", "loop.gap"]
    timing = loader.run(wishbone, setting, H=0.05, stop=2.0, outputs=outputs, repeat=1, min_time=0.0)
    result = wishbone.run(setting, H=0.05, stop=2.0, outputs=outputs)
    assert timing.steps == 40
    assert timing.counts == result.counts
    # the same calls with the same numbers: the same bits
    assert timing.samples.t.tobytes() == result.t.tobytes()
    assert timing.samples.values.tobytes() == result.values.tobytes()


def test_loader_reports_what_the_fmu_refuses(wishbone, loader):
    with pytest.raises(LoaderError, match="carrier.mass"):
        loader.run(wishbone, {"carrier.mass": -1.0}, H=0.05, stop=1.0)
    with pytest.raises(LoaderError, match="radau5"):
        loader.run(wishbone, {**scenes.bushing(1e8, 1e4), **scenes.fixed("rk4", 0.05)}, H=0.05, stop=1.0)


def test_loader_counts_the_work_of_the_paper_run(wishbone, loader):
    """200 steps and 400 evaluations in 10 s with Heun at 0.05 s; times are reported, they decide nothing."""
    timing = loader.run(wishbone, scenes.fixed("heun", 0.05), H=0.05, stop=10.0, repeat=3, min_time=0.02)
    assert (timing.steps, timing.counts["solver.steps"], timing.counts["solver.rhs_evaluations"]) == (200, 200, 400)
    assert 0.0 < timing.cpu_min <= timing.cpu_median
    assert 0.0 < timing.wall_min <= timing.wall_median


def test_one_point_of_the_study(wishbone, loader, tmp_path):
    """A row of work_precision.csv end to end, with little repetition."""
    reference = Reference.named("wishbone_paper")
    setting = work_precision.Setting("rk4", step=0.01)
    point = work_precision.run_point(wishbone, loader, reference, setting, repeat=1, min_time=0.0)
    assert point.theta_error <= 5e-8
    assert point.theta_error_relative == pytest.approx(point.theta_error / 7.6737237662454355e-3)
    assert (point.do_steps, point.steps) == (200, 1000)
    assert point.cpu > 0.0 and point.cpu_fmpy > point.cpu
    assert point.real_time_factor == pytest.approx(10.0 / point.cpu)
    path = tmp_path / "work_precision.csv"
    work_precision.write_csv([point], path)
    header, row = path.read_text(encoding="utf-8").splitlines()
    assert header.split(",")[:3] == ["scene", "method", "H"] and row.startswith("double_wishbone,rk4,0.05,0.01,,")
