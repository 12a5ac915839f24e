"""What calms a structure: Rayleigh-van-der-Pol absorber, passive absorbers and none, by the scene
`absorber_on_oscillator`.

python -m koppel.absorber    docs/absorber_detuning.png, out/absorber/{cases,detuning}.csv, the table of cases
"""

import csv
from dataclasses import dataclass
from math import pi

import numpy as np

from . import library, paths, scenes

#: Design frequency [rad/s] and force [N].
OMEGA, FORCE = 4.0 * pi, 50.0
#: Samples per period, and periods at the end over which is measured.
SAMPLES, LAST = 48, 10
STOP = 60.0
KINDS: dict[str, str | None] = {"none": None, "passive": "passive", "den_hartog": "den_hartog", "rvdp": "rvdp"}


@dataclass(frozen=True)
class Measured:
    """Over the last periods."""

    #: Largest displacement of the structure, and its part at the drive's frequency [m]; off the design point they
    #: differ where the motion has two frequencies
    amplitude: float
    harmonic: float
    #: Root mean square of the controlled force [N] and mean power of the controller [W]
    force: float = 0.0
    power: float = 0.0


def measure(absorber: str | None, omega: float = OMEGA, fmus=None, stop: float = STOP, **options) -> Measured:
    """One run of the scene; `options` as of `library.absorber_on_oscillator`."""
    interval = 2.0 * pi / omega / SAMPLES
    periods = int(stop / interval) // SAMPLES
    with library.scene("absorber_on_oscillator", fmus, absorber=absorber, omega=omega, **options) as scene:
        # quadratic extrapolation at 2.6 ms: 1e-5 of the peak, where a common integrator would restart at every sample
        how = {"method": "seidel", "order": 2, "H": 0.25 * interval, "values": scenes.adaptive("dop853", 1e-8)}
        result = scene.run(interval=interval, stop=periods * SAMPLES * interval, **how)
    late = slice(-LAST * SAMPLES, None)
    s, t = result["primary.s[1]"][late], result.t[late]
    amplitude, harmonic = float(np.abs(s).max()), float(abs(2.0 * (s * np.exp(-1j * omega * t)).mean()))
    if absorber != "rvdp":
        return Measured(amplitude, harmonic)
    force, power = (result[f"absorber.control.{name}"][late] for name in ("F1", "power"))
    return Measured(amplitude, harmonic, float(np.sqrt((force**2).mean())), float(power.mean()))


#: Name; drive of all absorbers; what is told or changed for the controlled one.
CASES: list[tuple[str, dict, dict]] = [
    ("design point", {}, {}),
    ("force +20 %", {"force": 1.2 * FORCE}, {}),
    ("force -20 %", {"force": 0.8 * FORCE}, {}),
    ("force -20 %, gamma/10", {"force": 0.8 * FORCE}, {"control.gamma": 1.0}),
    ("force +20 %, gamma x10", {"force": 1.2 * FORCE}, {"control.gamma": 100.0}),
    ("frequency +2 % not told", {"omega": 1.02 * OMEGA}, {"told": False}),
    ("frequency +5 % not told", {"omega": 1.05 * OMEGA}, {"told": False}),
    ("frequency +5 % told", {"omega": 1.05 * OMEGA}, {}),
    ("frequency -20 % told", {"omega": 0.8 * OMEGA}, {}),
    ("no force", {"force": 0.0}, {}),
    ("damping not compensated", {}, {"control.compensate_damping": False}),
]


def told(drive: dict, own: dict) -> dict:
    """With the frequency, a controller is told the amplitude that goes with it: X = F/(m omega^2)."""
    omega = drive.get("omega", OMEGA)
    if "omega" in drive and own.get("told", True):
        return own | {"control.amplitude": FORCE / (5.0 * omega**2)}
    return own


def case(drive: dict, own: dict, fmus=None) -> dict[str, Measured]:
    """A case with all absorbers."""
    own = told(drive, own)
    return {kind: measure(w, fmus=fmus, **drive, **(own if w == "rvdp" else {})) for kind, w in KINDS.items()}


def detuning(ratios, fmus=None) -> dict[str, list[float]]:
    """Amplitudes of the structure over the drive's frequency relative to the design; `rvdp_told` knows the
    frequency."""
    columns = {kind: [measure(w, r * OMEGA, fmus, **({} if w != "rvdp" else {"told": False})).amplitude for r in ratios]
               for kind, w in KINDS.items()}  # fmt: skip
    columns["rvdp_told"] = [
        measure("rvdp", r * OMEGA, fmus, **told({"omega": r * OMEGA}, {})).amplitude for r in ratios
    ]
    return columns


def draw(ratios, columns: dict[str, list[float]], path):
    """The diagram."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    labels = {
        "none": "none",
        "passive": "passive, tuned",
        "den_hartog": "Den Hartog",
        "rvdp": "RvdP, frequency not told",
        "rvdp_told": "RvdP, frequency told",
    }
    figure, axes = pyplot.subplots(figsize=(7.0, 4.2), layout="constrained")
    for kind, label in labels.items():
        style = "--" if kind == "rvdp" else "-"
        axes.semilogy(100.0 * (np.asarray(ratios) - 1.0), 1e3 * np.asarray(columns[kind]), style, label=label)
    axes.set_xlabel("drive frequency off the design [%]")
    axes.set_ylabel("amplitude of the structure after 60 s [mm]")
    axes.grid(True, which="both", alpha=0.25)
    axes.legend()
    figure.savefig(path, dpi=110, metadata={"Software": None})
    pyplot.close(figure)


def _write(path, header, rows):
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([header, *rows])


def main():
    """`scripts/absorber`"""
    out = paths.ROOT / "out" / "absorber"
    out.mkdir(parents=True, exist_ok=True)
    print(
        f"{'case':26}{'RvdP':>9}{'at omega':>9}{'none':>9}{'passive':>9}{'Hartog':>9}  mm {'F1 rms N':>9}{'mean W':>9}"
    )
    rows = []
    for name, drive, own in CASES:
        found = case(drive, own)
        others = [found[kind].amplitude for kind in ("none", "passive", "den_hartog")]
        mm = [1e3 * a for a in (found["rvdp"].amplitude, found["rvdp"].harmonic, *others)]
        row = [*mm, found["rvdp"].force, found["rvdp"].power]
        print(f"{name:26}" + "".join(f"{v:9.4g}" for v in mm) + f"     {row[5]:9.4g}{row[6]:9.4g}", flush=True)
        rows.append([name, *row])
    _write(
        out / "cases.csv",
        ["case", "rvdp_mm", "rvdp_harmonic_mm", "none_mm", "passive_mm", "den_hartog_mm", "force_rms_N", "power_W"],
        rows,
    )
    ratios = 1.0 + np.array([-20, -10, -5, -3, -1, 0, 1, 3, 5, 10, 20]) / 100.0
    columns = detuning(ratios)
    _write(out / "detuning.csv", ["ratio", *columns], zip(ratios, *columns.values()))
    draw(ratios, columns, paths.ROOT / "docs" / "absorber_detuning.png")
    print(f"== {out}/cases.csv, detuning.csv and docs/absorber_detuning.png")


if __name__ == "__main__":
    main()
