"""Model Exchange: a foreign integrator on the FMU's derivatives gives the reference solution."""

import csv
import subprocess
import sys
from ctypes import byref

import fmpy
import fmpy.validation
import numpy as np
import pytest
from fmpy import fmi3
from koppel import Reference, Status, scenes
from scipy.integrate import solve_ivp

THETA = "lower.angle.theta"
BAUMGARTE = {"stabilisation.kind": "baumgarte"}
# the road scene's pulse on the resting wheel: two time events
PULSE = {
    "force.amplitude.z": 0.0,
    "force.pulse.amplitude.z": 800.0,
    "force.pulse.start": 0.5,
    "force.pulse.duration": 0.08,
}


class Exchange:
    """An instance for Model Exchange in Continuous-Time Mode, with buffers for states and derivatives."""

    def __init__(self, fmu, values, stop=None):
        self.fmu = fmu
        self.messages = []
        self.model = fmi3.FMU3Model(
            guid=fmu.description.instantiationToken,
            unzipDirectory=str(fmu.folder),
            modelIdentifier=fmu.description.modelExchange.modelIdentifier,
            instanceName="exchange",
        )
        self.model.instantiate(logMessage=lambda _e, status, _c, text: self.messages.append((status, text.decode())))
        self.set(values)
        self.model.enterInitializationMode(startTime=0.0, stopTime=stop)
        self.model.exitInitializationMode()
        self.next_event = self.update()
        self.n = self.model.getNumberOfContinuousStates()
        self.x = (fmi3.fmi3Float64 * self.n)()
        self.x_dot = (fmi3.fmi3Float64 * self.n)()
        self.evaluations = 0

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.model.freeInstance()

    def set(self, values):
        """Values of any type by name."""
        setters = {"Float64": self.model.setFloat64, "Enumeration": self.model.setInt64, "Boolean": self.model.setBoolean}
        setters["Int32"] = self.model.setInt32
        for name, value in values.items():
            variable = self.fmu.variable(name)
            setters[variable.type]([variable.valueReference], [self.fmu.coded(name, value)])

    def get(self, names):
        """Float64 variables by name."""
        return np.array(self.model.getFloat64([self.fmu.variable(name).valueReference for name in names]))

    def update(self):
        """Event iteration, then Continuous-Time Mode; the time of the next event or infinity."""
        again = True
        while again:
            again, terminate, _nominals, self.moved, defined, t = self.model.updateDiscreteStates()
            assert not terminate
        self.model.enterContinuousTimeMode()
        return t if defined else np.inf

    def states(self):
        """All continuous states."""
        self.model.getContinuousStates(self.x, self.n)
        return np.array(self.x)

    def put(self, t, x):
        """Time and states."""
        self.model.setTime(t)
        self.x[:] = x
        self.model.setContinuousStates(self.x, self.n)

    def rates(self, t, x):
        """The right-hand side."""
        self.put(t, x)
        self.model.getContinuousStateDerivatives(self.x_dot, self.n)
        self.evaluations += 1
        return np.array(self.x_dot)

    def call(self, function, *arguments):
        """The C function itself: status and messages."""
        before = len(self.messages)
        status = getattr(self.model.dll, function)(self.model.component, *arguments)
        return Status(status), " ".join(text for _, text in self.messages[before:])


def integrate(exchange, t, names, rtol=1e-10):
    """Samples of `names` at the times `t` by DOP853, stopping at time events."""
    samples = []
    start, x = t[0], exchange.states()
    for point in t:
        while start < point:
            end = min(point, exchange.next_event)
            solved = solve_ivp(exchange.rates, (start, end), x, method="DOP853", rtol=rtol, atol=rtol * 1e-3)
            assert solved.success
            x, start = solved.y[:, -1], end
            exchange.put(start, x)
            asked, terminate = exchange.model.completedIntegratorStep()
            assert not terminate
            if asked or start >= exchange.next_event:
                exchange.model.enterEventMode()
                exchange.next_event = exchange.update()
                x = exchange.states()
        exchange.put(start, x)
        samples.append(exchange.get(names))
    return np.array(samples)


def test_every_derivative_belongs_to_a_state(wishbone):
    description = wishbone.description
    assert description.modelExchange is not None and description.coSimulation is not None
    assert description.modelExchange.needsCompletedIntegratorStep
    assert fmpy.validation.validate_fmu(str(wishbone.path)) == []
    names = [unknown.variable.name for unknown in description.derivatives]
    assert len(names) == 24
    for unknown in description.derivatives:
        state = unknown.variable.derivative
        assert unknown.variable.name == f"der({state.name})"
        assert unknown.dependencies is not None and unknown.dependencies
        per_second = {"rad": "rad/s", "rad/s": "rad/s2", "J": "W", "1": "1/s", None: "1/s"}
        assert unknown.variable.unit == per_second[state.unit], state.name


def test_scipy_on_the_derivatives_follows_the_reference(wishbone):
    """DOP853 with rtol 1e-10; Baumgarte's terms hold the loop: angles 1e-9 rad, forces 1e-6 N."""
    reference = Reference.named("wishbone_paper")
    names = [THETA, "carrier.angle.psi", "upper.angle.theta", "lower.angle_rate.theta", "P.r.z", "A.F.x", "D.F.z"]
    names += ["energy.supplied", "energy.dissipated"]
    with Exchange(wishbone, BAUMGARTE, stop=10.0) as exchange:
        samples = integrate(exchange, reference.t, names)
    for name, column in zip(names, samples.T):
        limit = 1e-6 if ".F." in name else 1e-9
        assert np.abs(column - reference[name]).max() <= limit, name


def test_projection_becomes_baumgarte(wishbone):
    """The default, projection, acts in Co-Simulation only: derivatives are those of baumgarte."""
    x = {}
    for kind in ("projection", "baumgarte", "none"):
        with Exchange(wishbone, {"stabilisation.kind": kind}) as exchange:
            # off the loop, so that Baumgarte's terms act
            x[kind] = exchange.rates(0.0, exchange.states() + 1e-3)
    assert x["projection"].tobytes() == x["baumgarte"].tobytes()
    assert np.abs(x["baumgarte"] - x["none"]).max() > 1e-3


def test_time_events_are_announced(wishbone):
    """The ends of the pulse come as nextEventTime; the run is the one of the own solver."""
    t = np.linspace(0.0, 1.0, 21)
    names = [THETA, "P.r.z", "P.a.z", "energy.supplied"]
    with Exchange(wishbone, {**BAUMGARTE, **PULSE}) as exchange:
        assert exchange.next_event == 0.5
        samples = integrate(exchange, t, names)
        assert exchange.next_event == np.inf
    own = wishbone.run({**BAUMGARTE, **PULSE, **scenes.adaptive("dopri5", 1e-11)}, H=0.05, stop=1.0, outputs=names)
    for name, column in zip(names, samples.T):
        scale = max(1.0, np.abs(own[name]).max())
        assert np.abs(column - own[name]).max() <= 1e-8 * scale, name


def test_quaternion_off_its_norm_is_brought_back_by_an_event(wishbone):
    names = [f"carrier.q[{i}]" for i in range(1, 5)]
    with Exchange(wishbone, {**scenes.SPATIAL, **BAUMGARTE}) as exchange:
        places = [[u.variable.derivative.name for u in wishbone.description.derivatives].index(name) for name in names]
        x = exchange.states()
        before = exchange.rates(0.0, x)
        x[places] *= 1.0 + 1e-6
        # the right-hand side sees the direction only
        turned = np.delete(exchange.rates(0.0, x), places)
        assert np.abs(turned - np.delete(before, places)).max() <= 1e-9 * np.abs(before).max()
        assert exchange.model.completedIntegratorStep() == (True, False)
        exchange.model.enterEventMode()
        exchange.update()
        assert exchange.moved
        assert np.linalg.norm(exchange.get(names)) == pytest.approx(1.0, abs=1e-15)
        assert np.linalg.norm(exchange.states()[places]) == pytest.approx(1.0, abs=1e-15)
        assert exchange.model.completedIntegratorStep() == (False, False)


@pytest.mark.parametrize("setting", [{}, scenes.SPATIAL], ids=["planar", "spatial"])
def test_directional_derivatives_are_the_jacobian(wishbone, setting):
    """d(derivatives)/d(states) by dual numbers against central differences: h^2 and rounding / h."""
    derivatives = [u.variable.valueReference for u in wishbone.description.derivatives]
    states = [u.variable.derivative.valueReference for u in wishbone.description.derivatives]
    with Exchange(wishbone, {**setting, **BAUMGARTE, "P.F.z": 30.0}) as exchange:
        random = np.random.default_rng(5)
        x = exchange.states() + 0.05 * random.standard_normal(exchange.n)
        h = 1e-6
        for i in range(exchange.n):
            exchange.put(0.0, x)
            exact = np.array(exchange.model.getDirectionalDerivative(derivatives, [states[i]], [1.0]))
            step = np.zeros(exchange.n)
            step[i] = h
            difference = (exchange.rates(0.0, x + step) - exchange.rates(0.0, x - step)) / (2.0 * h)
            assert np.abs(exact - difference).max() <= 1e-5 * max(1.0, np.abs(exact).max()), states[i]


def test_fmpy_simulates_with_cvode(wishbone, tmp_path):
    """The command line integrates the states itself; relative tolerance 1e-8 of CVode, checked by the reference."""
    out = tmp_path / "result.csv"
    command = [sys.executable, "-m", "fmpy", "simulate", wishbone.path, "--interface-type", "ModelExchange"]
    command += ["--stop-time", "10", "--output-interval", "0.05", "--output-variables", THETA, "--relative-tolerance", "1e-8"]
    command += ["--output-file", out]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    with out.open(encoding="utf-8", newline="") as file:
        _, *rows = csv.reader(file)
    samples = np.array(rows, dtype=float)
    reference = Reference.named("wishbone_paper")
    assert samples[:, 0] == pytest.approx(reference.t, abs=1e-9)
    assert np.abs(samples[:, 1] - reference[THETA]).max() <= 1e-6


def test_calls_of_the_other_interface_are_refused(wishbone):
    with Exchange(wishbone, {}) as exchange:
        flags = [byref(fmi3.fmi3Boolean()) for _ in range(3)]
        status, text = exchange.call("fmi3DoStep", 0.0, 0.1, True, *flags, byref(fmi3.fmi3Float64()))
        assert status == Status.ERROR and "Co-Simulation" in text, text
        status, text = exchange.call("fmi3EnterStepMode")
        assert status == Status.ERROR and "eventModeUsed = true" in text, text
        exchange.x[2] = np.nan
        status, text = exchange.call("fmi3SetContinuousStates", exchange.x, exchange.n)
        assert status == Status.DISCARD and "angle_rate" in text, text
        status, text = exchange.call("fmi3SetContinuousStates", exchange.x, exchange.n - 1)
        assert status == Status.ERROR and "24" in text, text
        status, text = exchange.call("fmi3SetTime", float("inf"))
        assert status == Status.ERROR and "time" in text, text
    with wishbone.instantiate() as instance:
        instance.initialise({})
        for function in ("fmi3EnterContinuousTimeMode", "fmi3EnterEventMode", "fmi3EnterStepMode"):
            outcome = instance.call(function)
            assert outcome.status == Status.ERROR and "Co-Simulation" in outcome.text, outcome.text
