#!/usr/bin/env python3
"""What hosts need per FMU and communication step on the chain of two links, with the error beside it, in one run.

    scripts/build && scripts/foreign && .venv/bin/python scripts/bench_hosts.py

All exchange the same values with linear inputs (Jacobi): the program `koppel`, Ecos (bulk stepping), a bare loop of fmpy and
the Python twin; the FMUs take one step of RK4 per H. Wall time of the step loop alone, nothing recorded, the smallest of the
runs. The last row is `koppel` with a C library in place of both FMUs that only copies values: what the host itself needs.
"""

import argparse
import json
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path
from time import perf_counter

sys.path.insert(0, str(Path(__file__).resolve().parent))

import fmpy
import numpy as np
from fmpy.fmi3 import FMU3Slave
from koppel import host, library, paths, scenes

STOP, FMUS = 2.0, 2
STEPS = (5e-3, 1.25e-3)
OUTPUTS = [f"{link}.{state}" for link in ("upper", "lower") for state in ("angle.theta", "angle_rate.theta")]
# angles from hanging: the published end of the double pendulum
END = np.array([-0.08275830682, -0.96114544454, 0.40736207491, 11.89895505304])
FLOOR = r"""
#include <stddef.h>
#include <stdint.h>
typedef struct { double values[1024]; } instance;
static instance all[64];
static int used;
void *fmi3InstantiateCoSimulation() { return &all[used++ % 64]; }
void fmi3FreeInstance(void *i) { (void)i; }
int fmi3GetFloat64(void *i, const uint32_t vr[], size_t n, double v[], size_t m) {
    for (size_t k = 0; k < n; k++) { if (vr[k] >= 1024) return 3; v[k] = ((instance *)i)->values[vr[k]]; }
    return n == m ? 0 : 3;
}
int fmi3SetFloat64(void *i, const uint32_t vr[], size_t n, const double v[], size_t m) {
    for (size_t k = 0; k < n; k++) { if (vr[k] >= 1024) return 3; ((instance *)i)->values[vr[k]] = v[k]; }
    return n == m ? 0 : 3;
}
int fmi3DoStep(void *i, double t, double h, _Bool p, _Bool *e, _Bool *x, _Bool *r, double *last) {
    (void)i; (void)p; *e = *x = *r = 0; *last = t + h; return 0;
}
"""
SILENT = ("EnterInitializationMode", "ExitInitializationMode", "Terminate", "Reset")
SILENT += ("SetInt32", "SetInt64", "SetBoolean")


def error(end) -> float:
    """Largest error of angles and rates at the end, angles from the horizontal [rad, rad/s]."""
    return float(np.abs(np.array(end) + [0.5 * np.pi, 0.0, 0.5 * np.pi, 0.0] - END).max())


def native(H: float, repeat: int, fmus: Path) -> tuple[float, float]:
    """The program `koppel`: seconds and error."""
    program, scene = paths.DIST / "bin" / "koppel", paths.ROOT / "scenes" / "double_pendulum"
    command = [program, "simulate", scene, "--method", "jacobi", "--H", str(H), "--interval", str(STOP), "--json"]
    command += ["--fmus", fmus, "--set", "*.solver.method=rk4", "--set", f"*.solver.step={H}"]
    runs = [json.loads(subprocess.run(command, capture_output=True, check=True).stdout) for _ in range(repeat)]
    return min(run["cost"]["steps"]["seconds"] for run in runs), error([runs[0]["values"][name] for name in OUTPUTS])


def floor(folder: Path) -> Path:
    """A folder with a `link2` that only copies values."""
    source, made = paths.fmu("link2"), folder / "link2.fmu"
    code = FLOOR + "".join(f"int fmi3{name}() {{ return 0; }}\n" for name in SILENT)
    (folder / "floor.c").write_text(code, encoding="utf-8")
    command = ["cc", "-O3", "-shared", "-fPIC", "-std=gnu11", "-w", "-o", folder / "floor.so", folder / "floor.c"]
    subprocess.run(command, check=True)
    with zipfile.ZipFile(source) as old, zipfile.ZipFile(made, "w") as new:
        for name in old.namelist():
            is_library = name.endswith("/link2.so")
            new.writestr(name, (folder / "floor.so").read_bytes() if is_library else old.read(name))
    return folder


def twin(H: float, repeat: int) -> tuple[float, float]:
    """The Python twin."""
    with library.scene("double_pendulum") as scene:
        options = {"method": "jacobi", "H": H, "values": scenes.fixed("rk4", H)}
        end = scene.run(**options).values[-1]
        return min(scene.run(record=False, **options).wall for _ in range(repeat)), error(end)


def coupled() -> tuple[list[tuple[str, str]], dict[str, dict]]:
    """Connections of the scene as pairs `component.variable`, and the values of its components."""
    with library.scene("double_pendulum") as scene:
        pairs = [(".".join(c.source), ".".join(c.target)) for c in scene.connections]
        return pairs, {name: dict(component.values) for name, component in scene.components.items()}


def ecos(H: float, repeat: int) -> tuple[float, float]:
    """Ecos, all steps by one call."""
    pairs, values = coupled()
    steps = round(STOP / H)
    inner = {"solver.step": H}
    plan = {
        "components": {name: [str(paths.fmu("link2")), {**of, **inner}] for name, of in values.items()},
        "connections": pairs,
        "outputs": OUTPUTS,
        "H": H,
        "steps": steps,
        "every": steps,
        "repeat": repeat,
    }
    python = paths.ROOT / ".foreign" / "ecospy" / "bin" / "python"
    program = paths.ROOT / "tests" / "foreign" / "ecospy_host.py"
    done = subprocess.run([python, program], input=json.dumps(plan), capture_output=True, text=True, check=True)
    answer = json.loads(done.stdout.splitlines()[-1])
    return min(answer["seconds"]), error(answer["samples"][-1])


class Link:
    """A link behind fmpy's functions."""

    def __init__(self, name: str, folder: str, description, start: dict, pairs):
        self.name, self.reference = name, {v.name: v.valueReference for v in description.modelVariables}
        identifier = description.coSimulation.modelIdentifier
        token = description.instantiationToken
        self.slave = FMU3Slave(guid=token, unzipDirectory=folder, modelIdentifier=identifier, instanceName=name)
        self.slave.instantiate()
        for variable, value in start.items():
            self.slave.setFloat64([self.reference[variable]], [value])
        local = lambda full: self.reference[full.split(".", 1)[1]]
        mine = lambda full: full.split(".", 1)[0] == name
        self.gives = [(source, local(source)) for source, _ in pairs if mine(source)]
        self.takes = [(source, local(target)) for source, target in pairs if mine(target)]
        self.inputs, self.outputs = [r for _, r in self.takes], [r for _, r in self.gives]

    def take(self, values: dict[str, float]):
        """Inputs from the values of all outputs."""
        self.slave.setFloat64(self.inputs, [values[source] for source, _ in self.takes])

    def give(self, values: dict[str, float]):
        """Outputs into the values."""
        values.update(zip((source for source, _ in self.gives), self.slave.getFloat64(self.outputs)))


def bare(H: float, repeat: int) -> tuple[float, float]:
    """A loop over fmpy's functions: doStep, Get, Set."""
    pairs, values = coupled()
    folder = fmpy.extract(str(paths.fmu("link2")))
    try:
        description = fmpy.read_model_description(folder)
        runs = [_bare_run(H, pairs, values, folder, description) for _ in range(repeat)]
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    return min(seconds for seconds, _ in runs), runs[0][1]


def _bare_run(H: float, pairs, start: dict, folder: str, description) -> tuple[float, float]:
    links = [Link(name, folder, description, {**of, "solver.step": H}, pairs) for name, of in start.items()]
    values: dict[str, float] = {}
    for link in links:
        link.slave.enterInitializationMode(startTime=0.0)
    # as many passes as the longest way: motion, load, acceleration
    for _ in range(3):
        for link in links:
            link.give(values)
        for link in links:
            link.take(values)
    for link in links:
        link.slave.exitInitializationMode()
    begin = perf_counter()
    for step in range(round(STOP / H)):
        for link in links:
            link.slave.doStep(step * H, H)
        for link in links:
            link.give(values)
        for link in links:
            link.take(values)
    seconds = perf_counter() - begin
    of = {link.name: link for link in links}
    parts = [name.split(".", 1) for name in OUTPUTS]
    states = [of[link].slave.getFloat64([of[link].reference[state]])[0] for link, state in parts]
    for link in links:
        link.slave.freeInstance()
    return seconds, error(states)


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeat", type=int, default=15, help="runs of each host (default 15)")
    repeat = parser.parse_args().repeat
    for key, fact in host.facts().items():
        print(f"{key}: {fact}")
    print(f"\n{'host':<22}{'H/s':>10}{'us per FMU and step':>22}{'error at 2 s':>15}")
    with tempfile.TemporaryDirectory() as folder:
        copies = floor(Path(folder))
        hosts = {
            "koppel": lambda H: native(H, repeat, paths.DIST / "fmi3"),
            "Ecos, bulk": lambda H: ecos(H, repeat),
            "fmpy, bare loop": lambda H: bare(H, repeat),
            "Python twin": lambda H: twin(H, repeat),
            "koppel, values only": lambda H: (native(H, repeat, copies)[0], None),
        }
        for name, measure in hosts.items():
            for H in STEPS:
                seconds, wrong = measure(H)
                each = seconds / (FMUS * round(STOP / H)) * 1e6
                beside = "-" if wrong is None else f"{wrong:.2e}"
                print(f"{name:<22}{H:>10g}{each:>22.3f}{beside:>15}", flush=True)


if __name__ == "__main__":
    main()
