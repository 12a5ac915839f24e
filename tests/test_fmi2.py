"""FMI 2.0 archives: the same model as the FMI 3.0 twin, and the rules of the older standard."""

import math
import random
import re
import shutil
import zipfile
from ctypes import byref, c_char, c_double, c_int, c_size_t, c_void_p

import fmpy.validation
import numpy as np
import pytest
from fmi2_host import Archive, Host
from fmpy import fmi2
from fmpy.model_description import read_model_description
from koppel import Status, paths

NAMES = sorted(folder.parent.name for folder in (paths.ROOT / "fmus").glob("*/Cargo.toml"))
each_fmu = pytest.mark.parametrize("name", NAMES)
THETA = "lower.angle.theta"


@pytest.fixture(scope="module")
def archive():
    """`archive(name)`: unpacked once."""
    opened = {}

    def load(name):
        if name not in opened:
            opened[name] = Archive(name)
        return opened[name]

    yield load
    for one in opened.values():
        shutil.rmtree(one.folder, ignore_errors=True)


@pytest.fixture
def wheel(archive):
    """The double wishbone for Co-Simulation."""
    with Host(archive("double_wishbone")) as host:
        yield host


@pytest.fixture
def running(wheel):
    """After a step of 0.1 s."""
    wheel.initialise()
    assert wheel.try_step(0.0, 0.1) == (Status.OK, "")
    return wheel


# archive --------------------------------------------------------------------------------------------------------------
@each_fmu
def test_fmpy_finds_no_problem(name):
    assert fmpy.validation.validate_fmu(str(paths.fmu(name, fmi=2))) == []


@each_fmu
def test_archive_holds_binary_licence_and_the_checked_description(name):
    with zipfile.ZipFile(paths.fmu(name, fmi=2)) as packed:
        entries = packed.namelist()
        assert entries == sorted(entries)
        assert any(entry.startswith("documentation/licenses/") for entry in entries)
        binary = packed.read(f"binaries/linux64/{name}.so")
        xml = packed.read("modelDescription.xml")
    assert xml == (paths.ROOT / "modelDescriptions" / f"{name}.fmi2.xml").read_bytes()
    with zipfile.ZipFile(paths.fmu(name)) as twin:
        assert twin.read(f"binaries/x86_64-linux/{name}.so") == binary


TYPES = {"Float64": "Real", "Int32": "Integer", "Int64": "Integer"}


@each_fmu
def test_the_description_says_the_same_as_its_twin(name):
    """Read by fmpy, which resolves indices (FMI 2.0) and value references (FMI 3.0) to variables."""
    old, new = (read_model_description(str(paths.fmu(name, fmi=fmi)), validate=True) for fmi in (2, 3))
    assert old.guid == new.instantiationToken
    assert [v.name for v in old.modelVariables] == [v.name for v in new.modelVariables]
    for a, b in zip(old.modelVariables, new.modelVariables):
        assert a.type == TYPES.get(b.type, b.type), a.name
        for what in ("valueReference", "causality", "variability", "initial", "unit", "min", "max", "nominal", "start"):
            assert getattr(a, what) == getattr(b, what), (a.name, what)
        assert (a.derivative and a.derivative.name) == (b.derivative and b.derivative.name), a.name
        assert a.reinit == b.reinit, a.name
        if a.type == "Enumeration":
            items = lambda v: [(item.name, int(item.value)) for item in v.declaredType.items]
            assert items(a) == items(b)
    depends = lambda unknowns: {u.variable.name: [d.name for d in u.dependencies] for u in unknowns}
    for unknowns in ("outputs", "derivatives"):
        assert depends(getattr(old, unknowns)) == depends(getattr(new, unknowns))
    initial = lambda description: {u.variable.name for u in description.initialUnknowns}
    assert initial(old) == initial(new)
    assert old.numberOfEventIndicators == len(new.eventIndicators)
    assert old.numberOfContinuousStates == new.numberOfContinuousStates


@each_fmu
def test_capabilities_are_declared(name):
    description = read_model_description(str(paths.fmu(name, fmi=2)), validate=True)
    for part in filter(None, (description.coSimulation, description.modelExchange)):
        assert part.canGetAndSetFMUstate and part.canSerializeFMUstate and part.providesDirectionalDerivative
    assert description.coSimulation.canHandleVariableCommunicationStepSize
    assert not description.coSimulation.canInterpolateInputs
    assert description.coSimulation.maxOutputDerivativeOrder == 0


# the same numbers -----------------------------------------------------------------------------------------------------
def force(description, stop):
    """Inputs that move: the first three of each kind force, velocity and acceleration, as fmpy takes them."""
    inputs = [v.name for v in description.modelVariables if v.causality == "input"]
    names = [name for kind in "Fva" for name in [n for n in inputs if re.search(rf"\.{kind}(\.|$)", n)][:3]]
    t = np.linspace(0.0, stop, 101)
    columns = [0.5 * np.sin(7.0 * t + i) for i in range(len(names))]
    signal = np.zeros(len(t), dtype=[("time", float), *[(name, float) for name in names]])
    signal["time"] = t
    for name, column in zip(names, columns):
        signal[name] = column
    return signal


def simulate(name, fmi, **options):
    """All outputs of a run by fmpy, with the inputs moving; every refusal raises."""
    path = str(paths.fmu(name, fmi=fmi))
    description = read_model_description(path)
    outputs = [v.name for v in description.modelVariables if v.causality == "output"]
    stop = min(float(description.defaultExperiment.stopTime), 2.0)
    result = fmpy.simulate_fmu(
        path, stop_time=stop, output_interval=0.02, input=force(description, stop), output=outputs, **options
    )
    return np.array([result[name] for name in result.dtype.names])


@each_fmu
def test_co_simulation_gives_the_numbers_of_its_twin_to_the_last_bit(name):
    old, new = (simulate(name, fmi, fmi_type="CoSimulation") for fmi in (2, 3))
    assert np.ptp(old, axis=1)[1:].max() > 0.0, "nothing moves"
    assert old.tobytes() == new.tobytes()


@each_fmu
def test_model_exchange_gives_the_numbers_of_its_twin(name):
    if read_model_description(str(paths.fmu(name, fmi=2))).modelExchange is None:
        pytest.skip("Co-Simulation only")
    old, new = (
        simulate(name, fmi, fmi_type="ModelExchange", solver="CVode", relative_tolerance=1e-6) for fmi in (2, 3)
    )
    assert np.ptp(old, axis=1)[1:].max() > 0.0, "nothing moves"
    scale = np.maximum(np.abs(new).max(axis=1, keepdims=True), 1.0)
    assert (np.abs(old - new) <= 1e-12 * scale).all()


def test_time_events_in_model_exchange_are_those_of_the_twin():
    pulse = {"force.pulse.amplitude.z": 800.0, "force.pulse.start": 0.31, "force.pulse.duration": 0.08}
    start_values = {"stabilisation.kind": 2, **pulse}
    old, new = (
        simulate("double_wishbone", fmi, fmi_type="ModelExchange", start_values=start_values) for fmi in (2, 3)
    )
    assert (np.abs(old - new) <= 1e-12 * np.maximum(np.abs(new).max(axis=1, keepdims=True), 1.0)).all()


def test_directional_derivatives_are_those_of_the_twin(wishbone, running):
    unknowns, known, seed = ["P.a.z", "P.a.x", "A.F.x"], ["P.F.z", "P.F.x"], [1.0, 0.3]
    with wishbone.instantiate() as twin:
        twin.initialise({})
        twin.step(0.0, 0.1)
        expected = twin.directional_derivative(unknowns, known, seed)
    result = (c_double * 3)()
    references = running.archive.references
    running.do(
        "fmi2GetDirectionalDerivative", references(unknowns), 3, references(known), 2, (c_double * 2)(*seed), result
    )
    assert list(result) == list(expected)
    assert expected.all()


# refusals -------------------------------------------------------------------------------------------------------------
def test_a_refused_value_is_discarded_and_changes_nothing(running):
    before = running.get([*running.archive.names("output"), "P.F.z"])
    for name, value in [("P.F.z", math.nan), ("strut.c", -1.0), ("strut.c", math.inf)]:
        status, text = running.try_set(name, value)
        assert status == Status.DISCARD
        assert name in text and "allowed" in text
    assert running.get([*running.archive.names("output"), "P.F.z"]) == before
    assert running.try_step(0.1, 0.1)[0] == Status.OK


def test_a_refused_step_is_discarded_and_the_run_goes_on(wheel):
    """The stability guard: a damper of 1e6 N s/m makes an explicit step of 0.05 s impossible."""
    wheel.initialise({"solver.method": 1, "solver.step": 0.05})
    assert wheel.try_step(0.0, 0.05)[0] == Status.OK
    wheel.set({"strut.c": 1e6})
    before = wheel.get(wheel.archive.names("output"))
    status, text = wheel.try_step(0.05, 0.05)
    assert status == Status.DISCARD and text.startswith("fmi2DoStep: ") and "solver.step" in text
    last = c_double()
    wheel.do("fmi2GetRealStatus", fmi2.fmi2LastSuccessfulTime, byref(last))
    assert last.value == 0.05
    assert wheel.get(wheel.archive.names("output")) == before
    wheel.set({"strut.c": 1000.0})
    assert wheel.try_step(0.05, 0.05)[0] == Status.OK


def test_status_of_the_last_step(running):
    integer = c_int(7)
    running.do("fmi2GetBooleanStatus", fmi2.fmi2Terminated, byref(integer))
    assert integer.value == 0
    for function, kind in [
        ("fmi2GetStatus", fmi2.fmi2DoStepStatus),
        ("fmi2GetIntegerStatus", fmi2.fmi2DoStepStatus),
        ("fmi2GetStringStatus", fmi2.fmi2PendingStatus),
        ("fmi2GetRealStatus", fmi2.fmi2Terminated),
        ("fmi2GetBooleanStatus", 99),
    ]:
        status, text = running.call(function, kind, byref(c_double()))
        assert status == Status.DISCARD and "fmi2LastSuccessfulTime" in text, function
    for function in ("fmi2GetRealStatus", "fmi2GetBooleanStatus"):
        kind = {"fmi2GetRealStatus": fmi2.fmi2LastSuccessfulTime}.get(function, fmi2.fmi2Terminated)
        assert running.call(function, kind, None)[0] == Status.ERROR


def test_variables_of_another_type_are_named(running):
    value = (c_int * 1)(1)
    for function, name, words in [
        ("fmi2GetInteger", "P.F.z", ("P.F.z", "Real", "Integer")),
        ("fmi2SetBoolean", "P.F.z", ("P.F.z", "Real", "Boolean")),
        ("fmi2GetReal", "solver.method", ("solver.method", "Enumeration", "Real")),
        ("fmi2GetReal", "solver.steps", ("solver.steps", "Integer", "Real")),
        ("fmi2GetString", "use.damper", ("use.damper", "Boolean", "String")),
        ("fmi2SetString", "P.F.z", ("P.F.z", "Real", "String")),
    ]:
        status, text = running.call(function, running.archive.references([name]), 1, value)
        assert status == Status.ERROR and all(word in text for word in words), text
    for kind in ("Real", "Integer", "Boolean", "String"):
        for access in ("Get", "Set"):
            assert running.call(f"fmi2{access}{kind}", None, 0, None)[0] == Status.OK
            assert running.call(f"fmi2{access}{kind}", None, 1, None)[0] == Status.ERROR


def test_whole_numbers_enumerations_and_switches_are_read_as_set(wheel):
    wheel.set({"solver.method": 3, "port.order": 2, "use.energy": 0})
    wheel.initialise()
    assert wheel.try_step(0.0, 0.1)[0] == Status.OK
    for name, expected in [("solver.method", 3), ("port.order", 2)]:
        value = (c_int * 1)()
        wheel.do("fmi2GetInteger", wheel.archive.references([name]), 1, value)
        assert value[0] == expected
    value = (c_int * 1)(5)
    wheel.do("fmi2GetBoolean", wheel.archive.references(["use.energy"]), 1, value)
    assert value[0] == 0
    wheel.do("fmi2GetInteger", wheel.archive.references(["solver.steps"]), 1, value)
    assert value[0] > 0


def test_calls_in_the_wrong_phase_say_where_they_are_allowed(wheel):
    def refused(function, *arguments, allowed):
        status, text = wheel.call(function, *arguments)
        assert status == Status.ERROR and text.startswith(f"{function}: may not be called"), text
        assert text.endswith(f"allowed in: {allowed}"), text

    step = (c_double(0.0), c_double(0.1), 1)
    refused("fmi2DoStep", *step, allowed="StepMode")
    refused("fmi2ExitInitializationMode", allowed="InitializationMode")
    refused("fmi2Terminate", allowed="StepMode")
    refused("fmi2EnterEventMode", allowed="FMI 2.0 Model Exchange")
    wheel.initialise()
    refused("fmi2SetupExperiment", 0, c_double(0.0), c_double(0.0), 0, c_double(0.0), allowed="Instantiated")
    refused("fmi2EnterInitializationMode", allowed="Instantiated")
    refused("fmi2SetTime", c_double(0.0), allowed="FMI 2.0 Model Exchange")
    wheel.do("fmi2DoStep", *step)
    wheel.do("fmi2Terminate")
    refused("fmi2DoStep", *step, allowed="StepMode")
    wheel.do("fmi2Reset")
    wheel.initialise()


def test_functions_of_the_other_standard_are_refused(running):
    status, text = running.call("fmi3Terminate")
    assert status == Status.ERROR and "FMI 2.0 Co-Simulation" in text
    assert running.try_step(0.1, 0.1)[0] == Status.OK


def test_functions_not_offered_say_so(running):
    references, order = running.archive.references(["P.F.z"]), (c_int * 1)(1)
    for function, arguments in [
        ("fmi2SetRealInputDerivatives", (references, 1, order, (c_double * 1)(1.0))),
        ("fmi2GetRealOutputDerivatives", (references, 1, order, (c_double * 1)())),
        ("fmi2CancelStep", ()),
    ]:
        status, text = running.call(function, *arguments)
        assert status == Status.ERROR and text.startswith(f"{function}: not supported"), text


def test_a_step_from_another_time_is_an_error(running):
    for t, step in [(5.0, 0.1), (0.1, 0.0), (0.1, -1.0), (math.nan, 0.1)]:
        status, text = running.try_step(t, step)
        assert status == Status.ERROR and text
    assert running.try_step(0.1, 0.1)[0] == Status.OK


def test_no_step_passes_the_stop_time(wheel):
    wheel.do("fmi2SetupExperiment", 0, c_double(0.0), c_double(1.0), 1, c_double(1.15))
    wheel.do("fmi2EnterInitializationMode")
    wheel.do("fmi2ExitInitializationMode")
    assert wheel.get(["time"]) == [1.0]
    assert wheel.try_step(1.0, 0.1)[0] == Status.OK
    status, text = wheel.try_step(1.1, 0.1)
    assert status == Status.ERROR and "1.15" in text


def test_instances_need_the_right_guid_and_kind_but_no_callbacks(archive):
    host = Host(archive("double_pendulum"))
    assert not host.instantiate(guid="{other}")
    assert "{other}" in host.messages[-1].text and archive("double_pendulum").description.guid in host.messages[-1].text
    assert not host.instantiate(kind=2)
    assert "fmuType" in host.messages[-1].text
    assert host.instantiate(callbacks=None, name=None)
    host.initialise()
    assert host.call("fmi2DoStep", c_double(7.0), c_double(0.1), 1) == (Status.ERROR, "")
    host.dll.fmi2FreeInstance(c_void_p(host.component))
    host.dll.fmi2FreeInstance(None)
    assert host.dll.fmi2Reset(None) == Status.ERROR


def test_inquiries(archive):
    slave = Host(archive("link2")).fmu
    assert (slave.getVersion(), slave.getTypesPlatform()) == ("2.0", "default")


def test_log_categories_filter(running):
    running.fmu.component = c_void_p(running.component)
    running.fmu.setDebugLogging(True, ["logStatusError"])
    assert running.try_set("strut.c", -1.0) == (Status.DISCARD, "")
    assert running.try_step(7.0, 0.1)[1]
    running.fmu.setDebugLogging(False, [])
    assert running.try_step(7.0, 0.1) == (Status.ERROR, "")
    running.fmu.setDebugLogging(True, [])
    assert running.try_set("strut.c", -1.0)[1]


# state ----------------------------------------------------------------------------------------------------------------
def march(host, first, count):
    """Steps of 0.05 s; all outputs after each."""
    samples = []
    for i in range(first, first + count):
        assert host.try_step(0.05 * i, 0.05)[0] == Status.OK
        samples.append(host.get(host.archive.names("output")))
    return np.array(samples)


def serialise(host):
    """Bytes of the present state."""
    state, size = host.save(), c_size_t()
    host.do("fmi2SerializedFMUstateSize", state, byref(size))
    data = (c_char * size.value)()
    host.do("fmi2SerializeFMUstate", state, data, size)
    host.do("fmi2FreeFMUstate", byref(state))
    assert not state.value
    return data.raw


def test_saved_and_serialised_states_repeat_the_run(archive, wheel):
    wheel.initialise({"solver.method": 3, "solver.rtol": 1e-5})
    march(wheel, 0, 5)
    state, data = wheel.save(), serialise(wheel)
    first = march(wheel, 5, 10)
    wheel.do("fmi2SetFMUstate", state)
    wheel.do("fmi2FreeFMUstate", byref(state))
    assert march(wheel, 5, 10).tobytes() == first.tobytes()
    with Host(archive("double_wishbone")) as other:
        again = c_void_p()
        other.do("fmi2DeSerializeFMUstate", data, c_size_t(len(data)), byref(again))
        other.do("fmi2SetFMUstate", again)
        other.do("fmi2FreeFMUstate", byref(again))
        assert march(other, 5, 10).tobytes() == first.tobytes()


def test_damaged_states_are_refused(running):
    data, chance, state = serialise(running), random.Random(2), c_void_p()
    for _ in range(50):
        damaged = bytearray(data)
        damaged[chance.randrange(len(data))] ^= chance.randint(1, 255)
        status, text = running.call("fmi2DeSerializeFMUstate", bytes(damaged), c_size_t(len(data)), byref(state))
        assert status == Status.ERROR and "serialised state is refused" in text
    assert not state.value
    assert running.try_step(0.1, 0.1)[0] == Status.OK


def test_reset_is_a_fresh_instance(archive, wheel):
    wheel.initialise({"carrier.mass": 40.0})
    march(wheel, 0, 3)
    wheel.do("fmi2Reset")
    wheel.initialise()
    with Host(archive("double_wishbone")) as fresh:
        fresh.initialise()
        assert march(fresh, 0, 5).tobytes() == march(wheel, 0, 5).tobytes()
