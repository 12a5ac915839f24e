"""Method `cs`: every component steps by its own solver; at communication points a sweep in Event Mode makes inputs fit.

P   port.inputs = extrapolate; doStep
E   Event Mode; sweep (with closing forces)
C   restore; port.inputs = endpoint, port.order = k + 1; the new inputs; doStep; E again    (pece only)

Without H that of pece follows the error (`StepControl`). Components without Event Mode answer sweeps by their linear
response.
"""

import math

import numpy as np

from .errors import SceneError
from .network import Network
from .ports import is_motion
from .sampling import points_between
from .stepping import Bound, Resets, Saved, Treatment

#: Error control: the estimate is this part of the difference of predictor and corrector.
ESTIMATE = 1.0 / 3.0
#: First and least step of error control, relative to the length of the run.
FIRST_STEP, LEAST_STEP = 1e-3, 1e-10
#: Points of time are the same if they differ by less than this part of a step.
SAME_TIME = 1e-9


class StepControl:
    """The communication step that follows the error.

    first     1e-3 of the run
    step      to the next sample, time event or stop if H reaches it; half the way if two steps are left; else H
    after it  H <- h min(2, max(0.2, 0.9 error^(-1/(k + 2)))), and not shorter than before where h was cut by such a point
              and the error lets it grow; beyond an error of 1 the step is repeated
    least     1e-10 of the run
    """

    def __init__(self, length: float, order: int):
        self.H, self._least, self._exponent = FIRST_STEP * length, LEAST_STEP * length, -1.0 / (order + 2)

    def step(self, remaining: float) -> float:
        """Length of the next step that leaves no tiny rest."""
        # steps that are doubled and halved meet the limit but for rounding
        if self.H >= remaining * (1.0 - SAME_TIME):
            return remaining
        return 0.5 * remaining if 2.0 * self.H > remaining else self.H

    def judge(self, h: float, error: float) -> bool:
        """Takes note of a step with its error in units of the tolerance; whether it counts."""
        # an error that is no number shortens the step
        error = math.inf if math.isnan(error) else max(error, 1e-10)
        factor = min(2.0, max(0.2, 0.9 * error**self._exponent))
        accepted = error <= 1.0
        self.H = max(self.H, h * factor) if accepted and factor >= 1.0 else h * factor
        return accepted

    @property
    def exhausted(self) -> bool:
        """The step has become too small to go on."""
        return self.H < self._least


class CoSimulation:
    """cs-predict, and with `correct` cs-pece. Without H the step of cs-pece follows the error, to `tolerance` (rtol, atol)."""

    def __init__(self, network: Network, H: float | None, order: int, correct: bool, tolerance: tuple[float, float]):
        self._network, self._H, self._order, self._tolerance = network, H, order, tolerance
        instances = list(network.instances.values())
        self._all, self._in_events = instances, [i for i in instances if i.event_mode]
        self._treatment, self._resets, self._bound = Treatment(instances), Resets(instances), Bound(network)
        self._saved = Saved(network) if correct else None
        self._motion = np.array([is_motion(name) for name in network.output_variables()])
        self.evaluations = self.steps = self.rejected = 0

    @property
    def passes(self) -> float:
        """Passes over the simulated time, discarded ones included."""
        return 1.0 if self._saved is None else 2.0 * (self.steps + self.rejected) / max(self.steps, 1)

    # parts of a step ------------------------------------------------------------------------------------------------
    def _step_all(self, t: float, H: float, final: bool):
        for instance in self._all:
            instance.step(t, H, final)
        self._network.time = t + H

    def _enter_step_mode(self):
        for instance in self._in_events:
            instance.check("fmi3EnterStepMode")

    def _enter_event_mode(self):
        for instance in self._in_events:
            instance.enter_event_mode()
        self._observe()

    def _observe(self):
        for response in self._network.responses.values():
            response.after_step()

    def _evaluate(self):
        """E, not accepted yet."""
        self._enter_event_mode()
        self._network.sweep()

    def _accept(self, swept: bool):
        """E, accepted: events, updates."""
        if any(instance.event_needed for instance in self._all):
            self._resets.announce()
        self._next_event, moved = self._network.settle(sweep_first=not swept)
        if moved:
            self._resets.announce()
            self._next_event, _ = self._network.settle()

    def _predict(self, t: float, H: float):
        for response in self._network.responses.values():
            response.before_step()
        self._enter_step_mode()
        self._step_all(t, H, final=self._saved is None)

    def _correct(self, t: float, H: float):
        self._saved.restore()
        self._treatment.set("endpoint", self._order + 1)
        self._enter_step_mode()
        self._network.write_inputs()
        self._step_all(t, H, final=self._H is not None)

    # run ------------------------------------------------------------------------------------------------------------
    def start(self, samples: np.ndarray, recorder):
        """Initialization, first events, first sample."""
        if self._H is not None:
            for a, b in zip(samples, samples[1:]):
                points_between(a, b, self._H)
        self._control = StepControl(float(samples[-1] - samples[0]), self._order)
        self._network.initialise(samples[0], samples[-1])
        self._observe()
        self._treatment.set("extrapolate", self._order)
        self._next_event, _ = self._network.settle()
        recorder.take()

    def loop(self, samples: np.ndarray, recorder):
        """From the first sample to the last."""
        t = float(samples[0])
        for a, b in zip(samples, samples[1:]):
            points = points_between(a, b, b - a if self._H is None else self._H)
            for after in points[1:].tolist():
                t = self._advance(t, after)
            recorder.take()

    def _advance(self, t: float, after: float) -> float:
        """To the next communication point, with one more at every time event on the way; returns where it is.

        A point and an event that differ in their last digits are one: a discontinuity must not begin just behind a point.
        """
        step = self._controlled if self._H is None else self._fixed
        near = SAME_TIME * (after - t)
        while t + near < self._next_event < after - near:
            event = self._next_event
            step(t, event)
            t = event
        end = self._next_event if abs(self._next_event - after) <= near else after
        step(t, end)
        return end

    def _fixed(self, t: float, end: float):
        H = _reaching(t, end)
        if self._saved is None:
            self._predict(t, H)
            self._enter_event_mode()
            self._accept(swept=False)
        else:
            self._saved.save()
            self._predict(t, H)
            self._evaluate()
            self._correct(t, H)
            self._saved.free()
            self._enter_event_mode()
            self._treatment.set("extrapolate", self._order)
            self._accept(swept=False)
        self.steps += 1
        self._bound.check(t + H)

    def _controlled(self, t: float, stop: float):
        """Steps of error-controlled size up to `stop`."""
        while t < stop:
            self._saved.save()
            u = self._network.u.copy()
            while True:
                H = self._control.step(_reaching(t, stop))
                self._predict(t, H)
                self._evaluate()
                predicted = self._network.y[self._motion]
                self._correct(t, H)
                self._evaluate()
                parts = self._errors(predicted, self._network.y[self._motion])
                if self._control.judge(H, float(np.max(parts, initial=0.0))):
                    break
                self.rejected += 1
                if self._control.exhausted:
                    worst = self._network.output_name(int(np.flatnonzero(self._motion)[np.argmax(parts)]))
                    raise SceneError(
                        f"t = {t:.6f} s: communication step fell to {self._control.H:.3e} s; worst signal: {worst}"
                    )
                self._saved.restore()
                self._treatment.set("extrapolate", self._order)
                self._network.u[:] = u
            self._saved.free()
            self._treatment.set("extrapolate", self._order)
            self._accept(swept=True)
            self.steps += 1
            t = stop if H >= stop - t else t + H
            self._bound.check(t)

    def _errors(self, predicted: np.ndarray, corrected: np.ndarray) -> np.ndarray:
        """Local errors in units of the tolerance."""
        rtol, atol = self._tolerance
        return ESTIMATE * np.abs(corrected - predicted) / (atol + rtol * np.abs(corrected))


def _reaching(t: float, end: float) -> float:
    """Step size from t with which t + H, as components add it, is not before the end."""
    H = end - t
    return H if t + H >= end else float(np.nextafter(H, np.inf))
