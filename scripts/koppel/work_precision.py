"""Error against run time: methods x inner steps or tolerances of one scene at a fixed communication step.

Two times are measured for every point: the CPU time inside the FMU (compiled loader) and the CPU time of the same loop
through fmpy. Both leave out loading, initialisation and recording.
"""

import csv
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from . import scenes
from .fmu import Fmu, Value
from .loader import Loader
from .reference import Reference

#: Communication step of the study [s].
H = 0.05
#: Inner steps of the fixed-step methods [s].
STEPS = (0.05, 0.025, 0.01, 0.005, 0.002, 0.001)
#: Relative tolerances of the adaptive methods; atol = rtol / 1000.
TOLERANCES = (1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10)
FIXED = ("heun", "rk4")
ADAPTIVE = ("dopri5",)

#: Below this the comparison shows the reference, not the method [rad]: two independent programs agree on theta to
#: 3e-15 rad, and a margin of 30 keeps the fitted order clear of it.
SATURATED = 1e-13

ENERGIES = ("energy.kinetic", "energy.potential", "energy.dissipated", "energy.supplied")


@dataclass(frozen=True)
class Setting:
    """One point of the study before it is run."""

    method: str
    #: Inner step [s] of a fixed-step method, or None.
    step: float | None = None
    #: Relative tolerance of an adaptive method, or None.
    rtol: float | None = None

    @property
    def start_values(self) -> dict[str, Value]:
        """Parameters of the FMU."""
        if self.step is not None:
            return scenes.fixed(self.method, self.step)
        return scenes.adaptive(self.method, self.rtol)

    @property
    def label(self) -> str:
        """Step or tolerance for a table."""
        return f"h = {self.step:g} s" if self.step is not None else f"rtol 1e{round(math.log10(self.rtol))}"


def settings() -> list[Setting]:
    """All points of the study."""
    return [Setting(method, step=step) for method in FIXED for step in STEPS] + [
        Setting(method, rtol=rtol) for method in ADAPTIVE for rtol in TOLERANCES
    ]


@dataclass(frozen=True)
class Point:
    """One row of work_precision.csv. Times in seconds for one run of `simulated` seconds."""

    scene: str
    method: str
    H: float
    step: float | None
    rtol: float | None
    atol: float | None
    #: Largest error over all signals, each over its scale s = max(max |reference|, nominal); rms likewise.
    e_max: float
    e_rms: float
    #: Error of lower.angle.theta [rad] and over the amplitude; worst joint force [N].
    theta_error: float
    theta_error_relative: float
    force_error: float
    #: Energy balance over the largest energy; largest loop gap [m].
    energy: float
    gap: float
    wall_min: float
    wall_median: float
    #: CPU time inside the FMU (compiled loader).
    cpu: float
    cpu_median: float
    #: CPU time of the loop through fmpy.
    cpu_fmpy: float
    cpu_fmpy_median: float
    simulated: float
    #: Simulated time over CPU time inside the FMU.
    real_time_factor: float
    do_steps: int
    steps: int
    rhs_evaluations: int
    rejected: int
    #: Fitted order of the method (slope of its last three points that are not saturated).
    order: float | None
    status: str


def energy_balance(result) -> float:
    """Largest |kinetic + potential - start - supplied + dissipated| over the largest energy that occurs.

    Energies that occur: kinetic, dissipated, supplied, and the change of the potential energy (its zero is arbitrary).
    """
    kinetic, potential, dissipated, supplied = (result[name] for name in ENERGIES)
    stored = kinetic + potential
    balance = stored - stored[0] - supplied + dissipated
    largest = max(np.abs(energy).max() for energy in (kinetic, potential - potential[0], dissipated, supplied))
    return float(np.abs(balance).max() / largest)


def fitted_order(work: Sequence[float], error: Sequence[float], saturated: float = SATURATED) -> float | None:
    """Slope of log(error) over log(work), sign turned, of the last three points that are not saturated."""
    points = [(math.log(w), math.log(e)) for w, e in sorted(zip(work, error)) if e > saturated and math.isfinite(e)]
    if len(points) < 3:
        return None
    x, y = np.array(points[-3:]).T
    return float(-np.polyfit(x, y, 1)[0])


def run_point(
    fmu: Fmu,
    loader: Loader,
    reference: Reference,
    setting: Setting,
    scene: str = "double_wishbone",
    start_values: Mapping[str, Value] | None = None,
    stop: float = 10.0,
    repeat: int = 7,
    min_time: float = 0.05,
) -> Point:
    """Error, counts and both times of one setting."""
    values = {**(start_values or {}), **setting.start_values}
    outputs = [name for name in reference.names if name in fmu.variables] + ["loop.gap"]
    result = fmu.run(values, H=H, stop=stop, outputs=outputs)
    error = reference.error_of(result)
    theta = error["lower.angle.theta"].largest
    inside = loader.run(fmu, values, H=H, stop=stop, repeat=repeat, min_time=min_time)
    if inside.counts != result.counts:
        raise RuntimeError(
            f"{setting.method} {setting.label}: counters {inside.counts} in the loader, {result.counts} in fmpy"
        )
    through = fmu.time_loop(values, H=H, stop=stop, repeats=repeat, min_time=min_time)
    return Point(
        scene=scene,
        method=setting.method,
        H=H,
        step=setting.step,
        rtol=setting.rtol,
        atol=None if setting.rtol is None else scenes.atol_of(setting.rtol),
        e_max=error.e_max,
        e_rms=error.e_rms,
        theta_error=theta,
        theta_error_relative=theta / reference.amplitude("lower.angle.theta"),
        force_error=error.worst("force").largest,
        energy=energy_balance(result),
        gap=float(np.abs(result["loop.gap"]).max()),
        wall_min=inside.wall_min,
        wall_median=inside.wall_median,
        cpu=inside.cpu_min,
        cpu_median=inside.cpu_median,
        cpu_fmpy=through.cpu_min,
        cpu_fmpy_median=through.cpu_median,
        simulated=stop,
        real_time_factor=stop / inside.cpu_min,
        do_steps=inside.steps,
        steps=result.counts["solver.steps"],
        rhs_evaluations=result.counts["solver.rhs_evaluations"],
        rejected=result.counts["solver.rejected"],
        order=None,
        status="ok",
    )


def with_orders(points: Sequence[Point]) -> list[Point]:
    """The points with the fitted order of their method filled in (work = number of inner steps)."""
    orders = {}
    for method in dict.fromkeys(point.method for point in points):
        of = [point for point in points if point.method == method]
        orders[method] = fitted_order([point.steps for point in of], [point.theta_error for point in of])
    return [Point(**{**as_dict(point), "order": orders[point.method]}) for point in points]


def study(
    fmu: Fmu,
    loader: Loader,
    reference: Reference,
    *,
    each: Callable[[Point], None] = lambda point: None,
    **options,
) -> list[Point]:
    """All points of the study; `each` is called as soon as a point is there."""
    points = []
    for setting in settings():
        points.append(run_point(fmu, loader, reference, setting, **options))
        each(points[-1])
    return with_orders(points)


def as_dict(point: Point) -> dict:
    """Fields by name."""
    return {field.name: getattr(point, field.name) for field in fields(point)}


def write_csv(points: Sequence[Point], path: Path):
    """work_precision.csv: one row per point, SI units, empty where a column does not apply."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(field.name for field in fields(Point))
        for point in points:
            writer.writerow("" if value is None else value for value in as_dict(point).values())


HEADER = (
    f"{'method':<8}{'step or tolerance':<19}{'theta error':>12}{'of ampl.':>10}{'force err.':>11}{'energy':>10}"
    f"{'CPU in FMU':>12}{'CPU fmpy':>11}{'real time':>11}{'steps':>8}{'rhs':>8}{'rej.':>6}"
)
UNITS = f"{'':<8}{'':<19}{'rad':>12}{'1':>10}{'N':>11}{'1':>10}{'ms':>12}{'ms':>11}{'x':>11}{'':>8}{'':>8}{'':>6}"


def line(point: Point) -> str:
    """One line of the printed table."""
    label = Setting(point.method, point.step, point.rtol).label
    return (
        f"{point.method:<8}{label:<19}{point.theta_error:>12.2e}{point.theta_error_relative:>10.1e}{point.force_error:>11.2e}"
        f"{point.energy:>10.1e}{point.cpu * 1e3:>12.4f}{point.cpu_fmpy * 1e3:>11.4f}{point.real_time_factor:>11.0f}"
        f"{point.steps:>8}{point.rhs_evaluations:>8}{point.rejected:>6}"
    )
