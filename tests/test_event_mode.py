"""Event Mode and moving inputs in Co-Simulation: same numbers, right orders, nothing forgotten or kept too long."""

import numpy as np
import pytest
from koppel import FmuError, Reference, Status, scenes
from koppel.fmu import grid
from koppel.work_precision import fitted_order

THETA = "lower.angle.theta"
FORCE = "P.F.z"
# the internal load of the paper's case comes through the port instead; inner steps leave 1e-11 rad
FED = {"force.kind": "input", **scenes.fixed("rk4", 2.5e-3)}


def load(t):
    """The paper's force at P [N]."""
    return 10.0 * np.sin(10.0 * t)


def treated(inputs, order):
    """Parameters of the input treatment."""
    return {"port.inputs": inputs, "port.order": order}


def feed(fmu, start_values, H, stop, names, event_mode=False):
    """Samples of a run whose port force is given at communication points only."""
    t = grid(0.0, stop, H)
    endpoint = start_values.get("port.inputs") == "endpoint"
    with fmu.instantiate(event_mode=event_mode) as instance:
        instance.initialise({**start_values, FORCE: load(0.0)})
        force, outputs = instance.block([FORCE]), instance.block(names)
        samples = [outputs.read().copy()]
        for start, end in zip(t, t[1:]):
            if event_mode:
                instance.enter_event_mode()
                force.write([load(start)])
                instance.enter_step_mode()
            if endpoint:
                force.write([load(end)])
            elif not event_mode:
                force.write([load(start)])
            instance.step(start, end - start)
            samples.append(outputs.read().copy())
    return np.array(samples)


# treatment, order of the polynomial, order of convergence
TREATMENTS = [
    ("hold", 1, 1.0),
    ("extrapolate", 0, 1.0),
    ("extrapolate", 1, 2.0),
    ("extrapolate", 2, 3.0),
    ("endpoint", 1, 2.0),
    ("endpoint", 2, 3.0),
    ("endpoint", 3, 4.0),
]


@pytest.mark.parametrize(("inputs", "order", "expected"), TREATMENTS)
def test_a_fed_sine_converges_with_the_order_of_the_treatment(wishbone, inputs, order, expected):
    """A polynomial of degree k errs by H^(k+1), and the states follow; the start with a short history counts less."""
    reference = Reference.named("wishbone_paper")
    steps = (0.05, 0.025, 0.0125, 0.00625)
    errors = []
    for H in steps:
        theta = feed(wishbone, {**FED, **treated(inputs, order)}, H, 5.0, [THETA])[:: round(0.05 / H), 0]
        # the first steps have a short history, after a second this is damped away
        errors.append(np.abs(theta - reference[THETA][: len(theta)])[20:].max())
    assert fitted_order([1.0 / H for H in steps], errors) == pytest.approx(expected, abs=0.12), errors


@pytest.mark.parametrize(("inputs", "order", "_expected"), TREATMENTS)
def test_event_mode_changes_no_number(wishbone, inputs, order, _expected):
    names = wishbone.names("output")
    values = {**FED, **treated(inputs, order)}
    plain = feed(wishbone, values, 0.02, 1.0, names)
    events = feed(wishbone, values, 0.02, 1.0, names, event_mode=True)
    assert plain.tobytes() == events.tobytes()


def test_outputs_follow_inputs_in_event_mode(wishbone):
    """Set and Get without a step, as sweeps do: affine in the force, back to the same bits, motion untouched."""
    names = ["P.r.z", "P.v.z", "P.a.z", "A.F.x", "der(lower.angle_rate.theta)"]
    with wishbone.instantiate(event_mode=True) as instance:
        instance.initialise(FED)
        instance.step(0.0, 0.05)
        instance.enter_event_mode()
        block, force = instance.block(names), instance.block([FORCE])
        at = {}
        for value in (0.0, 1.0, 2.0, 0.0):
            force.write([value])
            at.setdefault(value, []).append(block.read().copy())
        assert at[0.0][0].tobytes() == at[0.0][1].tobytes()
        first, second = at[1.0][0] - at[0.0][0], at[2.0][0] - at[0.0][0]
        assert np.abs(second - 2.0 * first).max() <= 1e-13
        assert not first[:2].any() and first[2:].all()
        instance.enter_step_mode()
        instance.step(0.05, 0.05)


def test_predict_and_correct_restores_and_interpolates(wishbone):
    """A step is predicted, restored and repeated with the end value: as if it had been an endpoint run all along."""
    names = [THETA, "P.a.z", "energy.supplied", FORCE]
    H, stop = 0.05, 1.0
    with wishbone.instantiate(event_mode=True) as instance:
        instance.initialise({**FED, FORCE: load(0.0)})
        force, outputs = instance.block([FORCE]), instance.block(names)
        t = grid(0.0, stop, H)
        corrected = [outputs.read().copy()]
        for start, end in zip(t, t[1:]):
            instance.enter_event_mode()
            force.write([load(start)])
            saved = instance.save()
            instance.set(treated("extrapolate", 1))
            instance.enter_step_mode()
            instance.step(start, end - start)
            predicted = outputs.read().copy()
            instance.restore(saved)
            instance.free_state(saved)
            instance.set(treated("endpoint", 2))
            instance.enter_step_mode()
            force.write([load(end)])
            instance.step(start, end - start)
            corrected.append(outputs.read().copy())
            assert predicted.tobytes() != corrected[-1].tobytes()
    endpoint = feed(wishbone, {**FED, **treated("endpoint", 2)}, H, stop, names, event_mode=True)
    assert np.array(corrected).tobytes() == endpoint.tobytes()


def test_inputs_after_a_step_are_the_end_of_their_polynomial(wishbone):
    with wishbone.instantiate() as instance:
        instance.initialise({**FED, FORCE: 1.0})
        for start, value, end in ((0.0, 1.0, 1.0), (0.1, 2.0, 3.0), (0.2, 2.5, 3.0)):
            instance.set({FORCE: value})
            instance.step(start, 0.1)
            assert instance.get(FORCE) == pytest.approx(end, abs=1e-12)


def test_a_reset_forgets_the_past(wishbone):
    """With port.reset a jump is a jump: the first step after it holds, the next is linear again."""
    with wishbone.instantiate(event_mode=True) as instance:
        instance.initialise(FED)
        ends = []
        for i, (value, reset) in enumerate([(0.0, 0.0), (1.0, 0.0), (50.0, 1.0), (51.0, 1.0)]):
            instance.enter_event_mode()
            instance.set({FORCE: value, "port.reset": reset})
            instance.enter_step_mode()
            instance.step(0.1 * i, 0.1)
            ends.append(instance.get(FORCE))
    assert ends == pytest.approx([0.0, 2.0, 50.0, 52.0], abs=1e-12)


def test_restored_history_repeats_to_the_bit(wishbone):
    names = wishbone.names("output") + [FORCE]

    def march(instance, start, scale):
        outputs, force, samples = instance.block(names), instance.block([FORCE]), []
        for i in range(6):
            t = start + 0.02 * i
            instance.enter_event_mode()
            force.write([scale * load(t)])
            instance.enter_step_mode()
            instance.step(t, 0.02)
            samples.append(outputs.read().copy())
        return np.array(samples)

    with wishbone.instantiate(event_mode=True) as instance:
        instance.initialise({**FED, **treated("extrapolate", 2)})
        march(instance, 0.0, 1.0)
        saved = instance.save()
        first = march(instance, 0.12, 2.0)
        march(instance, 0.24, -3.0)
        instance.restore(saved)
        assert march(instance, 0.12, 2.0).tobytes() == first.tobytes()
        instance.free_state(saved)


def test_limit_holds_a_wild_extrapolation(wishbone):
    """A contact force jumps from 0 to 100 N: beyond the limit of half its size the change is not trusted."""
    for limit, end in ((0.0, 200.0), (0.5, 100.0), (2.0, 200.0)):
        with wishbone.instantiate() as instance:
            instance.initialise({**FED, "port.limit": limit})
            instance.step(0.0, 0.01)
            instance.set({FORCE: 100.0})
            instance.step(0.01, 0.01)
            assert instance.get(FORCE) == pytest.approx(end, abs=1e-9), limit


def test_orders_that_do_not_fit_are_refused(wishbone):
    with wishbone.instantiate() as instance:
        instance.set({**treated("endpoint", 0)})
        instance.enter_initialisation()
        outcome = instance.call("fmi3ExitInitializationMode")
        assert outcome.status == Status.ERROR
        assert all(word in outcome.text for word in ("port.order", "0", "1 .. 3")), outcome.text
    with wishbone.instantiate() as instance:
        assert instance.try_set("port.order", 4).status == Status.DISCARD
        assert instance.try_set("port.order", -1).status == Status.DISCARD
        assert instance.try_set("port.limit", -1.0).status == Status.DISCARD


def test_values_that_change_at_events_wait_for_event_mode(wishbone):
    with wishbone.instantiate(event_mode=True) as instance:
        instance.initialise({})
        for values in ({"strut.c": 900.0}, {"port.reset": 1.0}, treated("hold", 0)):
            with pytest.raises(FmuError) as refused:
                instance.set(values)
            assert refused.value.status == Status.ERROR and "Event Mode" in str(refused.value)
        instance.enter_event_mode()
        instance.set({"strut.c": 900.0, "port.reset": 1.0, **treated("hold", 0)})
        instance.enter_step_mode()
        instance.step(0.0, 0.05)
