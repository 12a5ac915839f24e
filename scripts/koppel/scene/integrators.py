"""One-step methods for method `common`: fixed steps of Heun and Runge-Kutta, adaptive ones by scipy."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.integrate import DOP853, RK45

Rates = Callable[[float, np.ndarray], np.ndarray]


def heun(f: Rates, t: float, x: np.ndarray, h: float, k1: np.ndarray) -> np.ndarray:
    """Heun's method, order 2; `k1` = f(t, x)."""
    return x + 0.5 * h * (k1 + f(t + h, x + h * k1))


def rk4(f: Rates, t: float, x: np.ndarray, h: float, k1: np.ndarray) -> np.ndarray:
    """The classical Runge-Kutta method; `k1` = f(t, x)."""
    k2 = f(t + 0.5 * h, x + 0.5 * h * k1)
    k3 = f(t + 0.5 * h, x + 0.5 * h * k2)
    k4 = f(t + h, x + h * k3)
    return x + h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)


FIXED = {"heun": heun, "rk4": rk4}


@dataclass(frozen=True)
class Advance:
    """A step: its end, the states there, and the states in between."""

    t: float
    x: np.ndarray
    between: Callable[[float], np.ndarray]
    rejected: int = 0
    #: The method itself repeated up to a time, to locate events; `between` where there is none.
    again: Callable[[float], np.ndarray] | None = None


class FixedStep:
    """Steps of equal size; a shorter last one ends at `bound`."""

    def __init__(self, method: str, h: float):
        self._method, self._h = FIXED[method], h

    def restart(self):
        """Nothing is remembered from step to step."""

    def step(self, f: Rates, t: float, x: np.ndarray, k1: np.ndarray, bound: float) -> Advance:
        """One step from (t, x), where f is `k1`. Between its ends the method itself is repeated with a shorter step."""
        end = t + self._h
        if end > bound - 1e-9 * self._h:
            end = bound
        again = lambda at: x if at <= t else self._method(f, t, x, at - t, k1)
        return Advance(end, self._method(f, t, x, end - t, k1), again)


class Adaptive:
    """Dormand-Prince 5(4) or 8(5,3) with step-size control and dense output."""

    _SOLVERS = {"dopri5": (RK45, 6), "dop853": (DOP853, 12)}

    def __init__(self, method: str, rtol: float, atol: np.ndarray):
        self._class, self._stages = self._SOLVERS[method]
        self._rtol, self._atol = max(rtol, 100.0 * np.finfo(float).eps), atol
        self._solver, self._next = None, None

    def restart(self):
        """States or inputs have changed: begin anew, with the step size reached so far."""
        self._solver = None

    def step(self, f: Rates, t: float, x: np.ndarray, k1: np.ndarray, bound: float) -> Advance:
        """One accepted step towards `bound`, which it does not pass."""
        if self._solver is None or self._solver.t != t or self._solver.t_bound != bound:
            # the first evaluation is `k1`, known already
            known = lambda at, y: k1 if at == t and np.array_equal(y, x) else f(at, y)
            first = None if self._next is None else min(self._next, bound - t)
            options = {"rtol": self._rtol, "atol": self._atol, "first_step": first}
            self._solver = self._class(known, t, x, bound, **options)
        solver, before = self._solver, self._solver.nfev
        message = solver.step()
        if solver.status == "failed":
            raise ArithmeticError(message)
        rejected = (solver.nfev - before) // self._stages - 1
        if solver.t < bound:
            self._next = solver.h_abs
        dense = []

        def between(at: float) -> np.ndarray:
            if not dense:
                dense.append(solver.dense_output())
            return dense[0](at)

        return Advance(solver.t, solver.y.copy(), between, rejected)
