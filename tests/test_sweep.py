"""Coupled elements through fmpy: the double pendulum of two `link2` by the three-pass sweep.

Both rods 1 kg, 1 m, uniform, horizontal at rest; gravity 9.81. The reference is integrated here from a Lagrangian in the
angles, with no part of the product; measured values of a separate program in brackets.
"""

from contextlib import ExitStack
from functools import cache

import numpy as np
import pytest
from koppel import scenes
from koppel.fmu import grid
from koppel.sweep import Node, Tree, run_cs, run_common
from koppel.work_precision import fitted_order
from scipy.integrate import solve_ivp

STOP, SAMPLES = 2.0, 20
GRAVITY = 9.81
# angles from hanging: phi = theta + pi/2
END = {"phi1": -0.08275830682, "w1": -0.96114544454, "phi2": 0.40736207491, "w2": 11.89895505304}
STATES = ("angle.theta", "angle_rate.theta")


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


@cache
def reference():
    """phi1, w1, phi2, w2 at the samples."""
    horizontal = 0.5 * np.pi
    times = np.linspace(0.0, STOP, SAMPLES + 1)
    solved = solve_ivp(
        lagrangian, (0.0, STOP), [horizontal, 0.0, horizontal, 0.0], "DOP853", times, rtol=1e-12, atol=1e-12
    )
    return solved.y.T


def test_reference_ends_at_the_published_values():
    assert np.abs(reference()[-1] - list(END.values())).max() <= 1e-10


def pendulum(link, H, method, stop=STOP, **options):
    """The pendulum's states at the samples until `stop`, as phi1, w1, phi2, w2."""
    every = round(STOP / SAMPLES / H)
    rod = {"mass": 1.0, "length": 1.0, "angle.theta": 0.0, "gravity.z": -GRAVITY, **scenes.fixed("rk4", H)}
    samples = []
    with ExitStack() as stack:
        make = link.equations if method is run_common else lambda: link.instantiate(event_mode=True)
        rods = [stack.enter_context(make()) for _ in range(2)]
        for one in rods:
            one.set(rod)
        rods[1].set({"A.r.x": 1.0})
        states = [one.block(STATES) for one in rods]
        tree = Tree([Node(rods[0], "A"), Node(rods[1], "A", leader=0, port="B")])
        method(
            tree, grid(0.0, stop, H), lambda _: samples.append(np.concatenate([s.read() for s in states])), **options
        )
    samples = np.array(samples)[::every]
    samples[:, 0::2] += 0.5 * np.pi
    return samples


def error(link, H, **how):
    """Largest error of all states over the samples."""
    samples = pendulum(link, H, **how)
    return np.abs(samples - reference()[: len(samples)]).max()


@pytest.fixture(scope="module")
def link(fmu):
    return fmu("link2")


PREDICT = {"method": run_cs, "correct": False}
PECE = {"method": run_cs, "correct": True}
COMMON = {"method": run_common}

ROWS = {
    "common rk4": (COMMON, 5e-3, 3e-6),  # (1.8e-6)
    "cs predict order 1": ({**PREDICT, "order": 1}, 1.25e-3, 3e-3),  # (1.9e-3)
    "cs pece k = 1": ({**PECE, "order": 1}, 5e-3, 1e-3),  # (5.9e-4)
    "cs pece k = 2": ({**PECE, "order": 2}, 5e-3, 5e-5),  # (2.9e-5)
}


@pytest.mark.parametrize("row", ROWS)
def test_double_pendulum(link, row):
    how, H, limit = ROWS[row]
    assert error(link, H, **how) <= limit


def test_common_rk4_ends_at_the_published_values(link):
    """Its error at t = 2 is of the size of its largest."""
    end = pendulum(link, 5e-3, run_common)[-1]
    assert np.abs(end - list(END.values())).max() <= 3e-6


ORDERS = {
    "common rk4": (COMMON, 4.0, (20e-3, 10e-3, 5e-3)),
    "cs predict order 0": ({**PREDICT, "order": 0}, 1.0, (5e-3, 2.5e-3, 1.25e-3)),
    "cs predict order 1": ({**PREDICT, "order": 1}, 2.0, (5e-3, 2.5e-3, 1.25e-3)),
    "cs predict order 2": ({**PREDICT, "order": 2}, 3.0, (5e-3, 2.5e-3, 1.25e-3)),
    "cs pece k = 1": ({**PECE, "order": 1}, 3.0, (10e-3, 5e-3, 2.5e-3)),
    "cs pece k = 2": ({**PECE, "order": 2}, 4.0, (10e-3, 5e-3, 2.5e-3)),
}


@pytest.mark.parametrize("row", ORDERS)
def test_order_is_the_promised_one(link, row):
    """Slope of the error over two halvings of H, in the first second: later the leading terms of the error change sign
    and pass zero, so that slopes of single halvings run from 3.3 to 5.6 for order 4."""
    how, order, steps = ORDERS[row]
    errors = [error(link, H, stop=1.0, **how) for H in steps]
    assert fitted_order([1.0 / H for H in steps], errors) == pytest.approx(order, abs=0.2), errors
