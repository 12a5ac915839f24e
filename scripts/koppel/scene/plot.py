"""Error over wall time and over evaluations of a scene's study."""

from collections.abc import Sequence
from pathlib import Path

import matplotlib.pyplot as plt
from matplotlib.ticker import NullFormatter

from ..plots import MUTED, STYLE, save
from .study import Point

# Okabe-Ito colours and different markers: told apart with any colour vision and in grey
COLOURS = ("#0072b2", "#009e73", "#d55e00", "#cc79a7", "#e69f00", "#56b4e9", "#000000", "#7f7f7f", "#8c564b")
MARKERS = "o^sDvP*Xh"


def work_precision(points: Sequence[Point], folder: Path) -> list[Path]:
    """`error_over_time.png` and `error_over_evaluations.png` in the folder; points that failed are named in the legend."""
    panels = {
        "error_over_time.png": (lambda p: p.wall_min and p.wall_min * 1e3, "wall time of the loop  [ms]"),
        "error_over_evaluations.png": (
            lambda p: p.counts.get("evaluations"),
            "right-hand sides of single components  [1]",
        ),
    }
    return [_panel(points, work, label, folder / name) for name, (work, label) in panels.items()]


def _panel(points: Sequence[Point], work, label: str, path: Path) -> Path:
    methods = dict.fromkeys(point.method for point in points)
    with plt.rc_context(STYLE):
        figure, axis = plt.subplots(figsize=(7.6, 5.2), layout="constrained")
        for number, method in enumerate(methods):
            of = [point for point in points if point.method == method]
            shown = [(work(point), point.e_max) for point in of if point.e_max and work(point)]
            order = of[0].order
            name = method + (f", order {order:.1f}" if order is not None else "")
            failed = [point for point in of if point.status.startswith("diverged")]
            if failed:
                name += f", {failed[0].status}" + ("" if len(failed) < len(of) else " (all)")
            if not shown and not failed:
                continue
            axis.loglog(
                *(zip(*shown) if shown else ([], [])),
                color=COLOURS[number % len(COLOURS)],
                marker=MARKERS[number % len(MARKERS)],
                label=name,
                lw=1.3,
                ms=6,
            )
        axis.set(xlabel=label, ylabel="largest error over scale  [1]", title=points[0].scene.replace("_", " "))
        axis.xaxis.set_minor_formatter(NullFormatter())
        axis.legend(fontsize=8, labelcolor=MUTED)
        save(figure, path)
    return path
