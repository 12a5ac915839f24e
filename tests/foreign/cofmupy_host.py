"""Runs a plan with CoFMPy: JSON on standard input, samples as JSON on the last line of standard output.

Runs in .foreign/cofmupy; knows nothing of our packages. The plan is that of ecospy_host.py. CoFMPy passes no values along
the connections before the first step: the plan's start values hold those of the inputs.
"""

import json
import sys
import tempfile
from pathlib import Path

from cofmupy import Coordinator


def run(plan: dict) -> list[list[float]]:
    """The outputs after every `every` steps; before the first step there are none."""
    end = lambda name: dict(zip(("id", "variable"), name.split(".", 1)), unit="", type="fmu")
    configuration = {
        "fmus": [
            {"id": name, "path": archive, "initialization": start}
            for name, (archive, start) in plan["components"].items()
        ],
        "connections": [{"source": end(source), "target": end(sink)} for source, sink in plan["connections"]],
        "cosim_method": "jacobi",
        "iterative": False,
        "root": "",
    }
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scene.json"
        path.write_text(json.dumps(configuration), encoding="utf-8")
        coordinator = Coordinator()
        coordinator.start(str(path))
        outputs = [tuple(name.split(".", 1)) for name in plan["outputs"]]
        samples = []
        for step in range(1, plan["steps"] + 1):
            coordinator.do_step(plan["H"])
            if step % plan["every"] == 0:
                samples.append([coordinator.get_variable(name)[0] for name in outputs])
        return samples


if __name__ == "__main__":
    print(json.dumps(run(json.load(sys.stdin))))
