"""The program `koppel` against the Python twin, which shares no code with it: the same scene files, methods and steps.

Both run the same FMUs, so differences are those of the hosts: rounding of other orders of summation, amplified by the motion.
"""

import csv
import json
import re
import subprocess

import numpy as np
import pytest
from koppel import Fmu, library, paths, scenes
from koppel.scene import Diverged

KOPPEL = paths.ROOT / "dist" / "bin" / "koppel"
AGREEMENT = 1e-9


def koppel(name, *options):
    """The program on a scene."""
    if not KOPPEL.is_file():
        pytest.fail(f"{KOPPEL} is missing: run scripts/build")
    command = [KOPPEL, "simulate", paths.ROOT / "scenes" / name, *options]
    return subprocess.run(command, capture_output=True, text=True, check=False, cwd=paths.ROOT, timeout=120)


def counted(tmp_path, name, *options):
    """A run by the program: recorded names, times, values; and its cost."""
    output = tmp_path / "result.csv"
    done = koppel(name, "--output", output, "--json", *options)
    assert done.returncode == 0, done.stderr
    with output.open(encoding="utf-8", newline="") as file:
        header, *rows = csv.reader(file)
    values = np.array(rows, dtype=float)
    return (header[1:], values[:, 0], values[:, 1:]), json.loads(done.stdout)["cost"]


def native(tmp_path, name, *options):
    """Recorded values of a run by the program: names, times, values."""
    return counted(tmp_path, name, *options)[0]


COMMON = [
    ("double_pendulum", 5e-3),
    ("two_mass", 5e-3),
    ("four_bar", 15e-3),
    ("double_wishbone", 0.05),
    ("double_wishbone_two_chain", 5e-3),
]
COUPLED = [
    ("double_pendulum", "jacobi", 0),
    ("double_pendulum", "jacobi", 1),
    ("double_pendulum", "jacobi", 2),
    ("double_pendulum", "cs-predict", 1),
    ("double_pendulum", "cs-pece", 1),
    ("double_pendulum", "cs-pece", 2),
    ("double_pendulum", "seidel", 1),
    ("two_mass", "jacobi", 1),
    ("two_mass", "cs-pece", 2),
    ("four_bar", "cs-predict", 1),
    ("four_bar", "cs-pece", 2),
]


def same(one, two):
    names, times, values = one
    assert names == list(two.names)
    assert values.shape == two.values.shape
    assert np.abs(times - two.t).max() <= 1e-12
    scale = np.maximum(np.abs(two.values).max(axis=0), 1.0)
    assert (np.abs(values - two.values) / scale).max() <= AGREEMENT


@pytest.mark.parametrize("integrator", ["heun", "rk4"])
@pytest.mark.parametrize(("name", "H"), COMMON)
def test_common(tmp_path, fmu, name, H, integrator):
    twin = library.scene(name, fmu).run(method="common", integrator=integrator, H=H)
    same(native(tmp_path, name, "--method", "common", "--integrator", integrator, "--H", str(H)), twin)


@pytest.mark.parametrize(("name", "method", "order"), COUPLED)
def test_coupled(tmp_path, fmu, name, method, order):
    scene = library.scene(name, fmu)
    H = scene.interval / 2
    twin = scene.run(method=method, order=order, H=H, values=scenes.fixed("rk4", H))
    options = ["--method", method, "--order", str(order), "--H", str(H)]
    inner = ["--set", "*.solver.method=rk4", "--set", f"*.solver.step={H}"]
    same(native(tmp_path, name, *options, *inner), twin)


# a bump whose ends lie inside the steps: time events
BUMP = {"force.pulse.amplitude.z": 20.0, "force.pulse.start": 0.1234, "force.pulse.duration": 0.2}


@pytest.mark.parametrize("options", [("common", "rk4", 1), ("cs-predict", None, 1), ("cs-pece", None, 2)], ids=lambda o: o[0])
def test_time_events(tmp_path, fmu, options):
    method, integrator, order = options
    scene = library.scene("double_wishbone", fmu)
    scene.set("load", **BUMP)
    H = 5e-3
    settings = {"method": method, "H": H, "stop": 1.0} | ({"integrator": integrator} if integrator else {"order": order})
    twin = scene.run(**settings, values={} if integrator else scenes.fixed("rk4", H))
    command = ["--method", method, "--order", str(order), "--H", str(H), "--stop", "1"]
    command += ["--integrator", integrator] if integrator else ["--set", "*.solver.method=rk4", "--set", f"*.solver.step={H}"]
    command += [part for name, value in BUMP.items() for part in ("--set", f"load.{name}={value}")]
    same(native(tmp_path, "double_wishbone", *command), twin)


# scene, k, rtol, further settings of both hosts
CONTROLLED = [
    ("double_pendulum", 1, 1e-5, {}),
    ("double_pendulum", 2, 1e-7, {}),
    ("two_mass", 2, 1e-6, {}),
    ("four_bar", 2, 1e-5, {}),
    ("double_wishbone", 2, 1e-5, {"stop": 1.0, "interval": 0.05}),
]


def same_counts(cost, twin):
    """Steps, and calls of the kinds that a step is made of."""
    counts, (steps, calls) = twin.counts, (cost["steps"], cost["calls"])
    native_counts = [steps["accepted"], steps["rejected"], calls["do_step"], calls["save"], calls["restore"]]
    assert native_counts == [counts.get(kind, 0) for kind in ("steps", "rejected", "doStep", "save", "restore")]


def controlled(fmu, tmp_path, name, k, rtol, settings, *options):
    """cs-pece without H by both hosts, the bump of the wishbone's load with time events inside steps."""
    scene = library.scene(name, fmu)
    inner = ["--set", "*.solver.method=dopri5", "--set", "*.solver.rtol=1e-10"]
    inner += ["--set", f"*.solver.atol={scenes.atol_of(1e-10)}"]
    if name == "double_wishbone":
        scene.set("load", **BUMP)
        inner += [part for item in BUMP.items() for part in ("--set", "load.{}={}".format(*item))]
    atol = rtol / 10.0
    twin = scene.run(
        method="cs-pece", order=k, rtol=rtol, atol=atol, values=scenes.adaptive("dopri5", 1e-10), **settings
    )
    command = ["--method", "cs-pece", "--order", str(k), "--rtol", str(rtol), "--atol", str(atol)]
    command += [part for key, value in settings.items() for part in (f"--{key}", str(value))]
    result, cost = counted(tmp_path, name, *command, *inner, *options)
    same(result, twin)
    same_counts(cost, twin)
    return twin


@pytest.mark.parametrize("case", CONTROLLED, ids=lambda case: f"{case[0]}-{case[1]}")
def test_steps_that_follow_the_error_are_the_same(tmp_path, fmu, case):
    twin = controlled(fmu, tmp_path, *case)
    assert twin.counts["rejected"] > 0


@pytest.fixture
def no_event_mode(monkeypatch):
    """The twin does without Event Mode, as FMI 2.0 has to."""
    has = Fmu.capability
    monkeypatch.setattr(Fmu, "capability", lambda self, name: name != "hasEventMode" and has(self, name))


FMI2 = ["--fmus", "dist/fmi2"]


@pytest.mark.usefixtures("no_event_mode")
@pytest.mark.parametrize(
    ("name", "method", "order"),
    [
        ("double_pendulum", "cs-predict", 1),
        ("double_pendulum", "cs-pece", 2),
        ("four_bar", "cs-pece", 2),
        ("double_wishbone", "cs-pece", 1),
        ("absorber_on_oscillator", "cs-predict", 1),
    ],
)
def test_fmi2_answers_sweeps_by_its_linear_response(tmp_path, fmu, name, method, order):
    """FMI 2.0 archives in the program, FMI 3.0 ones without Event Mode in the twin; stepped as often as with Event Mode."""
    scene = library.scene(name, fmu)
    scene.configure(stop=min(scene.stop, 1.2))
    H = scene.interval / 2 if name != "double_wishbone" else 5e-3
    twin = scene.run(method=method, order=order, H=H, values=scenes.fixed("rk4", H))
    options = ["--method", method, "--order", str(order), "--H", str(H), "--stop", str(scene.stop)]
    inner = ["--set", "*.solver.method=rk4", "--set", f"*.solver.step={H}"]
    result, cost = counted(tmp_path, name, *FMI2, *options, *inner)
    same(result, twin)
    same_counts(cost, twin)
    assert cost["calls"]["derivatives"] > 0


@pytest.mark.usefixtures("no_event_mode")
def test_fmi2_follows_the_error(tmp_path, fmu):
    controlled(fmu, tmp_path, "double_pendulum", 2, 1e-6, {}, *FMI2)


# H d/m is 62 with 4 kg at the port, the other end nearly held: beyond the limits of every method but common
STIFF = {"damping[1]": 5e4, "mass[1]": 1e6}


@pytest.mark.parametrize(("method", "order"), [("cs-predict", 1), ("cs-pece", 1), ("jacobi", 1)])
def test_both_diverge_at_the_same_time_by_the_same_signal(tmp_path, fmu, method, order):
    scene = library.scene("two_mass", fmu)
    scene.set("follower", **STIFF)
    with pytest.raises(Diverged) as twin:
        scene.run(method=method, order=order, H=5e-3)
    stiff = [part for item in STIFF.items() for part in ("--set", "follower.{}={}".format(*item))]
    done = koppel("two_mass", "--method", method, "--order", str(order), "--H", "0.005", *stiff)
    assert done.returncode != 0
    cause = re.compile(r"diverged at t = [0-9.]+ s: \w+\.\S+ = ")
    assert cause.search(str(twin.value)), twin.value
    assert cause.search(str(twin.value))[0] in done.stderr, (done.stderr, str(twin.value))


def bushed(fmu, tmp_path):
    """The four-bar with a bushing of 1e8 N/m and 1e5 N s/m for its joint: rates of 1e5 1/s. The scene and its folder."""
    scene = library.scene("four_bar", fmu)
    scene.joints.clear()
    scene.add("bushing", "bushing", stiffness=1e8, damping=1e5)
    scene.connect("link2.B", "bushing.A")
    scene.connect("link3.B", "bushing.B")
    scene.reference = None
    return scene, scene.write(tmp_path / "bushed").parent


def implicit(scene, folder, tmp_path, integrator, settings, *options):
    """A run of method common by both hosts: the steps of the program's."""
    twin = scene.run(method="common", integrator=integrator, **settings)
    command = ["--integrator", integrator]
    command += [part for key, value in settings.items() for part in (f"--{key}", str(value))]
    result, cost = counted(tmp_path, folder, "--method", "common", *command, *options)
    same(result, twin)
    steps = cost["steps"]
    assert [steps["accepted"], steps["rejected"]] == [twin.counts["steps"], twin.counts["rejected"]]
    return steps


# looser or longer, rounding in the differences of the Jacobian shows: 1e-8 of it times what the Newton iteration leaves
@pytest.mark.parametrize(
    ("integrator", "settings"),
    [("rodas4", {"stop": 0.045, "rtol": 1e-6, "atol": 1e-8}), ("radau5", {"stop": 0.06, "rtol": 1e-8, "atol": 1e-10})],
    ids=["rodas4", "radau5"],
)
def test_implicit_integrators_are_the_same(tmp_path, fmu, integrator, settings):
    scene, folder = bushed(fmu, tmp_path)
    implicit(scene, folder, tmp_path, integrator, settings)


def test_implicit_integrators_on_a_stiff_bushing(tmp_path, fmu):
    """Rates of 1e5 1/s bind the explicit method to 280 000 evaluations at any tolerance; errors from 7e-6 to 6e-6."""
    _, folder = bushed(fmu, tmp_path)
    run = lambda *options: counted(tmp_path, folder, "--method", "common", "--stop", "0.45", "--integrator", *options)
    (_, _, exact), explicit = run("dopri5", "--rtol", "1e-8", "--atol", "1e-9")
    for integrator, rtol, times_less in (("radau5", "1e-5", 30), ("rodas4", "1e-4", 8)):
        (_, _, values), cost = run(integrator, "--rtol", rtol, "--atol", str(float(rtol) / 100.0))
        assert np.abs(values - exact).max() <= 2e-5
        assert times_less * cost["steps"]["rhs_evaluations"] <= explicit["steps"]["rhs_evaluations"]


def test_implicit_integrators_meet_time_events(tmp_path, fmu):
    scene = library.scene("double_wishbone", fmu)
    scene.set("load", **BUMP)
    bump = [part for item in BUMP.items() for part in ("--set", "load.{}={}".format(*item))]
    settings = {"stop": 0.5, "interval": 0.05, "rtol": 1e-6, "atol": 1e-8}
    steps = implicit(scene, "double_wishbone", tmp_path, "radau5", settings, *bump)
    assert steps["events"] == 2


def test_adaptive_runs_agree_to_their_tolerance(tmp_path, fmu):
    options = {"rtol": 1e-10, "atol": 1e-12}
    twin = library.scene("double_pendulum", fmu).run(method="common", integrator="dopri5", **options)
    names, _, values = native(tmp_path, "double_pendulum", "--rtol", "1e-10", "--atol", "1e-12")
    assert names == list(twin.names)
    assert np.abs(values - twin.values).max() <= 1e-6
