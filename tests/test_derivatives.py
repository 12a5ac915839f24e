"""Directional derivatives and declared dependencies against what Set and Get show."""

import numpy as np
import pytest
from koppel import FmuError, Status, scenes
from oracle.wishbone import Wishbone, vec

VECTOR = ("x", "y", "z")
FORCES = [f"{slot}.F.{i}" for slot in ("P", "P.slot[2]") for i in VECTOR]
MASSES = [f"{slot}.M.{ij}" for slot in ("P", "P.slot[2]") for ij in ("xx", "xy", "xz", "yy", "yz", "zz")]
CHASSIS = [f"chassis.a.{i}" for i in VECTOR]
# inputs around which derivatives are taken: a point mass that keeps M positive definite when an entry moves
BASE = {
    "P.F.x": 20.0,
    "P.F.y": 30.0,
    "P.F.z": 50.0,
    **{f"{slot}.M.{ii}": 5.0 for slot in ("P", "P.slot[2]") for ii in ("xx", "yy", "zz")},
}
# nothing in one plane, so that every direction acts on every other
SKEW = {"design.B.y": 0.03, "design.C.y": -0.02, "design.G.y": 0.02, "design.P.y": -0.05, "carrier.inertia.xy": 0.1}
SPATIAL = {**scenes.SPATIAL, **SKEW, "strut.preload_mode": "given", "strut.preload": 300.0}
WEIGHT = {"gravity.z": -9.80665, "strut.preload": 300.0}
SCENES = {
    "planar": WEIGHT,
    "bushing": {**WEIGHT, "closure.kind": "bushing", **scenes.fixed("rk4", 1e-4)},
    "baumgarte": {**WEIGHT, "stabilisation.kind": "baumgarte"},
    "spatial": SPATIAL,
    "universal": {**SPATIAL, "arm.joint": "universal", "carrier.joint": "universal"},
}
#: Start of the lower link [rad] and its rate [rad/s]: places that are not special.
STATES = {"near the design": (-0.13, 0.7), "far and fast": (0.21, -2.3)}


class Probe:
    """Outputs as a function of inputs at a fixed moving state (Initialization Mode, started away from the design)."""

    def __init__(self, fmu, start_values, state):
        self.fmu = fmu
        self.instance = fmu.instantiate()
        theta, rate = state
        moving = {"start.override": True, "lower.angle.theta": theta, "lower.angle_rate.theta": rate}
        self.instance.set({**start_values, **moving})
        self.instance.enter_initialisation()
        self.inputs = self.instance.block(fmu.names("input"))
        self.outputs = self.instance.block(fmu.names("output"))
        self.base = {name: 0.0 for name in self.inputs.names} | BASE

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.instance.free()

    def at(self, **changes):
        """Outputs with the base inputs changed by `changes`."""
        values = self.base | {name: self.base[name] + delta for name, delta in changes.items()}
        self.inputs.write([values[name] for name in self.inputs.names])
        return self.outputs.read().copy()

    def derivative(self, name):
        """All outputs by one input."""
        self.at()
        return self.instance.directional_derivative(self.outputs.names, [name], [1.0])


@pytest.fixture(scope="module", params=[(scene, state) for scene in SCENES for state in STATES], ids=" ".join)
def probe(request, wishbone):
    scene, state = request.param
    with Probe(wishbone, SCENES[scene], STATES[state]) as one:
        yield one


def scale_of(*columns):
    return max(1.0, *(np.abs(column).max() for column in columns))


def test_forces_and_chassis_act_affinely_and_the_derivative_is_exact(probe):
    """Unit differences of an affine function are its derivative, up to rounding of the outputs."""
    base = probe.at()
    exact = [i for i, name in enumerate(probe.outputs.names) if name != "loop.condition"]
    moved = 0
    for name in FORCES + CHASSIS:
        derivative = probe.derivative(name)
        for step in (1.0, -1.0, 64.0):
            difference = (probe.at(**{name: step}) - base) / step
            # rounding: 1e-16 of the largest output, a few thousand newton
            assert np.abs(difference - derivative)[exact].max() <= 1e-11 * scale_of(base, derivative), name
        moved += bool(np.abs(derivative).max() > 1e-6)
    assert moved >= 6, "too few inputs act for this to be a test"


def test_derivative_by_inertia_agrees_with_central_differences(probe):
    moved = 0
    for name in MASSES:
        derivative = probe.derivative(name)
        h = 1e-3
        difference = (probe.at(**{name: h}) - probe.at(**{name: -h})) / (2.0 * h)
        # third derivative / 6 h^2 with 1/m scales of 30 kg: below 1e-8; rounding 1e-13 / h
        assert np.abs(difference - derivative).max() <= 1e-6 * scale_of(derivative), name
        moved += bool(np.abs(derivative).max() > 1e-6)
    assert moved >= 4


def test_derivative_is_linear_in_its_seed(probe):
    probe.at()
    names = FORCES + CHASSIS
    seed = np.linspace(-1.0, 2.0, len(names))
    together = probe.instance.directional_derivative(probe.outputs.names, names, seed)
    apart = sum(
        s * probe.instance.directional_derivative(probe.outputs.names, [name], [1.0]) for s, name in zip(seed, names)
    )
    assert np.abs(together - apart).max() <= 1e-12 * scale_of(together)


def test_derivatives_leave_the_instance_alone(probe):
    before = probe.at()
    probe.instance.directional_derivative(probe.outputs.names, FORCES, np.ones(len(FORCES)))
    assert probe.outputs.read().tobytes() == before.tobytes()


def test_mobility_at_the_port_is_symmetric_and_positive_semidefinite(probe):
    """d(P.a)/d(P.F) is the mobility behind the port."""
    columns = []
    for i in VECTOR:
        probe.at()
        columns.append(probe.instance.directional_derivative([f"P.a.{j}" for j in VECTOR], [f"P.F.{i}"], [1.0]))
    Y = np.array(columns)
    assert np.abs(Y - Y.T).max() <= 1e-12 * np.abs(Y).max()
    assert np.linalg.eigvalsh(0.5 * (Y + Y.T)).min() >= -1e-12 * np.abs(Y).max()
    assert np.abs(Y).max() > 1e-3


def test_first_accelerations_and_forces_agree_with_the_oracle(wishbone):
    """In Initialization Mode: outputs after Set, and derivatives by P.F, against free bodies with multipliers."""
    with wishbone.instantiate() as instance:
        instance.set({"gravity.z": -9.80665, "force.kind": "input"})
        instance.enter_initialisation()
        names = [f"{p}.F.{i}" for p in "ABCD" for i in "xz"]
        instance.set({"P.F.x": 100.0, "P.F.z": 3500.0})
        measured = instance.block(names).read().copy()
        derivatives = {i: instance.directional_derivative(names, [f"P.F.{i}"], [1.0]) for i in "xz"}

    def forces(x, z):
        model = Wishbone(gravity=vec(0.0, -9.80665), offset=vec(x, z), amplitude=vec(0.0, 0.0))
        solved = model.solve(0.0, model.start())
        return np.concatenate([solved[f"{p}.F"] for p in "ABCD"])

    expected = forces(100.0, 3500.0)
    assert np.abs(measured - expected).max() <= 1e-11 * np.abs(expected).max()
    assert np.abs(derivatives["x"] - (forces(101.0, 3500.0) - expected)).max() <= 1e-9
    assert np.abs(derivatives["z"] - (forces(100.0, 3501.0) - expected)).max() <= 1e-9


def test_derivatives_by_parameters_or_of_inputs_are_refused(probe):
    for unknown, known in (("P.a.z", "carrier.mass"), ("P.F.z", "P.F.z"), ("P.a.z", "P.a.z")):
        with pytest.raises(FmuError) as refused:
            probe.instance.directional_derivative([unknown], [known], [1.0])
        assert refused.value.status == Status.ERROR
        assert refused.value.messages


def observed(fmu):
    """Output -> inputs that change it, united over all settings and states."""
    found = {name: set() for name in fmu.names("output")}
    for start_values in SCENES.values():
        for state in STATES.values():
            with Probe(fmu, start_values, state) as probe:
                base = probe.at()
                for name in probe.inputs.names:
                    for step in (1.0, -0.5):
                        changed = probe.at(**{name: step})
                        for output, now, before in zip(probe.outputs.names, changed, base):
                            if abs(now - before) > 1e-11 * max(1.0, abs(before)):
                                found[output].add(name)
    return found


def test_declared_dependencies_are_the_observed_ones(wishbone):
    found = observed(wishbone)
    inputs = set(wishbone.names("input"))
    declared = {}
    for unknown in wishbone.description.outputs:
        assert unknown.dependencies is not None, f"{unknown.variable.name}: dependencies not declared"
        declared[unknown.variable.name] = {v.name for v in unknown.dependencies} & inputs
    assert set(declared) == set(found)
    missing = {name: sorted(found[name] - declared[name]) for name in found if found[name] - declared[name]}
    never = {name: sorted(declared[name] - found[name]) for name in found if declared[name] - found[name]}
    assert not missing, f"acts but is not declared: {missing}"
    assert not never, f"declared but never seen: {never}"


def test_positions_and_velocities_depend_on_no_input(wishbone):
    for unknown in wishbone.description.outputs:
        name = unknown.variable.name
        if ".r." in name or ".v." in name or ".angle" in name:
            assert not [v.name for v in unknown.dependencies if v.causality == "input"], name
