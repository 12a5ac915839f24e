"""A run that may be cut in two: what `test_serialised_state.py` does in one process and repeats in another."""

import sys
from pathlib import Path

import numpy as np
from koppel import Fmu

WAYS = ("cs", "cs with events", "me")
STEP = 0.01
METHODS = ("heun", "rk4", "dopri5", "dop853", "rodas4", "radau5")


def open_instance(fmu, way):
    """A new instance, used in one of the three ways."""
    return fmu.equations() if way == "me" else fmu.instantiate(event_mode=way == "cs with events")


def moved(fmu):
    """Inputs that move: all continuous ones of any sign except masses."""
    inputs = [fmu.variable(name) for name in fmu.names("input")]
    return [v.name for v in inputs if v.variability == "continuous" and ".M." not in v.name and v.min is None]


def tunable(fmu):
    """A tunable parameter and another value for it."""
    for variable in fmu.variables.values():
        if (variable.causality, variable.variability, variable.type) == ("parameter", "tunable", "Float64"):
            return {variable.name: max(float(variable.start), 0.0) + 0.5}  # -1 may stand for another source
    return {}


def go_on(fmu, instance, way, first, count):
    """Steps number `first` to `first + count - 1`; every Float64 variable after each."""
    everything = instance.block([name for name in fmu.variables if fmu.variable(name).type == "Float64"])
    feed = instance.block(moved(fmu))
    samples = []
    for t in (first + np.arange(count)) * STEP:
        u = 0.01 * np.sin(3.0 * t + np.arange(len(moved(fmu))))
        if way == "me":
            feed.write(u)
            midpoint(instance, t)
        else:
            if way == "cs with events":
                instance.enter_event_mode()
                instance.enter_step_mode()
            feed.write(u)
            instance.step(t, STEP)
        samples.append(everything.read().copy())
    return np.array(samples)


def midpoint(instance, t):
    """One step of the midpoint rule by Model Exchange."""
    start = instance.x.copy()
    instance.set_time(t)
    half = start + 0.5 * STEP * instance.read_derivatives()
    instance.set_time(t + 0.5 * STEP)
    instance.x[:] = half
    instance.write_states()
    end = start + STEP * instance.read_derivatives()
    instance.set_time(t + STEP)
    instance.x[:] = end
    instance.write_states()
    if instance.completed_step():
        instance.enter_event_mode()
        instance.enter_continuous_time_mode()


def resume(path, way, state, first, count):
    """From the bytes of a state, in an instance that was not even initialised."""
    with Fmu(path) as fmu, open_instance(fmu, way) as instance:
        saved = instance.deserialise(Path(state).read_bytes(), at=first * STEP)
        instance.restore(saved)
        instance.free_state(saved)
        if way == "me":
            instance.read_states()
        return go_on(fmu, instance, way, first, count)


if __name__ == "__main__":
    archive, used, state_file, begin, number, result_file = sys.argv[1:]
    Path(result_file).write_bytes(resume(archive, used, state_file, int(begin), int(number)).tobytes())
