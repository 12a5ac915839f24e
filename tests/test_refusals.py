"""Wrong calls and impossible values: a status, a message that helps, and nothing changed."""

import math
import re
from ctypes import c_double, c_uint

import numpy as np
import pytest
from fmpy import fmi3
from koppel import Status, scenes

THETA = "lower.angle.theta"
NOT_FINITE = {"nan": math.nan, "inf": math.inf, "-inf": -math.inf}


@pytest.fixture
def instance(wishbone):
    with wishbone.instantiate() as one:
        yield one


@pytest.fixture
def initialising(instance):
    """In Initialization Mode: parameters and inputs may be set and read."""
    instance.enter_initialisation()
    return instance


@pytest.fixture
def running(instance):
    """In Step Mode at t = 0.1 s."""
    instance.initialise({})
    instance.step(0.0, 0.1)
    return instance


def settable(fmu, causalities=("parameter", "input")):
    return [v.name for v in fmu.description.modelVariables if v.type == "Float64" and v.causality in causalities]


def numbers(text):
    """All numbers in a message."""
    return [float(n) for n in re.findall(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?", text)]


# values -----------------------------------------------------------------------------------------------------------
OUT_OF_RANGE = [
    ("carrier.mass", -25.0),
    ("carrier.mass", 0.0),
    ("lower.mass", -1.0),
    ("upper.mass", 0.0),
    ("strut.k", -1.0),
    ("strut.c", -1.0),
    ("strut.s1", 0.0),
    ("closure.k", -1.0),
    ("tie.c", -1.0),
    ("force.pulse.duration", -0.1),
    ("solver.step", 0.0),
    ("solver.step", -1e-3),
    ("solver.rtol", 0.0),
    ("solver.atol", -1e-9),
]


@pytest.mark.parametrize(("name", "value"), OUT_OF_RANGE)
def test_value_outside_its_range_is_discarded(initialising, name, value):
    before = initialising.get(name)
    outcome = initialising.try_set(name, value)
    assert outcome.status == Status.DISCARD
    assert name in outcome.text, outcome.text
    assert value in numbers(outcome.text), f"the value is not named: {outcome.text}"
    assert re.search(r">|<|≥|≤|between|at least|above|\[|\(|\.\.", outcome.text), (
        f"the range is not named: {outcome.text}"
    )
    assert initialising.get(name) == before
    initialising.exit_initialisation()
    initialising.step(0.0, 0.1)


def test_values_are_refused_before_initialisation_as_well(wishbone, instance):
    for name, value in OUT_OF_RANGE:
        outcome = instance.try_set(name, value)
        assert outcome.status == Status.DISCARD and name in outcome.text, (name, outcome)
    instance.initialise({})
    for name, _ in OUT_OF_RANGE:
        assert instance.get(name) == float(wishbone.variable(name).start)


def test_declared_ranges_are_the_enforced_ones(wishbone, initialising):
    """A value just below min and just above max is refused, min and max themselves are taken."""
    checked = 0
    for name in settable(wishbone):
        variable = wishbone.variable(name)
        for bound, outside in ((variable.min, -math.inf), (variable.max, math.inf)):
            if bound is None:
                continue
            bound = float(bound)
            assert initialising.try_set(name, bound).status == Status.OK, f"{name} = {bound}"
            assert initialising.try_set(name, math.nextafter(bound, outside)).status == Status.DISCARD, (
                f"{name} past {bound}"
            )
            assert initialising.get(name) == bound
            checked += 1
    assert checked >= 10


@pytest.mark.parametrize("kind", NOT_FINITE)
def test_no_input_or_parameter_takes_a_value_that_is_not_finite(wishbone, initialising, kind):
    for name in settable(wishbone):
        before = initialising.get(name)
        outcome = initialising.try_set(name, NOT_FINITE[kind])
        assert outcome.status == Status.DISCARD, name
        assert name in outcome.text and kind.strip("-") in outcome.text.lower(), outcome.text
        assert initialising.get(name) == before, name


def test_nan_force_in_a_run_is_discarded_and_the_run_goes_on(wishbone, running):
    outputs = wishbone.names("output")
    running.set({"P.F.x": 3.0})
    before = running.get_all(outputs)
    outcome = running.try_set("P.F.x", math.nan)
    assert outcome.status == Status.DISCARD
    assert "P.F.x" in outcome.text and "nan" in outcome.text.lower()
    assert running.get("P.F.x") == 3.0
    assert running.get_all(outputs) == before
    running.step(0.1, 0.1)
    assert np.isfinite(list(running.get_all(outputs).values())).all()


def test_one_bad_value_in_a_set_call_changes_none(wishbone, running):
    names = ["P.F.x", "P.F.y", "P.F.z"]
    running.set(dict(zip(names, (1.0, 2.0, 3.0))))
    references = (fmi3.fmi3ValueReference * 3)(*[wishbone.variable(name).valueReference for name in names])
    outcome = running.call("fmi3SetFloat64", references, 3, (c_double * 3)(10.0, math.nan, 30.0), 3)
    assert outcome.status == Status.DISCARD
    assert "P.F.y" in outcome.text
    assert running.get_all(names) == dict(zip(names, (1.0, 2.0, 3.0)))


@pytest.mark.parametrize("value", [1e308, -1e308, 1e160])
def test_huge_force_never_gives_a_silent_nan(wishbone, running, value):
    """Refused, or stepped to finite values: nothing in between."""
    outputs = wishbone.names("output")
    if running.try_set("P.F.x", value).status == Status.DISCARD:
        return
    before = running.get_all([THETA, "lower.angle_rate.theta"])
    outcome = running.try_step(0.1, 0.1)
    if outcome.status == Status.OK:
        assert np.isfinite(list(running.get_all(outputs).values())).all()
    else:
        assert outcome.status == Status.DISCARD and outcome.text
        assert running.last_successful_time == 0.1
        running.set({"P.F.x": 0.0})
        assert running.get_all([THETA, "lower.angle_rate.theta"]) == before
        running.step(0.1, 0.1)


@pytest.mark.parametrize("value", [0, 8, -1, 2**40])
def test_unknown_enumeration_item_is_discarded(initialising, value):
    outcome = initialising.try_set("solver.method", value)
    assert outcome.status == Status.DISCARD
    assert "solver.method" in outcome.text and "rk4" in outcome.text, outcome.text
    assert initialising.get("solver.method") == 2


# parameters that do not fit together: Error on leaving initialisation ------------------------------------------------
TOGETHER = {
    "loop cannot close": (
        {"start.override": True, "lower.angle.theta": -2.0},
        ["lower.angle.theta", "-2"],
    ),
    "spring foot beyond the link": ({"strut.s1": 0.3}, ["strut.s1", "0.3", "0.28"]),
    "link without length": ({"design.C.x": 0.08, "design.C.z": 0.25}, ["design.C"]),
    "arm without length": ({"design.B.x": 0.0, "design.B.z": 0.0}, ["design.B"]),
    "start without override": ({"lower.angle.theta": 0.1}, ["lower.angle.theta", "start.override"]),
    "triangle inequality in space": (
        {"scene.motion": "spatial", "carrier.inertia.xx": 5.0},
        ["carrier.inertia", "5"],
    ),
    "carrier inertia not positive definite": (
        {"scene.motion": "spatial", "carrier.inertia.xy": 1.5},
        ["carrier.inertia"],
    ),
}


@pytest.mark.parametrize("case", TOGETHER)
def test_parameters_that_do_not_fit_together_are_refused(instance, case):
    values, words = TOGETHER[case]
    instance.set(values)
    instance.enter_initialisation()
    outcome = instance.call("fmi3ExitInitializationMode")
    assert outcome.status == Status.ERROR
    assert all(word in outcome.text for word in words), outcome.text
    # the instance is not lost
    instance.reset()
    instance.initialise({})
    instance.step(0.0, 0.1)


def test_the_triangle_inequality_does_not_matter_in_the_plane(instance):
    instance.initialise({"carrier.inertia.xx": 5.0})
    instance.step(0.0, 0.1)


@pytest.mark.parametrize(("method", "number"), [("exact", 7)])
def test_methods_not_offered_are_refused_with_the_offered_ones(wishbone, instance, method, number):
    set_ = instance.try_set("solver.method", number)
    assert set_.status == Status.OK, set_.text
    instance.enter_initialisation()
    outcome = instance.call("fmi3ExitInitializationMode")
    assert outcome.status == Status.ERROR
    for word in ("solver.method", method, "heun", "rk4", "dopri5"):
        assert word in outcome.text, outcome.text


# steps that cannot be done -------------------------------------------------------------------------------------------
@pytest.mark.parametrize(("method", "low", "high"), [("rk4", 2e-4, 3e-4), ("heun", 1e-5, 3e-4)])
def test_too_large_an_explicit_step_on_a_stiff_bushing_is_discarded(wishbone, instance, method, low, high):
    """1e8 N/m has an eigenvalue of -6197 +- 9090i 1/s: 0.05 s would explode (5e13 rad), RK4 takes about 2.5e-4 s."""
    outputs = wishbone.names("output")
    instance.initialise({**scenes.bushing(1e8, 1e4), **scenes.fixed(method, 0.05)})
    before = instance.get_all(outputs)
    outcome = instance.try_step(0.0, 0.05)
    assert outcome.status == Status.DISCARD
    text = outcome.text
    assert "rodas4" in text and "radau5" in text, text
    named = numbers(text)
    assert any(6.0e3 < abs(number) < 1.2e4 for number in named), f"no eigenvalue in: {text}"
    usable = [number for number in named if low <= number <= high]
    assert usable, f"no usable step in: {text}"
    assert instance.last_successful_time == 0.0
    assert instance.get_all(outputs) == before
    # the run goes on with the step that the message gives
    h = min(usable)
    for i in range(100):
        instance.step(i * h, h)
    assert np.isfinite(list(instance.get_all(outputs).values())).all()
    assert abs(instance.get(THETA) - before[THETA]) < 1e-2


def test_stiffening_in_a_run_is_noticed(instance):
    """The guard acts again after a tunable changed: a damper of 1e6 N s/m makes 0.05 s impossible."""
    instance.initialise(scenes.fixed("heun", 0.05))
    instance.step(0.0, 0.05)
    before = instance.get(THETA)
    instance.set({"strut.c": 1e6})
    outcome = instance.try_step(0.05, 0.05)
    assert outcome.status == Status.DISCARD
    assert instance.get(THETA) == before
    instance.set({"strut.c": 1000.0})
    instance.step(0.05, 0.05)


@pytest.mark.parametrize("H", [0.0, -0.1, math.nan, math.inf])
def test_impossible_communication_steps(running, H):
    before = running.get(THETA)
    outcome = running.try_step(0.1, H)
    assert outcome.status == Status.ERROR
    assert outcome.text
    assert running.get(THETA) == before


def test_step_from_another_time_than_the_current_one(running):
    before = running.get(THETA)
    outcome = running.try_step(5.0, 0.1)
    assert outcome.status == Status.ERROR
    assert "5" in outcome.text and "0.1" in outcome.text, outcome.text
    assert running.get(THETA) == before


def test_strut_of_no_length_is_discarded(instance):
    """The chassis end of the strut on its foot: length zero at the start of the motion."""
    s1 = 0.14 / math.hypot(0.28, 0.02)
    values = {"design.T.x": 0.08 + 0.28 * s1, "design.T.z": 0.25 + 0.02 * s1, "strut.l0": 0.3}
    instance.set(values)
    instance.enter_initialisation()
    left = instance.call("fmi3ExitInitializationMode")
    if left.status == Status.OK:
        outcome = instance.try_step(0.0, 0.05)
        assert outcome.status == Status.DISCARD
    else:
        assert left.status == Status.ERROR
        outcome = left
    assert "strut" in outcome.text and "length" in outcome.text, outcome.text


# wrong calls ---------------------------------------------------------------------------------------------------------
def expect_error(outcome, *words):
    assert outcome.status == Status.ERROR, outcome
    assert outcome.text, "no message"
    assert all(word in outcome.text for word in words), outcome.text


def test_unknown_value_reference(initialising):
    unknown = (c_uint * 1)(4_000_000_000)
    value = (c_double * 1)(1.0)
    expect_error(initialising.call("fmi3GetFloat64", unknown, 1, value, 1), "4000000000")
    expect_error(initialising.call("fmi3SetFloat64", unknown, 1, value, 1), "4000000000")


def test_reference_of_another_type(wishbone, initialising):
    boolean = (c_uint * 1)(wishbone.variable("use.energy").valueReference)
    expect_error(initialising.call("fmi3GetFloat64", boolean, 1, (c_double * 1)(), 1), "use.energy")
    mass = (c_uint * 1)(wishbone.variable("carrier.mass").valueReference)
    expect_error(initialising.call("fmi3SetInt64", mass, 1, (fmi3.fmi3Int64 * 1)(3), 1), "carrier.mass")


def test_counts_that_do_not_match(wishbone, initialising):
    mass = (c_uint * 1)(wishbone.variable("carrier.mass").valueReference)
    expect_error(initialising.call("fmi3GetFloat64", mass, 1, (c_double * 2)(), 2))


def test_null_pointers(initialising):
    expect_error(initialising.call("fmi3GetFloat64", None, 1, (c_double * 1)(), 1))
    expect_error(initialising.call("fmi3GetFloat64", (c_uint * 1)(), 1, None, 1))
    assert initialising.call("fmi3GetFloat64", None, 0, None, 0).status == Status.OK
    assert initialising.call("fmi3SetFloat64", None, 0, None, 0).status == Status.OK


def test_outputs_cannot_be_set(instance):
    expect_error(instance.try_set("P.r.z", 1.0), "P.r.z")
    expect_error(instance.try_set("energy.kinetic", 1.0), "energy.kinetic")


def test_fixed_parameters_cannot_be_set_in_a_run(running):
    expect_error(running.try_set("carrier.mass", 30.0), "carrier.mass")
    expect_error(running.try_set("solver.method", 1), "solver.method")
    assert running.get("carrier.mass") == 25.0


def test_calls_in_the_wrong_phase(instance, wishbone):
    expect_error(instance.try_step(0.0, 0.1))
    expect_error(instance.call("fmi3ExitInitializationMode"))
    height = (c_uint * 1)(wishbone.variable("P.r.z").valueReference)
    expect_error(instance.call("fmi3GetFloat64", height, 1, (c_double * 1)(), 1), "P.r.z")
    expect_error(instance.call("fmi3EnterEventMode"))
    instance.initialise({})
    expect_error(instance.call("fmi3EnterInitializationMode", False, 0.0, 0.0, False, 0.0))
    # event mode was not asked for
    expect_error(instance.call("fmi3EnterEventMode"))
    instance.step(0.0, 0.1)
    assert instance.call("fmi3Terminate").status == Status.OK
    expect_error(instance.try_step(0.1, 0.1))
    assert math.isfinite(instance.get(THETA))
    instance.reset()
    instance.initialise({})


def test_start_values_are_read_before_initialisation(instance):
    """FMI 3.0, state Instantiated: the start value, or what was set."""
    assert instance.get("carrier.mass") == 25.0
    instance.set({"carrier.mass": 30.0, "lower.angle.theta": 0.25})
    assert instance.get("carrier.mass") == 30.0
    assert instance.get("lower.angle.theta") == 0.25


def test_wrong_token_gives_no_instance(wishbone):
    slave = fmi3.FMU3Slave(
        guid="not the token",
        unzipDirectory=str(wishbone.folder),
        modelIdentifier=wishbone.description.coSimulation.modelIdentifier,
        instanceName="x",
    )
    said = []
    with pytest.raises(Exception, match="Failed to instantiate"):
        slave.instantiate(logMessage=lambda environment, status, category, message: said.append(message.decode()))
    assert any("token" in message.lower() for message in said), said


UNSUPPORTED = {
    "fmi3GetOutputDerivatives": lambda vr: (vr, 1, (fmi3.fmi3Int32 * 1)(1), (c_double * 1)(), 1),
    "fmi3GetAdjointDerivative": lambda vr: (vr, 1, vr, 1, (c_double * 1)(1.0), 1, (c_double * 1)(), 1),
    "fmi3GetClock": lambda vr: (vr, 1, (fmi3.fmi3Clock * 1)()),
    "fmi3SetClock": lambda vr: (vr, 1, (fmi3.fmi3Clock * 1)()),
    "fmi3GetFloat32": lambda vr: (vr, 1, (fmi3.fmi3Float32 * 1)(), 1),
    "fmi3SetUInt8": lambda vr: (vr, 1, (fmi3.fmi3UInt8 * 1)(1), 1),
    "fmi3GetIntervalDecimal": lambda vr: (vr, 1, (c_double * 1)(), (fmi3.fmi3IntervalQualifier * 1)()),
    "fmi3EnterConfigurationMode": lambda vr: (),
    "fmi3ActivateModelPartition": lambda vr: (vr[0], 0.0),
}


@pytest.mark.parametrize("function", UNSUPPORTED)
def test_functions_not_offered_say_so(wishbone, running, function):
    reference = (c_uint * 1)(wishbone.variable("P.r.z").valueReference)
    expect_error(running.call(function, *UNSUPPORTED[function](reference)))
    running.step(0.1, 0.1)


def test_refusals_are_logged_with_and_without_debug_logging(wishbone):
    for logging in (False, True):
        with wishbone.instantiate(logging=logging) as instance:
            assert "carrier.mass" in instance.try_set("carrier.mass", -1.0).text
