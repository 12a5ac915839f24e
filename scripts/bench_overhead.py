#!/usr/bin/env python3
"""What single FMI 3.0 calls of our FMUs cost, beside a C library that only copies values (the floor), in one run.

    scripts/build && .venv/bin/python scripts/bench_overhead.py [NAME...]

Measured by the compiled loader: CPU time per call, smallest of seven measurements. Get of one and of all outputs (nothing
has changed in between: they are in the list), Set of one and of all continuous inputs to what they are, and doStep where
the FMU has next to nothing to integrate (`load`, `guide`, `bushing`: one step of RK4), else with its default settings.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

from koppel import Fmu, Loader, host, paths, scenes

FLOOR = r"""
#include <stddef.h>
#include <stdint.h>
typedef int status;
static double values[512];
void *fmi3InstantiateCoSimulation() { return values; }
void fmi3FreeInstance(void *i) { (void)i; }
status fmi3EnterInitializationMode() { return 0; }
status fmi3ExitInitializationMode() { return 0; }
status fmi3Terminate() { return 0; }
status fmi3Reset() { return 0; }
status fmi3GetInt64() { return 0; }
status fmi3SetInt32() { return 0; }
status fmi3SetInt64() { return 0; }
status fmi3SetBoolean() { return 0; }
status fmi3SetString() { return 0; }
status fmi3GetFloat64(void *i, const uint32_t vr[], size_t n, double v[], size_t m) {
    for (size_t k = 0; k < n; k++) { if (vr[k] >= 512) return 3; v[k] = ((double *)i)[vr[k]]; }
    return n == m ? 0 : 3;
}
status fmi3SetFloat64(void *i, const uint32_t vr[], size_t n, const double v[], size_t m) {
    for (size_t k = 0; k < n; k++) { if (vr[k] >= 512) return 3; ((double *)i)[vr[k]] = v[k]; }
    return n == m ? 0 : 3;
}
status fmi3DoStep(void *i, double t, double h, _Bool p, _Bool *e, _Bool *x, _Bool *r, double *last) {
    (void)i; (void)p; *e = *x = *r = 0; *last = t + h; return 0;
}
"""
LIGHT = ("load", "guide", "bushing")


def measure(loader: Loader, job: dict) -> dict:
    """The loader's answer to one job."""
    done = subprocess.run([loader.path], input=json.dumps(job), capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


def row(loader: Loader, job: dict, outputs: list[int], inputs: list[int]) -> dict:
    """Times of one library [ns]."""
    job = {**job, "mode": "overhead"}
    one = measure(loader, {**job, "get": outputs[:1], "input_vrs": inputs[:1]})
    every = measure(loader, {**job, "get": outputs, "input_vrs": inputs})
    slope = lambda kind, n: (every[kind]["per_call"] - one[kind]["per_call"]) / max(n - 1, 1) if one[kind] else None
    return {
        "step": one["step_ns"],
        "get one": one["get_ns"]["per_call"],
        "get per further value": slope("get_ns", len(outputs)),
        "set one": one["set_ns"]["per_call"] if one["set_ns"] else None,
        "set per further value": slope("set_ns", len(inputs)),
    }


def floor(loader: Loader, n: int) -> dict:
    """The C library with n outputs and n inputs."""
    with tempfile.TemporaryDirectory() as folder:
        source, library = Path(folder) / "floor.c", Path(folder) / "floor.so"
        source.write_text(FLOOR, encoding="utf-8")
        subprocess.run(["cc", "-O3", "-shared", "-fPIC", "-std=gnu11", "-w", "-o", library, source], check=True)
        job = {"library": str(library), "token": "", "set": [], "stop": 10.0, "H": 0.01, "repeat": 7, "min_time": 0.05}
        return row(loader, job, list(range(1, n + 1)), list(range(n + 1, 2 * n + 1)))


def ours(loader: Loader, name: str) -> dict:
    """One of our FMUs."""
    with Fmu(paths.fmu(name)) as fmu:
        step = float(fmu.description.defaultExperiment.stepSize)
        start = {**scenes.fixed("rk4", step), "use.energy": False} if name in LIGHT else {}
        of = lambda wanted: [
            v.valueReference
            for v in fmu.description.modelVariables
            if v.type == "Float64" and v.causality == wanted and v.variability == "continuous"
        ]
        outputs = of("output")
        job = loader.job(fmu, start, H=step, stop=100 * step, repeat=7, min_time=0.05)
        return row(loader, job, outputs, of("input")) | {"outputs": len(outputs), "inputs": len(of("input"))}


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help="FMUs; all unless given")
    names = parser.parse_args().names or sorted(path.stem for path in (paths.DIST / "fmi3").glob("*.fmu"))
    loader = Loader()
    for key, fact in host.facts().items():
        print(f"{key}: {fact}")
    columns = ("step", "get one", "get per further value", "set one", "set per further value")
    print(f"\nns, CPU{'':<14}" + "".join(f"{column:>23}" for column in columns))
    table = [("floor (C)", floor(loader, 50))] + [(name, ours(loader, name)) for name in names]
    for name, values in table:
        number = lambda value: "-" if value is None else f"{value:.2f}"
        print(f"{name:<21}" + "".join(f"{number(values[column]):>23}" for column in columns))


if __name__ == "__main__":
    main()
