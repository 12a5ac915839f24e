"""Small parts (`load`, `guide`, `bushing`) and `primary_oscillator`, each against equations written here."""

import closed_forms
import numpy as np
import pytest
from koppel import Status, scenes

AXES = "xyz"
TENSOR = ("xx", "xy", "xz", "yy", "yz", "zz")
TIGHT = scenes.adaptive("dop853", 1e-11)


def vector(name):
    return [f"{name}.{axis}" for axis in AXES]


def tensor(name):
    return [f"{name}.{part}" for part in TENSOR]


def matrix(six):
    xx, xy, xz, yy, yz, zz = six
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def values(names, numbers):
    return dict(zip(names, np.asarray(numbers, float).tolist()))


def definite(random, scale):
    """A random symmetric positive definite matrix as matrix and six components."""
    half = random.normal(size=(3, 3))
    M = scale * (half @ half.T + np.eye(3))
    return M, [M[i, j] for i, j in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))]


# load ---------------------------------------------------------------------------------------------------------------
LOAD = {
    **values(vector("force.offset"), [1.0, -2.0, 3.0]),
    **values(vector("force.amplitude"), [4.0, 5.0, 6.0]),
    **values(vector("force.omega"), [7.0, 8.0, 9.0]),
    **values(vector("force.phase"), [0.1, 0.2, 0.3]),
    **values(vector("force.pulse.amplitude"), [100.0, -50.0, 25.0]),
    "force.pulse.start": 0.301,
    "force.pulse.duration": 0.25,
}


def force(t):
    """The law of `LOAD` at t."""
    i = np.arange(3)
    F = np.array([1.0, -2.0, 3.0]) + (4.0 + i) * np.sin((7.0 + i) * t + 0.1 * (1 + i))
    inside = 0.301 <= t <= 0.301 + 0.25
    return F + np.array([100.0, -50.0, 25.0]) * (np.sin(np.pi * (t - 0.301) / 0.25) if inside else 0.0)


def test_load_follows_its_law_and_counts_its_work(fmu):
    """A.F = A.F0 = F(t), no inertia; work at constant velocity by a fine Simpson rule over each smooth part."""
    v = np.array([0.5, -0.25, 2.0])
    outputs = [*vector("A.F"), *vector("A.F0"), *tensor("A.M"), "energy.supplied", "energy.port"]
    start = {**LOAD, **values(vector("A.v"), v), **TIGHT}
    result = fmu("load").run(start, H=0.02, stop=1.0, outputs=outputs)
    F = np.array([force(t) for t in result.t])
    assert np.abs(result.values[:, 0:3] - F).max() <= 1e-12 * 100.0
    assert np.array_equal(result.values[:, 0:3], result.values[:, 3:6])
    assert not result.values[:, 6:12].any()
    work = 0.0
    for a, b in ((0.0, 0.301), (0.301, 0.551), (0.551, 1.0)):
        t = np.linspace(a, b, 2001)
        power = np.array([force(at) @ v for at in t])
        weights = np.tile([2.0, 4.0], 1000)
        work += (b - a) / 6000.0 * (weights @ power[:-1] + power[-1] - power[0])
    assert result["energy.supplied"][-1] == pytest.approx(work, rel=1e-9)
    assert np.array_equal(result["energy.port"], -result["energy.supplied"])


def test_load_without_energy_counts_nothing(fmu):
    result = fmu("load").run({**LOAD, "A.v.x": 1.0, "use.energy": False}, H=0.1, stop=1.0, outputs=["energy.supplied"])
    assert not result.values.any()


# bushing ------------------------------------------------------------------------------------------------------------
def test_bushing_is_a_spring_and_damper_between_its_leaders(fmu):
    random = np.random.default_rng(1)
    k, c = 2e5, 300.0
    r_A, r_B, v_A, v_B = random.normal(size=(4, 3))
    with fmu("bushing").instantiate() as instance:
        motion = zip((r_A, r_B, v_A, v_B), ("A.r", "B.r", "A.v", "B.v"))
        instance.set(
            {"stiffness": k, "damping": c, **{n: x for at, name in motion for n, x in values(vector(name), at).items()}}
        )
        instance.enter_initialisation()
        got = instance.get_all([n for port in "AB" for of in ("F", "F0") for n in vector(f"{port}.{of}")])
        inertia = instance.get_all([*tensor("A.M"), *tensor("B.M")])
        potential = instance.get("energy.potential")
    F = -k * (r_A - r_B) - c * (v_A - v_B)
    for name, expected in (("A.F", F), ("A.F0", F), ("B.F", -F), ("B.F0", -F)):
        assert [got[n] for n in vector(name)] == pytest.approx(expected.tolist(), rel=1e-14)
    assert not any(inertia.values())
    assert potential == pytest.approx(0.5 * k * (r_A - r_B) @ (r_A - r_B), rel=1e-14)


def test_bushing_keeps_the_energy_law(fmu):
    """A moves away with 0.1 m/s: stored + heat = work, each in closed form."""
    k, c, v, stop = 1e4, 50.0, 0.1, 1.0
    outputs = ["energy.potential", "energy.dissipated", "energy.supplied", "energy.port"]
    result = fmu("bushing").run({"stiffness": k, "damping": c, "A.v.x": v, **TIGHT}, H=0.05, stop=stop, outputs=outputs)
    stored, heat = 0.5 * k * (v * stop) ** 2, c * v * v * stop
    assert result.values[-1] == pytest.approx([stored, heat, stored + heat, stored + heat], rel=1e-12)


# guide --------------------------------------------------------------------------------------------------------------
def test_guide_moves_as_prescribed_and_reports_what_it_carries(fmu):
    """Minimum jerk from 0.2 by 0.3 m in 0.5 s from 0.25 s on, a sine, rest; load F - M a of both slots."""
    random = np.random.default_rng(2)
    M, six = definite(random, 2.0)
    F, F_2 = random.normal(size=(2, 3))
    start = {
        "kind.x": "min_jerk", "kind.y": "sine", "kind.z": "rest", "kind.s": "sine",
        "start.x": 0.2, "end.x": 0.5, "t0.x": 0.25, "duration.x": 0.5, "start.z": -1.0,
        "amplitude.y": 0.3, "omega.y": 5.0, "phase.y": 0.4, "start.s": 0.1, "amplitude.s": 0.02, "omega.s": 7.0,
        **values(vector("P.F"), F), **values(vector("P.slot[2].F"), F_2), **values(tensor("P.M"), six),
        "H.F": 4.0, "H.M": 3.0, **TIGHT,
    }  # fmt: skip
    names = [*vector("P.r"), *vector("P.v"), *vector("P.a"), *vector("P.load"), "H.s", "H.v", "H.a", "H.load"]
    result = fmu("guide").run(start, H=0.05, stop=1.0, outputs=[*names, "energy.supplied", "energy.port"])
    t = result.t
    tau = np.clip((t - 0.25) / 0.5, 0.0, 1.0)
    r = np.column_stack([0.2 + 0.3 * (10 * tau**3 - 15 * tau**4 + 6 * tau**5), 0.3 * np.sin(5 * t + 0.4), 0 * t - 1.0])
    v = np.column_stack([0.6 * 30 * (tau**2 - 2 * tau**3 + tau**4), 1.5 * np.cos(5 * t + 0.4), 0 * t])
    a = np.column_stack([1.2 * 60 * (tau - 3 * tau**2 + 2 * tau**3), -7.5 * np.sin(5 * t + 0.4), 0 * t])
    load = F + F_2 - a @ M
    H = [0.1 + 0.02 * np.sin(7 * t), 0.14 * np.cos(7 * t), -0.98 * np.sin(7 * t)]
    exact = np.column_stack([r, v, a, load, *H, 4.0 - 3.0 * H[2]])
    assert np.abs(result.values[:, : exact.shape[1]] - exact).max() <= 1e-12 * np.abs(exact).max()
    # work on followers without inertia would be -(F . dr); with M it loses what M gains in kinetic energy
    gained = 0.5 * np.einsum("ti,ij,tj->t", v, M, v) + 1.5 * H[1] ** 2
    done = -((r - r[0]) @ (F + F_2)) - 4.0 * (H[0] - H[0][0]) + gained - gained[0]
    assert np.abs(result["energy.supplied"] - done).max() <= 1e-9 * np.abs(done).max()
    assert np.array_equal(result["energy.port"], -result["energy.supplied"])


# primary oscillator -------------------------------------------------------------------------------------------------
class Oscillator:
    """Lagrange's equations in (r_A, s_1, s_2) at a random state: no ports, one mass matrix."""

    def __init__(self, seed, spatial, dof, port, base=True):
        random = np.random.default_rng(seed)
        e = random.normal(size=3)
        K, C, M = random.uniform(10.0, 100.0, 2), random.uniform(1.0, 5.0, 2), random.uniform(1.0, 4.0, 2)
        M_r, drive = random.uniform(0.5, 2.0), random.normal()
        g = random.normal(size=3) if spatial and base else np.zeros(3)
        K_g, C_g = (0.0, 1.5) if spatial else (7.0, 1.5)
        s, v = random.normal(size=(2, 2))
        r_0, r_A, v_A, a_A, F, F_2 = random.normal(size=(6, 3))
        slots, six = definite(random, 1.0)
        slots_2, six_2 = definite(random, 1.0)
        self.spatial, self.dof, self.base = spatial, dof, base
        self.start = {
            "port.kind": "spatial" if spatial else "scalar", "dof": dof, "port.mass": port, "drive.mass": dof,
            "mass[1]": M[0], "mass[2]": M[1], "stiffness[1]": K[0], "stiffness[2]": K[1],
            "damping[1]": C[0], "damping[2]": C[1], "s[1].start": s[0], "s[2].start": s[1],
            "v[1].start": v[0], "v[2].start": v[1], "ground.stiffness": K_g, "ground.damping": C_g,
            "use.base": base, "root.mass": M_r, "drive.amplitude": 0.0,
            **values(vector("direction"), e), **values(vector("gravity"), g),
        }  # fmt: skip
        e /= np.linalg.norm(e)
        if spatial:
            #: A.r stands at r_0 when initialisation ends.
            self.first = values(vector("A.r"), r_0)
            self.inputs = {
                **values(vector("A.r"), r_A), **values(vector("A.v"), v_A), **values(vector("A.a"), a_A),
                **values(vector("P.F"), F), **values(vector("P.slot[2].F"), F_2),
                **values(tensor("P.M"), six), **values(tensor("P.slot[2].M"), six_2), "drive.force": drive,
            }  # fmt: skip
        else:
            # one coordinate: along x
            e, r_0 = np.eye(3)[0], np.zeros(3)
            r_A, v_A, a_A, F, F_2 = (np.array([x[0], 0.0, 0.0]) for x in (r_A, v_A, a_A, F, F_2))
            slots, slots_2 = (np.diag([m[0, 0], 0.0, 0.0]) for m in (slots, slots_2))
            self.first = {}
            self.inputs = {
                "A.s": r_A[0], "A.v": v_A[0], "A.a": a_A[0], "P.F": F[0], "P.slot[2].F": F_2[0],
                "P.M": slots[0, 0], "P.slot[2].M": slots_2[0, 0], "drive.force": drive,
            }  # fmt: skip
        if not base:
            r_A = v_A = a_A = r_0 = np.zeros(3)
        # velocities of base and masses are J (v_A, s_1', s_2')
        E = np.eye(3) - np.outer(e, e)
        J_A = np.hstack([np.eye(3), np.zeros((3, 2))])
        J = [np.hstack([E, np.outer(e, np.eye(2)[i])]) for i in range(2)]
        J_P = J[port - 1]
        self.masses = range(dof)
        whole = M_r * J_A.T @ J_A + sum(M[i] * J[i].T @ J[i] for i in self.masses) + J_P.T @ (slots + slots_2) @ J_P
        total = M_r + sum(M[i] for i in self.masses)
        Q = J_P.T @ (F + F_2)
        Q[:3] += total * g
        s_A = e @ (r_A - r_0)
        self.stretch = [s[0] - s_A, s[1] - s[0] if dof == 2 else 0.0]
        rate = [v[0] - e @ v_A, v[1] - v[0] if dof == 2 else 0.0]
        T = [K[i] * self.stretch[i] + C[i] * rate[i] for i in range(2)]
        Q[:3] += T[0] * e
        Q[3] += T[1] - T[0] - K_g * s[0] - C_g * v[0]
        Q[4] -= T[1]
        Q[2 + dof] += drive
        free = slice(3, 3 + dof)
        inverse = np.linalg.inv(whole[free, free])
        self.s_ddot = inverse @ (Q[free] - whole[free, :3] @ a_A)
        self.A_M = whole[:3, :3] - whole[:3, free] @ inverse @ whole[free, :3]
        self.A_F0 = Q[:3] - whole[:3, free] @ inverse @ Q[free]
        self.A_F = Q[:3] - whole[:3, :3] @ a_A - whole[:3, free] @ self.s_ddot
        z = np.concatenate([v_A, v])
        self.kinetic = 0.5 * M_r * v_A @ v_A + 0.5 * sum(M[i] * np.sum((J[i] @ z) ** 2) for i in self.masses)
        self.potential = (
            0.5 * sum(K[i] * self.stretch[i] ** 2 for i in range(2)) + 0.5 * K_g * s[0] ** 2 - total * g @ r_A
        )
        self.P_v, self.P_a = J_P @ z, J_P[:, :3] @ a_A + e * self.s_ddot[port - 1]
        self.P_r = r_A + (s[port - 1] - s_A) * e
        self.e = e

    def expected(self):
        """By the FMU's names."""
        derivatives = {f"der(v[{i + 1}])": a for i, a in enumerate(self.s_ddot)}
        common = {"energy.kinetic": self.kinetic, "energy.potential": self.potential, **derivatives}
        if self.spatial:
            of = {"P.r": self.P_r, "P.v": self.P_v, "P.a": self.P_a}
            if self.base:
                of |= {"A.F0": self.A_F0, "A.F": self.A_F}
                common |= values(
                    tensor("A.M"), [self.A_M[i, j] for i, j in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))]
                )
            return common | {n: x for name, three in of.items() for n, x in values(vector(name), three).items()}
        along = {"P.v": self.P_v[0], "P.a": self.P_a[0]}
        if self.base:
            # one coordinate: the across part of the masses does not exist
            along |= {"A.F0": self.A_F0[0], "A.F": self.A_F[0], "A.M": self.A_M[0, 0]}
        return common | along


CASES = [
    (spatial, dof, port, base)
    for spatial in (False, True)
    for dof, port in ((1, 1), (2, 1), (2, 2))
    for base in (True, False)
]


@pytest.mark.parametrize(("spatial", "dof", "port", "base"), CASES)
@pytest.mark.parametrize("seed", range(3))
def test_oscillator_obeys_lagrange(fmu, seed, spatial, dof, port, base):
    """(27), (28): accelerations, force on the base, effective inertia and energies, relative 1e-12."""
    case = Oscillator(seed, spatial, dof, port, base)
    expected = case.expected()
    with fmu("primary_oscillator").instantiate(event_mode=True) as instance:
        instance.set({**case.start, **case.first})
        instance.initialise({})
        instance.enter_event_mode()
        instance.set(case.inputs)
        actual = instance.get_all(list(expected))
    for name, value in expected.items():
        scale = max(abs(x) for other, x in expected.items() if other.split(".")[:2] == name.split(".")[:2])
        assert actual[name] == pytest.approx(value, rel=1e-12, abs=1e-12 * max(scale, 1.0)), name


def test_oscillator_rings_as_the_closed_form_says(fmu):
    """Free vibration of one mass: amplitude, frequency and decay; energy law along the way."""
    m, k, c, s_0 = 100.0, 15791.367041742973, 25.132741228718345, 0.01
    omega, zeta = np.sqrt(k / m), c / (2.0 * np.sqrt(k * m))
    damped = omega * np.sqrt(1.0 - zeta**2)
    energies = [f"energy.{part}" for part in ("kinetic", "potential", "dissipated", "supplied")]
    start = {"drive.amplitude": 0.0, "s[1].start": s_0, **TIGHT}
    result = fmu("primary_oscillator").run(start, H=0.05, stop=5.0, outputs=["s[1]", *energies])
    t = result.t
    exact = s_0 * np.exp(-zeta * omega * t) * (np.cos(damped * t) + zeta * omega / damped * np.sin(damped * t))
    assert np.abs(result["s[1]"] - exact).max() <= 1e-9 * s_0
    kinetic, potential, dissipated, supplied = result.values[:, 1:].T
    assert np.abs(kinetic + potential + dissipated - supplied - potential[0]).max() <= 1e-9 * potential[0]


def test_oscillator_at_resonance_has_the_amplitude_of_the_closed_form(fmu):
    """50 N at 2 Hz, 1 %: F/(c omega) after the start has died out, and the work of the drive is the heat."""
    start = {"drive.amplitude": 50.0, **scenes.adaptive("dop853", 1e-10)}
    outputs = ["s[1]", "drive.omega", "energy.supplied", "energy.dissipated", "energy.kinetic", "energy.potential"]
    result = fmu("primary_oscillator").run(start, H=0.01, stop=120.0, outputs=outputs)
    last = result["s[1]"][-50:]
    assert np.abs(last).max() == pytest.approx(50.0 / (25.132741228718345 * 4.0 * np.pi), rel=1e-5)
    assert result["drive.omega"][-1] == pytest.approx(4.0 * np.pi, rel=1e-15)
    balance = (
        result["energy.kinetic"] + result["energy.potential"] + result["energy.dissipated"] - result["energy.supplied"]
    )
    assert np.abs(balance).max() <= 1e-8 * result["energy.supplied"][-1]


@pytest.mark.parametrize(("H", "step"), [(0.01, 1e-3), (0.01, 1.0), (1.0, 1.0), (10.0, 50.0)])
def test_exact_steps_of_the_oscillator_have_no_error(fmu, H, step):
    """The default method, at any step: closed form to rounding, work of the drive = heat + stored energy."""
    outputs = ["s[1]", "v[1]", *(f"energy.{part}" for part in ("kinetic", "potential", "dissipated", "supplied"))]
    result = fmu("primary_oscillator").run({"solver.step": step}, H=H, stop=50.0, outputs=outputs)
    s, v = closed_forms.resonance(result.t)
    X = closed_forms.X
    assert np.abs(result["s[1]"] - s).max() <= 2e-12 * X
    assert np.abs(result["v[1]"] - v).max() <= 2e-12 * X * 4.0 * np.pi
    kinetic, potential, dissipated, supplied = result.values[:, 2:].T
    assert np.abs(kinetic + potential + dissipated - supplied).max() <= 1e-10 * supplied[-1]


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("spatial", [False, True])
def test_exact_steps_follow_moving_inputs(fmu, spatial, order):
    """Two masses on a base that shakes, with load and inertia at the port: as dop853 at 1e-13 under the same inputs."""
    names = {"A.r.z": 1.0, "A.v.z": 0.0, "A.a.z": 0.0, "P.F.z": 0.0, "P.M.zz": 7.0} if spatial else {
        "A.s": 1.0, "A.v": 0.0, "A.a": 0.0, "P.F": 0.0, "P.M": 7.0
    }  # fmt: skip
    base = {"dof": 2, "use.base": True, "root.mass": 3.0, "port.kind": 2 if spatial else 1, "port.order": order, **names}
    position, velocity, acceleration, force, _ = names
    ends = {}
    for method, extra in ((7, {}), (4, {"solver.rtol": 1e-13, "solver.atol": 1e-15})):
        with fmu("primary_oscillator").instantiate() as instance:
            instance.initialise({**base, "solver.method": method, "solver.step": 0.02, **extra})
            for i in range(100):
                t = 0.02 * i
                shake = {
                    position: 1.0 + 0.1 * np.sin(3.0 * t),
                    velocity: 0.3 * np.cos(3.0 * t),
                    acceleration: -0.9 * np.sin(3.0 * t),
                }
                instance.set({**shake, force: 20.0 * np.cos(5.0 * t)})
                instance.step(t, 0.02)
            ends[method] = instance.get_all(
                ["s[1]", "v[1]", "s[2]", "v[2]", "energy.dissipated", "energy.supplied", "energy.port"]
            )
    for name, value in ends[4].items():
        assert ends[7][name] == pytest.approx(value, rel=1e-10, abs=1e-11), name


def test_a_sweep_and_a_moving_inertia_take_steps_of_dop853(fmu):
    """Not linear with constant coefficients: `exact` hands these steps over, and counts what they cost."""
    counts = {}
    for name, start in {"plain": {}, "sweep": {"drive.sweep": 0.5}}.items():
        tight = {**start, "solver.rtol": 1e-12, "solver.atol": 1e-14}
        exact = fmu("primary_oscillator").run(tight, H=0.1, stop=5.0, outputs=["s[1]"])
        other = fmu("primary_oscillator").run({**tight, "solver.method": 4}, H=0.1, stop=5.0, outputs=["s[1]"])
        assert np.abs(exact["s[1]"] - other["s[1]"]).max() <= 1e-11
        counts[name] = [result.counts["solver.rhs_evaluations"] for result in (exact, other)]
    assert counts["sweep"][0] == counts["sweep"][1]
    assert counts["plain"][0] != counts["plain"][1]

    def run(method):
        with fmu("primary_oscillator").instantiate() as instance:
            instance.initialise({"solver.method": method, "solver.rtol": 1e-12, "solver.atol": 1e-14})
            for i in range(20):
                instance.set({"P.M": 10.0 + i})
                instance.step(0.1 * i, 0.1)
            return instance.get_all(["s[1]"])["s[1]"], instance.get("solver.rhs_evaluations")

    (exact, evaluations), (other, all_evaluations) = run(7), run(4)
    assert exact == pytest.approx(other, abs=1e-12)
    # the first step has a constant inertia: 100 parts of 7 evaluations; all 20 would take 14000
    assert 700 < evaluations < 700 + all_evaluations


@pytest.mark.parametrize(
    "extreme", [{"stiffness[1]": 1e12}, {"damping[1]": 0.0}, {"stiffness[1]": 0.0, "damping[1]": 0.0}, {"mass[1]": 1e-6}]
)
def test_extreme_oscillators_keep_the_energy_law(fmu, extreme):
    outputs = [f"energy.{part}" for part in ("kinetic", "potential", "dissipated", "supplied")]
    result = fmu("primary_oscillator").run({**extreme, "s[1].start": 1e-3}, H=0.01, stop=1.0, outputs=outputs)
    kinetic, potential, dissipated, supplied = result.values.T
    scale = max(np.abs(result.values).max(), 1e-30)
    assert np.isfinite(result.values).all()
    assert np.abs(kinetic + potential + dissipated - supplied - potential[0]).max() <= 1e-8 * scale


def test_what_exact_cannot_resolve_is_discarded_with_the_reason(fmu):
    """1e12 N s/m on 100 kg: a mode of 1e10 1/s would need 1e8 parts of a step of 10 ms."""
    with fmu("primary_oscillator").instantiate() as instance:
        instance.initialise({"damping[1]": 1e12})
        outcome = instance.try_step(0.0, 0.01)
        assert outcome.status == Status.DISCARD and "evaluations" in outcome.text, outcome.text


@pytest.mark.parametrize(
    ("start", "named"),
    [
        ({"dof": 1, "port.mass": 2}, "port.mass"),
        ({"dof": 1, "drive.mass": 2}, "drive.mass"),
        ({"direction.z": 0.0}, "direction"),
        ({"ground.stiffness": 1.0, "gravity.z": -9.81}, "ground.stiffness"),
    ],
)
def test_oscillator_refuses_what_does_not_fit_together(fmu, start, named):
    with fmu("primary_oscillator").instantiate() as instance:
        instance.set(start)
        instance.enter_initialisation()
        outcome = instance.call("fmi3ExitInitializationMode")
        assert outcome.status == Status.ERROR and named in outcome.text, outcome.text
