"""Error against run time of the library's scenes.

python -m koppel.scene_study [NAME...]            out/<scene>/work_precision.csv and the plots
python -m koppel.scene_study --keep [NAME...]     tests/reference/regression/<scene>.json, and native/<scene>.json there by
                                                  the program koppel: errors and counts only
"""

import argparse
import json
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass

from . import host, library, paths
from .scene import SceneError, plot, study
from .scene.study import METHODS, TOLERANCES, Method, Point

REGRESSION = paths.REFERENCE / "regression"


@dataclass(frozen=True)
class Plan:
    """Steps and tolerances of a scene's study: over two decades for the whole one, few for the kept one."""

    steps: tuple[float, ...]
    kept_steps: tuple[float, ...]
    tolerances: tuple[float, ...] = TOLERANCES
    methods: tuple[Method, ...] = METHODS
    #: End of the kept study where it is not the scene's [s].
    kept_stop: float | None = None


_SMALL = Plan((10e-3, 5e-3, 2.5e-3, 1e-3, 0.5e-3, 0.1e-3), (10e-3, 5e-3, 2.5e-3))
#: A sampled controller: communication points at its ticks, and between them for arm and plant.
_SAMPLED = tuple(method for method in METHODS if method.name == "cs predict")
PLANS = {
    "absorber_on_oscillator": Plan((10e-3, 5e-3, 2e-3, 1e-3, 0.5e-3), (10e-3, 5e-3, 2e-3), kept_stop=5.0),
    "haptic_wall": Plan((0.5e-3, 0.25e-3, 0.125e-3, 0.0625e-3), (0.5e-3, 0.25e-3), methods=_SAMPLED, kept_stop=0.2),
    "haptic_mechanism": Plan((0.2e-3, 0.1e-3, 0.05e-3), (0.2e-3, 0.1e-3), methods=_SAMPLED, kept_stop=0.2),
    "two_mass": _SMALL,
    "double_pendulum": _SMALL,
    "four_bar": Plan((15e-3, 7.5e-3, 3.75e-3, 1.5e-3, 0.75e-3, 0.15e-3), (15e-3, 7.5e-3, 3.75e-3)),
    "double_wishbone": Plan((50e-3, 10e-3, 5e-3, 2.5e-3, 1e-3, 0.5e-3), (5e-3, 2.5e-3, 1.25e-3), kept_stop=1.0),
    "double_wishbone_two_chain": Plan(
        (50e-3, 5e-3, 2.5e-3, 1e-3, 0.5e-3), (5e-3, 2.5e-3, 1.25e-3), methods=METHODS[:2], kept_stop=0.5
    ),
}


def kept(name: str, fmus=None) -> list[Point]:
    """The short study whose errors and counts are kept; counts include the recording."""
    plan = PLANS[name]
    methods = [method for method in plan.methods if not method.adaptive]
    with library.scene(name, fmus) as scene:
        scene.configure(stop=plan.kept_stop)
        return scene.study(steps=plan.kept_steps, methods=methods, repeat=0)


def kept_native(name: str) -> list[Point]:
    """The same of `koppel study`, whose steps are parts of the sample interval; without adaptive methods, too."""
    stop = [] if PLANS[name].kept_stop is None else ["--stop", str(PLANS[name].kept_stop)]
    command = [paths.DIST / "bin" / "koppel", "study", paths.ROOT / "scenes" / name, "--runs", "0", "--json", *stop]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=paths.ROOT, timeout=600)
    if done.returncode != 0:
        raise SceneError(f"koppel study {name}: {done.stderr.strip()}")
    only_common = all(method.settings["method"] == "common" for method in PLANS[name].methods)
    points = [point for point in json.loads(done.stdout)["points"] if point["H"] is not None]
    return [_native_point(name, p) for p in points if not only_common or p["method"].startswith("common")]


def _native_point(scene: str, point: dict) -> Point:
    counts = {}
    if cost := point["cost"]:
        steps, calls = cost["steps"], cost["calls"]
        counts = {
            "steps": steps["accepted"],
            "rejected": steps["rejected"],
            "evaluations": point["evaluations"],
            "sweeps": cost["sweeps"],
            "calls": sum(calls.values()),
            "Get": calls["get"],
            "Set": calls["set"],
            "doStep": calls["do_step"],
            "save": calls["save"],
            "restore": calls["restore"],
        }
    same = ("method", "H", "rtol", "e_max", "e_rms", "energy", "gap", "wall_min", "wall_median", "cpu")
    taken = {name: point[name] for name in (*same, "real_time_factor", "order", "status")}
    return Point(scene=scene, counts={kind: n for kind, n in counts.items() if n}, **taken)


def whole(name: str, repeat: int) -> list[Point]:
    """The whole study, printed as it goes, with its table and plots."""
    plan, folder = PLANS[name], paths.OUT / name
    folder.mkdir(parents=True, exist_ok=True)
    with library.scene(name) as scene:
        reference = study.reference_of(scene)
        source = [one.removeprefix("source: ") for one in reference.source if one.startswith("source: ")]
        print(f"{name}, {scene.stop - scene.start:g} s; reference: {' '.join(source)}")
        print(study.HEADER, flush=True)
        options = {"steps": plan.steps, "tolerances": plan.tolerances, "methods": plan.methods, "repeat": repeat}
        points = scene.study(**options, reference=reference, each=lambda point: print(study.line(point), flush=True))
    orders = {point.method: point.order for point in points if point.order is not None}
    print("fitted order: " + ", ".join(f"{method} {order:.2f}" for method, order in orders.items()))
    study.write_csv(points, folder / "work_precision.csv", host.facts())
    for path in plot.work_precision(points, folder):
        print(path)
    return points


def main(arguments: Sequence[str] | None = None):
    """Study, or keep, the named scenes."""
    parser = argparse.ArgumentParser(prog="python -m koppel.scene_study", description=__doc__.splitlines()[0])
    parser.add_argument("--keep", action="store_true", help="write the files that the regression test compares with")
    parser.add_argument("--repeat", type=int, default=7, help="timed runs per point (default 7)")
    parser.add_argument("names", nargs="*", metavar="NAME", help="scenes; all unless given")
    options = parser.parse_args(arguments)
    for name in options.names or PLANS:
        if name not in PLANS:
            parser.error(f"no scene {name}; there are: {', '.join(PLANS)}")
        if options.keep:
            for path, points in ((REGRESSION, kept(name)), (REGRESSION / "native", kept_native(name))):
                study.write_regression(points, path / f"{name}.json")
                print(f"written: {(path / name).relative_to(paths.ROOT)}.json")
        else:
            whole(name, options.repeat)


if __name__ == "__main__":
    try:
        main()
    except (SceneError, FileNotFoundError) as failed:
        sys.exit(f"error: {failed}")
