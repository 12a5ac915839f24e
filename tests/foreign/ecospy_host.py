"""Runs a plan with Ecos: JSON on standard input, samples as JSON on the last line of standard output.

Runs in .foreign/ecospy; knows nothing of our packages. Plan: `components` {name: [archive, {variable: start}]},
`connections` [[from, to], ...] as "component.variable", `outputs`, `H`, `steps`, `every`.
"""

import ctypes
import json
import sys
from pathlib import Path

# the library of Ecos asks the system for libtbb.so.12: the wheel tbb has it
ctypes.CDLL(str(Path(sys.prefix) / "lib" / "libtbb.so.12"), mode=ctypes.RTLD_GLOBAL)
from ecospy import EcosSimulation, EcosSimulationStructure  # noqa: E402 - after its library


def identifier(name: str) -> str:
    """component.variable as Ecos writes it."""
    component, variable = name.split(".", 1)
    return f"{component}::{variable}"


def run(plan: dict) -> list[list[float]]:
    """The outputs at the start and after every `every` steps."""
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
            samples = [read()]
            for _ in range(plan["steps"] // plan["every"]):
                simulation.step(plan["every"])
                samples.append(read())
            return samples


if __name__ == "__main__":
    print(json.dumps(run(json.load(sys.stdin))))
