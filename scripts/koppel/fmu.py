"""Load an FMI 3.0 FMU once and run it: Co-Simulation with exact inputs, or its equations by Model Exchange.

Built on fmpy's low-level layer (`fmpy.fmi3.FMU3Slave`, `FMU3Model`). Everything that is called per step goes through buffers that
are allocated once; numpy looks at the same memory, so no list is built in the loop.

    with Fmu(path) as fmu:
        result = fmu.run({"solver.method": "heun", "solver.step": 0.05}, H=0.05, stop=10.0, outputs=["P.r.z"])
        result["P.r.z"]
"""

import shutil
import statistics
import time
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from ctypes import byref, c_size_t, c_uint8
from dataclasses import dataclass, field
from enum import IntEnum
from functools import cached_property
from pathlib import Path
from xml.etree import ElementTree

import fmpy
import numpy as np
from fmpy import fmi3

Value = float | int | bool | str


class Status(IntEnum):
    """fmi3Status."""

    OK = 0
    WARNING = 1
    DISCARD = 2
    ERROR = 3
    FATAL = 4


@dataclass(frozen=True)
class Message:
    """One call of the FMU's logger."""

    status: Status
    category: str
    text: str

    def __str__(self):
        return f"[{self.status.name}] {self.text}"


class FmuError(RuntimeError):
    """An FMI call ended in Discard, Error or Fatal."""

    def __init__(self, model: str, function: str, status: Status, messages: Sequence[Message], at: float | None = None):
        when = "" if at is None else f" at t = {at:.9g} s"
        said = "".join(f"\n  {message}" for message in messages) or "\n  (the FMU logged nothing)"
        super().__init__(f"{model}: {function} returned {status.name}{when}{said}")
        self.function = function
        self.status = status
        self.messages = list(messages)
        self.time = at


@dataclass(frozen=True)
class Outcome:
    """Status of one call and what the FMU logged meanwhile."""

    status: Status
    messages: list[Message]

    @property
    def text(self) -> str:
        """All messages in one string."""
        return "\n".join(message.text for message in self.messages)


@dataclass
class Result:
    """Samples of one run: `result[name]` is an array over `result.t`."""

    t: np.ndarray
    names: list[str]
    values: np.ndarray
    #: Nominal value of each recorded variable.
    nominal: dict[str, float]
    #: Counters (`solver.*`, Int64) at the end of the run.
    counts: dict[str, int]
    messages: list[Message] = field(default_factory=list)

    def __getitem__(self, name: str) -> np.ndarray:
        return self.values[:, self.names.index(name)]

    def __contains__(self, name: str) -> bool:
        return name in self.names


@dataclass(frozen=True)
class Update:
    """What updateDiscreteStates answered."""

    again: bool
    terminate: bool
    #: Values of continuous states have changed.
    moved: bool
    #: Time of the next time event, infinity if there is none.
    next_event: float


@dataclass(frozen=True)
class LoopTime:
    """CPU time of the bare doStep loop, per run [s]."""

    cpu_min: float
    cpu_median: float
    runs: int
    steps: int


# FMI type -> (suffix of the Get/Set functions, ctypes type)
TYPES = {
    "Float64": ("Float64", fmi3.fmi3Float64),
    "Int32": ("Int32", fmi3.fmi3Int32),
    "Int64": ("Int64", fmi3.fmi3Int64),
    "Enumeration": ("Int64", fmi3.fmi3Int64),
    "Boolean": ("Boolean", fmi3.fmi3Boolean),
    "String": ("String", fmi3.fmi3String),
}


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
        element = ElementTree.parse(self.folder / "modelDescription.xml").getroot().find("CoSimulation")
        return element.get(attribute, "false") in ("true", "1")

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


def _nothing():
    """Get and Set of no variables."""


class Block:
    """Prepared Get and Set of variables of one type; `values` is the buffer itself, seen by numpy.

    `memory`: a contiguous array to be used as buffer, of the type's size.
    """

    def __init__(
        self,
        instance: "Instance",
        names: Sequence[str],
        type_name: str = "Float64",
        memory: np.ndarray | None = None,
    ):
        self.names = list(names)
        n = len(self.names)
        for name in self.names:
            if instance.fmu.variable(name).type != type_name:
                raise TypeError(f"{name} is {instance.fmu.variable(name).type}, not {type_name}")
        suffix, ctype = TYPES[type_name]
        references = (fmi3.fmi3ValueReference * n)(*[instance.fmu.variable(name).valueReference for name in self.names])
        if memory is None:
            buffer = (ctype * n)()
            self.values = np.ctypeslib.as_array(buffer) if n else np.empty(0)
        else:
            buffer, self.values = (ctype * n).from_buffer(memory), memory
        arguments = (references, n, buffer, n)
        #: Get and Set of what is in the buffer; nothing is called for an empty block.
        self.get = instance.prepared(f"fmi3Get{suffix}", *arguments) if n else _nothing
        self.set = instance.prepared(f"fmi3Set{suffix}", *arguments) if n else _nothing

    def read(self) -> np.ndarray:
        """Get; returns the buffer (a view, overwritten by the next read)."""
        self.get()
        return self.values

    def write(self, values: Sequence[float] | None = None):
        """Set the given values, or what is in the buffer."""
        if values is not None:
            self.values[:] = values
        self.set()


class Instance:
    """One instance; a context manager that frees it.

    `call` returns status and messages and never raises; `check` raises `FmuError` from Discard upwards.
    """

    INTERFACE = "CoSimulation"

    def __init__(self, fmu: Fmu, event_mode: bool = False, logging: bool = False, name: str = "instance"):
        self.fmu = fmu
        self.event_mode = event_mode
        self.messages: list[Message] = []
        self.time: float | None = None
        #: Calls of each C function so far.
        self.counts: Counter[str] = Counter()
        self._slave = self._open(
            guid=fmu.description.instantiationToken, unzipDirectory=str(fmu.folder), instanceName=name
        )
        self._component = None
        try:
            self._slave.instantiate(loggingOn=logging, logMessage=self._log, **self._options())
        except Exception as failed:  # fmpy has no narrower class for "no instance"
            self._slave.freeLibrary()
            raise FmuError(fmu.name, f"fmi3Instantiate{self.INTERFACE}", Status.ERROR, self.messages) from failed
        self._component = self._slave.component
        # results of doStep and updateDiscreteStates
        self._flags = [fmi3.fmi3Boolean() for _ in range(5)]
        self._last_time = fmi3.fmi3Float64()
        self._step_flags = [*(byref(flag) for flag in self._flags[:3]), byref(self._last_time)]

    def _open(self, **options):
        """The library."""
        return fmi3.FMU3Slave(modelIdentifier=self.fmu.description.coSimulation.modelIdentifier, **options)

    def _options(self) -> dict[str, bool]:
        """What only this interface is instantiated with."""
        return {"eventModeUsed": self.event_mode}

    def _log(self, _environment, status, category, message):
        self.messages.append(Message(Status(status), (category or b"").decode(), (message or b"").decode()))

    def __enter__(self) -> "Instance":
        return self

    def __exit__(self, *_):
        self.free()

    def free(self):
        """Free the instance."""
        if self._component is not None:
            self._component = None
            self._slave.freeInstance()

    # calls --------------------------------------------------------------------------------------------------------
    def call(self, function: str, *arguments) -> Outcome:
        """The C function itself (the instance is added as first argument)."""
        before = len(self.messages)
        self.counts[function] += 1
        status = getattr(self._slave.dll, function)(self._component, *arguments)
        return Outcome(Status(status), self.messages[before:])

    def check(self, function: str, *arguments) -> Status:
        """As `call`, but Discard, Error and Fatal raise."""
        outcome = self.call(function, *arguments)
        if outcome.status > Status.WARNING:
            raise FmuError(self.fmu.name, function, outcome.status, outcome.messages, self.time)
        return outcome.status

    def prepared(self, function: str, *arguments) -> Callable[[], None]:
        """`check` with these arguments as a function of none, for calls in a loop."""
        native, component, counts, messages = (
            getattr(self._slave.dll, function),
            self._component,
            self.counts,
            self.messages,
        )

        def call():
            before = len(messages)
            counts[function] += 1
            status = native(component, *arguments)
            if status > 1:
                raise FmuError(self.fmu.name, function, Status(status), messages[before:], self.time)

        return call

    # values -------------------------------------------------------------------------------------------------------
    def block(self, names: Sequence[str], type_name: str = "Float64", memory: np.ndarray | None = None) -> Block:
        """Prepared access to variables of one type, in `memory` if it is given."""
        return Block(self, names, type_name, memory)

    def try_set(self, name: str, value: Value) -> Outcome:
        """Set one variable; returns status and messages."""
        suffix, ctype = TYPES[self.fmu.variable(name).type]
        reference = (fmi3.fmi3ValueReference * 1)(self.fmu.variable(name).valueReference)
        return self.call(f"fmi3Set{suffix}", reference, 1, (ctype * 1)(self.fmu.coded(name, value)), 1)

    def set(self, values: Mapping[str, Value]):
        """Set variables of any type, one call per type."""
        for suffix, group in self.fmu.grouped(values).items():
            ctype = TYPES[suffix][1]
            n = len(group)
            references = (fmi3.fmi3ValueReference * n)(*[self.fmu.variable(name).valueReference for name, _ in group])
            self.check(f"fmi3Set{suffix}", references, n, (ctype * n)(*[value for _, value in group]), n)

    def get(self, name: str) -> Value:
        """One variable of any type (enumerations as number)."""
        suffix, ctype = TYPES[self.fmu.variable(name).type]
        reference = (fmi3.fmi3ValueReference * 1)(self.fmu.variable(name).valueReference)
        value = (ctype * 1)()
        self.check(f"fmi3Get{suffix}", reference, 1, value, 1)
        return value[0].decode() if suffix == "String" else value[0]

    def get_all(self, names: Sequence[str]) -> dict[str, float]:
        """Float64 variables by name."""
        return dict(zip(names, self.block(names).read().tolist()))

    # phases -------------------------------------------------------------------------------------------------------
    def enter_initialisation(self, start: float = 0.0, stop: float | None = None):
        """Instantiated -> Initialization Mode."""
        self.time = start
        self.check("fmi3EnterInitializationMode", False, 0.0, start, stop is not None, 0.0 if stop is None else stop)

    def exit_initialisation(self):
        """Initialization Mode -> Step Mode (through Event Mode where it is used)."""
        self.check("fmi3ExitInitializationMode")
        if self.event_mode:
            self.update_discrete_states()
            self.check("fmi3EnterStepMode")

    def initialise(self, start_values: Mapping[str, Value], start: float = 0.0, stop: float | None = None):
        """Set the start values and go to Step Mode."""
        self.set(start_values)
        self.enter_initialisation(start, stop)
        self.exit_initialisation()

    def enter_event_mode(self):
        """Step Mode -> Event Mode."""
        self.check("fmi3EnterEventMode")

    def enter_step_mode(self):
        """Event Mode -> Step Mode."""
        self.update_discrete_states()
        self.check("fmi3EnterStepMode")

    def update_once(self) -> Update:
        """One updateDiscreteStates."""
        again, terminate, _nominals, moved, defined = self._flags
        self.check("fmi3UpdateDiscreteStates", *[byref(flag) for flag in self._flags], byref(self._last_time))
        next_event = self._last_time.value if defined.value else np.inf
        return Update(again.value, terminate.value, moved.value, next_event)

    def update_discrete_states(self):
        """updateDiscreteStates until the FMU asks for no more."""
        for _ in range(100):
            if not self.update_once().again:
                return
        raise RuntimeError(f"{self.fmu.name}: the event iteration does not end")

    def try_step(self, t: float, H: float, final: bool = True) -> Outcome:
        """doStep; returns status and messages. `final`: no state from before `t` will be restored."""
        flags = [byref(flag) for flag in self._flags[:3]]
        outcome = self.call("fmi3DoStep", t, H, final, *flags, byref(self._last_time))
        if outcome.status <= Status.WARNING:
            self.time = t + H
        return outcome

    @property
    def event_needed(self) -> bool:
        """eventHandlingNeeded of the last doStep."""
        return self._flags[0].value

    @property
    def last_successful_time(self) -> float:
        """lastSuccessfulTime of the last doStep."""
        return self._last_time.value

    def step(self, t: float, H: float, final: bool = True):
        """doStep; raises from Discard upwards. `final`: no state from before `t` will be restored."""
        self.time = t
        self.check("fmi3DoStep", t, H, final, *self._step_flags)
        self.time = t + H

    def reset(self):
        """Back to Instantiated."""
        self.check("fmi3Reset")
        self.time = None

    # runs ---------------------------------------------------------------------------------------------------------
    def run(self, t: np.ndarray, outputs: list[str], inputs=None) -> Result:
        """Steps along the communication points `t` and records `outputs` at each."""
        block = self.block(outputs)
        values = np.empty((len(t), len(outputs)))
        values[0] = block.read()
        names, values_at = inputs or ((), None)
        feed = self.block(names)
        for i in range(len(t) - 1):
            if values_at is not None:
                feed.write(values_at(t[i]))
            self.step(t[i], t[i + 1] - t[i])
            values[i + 1] = block.read()
        counts = {name: int(self.get(name)) for name in self.fmu.counters}
        nominal = {name: self.fmu.nominal(name) for name in outputs}
        return Result(t, outputs, values, nominal, counts, list(self.messages))

    def loop(self, t: np.ndarray) -> float:
        """The bare doStep loop through fmpy's low-level function; returns its CPU time [s]."""
        do_step, component = self._slave.fmi3DoStep, self._component
        event, terminate, early = (byref(flag) for flag in self._flags[:3])
        last = byref(self._last_time)
        points = t.tolist()
        sizes = np.diff(t).tolist()
        begin = time.process_time_ns()
        try:
            for at, size in zip(points, sizes):
                do_step(component, at, size, True, event, terminate, early, last)
        except fmpy.fmi1.FMICallException as failed:
            raise FmuError(self.fmu.name, failed.function, Status(failed.status), self.messages, at) from failed
        return (time.process_time_ns() - begin) * 1e-9

    # state and derivatives ----------------------------------------------------------------------------------------
    def save(self):
        """getFMUState; give it back to `restore` and `free_state`."""
        state = fmi3.fmi3FMUState()
        self.check("fmi3GetFMUState", byref(state))
        return state, self.time

    def restore(self, saved):
        """setFMUState."""
        state, self.time = saved
        self.check("fmi3SetFMUState", state)

    def free_state(self, saved):
        """freeFMUState."""
        self.check("fmi3FreeFMUState", byref(saved[0]))

    def serialise(self, saved) -> bytes:
        """The saved state as bytes."""
        size = c_size_t()
        self.check("fmi3SerializedFMUStateSize", saved[0], byref(size))
        data = (c_uint8 * size.value)()
        self.check("fmi3SerializeFMUState", saved[0], data, size)
        return bytes(data)

    def deserialise(self, data: bytes, at: float | None):
        """A state for `restore` from bytes."""
        state = fmi3.fmi3FMUState()
        self.check("fmi3DeserializeFMUState", (c_uint8 * len(data))(*data), len(data), byref(state))
        return state, at

    def directional_derivative(
        self, unknowns: Sequence[str], knowns: Sequence[str], seed: Sequence[float]
    ) -> np.ndarray:
        """d(unknowns)/d(knowns) times seed."""
        nu, nk = len(unknowns), len(knowns)
        references = lambda names: (fmi3.fmi3ValueReference * len(names))(
            *[self.fmu.variable(n).valueReference for n in names]
        )
        out = (fmi3.fmi3Float64 * nu)()
        self.check(
            "fmi3GetDirectionalDerivative",
            references(unknowns),
            nu,
            references(knowns),
            nk,
            (fmi3.fmi3Float64 * nk)(*seed),
            nk,
            out,
            nu,
        )
        return np.array(out)


class Equations(Instance):
    """A Model Exchange instance: `x`, `x_dot` and `z` are the buffers of its continuous states, their
    derivatives and the event indicators."""

    INTERFACE = "ModelExchange"

    def __init__(self, fmu: Fmu, logging: bool = False, name: str = "instance"):
        if fmu.description.modelExchange is None:
            raise ValueError(f"{fmu.path.name} has no Model Exchange interface")
        super().__init__(fmu, True, logging, name)
        self.nx, self.nz = self._number("ContinuousStates"), self._number("EventIndicators")
        x, x_dot = (fmi3.fmi3Float64 * self.nx)(), (fmi3.fmi3Float64 * self.nx)()
        z = (fmi3.fmi3Float64 * self.nz)()
        self.x, self.x_dot, self.z = (
            np.ctypeslib.as_array(array) if len(array) else np.empty(0) for array in (x, x_dot, z)
        )
        self._t = fmi3.fmi3Float64()
        self._write_time = self.prepared("fmi3SetTime", self._t)
        self._read_states = self.prepared("fmi3GetContinuousStates", x, self.nx)
        self._write_states = self.prepared("fmi3SetContinuousStates", x, self.nx)
        self._read_derivatives = self.prepared("fmi3GetContinuousStateDerivatives", x_dot, self.nx)
        self._read_indicators = self.prepared("fmi3GetEventIndicators", z, self.nz)

    def _number(self, of: str) -> int:
        count = c_size_t()
        self.check(f"fmi3GetNumberOf{of}", byref(count))
        return count.value

    def _open(self, **options):
        return fmi3.FMU3Model(modelIdentifier=self.fmu.description.modelExchange.modelIdentifier, **options)

    def _options(self):
        return {}

    def exit_initialisation(self):
        """Initialization Mode -> Continuous-Time Mode; `x` is read."""
        self.check("fmi3ExitInitializationMode")
        self.enter_continuous_time_mode()

    def enter_continuous_time_mode(self):
        """Event Mode -> Continuous-Time Mode; `x` is read."""
        self.update_discrete_states()
        self.go_on()

    def go_on(self):
        """Event Mode, with all updates done, -> Continuous-Time Mode; `x` is read."""
        self.check("fmi3EnterContinuousTimeMode")
        self.read_states()

    def read_states(self):
        """Get the states into `x`."""
        if self.nx:
            self._read_states()

    def nominals(self) -> np.ndarray:
        """Nominal values of the states."""
        nominals = (fmi3.fmi3Float64 * self.nx)()
        if self.nx:
            self.check("fmi3GetNominalsOfContinuousStates", nominals, self.nx)
        return np.array(nominals)

    def set_time(self, t: float):
        """SetTime."""
        self.time = self._t.value = t
        self._write_time()

    def write_states(self):
        """Set the states in `x`."""
        if self.nx:
            self._write_states()

    def read_derivatives(self) -> np.ndarray:
        """Get the derivatives; returns `x_dot`."""
        if self.nx:
            self._read_derivatives()
        return self.x_dot

    def read_indicators(self) -> np.ndarray:
        """Get the event indicators; returns `z`."""
        if self.nz:
            self._read_indicators()
        return self.z

    def completed_step(self, final: bool = True) -> bool:
        """completedIntegratorStep; true if the FMU asks for Event Mode."""
        event, terminate = self._flags[:2]
        self.check("fmi3CompletedIntegratorStep", final, byref(event), byref(terminate))
        return event.value
