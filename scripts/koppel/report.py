"""One HTML file with the figures inside it; opens anywhere, loads nothing."""

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path

from .reference import Error
from .scene.study import Point as CoupledPoint
from .work_precision import SATURATED, Point, Setting

#: Table 1 of the paper: tool, solver, run time [s] for 10 s with a largest step of 0.05 s on an i7-6700K.
PAPER_TABLE = (
    ("MATLAB/Simulink", "ode2 (Heun)", 0.157),
    ("Dymola", "DASSL", 0.269),
    ("Adams", "GSTIFF I3", 1.641),
)
PAPER_MACHINE = "i7-6700K, as printed"

METHOD_NAMES = {"heun": "Heun", "rk4": "RK4", "dopri5": "Dormand-Prince 5(4)"}

CSS = """
:root { color-scheme: light; }
body { font: 16px/1.55 system-ui, "Segoe UI", "DejaVu Sans", sans-serif; color: #1a1a1a; background: #fff;
       max-width: 70rem; margin: 2.5rem auto; padding: 0 1.5rem; }
h1 { font-size: 1.7rem; line-height: 1.2; margin: 0 0 .4rem; }
h2 { font-size: 1.2rem; margin: 2.6rem 0 .6rem; }
p { margin: .4rem 0 .8rem; max-width: 48rem; }
.lead { font-size: 1.08rem; color: #3c4043; }
img { width: 100%; height: auto; display: block; margin: .6rem 0; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-size: .86rem; font-variant-numeric: tabular-nums; margin: .6rem 0 1rem; }
th, td { padding: .3rem .55rem; text-align: right; border-bottom: 1px solid #e3e5e8; white-space: nowrap; }
th { font-weight: 600; color: #3c4043; border-bottom-color: #9aa0a6; vertical-align: bottom; }
th span { display: block; font-weight: 400; color: #5f6368; }
td.text, th.text { text-align: left; vertical-align: top; }
.wide td.text { white-space: normal; }
tr.group td { border-top: 1px solid #9aa0a6; }
tr.ours { background: #f3f7fb; }
.key { display: flex; flex-wrap: wrap; gap: .8rem 2.6rem; margin: 1.2rem 0; }
.key div { min-width: 9rem; }
.key b { display: block; font-size: 1.5rem; line-height: 1.2; }
.key span { color: #5f6368; font-size: .86rem; }
code { font-family: ui-monospace, "DejaVu Sans Mono", monospace; font-size: .9em; }
details { margin: .6rem 0; } summary { cursor: pointer; }
"""


@dataclass(frozen=True)
class Loaded:
    """What of the product took part: counts are loaded / available."""

    fmus: tuple[int, int]
    variables_recorded: tuple[int, int]
    inputs_connected: tuple[int, int]
    #: Optional parts and choices: name -> value.
    parts: dict[str, str]


def image(path: Path, text: str) -> str:
    """An <img> with the file inside."""
    data = base64.b64encode(path.read_bytes()).decode("ascii")
    return f'<img alt="{escape(text)}" src="data:image/png;base64,{data}">'


def ms(seconds: float) -> str:
    """Milliseconds with three digits that count."""
    return f"{seconds * 1e3:.3g}"


def number(value: float | None, form: str = ".1e") -> str:
    """A number, or a dash."""
    return "-" if value is None else format(value, form)


def find(points: Sequence[Point], method: str, **wanted) -> Point:
    """The point with these values."""
    for point in points:
        if point.method == method and all(getattr(point, name) == value for name, value in wanted.items()):
            return point
    raise KeyError(f"the study has no {method} with {wanted}")


def study_table(points: Sequence[Point]) -> str:
    """All points, with units."""
    columns = (
        ("method", ""),
        ("step or tolerance", ""),
        ("theta1 error", "rad"),
        ("relative", "of the amplitude"),
        ("CPU in FMU", "ms"),
        ("CPU fmpy", "ms"),
        ("real time", "factor"),
        ("force error", "N"),
        ("energy", "balance"),
        ("evaluations", ""),
        ("rejected", ""),
    )
    text = 'class="text"'
    head = "".join(
        f"<th {text if i < 2 else ''}>{name}<span>{unit}</span></th>" for i, (name, unit) in enumerate(columns)
    )
    rows, last = [], None
    for p in points:
        label = Setting(p.method, p.step, p.rtol).label
        first = p.method != last
        cells = (
            number(p.theta_error),
            number(p.theta_error_relative),
            ms(p.cpu),
            ms(p.cpu_fmpy),
            f"{p.real_time_factor:,.0f}",
            number(p.force_error),
            number(p.energy),
            p.rhs_evaluations,
            p.rejected,
        )
        name = f"{METHOD_NAMES.get(p.method, p.method)}<br>order {number(p.order, '.2f')}" if first else ""
        rows.append(
            f"<tr{' class=group' if first and last else ''}>"
            + (f"<td {text} rowspan={sum(q.method == p.method for q in points)}>{name}</td>" if first else "")
            + f"<td {text}>{label}</td>"
            + "".join(f"<td>{cell}</td>" for cell in cells)
            + "</tr>"
        )
        last = p.method
    return f'<div class="scroll"><table><thead><tr>{head}</tr></thead><tbody>{"".join(rows)}</tbody></table></div>'


def paper_table(points: Sequence[Point]) -> str:
    """Table 1 of the paper with our rows below."""
    rows = [
        f'<tr><td class="text">{tool}</td><td class="text">{solver}</td><td>{time * 1e3:.0f}</td><td>-</td><td>-</td>'
        f'<td>{10.0 / time:.0f}</td><td class="text">{PAPER_MACHINE}</td></tr>'
        for tool, solver, time in PAPER_TABLE
    ]
    ours = (
        find(points, "heun", step=0.05),
        find(points, "rk4", step=0.05),
        find(points, "rk4", step=0.01),
        find(points, "dopri5", rtol=1e-6),
    )
    for p in ours:
        label = f"{METHOD_NAMES[p.method]}, {Setting(p.method, p.step, p.rtol).label}"
        rows.append(
            f'<tr class="ours"><td class="text">this FMU</td><td class="text">{label}</td><td>{ms(p.cpu)}</td>'
            f"<td>{ms(p.cpu_fmpy)}</td><td>{number(p.theta_error_relative)}</td><td>{p.real_time_factor:,.0f}</td>"
            '<td class="text">this machine</td></tr>'
        )
    return (
        '<div class="scroll"><table><thead><tr><th class="text">tool</th><th class="text">solver</th>'
        "<th>time<span>ms</span></th><th>fmpy loop<span>ms</span></th><th>error<span>of the amplitude</span></th>"
        '<th>real-time factor<span>1</span></th><th class="text">machine</th></tr></thead>'
        f"<tbody>{''.join(rows)}</tbody></table></div>"
    )


def error_table(error: Error) -> str:
    """Error of every signal."""
    rows = "".join(
        f'<tr><td class="text"><code>{escape(s.name)}</code></td><td>{s.largest:.2e}</td><td class="text">{s.unit}</td>'
        f"<td>{s.at:.2f}</td><td>{s.scale:.3g}</td><td>{s.e_max:.1e}</td><td>{s.e_rms:.1e}</td></tr>"
        for s in sorted(error.signals, key=lambda signal: -signal.e_max)
    )
    return (
        '<div class="scroll"><table><thead><tr><th class="text">signal</th><th>largest error</th><th class="text">unit</th>'
        f"<th>at<span>s</span></th><th>scale</th><th>e_max</th><th>e_rms</th></tr></thead><tbody>{rows}</tbody></table></div>"
    )


def pairs(values: dict[str, str]) -> str:
    """A table of two columns."""
    rows = "".join(
        f'<tr><td class="text">{escape(k)}</td><td class="text">{escape(v)}</td></tr>' for k, v in values.items()
    )
    return f'<table class="wide"><tbody>{rows}</tbody></table>'


def coupled_table(points: Sequence[CoupledPoint]) -> str:
    """Errors, times and counts of the coupled elements."""
    rows = []
    for p in points:
        setting = f"rtol {p.rtol:.0e}" if p.H is None else f"{p.H * 1e3:g} ms"
        if p.status != "ok":
            rows.append(
                f'<tr><td class="text">{p.method}</td><td>{setting}</td><td colspan="6">{escape(p.status)}</td></tr>'
            )
            continue
        cells = [
            number(p.e_max),
            number(p.e_rms),
            number(p.gap),
            ms(p.cpu),
            str(p.counts["calls"]),
            str(p.counts["evaluations"]),
        ]
        cells = "".join(f"<td>{cell}</td>" for cell in cells)
        rows.append(f'<tr><td class="text">{p.method}</td><td>{setting}</td>{cells}</tr>')
    head = "".join(
        f"<th>{name}</th>"
        for name in ("method", "H or rtol", "e_max", "e_rms", "gap [m]", "CPU", "FMI calls", "evaluations")
    )
    return f"<table><thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody></table>"


def double_wishbone(
    path: Path,
    *,
    points: Sequence[Point],
    coupled: Sequence[CoupledPoint],
    error: Error,
    amplitude: float,
    source: Sequence[str],
    loaded: Loaded,
    facts: dict[str, str],
    figure18: Path,
    work_precision: Path,
    coupled_plot: Path,
):
    """Write report.html."""
    paper = find(points, "heun", step=0.05)
    best = min(points, key=lambda point: point.theta_error)
    best_label = f"{METHOD_NAMES[best.method]}, {Setting(best.method, best.step, best.rtol).label}"
    of = lambda pair: f"{pair[0]} / {pair[1]}"
    body = f"""
<h1>Double wishbone: error against run time</h1>
<p class="lead">A wheel carrier on two links with spring and damper, driven by a 10 N sine at 10 rad/s for 10 s: the case of the
paper's figure 18, as an FMI 3.0 Co-Simulation FMU run by fmpy. Every number is compared with a solution that shares no code
with the FMU.</p>
<div class="key">
<div><b>{
        ms(paper.cpu)
    } ms</b><span>CPU inside the FMU for the paper's run<br>(Heun, 0.05 s, 10 s simulated)</span></div>
<div><b>{paper.theta_error_relative * 100:.0f} %</b><span>error of that run, of the amplitude {
        amplitude * 1e3:.3f} mrad</span></div>
<div><b>{number(best.theta_error)} rad</b><span>smallest error in the study<br>({best_label}, {
        ms(best.cpu)
    } ms)</span></div>
</div>

<h2>Figure 18</h2>
<p>Angle of the lower link against its start, with the step of the paper. Below: distance to the reference.</p>
{image(figure18, "theta1 minus its start value over 10 s: reference, Heun and RK4 with 0.05 s, and their errors")}

<h2>Beside the paper's table 1</h2>
<p>The paper's times are quoted as printed, from another machine and for whole tools; they show the order of magnitude, not a contest.
Ours: CPU time of the step loop only. The paper's table gives no errors.</p>
{paper_table(points)}

<h2>Work and precision</h2>
<p>Communication step 0.05 s throughout; only the inner step or the tolerance varies (atol = rtol / 1000). Error: largest deviation of
<code>lower.angle.theta</code> over 201 samples. Order: slope of the last three points above {SATURATED:.0e} rad.</p>
{image(work_precision, "log-log: error of theta1 over CPU time and over right-hand-side evaluations, three methods")}
{study_table(points)}
<p>Two times per run: <b>CPU in FMU</b> is measured by a compiled loader, <b>CPU fmpy</b> is the same doStep loop from Python.
Both leave out loading, initialisation and recording; minimum of 7 measurements of at least 50 ms after a warm-up.
An adaptive step never crosses a communication point, so the coarsest tolerances end at the same error.
Median, wall time, loop gap and all counts are in <code>work_precision.csv</code>.</p>
<details><summary>Error of every signal, Heun with 0.05 s</summary>
<p>e_max = largest error / s, s = max(largest reference value, nominal).</p>{error_table(error)}</details>

<h2>The same from separate FMUs</h2>
<p>Every element is an FMU of its own: lower link, carrier, upper link with strut, and the load at the wheel. Motion goes forward,
force goes backward, the loop is closed at the carrier's upper joint by one small linear solve. <b>common</b>: one integrator over
Model Exchange, the numbers of the single FMU with the same stabilisation; <b>cs</b>: every FMU steps by itself (RK4, one step per
H). The host is a Python script over fmpy, so its time is that of the script. e_max: largest error of all recorded angles, rates
and positions over their largest value. Closed loops cannot be run by plain exchange (Jacobi).</p>
{image(coupled_plot, "log-log: error of the coupled elements over wall time, by method")}
{coupled_table(coupled)}

<h2>What took part</h2>
{
        pairs(
            {
                "FMUs loaded / available": of(loaded.fmus),
                "variables recorded / outputs available": of(loaded.variables_recorded),
                "inputs connected / available": of(loaded.inputs_connected),
                "variables exchanged per step in the timed loops": "0",
                **loaded.parts,
            }
        )
    }

<h2>Machine, build, reference</h2>
{pairs({**facts, "reference": "; ".join(source)})}
<p>Made by <code>scripts/demo</code>. Beside this file: <code>result.csv</code>, <code>work_precision.csv</code>,
<code>coupled.csv</code>, <code>figure18.png</code>,
<code>work_precision.png</code>, <code>error_over_time.png</code>, <code>error_over_evaluations.png</code>.</p>
"""
    path.write_text(
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>Double wishbone: error against run time</title><style>{CSS}</style></head><body>{body}</body></html>\n",
        encoding="utf-8",
    )
