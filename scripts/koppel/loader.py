"""The compiled loader: runs an FMU without an interpreter in the loop, so that its CPU time is the FMU's."""

import json
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from . import paths
from .fmu import Fmu, Result, Value

#: A measurement that takes longer than this hangs [s].
TIMEOUT = 600.0


class LoaderError(RuntimeError):
    """The loader or the FMU inside it failed."""

    def __init__(self, model: str, answer: dict):
        at = "" if answer.get("time") is None else f" at t = {answer['time']} s"
        said = "".join(f"\n  {message}" for message in answer.get("messages") or ["(no message)"])
        super().__init__(f"{model} in the loader: {answer.get('function')} returned {answer.get('status')}{at}{said}")
        self.answer = answer


@dataclass(frozen=True)
class Timing:
    """Times per run of the doStep loop [s] and counters at its end."""

    cpu_min: float
    cpu_median: float
    wall_min: float
    wall_median: float
    runs: int
    steps: int
    counts: dict[str, int]
    samples: Result


class Loader:
    """`dist/bin/fmu-loader`: one job as JSON on standard input, one answer as JSON on standard output."""

    def __init__(self, path: Path | None = None):
        self.path = path or paths.loader()

    def job(
        self,
        fmu: Fmu,
        start_values: Mapping[str, Value] | None = None,
        *,
        H: float,
        stop: float,
        outputs: Sequence[str] = (),
        start: float = 0.0,
        repeat: int = 7,
        min_time: float = 0.05,
        sample_every: int = 1,
        mode: str = "run",
    ) -> dict:
        """The job as the loader reads it."""
        values = []
        for suffix, group in fmu.grouped(start_values or {}).items():
            for name, value in group:
                value = value.decode() if isinstance(value, bytes) else value
                values.append({"vr": fmu.variable(name).valueReference, "type": suffix, "value": value})
        return {
            "library": str(fmu.library),
            "token": fmu.description.instantiationToken,
            "resources": f"{fmu.resources}/",
            "set": values,
            "start": start,
            "stop": stop,
            "H": H,
            "get": [fmu.variable(name).valueReference for name in outputs],
            "repeat": repeat,
            "min_time": min_time,
            "sample_every": sample_every,
            "count": [fmu.variable(name).valueReference for name in fmu.counters],
            "mode": mode,
        }

    def run(
        self, fmu: Fmu, start_values: Mapping[str, Value] | None = None, *, outputs: Sequence[str] = (), **options
    ) -> Timing:
        """Time the FMU; `outputs` are sampled in a run of their own, outside the timer."""
        job = self.job(fmu, start_values, outputs=outputs, **options)
        done = subprocess.run(
            [self.path], input=json.dumps(job), capture_output=True, text=True, timeout=TIMEOUT, check=False
        )
        try:
            answer = json.loads(done.stdout)
        except json.JSONDecodeError as bad:
            raise LoaderError(
                fmu.name,
                {
                    "function": f"the loader ended with exit code {done.returncode} and no JSON; it",
                    "status": "nothing readable",
                    "messages": [line for line in (done.stdout + done.stderr).splitlines()[-10:] if line],
                },
            ) from bad
        if done.returncode != 0:
            raise LoaderError(fmu.name, answer)
        samples = np.array(answer["samples"], dtype=float).reshape(-1, 1 + len(outputs))
        counts = dict(zip(fmu.counters, (int(count) for count in answer["counts"])))
        return Timing(
            cpu_min=answer["cpu_min"],
            cpu_median=answer["cpu_median"],
            wall_min=answer["wall_min"],
            wall_median=answer["wall_median"],
            runs=answer["runs"],
            steps=answer["steps"],
            counts=counts,
            samples=Result(
                samples[:, 0], list(outputs), samples[:, 1:], {name: fmu.nominal(name) for name in outputs}, counts
            ),
        )
