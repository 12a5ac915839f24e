"""An FMU instance: Get and Set through buffers that are made once, phases, steps, saved states, derivatives."""

import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from ctypes import byref, c_size_t, c_uint8
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import fmpy
import numpy as np
from fmpy import fmi3

from .calls import TYPES, FmuError, Message, Outcome, Status, Update, Value

if TYPE_CHECKING:
    from .fmu import Fmu


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

    def __init__(self, fmu: "Fmu", event_mode: bool = False, logging: bool = False, name: str = "instance"):
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
