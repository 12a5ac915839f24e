"""Events in scenes, components without Event Mode, and how plain hosts step."""

import numpy as np
import pytest
from koppel import Fmu, Reference, library, scenes
from koppel.scene import Scene, SceneError
from koppel.scene.common import Common
from koppel.scene.exchange import _leaders_first
from koppel.scene.study import raw_variant

THETA = "lower.angle.theta"
G = 9.81


# state events, on a component written here: no FMU of the project has any -------------------------------------------
class Ball:
    """A ball that falls from 1 m and keeps 0.8 of its speed at the ground; the interface of `Equations`."""

    nx, nz, event_mode = 2, 1, True

    def __init__(self):
        self.x, self.x_dot, self.z = np.array([1.0, 0.0]), np.zeros(2), np.zeros(1)
        self._at = self.x.copy()
        self.bounces = []
        self.time = 0.0

    def nominals(self):
        return np.ones(2)

    def set_time(self, t):
        self.time = t

    def write_states(self):
        self._at = self.x.copy()

    def read_derivatives(self):
        self.x_dot[:] = self._at[1], -G
        return self.x_dot

    def read_indicators(self):
        # on the ground and going up: above it
        self.z[:] = self._at[0] if self._at[1] <= 0.0 else max(self._at[0], 1e-9)
        return self.z

    def completed_step(self):
        return False

    def enter_event_mode(self):
        if self._at[0] <= 0.0 and self._at[1] < 0.0:
            self.bounces.append(self.time)
            self._at = np.array([0.0, -0.8 * self._at[1]])

    def go_on(self):
        self.x[:] = self._at


class OneBall:
    """A network of one ball."""

    def __init__(self):
        self.ball = Ball()
        self.instances, self.time, self.u = {"ball": self.ball}, 0.0, np.zeros(0)

    def initialise(self, _start, _stop):
        pass

    def sweep(self, discrete=True):
        pass

    def settle(self, sweep_first=True):
        return np.inf, True

    def each(self, _do):
        self.ball.enter_event_mode()


class Heights:
    """Samples of the ball."""

    def __init__(self, ball):
        self.ball, self.values = ball, []

    def take(self):
        self.values.append(self.ball._at[0])


def bounce_times(count):
    """Closed form: the first after sqrt(2 h / g), the n-th flight 2 v 0.8^n / g."""
    fall = np.sqrt(2.0 / G)
    return fall + np.cumsum([0.0] + [2.0 * G * fall * 0.8**n / G for n in range(1, count)])


@pytest.mark.parametrize(
    ("integrator", "step", "limit"),
    [
        ("heun", 0.05, 1e-11),
        ("rk4", 0.05, 1e-11),
        ("dopri5", None, 1e-10),
        ("rodas4", None, 1e-10),
        ("radau5", None, 1e-10),
    ],
)
def test_state_events_are_located(integrator, step, limit):
    """Parabolas are exact for every method, so bounces are met to the accuracy of their location."""
    network = OneBall()
    samples = np.linspace(0.0, 2.0, 21)
    method, recorder = Common(network, integrator, step, 1e-9, 1e-9), Heights(network.ball)
    method.start(samples, recorder)
    method.loop(samples, recorder)
    times = bounce_times(20)
    times = times[times < 2.0]
    assert len(network.ball.bounces) == len(times) == 3
    assert np.abs(network.ball.bounces - times).max() <= limit
    heights = [flight(t, times) for t in samples]
    assert np.abs(np.array(recorder.values) - heights).max() <= 1e-9


def flight(t, times):
    """Height of the ball at t."""
    n = int((times <= t).sum())
    if n == 0:
        return 1.0 - 0.5 * G * t * t
    speed, since = np.sqrt(2.0 * G) * 0.8**n, t - times[n - 1]
    return speed * since - 0.5 * G * since * since


# time events --------------------------------------------------------------------------------------------------------
def road(fmu):
    """The half-sine bump of `wishbone_road`, by a load of its own."""
    reference = Reference.named("wishbone_road")
    scene = library.scene("double_wishbone", fmu)
    for name in ("lower", "carrier", "upper"):
        scene.set(name, **{"gravity.z": scenes.GRAVITY})
    scene.set("upper", **{"strut.preload": reference.parameters["parameters"]["spring_preload"]})
    scene.set("load", **{name: value for name, value in scenes.ROAD.items() if name.startswith("force.")})
    return scene, reference


def test_time_events_end_a_step(fmu):
    """Kinks of the force at 0.5 and 0.58 s; samples 0.01 s apart see none of it (dopri5 1e-9: 1e-9 rad)."""
    scene, reference = road(fmu)
    result = scene.run(integrator="dopri5", rtol=1e-9, atol=1e-12, stop=1.5, interval=0.01)
    assert np.ptp(result[THETA]) > 0.01
    assert np.abs(result[THETA] - reference[THETA][:151]).max() <= 1e-9
    # one Event Mode at the start, one at each end of the pulse
    assert result.calls["load"]["fmi3EnterEventMode"] == 2


def test_order_is_kept_over_time_events_between_steps(fmu):
    """The pulse begins and ends inside of steps: each costs one more step, and RK4 keeps its order."""
    scene, _ = road(fmu)
    scene.set("load", **{"force.pulse.start": 0.5033, "force.pulse.duration": 0.0777})
    options = {"stop": 0.8, "interval": 0.01}
    exact = scene.run(integrator="rk4", step=0.000625, **options)[THETA]
    runs = [scene.run(integrator="rk4", step=h, **options) for h in (0.01, 0.005, 0.0025)]
    errors = [np.abs(run[THETA] - exact).max() for run in runs]
    assert errors[0] > 14.0 * errors[1] > 14.0**2 * errors[2], errors
    assert [run.counts["steps"] for run in runs] == [82, 162, 322]


# components without Event Mode --------------------------------------------------------------------------------------
def test_without_event_mode_outputs_follow_by_derivatives(fmu, monkeypatch):
    """Inertial ports are affine in all but M, which changes little in a step: the order of `cs` with Event Mode is kept.
    With raw connections, affine throughout, the numbers are those of Event Mode."""
    has = Fmu.capability
    runs = {}
    for events in (True, False):
        hide = lambda self, name, events=events: (events or name != "hasEventMode") and has(self, name)
        monkeypatch.setattr(Fmu, "capability", hide)
        for H in (5e-3, 2.5e-3):
            scene = library.scene("two_mass", fmu)
            inner = scenes.fixed("rk4", H)
            runs[events, H] = scene.run(method="cs-predict", H=H, values=inner)
    for H in (5e-3, 2.5e-3):
        # the inertia of this scene is constant
        assert np.abs(runs[True, H].values - runs[False, H].values).max() <= 1e-10
        assert runs[False, H].counts["directional"] > 0 and "directional" not in runs[True, H].counts
        assert "fmi3EnterEventMode" not in runs[False, H].calls["leader"]


def test_a_loop_without_directional_derivatives_is_solved_by_differences(fmu, monkeypatch):
    """The loop of the two masses is affine: changes by a unit are as good."""
    scene = raw_variant(library.scene("two_mass", fmu))
    options = {"integrator": "rk4", "H": 5e-3, "stop": 0.5}
    exact = scene.run(**options)
    has = Fmu.capability
    monkeypatch.setattr(
        Fmu, "capability", lambda self, name: name != "providesDirectionalDerivatives" and has(self, name)
    )
    differences = scene.run(**options)
    assert exact.counts["directional"] > 0 and "directional" not in differences.counts
    assert np.abs(differences.values - exact.values).max() <= 1e-10


# plain exchange -----------------------------------------------------------------------------------------------------
def test_seidel_steps_leaders_first(fmu):
    scene = Scene("chain", fmu)
    for name in ("c", "b", "a"):
        scene.add(name, "link2")
    scene.connect("a.B", "b.A")
    scene.connect("b.B", "c.A")
    assert _leaders_first(scene) == ["a", "b", "c"]


def test_seidel_is_closer_than_jacobi(fmu):
    """The follower's motion is interpolated; order 2 as jacobi has with linear inputs."""
    reference = Reference.named("double_pendulum", "coupling")
    scene = library.scene("double_pendulum", fmu)
    run = lambda method, H: reference.error_of(scene.run(method=method, H=H, values=scenes.fixed("rk4", H))).e_max
    errors = {method: [run(method, H) for H in (5e-3, 2.5e-3)] for method in ("jacobi", "seidel")}
    assert errors["seidel"][0] < errors["jacobi"][0]
    assert errors["seidel"][0] / errors["seidel"][1] == pytest.approx(4.0, rel=0.1)


def test_loops_that_are_not_affine_are_reported(fmu):
    """Two rods that hang on each other have no solution to find: motion goes round."""
    scene = Scene("round", fmu)
    for name in ("one", "two"):
        scene.add(name, "link2")
    scene.connect("one.B", "two.A")
    scene.connect("two.B", "one.A")
    with pytest.raises((SceneError, np.linalg.LinAlgError)):
        scene.run(integrator="rk4", step=0.01, stop=0.01, interval=0.01)


@pytest.mark.parametrize("start", [0.5, 0.5003])
def test_a_discontinuity_is_announced(fmu, start):
    """Kinks of the force are communication points, wherever they lie, and components forget there what they knew of their
    inputs (port.reset): cs pece k = 1 keeps order 3 across. With inputs interpolated over the kink it has order 2."""
    scene, _ = road(fmu)
    scene.set("load", **{"force.pulse.start": start})
    options = {"stop": 0.8, "interval": 0.01}
    exact = scene.run(integrator="rk4", step=1e-3, **options)[THETA]
    runs = [scene.run(method="cs-pece", H=H, values=scenes.fixed("rk4", H), **options) for H in (1e-3, 5e-4)]
    errors = [np.abs(run[THETA] - exact).max() for run in runs]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(3.0, abs=0.3), errors
    # a kink between two points is one more
    between = 0 if start == 0.5 else 2
    assert [run.counts["steps"] for run in runs] == [800 + between, 1600 + between]
