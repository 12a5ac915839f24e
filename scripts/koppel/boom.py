"""The boom under the profiles of commands of `tests/reference/boom`: pictures, and differences from the reference.

python -m koppel.boom    out/boom/profile_*.png
"""

from dataclasses import dataclass

import numpy as np

from . import paths
from .fmu import Fmu, Result

JOINTS = range(1, 7)
CYLINDERS = range(2, 7)
#: Profile: variant and support of the machine.
PROFILES = {"profile_rate_A": ("A", "full"), "profile_flow_B": ("B", "partial")}
#: Outputs that the reference has too: largest difference that the specification allows (A5, A6), column.
COMPARED = {
    **{f"joint[{i}].angle": (1e-6, f"q{i}") for i in JOINTS},
    **{f"joint[{i}].velocity": (1e-6, f"qd{i}") for i in JOINTS},
    **{f"cylinder[{i}].flow": (1e-9, f"flow{i}") for i in CYLINDERS},
    "hydraulics.flow_total": (1e-9, "flow_total"),
    **{f"TIP.r.{axis}": (1e-4, f"tip.r.{axis}") for axis in "xyz"},
    **{f"TIP.v.{axis}": (1e-5, f"tip.v.{axis}") for axis in "xyz"},
    **{f"TIP.a.{axis}": (1e-5, f"tip.a.{axis}") for axis in "xyz"},
    "stability.beta_min": (1e-6, "beta_min"),
    "energy.potential": (1.0, "potential"),
}


@dataclass(frozen=True)
class Profile:
    """Rows of a reference file by column."""

    name: str
    table: np.ndarray

    @classmethod
    def read(cls, name: str) -> "Profile":
        """`name`: a key of `PROFILES`."""
        text = (paths.ROOT / "tests" / "reference" / "boom" / f"{name}.csv").read_text(encoding="utf-8")
        lines = [line for line in text.splitlines() if not line.startswith("#")]
        return cls(name, np.genfromtxt(lines, delimiter=",", names=True, deletechars=""))

    def commands(self, row: int) -> dict[str, float]:
        """What the joints are told from a row on."""
        return {f"joint[{i}].velocity_command": float(self.table[f"cmd{i}"][row]) for i in JOINTS}

    def steady(self) -> np.ndarray:
        """True where the commands of a row are those of the row before: there rates are the same on both sides."""
        told = np.column_stack([self.table[f"cmd{i}"] for i in JOINTS])
        return np.append(True, (told[1:] == told[:-1]).all(axis=1))


def play(fmu: Fmu, profile: Profile) -> Result:
    """All outputs at the times of the profile, under its commands."""
    variant, support = PROFILES[profile.name]
    start = {f"joint[{i}].angle_start": float(profile.table[f"q{i}"][0]) for i in JOINTS}
    start |= {"machine.variant": variant, "machine.support": support, **profile.commands(0)}
    t, names = profile.table["time"], fmu.names("output")
    law = lambda at: list(profile.commands(int(np.searchsorted(t, at + 1e-9)) - 1).values())
    with fmu.instantiate() as instance:
        instance.initialise(start, start=0.0, stop=float(t[-1]))
        return instance.run(t, names, (list(profile.commands(0)), law))


def differences(result: Result, profile: Profile) -> dict[str, tuple[float, float]]:
    """Largest difference and limit by output; rates at the instant of a new command are left out."""
    steady = profile.steady()
    return {
        name: (float(np.abs(result[name] - profile.table[column])[steady].max()), limit)
        for name, (limit, column) in COMPARED.items()
    }


def _points(result: Result, row: int) -> np.ndarray:
    """Joints 2 to 6 and the tip [m], one per row."""
    ports = [*(f"K[{k}]" for k in range(1, 6)), "TIP"]
    return np.array([[result[f"{port}.r.{axis}"][row] for axis in "xyz"] for port in ports])


def _views(side, top, result: Result):
    """The boom at six instants, from the side (in the plane of the boom) and from above."""
    from matplotlib import colormaps

    rows = np.linspace(0, len(result.t) - 1, 6).astype(int)
    for color, row in zip(colormaps["viridis"](np.linspace(0.0, 0.9, len(rows))), rows):
        points = _points(result, row)
        turn = np.pi + result["joint[1].angle"][row]
        out = points[:, 0] * np.cos(turn) + points[:, 1] * np.sin(turn)
        side.plot(out, points[:, 2], "o-", color=color, markersize=3, label=f"{result.t[row]:.0f} s")
        top.plot(points[:, 0], points[:, 1], "o-", color=color, markersize=3)
    side.axhline(0.0, color="0.6")
    side.set(title="side view", xlabel="away from the slewing axis [m]", ylabel="height [m]", aspect="equal")
    side.legend(fontsize="small", loc="upper left", bbox_to_anchor=(1.0, 1.0))
    top.plot(0.0, 0.0, "k+", markersize=10)
    top.set(title="top view", xlabel="x, forward [m]", ylabel="y, left [m]", aspect="equal")


def _curves(axes, result: Result):
    """Angles, used parts of flows and tangential speeds, margins, distances."""
    t = result.t
    angles, flows, speeds, margins, distances, total = axes
    for i in JOINTS:
        angles.plot(t, np.degrees(result[f"joint[{i}].angle"]), label=f"{i}")
        flow = result["slew.flow" if i == 1 else f"cylinder[{i}].flow"]
        flows.plot(t, flow / (flow + result[f"margin.w5[{i}]"]), label=f"{i}")
        speed = np.max([np.abs(result[f"joint[{i}].tangential[{k}]"]) for k in range(i, 7)], axis=0)
        speeds.plot(t, speed / (speed + result[f"margin.w4[{i}]"]), label=f"{i}")
    margins.plot(t, np.min([result[f"margin.w1[{i}]"] for i in CYLINDERS], axis=0), label="w1, distance [m]")
    margins.plot(t, np.min([result[f"margin.w2[{i}]"] for i in JOINTS], axis=0), label="w2, height [m]")
    margins.plot(t, np.degrees(result["margin.w3"]), label="w3, tip-over [deg]")
    for i in CYLINDERS:
        distances.plot(t, result[f"distance.arm[{i}]"], label=f"arm {i}")
    flow = result["hydraulics.flow_total"]
    total.plot(t, flow / (flow + result["margin.w6"]), "k")
    titles = ["joint angles [deg]", "own flow / limit", "tangential speed / limit"]
    titles += ["margins", "distance from vehicle and outriggers [m]", "total flow / limit"]
    for one, title in zip(axes, titles):
        one.set(title=title, xlabel="time [s]")
        one.grid(alpha=0.25)
        if one is not total:
            one.legend(fontsize="x-small", ncols=2)


def draw(result: Result, profile: Profile, path):
    """The page of a profile."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(2, 4, figsize=(17.0, 8.0), layout="constrained")
    _views(axes[0, 0], axes[1, 0], result)
    _curves(list(axes[:, 1:].flat), result)
    variant, support = PROFILES[profile.name]
    figure.suptitle(f"variant {variant}, {support} support")
    figure.savefig(path, dpi=80, metadata={"Software": None})
    pyplot.close(figure)


def main():
    """`scripts/boom`"""
    out = paths.ROOT / "out" / "boom"
    out.mkdir(parents=True, exist_ok=True)
    with Fmu(paths.fmu("boom")) as fmu:
        for name in PROFILES:
            profile = Profile.read(name)
            result = play(fmu, profile)
            found = differences(result, profile)
            worst = max(found, key=lambda n: found[n][0] / found[n][1])
            print(f"{name}: {worst} is the nearest to its limit: {found[worst][0]:.1e} of {found[worst][1]:.0e}")
            draw(result, profile, out / f"{name}.png")
            print(f"== {out / name}.png")


if __name__ == "__main__":
    main()
