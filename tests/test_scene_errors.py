"""Scenes that are not right are refused with what is wrong and what would be right."""

import pytest
from koppel import library
from koppel.fmu import FmuError
from koppel.scene import Scene, SceneError


@pytest.fixture
def scene(fmu):
    """Two rods, a load and a strut, nothing connected."""
    scene = Scene("scene", fmu)
    scene.add("upper", "link2")
    scene.add("lower", "link2")
    scene.add("carrier", "link3", **{"force.kind": "input"})
    for name in ("load1", "load2", "load3"):
        scene.add(name, "load")
    scene.add("scalar", "primary_oscillator")
    return scene


BAD = {
    "component": (lambda s: s.connect("uper.B", "lower.A"), r"no component 'uper'; near: upper"),
    "port": (lambda s: s.connect("upper.C", "lower.A"), r"upper: link2 has no port 'C'; near: A, B"),
    "variable": (
        lambda s: s.record("upper.angle.teta"),
        r"upper \(link2\) has no variable 'angle.teta'; near: angle.theta",
    ),
    "value": (lambda s: s.set("upper", **{"lenght": 1.0}), r"no variable 'lenght'; near: length"),
    "no component": (lambda s: s.record("theta"), r"'theta': a component and, after a point, its port or variable"),
    "again": (lambda s: s.add("upper", "link2"), r"component upper exists already"),
    "name": (lambda s: s.add("a.b", "link2"), r"'a.b' cannot name a component"),
    "leaders": (
        lambda s: s.connect("upper.B", "lower.B"),
        r"upper.B and lower.B are both leaders: close them by a joint",
    ),
    "followers": (lambda s: s.connect("upper.A", "lower.A"), r"both followers: each needs a leader"),
    "scalar": (lambda s: s.connect("scalar.P", "lower.A"), r"a scalar port cannot be connected to a spatial one"),
    "factor": (lambda s: s.connect("upper.B", "lower.A", factor=-1.0), r"factor \(-1.0\) is for raw connections"),
    "joint": (lambda s: s.close("upper.B", "lower.A"), r"lower.A is a follower; a closing joint joins two leaders"),
    "slot": (lambda s: s.connect("upper.B", "load1.A", slot=3), r"link2.B has no slot 3"),
    "unit": (
        lambda s: s.connect_signal("upper.B.r.x", "lower.A.v.x"),
        r"upper.B.r.x -> lower.A.v.x: unit m does not fit m/s",
    ),
    "input": (
        lambda s: s.connect_signal("upper.A.r.x", "lower.A.r.x"),
        r"needs an output and an input, got input and input",
    ),
    "interval": (lambda s: s.record(interval=0.0), r"interval = 0.0: must be above 0"),
    "method": (lambda s: s.configure(method="euler"), r"no method 'euler'; offered: common, cs-predict"),
    "integrator": (lambda s: s.configure(integrator="rk5"), r"no integrator 'rk5'; offered: heun, rk4, dopri5, dop853"),
    "order": (lambda s: s.configure(order=3), r"order = 3: allowed are 0, 1 and 2"),
    "alpha": (lambda s: s.configure(alpha=-1.0), r"alpha = -1.0: must not be below 0"),
    "step": (lambda s: s.configure(step=0.0), r"step = 0.0: must be above 0"),
}


@pytest.mark.parametrize("case", BAD)
def test_refusal(scene, case):
    do, message = BAD[case]
    before = (len(scene.connections), len(scene.joints), list(scene.components))
    with pytest.raises(SceneError, match=message):
        do(scene)
    assert (len(scene.connections), len(scene.joints), list(scene.components)) == before


def test_missing_fmu(fmu):
    with Scene("scene") as scene, pytest.raises(SceneError, match=r"no FMU link4.fmu in .*; near: link"):
        scene.add("one", "link4")


def test_an_input_has_one_source(scene):
    scene.connect("upper.B", "lower.A")
    with pytest.raises(SceneError, match=r"the input has a source already, upper.B.r.x"):
        scene.connect("carrier.C", "lower.A")
    with pytest.raises(SceneError, match=r"has a source already"):
        scene.connect("upper.B", "load1.A", slot=1)


def test_slots_are_filled_in_order_until_none_is_left(scene):
    scene.connect("carrier.P", "load1.A")
    scene.connect("carrier.P", "load2.A")
    targets = {c.target[1] for c in scene.connections if c.target[0] == "carrier"}
    assert {"P.F.x", "P.slot[2].F.x", "P.M.xx", "P.slot[2].M.xx"} <= targets
    with pytest.raises(SceneError, match=r"carrier.P: all 2 slots are taken"):
        scene.connect("carrier.P", "load3.A")


RUNS = {
    "no step": ({"integrator": "rk4"}, r"rk4 needs a step"),
    "no H": ({"method": "jacobi"}, r"jacobi needs a communication step H"),
    "no corrector": ({"method": "cs-predict"}, r"cs-predict needs a communication step H"),
    "H": ({"method": "cs-predict", "H": 0.03}, r"H = 0.03 s does not divide the distance of the samples, 0.01 s"),
    "interval": ({"interval": 0.3, "H": 0.1, "method": "jacobi"}, r"interval = 0.3 s does not divide 2 s"),
    "stop": ({"stop": 0.0}, r"stop = 0.0: must be after start"),
    "k": ({"method": "cs-pece", "order": 0, "H": 0.01}, r"cs-pece has k = 1 or 2"),
}


@pytest.mark.parametrize("case", RUNS)
def test_refused_run(fmu, case):
    options, message = RUNS[case]
    with pytest.raises(SceneError, match=message):
        library.scene("double_pendulum", fmu).run(**options)


def test_plain_exchange_refuses_heavy_raw_connections_and_joints(fmu):
    scene = Scene("raw", fmu)
    scene.add("upper", "link2")
    scene.add("lower", "link2", **{"A.r.x": 0.4})
    scene.connect("upper.B", "lower.A", raw=True)
    with pytest.raises(SceneError, match=r"raw connection of lower.A to upper: the follower has inertia \(M\)"):
        scene.run(method="jacobi", H=1e-3, stop=0.2)
    with pytest.raises(SceneError, match=r"jacobi and seidel cannot solve closing joints"):
        library.scene("four_bar", fmu).run(method="seidel", H=1e-3)


def test_massless_followers_may_be_raw(fmu):
    """A load has no inertia: its true force is its bias force, to the bit."""
    runs = []
    for raw in (False, True):
        scene = Scene("loaded", fmu)
        scene.add("rod", "link2")
        scene.add("load", "load", **{"force.amplitude.z": 10.0, "force.omega.z": 10.0})
        scene.connect("rod.B", "load.A", raw=raw)
        scene.record("rod.angle.theta", interval=0.01)
        runs.append([scene.run(method=m, H=1e-3, integrator="rk4", stop=0.2).values for m in ("jacobi", "common")])
    assert all((one == two).all() for one, two in zip(*runs))


def without(monkeypatch, *missing):
    """FMUs that do not have these capabilities."""
    from koppel import Fmu

    has = Fmu.capability
    monkeypatch.setattr(Fmu, "capability", lambda self, name: name not in missing and has(self, name))


def test_pece_needs_saved_states(fmu, monkeypatch):
    without(monkeypatch, "canGetAndSetFMUState")
    scene = library.scene("double_pendulum", fmu)
    with pytest.raises(
        SceneError, match=r"upper \(link2.fmu\) cannot save its state: use cs-predict, jacobi or seidel"
    ):
        scene.run(method="cs-pece", H=5e-3)
    scene.run(method="cs-predict", H=5e-3, stop=0.1)


def test_neither_event_mode_nor_derivatives(fmu, monkeypatch):
    without(monkeypatch, "hasEventMode", "providesDirectionalDerivatives")
    with pytest.raises(
        SceneError, match=r"has neither Event Mode nor directional derivatives: use method jacobi or seidel"
    ):
        library.scene("double_pendulum", fmu).run(method="cs-predict", H=5e-3)


def test_what_the_fmu_refuses_is_passed_on(fmu):
    scene = library.scene("double_pendulum", fmu)
    scene.set("upper", mass=-1.0)
    with pytest.raises(FmuError, match=r"mass"):
        scene.run(integrator="rk4", step=0.01)


def test_bias_force_of_a_heavy_follower_alone_is_refused(fmu):
    """A leader without a slot for inertia takes massless followers only; here the inertia is left out by hand."""
    scene = library.scene("two_mass", fmu)
    plain = Scene("plain", fmu)
    for component in scene.components.values():
        plain.add(component.name, component.fmu, **component.values)
    plain.connect_all([c for c in scene.connections if not c.target[1].endswith(".M")])
    with pytest.raises(SceneError, match=r"follower.A.F0 is passed on without the inertia behind it, A.M = 3 kg"):
        plain.run(integrator="rk4", step=0.01, stop=0.1, interval=0.1)
    plain.set("follower", **{"root.mass": 0.0})
    plain.run(integrator="rk4", step=0.01, stop=0.1, interval=0.1)


def test_common_needs_model_exchange(fmu, monkeypatch):
    monkeypatch.setattr(fmu("link2").description, "modelExchange", None)
    scene = library.scene("double_pendulum", fmu)
    with pytest.raises(SceneError, match=r"upper \(link2.fmu\) has no Model Exchange"):
        scene.run(integrator="rk4", step=0.01)
    scene.run(method="jacobi", H=0.01, stop=0.1)


def test_stabilisation_that_is_too_fast_is_mentioned(fmu):
    scene = library.scene("four_bar", fmu)
    run = lambda alpha: scene.run(integrator="rk4", step=0.015, stop=0.03, alpha=alpha).messages
    assert run(2.0) == []
    (message,) = run(100.0)
    assert "alpha H = 1.5 is above 1" in message.text


def test_H_of_a_run_counts_before_the_step_of_the_scene(fmu):
    scene = library.scene("double_pendulum", fmu)
    scene.configure(integrator="rk4", step=0.01)
    assert scene.run(record=False).counts["steps"] == 200
    assert scene.run(record=False, H=0.005).counts["steps"] == 400
    assert scene.run(record=False, step=0.0025).counts["steps"] == 800
