"""`python -m koppel.demo`: the paper's double wishbone through fmpy as one FMU and as coupled elements, and the report."""

import csv
import sys
from pathlib import Path

import numpy as np

from . import host, library, paths, plots, report, scenes, work_precision
from .fmu import Fmu, FmuError, Result
from .loader import Loader, LoaderError
from .reference import BadReference, Reference
from .scene import SceneError, plot, study
from .scene.study import Method, Point

SYSTEM = "double_wishbone"
STOP = 10.0

#: Methods of the coupled elements with their steps or tolerances; the paper's own way comes first.
COUPLED = (
    (Method("common heun", {"method": "common", "integrator": "heun"}), (50e-3, 10e-3, 2.5e-3)),
    (Method("common rk4", {"method": "common", "integrator": "rk4"}), (50e-3, 25e-3, 10e-3, 5e-3)),
    (Method("common dopri5", {"method": "common", "integrator": "dopri5"}, adaptive=True), (1e-4, 1e-6, 1e-8)),
    (Method("cs predict", {"method": "cs-predict", "order": 1}), (5e-3, 2.5e-3, 1e-3)),
    (Method("cs pece k = 2", {"method": "cs-pece", "order": 2}), (5e-3, 2.5e-3)),
)


def coupled(out: Path) -> list[Point]:
    """The same case with every element an FMU of its own, printed as it goes, with its table and plots."""
    with library.scene(SYSTEM) as scene:
        parts = ", ".join(component.fmu.name for component in scene.components.values())
        print(f"\nthe same from separate FMUs ({parts}), loop closed at the carrier's upper joint")
        print(study.HEADER, flush=True)
        points: list[Point] = []
        for method, values in COUPLED:
            where = {"tolerances": values, "steps": ()} if method.adaptive else {"steps": values}
            points += scene.study(
                methods=[method], repeat=3, each=lambda point: print(study.line(point), flush=True), **where
            )
    study.write_csv(points, out / "coupled.csv", host.facts())
    plot.work_precision(points, out)
    return points


def write_result(path: Path, runs: dict[str, Result], reference: Reference):
    """result.csv: the paper's run in full, then theta1 of the other methods and every signal of the reference."""
    first, others = next(iter(runs.items()))[1], list(runs.items())[1:]
    columns = {"t": first.t, **{name: first[name] for name in first.names}}
    for method, result in others:
        columns[f"{method}:{plots.THETA}"] = result[plots.THETA]
    for name in first.names:
        if name in reference.variables:
            columns[f"reference:{name}"] = reference[name]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        writer.writerows([f"{value:.15g}" for value in row] for row in np.column_stack(list(columns.values())))


def loaded(fmu: Fmu, recorded: list[str]) -> report.Loaded:
    """What of the product took part in the run."""
    parts = {}
    with fmu.instantiate() as instance:
        instance.initialise({})
        for name, variable in fmu.variables.items():
            if variable.type == "Boolean" and name.startswith("use."):
                parts[name] = "on" if instance.get(name) else "off"
            elif variable.type == "Enumeration" and variable.causality == "parameter":
                parts[name] = {int(i.value): i.name for i in variable.declaredType.items}[instance.get(name)]
    parts.pop("solver.method", None)
    available = [folder for folder in (paths.ROOT / "fmus").iterdir() if (folder / "Cargo.toml").is_file()]
    return report.Loaded(
        fmus=(1, len(available)),
        variables_recorded=(len(recorded), len(fmu.names("output"))),
        inputs_connected=(0, len(fmu.names("input"))),
        parts=parts,
    )


def main():
    """Run everything and print the table; the last line is the report's path."""
    out = paths.OUT / SYSTEM
    out.mkdir(parents=True, exist_ok=True)
    reference = Reference.named("wishbone_paper")
    amplitude = reference.amplitude(plots.THETA)
    loader = Loader()
    with Fmu(paths.fmu(SYSTEM)) as fmu:
        outputs = fmu.names("output")
        runs = {
            method: fmu.run(scenes.fixed(method, work_precision.H), H=work_precision.H, stop=STOP, outputs=outputs)
            for method in ("heun", "rk4")
        }
        write_result(out / "result.csv", runs, reference)
        plots.figure18(reference, runs, out / "figure18.png")
        error = reference.error_of(runs["heun"])

        print(
            f"double wishbone, {STOP:g} s, force at the wheel 10 N sin(10 rad/s t), communication step {work_precision.H} s"
        )
        print(f"reference: {reference.path.relative_to(paths.ROOT)}, amplitude of theta1 {amplitude:.6e} rad\n")
        print(work_precision.HEADER)
        print(work_precision.UNITS, flush=True)
        points = work_precision.study(
            fmu, loader, reference, each=lambda point: print(work_precision.line(point), flush=True), stop=STOP
        )
        orders = {point.method: point.order for point in points}
        print(
            "\nfitted order: "
            + ", ".join(f"{method} {report.number(order, '.2f')}" for method, order in orders.items())
        )
        print("CPU in FMU: compiled loader; CPU fmpy: the same loop from Python; both without recording, minimum of 7")
        for tool, solver, time in report.PAPER_TABLE:
            print(f"paper, table 1: {tool + ' ' + solver:<28}{time * 1e3:>8.0f} ms  ({report.PAPER_MACHINE})")

        work_precision.write_csv(points, out / "work_precision.csv")
        plots.work_precision(points, amplitude, out / "work_precision.png")
        report.double_wishbone(
            out / "report.html",
            points=points,
            coupled=coupled(out),
            error=error,
            amplitude=amplitude,
            source=[line.removeprefix("source: ") for line in reference.source if line.startswith("source: ")],
            loaded=loaded(fmu, outputs),
            facts=host.facts(),
            figure18=out / "figure18.png",
            work_precision=out / "work_precision.png",
            coupled_plot=out / "error_over_time.png",
        )
    print(f"\nreport: {out / 'report.html'}")


if __name__ == "__main__":
    try:
        main()
    except (FmuError, LoaderError, BadReference, SceneError, FileNotFoundError) as failed:
        sys.exit(f"error: {failed}")
