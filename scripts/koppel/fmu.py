"""Load an FMI 3.0 FMU once and run it: Co-Simulation with exact inputs, or its equations by Model Exchange.

Built on fmpy's low-level layer (`fmpy.fmi3.FMU3Slave`, `FMU3Model`). Everything that is called per step goes through buffers that
are allocated once; numpy looks at the same memory, so no list is built in the loop.

    with Fmu(path) as fmu:
        result = fmu.run({"solver.method": "heun", "solver.step": 0.05}, H=0.05, stop=10.0, outputs=["P.r.z"])
        result["P.r.z"]
"""

import shutil
import statistics
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from xml.etree import ElementTree

import fmpy
import numpy as np

from .calls import TYPES, FmuError, Message, Outcome, Status, Update, Value
from .equations import Equations
from .instance import Block, Instance, Result

__all__ = [
    "Block",
    "Equations",
    "Fmu",
    "FmuError",
    "Instance",
    "LoopTime",
    "Message",
    "Outcome",
    "Result",
    "Status",
    "Update",
    "Value",
    "grid",
]


@dataclass(frozen=True)
class LoopTime:
    """CPU time of the bare doStep loop, per run [s]."""

    cpu_min: float
    cpu_median: float
    runs: int
    steps: int


def grid(start: float, stop: float, H: float) -> np.ndarray:
    """Communication points start + i H; the last one is exactly `stop` (a shorter last step where H does not divide)."""
    if not (H > 0.0 and stop > start):
        raise ValueError(f"need H > 0 and stop > start, got H = {H}, start = {start}, stop = {stop}")
    steps = int(np.ceil((stop - start) / H - 1e-9))
    t = start + np.arange(steps + 1) * H
    t[-1] = stop
    return t


class Fmu:
    """An unpacked FMU and its description. Instances are made by `instantiate`, whole runs by `run`."""

    def __init__(self, path: str | Path):
        self.path = Path(path)
        self.folder = Path(fmpy.extract(str(self.path)))
        self.description = fmpy.read_model_description(str(self.folder))
        self.name = self.description.modelName
        if self.description.coSimulation is None:
            raise ValueError(f"{self.path.name} has no Co-Simulation interface")
        self.variables = {variable.name: variable for variable in self.description.modelVariables}
        #: Int64 locals `solver.*`, read at the end of every run.
        self.counters = [
            name
            for name, variable in self.variables.items()
            if name.startswith("solver.") and variable.type == "Int64" and variable.causality == "local"
        ]

    def __enter__(self) -> "Fmu":
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        """Remove the unpacked files."""
        shutil.rmtree(self.folder, ignore_errors=True)

    @property
    def library(self) -> Path:
        """The shared library for this platform."""
        identifier = self.description.coSimulation.modelIdentifier
        return self.folder / "binaries" / fmpy.platform_tuple / (identifier + fmpy.sharedLibraryExtension)

    @property
    def resources(self) -> Path:
        """Folder with the resources."""
        return self.folder / "resources"

    def capability(self, attribute: str) -> bool:
        """A flag of the CoSimulation element, false unless declared (fmpy reads some of them under FMI 2.0 names)."""
        return self._co_simulation.get(attribute, "false") in ("true", "1")

    @cached_property
    def _co_simulation(self) -> dict[str, str]:
        return ElementTree.parse(self.folder / "modelDescription.xml").getroot().find("CoSimulation").attrib

    def variable(self, name: str):
        """Description of a variable."""
        if name not in self.variables:
            close = [other for other in self.variables if other.split(".")[0] == name.split(".")[0]]
            hint = f"; known there: {', '.join(close[:12])}" if close else ""
            raise KeyError(f"{self.name} has no variable {name!r}{hint}")
        return self.variables[name]

    @cached_property
    def _dependencies(self) -> dict[str, frozenset[str] | None]:
        return {
            unknown.variable.name: None
            if unknown.dependencies is None
            else frozenset(known.name for known in unknown.dependencies)
            for unknown in self.description.outputs
        }

    def dependencies(self, output: str) -> frozenset[str] | None:
        """Inputs and states that an output is declared to depend on; None: on any of them."""
        return self._dependencies.get(output)

    def item(self, name: str, value: Value) -> str:
        """Name of the item that an enumeration variable has at this value (its number or name)."""
        numbers = {int(item.value): item.name for item in self.variable(name).declaredType.items}
        return value if isinstance(value, str) and value in numbers.values() else numbers[int(value)]

    def names(self, causality: str) -> list[str]:
        """Names of all Float64 variables with this causality."""
        return [v.name for v in self.description.modelVariables if v.causality == causality and v.type == "Float64"]

    def nominal(self, name: str) -> float:
        """Nominal value, 1 unless declared."""
        value = self.variable(name).nominal
        return 1.0 if value is None else float(value)

    def coded(self, name: str, value: Value):
        """The value as the C function takes it: enumeration items become their number, text becomes bytes."""
        variable = self.variable(name)
        if variable.type == "Enumeration" and isinstance(value, str):
            items = {item.name: int(item.value) for item in variable.declaredType.items}
            if value not in items:
                raise ValueError(f"{name} has no item {value!r}; offered: {', '.join(items)}")
            return items[value]
        if variable.type == "String":
            return str(value).encode()
        return value

    def grouped(self, values: Mapping[str, Value]) -> dict[str, list[tuple[str, Value]]]:
        """Values by the type of their Set function, in the given order."""
        groups: dict[str, list[tuple[str, Value]]] = {}
        for name, value in values.items():
            suffix, _ = TYPES[self.variable(name).type]
            groups.setdefault(suffix, []).append((name, self.coded(name, value)))
        return groups

    def instantiate(self, event_mode: bool = False, logging: bool = False, name: str = "instance") -> "Instance":
        """A new instance in state Instantiated."""
        return Instance(self, event_mode, logging, name)

    def equations(self, logging: bool = False, name: str = "instance") -> "Equations":
        """A new Model Exchange instance in state Instantiated."""
        return Equations(self, logging, name)

    def run(
        self,
        start_values: Mapping[str, Value] | None = None,
        *,
        H: float,
        stop: float,
        outputs: Iterable[str] = (),
        inputs: tuple[Sequence[str], Callable[[float], Sequence[float]]] | None = None,
        start: float = 0.0,
    ) -> Result:
        """A fresh instance from `start` to `stop`, sampled at every communication point.

        `inputs = (names, values_at)`: before each step the named inputs are set to `values_at(t)` (t: its start).
        """
        with self.instantiate() as instance:
            instance.initialise(start_values or {}, start=start, stop=stop)
            return instance.run(grid(start, stop, H), list(outputs), inputs)

    def time_loop(
        self,
        start_values: Mapping[str, Value] | None = None,
        *,
        H: float,
        stop: float,
        start: float = 0.0,
        repeats: int = 7,
        min_time: float = 0.05,
    ) -> LoopTime:
        """CPU time of the doStep loop alone: nothing is recorded, initialisation is outside the timer.

        One warm-up run is dropped; each of `repeats` measurements sums whole runs until it has `min_time`.
        """
        t = grid(start, stop, H)
        per_run = []
        runs = 0
        with self.instantiate() as instance:
            for measurement in range(-1, repeats):
                spent, count = 0.0, 0
                while count == 0 or (spent < min_time and measurement >= 0):
                    if runs:
                        instance.reset()
                    instance.initialise(start_values or {}, start=start, stop=stop)
                    spent += instance.loop(t)
                    count += 1
                    runs += 1
                if measurement >= 0:
                    per_run.append(spent / count)
        return LoopTime(min(per_run), statistics.median(per_run), runs, len(t) - 1)
