"""What the haptic interface lets feel: evaluation of a rendered mechanism, limit of a virtual wall, workspace.

python -m koppel.haptics    docs/haptic_{wall,workspace,mechanism,study}.png, out/haptics/*.csv, tables
"""

import csv
from dataclasses import asdict, dataclass, fields
from functools import cache
from itertools import pairwise

import numpy as np
from scipy.linalg import expm

from . import library, paths
from .fmu import Fmu
from .scene import SceneResult

F_PEAK = 2500.0
#: Where the detent of the flap is and how far it reaches [rad]
DETENT, WIDTH = 0.3, 0.05
PIVOTS = np.array([[-0.35, 0.0], [0.35, 0.0]])


# a rendered mechanism -----------------------------------------------------------------------------------------------
@dataclass(frozen=True)
class Evaluation:
    """Over one opening and closing movement."""

    #: Path length of the hand [m]
    travel: float
    #: Largest hand force along the path [N]
    peak: float
    #: Largest less next smallest force near the detent while opening [N]
    detent_drop: float
    #: Work of the hand over the movement there and back, and the mechanism's energy.port [J]
    hysteresis: float
    port: float
    #: Largest command of an axis as part of its peak force
    command: float
    #: Shortest distance of an axis to an end of its stroke [m]
    margin: float
    #: Rendered against direct: largest and root mean square difference of hand force [N] and of hand position [m]
    force_max: float
    force_rms: float
    position_max: float
    position_rms: float


@dataclass(frozen=True)
class Felt:
    """What the hand feels in a run."""

    t: np.ndarray
    r: np.ndarray
    v: np.ndarray
    F: np.ndarray
    coordinate: np.ndarray

    @property
    def travel(self) -> np.ndarray:
        """Path length so far [m]."""
        return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(self.r, axis=1), axis=0))])

    @property
    def along(self) -> np.ndarray:
        """Force along the path [N]."""
        speed = np.linalg.norm(self.v, axis=0)
        # at rest there is no path
        return np.where(speed > 1e-3, (self.F * self.v).sum(axis=0) / np.maximum(speed, 1e-3), 0.0)

    @property
    def work(self) -> float:
        """Work of the hand [J]."""
        power = (self.F * self.v).sum(axis=0)
        return float(np.trapezoid(power, self.t))


def movement(fmus=None, kind: str = "flap", direct: bool = False, **values) -> tuple[SceneResult, Felt]:
    """One opening and closing movement of 4 s."""
    with library.scene("haptic_mechanism", fmus, kind=kind, direct=direct, cycle=True, **values) as scene:
        result = scene.run(stop=4.0, interval=5e-3)
    leader = "mechanism" if direct else "plant"
    pair = lambda quantity: np.array([result[f"{quantity}.{i}"] for i in "xz"])
    coordinate = result["mechanism.drawer.s" if kind == "drawer" else "mechanism.phi"]
    hand = "arm.H.F" if direct else "plant.sensor.F"
    return result, Felt(result.t, pair(f"{leader}.H.r"), pair(f"{leader}.H.v"), pair(hand), coordinate)


def drop(felt: Felt) -> float:
    """Largest force within two widths of the detent on the way there, less the smallest that follows [N]."""
    opening = felt.t <= felt.t[-1] / 2.0
    near = felt.along[opening & (np.abs(felt.coordinate - DETENT) <= 2.0 * WIDTH)]
    if near.size == 0:
        return 0.0
    at = int(near.argmax())
    return float(near[at] - near[at:].min())


def evaluate(fmus=None, kind: str = "flap", **values) -> tuple[Evaluation, Felt, Felt]:
    """The figures, and what the hand feels by the device and directly."""
    result, felt = movement(fmus, kind, **values)
    _, direct = movement(fmus, kind, direct=True, **values)
    commands = np.abs([result[f"controller.axis[{i}].force_command"] for i in (1, 2)])
    lengths = np.array([result[f"plant.axis[{i}].position"] for i in (1, 2)])
    force = np.linalg.norm(felt.F - direct.F, axis=0)
    # the device works about its own centre
    shift = (felt.r - direct.r) - (felt.r - direct.r)[:, :1]
    position = np.linalg.norm(shift, axis=0)
    rms = lambda values: float(np.sqrt((values**2).mean()))
    found = Evaluation(
        travel=float(felt.travel[-1]), peak=float(np.abs(felt.along).max()), detent_drop=drop(felt),
        hysteresis=felt.work, port=float(result["mechanism.energy.port"][-1]),
        command=float(commands.max() / F_PEAK), margin=float(min(lengths.min() - 0.5, 0.9 - lengths.max())),
        force_max=float(force.max()), force_rms=rms(force),
        position_max=float(position.max()), position_rms=rms(position),
    )  # fmt: skip
    return found, felt, direct


# the limit of a wall ------------------------------------------------------------------------------------------------
@dataclass(frozen=True)
class Vertical:
    """The default device at (0, z), moving along z with viscous friction: mass [kg], damping [N.s/m], weight [N]."""

    m: float
    b: float
    weight: float


def vertical(z: float) -> Vertical:
    """From the plant's equations (4), (5), (8) with its default parameters."""
    l = np.hypot(0.35, z)
    u, t = z / l, 0.35 / l  # z components of u_i and, up to its sign, t_i
    rod = 3.0 + 1e-4 * (2.0 * np.pi / 0.01) ** 2
    I = 0.35 + 0.0625 + 3.0 * (l - 0.25) ** 2
    m = 2.0 + 2.0 * (rod * u**2 + I / l**2 * t**2)
    weight = 9.81 * (2.0 + 2.0 * (3.0 * u**2 + (3.0 * (l - 0.25) + 8.0 * 0.15) * t**2 / l))
    return Vertical(m, 2.0 * 300.0 * u**2, weight)


#: Time constant of the default current loop [s]
LAG = 1.0 / (1000.0 * np.pi)


def radius(device: Vertical, K: float, B: float, T: float = 1e-3, delay: int = 1, tau: float = LAG) -> float:
    """Spectral radius of the held-force loop: states x, v, f, x of the last tick, and the queue of commands."""
    A = np.zeros((4, 4))
    A[0, 1], A[1, 1:3], A[2, 2:] = 1.0, [-device.b / device.m, 1.0 / device.m], [-1.0 / tau, 1.0 / tau]
    step = expm(A * T)
    n = 4 + delay
    loop = np.zeros((n, n))
    loop[:3, :3] = step[:3, :3]
    loop[3, 0] = 1.0
    command = np.zeros(n)
    command[0], command[3] = -K - B / T, B / T
    if delay:
        loop[:3, 4 + delay - 1] = step[:3, 3]
        loop[4] = command
        for i in range(1, delay):
            loop[4 + i, 3 + i] = 1.0
    else:
        loop[:3] += np.outer(step[:3, 3], command)
    return float(np.abs(np.linalg.eigvals(loop)).max())


def boundary(device: Vertical, B: float, **how) -> float:
    """Smallest stiffness at which the loop is unstable [N/m]."""
    stiffness = np.geomspace(1e3, 1e7, 400)
    lo, hi = next(((a, b) for a, b in pairwise(stiffness) if radius(device, b, B, **how) >= 1.0), (0.0, 0.0))
    for _ in range(40):
        middle = 0.5 * (lo + hi)
        lo, hi = (middle, hi) if radius(device, middle, B, **how) < 1.0 else (lo, middle)
    return hi


#: Height of the default wall's surface [m]
SURFACE = 0.57


def grows(K: float, B: float, fmus=None) -> bool:
    """The device, alone, rests with its weight on the wall: true if a disturbance grows within 1.2 s."""
    device = vertical(SURFACE)
    with library.scene("haptic_wall", fmus, stiffness=K, damping=B, arm=False) as scene:
        scene.set("plant", **{"H.start.z": SURFACE - device.weight / K, "H.start.v.x": 0.0, "H.start.v.z": 0.0})
        scene.set("controller", **{"comp.gravity": 0.0, "filter.cutoff": 0.0})
        result = scene.run(stop=1.2, interval=1e-3)
    z, t = result["plant.H.r.z"], result.t
    swing = lambda of: np.ptp(z[of])
    return bool(swing(t > 0.9) > swing((t > 0.3) & (t <= 0.6)))


def observed(B: float, fmus=None, digits: int = 5) -> float:
    """The limit in the scene, to a part in 2^digits [N/m]."""
    exact = boundary(vertical(SURFACE), B)
    lo, hi = 0.8 * exact, 1.2 * exact
    for _ in range(digits):
        middle = 0.5 * (lo + hi)
        lo, hi = (lo, middle) if grows(middle, B, fmus) else (middle, hi)
    return 0.5 * (lo + hi)


# the device ---------------------------------------------------------------------------------------------------------
def determinant(r: np.ndarray, pivots: np.ndarray = PIVOTS) -> np.ndarray:
    """det J at the places r[.., 2]."""
    u = r[..., None, :] - pivots
    u = u / np.linalg.norm(u, axis=-1, keepdims=True)
    return u[..., 0, 0] * u[..., 1, 1] - u[..., 0, 1] * u[..., 1, 0]


def strongest(r: np.ndarray, directions: np.ndarray, pivots: np.ndarray = PIVOTS) -> np.ndarray:
    """Largest force in each direction that both axes can hold up [N], without weight."""
    u = r[None, :] - pivots
    J = u / np.linalg.norm(u, axis=-1, keepdims=True)
    return F_PEAK / np.abs(np.linalg.solve(J.T, directions.T)).max(axis=0)


# diagrams -----------------------------------------------------------------------------------------------------------
def _axes(width: float, height: float, **how):
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(width, height), layout="constrained", **how)
    for one in np.ravel(axes):
        one.grid(True, alpha=0.25)
    return figure, axes


def _save(figure, name: str):
    figure.savefig(paths.ROOT / "docs" / f"{name}.png", dpi=110, metadata={"Software": None})


def draw_wall(fmus=None) -> list[list[float]]:
    """Largest stable stiffness over the wall's damping; the rows of the diagram."""
    device = vertical(SURFACE)
    damping = np.linspace(-0.6, 0.9, 61) * device.b
    figure, axes = _axes(7.0, 4.4)
    for delay, label in ((0, "exact, no delay"), (1, "exact, one tick (default)"), (3, "exact, three ticks")):
        K = [boundary(device, B, delay=delay) for B in damping]
        axes.semilogy(damping, K, label=label)
    passive = 2.0 * (device.b - np.abs(damping)) / 1e-3
    axes.semilogy(damping, passive, "k--", label="passive: K < 2 (b - |B|)/T, no delay")
    points = np.array([0.0, 0.25, 0.5, 0.75]) * device.b  # of a wall that is no source itself
    rows = [[float(B), boundary(device, B), observed(B, fmus)] for B in points]
    axes.plot(points, [row[2] for row in rows], "ko", label="scene with packed FMUs, one tick")
    axes.set_xlabel("damping of the wall [N.s/m]")
    axes.set_ylabel("largest stable stiffness [N/m]")
    title = f"Virtual wall on {device.m:.1f} kg and {device.b:.0f} N.s/m, T = 1 ms, current loop 500 Hz"
    axes.set_title(title, fontsize=10)
    axes.legend(fontsize=8)
    _save(figure, "haptic_wall")
    return rows


def draw_workspace():
    """Where the stroke lets the handle go, det J there, and the largest static force in each direction."""
    x, z = np.meshgrid(np.linspace(-0.6, 0.6, 481), np.linspace(0.01, 0.95, 377))
    r = np.stack([x, z], axis=-1)
    l = np.linalg.norm(r[..., None, :] - PIVOTS, axis=-1)
    inside = ((l >= 0.5) & (l <= 0.9)).all(axis=-1)
    figure, axes = _axes(7.0, 5.2)
    shown = np.where(inside, np.abs(determinant(r)), np.nan)
    mesh = axes.pcolormesh(x, z, shown, shading="auto", cmap="viridis", vmin=0.6, vmax=1.0, rasterized=True)
    figure.colorbar(mesh, label="|det J| [1]")
    angle = np.linspace(0.0, 2.0 * np.pi, 181)
    directions = np.column_stack([np.cos(angle), np.sin(angle)])
    for place in ((0.0, 0.42), (0.0, 0.6), (0.0, 0.77), (-0.2, 0.6), (0.2, 0.6)):
        force = strongest(np.array(place), directions)[:, None] * directions * 1.5e-5
        axes.plot(place[0] + force[:, 0], place[1] + force[:, 1], "k-", lw=1.2)
    axes.plot(*PIVOTS.T, "k^", label="pivots A, B")
    axes.plot([-0.58, -0.58 + 1.5e-5 * F_PEAK], [0.04, 0.04], "k-", lw=1.2)
    axes.text(-0.58, 0.055, "scale of the force limit: 2.5 kN", fontsize=8)
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("z [m]")
    axes.legend(loc="lower right", fontsize=8)
    _save(figure, "haptic_workspace")


LABELS = {"flap": "flap, gas spring 20 N", "drawer": "drawer"}


def draw_mechanism(fmus=None) -> dict[str, Evaluation]:
    """Hand force over travel, rendered and direct, with the figures."""
    figure, all_axes = _axes(9.0, 4.2, ncols=2)
    found = {}
    for axes, (kind, label) in zip(all_axes, LABELS.items()):
        found[kind], felt, direct = evaluate(fmus, kind)
        e = found[kind]
        axes.plot(1e3 * felt.travel, felt.along, label="rendered")
        axes.plot(1e3 * direct.travel, direct.along, "--", label="direct")
        text = f"peak {e.peak:.1f} N\nhysteresis {e.hysteresis:.2f} J\nrendered - direct:\n{e.force_rms:.2f} N rms, "
        text += f"{1e3 * e.position_rms:.2f} mm rms\ncommand {100.0 * e.command:.0f} % of peak"
        box = {"facecolor": "w", "alpha": 0.8, "lw": 0}
        axes.text(0.03, 0.03, text, transform=axes.transAxes, fontsize=7.5, bbox=box)
        axes.set_title(label, fontsize=10)
        axes.set_xlabel("travel of the hand, there and back [mm]")
    all_axes[0].set_ylabel("hand force along the path [N]")
    all_axes[0].legend(fontsize=8)
    _save(figure, "haptic_mechanism")
    return found


GAS, HINGE = (0.0, 20.0, 40.0, 60.0), (0.09, 0.10, 0.11)


def draw_study(fmus=None) -> list[list[float]]:
    """Peak, detent drop and hysteresis over the gas spring's force, for positions of the hinge; the rows."""
    figure, all_axes = _axes(11.0, 3.8, ncols=3)
    rows = []
    for hinge in HINGE:
        line = [evaluate(fmus, "flap", **{"gas.force": gas, "O2.z": hinge})[0] for gas in GAS]
        rows += [[hinge, gas, *asdict(e).values()] for gas, e in zip(GAS, line)]
        for axes, name in zip(all_axes, ("peak", "detent_drop", "hysteresis")):
            axes.plot(GAS, [getattr(e, name) for e in line], "o-", label=f"hinge O2 at {1e3 * hinge:.0f} mm")
    for axes, label in zip(all_axes, ("peak of the hand force [N]", "drop at the detent [N]", "hysteresis [J]")):
        axes.set_xlabel("force of the gas spring [N]")
        axes.set_ylabel(label)
    all_axes[0].legend(fontsize=8)
    _save(figure, "haptic_study")
    return rows


def _write(name: str, header: list[str], rows):
    folder = paths.OUT / "haptics"
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / f"{name}.csv").open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([header, *rows])


def main():
    """`scripts/haptics`"""
    names = [f.name for f in fields(Evaluation)]
    # unpacked once
    fmus = cache(lambda name: Fmu(paths.fmu(name)))
    draw_workspace()
    found = draw_mechanism(fmus)
    _write("mechanism", ["kind", *names], [[kind, *asdict(e).values()] for kind, e in found.items()])
    for kind, e in found.items():
        print(f"{kind}: " + ", ".join(f"{name} {value:.4g}" for name, value in asdict(e).items()), flush=True)
    rows = draw_wall(fmus)
    _write("wall", ["damping", "exact", "observed"], rows)
    for B, exact, seen in rows:
        print(f"wall, B = {B:7.1f} N.s/m: exact {exact:.0f} N/m, scene {seen:.0f} N/m", flush=True)
    _write("study", ["hinge", "gas", *names], draw_study(fmus))
    print("== docs/haptic_{workspace,mechanism,wall,study}.png")


if __name__ == "__main__":
    main()
