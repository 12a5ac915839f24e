"""Acceptance: the double wishbone against references that share no code with it.

Limits are the accepted ones of the specification; the value a separate program reached with the same method is in brackets.
"""

import numpy as np
import pytest
from koppel import Reference, scenes
from koppel.work_precision import energy_balance, fitted_order
from oracle.wishbone import Wishbone

THETA = "lower.angle.theta"
PAPER = "wishbone_paper"


def simulate(fmu, reference, start_values, H=0.05, stop=None):
    """Run over the reference's interval, recording everything it has."""
    outputs = [name for name in reference.names if name in fmu.variables] + ["loop.gap", "loop.gap_rate"]
    missing = [name for name in reference.names if name not in fmu.variables]
    assert not missing, f"no variable for {missing}"
    return fmu.run(start_values, H=H, stop=stop or reference.t[-1], outputs=outputs)


def theta_error(fmu, reference, start_values, **options):
    """Largest error of theta1 [rad]."""
    return reference.error_of(simulate(fmu, reference, start_values, **options))[THETA].largest


# method, step, limit of theta1 [rad]
PAPER_ROWS = [
    ("rk4", 0.002, 2e-10),  # (5.7e-11)
    ("rk4", 0.01, 5e-8),  # (3.6e-8)
    ("heun", 0.01, 5e-5),  # (4.0e-5)
    ("heun", 0.05, 1.0e-3),  # (8.7e-4)
]


@pytest.mark.parametrize(("method", "step", "limit"), PAPER_ROWS)
def test_paper_scene(wishbone, method, step, limit):
    reference = Reference.named(PAPER)
    error = reference.error_of(simulate(wishbone, reference, scenes.fixed(method, step)))
    assert error.samples == 201
    assert error[THETA].largest <= limit, error.table()


@pytest.mark.parametrize(("method", "step", "limit"), PAPER_ROWS)
def test_tiny_upper_link_is_as_accurate(wishbone, method, step, limit):
    """Upper link 1e4 times lighter than the carrier, inertia about its axis 1e-6 kg m2: same limits."""
    reference = Reference.named("oracle_tiny")
    error = reference.error_of(simulate(wishbone, reference, {**scenes.TINY, **scenes.fixed(method, step)}))
    assert error[THETA].largest <= limit, error.table()
    if (method, step) == ("rk4", 0.002):
        assert error.worst("force").largest <= 1e-6, error.table()


def test_paper_scene_joint_forces(wishbone):
    """(1.3e-7 N)"""
    reference = Reference.named(PAPER)
    error = reference.error_of(simulate(wishbone, reference, scenes.fixed("rk4", 0.002)))
    assert {signal.name for signal in error.of("force")} == {f"{p}.F.{i}" for p in "ABCD" for i in "xz"}
    assert error.worst("force").largest <= 1e-6, error.table()


def test_paper_scene_energy_balance(wishbone):
    """(3e-9)"""
    result = simulate(wishbone, Reference.named(PAPER), scenes.fixed("rk4", 0.002))
    assert energy_balance(result) <= 1e-8


def test_paper_scene_energies(wishbone):
    """Each energy, not only their balance. Angles and rates are within 2e-10 rad of 7.7e-3 rad, 2.6e-8; energies are
    quadratic in them: twice that of the 1.13 J that are supplied."""
    reference = Reference.named(PAPER)
    error = reference.error_of(simulate(wishbone, reference, scenes.fixed("rk4", 0.002)))
    assert error.worst("energy").largest <= 2.0 * 2.6e-8 * reference["energy.supplied"].max(), error.table()


@pytest.mark.parametrize(("method", "order"), [("heun", 2.0), ("rk4", 4.0)])
def test_observed_order_is_the_promised_one(wishbone, method, order):
    reference = Reference.named(PAPER)
    steps = (0.01, 0.005, 0.002)
    errors = [theta_error(wishbone, reference, scenes.fixed(method, step)) for step in steps]
    assert fitted_order([1.0 / step for step in steps], errors) == pytest.approx(order, abs=0.15), errors


def test_defaults_are_the_paper_scene(wishbone):
    """Nothing set: RK4 with 1e-3 s, 16 times more accurate than with 2e-3 s (5.7e-11 / 16 = 3.6e-12)."""
    assert theta_error(wishbone, Reference.named(PAPER), {}) <= 2e-10 / 16.0


def test_dormand_prince_error_follows_its_tolerance(wishbone):
    """Each tolerance ten times smaller makes the error smaller, and none exceeds its tolerance times the amplitude by 10."""
    reference = Reference.named(PAPER)
    tolerances = (1e-6, 1e-7, 1e-8, 1e-9, 1e-10)
    errors = [theta_error(wishbone, reference, scenes.adaptive("dopri5", rtol)) for rtol in tolerances]
    assert all(later < earlier for earlier, later in zip(errors, errors[1:])), errors
    assert all(error < 10.0 * rtol * reference.amplitude(THETA) for error, rtol in zip(errors, tolerances)), errors


def test_road_scene(wishbone):
    """Half-sine bump of 0.08 s: its ends are time events inside the FMU (7e-11 rad)."""
    reference = Reference.named("wishbone_road")
    result = simulate(wishbone, reference, {**scenes.ROAD, **scenes.adaptive("dopri5", 1e-9)}, H=0.01)
    error = reference.error_of(result)
    assert error.samples == 301
    assert error[THETA].largest <= 1e-9, error.table()
    assert error.worst("force").largest <= 1e-5, error.table()


def test_road_scene_with_kinks_inside_communication_steps(wishbone):
    """H = 0.3 s hides both ends of the pulse inside steps (0.3 to 0.6); the FMU stops at them by itself."""
    reference = Reference.named("wishbone_road")
    result = simulate(wishbone, reference, {**scenes.ROAD, **scenes.adaptive("dopri5", 1e-9)}, H=0.3)
    error = reference.error_of(result)
    assert error[THETA].largest <= 1e-9, error.table()
    assert error.worst("force").largest <= 1e-5, error.table()


def test_road_scene_with_given_preload(wishbone):
    """The balancing preload of the reference, given instead of computed: rest before the bump."""
    reference = Reference.named("wishbone_road")
    values = {
        **scenes.ROAD,
        "strut.preload_mode": "given",
        "strut.preload": reference.parameters["parameters"]["spring_preload"],
    }
    error = reference.error_of(simulate(wishbone, reference, {**values, **scenes.adaptive("dopri5", 1e-9)}, H=0.01))
    assert error[THETA].largest <= 1e-9, error.table()


def test_gravity_drop_conserves_energy_and_follows_the_oracle(wishbone):
    """c = 0 (energy 2e-8 at h = 0.0025); theta1 swings by 0.27 rad, 35 times the paper's amplitude."""
    reference = Reference.named("oracle_drop")
    steps = (0.0025, 0.00125, 0.000625)
    results = [simulate(wishbone, reference, {**scenes.DROP, **scenes.fixed("rk4", step)}) for step in steps]
    assert energy_balance(results[0]) <= 1e-7
    errors = [reference.error_of(result)[THETA].largest for result in results]
    assert fitted_order([1.0 / step for step in steps], errors) == pytest.approx(4.0, abs=0.15), errors


def test_start_away_from_the_design_position(wishbone):
    """start.override: -0.08 rad from the design and 0.5 rad/s, no load. RK4 1e-3 s; ten times the paper's amplitude."""
    reference = Reference.named("oracle_start")
    start = {
        "start.override": True,
        "lower.angle.theta": reference[THETA][0],
        "lower.angle_rate.theta": 0.5,
        "force.amplitude.z": 0.0,
    }
    error = reference.error_of(simulate(wishbone, reference, {**start, **scenes.fixed("rk4", 1e-3)}))
    assert error[THETA].largest <= 2e-10, error.table()
    assert error.worst("force").largest <= 1e-5, error.table()


def test_spatial_scene(wishbone):
    """Revolute arms, quaternion carrier, tie rod, three-axis force."""
    reference = Reference.named("wishbone_spatial")
    error = reference.error_of(
        simulate(wishbone, reference, {**scenes.SPATIAL, **scenes.adaptive("dopri5", 1e-10)}, H=0.01)
    )
    assert error.samples == 101
    assert error.worst("position").largest <= 1e-8, error.table()
    assert error.worst("force").largest <= 1e-4, error.table()


# stiffness, damping, step inside RK4's stability limit (2.5e-4 s and 1.7e-5 s)
BUSHINGS = [("1e8", 1e8, 1e4, 5e-5), ("2.2e10", 2.2e10, 2e5, 5e-6)]


@pytest.mark.parametrize(("name", "k", "c", "step"), BUSHINGS)
def test_bushing_with_small_explicit_steps(wishbone, name, k, c, step):
    """theta1 a hundred times below the limit for implicit methods: small steps resolve the fast modes too."""
    reference = Reference.named(f"oracle_bushing_{name}")
    result = simulate(wishbone, reference, {**scenes.bushing(k, c), **scenes.fixed("rk4", step)}, H=0.01)
    error = reference.error_of(result)
    assert error[THETA].largest <= 2e-8, error.table()
    # the force at D is k times the deflection there: 1e-4 of its 420 N
    assert error["D.F.x"].largest <= 0.04, error.table()


# stiffness, damping, distance of theta1 from the rigid joint over 1 s [rad] as published
STIFF_BUSHINGS = [("1e8", 1e8, 1e4, 2.35e-5), ("2.2e10", 2.2e10, 2e5, 1.07e-7)]


@pytest.mark.parametrize(("name", "k", "c", "distance"), STIFF_BUSHINGS)
def test_bushing_with_radau5(wishbone, name, k, c, distance):
    """rtol 1e-7: theta1 within 2e-6 rad in at most 5000 steps, near the rigid joint as far as it should be."""
    reference = Reference.named(f"oracle_bushing_{name}")
    tolerance = scenes.adaptive("radau5", 1e-7)
    result = simulate(wishbone, reference, {**scenes.bushing(k, c), **tolerance}, H=0.01)
    error = reference.error_of(result)
    assert error[THETA].largest <= min(2e-6, 0.2 * distance), error.table()
    assert result.counts["solver.steps"] <= 500, result.counts  # (256, 425)
    rigid = wishbone.run({**scenes.LOAD200, **tolerance}, H=0.01, stop=1.0, outputs=[THETA])
    assert np.abs(result[THETA] - rigid[THETA]).max() == pytest.approx(distance, rel=0.15)


@pytest.mark.parametrize(("name", "k", "c", "rtol"), [("1e8", 1e8, 1e4, 1e-7), ("2.2e10", 2.2e10, 2e5, 1e-5)])
def test_bushing_with_rodas4(wishbone, name, k, c, rtol):
    """theta1 within 2e-6 rad in at most 5000 steps (4790; 3896).

    A Rosenbrock method loses order on stiff springs between masses: at 2.2e10 N/m rtol 1e-7 would take 32500 steps, for an
    error of 9e-11 rad; radau5 is the method for them.
    """
    reference = Reference.named(f"oracle_bushing_{name}")
    result = simulate(wishbone, reference, {**scenes.bushing(k, c), **scenes.adaptive("rodas4", rtol)}, H=0.01)
    error = reference.error_of(result)
    assert error[THETA].largest <= 2e-6, error.table()
    assert result.counts["solver.steps"] <= 5000, result.counts


# Largest error of theta1 [rad], loop gap [m], gap rate [m/s] over 10 s; a separate program's values.
# A projected gap is rounding: a few 1e-16 of lengths below 1 m.
ROUNDING = 1e-15
STABILISATION = [
    ("heun", 0.05, "none", 8.7e-4, 1.3e-4, 2.6e-5),
    ("heun", 0.05, "baumgarte", 8.7e-4, 3.8e-7, 2.4e-5),
    ("heun", 0.05, "projection", 8.7e-4, ROUNDING, ROUNDING),
    ("heun", 0.01, "none", 4.0e-5, 3.7e-7, 6e-8),
    ("heun", 0.01, "baumgarte", 4.0e-5, 2.5e-8, 4e-7),
    ("heun", 0.01, "projection", 4.0e-5, ROUNDING, ROUNDING),
    ("heun", 0.002, "none", 1.6e-6, 2.2e-9, None),
    ("heun", 0.002, "baumgarte", 1.6e-6, 1.0e-9, None),
    ("heun", 0.002, "projection", 1.6e-6, ROUNDING, ROUNDING),
    ("rk4", 0.05, "none", 3.0e-5, 2.2e-5, None),
    ("rk4", 0.05, "baumgarte", 2.35e-5, 9e-8, None),
    ("rk4", 0.05, "projection", 2.35e-5, ROUNDING, ROUNDING),
    ("rk4", 0.01, "none", 4.8e-8, 3.9e-8, None),
    ("rk4", 0.01, "baumgarte", 3.6e-8, 9e-11, None),
    ("rk4", 0.01, "projection", 3.6e-8, ROUNDING, ROUNDING),
    ("rk4", 0.002, "none", 7.5e-11, 6e-11, None),
    ("rk4", 0.002, "baumgarte", 5.6e-11, 1e-13, None),
    ("rk4", 0.002, "projection", 5.7e-11, ROUNDING, ROUNDING),
]


@pytest.mark.parametrize(("method", "step", "kind", "angle", "gap", "gap_rate"), STABILISATION)
def test_stabilisation(wishbone, method, step, kind, angle, gap, gap_rate):
    """Within a factor 1.5 of the separate program: above would be worse, far below would be another method."""
    reference = Reference.named(PAPER)
    result = simulate(wishbone, reference, {"stabilisation.kind": kind, **scenes.fixed(method, step)})
    measured = reference.error_of(result)[THETA].largest
    assert angle / 1.5 <= measured <= angle * 1.5
    assert np.abs(result["loop.gap"]).max() <= gap * 1.5
    if gap_rate is not None:
        assert np.abs(result["loop.gap_rate"]).max() <= gap_rate * 1.5


def test_gap_is_reported_not_invented(wishbone):
    """Without stabilisation the gap is the one the positions show: C from the carrier against C from the upper link."""
    result = wishbone.run(
        {"stabilisation.kind": "none", **scenes.fixed("heun", 0.05)},
        H=0.05,
        stop=10.0,
        outputs=["loop.gap", "lower.angle.theta", "carrier.angle.psi", "upper.angle.theta"],
    )
    theta1, psi, theta3 = (result[name] for name in ("lower.angle.theta", "carrier.angle.psi", "upper.angle.theta"))
    L1, L3, BC = np.hypot(0.40, -0.02), np.hypot(0.28, 0.02), np.array([-0.04, 0.29])
    x = L1 * np.cos(theta1) + BC[0] * np.cos(psi) - BC[1] * np.sin(psi) - 0.08 - L3 * np.cos(theta3)
    z = L1 * np.sin(theta1) + BC[0] * np.sin(psi) + BC[1] * np.cos(psi) - 0.25 - L3 * np.sin(theta3)
    assert np.abs(np.hypot(x, z) - result["loop.gap"]).max() <= 1e-15


@pytest.mark.parametrize(("m", "stop"), [(1.0, 0.5), (25.0, 0.5), (1e3, 0.1)])
def test_point_mass_on_the_port_is_a_point_mass_in_the_carrier(wishbone, m, stop):
    """P.M = m 1 with P.F = m g against the same mass merged into the carrier (centre, inertia about it by Steiner).

    1000 kg fall through the spring: after 0.2 s the links are nearly stretched and rounding grows, so it ends before.
    """
    g = scenes.GRAVITY
    G, P, mass, inertia = np.array([0.48, 0.12]), np.array([0.50, 0.12]), 25.0, 0.8
    merged = (mass * G + m * P) / (mass + m)
    around = inertia + mass * ((G - merged) @ (G - merged)) + m * ((P - merged) @ (P - merged))
    common = {"gravity.z": g, "force.amplitude.z": 0.0, **scenes.fixed("rk4", 1e-3)}
    port = {"P.M.xx": m, "P.M.yy": m, "P.M.zz": m, "P.F.z": m * g}
    carrier = {"carrier.mass": mass + m, "design.G.x": merged[0], "design.G.z": merged[1], "carrier.inertia.yy": around}
    outputs = ["P.a.x", "P.a.z", "B.a.x", "B.a.z", "C.a.x", "C.a.z", "A.F.x", "A.F.z", "D.F.x", "D.F.z", THETA]
    one = wishbone.run({**common, **port}, H=0.05, stop=stop, outputs=outputs)
    two = wishbone.run({**common, **carrier}, H=0.05, stop=stop, outputs=outputs)
    for kind in ("a", "F"):
        of = [name for name in outputs if f".{kind}." in name]
        scale = max(np.abs(two[name]).max() for name in of)
        assert max(np.abs(one[name] - two[name]).max() for name in of) <= 1e-10 * scale
    assert np.abs(one[THETA] - two[THETA]).max() <= 1e-10


def test_chassis_acceleration_acts_like_gravity(wishbone):
    """A chassis accelerated by -g feels g: motion relative to it and all forces agree to rounding."""
    outputs = [THETA, "lower.angle_rate.theta", "carrier.angle.psi", "P.r.z", "P.a.x", "P.a.z"]
    outputs += [f"{p}.F.{i}" for p in "ABCD" for i in "xz"]
    accelerated = wishbone.run({"chassis.a.x": 3.0, "chassis.a.z": 9.80665}, H=0.05, stop=2.0, outputs=outputs)
    heavy = wishbone.run({"gravity.x": -3.0, "gravity.z": -9.80665}, H=0.05, stop=2.0, outputs=outputs)
    still = wishbone.run({}, H=0.05, stop=2.0, outputs=outputs)
    assert np.abs(heavy[THETA] - still[THETA]).max() > 1e-2
    for name in outputs:
        scale = max(1.0, np.abs(heavy[name]).max())
        assert np.abs(accelerated[name] - heavy[name]).max() <= 1e-11 * scale, name


def test_held_force_input_equals_the_internal_offset(wishbone):
    outputs = [THETA, "P.r.z", "A.F.x", "D.F.z", "energy.supplied"]
    held = wishbone.run(
        {"force.amplitude.z": 0.0},
        H=0.05,
        stop=2.0,
        outputs=outputs,
        inputs=(["P.F.x", "P.F.z", "P.slot[2].F.z"], lambda t: (-20.0, 30.0, 20.0)),
    )
    start = {"P.F.x": -20.0, "P.F.z": 30.0, "P.slot[2].F.z": 20.0, "force.kind": "input"}
    slots = wishbone.run(start, H=0.05, stop=2.0, outputs=outputs)
    internal = wishbone.run(
        {"force.amplitude.z": 0.0, "force.offset.x": -20.0, "force.offset.z": 50.0}, H=0.05, stop=2.0, outputs=outputs
    )
    assert np.abs(internal[THETA] - internal[THETA][0]).max() > 1e-3
    for name in outputs:
        scale = max(1.0, np.abs(internal[name]).max())
        assert np.abs(slots[name] - internal[name]).max() <= 1e-12 * scale, name
        # the held inputs of the first run arrive with the first step, its sample at t = 0 is unloaded
        assert np.abs(held[name][1:] - internal[name][1:]).max() <= 1e-12 * scale, name


@pytest.mark.parametrize("closure", ["rigid", "bushing"])
def test_start_away_from_the_design_closes_the_loop(wishbone, closure):
    """All angles and rates follow from the lower link's, whatever holds the link at D."""
    model = Wishbone(start_angle=0.15, start_rate=-1.2)
    angle = model.angles([0.15, -1.2])
    rate = model.rates([0.15, -1.2], angle)
    with wishbone.instantiate() as instance:
        instance.set(
            {"start.override": True, "lower.angle.theta": model.theta1_0 + 0.15, "lower.angle_rate.theta": -1.2}
        )
        instance.set({"closure.kind": closure})
        instance.enter_initialisation()
        assert abs(instance.get("loop.gap")) <= 1e-13
        expected = {
            THETA: model.theta1_0 + angle[0],
            "carrier.angle.psi": angle[1],
            "upper.angle.theta": model.theta3_0 + angle[2],
            "lower.angle_rate.theta": rate[0],
            "carrier.angle_rate.psi": rate[1],
            "upper.angle_rate.theta": rate[2],
        }
        for name, value in expected.items():
            assert abs(instance.get(name) - value) <= 1e-12, name
