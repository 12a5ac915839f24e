"""FMUs that are not ours in the program `koppel`: PythonFMU exports a spring with a damper as FMI 2.0 and FMI 3.0.

It follows our `primary_oscillator`, which carries the mass. Closed form: the damped oscillation of one mass on both springs.
The spring knows nothing of `port.*`, has no Event Mode and saves no state; its force belongs to the last inputs it got.
"""

import csv
import os
import subprocess
import sysconfig
from pathlib import Path

import numpy as np
import pytest
from koppel import paths
from koppel.work_precision import fitted_order

KOPPEL = paths.ROOT / "dist" / "bin" / "koppel"
PYTHON = paths.ROOT / ".foreign" / "pythonfmu" / "bin" / "python"
EXPORTERS = {2: "pythonfmu", 3: "pythonfmu3"}
MASS, START, STOP = 2.0, 0.1, 2.0
# of our spring and of the foreign one
STIFFNESS, DAMPING = (30.0, 50.0), (0.4, 0.6)
STEPS = (10e-3, 5e-3, 2.5e-3)

OURS = {"stiffness[1]": STIFFNESS[0], "damping[1]": DAMPING[0]}
LEADER = {"mass[1]": MASS, "s[1].start": START, "drive.amplitude": 0.0, **OURS}
SPRING = {"k": STIFFNESS[1], "c": DAMPING[1]}
CONNECTIONS = [
    ("leader", "P.s", "spring", "A.s"),
    ("leader", "P.v", "spring", "A.v"),
    ("spring", "A.F0", "leader", "P.F"),
]


def component(name: str, fmu: str, values: dict[str, float]) -> str:
    parameter = '<ssv:Parameter name="{}"><ssv:Real value="{!r}"/></ssv:Parameter>'
    parameters = "".join(parameter.format(*item) for item in values.items())
    return (
        f'<ssd:Component name="{name}" type="application/x-fmu-sharedlibrary" source="resources/{fmu}.fmu">'
        "<ssd:ParameterBindings><ssd:ParameterBinding><ssd:ParameterValues>"
        f'<ssv:ParameterSet version="1.0" name="{name}"><ssv:Parameters>{parameters}</ssv:Parameters></ssv:ParameterSet>'
        "</ssd:ParameterValues></ssd:ParameterBinding></ssd:ParameterBindings></ssd:Component>"
    )


def structure() -> str:
    """The scene's system structure."""
    spaces = "".join(
        f' xmlns:{short}="http://ssp-standard.org/SSP1/SystemStructure{whole}"'
        for short, whole in (("ssd", "Description"), ("ssc", "Common"), ("ssv", "ParameterValues"))
    )
    connections = "".join(
        f'<ssd:Connection startElement="{a}" startConnector="{b}" endElement="{c}" endConnector="{d}"/>'
        for a, b, c, d in CONNECTIONS
    )
    return (
        f'<?xml version="1.0" encoding="UTF-8"?><ssd:SystemStructureDescription{spaces} version="1.0" name="pair">'
        '<ssd:System name="pair"><ssd:Elements>'
        f'{component("leader", "primary_oscillator", LEADER)}{component("spring", "Spring", SPRING)}'
        f"</ssd:Elements><ssd:Connections>{connections}</ssd:Connections>"
        '<ssd:Annotations><ssc:Annotation type="org.fmu-suite.scene">'
        '<scene xmlns="http://org.fmu-suite/scene" method="seidel">'
        '<record variables="leader.s[1] leader.v[1]" interval="0.1"/></scene></ssc:Annotation></ssd:Annotations>'
        f'</ssd:System><ssd:DefaultExperiment startTime="0.0" stopTime="{STOP}"/></ssd:SystemStructureDescription>'
    )


@pytest.fixture(scope="module", params=EXPORTERS, ids=lambda fmi: f"fmi{fmi}")
def scene(request, tmp_path_factory):
    """A scene's folder with the exported FMU in it."""
    for needed, how in ((KOPPEL, "scripts/build"), (PYTHON, "scripts/foreign")):
        if not needed.exists():
            pytest.fail(f"{needed.relative_to(paths.ROOT)} is missing: run {how}")
    folder = tmp_path_factory.mktemp("pair")
    resources = folder / "resources"
    resources.mkdir()
    (folder / "SystemStructure.ssd").write_text(structure(), encoding="utf-8")
    source = paths.ROOT / "tests" / "foreign" / f"spring{request.param}.py"
    command = [PYTHON, "-m", EXPORTERS[request.param], "build", "-f", source, "-d", resources]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 0, done.stderr
    return folder


def interpreter() -> Path:
    """The interpreter's shared library, which these FMUs expect in the program that loads them (needsExecutionTool)."""
    folder, name = (sysconfig.get_config_var(key) or "" for key in ("LIBDIR", "INSTSONAME"))
    library = Path(folder) / name
    if ".so" not in name or not library.is_file():
        pytest.fail(f"the interpreter has no shared library ({library}): Debian has it in the package libpython3-dev")
    return library


def koppel(scene, *options) -> subprocess.CompletedProcess:
    command = [KOPPEL, "simulate", scene, "--fmus", paths.fmu("primary_oscillator").parent, *options]
    environment = {**os.environ, "LD_PRELOAD": str(interpreter())}
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=120, env=environment)


def error(scene, method: str, H: float) -> float:
    """Largest error of displacement and velocity over the start displacement, times the frequency for the velocity."""
    output = scene / "result.csv"
    inner = ["--set", "leader.solver.method=rk4", "--set", f"leader.solver.step={H}"]
    done = koppel(scene, "--method", method, "--order", "1", "--H", str(H), "--output", output, *inner)
    assert done.returncode == 0, done.stderr
    with output.open(encoding="utf-8", newline="") as file:
        header, *rows = csv.reader(file)
    assert header == ["time", "leader.s[1]", "leader.v[1]"]
    t, s, v = np.array(rows, dtype=float).T
    assert len(t) == 21
    decay, omega0 = sum(DAMPING) / (2.0 * MASS), np.sqrt(sum(STIFFNESS) / MASS)
    omega = np.sqrt(omega0**2 - decay**2)
    envelope = START * np.exp(-decay * t)
    exact = envelope * (np.cos(omega * t) + decay / omega * np.sin(omega * t))
    rate = -envelope * omega0**2 / omega * np.sin(omega * t)
    return max(np.abs(s - exact).max(), np.abs(v - rate).max() / omega) / START


# jacobi: the force belongs to the motion one step before; seidel: to the motion at the end of the step
@pytest.mark.parametrize(("method", "order", "limit"), [("jacobi", 1.0, 0.05), ("seidel", 2.0, 5e-3)])
def test_a_foreign_follower_converges_to_the_closed_form(scene, method, order, limit):
    errors = [error(scene, method, H) for H in STEPS]
    assert errors[-1] <= limit, errors
    assert fitted_order([1.0 / H for H in STEPS], errors) == pytest.approx(order, abs=0.2), errors


LACKS = {"common": "ModelExchange", "cs-predict": "Event Mode", "cs-pece": "Event Mode"}


@pytest.mark.parametrize(("method", "lacks"), LACKS.items())
def test_what_it_lacks_is_named(scene, method, lacks):
    done = koppel(scene, "--method", method, "--H", "0.01")
    assert done.returncode == 2
    assert "spring" in done.stderr.lower(), done.stderr
    assert lacks.lower().replace(" ", "") in done.stderr.lower().replace(" ", ""), done.stderr
