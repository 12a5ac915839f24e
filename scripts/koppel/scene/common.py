"""Method `common`: all states in one vector, one integrator, Model Exchange.

Right-hand side: set states, sweep (with closing forces), get derivatives. Time events end a step exactly, state events
are located on the indicators; in Event Mode all components are swept and updated until none asks for more.
"""

from collections.abc import Callable

import numpy as np

from ..fmu import Equations
from .errors import Diverged
from .integrators import FIXED, Adaptive, Advance, FixedStep
from .network import Network
from .sampling import points_between
from .stiff import Stiff

#: State events are located to this part of max(|t|, step).
EVENT_TIME = 1e-13


class Common:
    """The method on a network of `Equations`."""

    def __init__(self, network: Network, integrator: str, step: float | None, rtol: float, atol: float):
        self._network = network
        self._instances: list[Equations] = list(network.instances.values())
        ends = np.cumsum([0] + [instance.nx for instance in self._instances])
        self._parts = [slice(a, b) for a, b in zip(ends, ends[1:])]
        self._dot = np.empty(ends[-1])
        self._watched = [instance for instance in self._instances if instance.nz]
        self._fixed, self._step = integrator in FIXED, step
        self._make = lambda: _integrator(integrator, step, rtol, atol, self._nominals)
        #: Where the components are: time and states as last placed.
        self._t, self._x = np.nan, np.empty(0)
        self.evaluations = self.steps = self.rejected = 0

    def _nominals(self) -> np.ndarray:
        return np.concatenate([instance.nominals() for instance in self._instances])

    # right-hand side ------------------------------------------------------------------------------------------------
    def place(self, t: float, x: np.ndarray):
        """All components at these states, inputs swept."""
        if t == self._t and np.array_equal(x, self._x):
            return
        new_time = t != self._t
        self._t, self._x = t, np.array(x)
        self._network.time = t
        for instance, part in zip(self._instances, self._parts):
            if new_time:
                instance.set_time(t)
            instance.x[:] = x[part]
            instance.write_states()
        self._network.sweep(discrete=False)

    def _derivatives(self) -> np.ndarray:
        """Derivatives where the components are."""
        self.evaluations += 1
        for instance, part in zip(self._instances, self._parts):
            self._dot[part] = instance.read_derivatives()
        return self._dot.copy()

    def rates(self, t: float, x: np.ndarray) -> np.ndarray:
        """Right-hand side."""
        self.place(t, x)
        return self._derivatives()

    # events ---------------------------------------------------------------------------------------------------------
    def _indicators(self, t: float, x: np.ndarray) -> np.ndarray:
        self.place(t, x)
        return np.concatenate([instance.read_indicators() for instance in self._watched])

    def _first_event(self, t: float, to: Advance) -> tuple[Advance, bool]:
        """The step up to just after the first sign change of an indicator, and whether there is one."""
        same = lambda z: bool(((z > 0.0) == before).all())
        before = self._indicators(t, self.x) > 0.0
        if same(self._indicators(to.t, to.x)):
            return to, False
        a, b, state = t, to.t, to.again or to.between
        while b - a > EVENT_TIME * max(abs(b), to.t - t):
            middle = 0.5 * (a + b)
            if middle in (a, b):
                break
            if same(self._indicators(middle, state(middle))):
                a = middle
            else:
                b = middle
        return Advance(b, state(b), to.between, to.rejected), True

    def _settle(self, sweep_first: bool = True) -> float:
        """Event Mode -> Continuous-Time Mode; time of the next event. Restarts where something has changed."""
        network = self._network
        x, u = self.x, network.u.copy()
        next_event, _ = network.settle(sweep_first)
        if x is not None:
            network.sweep()  # with what the update has changed
        for instance in self._instances:
            instance.go_on()
        self.x = np.concatenate([instance.x for instance in self._instances])
        # in Continuous-Time Mode the components are where they were in Event Mode
        self._t, self._x = network.time, self.x
        if x is None or not (np.array_equal(x, self.x) and np.array_equal(u, network.u)):
            self._integrator.restart()
        return next_event

    # run ------------------------------------------------------------------------------------------------------------
    def start(self, samples: np.ndarray, recorder):
        """Initialization, first events, first sample."""
        if self._fixed:
            for a, b in zip(samples, samples[1:]):
                points_between(a, b, self._step)
        self.x = None
        self._network.initialise(samples[0], samples[-1])
        self._integrator = self._make()
        self._next_event = self._settle()
        for instance in self._instances:
            instance.set_time(samples[0])
        recorder.take()

    def loop(self, samples: np.ndarray, recorder):
        """From the first sample to the last."""
        t, due, stop = samples[0], 1, samples[-1]
        while t < stop:
            self.place(t, self.x)
            k1 = self._derivatives()
            bound = min(self._next_event, samples[due] if self._fixed else stop)
            to = self._integrator.step(self.rates, t, self.x, k1, bound)
            located = False
            if self._watched:
                to, located = self._first_event(t, to)
            if not np.isfinite(to.x).all():
                raise Diverged(to.t, "a state is not finite")
            self.steps += 1
            self.rejected += to.rejected
            while due < len(samples) and samples[due] < to.t:
                self.place(samples[due], to.between(samples[due]))
                recorder.take()
                due += 1
            t, self.x = to.t, to.x
            self.place(t, self.x)
            asked = [instance.completed_step() for instance in self._instances]
            if any(asked) or located or t >= self._next_event:
                self._network.each(Equations.enter_event_mode)
                self._next_event = self._settle()
            if due < len(samples) and samples[due] <= t:
                recorder.take()
                due += 1


def _integrator(name: str, step: float | None, rtol: float, atol: float, nominals: Callable[[], np.ndarray]):
    """The integrator of that name."""
    if name in FIXED:
        return FixedStep(name, step)
    if name in Stiff.METHODS:
        return Stiff(name, rtol, atol, nominals())
    return Adaptive(name, rtol, atol * nominals())
