"""Reference solutions and the error of a run against them."""

import json
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from . import paths
from .fmu import Result

#: Reference column -> variable; columns with a point in them have the variable's name already.
COLUMNS = {
    "theta1": "lower.angle.theta",
    "theta1_dot": "lower.angle_rate.theta",
    "psi": "carrier.angle.psi",
    "psi_dot": "carrier.angle_rate.psi",
    "theta3": "upper.angle.theta",
    "theta3_dot": "upper.angle_rate.theta",
    "q1": "carrier.q[1]",
    "q2": "carrier.q[2]",
    "q3": "carrier.q[3]",
    "q4": "carrier.q[4]",
    "w.x": "carrier.omega.x",
    "w.y": "carrier.omega.y",
    "w.z": "carrier.omega.z",
}
#: The same for files of other systems.
COLUMNS_OF = {
    "four_bar": {
        "theta1": "crank.angle.theta",
        "theta1_dot": "crank.angle_rate.theta",
        "psi": "coupler.angle.theta",
        "psi_dot": "coupler.angle_rate.theta",
        "theta3": "rocker.angle.theta",
        "theta3_dot": "rocker.angle_rate.theta",
        "strut.length": None,
    },
    "double_pendulum": {
        "theta1": "upper.angle.theta",
        "theta1_dot": "upper.angle_rate.theta",
        "theta2": "lower.angle.theta",
        "theta2_dot": "lower.angle_rate.theta",
    },
}
#: Columns that the FMU does not offer as a variable.
WITHOUT_VARIABLE = ("t", "theta1_ddot")

#: Unit and kind of a variable, by the first pattern that fits its name.
KINDS = (
    (r"\.angle\.", "angle", "rad"),
    (r"\.angle_rate\.|\.omega\.", "rate", "rad/s"),
    (r"\.q\[", "quaternion", "1"),
    (r"\.F\.", "force", "N"),
    (r"(^|\.)s(\[\d+\])?$", "position", "m"),
    (r"(^|\.)v(\[\d+\])?$", "velocity", "m/s"),
    (r"\.r\.", "position", "m"),
    (r"\.v\.", "velocity", "m/s"),
    (r"\.a\.", "acceleration", "m/s2"),
    (r"(^|\.)x$", "position", "m"),
    (r"(^|\.)w$", "velocity", "m/s"),
    (r"(^|\.)(F|F1|force|force_command)$", "force", "N"),
    (r"\.bristle$", "position", "m"),
    (r"\.phi$", "angle", "rad"),
    (r"\.phi_rate$", "rate", "rad/s"),
    (r"(^|\.)power$", "power", "W"),
    (r"^strut\.length", "length", "m"),
    (r"^energy\.", "energy", "J"),
)


class BadReference(ValueError):
    """A reference that cannot be read or does not fit the run."""


def kind_of(name: str) -> tuple[str, str]:
    """Kind and unit of a variable."""
    for pattern, kind, unit in KINDS:
        if re.search(pattern, name):
            return kind, unit
    raise BadReference(f"{name}: no kind known for this name")


@dataclass(frozen=True)
class SignalError:
    """Error of one variable over all common samples."""

    name: str
    kind: str
    unit: str
    #: Largest error, its time, and root mean square, in the variable's unit.
    largest: float
    at: float
    rms: float
    #: Scale s = max(max |reference|, nominal) in the variable's unit.
    scale: float

    @property
    def e_max(self) -> float:
        """Largest error over the scale."""
        return self.largest / self.scale

    @property
    def e_rms(self) -> float:
        """Root mean square error over the scale."""
        return self.rms / self.scale


@dataclass(frozen=True)
class Error:
    """Errors of all compared variables."""

    signals: list[SignalError]
    samples: int

    def __getitem__(self, name: str) -> SignalError:
        for signal in self.signals:
            if signal.name == name:
                return signal
        raise KeyError(f"{name} was not compared; compared: {', '.join(s.name for s in self.signals)}")

    def worst(self, kind: str | None = None) -> SignalError:
        """The signal with the largest e_max; with a kind (same unit): with the largest error."""
        if kind is None:
            return max(self.signals, key=lambda signal: signal.e_max)
        return max(self.of(kind), key=lambda signal: signal.largest)

    def of(self, kind: str) -> list[SignalError]:
        """All signals of a kind."""
        signals = [signal for signal in self.signals if signal.kind == kind]
        if not signals:
            raise KeyError(f"no {kind} was compared")
        return signals

    @property
    def e_max(self) -> float:
        """Error of the scene."""
        return self.worst().e_max

    @property
    def e_rms(self) -> float:
        """Largest e_rms of all signals."""
        return max(signal.e_rms for signal in self.signals)

    def table(self) -> str:
        """Which signal, how much, when."""
        rows = [f"{'signal':<26}{'largest':>12}{'unit':>7}{'at t/s':>9}{'rms':>11}{'e_max':>11}{'e_rms':>11}"]
        for s in sorted(self.signals, key=lambda signal: -signal.e_max):
            rows.append(
                f"{s.name:<26}{s.largest:>12.3e}{s.unit:>7}{s.at:>9.3f}{s.rms:>11.2e}{s.e_max:>11.2e}{s.e_rms:>11.2e}"
            )
        return "\n".join(rows)


class Reference:
    """Samples of a reference solution by variable name."""

    def __init__(self, path: Path | str):
        self.path = Path(path)
        if not self.path.is_file():
            raise BadReference(f"reference {self.path} is missing")
        lines = self.path.read_text(encoding="utf-8").splitlines()
        #: Lines that say where the file comes from.
        self.source = [line.lstrip("# ") for line in lines if line.startswith("#")]
        if not any(line.startswith("source:") for line in self.source):
            raise BadReference(f"{self.path.name} does not say where it comes from (no line '# source: ...')")
        data = [line.split(",") for line in lines if line and not line.startswith("#")]
        columns, rows = data[0], data[1:]
        if columns[0] != "t" or any(len(row) != len(columns) for row in rows):
            raise BadReference(f"{self.path.name}: not a table with the columns {','.join(columns)}")
        self.columns = columns
        self.values = np.array(rows, dtype=float)
        if not np.isfinite(self.values).all():
            raise BadReference(f"{self.path.name} holds values that are not finite")
        self.t = self.values[:, 0]
        #: Variable name -> column number.
        names = COLUMNS_OF.get(self.path.stem, COLUMNS)
        offered = [(names.get(c, c), i) for i, c in enumerate(columns) if c not in WITHOUT_VARIABLE]
        self.variables = {name: i for name, i in offered if name is not None}
        parameters = self.path.with_suffix(".json")
        #: Parameters that came with the file.
        self.parameters = json.loads(parameters.read_text(encoding="utf-8")) if parameters.is_file() else {}

    @classmethod
    def sampled(cls, t: np.ndarray, names: list[str], values: np.ndarray, source: str) -> "Reference":
        """Samples that are no file."""
        made = cls.__new__(cls)
        made.path, made.source, made.parameters = Path(source), [f"source: {source}"], {}
        made.columns = ["t", *names]
        made.t, made.values = t, np.column_stack([t, values])
        made.variables = {name: i + 1 for i, name in enumerate(names)}
        return made

    @classmethod
    def named(cls, name: str, system: str = "suspension") -> "Reference":
        """One of the files under tests/reference."""
        return cls(paths.REFERENCE / system / f"{name}.csv")

    @property
    def names(self) -> list[str]:
        """All variables with a reference."""
        return list(self.variables)

    def __getitem__(self, name: str) -> np.ndarray:
        if name not in self.variables:
            raise KeyError(f"{self.path.name} has no {name}; it has {', '.join(self.variables)}")
        return self.values[:, self.variables[name]]

    def amplitude(self, name: str) -> float:
        """Largest deviation from the start value."""
        return float(np.abs(self[name] - self[name][0]).max())

    def error_of(self, result: Result) -> Error:
        """Errors of every recorded variable that has a reference, at the samples they share.

        Samples are never interpolated: each communication point of the run must be a sample of the reference, or each
        sample of the reference a communication point of the run (up to the end of the shorter one).
        """
        mine, theirs = self._common(result.t)
        signals = []
        for name in result.names:
            if name not in self.variables:
                continue
            ref = self[name][theirs]
            e = np.abs(result[name][mine] - ref)
            e = np.where(np.isnan(e), np.inf, e)
            worst = int(np.argmax(e))
            kind, unit = kind_of(name)
            scale = max(float(np.abs(ref).max()), result.nominal[name])
            rms = float(np.sqrt(np.mean(e * e)))
            signals.append(SignalError(name, kind, unit, float(e[worst]), float(result.t[mine][worst]), rms, scale))
        if not signals:
            raise BadReference(
                f"the run recorded nothing that {self.path.name} has; it has {', '.join(self.variables)}"
            )
        return Error(signals, len(mine))

    def _common(self, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        end = min(t[-1], self.t[-1]) * (1.0 + 1e-12)
        near = np.searchsorted(self.t, t, side="left")
        mine, theirs = [], []
        for i, k in enumerate(near):
            for j in (k - 1, k):
                if 0 <= j < len(self.t) and abs(self.t[j] - t[i]) <= 1e-9:
                    mine.append(i)
                    theirs.append(j)
        needed = min(int((t <= end).sum()), int((self.t <= end).sum()))
        if len(mine) < needed:
            raise BadReference(
                f"{self.path.name}: only {len(mine)} of {needed} samples fall on communication points; "
                "choose H so that it divides the sample interval (or is a multiple of it)"
            )
        return np.array(mine), np.array(theirs)
