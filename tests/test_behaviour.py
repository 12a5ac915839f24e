"""What a host may do with an FMU besides stepping it: reset, copies, saved states, other step sizes, tunables."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from koppel import FmuError, Reference, Status, scenes
from koppel.fmu import grid
from oracle.wishbone import Wishbone

THETA = "lower.angle.theta"
SETTINGS = {
    "heun": scenes.fixed("heun", 0.05),
    "rk4": scenes.fixed("rk4", 0.01),
    "dopri5": scenes.adaptive("dopri5", 1e-6),
    "baumgarte": {**scenes.fixed("rk4", 0.01), "stabilisation.kind": "baumgarte"},
    "road": {**scenes.ROAD, **scenes.adaptive("dopri5", 1e-7)},
    "spatial": {**scenes.SPATIAL, **scenes.adaptive("dopri5", 1e-6)},
    "bushing": {**scenes.bushing(1e8, 1e4), **scenes.fixed("rk4", 1e-4)},
}
each_setting = pytest.mark.parametrize("setting", SETTINGS)


def everything(fmu):
    """All outputs."""
    return fmu.names("output")


def march(instance, t, names):
    """Step along t; samples of `names` after each step."""
    block = instance.block(names)
    samples = []
    for start, end in zip(t, t[1:]):
        instance.step(start, end - start)
        samples.append(block.read().copy())
    return np.array(samples)


def same(a, b):
    """Equal to the last bit."""
    return a.tobytes() == b.tobytes()


@each_setting
def test_reset_is_a_fresh_instance(wishbone, setting):
    names, t = everything(wishbone), grid(0.0, 1.0, 0.05)
    fresh = wishbone.run(SETTINGS[setting], H=0.05, stop=1.0, outputs=names)
    with wishbone.instantiate() as instance:
        # another life before: other parameters, inputs, step sizes, ended in the middle of a run
        instance.initialise(
            {"carrier.mass": 40.0, "solver.method": "rk4", "strut.c": 10.0, "P.F.z": 77.0, "gravity.z": -3.0}
        )
        march(instance, [0.0, 0.1, 0.37], names)
        instance.reset()
        instance.initialise(SETTINGS[setting], stop=1.0)
        again = instance.run(t, names)
    assert same(fresh.values, again.values)
    assert fresh.counts == again.counts


def test_reset_restores_every_start_value(wishbone):
    floats = [
        v.name
        for v in wishbone.description.modelVariables
        if v.type == "Float64" and v.causality in ("parameter", "input")
    ]
    with wishbone.instantiate() as instance:
        instance.enter_initialisation()
        before = instance.get_all(floats)
        instance.set({"carrier.mass": 40.0, "solver.method": "heun", "use.energy": False, "P.F.x": 5.0})
        assert instance.get_all(floats) != before
        instance.reset()
        instance.enter_initialisation()
        assert instance.get_all(floats) == before
        assert before == {name: float(wishbone.variable(name).start) for name in floats}
        assert instance.get("solver.method") == 2
        assert instance.get("use.energy") is True


@each_setting
def test_interleaved_instances_do_not_touch_each_other(wishbone, setting):
    names, t = everything(wishbone), grid(0.0, 0.5, 0.05)
    other = {**scenes.fixed("rk4", 0.005), "carrier.mass": 40.0, "strut.c": 300.0}
    alone = [wishbone.run(values, H=0.05, stop=0.5, outputs=names).values[1:] for values in (SETTINGS[setting], other)]
    with wishbone.instantiate() as first, wishbone.instantiate() as second:
        first.initialise(SETTINGS[setting], stop=0.5)
        second.initialise(other, stop=0.5)
        samples = ([], [])
        for start, end in zip(t, t[1:]):
            for instance, kept in zip((first, second), samples):
                kept.append(march(instance, [start, end], names)[0])
    assert same(np.array(samples[0]), alone[0])
    assert same(np.array(samples[1]), alone[1])


def test_instances_in_threads_are_independent(wishbone):
    names = everything(wishbone)
    values = [{**scenes.fixed("rk4", 1e-3), "carrier.mass": 20.0 + i} for i in range(4)]
    run = lambda start_values: wishbone.run(start_values, H=0.5, stop=5.0, outputs=names).values
    one_by_one = [run(start_values) for start_values in values]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(run, values))
    assert all(same(a, b) for a, b in zip(one_by_one, together))


@each_setting
def test_restored_state_repeats_the_run(wishbone, setting):
    names = everything(wishbone)
    with wishbone.instantiate() as instance:
        instance.initialise(SETTINGS[setting])
        march(instance, grid(0.0, 0.5, 0.05), names)
        saved = instance.save()
        at_save = instance.block(names).read().copy()
        first = march(instance, grid(0.5, 1.0, 0.05), names)
        # what happens after saving must not survive the restore: inputs, tunables, time
        instance.set({"P.F.z": 5.0, "strut.c": 900.0})
        march(instance, [1.0, 1.05, 1.1], names)
        instance.restore(saved)
        assert same(instance.block(names).read().copy(), at_save)
        second = march(instance, grid(0.5, 1.0, 0.05), names)
        assert same(first, second)
        # the state may be used more than once
        instance.restore(saved)
        assert same(first, march(instance, grid(0.5, 1.0, 0.05), names))
        instance.free_state(saved)


# The declared communication step is 0.05 s; x 0.25 to x 16. Limit of RK4 with 1e-3 s: 2e-10 / 2^4 rad, and as much again
# for the inner step, which H / ceil(H / step) makes smaller, never larger.
@pytest.mark.parametrize("H", [0.0125, 0.025, 0.05, 0.1, 0.2, 0.4, 0.8])
def test_communication_step_does_not_change_the_solution(wishbone, H):
    reference = Reference.named("wishbone_paper")
    result = wishbone.run({}, H=H, stop=8.0, outputs=[THETA])
    error = reference.error_of(result)
    assert error.samples == min(round(8.0 / H), 160) + 1
    assert error[THETA].largest <= 2e-10 / 16.0, error.table()


@pytest.mark.parametrize("method", ["heun", "rk4", "dopri5"])
def test_uneven_communication_steps(wishbone, method):
    """Steps with no common divisor, some far below the inner step; at t = 2 s the solution is the reference's."""
    setting = scenes.adaptive("dopri5", 1e-9) if method == "dopri5" else scenes.fixed(method, 1e-3)
    limit = {"heun": 1e-6, "rk4": 2e-10, "dopri5": 1e-9}[method]
    rng = np.random.default_rng(7)
    t = np.unique(np.concatenate([[0.0, 2.0], rng.uniform(0.0, 2.0, 60), [1.0, 1.0 + 1e-12, 1.0 + 1e-7]]))
    with wishbone.instantiate() as instance:
        instance.initialise(setting)
        march(instance, t, [THETA])
        reference = Reference.named("wishbone_paper")
        assert abs(instance.get(THETA) - reference[THETA][reference.t == 2.0][0]) <= limit


def test_inner_steps_divide_the_communication_step(wishbone):
    """n = max(1, ceil(H / step - 1e-9)) equal steps, counted; two evaluations each with Heun, four with RK4."""
    for method, stages in (("heun", 2), ("rk4", 4)):
        for H, step, n in ((0.05, 0.05, 1), (0.05, 0.02, 3), (0.05, 0.1, 1), (0.06, 0.02, 3), (0.1, 0.001, 100)):
            result = wishbone.run(scenes.fixed(method, step), H=H, stop=10 * H, outputs=[])
            assert result.counts["solver.steps"] == 10 * n, (method, H, step)
            assert result.counts["solver.rejected"] == 0
            # beside the stages: at most two more per communication step (projection, outputs)
            assert stages * 10 * n <= result.counts["solver.rhs_evaluations"] <= (stages + 1) * 10 * n + 20


def test_damper_changed_in_a_run_follows_the_oracle(wishbone):
    """strut.c from 1000 to 100 N s/m at t = 1 s, between two steps."""
    before = Wishbone()
    state = list(before.integrate([0.0, 1.0]))[-1][1]
    after = Wishbone(c=100.0, start_angle=state[0], start_rate=state[1]).table([1.0, 1.5, 2.0])
    with wishbone.instantiate() as instance:
        instance.initialise({})
        march(instance, grid(0.0, 1.0, 0.05), [])
        instance.set({"strut.c": 100.0})
        samples = march(instance, [1.0, 1.5, 2.0], [THETA])
    unchanged = wishbone.run({}, H=0.5, stop=2.0, outputs=[THETA])
    assert abs(samples[-1, 0] - unchanged[THETA][-1]) > 1e-3
    assert np.abs(samples[:, 0] - after[1:, 1]).max() <= 2e-10


@pytest.mark.parametrize(("name", "value"), [("strut.k", 3e4), ("strut.preload", 50.0), ("gravity.z", -1.0)])
def test_tunables_act_at_once(wishbone, name, value):
    with wishbone.instantiate() as instance:
        instance.initialise({})
        instance.step(0.0, 0.2)
        instance.set({name: value})
        assert instance.get(name) == value
        instance.step(0.2, 0.2)
        changed = instance.get(THETA)
    assert abs(changed - wishbone.run({}, H=0.2, stop=0.4, outputs=[THETA])[THETA][-1]) > 1e-5


def test_event_mode_and_plain_stepping_give_the_same_numbers(wishbone):
    names, t = everything(wishbone), grid(0.0, 1.0, 0.05)
    plain = wishbone.run(scenes.fixed("rk4", 0.01), H=0.05, stop=1.0, outputs=names).values[1:]
    if not wishbone.capability("hasEventMode"):
        # not offered: no instance, and a message that says why
        with pytest.raises(FmuError, match="(?i)event ?mode"):
            wishbone.instantiate(event_mode=True)
        return
    with wishbone.instantiate(event_mode=True) as instance:
        instance.initialise(scenes.fixed("rk4", 0.01))
        samples = []
        for start, end in zip(t, t[1:]):
            samples.append(march(instance, [start, end], names)[0])
            instance.enter_event_mode()
            instance.enter_step_mode()
    assert same(np.array(samples), plain)


def test_energy_switch_changes_no_motion(wishbone):
    names = [THETA, "lower.angle_rate.theta", "A.F.x", "D.F.z", "P.r.z"]
    for setting in (scenes.fixed("heun", 0.05), scenes.fixed("rk4", 0.01)):
        on = wishbone.run(setting, H=0.05, stop=1.0, outputs=names)
        off = wishbone.run({**setting, "use.energy": False}, H=0.05, stop=1.0, outputs=[*names, "energy.supplied"])
        assert same(on.values, np.ascontiguousarray(off.values[:, :-1]))
        assert not off["energy.supplied"].any()


@pytest.mark.parametrize(
    ("off", "zero"),
    [
        ({"use.damper": False}, {"strut.c": 0.0}),
        ({"use.gravity": False, "gravity.z": -9.80665}, {"gravity.z": 0.0}),
        ({"force.kind": "input"}, {"force.amplitude.z": 0.0}),
    ],
)
def test_a_part_left_out_is_the_part_with_zero_strength(wishbone, off, zero):
    start = {"strut.preload": 30.0}
    names = [THETA, "P.r.z", "A.F.x", "D.F.z"]
    without = wishbone.run({**start, **off}, H=0.05, stop=1.0, outputs=names)
    nothing = wishbone.run({**start, **zero}, H=0.05, stop=1.0, outputs=names)
    assert np.abs(without.values - nothing.values).max() <= 1e-12
    assert (
        np.abs(without[THETA] - wishbone.run(start, H=0.05, stop=1.0, outputs=names)[THETA]).max() > 1e-4
        or "gravity.z" in off
    )


def test_planar_scene_in_spatial_motion_is_the_same(wishbone):
    """All forces in the plane: the spatial model moves as the planar one and nothing leaves the plane."""
    names = [THETA, "upper.angle.theta", "P.r.x", "P.r.z", "A.F.x", "A.F.z", "D.F.x", "D.F.z"]
    setting = scenes.fixed("rk4", 0.01)
    planar = wishbone.run(setting, H=0.05, stop=2.0, outputs=names)
    spatial = wishbone.run(
        {**setting, "scene.motion": "spatial"}, H=0.05, stop=2.0, outputs=[*names, "P.r.y", "carrier.omega.z"]
    )
    # the same mechanism in other coordinates: equal up to RK4's error, which is 3.6e-8 rad at this step
    assert np.abs(planar[THETA] - spatial[THETA]).max() <= 1e-7
    assert np.abs(spatial["P.r.y"]).max() <= 1e-12
    assert np.abs(spatial["carrier.omega.z"]).max() <= 1e-12


def test_time_may_start_anywhere(wishbone):
    """The load is a function of time: a run from t = 2 pi / 10 s sees the same sine as one from 0."""
    period = 2.0 * np.pi / 10.0
    zero = wishbone.run({}, H=0.05, stop=1.0, outputs=[THETA])
    later = wishbone.run({}, H=0.05, start=period, stop=period + 1.0, outputs=[THETA])
    assert np.abs(zero[THETA] - later[THETA]).max() <= 1e-12
    other = wishbone.run({}, H=0.05, start=0.1, stop=1.1, outputs=[THETA])
    assert np.abs(zero[THETA] - other[THETA]).max() > 1e-4


def test_pushing_the_wheel_up_lifts_it_and_loads_the_strut(wishbone):
    """Signs: a force up at P lifts it, shortens the strut, and the strut pushes the chassis up."""
    result = wishbone.run(
        {"force.amplitude.z": 0.0, "force.offset.z": 100.0},
        H=0.05,
        stop=3.0,
        outputs=["P.a.z", "P.r.z", "strut.length", "strut.force", "T.F.z"],
    )
    assert result["P.a.z"][0] > 0.0
    assert result["P.r.z"][-1] > 0.12
    assert result["strut.length"][-1] < 0.360025588795974
    assert result["strut.force"][-1] < 0.0, "tension is positive"
    assert result["T.F.z"][-1] > 0.0, "a compressed strut pushes the chassis up"
    # at rest: stiffness at the wheel 4878 N/m (published for these parameters)
    assert (result["P.r.z"][-1] - 0.12) == pytest.approx(100.0 / 4878.0, rel=0.02)
