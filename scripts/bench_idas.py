#!/usr/bin/env python3
"""CPU time of the paper's wheel suspension at equal error: SUNDIALS IDAS through CasADi against our FMU.

    python3 -m venv /tmp/bench && /tmp/bench/bin/pip install -r scripts/requirements-bench.txt
    /tmp/bench/bin/python scripts/bench_idas.py

Needs scripts/build to have run, and a C compiler: CasADi writes its functions as C and compiles them, so that neither
side is interpreted. Scene: 10 s of `wishbone_paper`, P.F.z = 10 sin(10 t) N. The error is the largest of the lower link's
angle over all samples against tests/reference, as part of its amplitude. Samples every 0.05 s, as the paper has them, and
every 0.5 s: our FMU ends a step at each, IDAS interpolates.

IDAS gets the mechanism in two forms, both written here with CasADi's symbols and nothing of the product:

    dae  three angles, their rates, accelerations and the two forces of the closed joint: index 1, the loop closed on
         accelerations with Baumgarte's terms (20, 20 1/s), the same as in our FMU's rows `baumgarte`
    ode  one coordinate; the other angles follow from it in closed form (two circles), Lagrange's equation
"""

import argparse
import itertools
import math
import statistics
import sys
import time
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

import casadi as ca
import numpy as np
from koppel import Fmu, Loader, LoaderError, Reference, host, paths, scenes
from koppel.work_precision import FIXED, STEPS

THETA = "lower.angle.theta"
STOP = 10.0
#: Error at which the times are compared, as part of the amplitude.
TARGET = 1e-6
TOLERANCES = tuple(10.0**-k for k in range(4, 13))
REPEATS, MIN_TIME = 7, 0.05
FORMS = ("dae", "ode")
METHODS = ("rk4", "dopri5", "dop853")
#: How our FMU holds the loop: as the DAE does, and exactly after every step.
STABILISATIONS = ("baumgarte", "projection")
JIT = {"jit": True, "compiler": "shell", "jit_options": {"flags": ["-O3", "-march=native"]}}


@dataclass(frozen=True)
class Measured:
    """One point of a work-precision list; time [s] of one run, error over the amplitude."""

    method: str
    setting: str
    error: float
    cpu: float
    cpu_median: float
    #: Part of the time inside the compiled functions, as CasADi counts it (its clock calls included).
    functions: float | None = None


# the mechanism, x-z plane -------------------------------------------------------------------------------------------
A, B, C, D = (np.array(p) for p in ((0.0, 0.0), (0.40, -0.02), (0.36, 0.27), (0.08, 0.25)))
G, P, T = (np.array(p) for p in ((0.48, 0.12), (0.50, 0.12), (0.22, 0.62)))
M_LOWER, M_CARRIER, M_UPPER, I_CARRIER = 4.0, 25.0, 2.5, 0.8
K, DAMPING, S1 = 22000.0, 1000.0, 0.14
ALPHA = BETA = 20.0


def turned(angle, p):
    """A body vector after a turn from x towards z."""
    c, s = ca.cos(angle), ca.sin(angle)
    return ca.vertcat(c * p[0] - s * p[1], s * p[0] + c * p[1])


class Mechanism:
    """Kinetic energy, forces and the loop as expressions in turns q from the design position and their rates v."""

    def __init__(self):
        q, v, t = ca.SX.sym("q", 3), ca.SX.sym("v", 3), ca.SX.sym("t")
        self.q, self.v, self.t = q, v, t
        rate = lambda point: ca.jacobian(point, q) @ v
        r_B = A + turned(q[0], B - A)
        at = lambda p: r_B + turned(q[1], p - B)
        foot = D + turned(q[2], (C - D) / np.linalg.norm(C - D) * S1)
        self.gap = at(C) - (D + turned(q[2], C - D))
        centres = [A + turned(q[0], 0.5 * (B - A)), at(G), D + turned(q[2], 0.5 * (C - D))]
        masses = [M_LOWER, M_CARRIER, M_UPPER]
        turns = [M_LOWER * np.dot(B - A, B - A) / 12.0, I_CARRIER, M_UPPER * np.dot(C - D, C - D) / 12.0]
        kinetic = sum(0.5 * m * ca.dot(rate(c), rate(c)) for m, c in zip(masses, centres))
        kinetic += sum(0.5 * I * v[i] ** 2 for i, I in enumerate(turns))
        reach = ca.SX(T) - foot
        length = ca.norm_2(reach)
        free = math.dist(T, D + (C - D) / np.linalg.norm(C - D) * S1)
        tension = K * (length - free) + DAMPING * ca.jacobian(length, q) @ v
        force = ca.vertcat(0.0, 10.0 * ca.sin(10.0 * t))
        #: Generalised forces, mass matrix, and what of d/dt dT/dv - dT/dq is not M v'.
        self.Q = ca.jacobian(at(P), q).T @ force + ca.jacobian(foot, q).T @ (tension * reach / length)
        momentum = ca.gradient(kinetic, v)
        self.M = ca.jacobian(momentum, v)
        self.bias = ca.jacobian(momentum, q) @ v - ca.gradient(kinetic, q)

    def dae(self):
        """Index 1: x = (q, v), z = (v', closing force)."""
        a, force = ca.SX.sym("a", 3), ca.SX.sym("force", 2)
        W = ca.jacobian(self.gap, self.q)
        gap_rate = W @ self.v
        closing = W @ a + ca.jacobian(gap_rate, self.q) @ self.v + 2.0 * ALPHA * gap_rate + BETA**2 * self.gap
        balance = self.M @ a + self.bias - self.Q + W.T @ force
        x, z = ca.vertcat(self.q, self.v), ca.vertcat(a, force)
        dae = {"t": self.t, "x": x, "z": z, "ode": ca.vertcat(self.v, a), "alg": ca.vertcat(balance, closing)}
        return dae, np.zeros(6), np.zeros(5)

    def ode(self):
        """One coordinate: the carrier and the upper link follow by the intersection of two circles."""
        x = ca.SX.sym("x", 2)
        r_B = A + turned(x[0], B - A)
        to_D = ca.SX(D) - r_B
        near, far = math.dist(B, C), math.dist(C, D)
        d2 = ca.dot(to_D, to_D)
        along = (d2 + near**2 - far**2) / (2.0 * d2)
        # C lies on the same side of B - D as in the design position
        side = math.copysign(1.0, (D - B)[0] * (C - B)[1] - (D - B)[1] * (C - B)[0])
        across = side * ca.sqrt(near**2 / d2 - along**2)
        r_C = r_B + along * to_D + across * ca.vertcat(-to_D[1], to_D[0])
        angle = lambda r, p: ca.atan2(p[0] * r[1] - p[1] * r[0], p[0] * r[0] + p[1] * r[1])
        q = ca.vertcat(x[0], angle(r_C - r_B, C - B), angle(r_C - ca.SX(D), C - D))
        J = ca.jacobian(q, x[0])
        J_rate = ca.jacobian(J, x[0]) * x[1]
        put = lambda expression: ca.substitute(expression, ca.vertcat(self.q, self.v), ca.vertcat(q, J * x[1]))
        M, rest = put(self.M), put(self.Q - self.bias)
        acceleration = (J.T @ (rest - M @ (J_rate * x[1]))) / (J.T @ M @ J)
        return {"t": self.t, "x": x, "ode": ca.vertcat(x[1], acceleration)}, np.zeros(2), np.zeros(0)


def idas(form, samples, tolerances=TOLERANCES):
    """IDAS over the tolerances."""
    dae, x0, z0 = getattr(Mechanism(), form)()
    times = np.linspace(0.0, STOP, len(samples))
    amplitude = np.abs(samples - samples[0]).max()
    for rtol in tolerances:
        options = {
            "reltol": rtol,
            "abstol": scenes.atol_of(rtol),
            "max_num_steps": 1_000_000,
            "calc_ic": bool(z0.size),
            "suppress_algebraic": True,
            **JIT,
        }
        solve = ca.integrator(f"{form}_{-math.log10(rtol):.0f}", "idas", dae, times[0], times[1:], options)
        run = lambda: solve(x0=x0, z0=z0)["xf"]
        theta = samples[0] + np.concatenate([[0.0], np.asarray(run())[0]])
        per_run = []
        for _ in range(REPEATS):
            spent, runs = 0.0, 0
            while spent < MIN_TIME:
                begin = time.process_time()
                run()
                spent += time.process_time() - begin
                runs += 1
            per_run.append(spent / runs)
        error = float(np.abs(theta - samples).max() / amplitude)
        inside = sum(value for name, value in solve.stats().items() if name in ("t_proc_daeF", "t_proc_jacF"))
        label = f"rtol {rtol:.0e}"
        yield Measured(f"idas {form}", label, error, min(per_run), statistics.median(per_run), inside)


def ours(fmu, samples, methods):
    """Our FMU in the compiled loader; without energies, which IDAS does not integrate either."""
    amplitude = np.abs(samples - samples[0]).max()
    loader = Loader()
    for stabilisation, method in itertools.product(STABILISATIONS, methods):
        name = f"fmu {method} {stabilisation}"
        fixed = method in FIXED
        for setting in STEPS if fixed else TOLERANCES:
            values = scenes.fixed(method, setting) if fixed else scenes.adaptive(method, setting)
            H = STOP / (len(samples) - 1)
            try:
                timing = loader.run(
                    fmu,
                    {"use.energy": False, "stabilisation.kind": stabilisation, **values},
                    outputs=[THETA],
                    H=H,
                    stop=STOP,
                    repeat=REPEATS,
                    min_time=MIN_TIME,
                )
            except LoaderError as refused:
                print(f"{name:<23} {refused}")
                break
            error = float(np.abs(timing.samples[THETA] - samples).max() / amplitude)
            label = f"h = {setting:g} s" if fixed else f"rtol {setting:.0e}"
            yield Measured(name, label, error, timing.cpu_min, timing.cpu_median)


def at_target(points):
    """CPU time at the target error per method, cheapest first: on the line (log - log) between two points around it, or
    of the cheapest point where all are better than the target."""
    found = {}
    for method in dict.fromkeys(point.method for point in points):
        of = sorted((p for p in points if p.method == method), key=lambda p: -p.error)
        if of[0].error < TARGET:
            found[method] = min(p.cpu for p in of)
        for worse, better in zip(of, of[1:]):
            if worse.error >= TARGET >= better.error:
                x = math.log(TARGET / better.error) / math.log(worse.error / better.error)
                found[method] = min(found.get(method, math.inf), better.cpu * (worse.cpu / better.cpu) ** x)
    return dict(sorted(found.items(), key=lambda item: item[1]))


def compare(fmu, samples, methods):
    """Print both lists and the ratio."""
    print(
        f"{'method':<23}{'setting':<14}{'error/amplitude':>16}{'CPU min / ms':>14}{'median / ms':>13}{'functions':>11}",
        flush=True,
    )
    sides = {"theirs": [], "ours": []}
    runs = [("theirs", idas(form, samples)) for form in FORMS] + [("ours", ours(fmu, samples, methods))]
    for side, points in runs:
        for p in points:
            sides[side].append(p)
            inside = "" if p.functions is None else f"{p.functions * 1e3:.4f}"
            print(
                f"{p.method:<23}{p.setting:<14}{p.error:>16.2e}{p.cpu * 1e3:>14.4f}{p.cpu_median * 1e3:>13.4f}"
                f"{inside:>11}",
                flush=True,
            )
    print(f"\nCPU time at an error of {TARGET:g} of the amplitude (between two points: on the line in log - log)")
    found = {side: at_target(points) for side, points in sides.items()}
    for method, cpu in [item for side in found.values() for item in side.items()]:
        print(f"  {method:<23}{cpu * 1e3:9.4f} ms")
    if not found["ours"]:
        print("our FMU never meets the target error: no ratio")
        return
    our, fast = next(iter(found["ours"].items()))
    for their, slow in found["theirs"].items():
        print(f"  {their} : {our} = {slow / fast:.1f} (target 10)")


def main():
    """Both sample intervals."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--methods", nargs="*", default=METHODS, help="methods of our FMU")
    methods = parser.parse_args().methods
    samples = Reference.named("wishbone_paper")[THETA]
    for name, fact in host.facts().items():
        print(f"{name}: {fact}")
    print(f"CasADi {ca.__version__}, functions compiled with {' '.join(JIT['jit_options']['flags'])}")
    with Fmu(paths.fmu("double_wishbone")) as fmu:
        for every in (1, 10):
            print(f"\nsamples every {0.05 * every:g} s\n")
            compare(fmu, samples[::every], methods)


if __name__ == "__main__":
    main()
