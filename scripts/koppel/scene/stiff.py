"""Rodas4 and Radau5 for method `common`: the formulas, the step control and the first step of the program `koppel`.

    rodas4   (1/(h gamma) I - J) u_i = f(t + alpha_i h, x + sum_j a_ij u_j) + sum_j (c_ij / h) u_j + gamma_i h f_t,   j < i
    radau5   z_i = h sum_j a_ij f(t + c_j h, x + z_j), by the simplified Newton method on w = T^-1 z

J by forward differences of the whole right-hand side. Source: Hairer & Wanner II, sections IV.7 and IV.8.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import lu_factor, lu_solve

from ..fmu import FmuError, Status
from .integrators import Advance, Rates

EPSILON = float(np.finfo(float).eps)
SAFETY = 0.9


class NotSolved(ArithmeticError):
    """The equations of an implicit step have no solution near its start."""


@dataclass(frozen=True)
class Start:
    """Where a step begins, with f there."""

    t: float
    x: np.ndarray
    slope: np.ndarray


def jacobian(f: Rates, start: Start, nominal: np.ndarray) -> np.ndarray:
    """df/dx by forward differences."""
    columns = []
    for j, x in enumerate(start.x):
        moved = start.x.copy()
        moved[j] = x + math.sqrt(EPSILON) * max(abs(x), nominal[j] if math.isfinite(nominal[j]) else 1.0)
        columns.append((f(start.t, moved) - start.slope) / (moved[j] - x))
    return np.array(columns).T


def rate(f: Rates, start: Start) -> np.ndarray:
    """df/dt by a forward difference."""
    after = start.t + math.sqrt(EPSILON) * max(abs(start.t), 1.0)
    return (f(after, start.x) - start.slope) / (after - start.t)


def decomposed(matrix: np.ndarray):
    """LU factors."""
    if not np.isfinite(matrix).all():
        raise NotSolved("the matrix of an implicit step is not finite")
    lu, pivots = lu_factor(matrix, check_finite=False)
    if (np.diag(lu) == 0.0).any():
        raise NotSolved("the matrix of an implicit step is singular")
    return lu, pivots


class Norm:
    """Errors in units of the tolerance."""

    def __init__(self, rtol: float, atol: float, nominal: np.ndarray):
        self.rtol, self.nominal = rtol, nominal
        self._absolute = np.where(np.isfinite(nominal), atol * nominal, np.inf)
        self._counted = max(int(np.isfinite(nominal).sum()), 1)

    def against(self, values: np.ndarray, magnitude: np.ndarray) -> float:
        """Root mean square of values scaled with magnitudes."""
        return math.sqrt(float(np.sum((values / (self._absolute + self.rtol * magnitude)) ** 2)) / self._counted)

    def of(self, values: np.ndarray, x: np.ndarray, end: np.ndarray) -> float:
        """Size of values against the larger of two states."""
        return self.against(values, np.maximum(np.abs(x), np.abs(end)))


@dataclass
class Trial:
    """A step that may count: its end, stages, error, and part of the step size that the error allows."""

    end: np.ndarray
    stages: np.ndarray
    error: float
    safety: float = SAFETY


class Rodas4:
    """Rosenbrock method of order 4."""

    order, shrink, grow = 4.0, 1.0 / 6.0, 5.0
    GAMMA = 0.25
    A = np.zeros((6, 6))
    A[1, :1] = [1.544]
    A[2, :2] = [0.9466785280815826, 0.2557011698983284]
    A[3, :3] = [3.314825187068521, 2.896124015972201, 0.9986419139977817]
    A[4, :4] = [1.221224509226641, 6.019134481288629, 12.53708332932087, -0.687886036105895]
    A[5, :5] = [*A[4, :4], 1.0]
    C = np.zeros((6, 6))
    C[1, :1] = [-5.6688]
    C[2, :2] = [-2.430093356833875, -0.2063599157091915]
    C[3, :3] = [-0.1073529058151375, -9.594562251023355, -20.47028614809616]
    C[4, :4] = [7.496443313967647, -10.24680431464352, -33.99990352819905, 11.7089089320616]
    C[5, :5] = [8.083246795921522, -7.981132988064893, -31.52159432874371, 16.31930543123136, -6.058818238834054]
    ALPHA = (0.0, 0.386, 0.21, 0.63, 1.0, 1.0)
    GAMMA_I = (0.25, -0.1043, 0.1035, -0.0362, 0.0, 0.0)
    H = np.array(
        [
            [10.12623508344586, -7.487995877610167, -34.80091861555747, -7.992771707568823, 1.025137723295662],
            [-0.6762803392801253, 6.087714651680015, 16.43084320892478, 24.76722511418386, -6.594389125716872],
        ]
    )

    @staticmethod
    def tolerance(rtol: float) -> float:
        """What the method makes of the tolerance wanted."""
        return rtol

    def begin(self, f: Rates, start: Start, norm: Norm):
        """Before the trials of a step."""
        self._J, self._f_t = jacobian(f, start, norm.nominal), rate(f, start)

    def trial(self, f: Rates, start: Start, h: float, norm: Norm, _fresh: bool) -> Trial:
        """One step of length h."""
        u = self._stages(f, start, h)
        end = start.x + self.A[5] @ u + u[5]
        return Trial(end, u, norm.of(u[5], start.x, end))

    def _stages(self, f: Rates, start: Start, h: float) -> np.ndarray:
        n = len(start.x)
        lu = decomposed(np.eye(n) / (self.GAMMA * h) - self._J)
        u = np.zeros((6, n))
        for i in range(6):
            slope = start.slope if i == 0 else f(start.t + self.ALPHA[i] * h, start.x + self.A[i] @ u)
            u[i] = lu_solve(lu, slope + self.C[i] @ u / h + self.GAMMA_I[i] * h * self._f_t)
        return u

    def inside(self, start: Start, trial: Trial, theta: float) -> np.ndarray:
        """Continuous extension."""
        bow, skew = self.H @ trial.stages[:5]
        return start.x + theta * (trial.end - start.x + bow + theta * (skew - bow - theta * skew))

    def repeat(self, f: Rates, start: Start, _trial: Trial, h: float, _norm: Norm) -> np.ndarray:
        """State at the end of a step with another length."""
        u = self._stages(f, start, h)
        return start.x + self.A[5] @ u + u[5]

    def accepted(self, _trial: Trial, _h: float):
        """The step counts."""

    def keeps(self, _growth: float) -> bool:
        """The same step size again is worth more than a longer one."""
        return False


_ROOT = math.sqrt(6.0)


class Radau5:
    """Collocation method of order 5."""

    order, shrink, grow = 4.0, 0.2, 8.0
    MOST, REUSE, KEEP = 10, 1e-3, 1.2
    NODES = np.array([(4.0 - _ROOT) / 10.0, (4.0 + _ROOT) / 10.0, 1.0])
    E = np.array([-(13.0 + 7.0 * _ROOT) / 3.0, (-13.0 + 7.0 * _ROOT) / 3.0, -1.0 / 3.0])
    GAMMA, ALPHA_BETA = 3.637834252744496, complex(2.6810828736277523, 3.0504301992474105)
    T = np.array(
        [
            [0.09123239487089295, -0.1412552950209542, -0.030029194105147424],
            [0.241717932707107, 0.20412935229379994, 0.3829421127572619],
            [0.966048182615093, 1.0, 0.0],
        ]
    )
    T_INVERSE = np.array(
        [
            [4.325579890063155, 0.33919925181580984, 0.5417705399358749],
            [-4.178718591551905, -0.32768282076106237, 0.47662355450055044],
            [-0.5028726349457868, 2.571926949855605, -0.5960392048282249],
        ]
    )
    #: z(theta) = sum_p theta^(p+1) sum_i POWERS_pi z_i
    POWERS = np.linalg.inv(np.array([[c, c**2, c**3] for c in NODES]))

    def __init__(self):
        self._J, self._current, self._matrices = None, False, None
        self._rate, self._eta = 0.0, 1.0
        self._before: tuple[float, np.ndarray] | None = None

    @staticmethod
    def tolerance(rtol: float) -> float:
        """The estimate has order 3 and the method 5: its step size goes with rtol^(1/6), its error with rtol^(5/6)."""
        return 0.1 * rtol ** (2.0 / 3.0)

    def begin(self, _f: Rates, _start: Start, _norm: Norm):
        """Before the trials of a step."""
        self._current = False
        if self._rate > self.REUSE:
            self._J = None

    def _prepare(self, f: Rates, start: Start, h: float, norm: Norm):
        if self._J is None:
            self._J, self._current, self._matrices = jacobian(f, start, norm.nominal), True, None
        if self._matrices is None or self._matrices[0] != h:
            one = np.eye(len(start.x))
            real = decomposed(one * (self.GAMMA / h) - self._J)
            self._matrices = (h, real, decomposed(one * (self.ALPHA_BETA / h) - self._J))

    def _guess(self, h: float, n: int) -> np.ndarray:
        if self._before is None:
            return np.zeros((3, n))
        length, (p1, p2, p3) = self._before
        # z(theta) - z(1), theta = 1 + s
        s = (self.NODES * h / length)[:, None]
        return s * (p1 + 2.0 * p2 + 3.0 * p3 + s * (p2 + 3.0 * p3 + s * p3))

    def _solve(self, f: Rates, start: Start, h: float, norm: Norm, guess: np.ndarray) -> tuple[np.ndarray, int]:
        self._prepare(f, start, h, norm)
        solved = self._newton(f, start, h, norm, guess)
        if solved is None and not self._current:
            self._J = None
            self._prepare(f, start, h, norm)
            solved = self._newton(f, start, h, norm, guess)
        if solved is None:
            raise NotSolved(f"the equations of an implicit step of {h:.3e} s at t = {start.t:.6f} s are not solved")
        return solved

    def _newton(self, f: Rates, start: Start, h: float, norm: Norm, z: np.ndarray) -> tuple[np.ndarray, int] | None:
        _, real, complex_ = self._matrices
        allowed = max(min(math.sqrt(norm.rtol), 0.03), 10.0 * EPSILON / norm.rtol)
        w = self.T_INVERSE @ z
        eta, rate_, last, before = max(self._eta, EPSILON) ** 0.8, 0.0, 0.0, 0.0
        for k in range(1, self.MOST + 1):
            g = self.T_INVERSE @ np.array([f(start.t + c * h, start.x + z_i) for c, z_i in zip(self.NODES, z)])
            first = lu_solve(real, g[0] - self.GAMMA / h * w[0])
            others = lu_solve(complex_, g[1] + 1j * g[2] - self.ALPHA_BETA / h * (w[1] + 1j * w[2]))
            increment = np.array([first, others.real, others.imag])
            size = math.sqrt(sum(norm.against(d, np.abs(start.x)) ** 2 for d in increment) / 3.0)
            if not math.isfinite(size):
                return None
            w = w + increment
            z = self.T @ w
            if k > 1:
                ratio = size / before
                rate_ = ratio if k == 2 else math.sqrt(ratio * last)
                last = ratio
                if rate_ < 0.99:
                    eta = rate_ / (1.0 - rate_)
                    if k > 2 and eta * size * rate_ ** (self.MOST - k) > allowed:
                        return None
                elif size > allowed:
                    return None
                else:
                    eta = 1.0
            before = size
            if eta * size <= allowed:
                self._rate, self._eta = rate_, eta
                return z, k
        return None

    def _filtered(self, h: float, slope: np.ndarray, z: np.ndarray) -> np.ndarray:
        return lu_solve(self._matrices[1], slope + self.E @ z / h)

    def trial(self, f: Rates, start: Start, h: float, norm: Norm, fresh: bool) -> Trial:
        """One step of length h."""
        z, iterations = self._solve(f, start, h, norm, self._guess(h, len(start.x)))
        end = start.x + z[2]
        parts = self._filtered(h, start.slope, z)
        if fresh and norm.of(parts, start.x, end) >= 1.0:
            parts = self._filtered(h, f(start.t, start.x + parts), z)
        safety = SAFETY * (2.0 * self.MOST + 1.0) / (2.0 * self.MOST + iterations)
        return Trial(end, z, norm.of(parts, start.x, end), safety)

    def inside(self, start: Start, trial: Trial, theta: float) -> np.ndarray:
        """Collocation polynomial."""
        p1, p2, p3 = self.POWERS @ trial.stages
        return start.x + theta * (p1 + theta * (p2 + theta * p3))

    def repeat(self, f: Rates, start: Start, trial: Trial, h: float, norm: Norm) -> np.ndarray:
        """State at the end of a step with another length; first guess: the polynomial of `trial`."""
        theta = self.NODES * (h / self._before[0])
        guess = np.array([self.inside(start, trial, at) - start.x for at in theta])
        return start.x + self._solve(f, start, h, norm, guess)[0][2]

    def accepted(self, trial: Trial, h: float):
        """The step counts."""
        self._before = (h, self.POWERS @ trial.stages)

    def keeps(self, growth: float) -> bool:
        """The same step size again is worth more than a longer one."""
        return self._rate <= self.REUSE and 1.0 <= growth <= self.KEEP


class Stiff:
    """Step-size control of Rodas4 and Radau5: predictive, as Hairer & Wanner IV.8."""

    METHODS = {"rodas4": Rodas4, "radau5": Radau5}
    LEAST_ERROR, LEAST_PREDICTED, RESOLUTION, FAILED, HALF = 1e-4, 1e-2, 8.0 * EPSILON, 0.2, 0.5

    def __init__(self, method: str, rtol: float, atol: float, nominal: np.ndarray):
        self._make = self.METHODS[method]
        rtol_ = self._make.tolerance(rtol)
        self._norm = Norm(rtol_, atol * (rtol_ / rtol), nominal)
        self.restart()

    def restart(self):
        """States or inputs have changed: begin anew."""
        self._method = self._make()
        self._next, self._before = 0.0, None

    def step(self, f: Rates, t: float, x: np.ndarray, k1: np.ndarray, bound: float) -> Advance:
        """One accepted step towards `bound`, which it does not pass."""
        start, remaining = Start(t, x.copy(), k1), bound - t
        if not np.isfinite(k1).all():
            raise ArithmeticError(f"a derivative is not finite at t = {t:.6f} s")
        if self._next <= 0.0:
            self._next = self._first(f, start, remaining)
        least = self.RESOLUTION * max(abs(t), abs(bound))
        wanted = max(self._next, least)
        self._method.begin(f, start, self._norm)
        h = remaining if wanted >= remaining else 0.5 * remaining if 2.0 * wanted > remaining else wanted
        trial, h, rejected = self._accepted(f, start, h, least)
        self._method.accepted(trial, h)
        self._note(trial, h, wanted, rejected)
        method, end = self._method, bound if h >= remaining else t + h
        inside = lambda at: trial.end if at >= end else method.inside(start, trial, (at - t) / h)
        again = lambda at: trial.end if at >= end else method.repeat(f, start, trial, at - t, self._norm)
        return Advance(end, trial.end, inside, rejected, again)

    def _accepted(self, f: Rates, start: Start, h: float, least: float) -> tuple[Trial, float, int]:
        rejected = 0
        while True:
            try:
                trial = self._method.trial(f, start, h, self._norm, rejected > 0 or self._before is None)
                if not np.isfinite(trial.end).all():
                    shorter = h * self.FAILED
                elif trial.error <= 1.0:
                    return trial, h, rejected
                else:
                    shorter = h * min(max(self._method.shrink, self._factor(trial)), SAFETY)
            except FmuError as refused:
                if refused.status != Status.DISCARD:
                    raise
                shorter = h * self.FAILED
            except NotSolved:
                shorter = h * self.HALF
            rejected += 1
            if shorter < least:
                raise ArithmeticError(f"step size fell to {shorter:.3e} s at t = {start.t:.6f} s")
            h = shorter

    def _factor(self, trial: Trial) -> float:
        return trial.safety * max(trial.error, 1e-300) ** (-1.0 / self._method.order)

    def _note(self, trial: Trial, h: float, wanted: float, rejected: int):
        method, factor = self._method, self._factor(trial)
        if self._before is not None:
            length, error = self._before
            now = max(trial.error, math.sqrt(float(np.finfo(float).tiny)))
            ratio = max(error, self.LEAST_PREDICTED) / (now * now)
            factor = min(factor, trial.safety * h / length * ratio ** (1.0 / method.order))
        growth = min(max(factor, method.shrink), method.grow)
        if rejected:
            growth = min(growth, 1.0)
        elif method.keeps(growth):
            growth = 1.0
        # cut short by the bound, not by its error
        self._next = max(h * growth, wanted) if not rejected and growth >= 1.0 else h * growth
        self._before = (h, trial.error)

    def _first(self, f: Rates, start: Start, remaining: float) -> float:
        size: Callable[[np.ndarray], float] = lambda values: self._norm.against(values, np.abs(start.x))
        state, slope = size(start.x), size(start.slope)
        euler = min(1e-6 if state < 1e-5 or slope < 1e-5 else 0.01 * state / slope, remaining)
        turned = size(f(start.t + euler, start.x + euler * start.slope) - start.slope) / euler
        steepest = max(slope, turned)
        order = self._method.order
        turning = max(1e-3 * euler, 1e-6) if steepest <= 1e-15 else (0.01 / steepest) ** (1.0 / order)
        return min(100.0 * euler, turning, remaining)
