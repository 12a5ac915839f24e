"""Archive and library against the standard's schemas, a second checker, and what a library may bring along."""

import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from koppel import paths
from lxml import etree

NAMES = sorted(folder.parent.name for folder in (paths.ROOT / "fmus").glob("*/Cargo.toml"))
SCHEMAS = Path(fmpy.__file__).parent / "schema" / "fmi3"
TERMINALS = "terminalsAndIcons/terminalsAndIcons.xml"

every_fmu = pytest.mark.parametrize("name", NAMES)


def read(fmu, entry):
    with zipfile.ZipFile(fmu.path) as archive:
        return archive.read(entry)


def problems(schema, xml):
    """What the standard's schema complains about."""
    validator = etree.XMLSchema(etree.parse(SCHEMAS / schema))
    validator.validate(etree.fromstring(xml))
    return [str(error) for error in validator.error_log]


# schemas ----------------------------------------------------------------------------------------------------------
@every_fmu
def test_model_description_follows_the_schema(fmu, name):
    assert problems("fmi3ModelDescription.xsd", read(fmu(name), "modelDescription.xml")) == []


@every_fmu
def test_terminals_follow_the_schema(fmu, name):
    assert problems("fmi3TerminalsAndIcons.xsd", read(fmu(name), TERMINALS)) == []


def test_the_schemas_complain(fmu):
    """A description with an unknown attribute, terminals without a matching rule."""
    description = read(fmu("link2"), "modelDescription.xml").replace(b"modelName=", b"model=")
    assert problems("fmi3ModelDescription.xsd", description)
    terminals = read(fmu("link2"), TERMINALS).replace(b' matchingRule="bus"', b"")
    assert problems("fmi3TerminalsAndIcons.xsd", terminals)


@every_fmu
def test_second_checker_finds_no_problem(fmu, name):
    """fmutool of the FMU Manipulation Toolbox: general and semantic checks for FMI 3."""
    command = [Path(sys.executable).parent / "fmutool", "-input", fmu(name).path, "-check"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    said = done.stdout + done.stderr
    assert done.returncode == 0, said
    assert "compliant with FMI-3.0" in said and "No semantic error against the FMI-3 standard" in said, said
    assert "ERROR" not in said and "WARNING" not in said, said


@every_fmu
@pytest.mark.parametrize("interface", ["CoSimulation", "ModelExchange"])
def test_fmpy_simulates_with_validation(fmu, name, interface, tmp_path):
    """The command line runs half the default experiment; all results are finite."""
    if interface == "ModelExchange" and fmu(name).description.modelExchange is None:
        pytest.skip("Co-Simulation only")
    out = tmp_path / "result.csv"
    stop = float(fmu(name).description.defaultExperiment.stopTime) / 2
    command = [sys.executable, "-m", "fmpy", "simulate", fmu(name).path, "--validate", "--output-file", out]
    command += ["--interface-type", interface, "--stop-time", str(stop)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    table = np.genfromtxt(out, delimiter=",", names=True, deletechars="")
    assert table["time"][-1] == pytest.approx(stop)
    assert all(np.isfinite(table[column]).all() for column in table.dtype.names)


# terminals --------------------------------------------------------------------------------------------------------
# ports of suspension.md, coupling.md, rvdp_absorber.md, boom.md and effi.md by kind; closed or fixed points are no ports
PORTS = {
    "boom": {"TIP": "leader"},
    "bushing": {"A": "follower", "B": "follower"},
    "double_pendulum": {"C": "leader"},
    "double_wishbone": {"P": "leader"},
    "effi_controller": {"V": "leader.sampled", "W": "follower"},
    "effi_plant": {"H": "leader"},
    "four_bar": {"P": "leader"},
    "guide": {"H": "leader", "P": "leader"},
    "link2": {"A": "follower", "B": "leader"},
    "link3": {"B": "follower", "C": "leader", "P": "leader"},
    "load": {"A": "follower"},
    "operator_arm": {"H": "force"},
    "primary_oscillator": {"A": "follower", "P": "leader"},
    "rvdp_absorber": {"A": "follower", "P": "follower"},
    "strut_link": {"D": "follower", "C": "leader", "T": "force"},
    "virtual_mechanism": {"H": "leader"},
    "virtual_wall": {"A": "force"},
}
VECTOR = ("x", "y", "z")
SYMMETRIC = ("xx", "xy", "xz", "yy", "yz", "zz")
MEMBERS = [f"{quantity}.{axis}" for quantity in "rvaF" for axis in VECTOR] + [f"M.{axes}" for axes in SYMMETRIC]
PLANAR_MEMBERS = [f"{quantity}.{axis}" for quantity in "rvaF" for axis in "xz"] + ["M.xx", "M.xz", "M.zz"]
SCALAR_MEMBERS = ["s", "v", "a", "F", "M"]
#: Models whose ports move in the plane, so that they have no y components.
PLANAR = {"effi_controller", "effi_plant", "operator_arm", "virtual_mechanism"}
#: A force law and a leader that is known at samples have no acceleration, the latter takes no inertia either.
LACKS = {"force": ("a.",), "leader.sampled": ("a.", "M.")}
#: Ports in one coordinate, and those that have both forms.
SCALAR, BOTH = {("guide", "H"), ("rvdp_absorber", "P")}, {("primary_oscillator", "A"), ("primary_oscillator", "P")}


def terminals(fmu):
    """Name: element of the outer terminals."""
    return {t.get("name"): t for t in etree.fromstring(read(fmu, TERMINALS)).iterfind("Terminals/Terminal")}


def members(terminal):
    """Member name: variable name, own members only."""
    return {m.get("memberName"): m.get("variableName") for m in terminal.iterfind("TerminalMemberVariable")}


@every_fmu
def test_every_port_is_a_terminal(fmu, name):
    found = {port: terminal.get("terminalKind") for port, terminal in terminals(fmu(name)).items()}
    assert found == {port: f"org.koppel.port.{kind}" for port, kind in PORTS[name].items()}


@every_fmu
def test_members_of_leader_and_follower_meet_in_the_inertial_connection(fmu, name):
    """F of a leader is fed by F0 of a follower, M by M; the motion goes the other way."""
    for port, terminal in terminals(fmu(name)).items():
        of, kind = members(terminal), PORTS[name][port]
        follows = not kind.startswith("leader")
        scalar, spatial = (name, port) in SCALAR | BOTH, (name, port) not in SCALAR
        axes, in_space = ("xz", PLANAR_MEMBERS) if name in PLANAR else (VECTOR, MEMBERS)
        wanted = SCALAR_MEMBERS * scalar + [m for m in in_space if not m.startswith(LACKS.get(kind, ()))] * spatial
        true = ["force"] * scalar + [f"force.{axis}" for axis in axes] * spatial if follows else []
        assert sorted(of) == sorted(wanted + true)
        for member, variable in of.items():
            quantity, dot, component = member.partition(".")
            expected = {"F": "F0", "force": "F"}.get(quantity, quantity) if follows else quantity
            assert variable == f"{port}.{expected}{dot}{component}"
            motion = quantity in ("r", "s", "v", "a")
            assert fmu(name).variable(variable).causality == ("input" if motion == follows else "output")


@pytest.mark.parametrize(
    ("name", "port"), [("double_wishbone", "P"), ("link3", "P"), ("effi_plant", "H"), ("virtual_mechanism", "H")]
)
def test_a_second_slot_is_a_terminal_inside(fmu, name, port):
    slot = terminals(fmu(name))[port].find("Terminal")
    assert (slot.get("name"), slot.get("terminalKind")) == ("slot[2]", "org.koppel.port.slot")
    in_space = PLANAR_MEMBERS if name in PLANAR else MEMBERS
    wanted = {m: f"{port}.slot[2].{m}" for m in in_space if m[0] in "FM"}
    assert members(slot) == wanted


# the library ------------------------------------------------------------------------------------------------------
def binutils(tool, *arguments):
    path = shutil.which(tool)
    assert path, f"{tool} is missing: it belongs to the C linker's package (Debian: binutils)"
    return subprocess.run([path, *arguments], capture_output=True, text=True, check=True).stdout


@pytest.fixture
def library(fmu, tmp_path):
    def unpack(name):
        path = tmp_path / f"{name}.so"
        path.write_bytes(read(fmu(name), f"binaries/x86_64-linux/{name}.so"))
        return path

    return unpack


@every_fmu
def test_the_library_exports_fmi_functions_only(library, name):
    exported = [line.split()[-1] for line in binutils("nm", "-D", "--defined-only", library(name)).splitlines()]
    assert len(exported) > 60
    assert [symbol for symbol in exported if not re.fullmatch(r"fmi[23][A-Z]\w*", symbol)] == []


@every_fmu
def test_the_library_needs_the_system_only(library, name):
    needed = re.findall(r"\(NEEDED\).*\[(.+)\]", binutils("readelf", "-d", library(name)))
    assert needed
    assert set(needed) <= {"libc.so.6", "libm.so.6", "libgcc_s.so.1", "ld-linux-x86-64.so.2"}


@every_fmu
def test_the_library_holds_no_other_model(library, name):
    """Symbols of every model's module, seen in the symbol table that the build keeps: its own are there, others not.

    The assemblies and elements of the suspension share the modules of their parts; those are no models of FMUs.
    """
    symbols = binutils("nm", "-C", library(name))
    holds = {other for other in NAMES if re.search(rf"\bmodels::(\w+::)?{other}::", symbols)}
    assert holds == {name}
