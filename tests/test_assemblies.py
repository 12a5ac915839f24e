"""Assemblies of links against references that share no code with them, and what joints must have in common.

Limits are the accepted ones of the specification; the value a separate program reached with the same method is in brackets.
"""

import numpy as np
import pytest
from koppel import Reference, scenes
from koppel.fmu import grid
from koppel.work_precision import ENERGIES, energy_balance, fitted_order
from scipy.integrate import solve_ivp

AXES = ("x", "y", "z")
PAIRS = ("xx", "xy", "xz", "yy", "yz", "zz")
GRAVITY = 9.80665


def simulate(fmu, reference, start_values):
    """Run over the reference's interval, recording everything it has."""
    missing = [name for name in reference.names if name not in fmu.variables]
    assert not missing, f"no variable for {missing}"
    outputs = reference.names + [name for name in ("loop.gap", "loop.gap_rate") if name in fmu.variables]
    return fmu.run(start_values, H=0.02, stop=reference.t[-1], outputs=outputs)


# double pendulum ----------------------------------------------------------------------------------------------------
def pendulum_error(fmu, setting):
    reference = Reference.named("double_pendulum")
    return reference.error_of(simulate(fmu("double_pendulum"), reference, {"gravity.z": -9.81, **setting}))


def test_double_pendulum(fmu):
    """(2.4e-11 rad). Forces m w^2 L with w below 10 rad/s: 2 m L w dw with dw = 1e-8 rad/s."""
    error = pendulum_error(fmu, scenes.fixed("rk4", 1e-3))
    assert error.samples == 151
    assert error.worst("angle").largest <= 1e-9, error.table()
    assert error.worst("position").largest <= 2e-9, error.table()
    assert error.worst("force").largest <= 2e-7, error.table()
    assert {s.name for s in error.of("force")} == {f"{p}.F.{i}" for p in "AB" for i in "xz"}


@pytest.mark.parametrize(("method", "order"), [("heun", 2.0), ("rk4", 4.0)])
def test_double_pendulum_converges_with_the_order_of_its_method(fmu, method, order):
    steps = (4e-3, 2e-3, 1e-3)
    errors = [pendulum_error(fmu, scenes.fixed(method, h)).worst("angle").largest for h in steps]
    assert fitted_order([1.0 / h for h in steps], errors) == pytest.approx(order, abs=0.15), errors


def test_chaotic_pendulum_keeps_its_energy(fmu):
    """Both rods nearly upright: they turn over again and again, and the path itself is lost to rounding."""
    start = {"upper.angle.theta": 1.5, "lower.angle.theta": 1.7, **scenes.adaptive("dopri5", 1e-10)}
    turning = "lower.angle.theta"
    result = fmu("double_pendulum").run(start, H=0.05, stop=10.0, outputs=[*ENERGIES, turning])
    assert np.ptp(result[turning]) > 2.0 * np.pi
    assert energy_balance(result) <= 1e-8


# four-bar -----------------------------------------------------------------------------------------------------------
def four_bar_run(fmu, setting):
    """The run and its errors."""
    reference = Reference.named("four_bar")
    start = reference.parameters["parameters"]
    x, z = np.subtract(start["C0"], start["B0"])
    # the file has the coupler's angle from its start
    reference.values[:, reference.variables["coupler.angle.theta"]] += np.arctan2(z, x)
    result = simulate(fmu("four_bar"), reference, setting)
    return result, reference.error_of(result)


def test_four_bar_with_fixed_steps(fmu):
    """(1.0e-6 rad; over 5 s the crank turns by 55 rad)"""
    result, error = four_bar_run(fmu, scenes.fixed("rk4", 1e-3))
    assert error.samples == 251
    assert np.ptp(result["crank.angle.theta"]) > 50.0
    assert error.worst("angle").largest <= 3e-6, error.table()
    assert {s.name for s in error.of("force")} == {f"{p}.F.{i}" for p in "ABCD" for i in "xz"}
    # forces follow the angles with m L w^2 per rad, below 200 N, and their rates
    assert error.worst("force").largest <= 1e-3, error.table()
    assert np.abs(result["loop.gap"]).max() <= 1e-15
    assert energy_balance(result) <= 1e-7


def test_four_bar_with_adaptive_steps(fmu):
    result, error = four_bar_run(fmu, scenes.adaptive("dopri5", 1e-10))
    assert error.worst("angle").largest <= 1e-6, error.table()
    assert np.abs(result["loop.gap"]).max() <= 1e-15


@pytest.mark.parametrize(("kind", "expected"), [("projection", 1.0e-6), ("none", 3.3e-5), ("baumgarte", 4.7e-6)])
def test_stabilisation_of_the_four_bar(fmu, kind, expected):
    """Within a factor 1.5 of a separate program: above would be worse, far below would be another method."""
    _, error = four_bar_run(fmu, {"stabilisation.kind": kind, **scenes.fixed("rk4", 1e-3)})
    assert expected / 1.5 <= error.worst("angle").largest <= expected * 1.5, error.table()


# point mass on a port -----------------------------------------------------------------------------------------------
@pytest.mark.parametrize("m", [1.0, 25.0, 1e3])
def test_point_mass_on_the_port_is_a_point_mass_in_the_spatial_carrier(wishbone, m):
    """P.M = m 1 with P.F = m g against the same mass merged into the carrier: mass, centre, and the inertia about it by
    the parallel-axis theorem. Nothing in one plane; from rest, where both start alike, and after 0.1 s of motion without
    stabilisation, where the tolerance of the integration comes in. (In the plane: test_accuracy.)"""
    G, P, mass = np.array([0.48, 0.02, 0.12]), np.array([0.50, -0.05, 0.12]), 25.0
    I = np.array([[1.2, 0.1, 0.0], [0.1, 0.8, 0.0], [0.0, 0.0, 0.8]])
    merged = (mass * G + m * P) / (mass + m)
    steiner = lambda m, r: m * ((r @ r) * np.eye(3) - np.outer(r, r))
    around = I + steiner(mass, G - merged) + steiner(m, P - merged)
    skew = {"design.B.y": 0.03, "design.C.y": -0.02, "design.P.y": P[1]}
    scene = {**scenes.SPATIAL, **skew, "strut.preload_mode": "given", "strut.preload": 300.0, "force.kind": "input"}
    scene |= {"stabilisation.kind": "none", **scenes.adaptive("dopri5", 1e-12)}
    carrier = lambda mass, G, I: (
        {"carrier.mass": mass}
        | {f"design.G.{i}": G[k] for k, i in enumerate(AXES)}
        | {f"carrier.inertia.{ij}": I[AXES.index(ij[0]), AXES.index(ij[1])] for ij in PAIRS}
    )
    load = {f"P.M.{ii}": m for ii in ("xx", "yy", "zz")} | {"P.F.z": -m * GRAVITY}
    names = [f"{p}.a.{i}" for p in "PBC" for i in AXES] + [f"{p}.F.{i}" for p in "ABCD" for i in AXES]
    one, two = (
        wishbone.run({**scene, **values}, H=0.01, stop=0.1, outputs=names)
        for values in ({**carrier(mass, G, I), **load}, carrier(mass + m, merged, around))
    )
    for part in (slice(0, 9), slice(9, None)):
        error, size = np.abs(one.values - two.values)[:, part], np.abs(two.values[:, part]).max()
        assert error[0].max() <= 1e-10 * size
        assert error.max() <= 1e-9 * size
    assert np.abs(two.values[:, 1:9:3]).max() > 1e-2, "nothing moves across the plane"


# rods in space ------------------------------------------------------------------------------------------------------
ROD = {"mass": 2.0, "length": 0.5, "inertia.xx": 2e-3}
#: Inertia of that rod about its end.
J_END = 2.0 * 0.5**2 / 3.0
TIP = [f"B.r.{i}" for i in AXES]
ANGLES = ["angle.theta", "angle.phi", "angle_rate.theta", "angle_rate.phi"]


def rod(fmu, start, stop, outputs, method="dopri5", rtol=1e-10, H=0.01):
    """A rod on a fixed joint under gravity."""
    return fmu("link2").run({**ROD, **start, **scenes.adaptive(method, rtol)}, H=H, stop=stop, outputs=outputs)


POLE = {
    "joint.kind": "universal",
    "angle.theta": np.deg2rad(80.0),
    "angle_rate.theta": 2.0,
    "angle_rate.phi": 0.5,
}


def momentum_about_z(theta, phi_rate):
    """p_phi of a universal rod: its inertia about z times the rate."""
    return (ROD["inertia.xx"] * np.sin(theta) ** 2 + J_END * np.cos(theta) ** 2) * phi_rate


def test_universal_rod_passes_the_vertical(fmu):
    """Over the top and round: theta reaches 7.19 rad. Values at t = 1 s to the digits given; p_phi and energy stay."""
    result = rod(fmu, POLE, 1.0, [*ANGLES, *ENERGIES])
    assert result["angle.theta"][-1] == pytest.approx(7.18810648, abs=1e-8)
    assert result["angle.phi"][-1] == pytest.approx(0.31133178, abs=1e-8)
    p = momentum_about_z(result["angle.theta"], result["angle_rate.phi"])
    assert np.abs(p / p[0] - 1.0).max() <= 1e-8
    assert energy_balance(result) <= 1e-9


def test_universal_rod_follows_its_equations_through_the_vertical(fmu):
    """(13), (14) integrated here, for a rod under gravity."""
    Jx, Jz = ROD["inertia.xx"], J_END

    def rates(_t, y):
        theta, phi, theta_dot, phi_dot = y
        st, ct = np.sin(theta), np.cos(theta)
        weight = ROD["mass"] * GRAVITY * 0.5 * ROD["length"]  # tau_y = weight cos(theta), tau_x = tau_z = 0
        phi_ddot = 2.0 * (Jz - Jx) * st * ct * theta_dot * phi_dot / (Jx * st * st + Jz * ct * ct)
        theta_ddot = (-weight * ct + (Jx - Jz) * st * ct * phi_dot * phi_dot) / Jz
        return [theta_dot, phi_dot, theta_ddot, phi_ddot]

    result = rod(fmu, POLE, 2.0, ANGLES)
    start = [POLE["angle.theta"], 0.0, 2.0, 0.5]
    exact = solve_ivp(rates, (0.0, 2.0), start, "DOP853", result.t, rtol=1e-12, atol=1e-13).y.T
    assert np.abs(result.values[:, :2] - exact[:, :2]).max() <= 1e-8


def direction(phi, theta):
    return np.array([np.cos(theta) * np.cos(phi), np.cos(theta) * np.sin(phi), np.sin(theta)])


def turning(phi, theta, phi_dot, theta_dot):
    """Angular velocity across the rod for these rates (2), without spin."""
    omega = np.array([theta_dot * np.sin(phi), -theta_dot * np.cos(phi), phi_dot])
    d = direction(phi, theta)
    return omega - (omega @ d) * d


def spherical_rod(phi, theta, phi_dot, theta_dot):
    start = dict(zip([f"direction.{i}" for i in AXES], direction(phi, theta)))
    return (
        start
        | dict(zip([f"omega.{i}" for i in AXES], turning(phi, theta, phi_dot, theta_dot)))
        | {"joint.kind": "spherical_rod"}
    )


def spherical(phi, theta, phi_dot, theta_dot):
    (sp, cp), (st, ct) = ((np.sin(0.5 * a), np.cos(0.5 * a)) for a in (phi, theta))
    # about z by phi, then about -y by theta
    q = [cp * ct, sp * st, -cp * st, sp * ct]
    start = {f"orientation.q[{i + 1}]": q[i] for i in range(4)}
    return (
        start
        | dict(zip([f"omega.{i}" for i in AXES], turning(phi, theta, phi_dot, theta_dot)))
        | {"joint.kind": "spherical"}
    )


@pytest.mark.parametrize("Ixx", [1e-5, 2e-3, 2e-2])
def test_rod_without_spin_is_a_rigid_body_on_a_ball_joint(fmu, Ixx):
    """Released 1e-3 rad off the upright, it swings through the lowest point and back: to the tolerance of the
    integration for any inertia about its axis."""
    at = (0.4, 0.5 * np.pi - 1e-3, 0.3, -0.5)
    runs = [
        rod(fmu, {**start, "inertia.xx": Ixx}, 2.0, [*TIP, *ENERGIES], rtol=1e-11)
        for start in (spherical_rod(*at), spherical(*at))
    ]
    assert np.ptp(runs[0]["B.r.z"]) > 0.9
    assert max(np.abs(runs[0][name] - runs[1][name]).max() for name in TIP) <= 1e-8
    assert all(energy_balance(run) <= 1e-9 for run in runs)


def test_rod_without_spin_is_the_limit_of_the_universal_one(fmu):
    """Universal joint with inertia about the axis going to zero: the difference goes with it, ten times per decade."""
    at = (0.2, 0.3, 2.0, 1.0)
    free = rod(fmu, spherical_rod(*at), 1.0, TIP, rtol=1e-11)
    names = ("angle.phi", "angle.theta", "angle_rate.phi", "angle_rate.theta")
    start = {"joint.kind": "universal"} | dict(zip(names, at))
    differences = []
    for Ixx in (1e-4, 1e-5, 1e-6, 1e-10):
        bound = rod(fmu, {**start, "inertia.xx": Ixx}, 1.0, TIP, rtol=1e-11)
        differences.append(np.abs(bound.values - free.values).max())
    *large, small = differences
    assert fitted_order([1.0 / Ixx for Ixx in (1e-4, 1e-5, 1e-6)], large) == pytest.approx(1.0, abs=0.05), large
    assert small <= 1e-8


def test_ball_joint_keeps_the_momentum_about_the_vertical(fmu):
    """Gravity has no moment about z: L_z of a spinning rod stays."""
    start = {"joint.kind": "spherical", "omega.x": 5.0, "omega.y": -1.0, "omega.z": 3.0}
    names = [f"orientation.q[{i}]" for i in (1, 2, 3, 4)] + [f"omega.{i}" for i in AXES]
    result = rod(fmu, start, 2.0, [*names, *ENERGIES], rtol=1e-11)
    w, x, y, z = (result[name] for name in names[:4])
    d = np.array([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)])
    omega = result.values[:, 4:7].T
    L_z = J_END * omega[2] + (ROD["inertia.xx"] - J_END) * d[2] * (d * omega).sum(axis=0)
    assert np.abs(L_z / L_z[0] - 1.0).max() <= 1e-9
    assert np.abs(w * w + x * x + y * y + z * z - 1.0).max() <= 1e-14
    assert energy_balance(result) <= 1e-9


def test_plane_and_hinged_rods_move_alike(fmu):
    """joint.kind planar, revolute and universal are the same motion in the plane x-z."""
    start = {"angle.theta": 0.4, "angle_rate.theta": -3.0}
    runs = [
        rod(fmu, {**start, "joint.kind": kind}, 1.0, [*TIP, "A.F.x", "A.F.z"])
        for kind in ("planar", "revolute", "universal")
    ]
    for other in runs[1:]:
        assert np.abs(other.values - runs[0].values).max() <= 1e-10 * np.abs(runs[0].values).max()
