"""What FMI calls take and give: types, statuses, messages, errors."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

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


@dataclass(frozen=True)
class Update:
    """What updateDiscreteStates answered."""

    again: bool
    terminate: bool
    #: Values of continuous states have changed.
    moved: bool
    #: Time of the next time event, infinity if there is none.
    next_event: float


# FMI type -> (suffix of the Get/Set functions, ctypes type)
TYPES = {
    "Float64": ("Float64", fmi3.fmi3Float64),
    "Int32": ("Int32", fmi3.fmi3Int32),
    "Int64": ("Int64", fmi3.fmi3Int64),
    "Enumeration": ("Int64", fmi3.fmi3Int64),
    "Boolean": ("Boolean", fmi3.fmi3Boolean),
    "String": ("String", fmi3.fmi3String),
}
