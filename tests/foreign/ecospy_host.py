"""Runs a plan with Ecos: JSON on standard input, samples as JSON on the last line of standard output.

Runs in .foreign/ecospy; knows nothing of our packages. Plan: `components` {name: [archive, {variable: start}]},
`connections` [[from, to], ...] as "component.variable", `outputs`, `H`, `steps`, `every`. With `repeat`: as many runs, and
the wall time of the steps of each beside the samples of the last, {"samples": ..., "seconds": [...]}.
"""

import ctypes
import json
import sys
import time
from pathlib import Path

# the library of Ecos asks the system for libtbb.so.12: the wheel tbb has it
ctypes.CDLL(str(Path(sys.prefix) / "lib" / "libtbb.so.12"), mode=ctypes.RTLD_GLOBAL)
from ecospy import EcosSimulation, EcosSimulationStructure  # noqa: E402 - after its library


def identifier(name: str) -> str:
    """component.variable as Ecos writes it."""
    component, variable = name.split(".", 1)
    return f"{component}::{variable}"


def run(plan: dict) -> tuple[list[list[float]], float]:
    """The outputs at the start and after every `every` steps, and the wall time of the steps [s]."""
    with EcosSimulationStructure() as structure:
        for name, (archive, _) in plan["components"].items():
            structure.add_model(name, archive)
        for source, sink in plan["connections"]:
            structure.make_real_connection(identifier(source), identifier(sink))
        start = {
            f"{name}::{variable}": value
            for name, (_, values) in plan["components"].items()
            for variable, value in values.items()
        }
        if not structure.add_parameter_set("start", start):
            raise RuntimeError("the start values are not accepted")
        with EcosSimulation(structure=structure, step_size=plan["H"]) as simulation:
            simulation.init(parameter_set="start")
            outputs = [identifier(name) for name in plan["outputs"]]
            read = lambda: [simulation.get_real(name) for name in outputs]
            samples, seconds = [read()], 0.0
            for _ in range(plan["steps"] // plan["every"]):
                begin = time.perf_counter()
                simulation.step(plan["every"])
                seconds += time.perf_counter() - begin
                samples.append(read())
            return samples, seconds


def main(plan: dict):
    """Carry out the plan."""
    if "repeat" not in plan:
        print(json.dumps(run(plan)[0]))
        return
    runs = [run(plan) for _ in range(plan["repeat"])]
    print(json.dumps({"samples": runs[-1][0], "seconds": [seconds for _, seconds in runs]}))


if __name__ == "__main__":
    main(json.load(sys.stdin))
