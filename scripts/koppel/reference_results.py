"""Reference results of every FMU: its default experiment, run with tight tolerances.

The archives hold the files (`extra/org.fmi-standard.fmi-ls-ref`), the documentation shows them;
`tests/test_reference_results.py` compares them with solutions that are computed separately.
"""

import argparse
from collections.abc import Callable
from pathlib import Path

import numpy as np

from . import paths
from .fmu import Fmu, Result

#: What `documentation/fmi-ls-ref.txt` promises (`boom` has `dopri5` instead).
TIGHT = {"solver.method": "dop853", "solver.rtol": 1e-12, "solver.atol": 1e-15}
#: Rows of a file, at most.
ROWS = 251


def shaken(t: float) -> list[float]:
    """Position, velocity and acceleration of A.z: 1 mm at 20 rad/s."""
    return [1e-3 * np.sin(20.0 * t), 0.02 * np.cos(20.0 * t), -0.4 * np.sin(20.0 * t)]


def commands(t: float) -> list[float]:
    """Commands of the six joints [rad/s]: raise the folded boom, slew and open arm 3, open the rest."""
    if t < 60.0:
        return [0.0, 0.02, 0.0, 0.0, 0.0, 0.0]
    return [0.03, 0.02, 0.01, 0.0, 0.0, 0.0] if t < 120.0 else [0.0, 0.0, 0.05, -0.05, 0.05, -0.05]


#: FMUs that do nothing with inputs at rest: names and law of the inputs.
INPUTS: dict[str, tuple[list[str], Callable[[float], list[float]]]] = {
    "boom": ([f"joint[{i}].velocity_command" for i in range(1, 7)], commands),
    "bushing": (["A.r.z", "A.v.z", "A.a.z"], shaken),
}


def folder(name: str) -> Path:
    """Folder of the model's files for the archive."""
    (found,) = (paths.ROOT / "common" / "models" / "src").glob(f"*/archive/{name}.svg")
    return found.parent


def every(fmu: Fmu) -> tuple[float, float, int]:
    """Stop time and step of the default experiment, and how many steps lie between two rows of the file."""
    experiment = fmu.description.defaultExperiment
    stop, step = float(experiment.stopTime), float(experiment.stepSize)
    return stop, step, -(-round(stop / step) // (ROWS - 1))


def run(fmu: Fmu, settings: dict, refine: int = 1) -> Result:
    """The reference experiment at communication points of `step / refine`, with the rows of the file only."""
    stop, step, stride = every(fmu)
    inputs = INPUTS.get(fmu.name)
    start = dict(settings)
    if inputs:
        names, law = inputs
        start |= dict(zip(names, law(0.0)))
    result = fmu.run(start, H=step / refine, stop=stop, outputs=fmu.names("output"), inputs=inputs)
    rows = slice(None, None, stride * refine)
    return Result(result.t[rows], result.names, result.values[rows], result.nominal, result.counts)


def reference(fmu: Fmu) -> Result:
    """The tight run. Inputs that move are given for the end of each step, which is 20 times shorter then; those that are
    always held belong to the start."""
    inputs = INPUTS.get(fmu.name)
    if fmu.name == "boom":
        return run(fmu, {**TIGHT, "solver.method": "dopri5"})
    if not inputs:
        return run(fmu, TIGHT)
    names, law = inputs
    stop, step, stride = every(fmu)
    H = step / 20.0
    start = {**TIGHT, "port.inputs": "endpoint", "port.order": 3, **dict(zip(names, law(0.0)))}
    result = fmu.run(start, H=H, stop=stop, outputs=fmu.names("output"), inputs=(names, lambda t: law(t + H)))
    rows = slice(None, None, stride * 20)
    return Result(result.t[rows], result.names, result.values[rows], result.nominal, result.counts)


def table(names: list[str], rows: np.ndarray) -> str:
    """Comma-separated values with 12 digits; what is rounding beside the column's largest value is zero."""
    rows = np.where(np.abs(rows) <= 1e-14 * np.abs(rows).max(axis=0), 0.0, rows)
    lines = [",".join(f"{value:.12g}" for value in row) for row in rows]
    return "\n".join([",".join(names), *lines]) + "\n"


def write(name: str):
    """The model's files."""
    with Fmu(paths.fmu(name)) as fmu:
        result = reference(fmu)
        rows = np.column_stack([result.t, result.values])
        (folder(name) / f"{name}.csv").write_text(table(["time", *result.names], rows), encoding="utf-8")
        if name in INPUTS:
            names, law = INPUTS[name]
            stop, step, _ = every(fmu)
            t = np.arange(round(stop / step) + 1) * step
            rows = np.array([[at, *law(at)] for at in t])
            (folder(name) / f"{name}_in.csv").write_text(table(["time", *names], rows), encoding="utf-8")


def main():
    """`scripts/reference_results NAME...`"""
    parser = argparse.ArgumentParser(prog="scripts/reference_results", description=__doc__)
    parser.add_argument("names", nargs="+")
    for name in parser.parse_args().names:
        write(name)
        print(f"== {(folder(name) / name).relative_to(paths.ROOT)}.csv")


if __name__ == "__main__":
    main()
