"""Error against run time of a scene: methods x communication steps or tolerances.

Errors from a run that records, times from runs that do not: one warm-up run is dropped, runs shorter than `min_time` are
summed. Components step by RK4 with one inner step per H, so that the coupling's error shows.
"""

import csv
import json
import math
import re
import statistics
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np

from .. import paths, scenes
from ..fmu import FmuError
from ..reference import Reference
from .definition import Connection, Scene
from .errors import Diverged, NotApplicable, SceneError
from .ports import is_inertia
from .result import SceneResult

#: Two computed references must agree to this part of the scale.
AGREE = 1e-9
#: Errors below this are the reference's.
SATURATED = 1e-12
NOT_APPLICABLE = "not applicable"
#: Counts of a point, in this order.
COUNTS = ("steps", "rejected", "evaluations", "sweeps", "calls", "Get", "Set", "doStep", "save", "restore")


@dataclass(frozen=True)
class Method:
    """A method of the study."""

    name: str
    settings: dict
    #: True: the points are tolerances rtol (atol = rtol / 1000), else steps H.
    adaptive: bool = False
    #: Connections are made raw first.
    raw: bool = False

    def options(self, value: float) -> dict:
        """Options of `run` for a step or tolerance."""
        if self.adaptive:
            return {**self.settings, "rtol": value, "atol": value * 1e-3}
        inner = {} if self.settings["method"] == "common" else {"values": scenes.fixed("rk4", value)}
        return {**self.settings, "H": value, **inner} | ({"raw": True} if self.raw else {})


METHODS = (
    Method("common rk4", {"method": "common", "integrator": "rk4"}),
    Method("common dopri5", {"method": "common", "integrator": "dopri5"}, adaptive=True),
    Method("cs predict", {"method": "cs-predict", "order": 1}),
    Method("cs pece k = 1", {"method": "cs-pece", "order": 1}),
    Method("cs pece k = 2", {"method": "cs-pece", "order": 2}),
    *(Method(f"jacobi order {k}", {"method": "jacobi", "order": k}) for k in (0, 1, 2)),
    Method("raw jacobi", {"method": "jacobi", "order": 1}, raw=True),
)
#: Tolerances of adaptive methods.
TOLERANCES = (1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9)


@dataclass(frozen=True)
class Point:
    """One row of the table; times of one run in seconds."""

    scene: str
    method: str
    H: float | None
    rtol: float | None
    e_max: float | None
    e_rms: float | None
    #: Energy balance over the largest energy; largest gap of the closing joints [m].
    energy: float | None
    gap: float | None
    wall_min: float | None
    wall_median: float | None
    cpu: float | None
    real_time_factor: float | None
    counts: dict[str, int]
    #: Slope of the last three points of the method that are not saturated.
    order: float | None
    status: str


def reference_of(scene: Scene) -> Reference:
    """The scene's reference file, or common dop853 and dopri5 at 1e-12, which must agree."""
    if scene.reference:
        inside = Path(scene.reference)
        places = [scene.folder / inside] if scene.folder else []
        places.append(paths.REFERENCE.joinpath(*inside.parts[1:]))
        for path in places:
            if path.is_file():
                return Reference(path)
        raise SceneError(f"{scene.name}: reference {scene.reference} is missing")
    tight = {"method": "common", "rtol": 1e-12, "atol": 1e-12}
    one, two = (scene.run(integrator=integrator, **tight) for integrator in ("dop853", "dopri5"))
    scale = np.maximum(np.abs(one.values).max(axis=0), [one.nominal[name] for name in one.names])
    apart = float((np.abs(one.values - two.values).max(axis=0) / scale).max())
    if not apart <= AGREE:
        raise SceneError(
            f"{scene.name} has no reference: dop853 and dopri5 at 1e-12 differ by {apart:.2g} of the scale"
        )
    return Reference.sampled(one.t, one.names, one.values, f"common dop853 and dopri5 at 1e-12, apart by {apart:.2g}")


def raw_variant(scene: Scene) -> Scene:
    """The scene with true forces in place of bias force and inertia; it shares the opened FMUs."""
    variant = Scene(f"{scene.name}_raw")
    for component in scene.components.values():
        variant.add(component.name, component.fmu, **component.values)
    for c in scene.connections:
        if not is_inertia(c.target[1]):
            name, variable = c.source
            true = re.sub(r"\.F0(?=\.[xyz]$|$)", ".F", variable)
            variant.connect_all([Connection((name, true), c.target, c.factor, c.offset)])
    variant.joints = list(scene.joints)
    variant.record(*scene.recorded, interval=scene.interval)
    variant.configure(start=scene.start, stop=scene.stop)
    variant.norms = dict(scene.norms)
    return variant


def study(
    scene: Scene,
    *,
    steps: Sequence[float],
    methods: Sequence[Method] = METHODS,
    tolerances: Sequence[float] = TOLERANCES,
    reference: Reference | None = None,
    repeat: int = 7,
    min_time: float = 0.05,
    each: Callable[[Point], None] = lambda point: None,
) -> list[Point]:
    """All points; `each` is called as soon as one is there. `repeat` = 0: no times, and counts include recording."""
    reference = reference or reference_of(scene)
    points = []
    for method in methods:
        subject = raw_variant(scene) if method.raw else scene
        for value in tolerances if method.adaptive else steps:
            point = _point(subject, scene.name, method, value, reference, repeat, min_time)
            points.append(point)
            each(point)
            if point.status.startswith(NOT_APPLICABLE):
                break
    return with_orders(points)


def _point(scene: Scene, name: str, method: Method, value: float, reference, repeat: int, min_time: float) -> Point:
    options = method.options(value)
    where = {"H": None if method.adaptive else value, "rtol": value if method.adaptive else None}
    nothing = dict.fromkeys(("e_max", "e_rms", "energy", "gap", "wall_min", "wall_median", "cpu", "real_time_factor"))
    try:
        result: SceneResult = scene.run(audit=True, **options)
    except Diverged as diverged:
        status = f"diverged at t = {diverged.time:.4g} s"
        return Point(name, method.name, **where, **nothing, counts={}, order=None, status=status)
    except (SceneError, FmuError) as refused:
        kind = NOT_APPLICABLE if isinstance(refused, NotApplicable) else "refused"
        status = f"{kind}: {' '.join(str(refused).split())}"
        return Point(name, method.name, **where, **nothing, counts={}, order=None, status=status)
    error = reference.error_of(result)
    times = _times(scene, options, repeat, min_time)
    wall, cpu = [w for w, _ in times], [c for _, c in times]
    counts = scene.run(record=False, **options).counts if repeat else result.counts
    return Point(
        scene=name,
        method=method.name,
        **where,
        e_max=error.e_max,
        e_rms=error.e_rms,
        energy=result.energy.balance if result.energy else None,
        gap=float(result.gap.max()) if scene.joints else None,
        wall_min=min(wall, default=None),
        wall_median=statistics.median(wall) if wall else None,
        cpu=min(cpu, default=None),
        real_time_factor=result.simulated / min(wall) if wall else None,
        counts={kind: counts[kind] for kind in COUNTS if counts.get(kind)},
        order=None,
        status="ok",
    )


def _times(scene: Scene, options: dict, repeat: int, min_time: float) -> list[tuple[float, float]]:
    """(wall time, CPU time) of one run, `repeat` times; a first run is dropped."""
    measured = []
    for number in range(repeat + 1 if repeat else 0):
        wall = cpu = runs = 0.0
        while runs == 0 or (wall < min_time and number > 0):
            result = scene.run(record=False, **options)
            wall, cpu, runs = wall + result.wall, cpu + result.cpu, runs + 1
        if number > 0:
            measured.append((wall / runs, cpu / runs))
    return measured


def fitted_order(points: Sequence[Point]) -> float | None:
    """Slope of log(error) over log(step), of the three smallest steps that are not saturated."""
    # a step of an adaptive method: the mean one
    sized = [(p.H or 1.0 / p.counts["steps"], p.e_max) for p in points if p.e_max is not None]
    usable = sorted((h, e) for h, e in sized if SATURATED < e < 1.0)[:3]
    if len(usable) < 3:
        return None
    x, y = np.log(np.array(usable)).T
    return float(np.polyfit(x, y, 1)[0])


def with_orders(points: Sequence[Point]) -> list[Point]:
    """The points with the fitted order of their method."""
    names = dict.fromkeys(point.method for point in points)
    orders = {name: fitted_order([point for point in points if point.method == name]) for name in names}
    return [replace(point, order=orders[point.method]) for point in points]


# tables -------------------------------------------------------------------------------------------------------------
def write_csv(points: Sequence[Point], path: Path, facts: dict[str, str]):
    """One row per point, SI units, empty where a column does not apply; the head says what it was measured with."""
    columns = [f.name for f in fields(Point) if f.name != "counts"]
    with path.open("w", newline="", encoding="utf-8") as file:
        file.writelines(f"# {key}: {value}\n" for key, value in facts.items())
        writer = csv.writer(file)
        at = columns.index("order")
        writer.writerow(columns[:at] + list(COUNTS) + columns[at:])
        for point in points:
            row = [getattr(point, name) for name in columns]
            row[at:at] = [point.counts.get(kind) for kind in COUNTS]
            writer.writerow("" if value is None else value for value in row)


HEADER = (
    f"{'method':<16}{'H or rtol':>10}{'e_max':>10}{'e_rms':>10}{'energy':>10}{'gap/m':>10}{'wall/ms':>10}"
    f"{'real time':>10}{'calls':>9}{'evals':>8}  status"
)


def line(point: Point) -> str:
    """One line of the printed table."""
    number = lambda value, form: "-" if value is None else format(value, form)
    wall = None if point.wall_min is None else point.wall_min * 1e3
    return (
        f"{point.method:<16}{point.H or point.rtol:>10.3g}{number(point.e_max, '.2e'):>10}{number(point.e_rms, '.2e'):>10}"
        f"{number(point.energy, '.1e'):>10}{number(point.gap, '.1e'):>10}{number(wall, '.2f'):>10}"
        f"{number(point.real_time_factor, '.1f'):>10}{point.counts.get('calls', 0):>9}{point.counts.get('evaluations', 0):>8}"
        f"  {point.status}"
    )


# regression ---------------------------------------------------------------------------------------------------------
#: Allowed growth of an error, and loss of an order.
GROWTH, LOSS = 1.2, 0.3


def regression(points: Sequence[Point]) -> dict:
    """What is kept of a study, without times: by method, errors and counts by step, and the order."""
    kept: dict = {}
    for point in points:
        of = kept.setdefault(point.method, {"order": point.order, "points": {}})
        of["points"][repr(point.H or point.rtol)] = {
            "e_max": point.e_max,
            "counts": point.counts,
            "status": point.status,
        }
    return kept


def worse(old: dict, new: dict) -> list[str]:
    """What is worse in the new study than in the kept one."""
    found = []
    for method, before in old.items():
        after = new.get(method)
        if after is None:
            found.append(f"{method} is missing")
            continue
        if before["order"] is not None and (after["order"] is None or after["order"] < before["order"] - LOSS):
            found.append(f"{method}: order {after['order']}, was {before['order']:.2f}")
        for value, was in before["points"].items():
            now = after["points"].get(value)
            if now is None:
                found.append(f"{method} at {value} is missing")
                continue
            found += [f"{method} at {value}: {what}" for what in _worse_point(was, now)]
    return found


def _worse_point(was: dict, now: dict) -> list[str]:
    if was["e_max"] is None:
        return [] if now["e_max"] is None else [f"no longer {was['status']!r}"]
    if now["e_max"] is None:
        return [f"{now['status']!r}, was ok"]
    found = []
    # rounding decides errors near saturation
    if now["e_max"] > max(GROWTH * was["e_max"], 10.0 * SATURATED) or not math.isfinite(now["e_max"]):
        found.append(f"e_max {now['e_max']:.3g}, was {was['e_max']:.3g}")
    found += [
        f"{kind} {count}, was {was['counts'].get(kind, 0)}"
        for kind, count in now["counts"].items()
        if count > was["counts"].get(kind, 0)
    ]
    return found


def write_regression(points: Sequence[Point], path: Path):
    """The kept part as JSON."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(regression(points), indent=1) + "\n", encoding="utf-8")
