"""The oracle against the stored references, and its own files against the oracle."""

import numpy as np
import pytest
from koppel import Reference
from oracle.cases import CASES
from oracle.wishbone import Wishbone, vec

# The stored references carry 15 digits: 1e-15 of angles and positions, 1e-12 N of a 1e3 N force. Both programs integrate
# at the limit of double precision (rtol 3e-14); over 10 s that leaves 1e-12 for rates and accelerations.
LIMITS = {"rad": 1e-12, "rad/s": 1e-11, "m": 1e-13, "N": 1e-9, "J": 1e-10}
PAPER = Wishbone()
ROAD = Wishbone(
    gravity=vec(0.0, -9.80665),
    preload=6851.546241433017,
    offset=vec(0.0, 3500.0),
    amplitude=vec(0.0, 0.0),
    pulse=vec(-300.0, 800.0),
    pulse_start=0.5,
    pulse_duration=0.08,
)


def compare(table, reference, stiffness=0.0):
    """Largest difference per column, with the limit for its unit.

    `stiffness` of a bushing [N/m]: its force is the difference of two positions of 1 m, and processors that add in
    another order differ in the last bit of these."""
    from koppel.reference import COLUMNS, kind_of

    limits = {**LIMITS, "N": max(LIMITS["N"], stiffness * np.finfo(float).eps)}

    for i, column in enumerate(Wishbone.COLUMNS):
        if column in ("t", "theta1_ddot"):
            continue
        _, unit = kind_of(COLUMNS.get(column, column))
        difference = np.abs(table[:, i] - reference.values[: len(table), i]).max()
        assert difference < limits[unit], f"{column}: {difference:.2e} {unit}, limit {limits[unit]:.0e}"


@pytest.mark.parametrize(("name", "model"), [("wishbone_paper", PAPER), ("wishbone_road", ROAD)])
def test_oracle_reproduces_the_stored_reference(name, model):
    reference = Reference.named(name)
    assert reference.columns == Wishbone.COLUMNS
    compare(model.table(reference.t), reference)


@pytest.mark.parametrize("name", CASES)
def test_stored_oracle_files_come_from_the_oracle(name):
    reference = Reference.named(f"oracle_{name}")
    case = CASES[name]
    assert np.array_equal(reference.t, case.times())
    rows = 2 if case.model.bushing else 12
    compare(case.table(rows), reference, case.model.bushing[0] if case.model.bushing else 0.0)


@pytest.mark.parametrize("name", CASES)
def test_oracle_files_satisfy_the_energy_law(name):
    """kinetic + potential - start = supplied - dissipated, at the accuracy of the integration."""
    reference = Reference.named(f"oracle_{name}")
    kinetic, potential, supplied, dissipated = (
        reference[f"energy.{part}"] for part in ("kinetic", "potential", "supplied", "dissipated")
    )
    stored = kinetic + potential
    scale = max(np.abs(kinetic).max(), np.abs(potential - potential[0]).max(), np.abs(supplied).max())
    assert np.abs(stored - stored[0] - supplied + dissipated).max() < 1e-10 * scale


@pytest.mark.parametrize(("name", "distance"), [("1e8", 2.35e-5), ("2.2e10", 1.07e-7)])
def test_bushing_moves_theta_by_the_published_distance(name, distance):
    """Largest distance to the rigid joint over 1 s as given with the case, to its three digits."""
    theta = "lower.angle.theta"
    measured = np.abs(Reference.named(f"oracle_bushing_{name}")[theta] - Reference.named("oracle_load200")[theta]).max()
    assert measured == pytest.approx(distance, rel=5e-3)
