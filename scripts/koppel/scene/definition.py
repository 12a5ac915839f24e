"""A scene: components, what connects them, and how it is run.

with Scene("double_pendulum") as scene:
    scene.add("upper", "link2", **{"mass": 1.0, "length": 1.0})
    scene.add("lower", "link2", **{"mass": 1.0, "length": 1.0, "A.r.x": 1.0})
    scene.connect("upper.B", "lower.A")
    scene.record("lower.angle.theta", interval=0.1)
    result = scene.run(method="common", integrator="rk4", H=5e-3, stop=2.0)
    result["lower.angle.theta"]
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from .. import paths
from ..fmu import Fmu, Value
from . import ports
from .errors import SceneError, near
from .ports import AXES, Port

METHODS = ("common", "cs-predict", "cs-pece", "jacobi", "seidel")
INTEGRATORS = ("heun", "rk4", "dopri5", "dop853", "rodas4", "radau5")
FIXED_STEP = ("heun", "rk4")

#: A variable of a component: (component, variable).
Ref = tuple[str, str]


@dataclass
class Component:
    """An FMU in the scene and the values that differ from its defaults."""

    name: str
    fmu: Fmu
    #: Name of the archive without its ending.
    archive: str
    values: dict[str, Value] = field(default_factory=dict)

    def value(self, name: str) -> Value | None:
        """Value of a parameter in this scene, as set or by default."""
        return self.values.get(name, self.fmu.variable(name).start)

    def choice(self, name: str) -> str | None:
        """Item of an enumeration parameter in this scene, None if there is no such parameter."""
        if name not in self.fmu.variables or self.fmu.variable(name).type != "Enumeration":
            return None
        return self.fmu.item(name, self.value(name))

    @property
    def planar(self) -> bool:
        """Moves in x-z by its parameters: it ignores y inputs, its y outputs are 0."""
        return "planar" in (self.choice("joint.kind"), self.choice("scene.motion"))


@dataclass(frozen=True)
class Connection:
    """An output feeds an input: value = factor * output + offset."""

    source: Ref
    target: Ref
    factor: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True)
class Joint:
    """A closing joint between two leader ports, `component.port`."""

    first: str
    second: str


@dataclass(frozen=True)
class Settings:
    """How the scene is run unless `run` is told otherwise."""

    method: str = "common"
    integrator: str = "dopri5"
    #: Step of a fixed-step integrator [s].
    step: float | None = None
    rtol: float = 1e-6
    #: Method common: times the nominal value of each state; cs-pece: of positions and velocities [m, m/s].
    atol: float = 1e-9
    #: Degree of the extrapolated inputs; k of pece.
    order: int = 1
    #: Communication step [s]; None: that of cs-pece follows the error.
    H: float | None = None
    #: Stabilisation of closing joints [1/s].
    alpha: float = 2.0

    def __post_init__(self):
        for value, known, what in (
            (self.method, METHODS, "method"),
            (self.integrator, INTEGRATORS, "integrator"),
        ):
            if value not in known:
                raise SceneError(f"no {what} {value!r}; offered: {', '.join(known)}")
        for name in ("step", "rtol", "atol", "H"):
            value = getattr(self, name)
            if value is not None and not 0.0 < value < float("inf"):
                raise SceneError(f"{name} = {value}: must be above 0")
        if self.order not in (0, 1, 2):
            raise SceneError(f"order = {self.order}: allowed are 0, 1 and 2")
        if not self.alpha >= 0.0:
            raise SceneError(f"alpha = {self.alpha}: must not be below 0")


class Scene:
    """Components, connections, closing joints, recorded variables and settings.

    `fmus`: folder with the archives (default dist/fmi3), or a function from name to `Fmu`. A context manager that
    closes the FMUs it has opened itself.
    """

    def __init__(self, name: str, fmus=None):
        self.name = name
        self.fmus = fmus
        self._opened: dict[Path, Fmu] = {}
        self.components: dict[str, Component] = {}
        self.connections: list[Connection] = []
        self.joints: list[Joint] = []
        self.assembled: list[str] = []
        self.recorded: list[str] = []
        #: Distance of samples [s]; None: 200 intervals.
        self.interval: float | None = None
        self.settings = Settings()
        self.start, self.stop = 0.0, 1.0
        #: Reference samples: a path inside the scene, or below tests/reference in place of `extra`.
        self.reference: str | None = None
        #: Folder that the scene was read from.
        self.folder: Path | None = None
        #: FMUs in the archive that the scene was read from.
        self.archived: int | None = None
        #: Scale of the error of a variable, where it is not its largest value.
        self.norms: dict[str, float] = {}
        self._sources: dict[Ref, Connection] = {}

    def __enter__(self) -> "Scene":
        return self

    def __exit__(self, *_):
        self.close_fmus()

    def close_fmus(self):
        """Remove the unpacked files of FMUs that this scene opened."""
        for fmu in self._opened.values():
            fmu.close()
        self._opened.clear()

    # building -------------------------------------------------------------------------------------------------------
    def add(self, name: str, fmu: "str | Path | Fmu", **values: Value) -> Component:
        """A component: its FMU by name (in the FMU folder), path or opened, and values of parameters and starts."""
        if name in self.components:
            raise SceneError(f"{self.name}: component {name} exists already")
        if not name or set(name) & set(". \t"):
            raise SceneError(f"{self.name}: {name!r} cannot name a component (no points, no blanks)")
        fmu = self._open(fmu)
        component = Component(name, fmu, fmu.path.stem)
        self.components[name] = component
        try:
            self.set(name, **values)
        except SceneError:
            del self.components[name]
            raise
        return component

    def set(self, name: str, **values: Value):
        """Change values of a component."""
        component = self.component(name)
        for variable in values:
            self._variable(component, variable)
        component.values |= values

    def _open(self, fmu) -> Fmu:
        if isinstance(fmu, Fmu):
            return fmu
        if callable(self.fmus) and isinstance(fmu, str):
            return self.fmus(fmu)
        path = Path(fmu)
        if path.suffix != ".fmu":
            path = (Path(self.fmus) if self.fmus else paths.DIST / "fmi3") / f"{fmu}.fmu"
        path = path.resolve()
        if path not in self._opened:
            if not path.is_file():
                known = sorted(other.stem for other in path.parent.glob("*.fmu"))
                raise SceneError(f"{self.name}: no FMU {path.name} in {path.parent}{near(path.stem, known)}")
            self._opened[path] = Fmu(path)
        return self._opened[path]

    def connect(
        self,
        first: str,
        second: str,
        *,
        raw: bool = False,
        slot: int | None = None,
        factor: float = 1.0,
        motion: bool = True,
    ):
        """Two ports, one leader and one follower in any order.

        Inertial: motion forward, `F0` and `M` back into a slot of the leader. `raw`: `F` back, without inertia.
        `slot`: of the leader, the first free one unless given. `factor`: on the raw force. `motion = False`: force only.
        Y components are left out where one end moves in x-z.
        """
        ends = [self.port(first), self.port(second)]
        if ends[0][1].leader == ends[1][1].leader:
            role = "leaders: close them by a joint" if ends[0][1].leader else "followers: each needs a leader"
            raise SceneError(f"{first} and {second} are both {role}")
        (lead, leader), (follow, follower) = ends if ends[0][1].leader else reversed(ends)
        if leader.scalar != follower.scalar:
            raise SceneError(f"{first} and {second}: a scalar port cannot be connected to a spatial one")
        if factor != 1.0 and not raw:
            raise SceneError(f"{first} and {second}: a factor ({factor}) is for raw connections, inertia has no sign")
        axes = self._axes((lead, leader), (follow, follower))
        slot = slot or self._free_slot(lead, leader, axes)
        back = ports.force_pairs(leader, follower, axes, slot, raw)
        forward = ports.motion_pairs(leader, follower, axes) if motion else []
        new = [Connection((lead.name, a), (follow.name, b)) for a, b in forward]
        new += [Connection((follow.name, a), (lead.name, b), factor) for a, b in back]
        self.connect_all(new)

    def connect_signal(self, source: str, target: str, factor: float = 1.0, offset: float = 0.0):
        """One output to one input, `component.variable` each."""
        self.connect_all([Connection(self.ref(source), self.ref(target), factor, offset)])

    def connect_all(self, connections: list[Connection]):
        """Connections variable by variable; none of them is made if one is refused."""
        for connection in connections:
            self._check(connection)
        for connection in connections:
            self._sources[connection.target] = connection
        self.connections += connections

    def _check(self, connection: Connection):
        source, target = (self.variable(ref) for ref in (connection.source, connection.target))
        says = f"{'.'.join(connection.source)} -> {'.'.join(connection.target)}"
        if source.causality != "output" or target.causality != "input":
            raise SceneError(f"{says}: needs an output and an input, got {source.causality} and {target.causality}")
        for variable, ref in ((source, connection.source), (target, connection.target)):
            if variable.type != "Float64":
                raise SceneError(f"{says}: {'.'.join(ref)} is {variable.type}, only Float64 can be connected")
        if source.unit != target.unit:
            raise SceneError(f"{says}: unit {source.unit} does not fit {target.unit}")
        if connection.target in self._sources:
            other = ".".join(self._sources[connection.target].source)
            raise SceneError(f"{says}: the input has a source already, {other}")

    def close(self, first: str, second: str, alpha: float | None = None):
        """A closing joint between two leader ports. `alpha`: stabilisation of all joints of the scene [1/s]."""
        for name in (first, second):
            if not self.port(name)[1].leader:
                raise SceneError(f"{name} is a follower; a closing joint joins two leaders, a follower is connected")
        self.joints.append(Joint(first, second))
        for name in (first, second):
            self.joint_slot(name)
        if alpha is not None:
            self.settings = replace(self.settings, alpha=alpha)

    def assemble(self, variables: Iterable[str]):
        """Start values that may be changed to close the joints at the start."""
        self.assembled += [".".join(self.ref(name)) for name in variables]

    def record(self, *variables: str, interval: float | None = None):
        """Variables to sample, `component.variable`. `interval`: distance of the samples [s]."""
        self.recorded += [".".join(self.ref(name)) for name in variables]
        if interval is not None:
            if not interval > 0.0:
                raise SceneError(f"interval = {interval}: must be above 0")
            self.interval = interval

    def configure(self, *, start: float | None = None, stop: float | None = None, **settings):
        """Settings of the scene: method, integrator, step, rtol, atol, order, H, alpha, start, stop."""
        self.settings = replace(self.settings, **settings)
        self.start = self.start if start is None else start
        self.stop = self.stop if stop is None else stop

    # looking up -----------------------------------------------------------------------------------------------------
    def component(self, name: str) -> Component:
        """The component of that name."""
        if name not in self.components:
            raise SceneError(f"{self.name} has no component {name!r}{near(name, self.components)}")
        return self.components[name]

    def split(self, name: str) -> tuple[Component, str]:
        """The component and the rest of `component.rest`."""
        component, point, rest = name.partition(".")
        if not point:
            raise SceneError(f"{name!r}: a component and, after a point, its port or variable are needed")
        return self.component(component), rest

    def _variable(self, component: Component, variable: str):
        if variable not in component.fmu.variables:
            known = near(variable, component.fmu.variables)
            raise SceneError(f"{component.name} ({component.archive}) has no variable {variable!r}{known}")
        return component.fmu.variables[variable]

    def ref(self, name: str) -> Ref:
        """A variable by `component.variable`."""
        component, variable = self.split(name)
        self._variable(component, variable)
        return component.name, variable

    def variable(self, ref: Ref):
        """Description of a variable."""
        return self._variable(self.component(ref[0]), ref[1])

    def port(self, name: str) -> tuple[Component, Port]:
        """A port by `component.port`."""
        component, port = self.split(name)
        try:
            return component, ports.port(component.fmu, port, component.choice("port.kind"))
        except SceneError as unknown:
            raise SceneError(f"{component.name}: {unknown}") from None

    def _axes(self, *ends: tuple[Component, Port]) -> tuple[str, ...]:
        planar = any(component.planar or port.planar for component, port in ends)
        return ("x", "z") if planar else AXES

    def joint_axes(self, joint: Joint) -> tuple[str, ...]:
        """Axes in which the joint closes."""
        return self._axes(self.port(joint.first), self.port(joint.second))

    def _free_slot(self, component: Component, port: Port, axes: tuple[str, ...], besides: Iterable[str] = ()) -> int:
        used = {variable for name, variable in self._sources if name == component.name} | set(besides)
        number = 1
        while forces := port.vector(port.slot(number, "F"), axes):
            if not used & set(forces):
                return number
            number += 1
        raise SceneError(
            f"{component.name}.{port.name}: all {number - 1} slots are taken, there is no room for another load"
        )

    def joint_slot(self, name: str) -> int:
        """Slot of the leader that takes the force of the closing joint at this port."""
        component, port = self.port(name)
        ends = [end for joint in self.joints for end in (joint.first, joint.second)]
        before = [self.port(end)[1] for end in ends[: ends.index(name)] if end.partition(".")[0] == component.name]
        if any(other.name == port.name for other in before):
            raise SceneError(f"{name} is in two closing joints")
        return self._free_slot(component, port, AXES)

    # running --------------------------------------------------------------------------------------------------------
    def run(self, **options):
        """Run the scene; options as of `koppel.scene.run.run`, each by default as configured. Returns a `SceneResult`."""
        from .run import run

        return run(self, **options)

    def study(self, **options):
        """Error against run time; options as of `koppel.scene.study.study`."""
        from .study import study

        return study(self, **options)

    def write(self, folder: str | Path) -> Path:
        """Write `SystemStructure.ssd` into the folder; returns its path."""
        from .ssp import write

        return write(self, folder)

    @classmethod
    def read(cls, source: str | Path, fmus=None, variant: str = "SystemStructure.ssd") -> "Scene":
        """The scene in a folder, an `.ssd` file or an `.ssp` archive; `variant`: another root file there."""
        from .ssp import read

        return read(cls, source, fmus, variant)


def start_values(component: Component, extra: Mapping[str, Value]) -> dict[str, Value]:
    """Values of the component, and of `extra` those that the FMU has."""
    return component.values | {name: value for name, value in extra.items() if name in component.fmu.variables}
