"""Scenes as one FMU (`koppel pack --assembly`): the numbers of method common, and what is asked of every FMU."""

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import fmpy
import numpy as np
import pytest
from koppel import Fmu, FmuError, Status, library, paths
from koppel.fmu import grid
from koppel.scene import Scene
from serialised import go_on, open_instance
from test_conformance import TERMINALS, problems, read
from test_native_host import BUMP, KOPPEL, native
from test_serialised_state import cut, in_another_process

PACKED = ("four_bar", "double_wishbone")
each_scene = pytest.mark.parametrize("name", PACKED)
EQUAL = 1e-12


@pytest.fixture(scope="session")
def assembly(tmp_path_factory):
    """`assembly(scene, fmi)`: packed by the program, unpacked once per session."""
    folder = tmp_path_factory.mktemp("assembly")
    opened = {}

    def load(name, fmi=3):
        if (name, fmi) not in opened:
            path = folder / f"{name}.fmi{fmi}.fmu"
            command = [KOPPEL, "pack", paths.ROOT / "scenes" / name, "--assembly", "--fmi", str(fmi), "--output", path]
            done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=paths.ROOT, timeout=120)
            assert done.returncode == 0, done.stderr
            opened[name, fmi] = Fmu(path) if fmi == 3 else path
        return opened[name, fmi]

    yield load
    for one in opened.values():
        if isinstance(one, Fmu):
            one.close()


def solver(method, **settings):
    return {"solver.method": method, **{f"solver.{name}": value for name, value in settings.items()}}


# the numbers of method common ---------------------------------------------------------------------------------------
RUNS = [
    ("four_bar", "heun", 0.005),
    ("four_bar", "rk4", 0.005),
    # steps that do not end at the communication points
    ("four_bar", "rk4", 0.01),
    ("double_wishbone", "heun", 0.05),
    ("double_wishbone", "rk4", 0.05),
    ("double_wishbone", "rk4", 0.02),
]


@pytest.mark.parametrize(("name", "method", "step"), RUNS)
def test_fixed_steps_are_those_of_the_native_host(assembly, tmp_path, name, method, step):
    one = assembly(name)
    names, t, expected = native(tmp_path, name, "--method", "common", "--integrator", method, "--H", str(step))
    result = one.run(solver(method, step=step), H=t[1] - t[0], stop=t[-1], outputs=names)
    assert np.abs(result.values - expected).max() <= EQUAL
    assert np.ptp(result.values, axis=0).max() > 1e-3, "nothing moves"


@each_scene
@pytest.mark.parametrize("method", ["dopri5", "dop853", "radau5"])
def test_adaptive_steps_are_those_of_the_native_host(assembly, tmp_path, name, method):
    """Communication points, also finer ones, do not touch the steps of the integrator."""
    one = assembly(name)
    options = ["--rtol", "1e-6", "--atol", "1e-9"]
    names, t, expected = native(tmp_path, name, "--method", "common", "--integrator", method, *options)
    settings = solver(method, rtol=1e-6, atol=1e-9)
    runs = [one.run(settings, H=(t[1] - t[0]) / part, stop=t[-1], outputs=names) for part in (1, 4)]
    for run, part in zip(runs, (1, 4)):
        assert np.abs(run.values[::part] - expected).max() <= EQUAL
    assert runs[0].counts["solver.steps"] == runs[1].counts["solver.steps"] < len(runs[1].t)


@pytest.mark.parametrize("method", ["rk4", "dopri5"])
def test_time_events_inside_a_step(assembly, tmp_path, method):
    """A pulse of the load whose ends lie inside communication steps."""
    one = assembly("double_wishbone")
    command = ["--method", "common", "--integrator", method, "--H", "0.01", "--stop", "1"]
    command += [part for name, value in BUMP.items() for part in ("--set", f"load.{name}={value}")]
    names, t, expected = native(tmp_path, "double_wishbone", *command)
    bump = {f"load.{name}": value for name, value in BUMP.items()}
    result = one.run({**solver(method, step=0.01), **bump}, H=0.05, stop=1.0, outputs=names)
    assert np.abs(result.values - expected).max() <= EQUAL


def test_joints_stay_closed(assembly):
    result = assembly("double_wishbone").run(solver("rk4", step=0.05), H=0.05, stop=10.0, outputs=["joint[1].gap"])
    assert 0.0 < result.values.max() <= 1e-6


@each_scene
def test_an_archive_of_fmi_2_gives_the_same_numbers(assembly, name):
    one, path = assembly(name), assembly(name, 2)
    outputs = [n for n in one.names("output") if n.endswith("theta")]
    start = {"solver.method": 2, "solver.step": 0.005}
    run = {"output": outputs, "stop_time": 0.6, "step_size": 0.02, "output_interval": 0.02, "start_values": start}
    new = fmpy.simulate_fmu(str(one.path), **run)
    old = fmpy.simulate_fmu(str(path), validate=True, **run)
    assert len(old) == 31
    for output in outputs:
        assert np.array_equal(new[output], old[output])


# ports outwards -----------------------------------------------------------------------------------------------------
FORCE = {"lower.B.F.x": 0.4, "lower.B.F.z": -1.3}


def loaded(fmu, **force):
    """The double pendulum with a load at its end, as a scene."""
    scene = library.scene("double_pendulum", fmu)
    scene.add("load", "load", **force)
    scene.connect("lower.B", "load.A")
    return scene


def test_a_constant_force_from_outside_is_that_of_a_load_inside(assembly, fmu):
    one = assembly("double_pendulum")
    scene = loaded(fmu, **{"force.offset.x": 0.4, "force.offset.z": -1.3, "force.amplitude.z": 0.0})
    inside = scene.run(method="common", integrator="rk4", H=0.01)
    result = one.run({**solver("rk4", step=0.01), **FORCE}, H=0.01, stop=2.0, outputs=inside.names)
    free = one.run(solver("rk4", step=0.01), H=0.01, stop=2.0, outputs=inside.names)
    assert np.abs(result.values - inside.values).max() <= 1e-9
    assert np.abs(result.values - free.values).max() > 0.1


@pytest.mark.parametrize(("order", "slope"), [(0, 0.8), (1, 1.8)])
def test_a_moving_force_converges_with_the_order_of_its_polynomial(assembly, order, slope):
    """A host that sets the force of each point, as jacobi does, against steps a tenth as long."""
    one = assembly("double_pendulum")
    angles = ["upper.angle.theta", "lower.angle.theta"]

    def end(H):
        feed = (["lower.B.F.z"], lambda t: [3.0 * np.sin(4.0 * t)])
        settings = {**solver("dop853", rtol=1e-11, atol=1e-13), "port.order": order}
        return one.run(settings, H=H, stop=1.0, outputs=angles, inputs=feed).values[-1]

    exact = end(0.0005)
    errors = [np.abs(end(H) - exact).max() for H in (0.04, 0.02)]
    assert np.log2(errors[0] / errors[1]) > slope, errors


def test_a_load_from_outside_by_plain_exchange(assembly, fmu):
    """The load is another FMU beside the assembly: `jacobi` with the order of its polynomials."""
    force = {"force.amplitude.z": 3.0, "force.omega.z": 4.0}
    inside = loaded(fmu, **force).run(method="common", integrator="dop853", rtol=1e-11, atol=1e-13, stop=1.0)
    names = list(inside.names)

    def end(H):
        parts = {"pendulum": assembly("double_pendulum")}
        scene = Scene("loaded", lambda name: parts[name] if name in parts else fmu(name))
        scene.add("one", "pendulum", **solver("dopri5", rtol=1e-10, atol=1e-12))
        scene.add("load", "load", **force)
        scene.connect("one.lower.B", "load.A")
        scene.record(*(f"one.{name}" for name in names), interval=0.1)
        return scene.run(method="jacobi", order=1, H=H, stop=1.0).values[-1]

    errors = [np.abs(end(H) - inside.values[-1]).max() for H in (0.02, 0.01)]
    assert np.log2(errors[0] / errors[1]) > 1.8, errors
    assert errors[1] < 1e-2


def test_a_base_that_accelerates_is_a_weight_to_the_side(assembly):
    """Seen from the base, an acceleration of 2 m/s2 is a field of -2 m/s2."""
    one = assembly("double_pendulum")
    angles = ["upper.angle.theta", "lower.angle.theta"]
    settings = solver("dop853", rtol=1e-11, atol=1e-13)
    moved = one.run({**settings, "upper.A.a.x": 2.0}, H=0.01, stop=1.0, outputs=angles)
    field = {"upper.gravity.x": -2.0, "lower.gravity.x": -2.0}
    still = one.run({**settings, **field}, H=0.01, stop=1.0, outputs=angles)
    free = one.run(settings, H=0.01, stop=1.0, outputs=angles)
    assert np.abs(moved.values - still.values).max() <= 1e-9
    assert np.abs(moved.values - free.values).max() > 0.1


@each_scene
def test_outputs_depend_on_the_declared_inputs_only(assembly, name):
    one = assembly(name)
    inputs, outputs = one.names("input"), one.names("output")
    inputs = [n for n in inputs if one.variable(n).variability == "continuous"]
    found = set()
    with one.instantiate(event_mode=True) as instance:
        instance.initialise({})
        feed, block = instance.block(inputs), instance.block(outputs)
        base = 0.1 * np.cos(np.arange(len(inputs)))
        feed.write(base)
        before = block.read().copy()
        for i, known in enumerate(inputs):
            moved = base.copy()
            moved[i] += 0.5
            feed.write(moved)
            for unknown in np.flatnonzero(block.read() != before):
                found.add((outputs[unknown], known))
    declared = {(unknown, known) for unknown in outputs for known in one.dependencies(unknown)}
    assert not found - declared, sorted(found - declared)[:5]
    # in the plane, each input that is declared for something moves something
    acts = {known for _, known in declared if ("y" in known.split(".")[-1]) == (".torque." in known)}
    assert acts == {known for _, known in found}


# what is asked of every FMU -----------------------------------------------------------------------------------------
@each_scene
@pytest.mark.parametrize("method", ["rk4", "dopri5", "rodas4", "radau5"])
@pytest.mark.parametrize("events", [False, True])
def test_restore_and_repeat_is_bit_identical(assembly, name, method, events):
    """Saved between two ends of the integrator's steps."""
    one = assembly(name)
    way = "cs with events" if events else "cs"
    with open_instance(one, way) as instance:
        instance.initialise(solver(method, step=0.007))
        go_on(one, instance, way, 0, 5)
        saved = instance.save()
        first = go_on(one, instance, way, 5, 9)
        instance.restore(saved)
        assert np.array_equal(go_on(one, instance, way, 5, 9), first)
        instance.free_state(saved)
    assert np.ptp(first, axis=0).max() > 0.0


@each_scene
@pytest.mark.parametrize("way", ["cs", "cs with events"])
def test_another_process_goes_on_to_the_last_bit(assembly, name, way, tmp_path):
    one = assembly(name)
    data, expected = cut(one, way, solver("dopri5"))
    assert np.array_equal(in_another_process(one, way, data, tmp_path), expected)


def test_a_saved_free_run_goes_on_to_the_last_bit(assembly):
    """No input moves: the integrator is beyond the communication point when the state is saved."""
    one = assembly("four_bar")
    names, t = one.names("output"), grid(0.0, 1.0, 0.01)
    whole = one.run(solver("dopri5"), H=0.01, stop=1.0, outputs=names)
    with one.instantiate() as instance, one.instantiate() as other:
        instance.initialise(solver("dopri5"), stop=1.0)
        instance.run(t[:38], names)
        saved = instance.save()
        data = instance.serialise(saved)
        instance.free_state(saved)
        state = other.deserialise(data, at=t[37])
        other.restore(state)
        other.free_state(state)
        rest = other.run(t[37:], names)
    assert np.array_equal(rest.values, whole.values[37:])


@each_scene
def test_reset_is_a_fresh_instance(assembly, name):
    one = assembly(name)
    names, t = one.names("output"), grid(0.0, 0.5, 0.01)
    fresh = one.run(solver("dopri5"), H=0.01, stop=0.5, outputs=names)
    mass = next(n for n in one.variables if n.endswith(".mass"))
    with one.instantiate() as instance:
        instance.initialise({mass: 3.0, **solver("heun", step=0.02)})
        instance.run(grid(0.0, 0.3, 0.1), names)
        instance.reset()
        instance.initialise(solver("dopri5"), stop=0.5)
        again = instance.run(t, names)
    assert np.array_equal(fresh.values, again.values)
    assert fresh.counts == again.counts


def test_instances_are_independent(assembly):
    one = assembly("four_bar")
    names = one.names("output")

    def run(mass):
        return one.run({"link2.mass": mass, **solver("rk4", step=0.01)}, H=0.01, stop=0.5, outputs=names).values

    masses = [1.0, 2.0, 3.0, 4.0]
    alone = [run(mass) for mass in masses]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(run, masses))
    assert all(np.array_equal(a, b) for a, b in zip(alone, together))
    assert not np.array_equal(alone[0], alone[1])


def test_event_mode_changes_no_number(assembly):
    one = assembly("double_wishbone")
    names, t = one.names("output"), grid(0.0, 1.0, 0.05)
    plain = one.run(solver("dopri5"), H=0.05, stop=1.0, outputs=names)
    with one.instantiate(event_mode=True) as instance:
        instance.initialise(solver("dopri5"), stop=1.0)
        block, samples = instance.block(names), []
        samples.append(block.read().copy())
        for start, end in zip(t, t[1:]):
            instance.step(start, end - start)
            instance.enter_event_mode()
            instance.update_discrete_states()
            instance.enter_step_mode()
            samples.append(block.read().copy())
    assert np.array_equal(samples, plain.values)


def test_a_tunable_parameter_acts_from_its_time_on(assembly):
    """Gravity is doubled at 0.5 s: the same as a run that begins there with the state and the other gravity."""
    one = assembly("double_pendulum")
    tunable = [n for n, v in one.variables.items() if v.variability == "tunable" and n.endswith("gravity.z")]
    assert tunable == ["upper.gravity.z", "lower.gravity.z"]
    state = [f"{link}.{kind}.theta" for link in ("upper", "lower") for kind in ("angle", "angle_rate")]
    settings = solver("rk4", step=0.005)
    with one.instantiate() as instance:
        instance.initialise(settings)
        instance.run(grid(0.0, 0.5, 0.05), state)
        middle = instance.get_all(state)
        instance.set(dict.fromkeys(tunable, -19.62))
        after = instance.run(grid(0.5, 1.0, 0.05), state).values
    again = one.run({**settings, **middle, **dict.fromkeys(tunable, -19.62)}, H=0.05, stop=0.5, outputs=state)
    assert np.abs(after - again.values).max() <= 1e-9
    assert np.ptp(after, axis=0).min() > 0.1


# refusals -----------------------------------------------------------------------------------------------------------
def test_a_refused_parameter_names_element_value_and_range(assembly):
    with assembly("four_bar").instantiate() as instance:
        outcome = instance.try_set("link2.mass", -1.0)
        assert outcome.status == Status.DISCARD
        assert "link2.mass = -1 is refused, the value stays 2; allowed: > 0 kg" in outcome.text
        assert instance.get("link2.mass") == 2.0
        assert instance.try_set("link2.mass", float("nan")).status == Status.DISCARD


def test_an_open_joint_is_an_error_that_names_it(assembly):
    with assembly("four_bar").instantiate() as instance, pytest.raises(FmuError) as refused:
        instance.initialise({"link1.length": 1.1})
    assert refused.value.status == Status.ERROR
    assert "joint link2.B - link3.B is open at the start" in str(refused.value)


def test_joints_are_closed_by_the_start_parameters_that_the_scene_lists(tmp_path):
    """With a longer first link the other two turn until their tips meet."""
    text = (paths.ROOT / "scenes/four_bar/SystemStructure.ssd").read_text(encoding="utf-8")
    assembled = '<assemble variables="link2.angle.theta link3.angle.theta"/><record'
    (tmp_path / "SystemStructure.ssd").write_text(text.replace("<record", assembled), encoding="utf-8")
    path = tmp_path / "four_bar.fmu"
    command = [KOPPEL, "pack", tmp_path, "--assembly", "--output", path]
    subprocess.run(command, check=True, capture_output=True, cwd=paths.ROOT, timeout=60)
    with Fmu(path) as one, one.instantiate() as instance:
        before = instance.get("link2.angle.theta")
        instance.initialise({"link1.length": 1.1, **solver("rk4", step=0.005)})
        assert instance.get("joint[1].gap") <= 1e-12
        assert abs(instance.get("link2.angle.theta") - before) > 0.01
        instance.run(grid(0.0, 0.5, 0.01), ["joint[1].gap"])


def test_a_method_that_is_not_offered_is_an_error(assembly):
    with assembly("four_bar").instantiate() as instance, pytest.raises(FmuError) as refused:
        instance.initialise({"solver.method": "exact"})
    assert refused.value.status == Status.ERROR
    assert "exact" in str(refused.value)


def test_a_refused_step_changes_nothing(assembly):
    """A force that no step can follow, then the run goes on as if nothing had been asked."""
    one = assembly("double_pendulum")
    names = one.names("output")
    with one.instantiate() as instance, one.instantiate() as other:
        for each in (instance, other):
            each.initialise(solver("dopri5"))
            each.run(grid(0.0, 0.2, 0.05), names)
        instance.set({"lower.B.F.z": 1e308})
        with pytest.raises(FmuError) as refused:
            instance.step(0.2, 0.05)
        assert refused.value.status == Status.DISCARD
        instance.set({"lower.B.F.z": 0.0})
        results = [each.run(grid(0.2, 0.5, 0.05), names).values for each in (instance, other)]
    assert np.array_equal(*results)


def test_a_wrong_token_and_a_missing_folder_are_refused(assembly, tmp_path):
    one = assembly("four_bar")
    folder = Path(fmpy.extract(str(one.path), unzipdir=str(tmp_path / "moved")))
    (folder / "resources" / "SystemStructure.ssd").unlink()
    broken = Fmu(one.path)
    broken.folder = folder
    with pytest.raises(FmuError) as refused:
        broken.instantiate()
    assert "resources: " in str(refused.value)
    broken.description.instantiationToken = "{0}"
    broken.folder = one.folder
    with pytest.raises(FmuError) as refused:
        broken.instantiate()
    assert "this binary belongs to" in str(refused.value)


def test_a_scene_whose_names_do_not_fit_is_not_packed(tmp_path):
    text = (paths.ROOT / "scenes/double_pendulum/SystemStructure.ssd").read_text(encoding="utf-8")
    (tmp_path / "SystemStructure.ssd").write_text(text.replace("upper", "upper-rod"), encoding="utf-8")
    command = [KOPPEL, "pack", tmp_path, "--assembly", "--output", tmp_path / "x.fmu"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=paths.ROOT, timeout=60)
    assert done.returncode == 2
    assert '"upper-rod" cannot be a name in an FMU' in done.stderr


# archive ------------------------------------------------------------------------------------------------------------
@each_scene
def test_archive_follows_schemas_and_checkers(assembly, name):
    one = assembly(name)
    assert problems("fmi3ModelDescription.xsd", read(one, "modelDescription.xml")) == []
    assert problems("fmi3TerminalsAndIcons.xsd", read(one, TERMINALS)) == []
    assert fmpy.validation.validate_fmu(str(one.path)) == []
    assert fmpy.validation.validate_fmu(str(assembly(name, 2))) == []
    command = [Path(sys.executable).parent / "fmutool", "-input", one.path, "-check"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


@each_scene
def test_the_default_experiment_meets_the_reference_results(assembly, name):
    one = assembly(name)
    text = read(one, f"extra/org.fmi-standard.fmi-ls-ref/{name}_ref.csv").decode().splitlines()
    names = text[0].split(",")[1:]
    assert names == one.names("output")
    expected = np.array([[float(value) for value in line.split(",")] for line in text[1:]])
    t = expected[:, 0]
    result = one.run({}, H=t[1] - t[0], stop=t[-1], outputs=names)
    scale = np.maximum(np.abs(expected[:, 1:]).max(axis=0), 1.0)
    assert (np.abs(result.values - expected[:, 1:]) / scale).max() <= 1e-3


def test_packing_twice_gives_the_same_bytes(assembly, tmp_path):
    path = tmp_path / "again.fmu"
    command = [KOPPEL, "pack", paths.ROOT / "scenes/four_bar", "--assembly", "--output", path]
    subprocess.run(command, check=True, capture_output=True, cwd=paths.ROOT, timeout=60)
    assert path.read_bytes() == assembly("four_bar").path.read_bytes()


def test_parameters_of_all_elements_are_there(assembly, fmu):
    one = assembly("four_bar")
    own = fmu("link2").description.modelVariables
    expected = {
        f"link{i}.{v.name}"
        for i in (1, 2, 3)
        for v in own
        if v.causality == "parameter" and not v.name.startswith(("solver.", "port."))
    }
    assert expected <= set(one.variables)
    assert one.variable("link3.mass").start == "1.5"
    assert one.variable("solver.method").start == "3", "the scene's integrator is dopri5"
