"""`rvdp_absorber` through the packed FMU against `tests/reference/absorber` (quad-precision solutions) and closed forms."""

import json

import numpy as np
import pytest
from koppel import Status, paths

FOLDER = paths.ROOT / "tests" / "reference" / "absorber"
INDEX = json.loads((FOLDER / "index.json").read_text())
OMEGA = 4.0 * np.pi
X = 0.06332573977646111


def table(name):
    """Time and columns of a reference."""
    lines = [line for line in (FOLDER / f"{name}.csv").read_text().splitlines() if not line.startswith("#")]
    rows = np.array([line.split(",") for line in lines[1:]], dtype=float)
    return rows[:, 0], dict(zip(lines[0].split(",")[1:], rows[:, 1:].T))


def parameters(name):
    """Start values of the absorber in a case."""
    return dict(INDEX[name]["fmu"]["rvdp_absorber"])


def solver(method, rtol, atol=None):
    return {"solver.method": method, "solver.rtol": rtol, "solver.atol": atol or min(rtol * 1e-3, 1e-12)}


def follow(fmu, name, settings, split=1):
    """Largest error of each column relative to its peak, and the run, at the samples of the reference or finer steps."""
    t, columns = table(name)
    result = fmu("rvdp_absorber").run(
        {**parameters(name), **settings}, H=(t[1] - t[0]) / split, stop=t[-1], outputs=list(columns)
    )
    return {
        column: np.abs(result[column][::split] - values).max() / np.abs(values).max()
        for column, values in columns.items()
    }, result


CORE = ["free_limit_cycle", "driven_paper", "n_far", "huge_start", "tiny_energy"]


@pytest.mark.parametrize("method", ["auto", "radau5", "dop853", "dopri5", "rodas4"])
@pytest.mark.parametrize("name", CORE)
def test_core_cases_follow_the_reference(fmu, name, method):
    """1e-4 at rtol 1e-6, 1e-7 at 1e-10 (at 1e-8 for rodas4, whose work grows with rtol^(-1/4))."""
    rough, _ = follow(fmu, name, solver(method, 1e-6))
    assert max(rough.values()) <= 1e-4, rough
    fine, _ = follow(fmu, name, solver(method, 1e-10))
    assert max(fine.values()) <= 1e-7, fine


def test_strong_control_is_solved_by_radau5(fmu):
    """g = 1e3: 1e-6 at rtol 1e-9 with fewer than 12000 evaluations (5979 by another implementation)."""
    error, result = follow(fmu, "driven_strong", solver("radau5", 1e-9))
    assert max(error.values()) <= 1e-6, error
    assert result.counts["solver.rhs_evaluations"] < 12000, result.counts
    assert result.counts["solver.jacobians"] > 0


@pytest.mark.parametrize("name", ["unstable_trace", "unstable_det"])
def test_unstable_designs_leave_the_harmonic_motion(fmu, name):
    """1e-5, and the check at the start says so."""
    error, _ = follow(fmu, name, solver("auto", 1e-11))
    assert max(error.values()) <= 1e-5, error
    with fmu("rvdp_absorber").instantiate() as absorber:
        absorber.initialise({**parameters(name), "use.stability_check": True})
        names = ["stability.predicted", "stability.trace", "stability.determinant", "stability.multiplier"]
        predicted, trace, determinant, multiplier = absorber.get(names)
    assert predicted == 0.0 and multiplier > 1.0
    assert min(trace, determinant) < 0.0
