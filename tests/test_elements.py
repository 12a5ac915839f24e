"""The elements link2, link3 and strut_link against their equations written a second time (tests/oracle/element.py), at
random states, parameters and inputs, for all joint kinds and roots. Everything is read in Initialization Mode.
"""

import math
from dataclasses import dataclass, field

import numpy as np
import pytest
from koppel import Status, scenes
from koppel.work_precision import energy_balance
from oracle.element import Element, Load, Strut, by_angles, by_direction, by_hinge, by_quaternion

AXES = ("x", "y", "z")
PAIRS = ("xx", "xy", "xz", "yy", "yz", "zz")
ENERGIES = [f"energy.{part}" for part in ("kinetic", "potential", "dissipated", "supplied")]
SEEDS = range(4)


def vector(name):
    return [f"{name}.{i}" for i in AXES]


def tensor(name):
    return [f"{name}.{ij}" for ij in PAIRS]


def components(M):
    """xx, xy, xz, yy, yz, zz of a symmetric matrix."""
    return [M[i, j] for i in range(3) for j in range(i, 3)]


def matrix(parts):
    """The symmetric matrix with these components."""
    M = np.zeros((3, 3), dtype=np.asarray(parts).dtype)
    M[np.triu_indices(3)] = parts
    return M + M.T - np.diag(np.diag(M))


@dataclass(frozen=True)
class Kind:
    """One element with a joint kind and a root."""

    fmu: str
    joint: str
    root: str | None = None

    def __str__(self):
        return "-".join(part for part in (self.fmu, self.joint, self.root and f"root_{self.root}") if part)

    @property
    def planar(self):
        return self.joint == "planar"

    @property
    def port(self):
        """Name of the follower port."""
        return {"link2": "A", "link3": "B", "strut_link": "D"}[self.fmu]

    @property
    def tips(self):
        """Names of the leader ports."""
        return {"link2": ["B"], "link3": ["C", "P"], "strut_link": ["C"]}[self.fmu]

    @property
    def slots(self):
        """Names of all slots with the leader port they belong to."""
        return {
            "link2": [("B", "B")],
            "link3": [("C", "C"), ("P", "P"), ("P.slot[2]", "P")],
            "strut_link": [("C", "C")],
        }[self.fmu]


LINK2 = [Kind("link2", joint) for joint in ("planar", "revolute", "universal", "spherical", "spherical_rod")]
LINK3 = [Kind("link3", joint, root) for joint in ("planar", "revolute", "universal", "spherical") for root in "BC"]
STRUT = [Kind("strut_link", joint, root) for joint in ("planar", "revolute", "spherical") for root in "DC"]
KINDS = LINK2 + LINK3 + STRUT


@dataclass
class Case:
    """Random parameters, states and inputs of a kind, as FMU variables and as the oracle's objects."""

    kind: Kind
    seed: int
    parameters: dict = field(default_factory=dict)
    inputs: dict = field(default_factory=dict)

    def __post_init__(self):
        # a seed per kind and number, the same in every process
        self.random = np.random.default_rng([self.seed, *str(self.kind).encode()])
        self.parameters["joint.kind"] = self.kind.joint
        if self.kind.root:
            self.parameters["root"] = 2 if self.kind.root == "C" else 1
        g = self.normal(6.0)
        self.parameters |= dict(zip(vector("gravity"), g))
        self.body = {"link2": self._rod, "strut_link": self._rod, "link3": self._carrier}[self.kind.fmu](g)
        self.attitude = self._state()
        self._draw_inputs()

    def normal(self, scale, n=3):
        return self.random.normal(scale=scale, size=n)

    def uniform(self, low, high):
        return float(self.random.uniform(low, high))

    def _plane(self, v):
        return v * np.array([1.0, 0.0, 1.0]) if self.kind.planar else v

    def _rod(self, g):
        L, m = self.uniform(0.2, 1.5), self.uniform(0.5, 8.0)
        uniform = self.seed % 2 == 0
        Iyy = m * L * L / 12.0 if uniform else self.uniform(0.02, 0.2) * m * L * L
        # moments that satisfy the triangle inequality; a rod without spin is round
        Ixx = self.uniform(0.01, 0.9) * Iyy
        Izz = Iyy if uniform or self.kind.joint == "spherical_rod" else Iyy + self.uniform(-0.5, 0.5) * Ixx
        c = 0.5 * L if uniform else self.uniform(0.0, L)
        self.parameters |= {"mass": m, "length": L, "rod.uniform": uniform, "inertia.xx": Ixx}
        if not uniform:
            self.parameters |= {"com.x": c, "inertia.yy": Iyy, "inertia.zz": Izz}
        at_root, strut = (L if self.kind.root == "C" else 0.0), None
        along = lambda x: np.array([x - at_root, 0.0, 0.0])
        self.points = {self.kind.tips[0]: along(0.0 if self.kind.root == "C" else L)}
        if self.kind.fmu == "strut_link":
            s1 = self.uniform(0.1, 1.0) * L
            strut = Strut(
                along(s1), self.uniform(1e2, 1e4), self.uniform(1.0, 1e2), self.uniform(0.1, 1.0), *self.normal(50.0, 1)
            )
            names = ("strut.s1", "strut.k", "strut.c", "strut.l0", "strut.preload")
            self.parameters |= dict(zip(names, (s1, strut.k, strut.c, strut.l0, strut.preload)))
        return Element(m, along(c), np.diag([Ixx, Iyy, Izz]), g, self.kind.planar, strut)

    def _carrier(self, g):
        m = self.uniform(5.0, 40.0)
        com, C, P = (self._plane(self.normal(0.3)) for _ in range(3))
        # inertia of random point masses: positive definite, satisfies the triangle inequality
        masses = self.random.normal(scale=0.2, size=(5, 3))
        I = m / 5.0 * sum((p @ p) * np.eye(3) - np.outer(p, p) for p in masses)
        self.parameters |= {"mass": m} | dict(zip(vector("com"), com)) | dict(zip(tensor("inertia"), components(I)))
        self.parameters |= dict(zip(vector("point.C"), C)) | dict(zip(vector("point.P"), P))
        root, tip = (C, np.zeros(3)) if self.kind.root == "C" else (np.zeros(3), C)
        self.points = {"C": tip - root, "P": P - root}
        if self.kind.planar:
            I = np.diag([0.0, I[1, 1], 0.0])  # plane motion uses yy only
        return Element(m, com - root, I, g, self.kind.planar)

    def _state(self):
        angle = "psi" if self.kind.fmu == "link3" else "theta"
        phi, theta = self.uniform(-3.0, 3.0), self.uniform(-1.3, 1.3)
        rates = self.normal(2.0)
        start = {}
        match self.kind.joint:
            case "planar":
                theta = self.uniform(-3.0, 3.0)
                start = {f"angle.{angle}": theta, f"angle_rate.{angle}": rates[1]}
                attitude = by_hinge(0.0, theta, rates[1])
            case "revolute":
                theta = self.uniform(-3.0, 3.0)
                start = {f"angle.{angle}": theta, f"angle_rate.{angle}": rates[1], "angle.phi": phi}
                attitude = by_hinge(phi, theta, rates[1])
            case "universal":
                start = {"angle.phi": phi, "angle.theta": theta}
                start |= {"angle_rate.phi": rates[0], "angle_rate.theta": rates[1]}
                attitude = by_angles(phi, theta, rates[0], rates[1])
            case "spherical":
                q = self.normal(1.0, 4)
                q /= np.linalg.norm(q)
                start = {f"orientation.q[{i + 1}]": q[i] for i in range(4)} | dict(zip(vector("omega"), rates))
                attitude = by_quaternion(q, rates)
            case "spherical_rod":
                d = self.normal(1.0)
                d /= np.linalg.norm(d)
                rates -= (rates @ d) * d
                start = dict(zip(vector("direction"), d)) | dict(zip(vector("omega"), rates))
                attitude = by_direction(d, rates)
        self.parameters |= start
        return attitude

    def _draw_inputs(self):
        port = self.kind.port
        self.inputs |= dict(zip(vector(f"{port}.r"), self.normal(1.0)))
        self.inputs |= dict(zip(vector(f"{port}.v"), self.normal(2.0)))
        self.inputs |= dict(zip(vector(f"{port}.a"), self.normal(5.0)))
        for slot, _ in self.kind.slots:
            root = self.random.normal(scale=1.0, size=(3, 3))
            self.inputs |= dict(zip(vector(f"{slot}.F"), self.normal(50.0)))
            self.inputs |= dict(zip(tensor(f"{slot}.M"), components(root @ root.T)))
        if self.kind.fmu == "link2":
            self.inputs |= dict(zip(vector("drive.torque"), self.normal(5.0)))
        if self.kind.fmu == "strut_link":
            # away from the foot of the strut, whose length is then never small
            at = np.array([self.inputs[name] for name in vector("D.r")])
            self.inputs |= dict(zip(vector("T.r"), at + np.array([0.3, 0.2, 2.5]) + self.normal(0.1)))
            self.inputs |= dict(zip(vector("T.v"), self.normal(2.0)))

    def oracle(self, **changes):
        """The oracle's answer at the inputs, some of them changed (by complex numbers, too)."""
        inputs = self.inputs | changes
        get = lambda names: np.array([inputs[name] for name in names])
        port = self.kind.port
        root = [get(vector(f"{port}.{part}")) for part in "rva"]
        loads = [
            Load(self.points[point], get(vector(f"{slot}.F")), matrix(get(tensor(f"{slot}.M"))))
            for slot, point in self.kind.slots
        ]
        torque = get(vector("drive.torque")) if self.kind.fmu == "link2" else np.zeros(3)
        top = [get(vector("T.r")), get(vector("T.v"))] if self.kind.fmu == "strut_link" else None
        return self.body.evaluate(self.attitude, root, loads, self.points.items(), torque, top)

    def outputs(self, **changes):
        """The oracle's answer by the FMU's variables: name -> (value, scale of its terms)."""
        answer = self.oracle(**changes)
        force, moment = answer["scale"]["force"], answer["scale"]["moment"]
        port, out = self.kind.port, {}

        def put(names, values, scale=0.0):
            scale = max(scale, np.abs(values).max())
            out.update((name, (value, scale)) for name, value in zip(names, values))

        put(vector(f"{port}.F0"), answer["F0"], force)
        put(tensor(f"{port}.M"), components(answer["M"]))
        put(vector(f"{port}.F"), answer["F"], force)
        put(vector("joint.moment"), answer["moment"], moment)
        for tip in self.kind.tips:
            for part in "rva":
                put(vector(f"{tip}.{part}"), answer[tip][part])
        if self.kind.fmu == "strut_link":
            for part in ("F", "F0"):
                put(vector(f"T.{part}"), answer["T.F"])
            put(tensor("T.M"), np.zeros(6), 1.0)
            for part in ("length", "rate", "force"):
                put([f"strut.{part}"], [answer[part]])
        for part in ("kinetic", "potential"):
            put([f"energy.{part}"], [answer[part]])
        return out

    def start(self, fmu, event_mode=False):
        """An instance in Initialization Mode with all of this set; give it back with `free`."""
        instance = fmu.instantiate(event_mode)
        instance.set(self.parameters)
        instance.enter_initialisation()
        instance.set(self.inputs)
        return instance


class Measured:
    """A case and an instance at it."""

    def __init__(self, case, fmu):
        self.case, self.kind, self.fmu = case, case.kind, fmu
        self.instance = case.start(fmu)
        self.names = fmu.names("output")
        self._all = self.instance.block(self.names)
        self._inputs = self.instance.block(list(case.inputs))

    def at(self, **changes):
        """All outputs with some inputs changed."""
        values = self.case.inputs | changes
        self._inputs.write([values[name] for name in self._inputs.names])
        return dict(zip(self.names, self._all.read().tolist()))

    def moved(self, name, step):
        """All outputs with `step` added to one input."""
        return np.array(list(self.at(**{name: self.case.inputs[name] + step}).values()))

    def array(self, names):
        return np.array([self.at()[name] for name in names])

    def jacobian(self, unknowns, knowns):
        """Directional derivatives, a column per known."""
        self.at()
        columns = [self.instance.directional_derivative(unknowns, [known], [1.0]) for known in knowns]
        return np.array(columns).T

    def differences(self, unknowns, knowns, step=4096.0):
        """The same from outputs at the inputs +- `step`: exact where they act affinely, and a power of two so that only
        the outputs round. The step is large, so that the rounding of what does not depend on the input is not."""
        rows = [self.names.index(name) for name in unknowns]
        return np.array([(self.moved(k, step) - self.moved(k, -step))[rows] / (2.0 * step) for k in knowns]).T


@pytest.fixture(params=[(kind, seed) for kind in KINDS for seed in SEEDS], ids=lambda p: f"{p[0]}-{p[1]}")
def measured(request, fmu):
    kind, seed = request.param
    one = Measured(Case(kind, seed), fmu(kind.fmu))
    yield one
    one.instance.free()


# equations ----------------------------------------------------------------------------------------------------------
def test_outputs_are_those_of_the_equations(measured):
    """(4)-(9), (12a), (12b), (15), (16), (21), to 1e-11 of the terms that are summed."""
    expected = measured.case.outputs()
    actual = measured.at()
    wrong = {
        name: (actual[name], value.real)
        for name, (value, scale) in expected.items()
        if not abs(actual[name] - value) <= 1e-11 * scale
    }
    assert not wrong, wrong
    # what is not compared: states themselves, and integrals that start at 0
    rest = set(actual) - set(expected)
    states = {"angle", "angle_rate", "orientation", "direction", "omega", "energy"}
    assert {name.split(".")[0] for name in rest} <= states, rest
    assert all(actual[name] == 0.0 for name in rest if name.startswith("energy."))


def test_states_keep_their_start_values(measured):
    actual = measured.at()
    starts = {name: value for name, value in measured.case.parameters.items() if name in actual}
    if measured.kind.joint == "revolute":
        starts.pop("angle.phi")  # no state here: the azimuth of the hinge
    assert starts
    # a quaternion or direction is normalised: rounding
    assert all(abs(actual[name] - value) <= 1e-15 * max(1.0, abs(value)) for name, value in starts.items())


@pytest.mark.parametrize("kind", KINDS, ids=str)
def test_states_of_other_joint_kinds_keep_their_start_values(fmu, kind):
    """What was set as an exact start is read back, used or not; so is the azimuth of a hinge."""
    case, element = Case(kind, 0), fmu(kind.fmu)
    others = {"angle.phi": 0.7, "angle.theta": -0.4, "angle.psi": 0.3, "angle_rate.phi": 1.5, "angle_rate.theta": -2.5}
    others |= {"angle_rate.psi": 0.25} | {f"orientation.q[{i}]": 0.5 for i in (1, 2, 3, 4)}
    others |= dict(zip(vector("direction"), (0.6, 0.0, -0.8))) | dict(zip(vector("omega"), (0.8, 1.5, 0.6)))
    case.parameters = {name: value for name, value in others.items() if name in element.variables} | case.parameters
    starts = {name: value for name, value in case.parameters.items() if name in element.names("output")}
    with case.start(element) as instance:
        wrong = {
            name: (instance.get(name), value)
            for name, value in starts.items()
            if abs(instance.get(name) - value) > 1e-15
        }
    assert not wrong, wrong


@pytest.mark.parametrize("measured", [(kind, 0) for kind in KINDS if kind.planar], indirect=True, ids=str)
def test_plane_elements_know_no_y(measured):
    """Inputs across the plane change nothing, outputs across it are zero."""
    before = measured.at()
    across = {name: 7.0 for name in measured.case.inputs if name.endswith((".y", ".xy", ".yy", ".yz"))}
    across.pop("drive.torque.y", None)  # this moment acts in the plane
    assert measured.at(**across) == before
    ports = [measured.kind.port, *measured.kind.tips]
    for name, value in before.items():
        if name.split(".")[0] in ports and name.endswith((".y", ".xy", ".yy", ".yz")):
            assert value == 0.0, name


@pytest.mark.parametrize("theta", [0.3, -1.2, 1.5705])
def test_singularity_of_the_universal_joint_is_reported(fmu, theta):
    """Jx st^2 + Jz ct^2 over Jz; 1 for other joints."""
    m, L, Jx = 2.0, 0.5, 2e-3
    Jz = m * L * L / 3.0
    for joint, expected in [
        ("universal", (Jx * np.sin(theta) ** 2 + Jz * np.cos(theta) ** 2) / Jz),
        ("spherical", 1.0),
    ]:
        with fmu("link2").instantiate() as instance:
            instance.set({"joint.kind": joint, "mass": m, "length": L, "inertia.xx": Jx, "angle.theta": theta})
            instance.enter_initialisation()
            assert instance.get("joint.singularity") == pytest.approx(expected, rel=1e-13)


def test_follower_identity(measured):
    """F = F0 - M a; F is summed inside from the accelerations, so this is no tautology."""
    port = measured.kind.port
    F, F0 = measured.array(vector(f"{port}.F")), measured.array(vector(f"{port}.F0"))
    a = np.array([measured.case.inputs[name] for name in vector(f"{port}.a")])
    M = matrix(measured.array(tensor(f"{port}.M")))
    assert np.abs(F - (F0 - M @ a)).max() <= 1e-10 * max(np.abs(F).max(), np.abs(F0).max())


def test_effective_inertia_is_positive_semidefinite(measured):
    M = matrix(measured.array(tensor(f"{measured.kind.port}.M")))
    values = np.linalg.eigvalsh(M)
    assert values[0] >= -1e-12 and values[-1] > 0.0


def test_joint_moment_does_no_work(measured):
    """(9) is orthogonal to the columns of H: the joint transmits nothing along its own freedom."""
    moment = measured.array(vector("joint.moment"))
    scale = measured.case.oracle()["scale"]["moment"]
    assert np.abs(measured.case.attitude.H.T @ moment).max() <= 1e-11 * scale


# two-ports ----------------------------------------------------------------------------------------------------------
BY = {"directional derivatives": Measured.jacobian, "differences": Measured.differences}


@pytest.mark.parametrize("by", BY)
def test_two_port_is_symmetric_definite_and_reciprocal(measured, by):
    """M_AA at the root, Y over all out ports and the cross blocks, to 1e-13 relative."""
    port, tips = measured.kind.port, measured.kind.tips
    a_A, F_A = vector(f"{port}.a"), vector(f"{port}.F")
    F = [name for tip in tips for name in vector(f"{tip}.F")]
    a = [name for tip in tips for name in vector(f"{tip}.a")]
    whole = BY[by](measured, F_A + a, a_A + F)
    M, G, GT, Y = -whole[:3, :3], whole[:3, 3:], whole[3:, :3], whole[3:, 3:]
    small = lambda difference, part: np.abs(difference).max() <= 1e-13 * np.abs(part).max()
    assert small(M - M.T, M) and np.linalg.eigvalsh(M)[0] >= -1e-13 * np.abs(M).max()
    assert small(Y - Y.T, Y) and np.linalg.eigvalsh(Y)[0] >= -1e-13 * np.abs(Y).max()
    assert small(GT - G.T, G)
    assert small(M - matrix(measured.array(tensor(f"{port}.M"))), M)
    assert np.abs(Y).max() > 1e-3


@pytest.mark.parametrize("by", BY)
def test_two_port_is_that_of_the_equations(measured, by):
    """(10)-(12c), to 1e-11."""
    case, port, tip = measured.case, measured.kind.port, measured.kind.tips[0]
    loads = [
        Load(case.points[p], np.zeros(3), matrix([case.inputs[n] for n in tensor(f"{s}.M")]))
        for s, p in measured.kind.slots
    ]
    if case.body.strut:
        loads.append(Load(case.body.strut.s, np.zeros(3), np.zeros((3, 3))))
    M, G, Y = case.body.two_port(case.attitude, loads, case.points[tip])
    blocks = [
        (f"{port}.F", f"{port}.a", -M),
        (f"{port}.F", f"{tip}.F", G),
        (f"{port}.F0", f"{tip}.F", G),
        (f"{tip}.a", f"{port}.a", G.T),
        (f"{tip}.a", f"{tip}.F", Y),
    ]
    for unknown, known, expected in blocks:
        actual = BY[by](measured, vector(unknown), vector(known))
        assert np.abs(actual - expected).max() <= 1e-11 * np.abs(expected).max(), (unknown, known)


def test_directional_derivatives_by_every_input(measured):
    """All outputs by all inputs, against a complex step through the equations: exact to rounding."""
    case, h = measured.case, 1e-40
    names, knowns = list(case.outputs()), list(case.inputs)
    changed = [case.outputs(**{known: case.inputs[known] + 1j * h}) for known in knowns]
    expected = np.array([[one[name][0].imag / h for one in changed] for name in names])
    error = np.abs(measured.jacobian(names, knowns) - expected)
    # relative to the largest entry of the vector by the vector; a joint's moment is what is left of forces with levers
    # of a metre that may cancel entirely
    first = lambda group: [[name.rsplit(".", 1)[0] for name in group].index(name.rsplit(".", 1)[0]) for name in group]
    rows, columns = first(names), first(knowns)
    size = np.zeros_like(expected)
    np.maximum.at(size, np.ix_(rows, columns), np.abs(expected))
    moment, force = names.index("joint.moment.x"), names.index(f"{measured.kind.port}.F.x")
    size[moment] = np.maximum(size[moment], size[force])
    bad = np.argwhere(error > 1e-11 * np.maximum(size[np.ix_(rows, columns)], 1e-3))
    assert not bad.size, [(names[i], knowns[j], expected[i, j], error[i, j]) for i, j in bad]


# Model Exchange -----------------------------------------------------------------------------------------------------
class Rates:
    """A case as equations: outputs and state derivatives in Continuous-Time Mode, as functions of inputs and states."""

    def __init__(self, case, fmu):
        self.case = case
        self.instance = instance = fmu.equations()
        instance.set(case.parameters)
        instance.enter_initialisation()
        instance.set(case.inputs)
        instance.exit_initialisation()
        self.states = [unknown.variable.derivative.name for unknown in fmu.description.derivatives]
        self.derivatives = [unknown.variable.name for unknown in fmu.description.derivatives]
        self.unknowns = fmu.names("output") + self.derivatives
        self._outputs = instance.block(fmu.names("output"))
        self._inputs = instance.block(list(case.inputs))
        self.x = instance.x.copy()

    def at(self, **changes):
        """All unknowns with `changes` added to inputs and states."""
        self._inputs.write([value + changes.get(name, 0.0) for name, value in self.case.inputs.items()])
        self.instance.x[:] = self.x + [changes.get(name, 0.0) for name in self.states]
        self.instance.write_states()
        return np.concatenate([self._outputs.read(), self.instance.read_derivatives()])

    def directional(self, unknowns, direction):
        """d(unknowns) along a direction of inputs and states."""
        self.at()
        return self.instance.directional_derivative(unknowns, list(direction), list(direction.values()))


@pytest.fixture
def rates(request, fmu):
    kind, seed = request.param
    one = Rates(Case(kind, seed), fmu(kind.fmu))
    yield one
    one.instance.free()


EVERY_CASE = pytest.mark.parametrize(
    "rates", [(kind, seed) for kind in KINDS for seed in SEEDS], indirect=True, ids=lambda p: f"{p[0]}-{p[1]}"
)


@EVERY_CASE
def test_state_derivatives_are_those_of_the_equations(rates):
    """alpha of (6) from the derivatives, the energy rates of (21); coordinates of other joint kinds rest."""
    case, answer = rates.case, rates.case.oracle()
    found = dict(zip(rates.unknowns, rates.at()))
    rate = lambda name: found.pop(f"der({name})")
    at, alpha = case.attitude, answer["alpha"].real
    scale = max(np.abs(alpha).max(), np.abs(at.gamma).max(), 1.0)
    angle = (
        "angle_rate.psi"
        if case.kind.fmu == "link3" and case.kind.joint in ("planar", "revolute")
        else "angle_rate.theta"
    )
    if case.kind.joint in ("planar", "revolute"):
        q_ddot = [rate(angle)]
    elif case.kind.joint == "universal":
        q_ddot = [rate("angle_rate.phi"), rate("angle_rate.theta")]
    else:
        omega_dot = np.array([rate(name) for name in vector("omega")])
        assert np.abs(omega_dot - alpha).max() <= 1e-11 * scale
        q_ddot = None
    if q_ddot is not None:
        assert np.abs(at.H @ q_ddot + at.gamma - alpha).max() <= 1e-11 * scale
    if case.kind.joint == "spherical":
        w, x, y, z = (case.parameters[f"orientation.q[{i}]"] for i in (1, 2, 3, 4))
        # p' = 1/2 (0, omega) o p
        u, o = np.array([x, y, z]), at.omega
        expected = 0.5 * np.array([-o @ u, *(w * o + np.cross(o, u))])
        assert np.abs([rate(f"orientation.q[{i}]") for i in (1, 2, 3, 4)] - expected).max() <= 1e-14 * np.abs(o).max()
    if case.kind.joint == "spherical_rod":
        expected = np.cross(at.omega, at.R[:, 0])
        assert (
            np.abs([rate(name) for name in vector("direction")] - expected).max()
            <= 1e-14 * np.abs(expected).max() + 1e-15
        )
    # the power of forces and velocities, with the accelerations in F - M a: what is summed, not what is left
    power = max(abs(answer["supplied'"]), answer["scale"]["force"] * 2.0)
    for name, key in (("supplied", "supplied'"), ("port", "port'"), ("dissipated", "dissipated'")):
        assert abs(rate(f"energy.{name}") - answer.get(key, 0.0)) <= 1e-11 * power, name
    for name in [name for name in found if name.startswith("der(")]:
        coordinate = name[4:-1]
        expected = {
            "planar": {f"angle.{angle[-3:]}", "angle.theta"},
            "revolute": {f"angle.{angle[-3:]}", "angle.theta"},
            "universal": {"angle.phi", "angle.theta"},
        }.get(case.kind.joint, set())
        if coordinate in expected:
            assert found[name] == case.parameters.get(coordinate.replace("angle.", "angle_rate."), 0.0), name
        else:
            assert found[name] == 0.0, name


@EVERY_CASE
def test_power_balance(rates):
    """kinetic' + potential' = supplied' - dissipated', the left side by the directional derivative along the motion."""
    port = rates.case.kind.port
    derivative = dict(zip(rates.states, rates.at()[-len(rates.states) :]))
    along = {name: value for name, value in derivative.items() if not name.startswith("energy.")}
    given = [(port, "r", "v"), (port, "v", "a")] + ([("T", "r", "v")] if rates.case.kind.fmu == "strut_link" else [])
    for point, moved, rate in given:
        along |= {f"{point}.{moved}.{i}": rates.case.inputs[f"{point}.{rate}.{i}"] for i in AXES}
    kinetic, potential = rates.directional(["energy.kinetic", "energy.potential"], along)
    supplied, dissipated = (derivative[f"energy.{part}"] for part in ("supplied", "dissipated"))
    scale = max(abs(kinetic), abs(potential), abs(supplied), 1.0)
    assert abs(kinetic + potential - supplied + dissipated) <= 1e-11 * scale


# dependencies -------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("name", ["link2", "link3", "strut_link"])
def test_declared_dependencies_are_the_observed_ones(fmu, name):
    """Outputs and state derivatives by inputs and states: sparsity by changed values, united over joint kinds, roots and
    random points; neither more nor less is declared."""
    element = fmu(name)
    inputs = [
        v.name for v in element.description.modelVariables if v.causality == "input" and v.variability == "continuous"
    ]
    found = {}
    for kind in (kind for kind in KINDS if kind.fmu == name):
        for seed in SEEDS:
            one = Rates(Case(kind, seed), element)
            assert set(one.case.inputs) == set(inputs)
            base = one.at()
            for known in inputs + one.states:
                # an inertia stays positive definite; a unit vector or quaternion is normalised inside
                for step in (0.125, 1.0):
                    # the moment of a ball joint is what is left of 1e4 N m: rounding up to 1e-11
                    moved = np.abs(one.at(**{known: step}) - base) > 1e-9 * np.maximum(1.0, np.abs(base))
                    for i in np.flatnonzero(moved):
                        found.setdefault(one.unknowns[i], set()).add(known)
            one.instance.free()
    declared = {}
    for unknown in element.description.outputs + element.description.derivatives:
        assert unknown.dependencies is not None, f"{unknown.variable.name}: dependencies not declared"
        declared[unknown.variable.name] = {v.name for v in unknown.dependencies}
    assert set(found) <= set(declared) == set(one.unknowns)
    missing = {n: sorted(found.get(n, set()) - declared[n]) for n in declared if found.get(n, set()) - declared[n]}
    never = {n: sorted(declared[n] - found.get(n, set())) for n in declared if declared[n] - found.get(n, set())}
    assert not missing, f"acts but is not declared: {missing}"
    assert not never, f"declared but never seen: {never}"
    port = Kind(name, "planar").port
    assert not any(f"{port}.a.{i}" in declared[o] for o in vector(f"{port}.F0") + tensor(f"{port}.M") for i in AXES)


# energy -------------------------------------------------------------------------------------------------------------
RUNS = [*LINK2, *LINK3[::2], *STRUT[::2], LINK3[-1], STRUT[-1]]


@pytest.mark.parametrize("kind", RUNS, ids=str)
def test_energy_law_holds_over_a_short_run(fmu, kind):
    """Root moved with constant acceleration, which is integrated exactly inside; constant loads and inertias on all
    slots; chassis point at rest. kinetic + potential - start = supplied - dissipated."""
    case = Case(kind, 11)
    case.inputs.update((name, 0.0) for name in vector("T.v") if name in case.inputs)
    with case.start(fmu(kind.fmu)) as instance:
        instance.set(scenes.adaptive("dopri5", 1e-11))
        start = case.oracle()
        instance.exit_initialisation()
        result = instance.run(np.linspace(0.0, 0.05, 26), ENERGIES)
    assert energy_balance(result) <= 1e-9, energy_balance(result)
    assert abs(result["energy.kinetic"][0] - start["kinetic"]) <= 1e-11 * start["kinetic"].real


def test_oracle_obeys_the_energy_law():
    """stored' = supplied' - dissipated', an identity between forces and motion: neither is right by accident."""
    for kind in KINDS:
        for seed in SEEDS:
            answer = Case(kind, seed).oracle()
            balance = answer["stored'"] - answer["supplied'"] + answer.get("dissipated'", 0.0)
            assert abs(balance) <= 1e-11 * max(abs(answer["supplied'"]), abs(answer["stored'"]), 1e3), kind


# names --------------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(("name", "ends"), [("link3", ["B", "C"]), ("strut_link", ["D", "C"])])
def test_ends_are_named_as_the_points_they_are(fmu, name, ends):
    assert [item.name for item in fmu(name).variable("root").declaredType.items] == ends


# refusals -----------------------------------------------------------------------------------------------------------
AT_THE_END = [
    ("link2", {"joint.kind": "spherical", "orientation.q[1]": 1.01}, "orientation.q"),
    ("link3", {"joint.kind": "spherical", "orientation.q[2]": 0.1}, "orientation.q"),
    ("strut_link", {"joint.kind": "spherical", "orientation.q[1]": 0.0}, "orientation.q"),
    ("link2", {"joint.kind": "universal", "inertia.xx": 0.0}, "inertia.xx"),
    ("link2", {"joint.kind": "spherical", "orientation.q[1]": 1.0, "inertia.xx": 0.0}, "inertia.xx"),
    ("strut_link", {"strut.s1": 0.3}, "strut.s1"),
    ("link2", {"joint.kind": "spherical_rod", "direction.y": 0.1}, "direction"),
    ("link2", {"joint.kind": "spherical_rod", "omega.x": 1.0}, "omega"),
    (
        "link2",
        {"joint.kind": "spherical_rod", "rod.uniform": False, "inertia.yy": 0.05, "inertia.zz": 0.06},
        "inertia.zz",
    ),
    ("link2", {"rod.uniform": False, "com.x": 0.5}, "com.x"),
    ("link3", {"joint.kind": "spherical", "inertia.xx": 1.7}, "inertia"),
    ("link3", {"joint.kind": "spherical", "inertia.xy": 2.0}, "inertia"),
]


@pytest.mark.parametrize(
    ("name", "values", "named"), AT_THE_END, ids=lambda v: v if isinstance(v, str) else ",".join(v)
)
def test_values_that_do_not_fit_together_end_initialisation_in_an_error(fmu, name, values, named):
    with fmu(name).instantiate() as instance:
        instance.set(values)
        instance.enter_initialisation()
        outcome = instance.call("fmi3ExitInitializationMode")
        assert outcome.status == Status.ERROR
        assert named in outcome.text, outcome.text


@pytest.mark.parametrize(
    ("name", "variable", "value"),
    [
        ("link2", "mass", -1.0),
        ("link3", "mass", -25.0),
        ("strut_link", "mass", 0.0),
        ("link2", "length", -0.1),
        ("link2", "inertia.xx", -1e-9),
        ("strut_link", "strut.s1", 0.0),
        ("strut_link", "strut.k", -1.0),
        ("link3", "orientation.q[1]", math.nan),
    ],
)
def test_value_outside_its_range_is_discarded(fmu, name, variable, value):
    with fmu(name).instantiate() as instance:
        outcome = instance.try_set(variable, value)
        assert outcome.status == Status.DISCARD
        assert variable in outcome.text, outcome.text
        instance.initialise({})
        instance.step(0.0, 1e-3)


@pytest.mark.parametrize(("kind", "start"), [("spherical", "orientation.q[1]"), ("spherical_rod", "direction.x")])
def test_rounding_of_a_unit_start_value_is_taken_away(fmu, kind, start):
    """Off by less than 1e-6: normalised, not refused."""
    with fmu("link2").instantiate() as instance:
        instance.initialise({"joint.kind": kind, start: 1.0 + 9e-7})
        assert instance.get(start) == 1.0


def test_strut_of_no_length_is_discarded(fmu):
    """T at the foot of the strut: no direction. The message says which length; the run goes on elsewhere."""
    with fmu("strut_link").instantiate() as instance:
        instance.initialise({"angle.theta": 0.0, "gravity.z": 0.0})
        instance.set({"T.r.x": 0.08 + 0.14, "T.r.z": 0.25})
        outcome = instance.try_step(0.0, 0.01)
        assert outcome.status == Status.DISCARD
        assert "strut length" in outcome.text, outcome.text
        instance.set({"T.r.x": 0.22, "T.r.z": 0.62})
        instance.step(0.0, 0.01)
