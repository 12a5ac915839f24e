"""The program `koppel` against the Python twin, which shares no code with it: the same scene files, methods and steps.

Both run the same FMUs, so differences are those of the hosts: rounding of other orders of summation, amplified by the motion.
"""

import csv
import subprocess

import numpy as np
import pytest
from koppel import library, paths, scenes

KOPPEL = paths.ROOT / "dist" / "bin" / "koppel"
AGREEMENT = 1e-9


def native(tmp_path, name, *options):
    """Recorded values of a run by the program: names, times, values."""
    if not KOPPEL.is_file():
        pytest.fail(f"{KOPPEL} is missing: run scripts/build")
    output = tmp_path / "result.csv"
    command = [KOPPEL, "simulate", paths.ROOT / "scenes" / name, "--output", output, *options]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=paths.ROOT, timeout=120)
    assert done.returncode == 0, done.stderr
    with output.open(encoding="utf-8", newline="") as file:
        header, *rows = csv.reader(file)
    values = np.array(rows, dtype=float)
    return header[1:], values[:, 0], values[:, 1:]


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


def test_adaptive_runs_agree_to_their_tolerance(tmp_path, fmu):
    options = {"rtol": 1e-10, "atol": 1e-12}
    twin = library.scene("double_pendulum", fmu).run(method="common", integrator="dopri5", **options)
    names, _, values = native(tmp_path, "double_pendulum", "--rtol", "1e-10", "--atol", "1e-12")
    assert names == list(twin.names)
    assert np.abs(values - twin.values).max() <= 1e-6
