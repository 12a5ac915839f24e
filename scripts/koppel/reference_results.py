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

#: What `documentation/fmi-ls-ref.txt` promises.
TIGHT = {"solver.method": "dop853", "solver.rtol": 1e-12, "solver.atol": 1e-15}
#: FMUs that do not offer dop853: the method instead; one without states has no integration error.
METHODS = {"boom": "dopri5", "effi_plant": "dopri5", "effi_controller": "rk4"}
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


def pressed(t: float) -> list[float]:
    """Position and velocity of A.z: 2 mm at 20 rad/s about the surface of the default wall."""
    return [0.57 - 2e-3 * np.sin(20.0 * t), -0.04 * np.cos(20.0 * t)]


def shaken_handle(t: float) -> list[float]:
    """Position and velocity of H.z: 1 mm at 20 rad/s about the hand's start."""
    return [0.6 + 1e-3 * np.sin(20.0 * t), 0.02 * np.cos(20.0 * t)]


def shaken_axis(t: float) -> list[float]:
    """Length of the first axis: 1 mm at 20 rad/s about the device's start."""
    return [np.hypot(0.35, 0.6) + 1e-3 * np.sin(20.0 * t)]


#: FMUs that do nothing with inputs at rest: names and law of the inputs.
INPUTS: dict[str, tuple[list[str], Callable[[float], list[float]]]] = {
    "boom": ([f"joint[{i}].velocity_command" for i in range(1, 7)], commands),
    "bushing": (["A.r.z", "A.v.z", "A.a.z"], shaken),
    "virtual_wall": (["A.r.z", "A.v.z"], pressed),
    "operator_arm": (["H.r.z", "H.v.z"], shaken_handle),
    "effi_controller": (["axis[1].position"], shaken_axis),
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
    """The tight run. Inputs that move are given for the end of each step, which is 20 times shorter then; a sampled FMU
    takes them at its ticks."""
    inputs = INPUTS.get(fmu.name)
    tight = TIGHT | ({"solver.method": METHODS[fmu.name]} if fmu.name in METHODS else {})
    if not inputs or "port.inputs" not in fmu.variables:
        return run(fmu, tight)
    names, law = inputs
    stop, step, stride = every(fmu)
    H = step / 20.0
    start = {**tight, "port.inputs": "endpoint", "port.order": 3, **dict(zip(names, law(0.0)))}
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
