#!/usr/bin/env python3
"""Reference solutions of the benchmark scenes, independent of the product: tests/reference/coupling/<scene>.csv.

python tests/oracle/coupling.py

two_mass: a linear system, by its matrix exponential. double_pendulum: Lagrange's equations in the two angles. four_bar:
the three rods with Lagrange multipliers, integrated in the one angle that is free, the others from the closed triangle.
Angles phi count from hanging, the files hold theta = phi - pi/2.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import expm

FOLDER = Path(__file__).resolve().parents[1] / "reference" / "coupling"
GRAVITY = 9.81
SAMPLES = 200
TOLERANCE = 1e-13


# two masses ---------------------------------------------------------------------------------------------------------
def two_mass_matrix(root_mass: float) -> np.ndarray:
    """x' = A x with x = (s1, v1, s2, v2): m1 with ground spring 10 and damper 0.1 carries the root mass; spring 100 and
    damper 0.5 to m2, with ground spring 10 and damper 0.1."""
    M = np.diag([1.0 + root_mass, 1.0])
    K = np.array([[10.0 + 100.0, -100.0], [-100.0, 100.0 + 10.0]])
    C = np.array([[0.1 + 0.5, -0.5], [-0.5, 0.5 + 0.1]])
    first_order = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
    order = [0, 2, 1, 3]
    return first_order[np.ix_(order, order)]


def two_mass(t: np.ndarray, root_mass: float = 3.0) -> np.ndarray:
    """s1, v1, s2, v2 from s1 = 1 at rest."""
    A = two_mass_matrix(root_mass)
    return np.array([expm(A * at) @ [1.0, 0.0, 0.0, 0.0] for at in t])


# double pendulum ----------------------------------------------------------------------------------------------------
def lagrangian(_t, y):
    """Uniform rods of 1 kg and 1 m, angles from hanging:

    T = 2/3 w1^2 + 1/6 w2^2 + 1/2 w1 w2 cos(phi1 - phi2),  V = -3/2 g cos(phi1) - 1/2 g cos(phi2)
    """
    phi1, w1, phi2, w2 = y
    c, s = np.cos(phi1 - phi2), np.sin(phi1 - phi2)
    mass = np.array([[4.0 / 3.0, 0.5 * c], [0.5 * c, 1.0 / 3.0]])
    force = [-0.5 * s * w2 * w2 - 1.5 * GRAVITY * np.sin(phi1), 0.5 * s * w1 * w1 - 0.5 * GRAVITY * np.sin(phi2)]
    a1, a2 = np.linalg.solve(mass, force)
    return [w1, a1, w2, a2]


def double_pendulum(t: np.ndarray) -> np.ndarray:
    """phi1, w1, phi2, w2 from level rest."""
    level = 0.5 * np.pi
    return _solved(lagrangian, [level, 0.0, level, 0.0], t)


# four-bar -----------------------------------------------------------------------------------------------------------
#: Masses and lengths; ground points (0, 0) and (2, 0).
MASS, LENGTH, BASE = np.array([1.0, 2.0, 1.5]), np.array([1.0, 2.0, 1.5]), 2.0
START = (1.0, 2.854723658638, -2.735431992820)


def _along(phi):
    return np.array([np.sin(phi), -np.cos(phi)])


def _across(phi):
    return np.array([np.cos(phi), np.sin(phi)])


def four_bar_rates(_t, y):
    """phi1..3 and w1..3; multipliers hold the tips of rods 2 and 3 together."""
    phi, w = y[:3], y[3:]
    a, n = [_along(p) for p in phi], [_across(p) for p in phi]
    m, L = MASS, LENGTH
    couple = 0.5 * m[1] * L[0] * L[1]
    mass = np.diag([m[0] * L[0] ** 2 / 3 + m[1] * L[0] ** 2, m[1] * L[1] ** 2 / 3, m[2] * L[2] ** 2 / 3])
    mass[0, 1] = mass[1, 0] = couple * np.cos(phi[0] - phi[1])
    s = np.sin(phi[0] - phi[1])
    weight = GRAVITY * np.array([0.5 * m[0] * L[0] + m[1] * L[0], 0.5 * m[1] * L[1], 0.5 * m[2] * L[2]])
    force = np.array([-couple * s * w[1] ** 2, couple * s * w[0] ** 2, 0.0]) - weight * np.sin(phi)
    # G = d(tip 2 - tip 3)/d(phi), and what centripetal acceleration adds to its second derivative
    G = np.column_stack([L[0] * n[0], L[1] * n[1], -L[2] * n[2]])
    bend = -(L[0] * w[0] ** 2 * a[0] + L[1] * w[1] ** 2 * a[1] - L[2] * w[2] ** 2 * a[2])
    system = np.block([[mass, -G.T], [G, np.zeros((2, 2))]])
    return np.concatenate([w, np.linalg.solve(system, np.concatenate([force, -bend]))[:3]])


def closed(y):
    """The state moved onto the closed loop, phi1 and w1 kept."""
    phi, w = y[:3].copy(), y[3:].copy()
    for _ in range(6):
        gap = LENGTH[0] * _along(phi[0]) + LENGTH[1] * _along(phi[1]) - [BASE, 0.0] - LENGTH[2] * _along(phi[2])
        G = np.column_stack([LENGTH[1] * _across(phi[1]), -LENGTH[2] * _across(phi[2])])
        phi[1:] -= np.linalg.solve(G, gap)
    G = np.column_stack([LENGTH[1] * _across(phi[1]), -LENGTH[2] * _across(phi[2])])
    w[1:] = np.linalg.solve(G, -LENGTH[0] * _across(phi[0]) * w[0])
    return np.concatenate([phi, w])


def four_bar(t: np.ndarray) -> np.ndarray:
    """phi1, w1, phi2, w2, phi3, w3 from rest; the loop is closed afresh at every sample."""
    y = closed(np.array([*START, 0.0, 0.0, 0.0]))
    rows = [y]
    for a, b in zip(t, t[1:]):
        y = closed(_solved(four_bar_rates, y, np.array([a, b]))[-1])
        rows.append(y)
    return np.array(rows)[:, [0, 3, 1, 4, 2, 5]]


def _solved(rates, start, t):
    return solve_ivp(rates, (t[0], t[-1]), start, "DOP853", t, rtol=TOLERANCE, atol=TOLERANCE).y.T


def times(stop: float) -> np.ndarray:
    """Equidistant samples."""
    return stop * np.arange(SAMPLES + 1) / SAMPLES


# files --------------------------------------------------------------------------------------------------------------
def _states(*names: str) -> list[str]:
    return [f"{name}.{state}.theta" for name in names for state in ("angle", "angle_rate")]


#: Scene: columns, end, solution, whether even columns are angles from hanging, and what the case is.
CASES: dict[str, tuple[list[str], float, Callable, bool, str]] = {
    "two_mass": (
        ["leader.s[1]", "leader.v[1]", "follower.s[1]", "follower.v[1]"],
        2.0,
        two_mass,
        False,
        "root mass 3 kg; matrix exponential",
    ),
    "double_pendulum": (
        _states("upper", "lower"),
        2.0,
        double_pendulum,
        True,
        "two uniform rods of 1 kg and 1 m from level rest; Lagrange's equations, DOP853, rtol 1e-13",
    ),
    "four_bar": (
        _states("link1", "link2", "link3"),
        3.0,
        four_bar,
        True,
        "rods of 1, 2, 1.5 m with 1, 2, 1.5 kg, ground points 2 m apart, from rest; DOP853, rtol 1e-13",
    ),
}


def main():
    """Write all files."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    for name, (columns, stop, solution, angles, note) in CASES.items():
        t = times(stop)
        values = solution(t)
        if angles:
            values[:, 0::2] -= 0.5 * np.pi
        with (FOLDER / f"{name}.csv").open("w", encoding="ascii") as file:
            file.write(
                "# source: tests/oracle/coupling.py, written separately from the product's code and formulation\n"
            )
            file.write(f"# case: {note}; gravity {GRAVITY} in -z where there is any\n")
            file.write("# columns: by the scene's variables, SI units, angles in rad\n")
            file.write(",".join(["t", *columns]) + "\n")
            file.writelines(",".join(f"{v:.15g}" for v in row) + "\n" for row in np.column_stack([t, values]))
        print(f"{name}: {len(t)} rows, ends at {values[-1]}")


if __name__ == "__main__":
    main()
