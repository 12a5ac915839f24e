"""An open chain of two `link2` with inertial connections in hosts that are not ours.

    Ecos        FMI 3.0, values pass along the connections during initialisation
    CoFMPy      FMI 2.0, no values before the first step: the start values of the inputs are given
    container   FMI 3.0, the two FMUs inside one, made by fmu-manipulation-toolbox, run by fmpy

Each steps both FMUs with the values of the last communication point (Jacobi). Promised: order 2 with linear inputs, the
default; the host needs to know nothing of ports. Reference: the published end state of the double pendulum.
"""

import json
import subprocess
import sys
from pathlib import Path

import fmpy
import numpy as np
import pytest
from koppel import Fmu, paths
from koppel.work_precision import fitted_order

STOP, GRAVITY = 2.0, 9.81
STEPS = (5e-3, 2.5e-3, 1.25e-3, 6.25e-4)
# angles from hanging
END = np.array([-0.08275830682, -0.96114544454, 0.40736207491, 11.89895505304])
OUTPUTS = [f"{link}.{state}" for link in ("upper", "lower") for state in ("angle.theta", "angle_rate.theta")]
ROD = {"mass": 1.0, "length": 1.0, "angle.theta": 0.0, "gravity.z": -GRAVITY}
AXES, PAIRS = "xyz", ("xx", "xy", "xz", "yy", "yz", "zz")
MOTION = [f"{part}.{axis}" for part in "rva" for axis in AXES]
LOAD = [(f"F0.{axis}", f"F.{axis}") for axis in AXES] + [(f"M.{pair}", f"M.{pair}") for pair in PAIRS]
CONNECTIONS = [[f"upper.B.{part}", f"lower.A.{part}"] for part in MOTION]
CONNECTIONS += [[f"lower.A.{source}", f"upper.B.{sink}"] for source, sink in LOAD]


def consistent_start() -> dict[str, dict[str, float]]:
    """Start values of the coupled inputs: one sweep through the two instances in Initialization Mode."""
    with Fmu(paths.fmu("link2")) as link, link.instantiate() as upper, link.instantiate() as lower:
        for one in (upper, lower):
            one.set(ROD)
            one.enter_initialisation()
        instances, given = {"upper": upper, "lower": lower}, {"upper": {}, "lower": {}}
        of = lambda part: [pair for pair in CONNECTIONS if pair[0].split(".")[2] in part]
        for part in (("r", "v"), ("F0", "M"), ("a",)):
            for source, sink in of(part):
                (component, variable), (other, into) = source.split(".", 1), sink.split(".", 1)
                given[other][into] = instances[component].get(variable)
                instances[other].set({into: given[other][into]})
        return given


def plan(archive: Path, H: float, given: dict[str, dict[str, float]]) -> dict:
    """What a host has to do."""
    steps = round(STOP / H)
    return {
        "components": {link: [str(archive), {**ROD, "solver.step": H, **given[link]}] for link in ("upper", "lower")},
        "connections": CONNECTIONS,
        "outputs": OUTPUTS,
        "H": H,
        "steps": steps,
        "every": steps,
    }


def in_own_environment(host: str, what: dict) -> list[float]:
    """The last sample of a plan in one of the environments of scripts/foreign."""
    python = paths.ROOT / ".foreign" / host / "bin" / "python"
    if not python.exists():
        pytest.fail(f"{python.relative_to(paths.ROOT)} is missing: run scripts/foreign")
    program = paths.ROOT / "tests" / "foreign" / f"{host}_host.py"
    done = subprocess.run(
        [python, program], input=json.dumps(what), capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode == 0, done.stderr[-2000:]
    return json.loads(done.stdout.splitlines()[-1])[-1]


def ecos(H: float, _folder: Path) -> list[float]:
    return in_own_environment("ecospy", plan(paths.fmu("link2"), H, {"upper": {}, "lower": {"A.r.x": 1.0}}))


def cofmpy(H: float, _folder: Path) -> list[float]:
    return in_own_environment("cofmupy", plan(paths.fmu("link2", 2), H, consistent_start()))


def container(H: float, folder: Path) -> list[float]:
    """One FMU with both inside."""
    what = plan(paths.fmu("link2"), H, {"upper": {}, "lower": {"A.r.x": 1.0}})
    rows = ["rule;from_fmu;from_port;to_fmu;to_port"]
    for name, (archive, start) in what["components"].items():
        (folder / f"{name}.fmu").write_bytes(Path(archive).read_bytes())
        rows.append(f"FMU;{name}.fmu;;;")
        rows += [f"START;{name}.fmu;{variable};{value!r};" for variable, value in start.items()]
    split = lambda name: name.split(".", 1)
    for source, sink in what["connections"]:
        (component, variable), (other, into) = split(source), split(sink)
        rows.append(f"LINK;{component}.fmu;{variable};{other}.fmu;{into}")
    for output in what["outputs"]:
        component, variable = split(output)
        rows.append(f"OUTPUT;{component}.fmu;{variable};;{output}")
    (folder / "chain.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    command = [Path(sys.executable).with_name("fmucontainer"), "-container", f"chain.csv:{H!r}", "-fmi", "3"]
    command += ["-no-auto-input", "-no-auto-output", "-fmu-directory", folder]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr[-2000:] + done.stdout[-2000:]
    result = fmpy.simulate_fmu(
        folder / "chain.fmu", stop_time=STOP, output_interval=H, validate=False, fmi_type="CoSimulation"
    )
    return [float(result[name][-1]) for name in what["outputs"]]


HOSTS = {"ecos": ecos, "cofmpy": cofmpy, "container": container}


@pytest.mark.parametrize("host", HOSTS)
def test_chain_converges_at_the_promised_order(host, tmp_path):
    errors = []
    for H in STEPS:
        folder = tmp_path / f"{H:g}"
        folder.mkdir()
        end = np.array(HOSTS[host](H, folder))
        end[0::2] += 0.5 * np.pi
        errors.append(np.abs(end - END).max())
    assert fitted_order([1.0 / H for H in STEPS], errors) == pytest.approx(2.0, abs=0.2), errors
    # limits of `jacobi`, linear inputs, over all samples: 6e-2 and 4e-3
    assert errors[0] <= 6e-2 and errors[2] <= 4e-3, errors
