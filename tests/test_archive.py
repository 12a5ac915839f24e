"""The packed archive as a foreign host sees it."""

import csv
import subprocess
import sys
import zipfile

import fmpy.validation
import numpy as np
import pytest
from koppel import Reference, paths

NAMES = sorted(folder.parent.name for folder in (paths.ROOT / "fmus").glob("*/Cargo.toml"))


def test_there_are_fmus():
    assert "double_wishbone" in NAMES


@pytest.mark.parametrize("name", NAMES)
def test_fmpy_finds_no_problem(fmu, name):
    assert fmpy.validation.validate_fmu(str(fmu(name).path)) == []


@pytest.mark.parametrize("name", NAMES)
def test_fmpy_validate_command(fmu, name):
    done = subprocess.run(
        [sys.executable, "-m", "fmpy", "validate", fmu(name).path], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "No problems found." in done.stdout


def test_fmpy_simulate_command_with_validation(wishbone, tmp_path):
    """The command line runs the paper's case and its result is the reference's, within Heun's error at 0.05 s."""
    out = tmp_path / "result.csv"
    command = [sys.executable, "-m", "fmpy", "simulate", wishbone.path, "--validate", "--output-file", out]
    command += ["--stop-time", "10", "--output-interval", "0.05", "--output-variables", "lower.angle.theta"]
    command += ["--start-values", "solver.method", "1", "solver.step", "0.05"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    with out.open(encoding="utf-8", newline="") as file:
        header, *rows = csv.reader(file)
    assert header == ["time", "lower.angle.theta"]
    theta = np.array(rows, dtype=float)[:, 1]
    reference = Reference.named("wishbone_paper")
    assert theta.shape == reference.t.shape
    assert np.abs(theta - reference["lower.angle.theta"]).max() <= 1.0e-3


def test_fmpy_simulate_runs_the_default_experiment(wishbone):
    """fmpy with nothing given: 10 s, every output finite."""
    result = fmpy.simulate_fmu(str(wishbone.path), validate=True)
    assert result["time"][-1] == pytest.approx(10.0)
    assert all(np.isfinite(result[name]).all() for name in result.dtype.names)


@pytest.mark.parametrize("name", NAMES)
def test_archive_holds_what_the_project_promises(fmu, name):
    with zipfile.ZipFile(fmu(name).path) as archive:
        entries = archive.namelist()
        assert entries == sorted(entries), "entries are not sorted"
        assert len({info.date_time for info in archive.infolist()}) == 1, "the entries have different times"
        assert any(entry.startswith("documentation/licenses/") for entry in entries), "no licence file"
        wanted = {"modelDescription.xml", f"binaries/x86_64-linux/{name}.so"}
        assert not wanted - set(entries), f"missing: {wanted - set(entries)}"
        xml = archive.read("modelDescription.xml")
    described = paths.ROOT / "modelDescriptions" / f"{name}.fmi3.xml"
    assert described.read_bytes() == xml, f"{described.name} is not what the archive holds: run scripts/describe"


@pytest.mark.parametrize("name", NAMES)
def test_description_follows_the_rules_for_all_fmus(fmu, name):
    description = fmu(name).description
    assert description.fmiVersion == "3.0"
    flags = ["canGetAndSetFMUState", "canSerializeFMUState", "canHandleVariableCommunicationStepSize"]
    for flag in [*flags, "providesDirectionalDerivatives", "hasEventMode"]:
        assert fmu(name).capability(flag), flag
    assert description.coSimulation.fixedInternalStepSize is None
    experiment = description.defaultExperiment
    assert (float(experiment.stopTime) - float(experiment.startTime or 0.0)) / float(experiment.stepSize) <= 1000.0
    for variable in description.modelVariables:
        assert variable.description, f"{variable.name} has no description"
        assert not variable.dimensions and not variable.clocks, f"{variable.name} is an array or clocked"
        if variable.causality in ("input", "output"):
            assert variable.type == "Float64", f"{variable.name} is {variable.type}"
        if variable.type == "Float64" and variable.causality != "independent":
            unit = variable.unit or (variable.declaredType and variable.declaredType.unit)
            assert unit, f"{variable.name} has no unit"
        if variable.causality == "parameter":
            assert variable.start is not None, f"{variable.name} has no default"
        if variable.start is not None and variable.type == "Float64":
            assert np.isfinite(float(variable.start)), f"{variable.name} starts at {variable.start}"
        if variable.causality == "local" and variable.name.startswith("solver."):
            assert variable.type == "Int64", f"{variable.name} is {variable.type}"


VECTOR = ("x", "y", "z")
SYMMETRIC = ("xx", "xy", "xz", "yy", "yz", "zz")


def spread(name, components, *rest):
    """One entry per component."""
    return [(f"{name}.{component}", *rest) for component in components]


def parameters(unit, **values):
    """Parameters (fixed) with this unit and start value; `__` stands for a dot."""
    return [(name.replace("__", "."), "parameter", unit, value, "fixed") for name, value in values.items()]


# name, causality, unit, start (None: not checked), variability (None: continuous)
INTERFACE = [
    *spread("P.F", VECTOR, "input", "N", 0.0, None),
    *spread("P.M", SYMMETRIC, "input", "kg", 0.0, None),
    *spread("P.slot[2].F", VECTOR, "input", "N", 0.0, None),
    *spread("P.slot[2].M", SYMMETRIC, "input", "kg", 0.0, None),
    *spread("chassis.a", VECTOR, "input", "m/s2", 0.0, None),
    *[row for p in "PBC" for row in spread(f"{p}.r", VECTOR, "output", "m", None, None)],
    *[row for p in "PBC" for row in spread(f"{p}.v", VECTOR, "output", "m/s", None, None)],
    *[row for p in "PBC" for row in spread(f"{p}.a", VECTOR, "output", "m/s2", None, None)],
    *[row for p in "ABCDT" for row in spread(f"{p}.F", VECTOR, "output", "N", None, None)],
    ("lower.angle.theta", "output", "rad", -0.04995839572194276, None),
    ("lower.angle_rate.theta", "output", "rad/s", 0.0, None),
    ("upper.angle.theta", "output", "rad", None, None),
    ("upper.angle_rate.theta", "output", "rad/s", None, None),
    ("carrier.angle.psi", "output", "rad", None, None),
    ("carrier.angle_rate.psi", "output", "rad/s", None, None),
    *[(f"carrier.q[{i}]", "output", "1", None, None) for i in (1, 2, 3, 4)],
    *spread("carrier.omega", VECTOR, "output", "rad/s", None, None),
    ("strut.length", "output", "m", None, None),
    ("strut.rate", "output", "m/s", None, None),
    ("strut.force", "output", "N", None, None),
    ("loop.gap", "output", "m", None, None),
    ("loop.gap_rate", "output", "m/s", None, None),
    ("loop.condition", "output", "1", None, None),
    *[
        (f"energy.{part}", "output", "J", None, None)
        for part in ("kinetic", "potential", "dissipated", "supplied", "port")
    ],
    *parameters("m", design__A__x=0.0, design__A__y=0.0, design__A__z=0.0, design__B__x=0.40, design__B__z=-0.02),
    *parameters("m", design__C__x=0.36, design__C__z=0.27, design__D__x=0.08, design__D__z=0.25),
    *parameters("m", design__G__x=0.48, design__G__z=0.12, design__P__x=0.50, design__P__z=0.12),
    *parameters("m", design__T__x=0.22, design__T__z=0.62),
    *parameters("kg", lower__mass=4.0, upper__mass=2.5, carrier__mass=25.0),
    *parameters("kg.m2", lower__inertia__xx=2e-3, upper__inertia__xx=1e-3),
    *parameters("kg.m2", carrier__inertia__xx=1.2, carrier__inertia__yy=0.8, carrier__inertia__zz=0.8),
    *parameters("kg.m2", carrier__inertia__xy=0.0, carrier__inertia__xz=0.0, carrier__inertia__yz=0.0),
    *parameters("m", strut__s1=0.14, strut__l0=0.0),
    ("strut.k", "parameter", "N/m", 22000.0, "tunable"),
    ("strut.c", "parameter", "N.s/m", 1000.0, "tunable"),
    ("strut.preload", "parameter", "N", 0.0, "tunable"),
    *spread("static_load", VECTOR, "parameter", "N", 0.0, "fixed"),
    *spread("force.offset", VECTOR, "parameter", "N", 0.0, "fixed"),
    *parameters("N", force__amplitude__x=0.0, force__amplitude__y=0.0, force__amplitude__z=10.0),
    *spread("force.omega", VECTOR, "parameter", "rad/s", 10.0, "fixed"),
    *spread("force.phase", VECTOR, "parameter", "rad", 0.0, "fixed"),
    *spread("force.pulse.amplitude", VECTOR, "parameter", "N", 0.0, "fixed"),
    *parameters("s", force__pulse__start=0.0, force__pulse__duration=0.0),
    *spread("gravity", VECTOR, "parameter", "m/s2", 0.0, "tunable"),
    ("tie.k", "parameter", "N/m", 3e5, "tunable"),
    ("tie.c", "parameter", "N.s/m", 300.0, "tunable"),
    *parameters("m", design__tie__R__x=0.38, design__tie__R__y=-0.12, design__tie__R__z=0.05),
    *parameters("m", design__tie__T__x=0.05, design__tie__T__y=-0.12, design__tie__T__z=0.05),
    *parameters("N/m", closure__k=1e8),
    *parameters("N.s/m", closure__c=1e4),
    ("stabilisation.a", "parameter", "1/s", 20.0, "fixed"),
    ("stabilisation.b", "parameter", "1/s", 20.0, "fixed"),
    ("solver.step", "parameter", "s", 1e-3, "fixed"),
    ("solver.rtol", "parameter", "1", 1e-6, "fixed"),
    ("solver.atol", "parameter", "1", 1e-9, "fixed"),
]


@pytest.mark.parametrize(
    ("name", "causality", "unit", "start", "variability"), INTERFACE, ids=[row[0] for row in INTERFACE]
)
def test_double_wishbone_interface(wishbone, name, causality, unit, start, variability):
    variable = wishbone.variable(name)
    assert (variable.type, variable.causality) == ("Float64", causality)
    assert (variable.unit or (variable.declaredType and variable.declaredType.unit)) == unit
    assert variable.variability == (variability or "continuous")
    if start is not None:
        assert float(variable.start) == start


ENUMERATIONS = {
    "solver.method": ("rk4", ["heun", "rk4", "dopri5", "dop853", "rodas4", "radau5", "exact"]),
    "stabilisation.kind": ("projection", ["none", "baumgarte", "projection"]),
    "closure.kind": ("rigid", ["rigid", "bushing"]),
    "scene.motion": ("planar", ["planar", "spatial"]),
    "arm.joint": ("revolute", ["revolute", "universal"]),
    "carrier.joint": ("spherical", ["spherical", "universal"]),
    "force.kind": ("internal", ["input", "internal"]),
    "strut.preload_mode": ("given", ["given", "static"]),
}


@pytest.mark.parametrize("name", ENUMERATIONS)
def test_double_wishbone_enumerations(wishbone, name):
    default, items = ENUMERATIONS[name]
    variable = wishbone.variable(name)
    declared = {item.name: int(item.value) for item in variable.declaredType.items}
    numbers = {item: number for number, item in enumerate(items, start=1)}
    assert variable.type == "Enumeration"
    assert declared.items() <= numbers.items(), "items or their numbers differ"
    assert int(variable.start) == numbers[default]


BOOLEANS = {"start.override": False, "use.tie": False, "use.damper": True, "use.gravity": True, "use.energy": True}


@pytest.mark.parametrize("name", BOOLEANS)
def test_double_wishbone_switches(wishbone, name):
    variable = wishbone.variable(name)
    assert (variable.type, variable.causality, variable.variability) == ("Boolean", "parameter", "fixed")
    assert str(variable.start).lower() == str(BOOLEANS[name]).lower()


def test_double_wishbone_offers_the_explicit_methods_and_counters(wishbone):
    assert {"heun", "rk4", "dopri5"} <= {item.name for item in wishbone.variable("solver.method").declaredType.items}
    assert {"solver.steps", "solver.rhs_evaluations", "solver.rejected"} <= set(wishbone.counters)
