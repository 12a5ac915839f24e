"""The scenes of the project. `scripts/scenes` writes them to `scenes/<name>/SystemStructure.ssd`.

with library.scene("double_wishbone") as scene:
    scene.run(integrator="rk4", step=0.05)
"""

from cmath import exp, phase
from collections.abc import Callable, Mapping
from math import acos, pi

from .fmu import Value
from .scene import Scene

GRAVITY = -9.81


def two_mass(scene: Scene, root_mass: float = 3.0):
    """A mass on a ground spring leads one on a spring of its own, whose foot carries a rigid mass: the ratio of the
    masses decides whether a plain exchange of forces is stable."""
    still: dict[str, Value] = {"drive.amplitude": 0.0, "mass[1]": 1.0}
    ground = {"ground.stiffness": 10.0, "ground.damping": 0.1}
    leader = {"stiffness[1]": 10.0, "damping[1]": 0.1, "s[1].start": 1.0}
    follower = {"stiffness[1]": 100.0, "damping[1]": 0.5, "use.base": True, "root.mass": root_mass}
    scene.add("leader", "primary_oscillator", **still, **leader)
    scene.add("follower", "primary_oscillator", **still, **follower, **ground)
    scene.connect("leader.P", "follower.A")
    scene.record("leader.s[1]", "leader.v[1]", "follower.s[1]", "follower.v[1]", interval=0.01)
    scene.configure(stop=2.0)
    scene.reference = "extra/coupling/two_mass.csv"


def double_pendulum(scene: Scene):
    """Two uniform rods, released level."""
    rod = {"mass": 1.0, "length": 1.0, "angle.theta": 0.0, "gravity.z": GRAVITY}
    scene.add("upper", "link2", **rod)
    scene.add("lower", "link2", **rod, **{"A.r.x": 1.0})
    scene.connect("upper.B", "lower.A")
    scene.record(*_angles("upper", "lower"), interval=0.01)
    scene.configure(stop=2.0)
    scene.reference = "extra/coupling/double_pendulum.csv"


def four_bar(scene: Scene):
    """Three uniform rods between two ground points, released; the tips of the second and the third are joined."""
    # angles from hanging
    rods = {"link1": (1.0, 1.0, 1.0), "link2": (2.0, 2.0, 2.854723658638), "link3": (1.5, 1.5, -2.735431992820)}
    for name, (mass, length, phi) in rods.items():
        rod = {"mass": mass, "length": length, "angle.theta": phi - 0.5 * pi, "gravity.z": GRAVITY}
        scene.add(name, "link2", **rod)
    scene.set("link3", **{"A.r.x": 2.0})
    scene.connect("link1.B", "link2.A")
    scene.close("link2.B", "link3.B", alpha=2.0)
    scene.record(*_angles("link1", "link2", "link3"), interval=0.015)
    scene.configure(stop=3.0)
    scene.reference = "extra/coupling/four_bar.csv"


#: The paper's case: no weight, a force of 10 N at the wheel.
_WEIGHTLESS: dict[str, Value] = {"gravity.z": 0.0}
_SINE: dict[str, Value] = {"force.amplitude.z": 10.0, "force.omega.z": 10.0}
_LOADED: dict[str, Value] = {"force.kind": "internal", **_SINE}


def double_wishbone(scene: Scene, load: bool = True):
    """The wheel suspension from its elements, closed at the carrier's upper joint (figure 16 of the paper).

    `load`: the force at the wheel is a component of its own, otherwise it is the carrier's internal one.
    """
    scene.add("lower", "link2", **_WEIGHTLESS)
    scene.add(
        "carrier", "link3", **_WEIGHTLESS, **({"force.kind": "input"} if load else {"force.kind": "internal", **_SINE})
    )
    scene.add("upper", "strut_link", **_WEIGHTLESS)
    scene.connect("lower.B", "carrier.B")
    if load:
        scene.add("load", "load", **_SINE)
        scene.connect("carrier.P", "load.A")
    scene.close("carrier.C", "upper.C", alpha=20.0)
    _wishbone_run(scene, "extra/suspension/wishbone_paper.csv")


def double_wishbone_two_chain(scene: Scene):
    """The same from two mirrored chains, each with all bodies; each gives the force at the other's tip (figure 15)."""
    theta1, psi = -0.04995839572194276, 0.0
    scene.add("lower", "link2", **_WEIGHTLESS)
    scene.add("carrier", "link3", **_WEIGHTLESS, **_LOADED, **{"angle.psi": psi})
    scene.add("upper", "strut_link", **_WEIGHTLESS, root="C")
    scene.add("upper_2", "strut_link", **_WEIGHTLESS)
    scene.add("carrier_2", "link3", **_WEIGHTLESS, **_LOADED, **{"angle.psi": psi}, root="C")
    scene.add("lower_2", "link2", **_WEIGHTLESS, **{"angle.theta": theta1 + pi})
    scene.connect("lower.B", "carrier.B")
    scene.connect("carrier.C", "upper.D")
    scene.connect("upper_2.C", "carrier_2.B")
    scene.connect("carrier_2.C", "lower_2.A")
    # a tip that ends at a resting joint receives minus the force that the other chain reports there
    scene.connect("upper_2.D", "upper.C", raw=True, factor=-1.0, motion=False)
    scene.connect("lower.A", "lower_2.B", raw=True, factor=-1.0, motion=False)
    _wishbone_run(scene, "extra/suspension/wishbone_paper.csv")
    # where both chains have the lower and the upper joint of the carrier: their distance is not held
    scene.record(*(f"{point}.r.{i}" for point in ("lower.B", "carrier_2.C", "carrier.C", "upper_2.C") for i in "xz"))
    scene.configure(integrator="rk4", step=0.005)


#: Structure of 100 kg at 2 Hz with 1 %, absorber of 5 kg; the force of 50 N acts at this frequency by default.
_OMEGA = 4.0 * pi
_STRUCTURE, _MASS, _FORCE = 100.0, 5.0, 50.0


def absorber_on_oscillator(
    scene: Scene,
    absorber: str | None = "rvdp",
    dof: int = 1,
    omega: float | None = None,
    told: bool = True,
    force: float | None = None,
    **values: Value,
):
    """A structure of one or two masses under a harmonic force, and what calms it: `rvdp` (controlled), `passive`
    (tuned to the
    drive), `den_hartog`, or None.

    `omega`, `force`: of the drive, the absorber is designed for the default ones; `told`: the controller knows the
    frequency.
    `values`: further parameters of the absorber.
    """
    design = _OMEGA if dof == 1 else 15.0
    drive = {"drive.omega_start": omega or design}
    if dof == 1:
        scene.add("primary", "primary_oscillator", **drive, **{"drive.amplitude": _FORCE if force is None else force})
    else:
        two = {"dof": 2, "mass[1]": 200.0, "stiffness[1]": 80000.0, "damping[1]": 60.0}
        drive["drive.amplitude"] = 80.0 if force is None else force
        scene.add("primary", "primary_oscillator", **two, **drive)
    states = [f"primary.{name}[{i}]" for i in range(1, dof + 1) for name in "sv"]
    if absorber is not None:
        own = {"mass": _MASS} if dof == 1 else {"mass": 6.0, "control.gamma": 5.0, "control.amplitude": 0.08}
        scene.add("absorber", "rvdp_absorber", **{**own, **_tuned(absorber, own["mass"], design), **values})
        scene.connect("primary.P", "absorber.P")
        if told:
            scene.connect_signal("primary.drive.omega", "absorber.drive.omega")
        else:
            scene.set("absorber", **{"drive.omega": design})
        states += [f"absorber.{name}" for name in ("x", "w", "control.F1", "control.power")]
    scene.record(*states, interval=0.1)
    scene.configure(stop=60.0)
    scene.reference = f"extra/absorber/coupled_{dof}dof.csv"


def _tuned(absorber: str, mass: float, omega: float) -> dict[str, Value]:
    """Spring and damper of a kind of absorber for the structure of one mass with this frequency."""
    if absorber == "rvdp":
        return {"drive.omega": omega}
    at_rest: dict[str, Value] = {"control.law": "off", "x.start": 0.0}
    if absorber == "passive":
        return {**at_rest, "stiffness": mass * omega**2}
    if absorber != "den_hartog":
        raise ValueError(f"absorber {absorber!r}: rvdp, passive, den_hartog or None")
    mu = mass / _STRUCTURE
    own = omega / (1.0 + mu)
    zeta = (3.0 * mu / (8.0 * (1.0 + mu) ** 3)) ** 0.5
    return {**at_rest, "stiffness": mass * own**2, "damping": 2.0 * zeta * mass * own}


def haptic_wall(scene: Scene, stiffness: float = 2e4, arm: bool = True, **wall: Value):
    """An arm pushes the handle of the haptic interface through a virtual wall at z = 0.57, rendered by impedance.

    `arm`: False leaves the handle to itself. `wall`: further parameters of the wall.
    """
    start: dict[str, Value] = {"x": 0.0, "z": 0.575}
    velocity: dict[str, Value] = {"v.x": 0.05, "v.z": -0.15}
    plain: dict[str, Value] = {"friction.model": "viscous", "use.encoder": False}
    scene.add("controller", "effi_controller", mode="impedance")
    scene.add("plant", "effi_plant", **_prefixed("H.start", start | velocity), **plain)
    scene.add("wall", "virtual_wall", stiffness=stiffness, **wall)
    _device(scene)
    scene.connect("controller.V", "wall.A")
    scene.record(*_HANDLE, *_COMMANDS, "wall.A.F.z", "controller.energy.rendered", interval=0.005)
    if arm:
        end: dict[str, Value] = {"x": 0.08, "z": 0.5}
        _arm(scene, start, end)
        scene.set("arm", **_prefixed("start", velocity))
        scene.connect("plant.H", "arm.H")
        scene.record("arm.H.F.x", "arm.H.F.z")
    scene.configure(method="cs-predict", H=1e-3, stop=0.6)
    scene.reference = "extra/effi/loop_wall.csv"


#: Variants of the mechanism: its parameters, coordinate, and start and end of the movement.
_RENDERED: dict[str, tuple[dict[str, Value], str, float, float]] = {
    "flap": ({"gas.force": 20.0}, "phi", -0.3, 0.2),
    "drawer": ({"kind": "drawer", "drawer.start.x": -0.05, "drawer.start.z": 0.1}, "drawer.s", 0.0, 0.25),
}


def haptic_mechanism(
    scene: Scene, kind: str = "flap", direct: bool = False, cycle: bool = False, **values: Value
):
    """An arm opens a flap or drawer that the haptic interface renders by admittance.

    `direct`: the arm holds the mechanism itself, for comparison. `cycle`: it closes it as well, 2 s each. `values`:
    further parameters of the mechanism.
    """
    own, coordinate, first, last = _RENDERED[kind]
    scene.add("mechanism", "virtual_mechanism", **{**own, **values})
    scene.set("mechanism", **{f"{coordinate}.start": first})
    # where the hand is at both ends; the device works about its own centre
    shift = (0.0, 0.0) if direct else _OFFSET
    ends = [_hand(scene.component("mechanism"), kind, q) for q in (first, last)]
    start, end = ({"x": x + shift[0], "z": z + shift[1]} for x, z in ends)
    _arm(scene, start, end, **{"grip.stiffness": 1000.0, "intent.duration": 2.0})
    if cycle:
        _there_and_back(scene, start, end, 4.0)
    if direct:
        scene.connect("mechanism.H", "arm.H")
    else:
        about: dict[str, Value] = {"offset.x": _OFFSET[0], "offset.z": _OFFSET[1]}
        balanced: dict[str, Value] = {"start.balanced": True}
        scene.add("controller", "effi_controller", **balanced, **about)
        scene.add("plant", "effi_plant", **balanced, **{"use.encoder": False}, **_prefixed("H.start", start))
        _device(scene)
        scene.connect("plant.H", "arm.H")
        scene.connect("mechanism.H", "controller.W")
        scene.record(*_HANDLE, *_COMMANDS, "plant.sensor.F.x", "plant.sensor.F.z", "plant.axis[1].position")
        scene.record("plant.axis[2].position", interval=0.01)
    names = ["mechanism.H.r.x", "mechanism.H.r.z", "mechanism.H.v.x", "mechanism.H.v.z", f"mechanism.{coordinate}"]
    scene.record(*names, "mechanism.energy.port", "arm.H.F.x", "arm.H.F.z", interval=0.01)
    scene.configure(method="cs-predict", H=1e-3, stop=3.0)
    scene.reference = None if direct or cycle or kind != "flap" or values else "extra/effi/haptic_mechanism.csv"


#: Where the device puts the origin of the mechanism [m].
_OFFSET = (-0.07, 0.55)
_HANDLE = tuple(f"plant.H.{part}.{i}" for part in "rv" for i in "xz")
_COMMANDS = tuple(f"controller.axis[{i}].force_command" for i in (1, 2))


def _prefixed(prefix: str, values: Mapping[str, Value]) -> dict[str, Value]:
    return {f"{prefix}.{name}": value for name, value in values.items()}


def _arm(scene: Scene, start: Mapping[str, Value], end: Mapping[str, Value], **values: Value):
    """An operator who holds the handle at `start` and means to move it to `end`."""
    at = {f"{name}.{i}": place[i] for name, place in (("start.r", start), ("intent.start.r", start)) for i in "xz"}
    scene.add("arm", "operator_arm", **at, **_prefixed("intent.end.r", end), **values)


def _there_and_back(scene: Scene, start: dict[str, float], end: dict[str, float], period: float):
    """The operator means to move to `end` and back again."""
    swing: dict[str, Value] = {"kind.y": "rest"}
    for i in "xz":
        middle, half = 0.5 * (start[i] + end[i]), 0.5 * (end[i] - start[i])
        swing |= {f"kind.{i}": "sine", f"start.{i}": middle, f"amplitude.{i}": half}
        swing |= {f"omega.{i}": 2.0 * pi / period, f"phase.{i}": -0.5 * pi}
    scene.add("intention", "guide", **swing)
    scene.set("arm", **{"intent.kind": "input"})
    for quantity in ("r.x", "r.z", "v.x", "v.z"):
        scene.connect_signal(f"intention.P.{quantity}", f"arm.intent.{quantity}")


def _device(scene: Scene):
    """Encoders and force sensor to the controller, its commands to the drives."""
    for i in (1, 2):
        scene.connect_signal(f"plant.axis[{i}].position", f"controller.axis[{i}].position")
        scene.connect_signal(f"controller.axis[{i}].force_command", f"plant.axis[{i}].force_command")
    for i in "xz":
        scene.connect_signal(f"plant.sensor.F.{i}", f"controller.sensor.F.{i}")


def _hand(mechanism, kind: str, q: float) -> tuple[float, float]:
    """Where the hand holds the mechanism at a coordinate."""
    of = lambda name: float(mechanism.value(name))
    if kind == "drawer":
        return of("drawer.start.x") + q * of("drawer.direction.x"), of("drawer.start.z") + q * of("drawer.direction.z")
    P = complex(of("O1.x"), of("O1.z")) + of("crank.length") * exp(1j * q)
    e = complex(of("O2.x"), of("O2.z")) - P
    b, c = of("coupler.length"), of("rocker.length")
    psi = phase(e) + of("branch") * acos((b * b + abs(e) ** 2 - c * c) / (2.0 * b * abs(e)))
    H = P + complex(of("hand.x"), of("hand.z")) * exp(1j * psi)
    return H.real, H.imag


def _wishbone_run(scene: Scene, reference: str):
    names = [*_angles("lower"), "carrier.angle.psi", "carrier.angle_rate.psi", *_angles("upper")]
    scene.record(*names, "carrier.P.r.x", "carrier.P.r.z", interval=0.05)
    scene.configure(stop=10.0)
    scene.reference = reference


def _angles(*components: str) -> list[str]:
    return [f"{name}.{state}.theta" for name in components for state in ("angle", "angle_rate")]


SCENES: dict[str, Callable[..., None]] = {
    build.__name__: build
    for build in (
        two_mass,
        double_pendulum,
        four_bar,
        double_wishbone,
        double_wishbone_two_chain,
        absorber_on_oscillator,
        haptic_wall,
        haptic_mechanism,
    )
}


def scene(name: str, fmus=None, **options) -> Scene:
    """A scene of the library; options are those of its function, `fmus` as of `Scene`."""
    made = Scene(name, fmus)
    try:
        SCENES[name](made, **options)
    except BaseException:
        made.close_fmus()
        raise
    return made
