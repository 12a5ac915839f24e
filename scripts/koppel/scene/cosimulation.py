"""Method `cs`: every component steps by its own solver; at communication points a sweep in Event Mode makes inputs fit.

P   port.inputs = extrapolate; doStep
E   Event Mode; sweep (with closing forces)
C   restore; port.inputs = endpoint, port.order = k + 1; the new inputs; doStep; E again    (pece only)
"""

import numpy as np

from .errors import SceneError
from .network import Network
from .ports import is_motion
from .sampling import points_between
from .stepping import Bound, Resets, Saved, Treatment

#: Error control: the estimate is this part of the difference of predictor and corrector.
ESTIMATE = 1.0 / 3.0
#: Points of time are the same if they differ by less than this part of a step.
SAME_TIME = 1e-9


class CoSimulation:
    """cs-predict, and with `correct` cs-pece. With `tolerance` (rtol, atol) the step size follows the error."""

    def __init__(
        self,
        network: Network,
        H: float,
        order: int,
        correct: bool,
        tolerance: tuple[float, float] | None = None,
    ):
        self._network, self._H, self._order = network, H, order
        self._tolerance = tolerance
        if tolerance and not correct:
            raise SceneError("cs-predict has a fixed H: error control needs the corrector, cs-pece")
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
        self._step_all(t, H, final=self._tolerance is None)

    # run ------------------------------------------------------------------------------------------------------------
    def start(self, samples: np.ndarray, recorder):
        """Initialization, first events, first sample."""
        for a, b in zip(samples, samples[1:]):
            if self._tolerance is None:
                points_between(a, b, self._H)
        self._network.initialise(samples[0], samples[-1])
        self._treatment.set("extrapolate", self._order)
        self._next_event, _ = self._network.settle()
        recorder.take()

    def loop(self, samples: np.ndarray, recorder):
        """From the first sample to the last."""
        t = float(samples[0])
        for a, b in zip(samples, samples[1:]):
            points = points_between(a, b, self._H if self._tolerance is None else b - a)
            for after in points[1:].tolist():
                t = self._advance(t, after)
            recorder.take()

    def _advance(self, t: float, after: float) -> float:
        """To the next communication point, with one more at every time event on the way; returns where it is.

        A point and an event that differ in their last digits are one: a discontinuity must not begin just behind a point.
        """
        step = self._fixed if self._tolerance is None else self._controlled
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
                H = min(self._H, _reaching(t, stop))
                # no sliver before the end
                H = 0.5 * (stop - t) if H < stop - t < 1.5 * H else H
                self._predict(t, H)
                self._evaluate()
                predicted = self._network.y[self._motion]
                self._correct(t, H)
                self._evaluate()
                e = self._error(predicted, self._network.y[self._motion])
                factor = min(2.0, max(0.2, 0.9 * max(e, 1e-10) ** (-1.0 / (self._order + 2))))
                if e <= 1.0:
                    break
                self.rejected += 1
                self._H = H * factor
                if self._H < 1e-9 * stop:
                    raise SceneError(f"H fell to {self._H:.3g} s at t = {t:.6g} s: the tolerance cannot be met")
                self._saved.restore()
                self._treatment.set("extrapolate", self._order)
                self._network.u[:] = u
            self._saved.free()
            self._treatment.set("extrapolate", self._order)
            self._accept(swept=True)
            self.steps += 1
            t = stop if H >= stop - t else t + H
            # a step cut short by a sample says nothing about longer ones
            self._H = max(self._H, H * factor) if H < self._H else H * factor
            self._bound.check(t)

    def _error(self, predicted: np.ndarray, corrected: np.ndarray) -> float:
        rtol, atol = self._tolerance
        scale = atol * self._network.nominal[self._motion] + rtol * np.abs(corrected)
        return float(ESTIMATE * np.max(np.abs(corrected - predicted) / scale, initial=0.0))


def _reaching(t: float, end: float) -> float:
    """Step size from t with which t + H, as components add it, is not before the end."""
    H = end - t
    return H if t + H >= end else float(np.nextafter(H, np.inf))
