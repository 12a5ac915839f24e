"""The haptic interface through the packed FMUs against `tests/reference/effi` (programs written separately)."""

import json

import numpy as np
import pytest
from koppel import Reference, haptics, library, paths
from koppel.scene import Scene, SceneError

FOLDER = paths.ROOT / "tests" / "reference" / "effi"
INDEX = json.loads((FOLDER / "index.json").read_text())
STATES = ["plant.H.r.x", "plant.H.r.z", "plant.H.v.x", "plant.H.v.z"]
POSITIONS = STATES[:2]


def errors(result, name, variables):
    """Largest error of each variable relative to its peak, at the samples of the reference."""
    reference = Reference.named(name, "effi")
    rows = np.searchsorted(result.t, reference.t - 1e-9)
    assert np.abs(result.t[rows] - reference.t).max() < 1e-9
    of = lambda n: np.abs(result[n][rows] - reference[n]).max() / np.abs(reference[n]).max()
    return {n: of(n) for n in variables}


# loops ----------------------------------------------------------------------------------------------------------------
def wall(fmu, H=1e-3, stop=0.6, order=1, **values):
    scene = library.scene("haptic_wall", fmu, **values)
    return scene.run(method="cs-predict", order=order, H=H, stop=stop, interval=max(H, 1e-3))


def test_wall_loop_follows_the_reference(fmu):
    """Arm and plant exchange motion and force every millisecond, inputs hold or go on along a line: 1e-2."""
    for order in (0, 1):
        worst = errors(wall(fmu, order=order), "loop_wall", STATES)
        assert max(worst.values()) <= 1e-2, (order, worst)


def test_wall_loop_has_order_one_with_held_inputs(fmu):
    """The controller ticks every millisecond whatever arm and plant do: the error is that of their exchange."""
    coarse, fine = (errors(wall(fmu, H=H, order=0), "loop_wall", STATES) for H in (1e-3, 0.25e-3))
    for name in STATES:
        assert 3.2 < coarse[name] / fine[name] < 5.0, (name, coarse, fine)


def first(result, name, level):
    return float(result.t[np.abs(result[name]) >= level][0])


def test_stiff_wall_ends_in_saturation_as_the_reference(fmu):
    """1e7 N/m is beyond the limit: the instability is shown, bounded by saturation, from the same contact on."""
    reference = Reference.named("loop_wall_stiff", "effi")
    result = wall(fmu, stop=0.2, stiffness=1e7)
    command = "controller.axis[1].force_command"
    # rows of the reference are 2 ms apart
    assert abs(first(result, "wall.A.F.z", 1e-9) - first(reference, "wall.A.F.z", 1e-9)) <= 2e-3 + 1e-3
    assert abs(first(result, command, 2499.0) - first(reference, command, 2499.0)) <= 5e-3
    assert np.abs(result[command]).max() <= 2500.0
    assert all(np.abs(result[name]).max() < 1.0 for name in STATES)


def test_flap_loop_follows_the_reference(fmu):
    """Through saturation and into the flap's end stop: positions to 5e-2 of their peaks at 1 ms."""
    scene = library.scene("haptic_mechanism", fmu, **{"gas.force": 125.0})
    for name in ("controller", "plant"):
        scene.set(name, **{"start.balanced": False})
    scene.set("arm", **{"grip.stiffness": 3000.0, "intent.duration": 0.5})
    case = INDEX["loop_flap"]["parameters"]
    arm = scene.component("arm")
    ends = [[arm.value(f"intent.{end}.r.{i}") for i in "xz"] for end in ("start", "end")]
    assert np.allclose(ends, case["intent"][:2], rtol=0.0, atol=1e-12)
    result = scene.run(method="cs-predict", order=1, H=1e-3, stop=0.7, interval=5e-3)
    worst = errors(result, "loop_flap", [*POSITIONS, "mechanism.phi"])
    assert max(worst.values()) <= 5e-2, worst
    assert np.abs(result["controller.axis[1].force_command"]).max() == 2500.0


def test_a_sampled_leader_takes_massless_followers_only(fmu):
    with Scene("refused", fmu) as scene:
        scene.add("controller", "effi_controller")
        scene.add("rod", "link2")
        with pytest.raises(SceneError, match=r"effi_controller.V takes no inertia \(M\), but link2.A has some"):
            scene.connect("controller.V", "rod.A")


def test_wall_rendered_late_or_slowly_is_right(fmu):
    """Ticks of 10 ms, or a queue of ten: far below the limit of the wall (30 and 42 kN/m), the motion does not depend
    on how arm and plant exchange: 1e-2 of the peaks between 1 ms and 0.25 ms; the wall holds."""
    for settings in ({"T": 1e-2}, {"delay": 10}):
        runs = []
        for H in (1e-3, 0.25e-3):
            scene = library.scene("haptic_wall", fmu, stiffness=1e4)
            scene.set("controller", **settings)
            runs.append(scene.run(method="cs-predict", H=H, stop=0.4, interval=1e-2))
        for name in STATES:
            coarse, fine = (run[name] for run in runs)
            assert np.abs(coarse - fine).max() <= 1e-2 * np.abs(fine).max(), (settings, name)
        assert fine.min() < 0.0 and runs[1]["plant.H.r.z"].min() > 0.5


# what it is for -------------------------------------------------------------------------------------------------------
def test_the_flap_is_felt_as_it_is(fmu):
    """Opening movement of 2 s: it snaps into the detent; commands below 0.8 of the peak force, no end stop is met."""
    result = library.scene("haptic_mechanism", fmu).run()
    assert 0.32 < result["mechanism.phi"].max() < 0.35
    for i in (1, 2):
        assert np.abs(result[f"controller.axis[{i}].force_command"]).max() < 0.8 * 2500.0
        assert 0.5 < result[f"plant.axis[{i}].position"].min() and result[f"plant.axis[{i}].position"].max() < 0.9


def test_rendered_is_like_direct(fmu):
    """The drawer there and back: within 2 mm and 1 % of the largest force of the direct grip; the closed movement costs
    the work of the drawer's friction, whether it is rendered or not."""
    found, felt, direct = haptics.evaluate(fmu, "drawer")
    assert found.command < 0.8 and found.margin > 0.0
    assert found.position_max < 2e-3 and found.force_rms < 0.01 * np.linalg.norm(direct.F, axis=0).max()
    assert felt.work == pytest.approx(direct.work, rel=0.02) and direct.work == pytest.approx(found.port, rel=0.02)


@pytest.mark.parametrize("share", [0.0, 0.5])
def test_wall_on_the_device_has_the_exact_limit(fmu, share):
    """The device on the wall, 2 % around the limit from eigenvalues of mass, damping, current loop and one tick."""
    B = share * haptics.vertical(haptics.SURFACE).b
    limit = haptics.boundary(haptics.vertical(haptics.SURFACE), B)
    assert not haptics.grows(0.98 * limit, B, fmu) and haptics.grows(1.02 * limit, B, fmu)
