#!/usr/bin/env python3
"""Error against CPU time of `rvdp_absorber` for every method, tolerance and gain g = gamma Omega X^2.

    scripts/build rvdp_absorber && .venv/bin/python scripts/bench_absorber.py [--quick]

The absorber starts at half its amplitude and synchronises with the design force of f = 0.4, alpha = 1.2 over two
seconds, in communication steps of 0.1 s. Error: of x over all samples, relative to X, against radau5 at rtol 1e-13, which
another method confirms to the figure printed above each gain. CPU time: of the doStep loop, smallest of three.
out/absorber/work_precision.csv and .png.
"""

import argparse
import csv
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))

from koppel import Fmu, FmuError, paths

OMEGA, X, MASS = 4.0 * np.pi, 0.06332573977646111, 5.0
F_SCALED, ALPHA = 0.4, 1.2
STOP, H = 2.0, 0.1
GAINS = (0.1, 1.0, 10.0, 1e3, 1e5)
METHODS = ("auto", "dopri5", "dop853", "rodas4", "radau5")
TOLERANCES = tuple(10.0**-k for k in range(3, 12))
STEPS = (2e-3, 1e-3, 5e-4, 2e-4, 1e-4)


def start(gain: float) -> dict:
    """Parameters of the case."""
    force = F_SCALED * MASS * OMEGA**2 * X
    design = {"control.gamma": gain / (OMEGA * X**2), "control.force": force, "control.alpha": ALPHA}
    drive = {"drive.amplitude": force, "drive.phase": ALPHA, "use.energy": False}
    return {**design, **drive, "x.start": 0.5 * X}


def adaptive(method: str, rtol: float) -> dict:
    """Settings of a solver with step-size control."""
    return {"solver.method": method, "solver.rtol": rtol, "solver.atol": 1e-3 * rtol}


def run(fmu: Fmu, gain: float, settings: dict):
    """Displacements, counts and CPU time."""
    values = {**start(gain), **settings}
    result = fmu.run(values, H=H, stop=STOP, outputs=["x"])
    time = fmu.time_loop(values, H=H, stop=STOP, repeats=3, min_time=0.01)
    return result["x"], result.counts, time.cpu_min


def points(fmu: Fmu, gains, tolerances):
    """Rows: gain, method, rtol or step, error, CPU time, evaluations, Jacobians, status."""
    for gain in gains:
        exact, *_ = run(fmu, gain, adaptive("radau5", 1e-13))
        other, *_ = run(fmu, gain, adaptive("rodas4" if gain > 1e3 else "dop853", 1e-13 if gain <= 1e3 else 1e-10))
        print(f"g = {gain:g}: references differ by {np.abs(exact - other).max() / X:.1e} X")
        settings = [(m, rtol, adaptive(m, rtol)) for m in METHODS for rtol in tolerances]
        settings += [("rk4", step, {"solver.method": "rk4", "solver.step": step}) for step in STEPS]
        for method, size, values in settings:
            try:
                x, counts, cpu = run(fmu, gain, values)
            except FmuError as refused:
                yield gain, method, size, None, None, None, None, refused.messages[-1].text
                continue
            error = np.abs(x - exact).max() / X
            yield gain, method, size, error, cpu, counts["solver.rhs_evaluations"], counts["solver.jacobians"], "ok"


def draw(rows, path):
    """One diagram per gain."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    gains = sorted({row[0] for row in rows})
    figure, all_axes = pyplot.subplots(
        1, len(gains), figsize=(3.2 * len(gains), 3.6), layout="constrained", sharey=True
    )
    for axes, gain in zip(np.atleast_1d(all_axes), gains):
        for method in (*METHODS, "rk4"):
            found = [(row[4], row[3]) for row in rows if row[0] == gain and row[1] == method and row[3]]
            if found:
                axes.loglog(*zip(*found), ".-", label=method)
        axes.set_title(f"g = {gain:g}")
        axes.set_xlabel("CPU time [s]")
        axes.grid(True, alpha=0.25)
    np.atleast_1d(all_axes)[0].set_ylabel("error of x / X")
    np.atleast_1d(all_axes)[0].legend()
    figure.savefig(path, dpi=110, metadata={"Software": None})


def main():
    """The table, its file and its picture."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="three tolerances only")
    tolerances = TOLERANCES[::4] if parser.parse_args().quick else TOLERANCES
    out = paths.ROOT / "out" / "absorber"
    out.mkdir(parents=True, exist_ok=True)
    rows = []
    print(f"{'g':>8} {'method':>8} {'rtol/step':>9} {'error/X':>9} {'CPU ms':>8} {'rhs':>9} {'Jacobians':>9}")
    with Fmu(paths.fmu("rvdp_absorber")) as fmu:
        for row in points(fmu, GAINS, tolerances):
            rows.append(row)
            gain, method, size, error, cpu, rhs, jacobians, status = row
            numbers = f"{error:9.1e} {1e3 * cpu:8.3f} {rhs:9} {jacobians:9}" if error is not None else status[:90]
            print(f"{gain:8g} {method:>8} {size:9.0e} {numbers}", flush=True)
    with (out / "work_precision.csv").open("w", newline="", encoding="utf-8") as file:
        header = ["g", "method", "rtol_or_step", "error", "cpu_s", "rhs", "jacobians", "status"]
        csv.writer(file).writerows([header, *rows])
    draw(rows, out / "work_precision.png")
    print(f"== {out}/work_precision.csv and .png")


if __name__ == "__main__":
    main()
