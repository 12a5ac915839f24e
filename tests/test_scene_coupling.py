"""What holds at the ports of every scene: force laws, the sweep as a linear solve, saved states, what is left out."""

import numpy as np
import pytest
from koppel import library, scenes
from koppel.scene import Scene, SceneError
from koppel.scene.network import Network
from koppel.scene.ports import PAIRS, port, port_names
from scipy.integrate import solve_ivp

SCENES = ["two_mass", "double_pendulum", "four_bar", "double_wishbone"]
#: Steps that fit the samples of each scene.
H = {"two_mass": 5e-3, "double_pendulum": 5e-3, "four_bar": 7.5e-3, "double_wishbone": 5e-3}


@pytest.fixture(params=SCENES)
def scene(fmu, request):
    return library.scene(request.param, fmu)


@pytest.fixture
def network(scene):
    """Co-Simulation with Event Mode, all components some way into the motion, swept, in Event Mode."""
    network = Network(scene, exchange=False, event_mode=True, values=scenes.fixed("rk4", 1e-3), alpha=2.0)
    with network:
        network.initialise(0.0, 10.0)
        network.settle()
        for i in range(40):
            network.each(lambda instance: instance.check("fmi3EnterStepMode"))
            network.each(lambda instance, t=i * 5e-3: instance.step(t, 5e-3, final=False))
            network.each(lambda instance: instance.enter_event_mode())
            network.settle()
        yield network


def followers(scene):
    """(component, port) of all follower ports."""
    for component in scene.components.values():
        for name in port_names(component.fmu):
            one = port(component.fmu, name, component.choice("port.kind"))
            connected = any(
                c.target[0] == component.name and c.target[1].startswith(f"{name}.") for c in scene.connections
            )
            if not one.leader and (connected or component.choice("port.kind") is None):
                yield component, one


def symmetric(values):
    """The matrix of the six values, or of the one."""
    if len(values) == 1:
        return np.array([[values[0]]])
    M = np.zeros((3, 3))
    for pair, value in zip(PAIRS, values):
        i, j = ("xyz".index(axis) for axis in pair)
        M[i, j] = M[j, i] = value
    return M


def test_force_is_bias_force_less_inertia_times_acceleration(network):
    """F = F0 - M a on every follower port, M symmetric by its six values and positive semidefinite: 1e-10 relative."""
    tested = 0
    for component, one in followers(network.scene):
        instance = network.instances[component.name]
        axes = ("x", "y", "z")
        read = lambda names: np.array([instance.get(name) for name in names])
        force, bias, M = (
            read(one.vector("F", axes)),
            read(one.vector("F0", axes)),
            symmetric(read(one.inertia("M", axes))),
        )
        a = read(one.vector("a", axes)) if one.vector("a", axes) else np.zeros(len(force))
        scale = max(np.abs(bias).max(), np.abs(M @ a).max(), 1e-3)
        assert np.abs(force - (bias - M @ a)).max() <= 1e-10 * scale, f"{component.name}.{one.name}"
        assert np.linalg.eigvalsh(M).min() >= -1e-12 * max(1.0, np.abs(M).max())
        tested += 1
    assert tested >= len([c for c in network.scene.connections if c.target[1].endswith(("a.x", ".a"))]) > 0


def interface_solution(network, feeds):
    """All coupled inputs by one linear solve, u = L y(u) with y linear about the present inputs.

    Written out with the FMUs' directional derivatives, one dense system; the inertias, whose products with forces are not
    linear, are kept.
    """
    scene = network.scene
    inputs = [ref for ref in network._at_u if ".M" not in ref[1]]
    at = {ref: i for i, ref in enumerate(inputs)}
    u = np.array([network.instances[name].get(variable) for name, variable in inputs])
    A, b = np.eye(len(inputs)), u.copy()
    for connection in scene.connections:
        if connection.target not in at:
            continue
        name, output = connection.source
        row, instance = at[connection.target], network.instances[name]
        mine = [ref for ref in inputs if ref[0] == name]
        D = [instance.directional_derivative([output], [ref[1]], [1.0])[0] for ref in mine]
        A[row, [at[ref] for ref in mine]] -= connection.factor * np.array(D)
        b[row] = connection.factor * (instance.get(output) - np.dot(D, u[[at[ref] for ref in mine]]))
    if feeds:
        closing_rows(network, at, u, A, b, feeds)
    return at, np.linalg.solve(A, b)


def closing_rows(network, at, u, A, b, feeds):
    """Rows of the closing forces: first + second = 0, and the stabilised relative acceleration is zero."""
    joint, alpha = network.joints[0], network.closure.alpha
    for axis in range(len(joint.axes)):
        (one, two) = (joint.pair("F")[end][axis] for end in (0, 1))
        A[at[two]], b[at[two]] = 0.0, 0.0
        A[at[two], [at[one], at[two]]] = 1.0
        A[at[one]], b[at[one]] = 0.0, 0.0
        for part, factor in (("a", 1.0), ("v", 2.0 * alpha), (joint.position, alpha**2)):
            for sign, end in ((1.0, 0), (-1.0, 1)):
                name, output = joint.pair(part)[end][axis]
                mine = [ref for ref in at if ref[0] == name]
                instance = network.instances[name]
                D = np.array([instance.directional_derivative([output], [ref[1]], [1.0])[0] for ref in mine])
                A[at[one], [at[ref] for ref in mine]] += sign * factor * D
                b[at[one]] -= sign * factor * (instance.get(output) - D @ u[[at[ref] for ref in mine]])


def test_sweep_is_the_linear_interface_solve(network):
    """1e-10 relative, for every coupled input, closing forces included."""
    feeds = [ref for joint in network.joints for ref in joint.feeds]
    at, solved = interface_solution(network, feeds)
    for kind in ("r", "v", "a", "F", "s"):
        rows = [i for (_, name), i in at.items() if f".{kind}." in name or name.endswith(f".{kind}")]
        refs = [ref for ref, i in at.items() if i in rows]
        if rows:
            swept = network.u[network.inputs_at(refs)]
            assert np.abs(swept - solved[rows]).max() <= 1e-10 * max(1.0, np.abs(swept).max()), kind


def test_sweep_from_wrong_inputs_comes_to_the_same(network):
    """Nothing of the sweep depends on what the inputs were before."""
    right = network.u.copy()
    network.u[:] = np.random.default_rng(1).normal(size=len(right))
    network.first_sweep()
    assert np.abs(network.u - right).max() <= 1e-12 * np.abs(right).max()


def test_save_step_restore_step_is_bit_identical(network):
    """Through a saved state of all components, with everything that is coupled."""
    states = {name: instance.save() for name, instance in network.instances.items()}
    inputs = network.u.copy()
    ends = []
    for _ in range(2):
        network.each(lambda instance: instance.check("fmi3EnterStepMode"))
        network.each(lambda instance: instance.step(0.2, 5e-3, final=False))
        network.each(lambda instance: instance.enter_event_mode())
        network.sweep()
        ends.append((network.u.copy(), network.y.copy()))
        for name, instance in network.instances.items():
            instance.restore(states[name])
        network.u[:] = inputs
    assert (ends[0][0] == ends[1][0]).all() and (ends[0][1] == ends[1][1]).all()
    assert not (ends[0][0] == inputs).all()
    for name, instance in network.instances.items():
        instance.free_state(states[name])


METHODS = [
    {"method": "common", "integrator": "rk4"},
    {"method": "common", "integrator": "dopri5"},
    {"method": "cs-predict"},
    {"method": "cs-pece"},
]


@pytest.mark.parametrize("how", METHODS, ids=lambda how: "-".join(how.values()))
def test_recording_changes_no_result(scene, how):
    """Everything recorded, one variable, or that at every tenth sample: the same bits at common times."""
    name = scene.recorded[0]
    options = {"H": H[scene.name], "stop": 0.15, "interval": 0.015, **how}
    full = scene.run(audit=True, **options)
    scene.recorded[:] = [name]
    assert (scene.run(**options)[name] == full[name]).all()
    last = scene.run(**{**options, "interval": 0.15} if how["method"] == "common" else options)[name][-1]
    assert last == pytest.approx(full[name][-1], abs=1e-13)


def test_runs_repeat_bit_for_bit(scene):
    options = {"method": "cs-pece", "H": H[scene.name], "stop": 0.15, "interval": 0.015}
    assert (scene.run(**options).values == scene.run(**options).values).all()


# leaving out --------------------------------------------------------------------------------------------------------
def test_a_component_that_is_left_out_is_not_called(fmu):
    """Without the load the scene loads one FMU less, and makes no call to it."""
    with_load, without = (library.scene("double_wishbone", fmu, load=load) for load in (True, False))
    options = {"integrator": "rk4", "step": 0.05, "stop": 0.5}
    full, left = with_load.run(**options), without.run(**options)
    assert set(full.calls) - set(left.calls) == {"load"}
    assert full.calls["load"]["fmi3GetFloat64"] > 0
    assert left.components[0] == full.components[0] - 1
    # the others are called as before, but for the slot of the load and its motion
    assert left.calls["upper"] == full.calls["upper"]
    assert left.counts["calls"] < full.counts["calls"]


def test_only_coupled_and_recorded_variables_are_exchanged(fmu):
    """Planar: no y; no true force, no energy, no third axis. A load's constant inertia goes once."""
    scene = library.scene("double_wishbone", fmu)
    names = {variable for c in scene.connections for _, variable in (c.source, c.target)}
    assert not any(name.endswith((".y", "yy", "xy", "yz")) for name in names)
    assert not any(".F." in c.source[1] for c in scene.connections)
    result = scene.run(integrator="rk4", step=0.05, stop=1.0)
    exchanged, available = result.variables
    assert exchanged < available / 4
    assert f"variables exchanged {exchanged} of {available}" in result.summary()
    # one Get of F0 per right-hand side; M is read in the first sweep only, together with F0
    sweeps = result.counts["sweeps"]
    assert result.calls["load"]["fmi3GetFloat64"] <= sweeps + 2


def test_calls_of_a_tree_are_one_get_and_one_set_per_element_and_pass(fmu):
    scene = library.scene("double_pendulum", fmu)
    result = scene.run(method="common", integrator="rk4", step=0.01, record=False)
    sweeps = result.counts["sweeps"]
    # upper: get r, v; set F, M; get a. lower: set r, v; get F0, M; set a
    assert result.calls["upper"]["fmi3GetFloat64"] == 2 * sweeps
    assert result.calls["lower"]["fmi3GetFloat64"] == sweeps
    # two more Sets: start values
    assert result.calls["upper"]["fmi3SetFloat64"] == sweeps + 1
    assert result.calls["lower"]["fmi3SetFloat64"] == 2 * sweeps + 1


# closing joints -----------------------------------------------------------------------------------------------------
def spatial_four_bar(fmu, **changes):
    """The four-bar with joints that could turn in space."""
    scene = library.scene("four_bar", fmu)
    for name in scene.components:
        scene.set(name, **{"joint.kind": "revolute", **changes.get(name, {})})
    made = Scene("spatial", fmu)
    for component in scene.components.values():
        made.add(component.name, component.fmu, **component.values)
    made.connect("link1.B", "link2.A")
    made.close("link2.B", "link3.B", alpha=2.0)
    made.record(*scene.recorded, interval=0.15)
    made.configure(stop=3.0)
    return made


def test_rank_of_a_planar_mechanism_in_space(fmu):
    """Hinges in one plane: K has no y direction, and the motion is the planar one."""
    spatial, planar = spatial_four_bar(fmu), library.scene("four_bar", fmu)
    options = {"integrator": "rk4", "step": 0.01, "interval": 0.15}
    one, two = (scene.run(**options).values for scene in (spatial, planar))
    assert np.abs(one - two).max() <= 1e-9
    with Network(spatial, exchange=True, event_mode=False, values={}, alpha=2.0) as network:
        network.initialise(0.0, 1.0)
        assert network.closure.size == 3 and network.closure.rank == 2


def test_an_open_loop_is_refused(fmu):
    scene = library.scene("four_bar", fmu)
    scene.set("link3", **{"angle.theta": 2.0})
    with pytest.raises(SceneError, match=r"link2.B - link3.B: open at the start by [\d.]+ m .*assemble"):
        scene.run(integrator="rk4", step=0.015)


def test_moving_apart_is_refused(fmu):
    scene = library.scene("four_bar", fmu)
    scene.set("link3", **{"angle_rate.theta": 1e-6})
    with pytest.raises(SceneError, match=r"open at the start by .* 1.38e-06 m/s"):
        scene.run(integrator="rk4", step=0.015)


def test_assembly_finds_the_closed_loop(fmu):
    """From start angles off by up to 0.05 rad back to the benchmark's, the crank kept; and rates that fit a turning crank."""
    scene = library.scene("four_bar", fmu)
    exact = {name: scene.components[name].values["angle.theta"] for name in ("link2", "link3")}
    scene.set("link2", **{"angle.theta": exact["link2"] + 0.05})
    scene.set("link3", **{"angle.theta": exact["link3"] - 0.03})
    scene.set("link1", **{"angle_rate.theta": 0.7})
    scene.assemble(f"{name}.{state}.theta" for name in exact for state in ("angle", "angle_rate"))
    result = scene.run(integrator="rk4", step=0.015, stop=0.03)
    for name, angle in exact.items():
        assert result[f"{name}.angle.theta"][0] == pytest.approx(angle, abs=1e-9)
    assert result["link1.angle_rate.theta"][0] == 0.7
    assert result.gap[0] <= 1e-9 and result.gap_rate[0] <= 1e-9
    assert abs(result["link3.angle_rate.theta"][0]) > 0.01


def test_assembly_that_cannot_close_says_so(fmu):
    scene = library.scene("four_bar", fmu)
    scene.set("link3", **{"A.r.x": 9.0})
    scene.assemble(["link2.angle.theta", "link3.angle.theta"])
    with pytest.raises(SceneError, match="open at the start by"):
        scene.run(integrator="rk4", step=0.015)


def test_links_in_line_are_a_singular_closure(fmu):
    """Two rods that just span the distance of their fixed points: across the line the joint holds them, along it no force
    can do what the motion would need."""
    scene = Scene("in_line", fmu)
    rod = {"mass": 1.0, "length": 1.0}
    scene.add("left", "link2", **rod, **{"angle.theta": 0.0})
    scene.add("right", "link2", **rod, **{"angle.theta": np.pi, "A.r.x": 2.0})
    scene.close("left.B", "right.B")
    with pytest.raises(SceneError, match=r"inconsistent or singular closure of left.B - right.B at t = 0.005 s"):
        scene.run(integrator="rk4", step=0.01, stop=0.01, interval=0.01)


def two_loops(fmu):
    """Three uprights of 1 m and 1 kg under two bars of the same kind, upright and falling: both loops share the middle one."""
    weight = {"mass": 1.0, "gravity.z": -9.81}
    rod, upright = {**weight, "length": 1.0, "angle.theta": 0.0}, {"angle.theta": np.pi / 2, "angle_rate.theta": -1.0}
    tip = {f"point.{point}.{axis}": value for point in "CP" for axis, value in (("x", 0.0), ("z", 1.0))}
    inertia = {f"inertia.{axis}": 1.0 / 12.0 for axis in ("xx", "yy", "zz")}
    scene = Scene("two_loops", fmu)
    scene.add("left", "link2", **{**rod, **upright})
    # the middle one has two places for loads at its tip
    middle = {"com.x": 0.0, "com.z": 0.5, "B.r.x": 1.0, "B.r.z": 0.0, "angle_rate.psi": -1.0, "force.kind": "input"}
    scene.add("middle", "link3", **weight, **inertia, **tip, **middle)
    scene.add("right", "link2", **{**rod, **upright, "A.r.x": 2.0})
    scene.add("bar1", "link2", **rod)
    scene.add("bar2", "link2", **rod)
    scene.connect("left.B", "bar1.A")
    scene.connect("middle.C", "bar2.A")
    scene.close("bar1.B", "middle.P", alpha=5.0)
    scene.close("bar2.B", "right.B")
    scene.record("left.angle.theta", "middle.angle.psi", "right.angle.theta", "bar1.angle.theta", interval=0.05)
    scene.configure(stop=0.4)
    return scene


@pytest.mark.parametrize(
    ("how", "limit"), [({"integrator": "rk4", "step": 5e-3}, 1e-9), ({"method": "cs-pece", "H": 2.5e-3}, 1e-4)]
)
def test_joints_of_a_scene_are_solved_together(fmu, how, limit):
    """N-four-bar, N = 2: uprights stay parallel, so that it is one pendulum, before it comes to its singular position:
    ((N + 1)/3 + N) phi'' = -((N + 1)/2 + N) 9.81 cos(phi)."""
    result = two_loops(fmu).run(**how)
    rates = lambda _t, y: [y[1], -3.5 / 3.0 * 9.81 * np.cos(y[0])]
    phi = solve_ivp(rates, (0.0, 0.4), [np.pi / 2, -1.0], "DOP853", result.t, rtol=1e-12, atol=1e-12).y[0]
    assert np.ptp(phi) > 0.5
    for name, zero in (("left.angle.theta", 0.0), ("middle.angle.psi", np.pi / 2), ("right.angle.theta", 0.0)):
        assert np.abs(result[name] + zero - phi).max() <= limit
    assert np.abs(result["bar1.angle.theta"]).max() <= limit
