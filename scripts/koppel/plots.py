"""Figures of the double wishbone: figure 18 of the paper and error against run time."""

from collections.abc import Sequence
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt  # noqa: E402  (the backend must be chosen first)
import numpy as np  # noqa: E402
from matplotlib.lines import Line2D  # noqa: E402
from matplotlib.ticker import LogLocator, NullFormatter  # noqa: E402

from .fmu import Result  # noqa: E402
from .reference import Reference  # noqa: E402
from .work_precision import Point, Setting  # noqa: E402

THETA = "lower.angle.theta"

# Okabe-Ito colours: told apart with any colour vision and, by their markers and dashes, in grey.
INK, MUTED, GRID = "#1a1a1a", "#5f6368", "#e3e5e8"
METHODS = {
    "heun": {"color": "#d55e00", "marker": "o", "label": "Heun"},
    "rk4": {"color": "#0072b2", "marker": "s", "label": "RK4"},
    "dopri5": {"color": "#009e73", "marker": "^", "label": "Dormand-Prince 5(4)"},
}
#: Where the first and the last point of a curve carry their text: offset in points and alignment.
CAPTIONS = {
    "heun": (((7, 5), "left"), ((7, 5), "left")),
    "rk4": (((-8, -4), "right"), ((8, -4), "left")),
    "dopri5": (((-8, -4), "right"), ((-8, -4), "right")),
}

STYLE = {
    "figure.dpi": 100,
    "savefig.dpi": 160,
    "font.family": "DejaVu Sans",
    "font.size": 10.5,
    "axes.edgecolor": MUTED,
    "axes.labelcolor": INK,
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": 12,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.titlepad": 12,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": GRID,
    "grid.linewidth": 0.8,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "legend.frameon": False,
    "lines.solid_capstyle": "round",
}


def save(figure, path: Path):
    """Write the figure; no date inside, so that equal data give equal files."""
    figure.savefig(path, metadata={"Software": None})
    plt.close(figure)


def figure18(reference: Reference, runs: dict[str, Result], path: Path):
    """theta1 - theta1_0 over 0..10 s on the paper's axis, with the errors below."""
    with plt.rc_context(STYLE):
        figure, (top, bottom) = plt.subplots(
            2, 1, figsize=(9.0, 6.4), sharex=True, height_ratios=[3, 1.35], layout="constrained"
        )
        deviation = reference[THETA] - reference[THETA][0]
        top.plot(reference.t, deviation, color=INK, lw=1.1, label="reference", zorder=2)
        drawing = {"heun": {"lw": 0, "ms": 4.0, "mfc": "none", "mew": 1.0}, "rk4": {"lw": 0, "ms": 3.0}}
        for method, result in runs.items():
            style = METHODS[method]
            name = f"{style['label']}, h = 0.05 s"
            top.plot(
                result.t,
                result[THETA] - result[THETA][0],
                color=style["color"],
                marker=style["marker"],
                label=name,
                zorder=3,
                clip_on=False,
                **drawing[method],
            )
            # from the first step on: the start is exact
            error = np.abs(result[THETA] - reference[THETA])
            bottom.semilogy(result.t[1:], error[1:], color=style["color"], lw=1.1, label=name)
        top.set(ylim=(-0.01, 0.01), xlim=(0.0, 10.0), ylabel=r"$\theta_1 - \theta_{1,0}$  [rad]")
        top.set_yticks([-0.01, -0.005, 0.0, 0.005, 0.01])
        top.set_title("Lower link under a 10 N sine at 10 rad/s (figure 18)")
        top.legend(loc="upper right", ncols=3, bbox_to_anchor=(1.0, 1.02), handletextpad=0.4, columnspacing=1.4)
        bottom.set(xlabel="time  [s]", ylabel="|error|  [rad]")
        bottom.yaxis.set_major_locator(LogLocator(numticks=5))
        bottom.yaxis.set_minor_formatter(NullFormatter())
        figure.align_ylabels()
        save(figure, path)


def work_precision(points: Sequence[Point], amplitude: float, path: Path):
    """log-log: error of theta1 over the CPU time inside the FMU, and over right-hand-side evaluations."""
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(1, 2, figsize=(10.6, 4.9), sharey=True, layout="constrained")
        panels = (
            (axes[0], lambda p: p.cpu * 1e3, "CPU time inside the FMU for 10 s  [ms]"),
            (axes[1], lambda p: p.rhs_evaluations, "right-hand-side evaluations  [1]"),
        )
        handles = []
        for method, style in METHODS.items():
            of = [point for point in points if point.method == method]
            if not of:
                continue
            for axis, work, _ in panels:
                axis.loglog(
                    [work(point) for point in of],
                    [point.theta_error for point in of],
                    color=style["color"],
                    marker=style["marker"],
                    ms=6,
                    lw=1.5,
                    mec="white",
                    mew=0.8,
                )
            order = of[0].order
            fitted = "" if order is None else f", order {order:.1f}"
            handles.append(
                Line2D(
                    [], [], color=style["color"], marker=style["marker"], lw=1.5, ms=6, label=style["label"] + fitted
                )
            )
            # the ends of each curve carry their step or tolerance
            for point, (offset, side) in zip((of[0], of[-1]), CAPTIONS[method]):
                axes[0].annotate(
                    Setting(point.method, point.step, point.rtol).label,
                    (point.cpu * 1e3, point.theta_error),
                    textcoords="offset points",
                    xytext=offset,
                    ha=side,
                    fontsize=8,
                    color=MUTED,
                )
        for axis, _, label in panels:
            axis.set_xlabel(label)
            axis.xaxis.set_minor_formatter(NullFormatter())
            axis.margins(x=0.24, y=0.08)
        axes[0].set_ylabel(r"largest error of $\theta_1$  [rad]")
        axes[0].set_title("Error against run time")
        axes[1].set_title("Error against evaluations")
        relative = axes[1].secondary_yaxis("right", functions=(lambda e: e / amplitude, lambda e: e * amplitude))
        relative.set_ylabel("relative to the amplitude  [1]")
        relative.spines["right"].set_visible(True)
        axes[1].legend(handles=handles, loc="lower left")
        save(figure, path)
