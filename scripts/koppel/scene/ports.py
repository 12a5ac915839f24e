"""Ports: which variables a point or scalar port has, and the variables that connect two of them.

A leader gives motion (outputs r, v, a or s, v, a) and takes force and inertia in slots; a follower takes the motion and
gives force `F`, bias force `F0` and inertia `M`, with F = F0 - M a.
"""

import re
from dataclasses import dataclass

from ..fmu import Fmu
from .errors import SceneError, near

AXES = ("x", "y", "z")
PAIRS = ("xx", "xy", "xz", "yy", "yz", "zz")

# pass of the sweep in which a variable goes: motion 0, load 1, acceleration 2; other signals go with the motion
_LOAD = re.compile(r"(^|\.)(F|F0|M)(\.[xyz]{1,2})?$")
_ACCELERATION = re.compile(r"(^|\.)a(\.[xyz])?$")
_INERTIA = re.compile(r"(^|\.)M(\.[xyz]{2})?$")
_MOTION = re.compile(r"(^|\.)(r\.[xyz]|v\.[xyz]|s|v)$")


def pass_of(name: str) -> int:
    """Pass of the sweep in which the variable goes."""
    return 1 if _LOAD.search(name) else 2 if _ACCELERATION.search(name) else 0


def is_inertia(name: str) -> bool:
    """A component of some `P.M`."""
    return _INERTIA.search(name) is not None


def is_motion(name: str) -> bool:
    """Position or velocity of a port."""
    return _MOTION.search(name) is not None


def is_true_force(name: str) -> bool:
    """A component of some `P.F`: the force that contains -M a."""
    return re.search(r"(^|\.)F(\.[xyz])?$", name) is not None


@dataclass(frozen=True)
class Port:
    """A port of an FMU."""

    fmu: Fmu
    name: str
    scalar: bool

    def _names(self, part: str, components: tuple[str, ...]) -> list[str]:
        whole = f"{self.name}.{part}"
        return [whole] if self.scalar else [f"{whole}.{i}" for i in components]

    def vector(self, part: str, axes: tuple[str, ...]) -> list[str]:
        """Names of a vector of the port along the axes; empty if the port does not have it."""
        return [name for name in self._names(part, axes) if name in self.fmu.variables]

    def inertia(self, part: str, axes: tuple[str, ...]) -> list[str]:
        """Names of an inertia; products within the axes."""
        pairs = tuple(pair for pair in PAIRS if set(pair) <= set(axes))
        return [name for name in self._names(part, pairs) if name in self.fmu.variables]

    def slot(self, number: int, part: str) -> str:
        """`F` or `M` of a slot: the port itself is slot 1."""
        return part if number == 1 else f"slot[{number}].{part}"

    @property
    def leader(self) -> bool:
        """Gives the motion."""
        first = (self.vector("s", AXES) if self.scalar else self.vector("r", AXES)) or self.vector("v", AXES)
        return self.fmu.variable(first[0]).causality == "output"

    @property
    def planar(self) -> bool:
        """Has no y components."""
        return not self.scalar and f"{self.name}.r.y" not in self.fmu.variables

    @property
    def position(self) -> str:
        """Name of the position."""
        return "s" if self.scalar else "r"


def port_names(fmu: Fmu) -> list[str]:
    """All ports of an FMU."""
    ends = (".r.x", ".v.x", ".s", ".v")
    found = dict.fromkeys(name.removesuffix(end) for name in fmu.variables for end in ends if name.endswith(end))
    return [name for name in found if _kinds(fmu, name)]


def _kinds(fmu: Fmu, name: str) -> list[bool]:
    """Of the answers to "is it scalar", those that the FMU's variables allow."""
    offered = lambda motion: all(
        variable in fmu.variables and fmu.variables[variable].causality in ("input", "output") for variable in motion
    )
    return [s for s, motion in ((True, ("s", "v")), (False, ("r.x", "v.x"))) if offered(f"{name}.{m}" for m in motion)]


def port(fmu: Fmu, name: str, kind: str | None = None) -> Port:
    """The port of that name; where it can be scalar and spatial, `kind` (parameter port.kind) decides."""
    kinds = _kinds(fmu, name)
    if not kinds:
        raise SceneError(f"{fmu.name} has no port {name!r}{near(name, port_names(fmu))}")
    return Port(fmu, name, kinds[0] if len(kinds) == 1 else kind == "scalar")


def motion_pairs(leader: Port, follower: Port, axes: tuple[str, ...]) -> list[tuple[str, str]]:
    """(leader's output, follower's input) of position, velocity and, where both have it, acceleration."""
    parts = (leader.position, "v", "a")
    return [pair for part in parts for pair in zip(leader.vector(part, axes), follower.vector(part, axes))]


def force_pairs(leader: Port, follower: Port, axes: tuple[str, ...], slot: int, raw: bool) -> list[tuple[str, str]]:
    """(follower's output, leader's input) of the force, and of the inertia unless the connection is raw."""
    targets = leader.vector(leader.slot(slot, "F"), axes)
    sources = follower.vector("F" if raw else "F0", axes)
    if not targets or not sources:
        lacking = (
            f"{leader.fmu.name}.{leader.name} has no slot {slot}"
            if not targets
            else (f"{follower.fmu.name}.{follower.name} gives no {'F' if raw else 'F0'}")
        )
        raise SceneError(lacking)
    pairs = list(zip(sources, targets))
    if raw:
        return pairs
    inertia = follower.inertia("M", axes)
    accepting = leader.inertia(leader.slot(slot, "M"), axes)
    if inertia and not accepting and not all(constant(follower.fmu, name) for name in inertia):
        raise SceneError(
            f"{leader.fmu.name}.{leader.name} takes no inertia (M), but {follower.fmu.name}.{follower.name} has some: "
            "only massless followers can hang there"
        )
    return pairs + list(zip(inertia, accepting))


def inertia_of_bias(fmu: Fmu, name: str) -> list[str]:
    """Names of the inertia that belongs to a component of a bias force; none for other variables."""
    found = re.fullmatch(r"(.*\.)?F0(\.[xyz])?", name)
    if found is None:
        return []
    whole = f"{found[1] or ''}M"
    names = [f"{whole}.{pair}" for pair in PAIRS] if found[2] else [whole]
    return [one for one in names if one in fmu.variables]


def constant(fmu: Fmu, name: str) -> bool:
    """An output that is declared to depend on nothing."""
    return fmu.dependencies(name) == frozenset()
