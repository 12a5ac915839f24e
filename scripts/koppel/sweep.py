"""Elements that are coupled at ports: the three-pass sweep, and the methods `common` and `cs` built on it.

    S1  leader -> follower   set r, v; get r, v
    S2  follower -> leader   get F0, M; set into the leader's slot
    S3  leader -> follower   get a; set a

One Get and one Set per element and pass, through buffers that are made once. A tree only: every element hangs at one
leader by one follower port.

    tree = Tree([Node(upper, "A"), Node(lower, "A", leader=0, port="B")])
    run_common(tree, t, observe)                      # Model Exchange, one integrator, classical Runge-Kutta
    run_cs(tree, t, observe, order=1, correct=True)   # Co-Simulation with Event Mode
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from .fmu import Block, Instance

AXES = ("x", "y", "z")
PAIRS = ("xx", "xy", "xz", "yy", "yz", "zz")
MOTION, ACCELERATION, LOAD = 6, 3, 9

#: Called with the time whenever all elements are there and their outputs belong together.
Observer = Callable[[float], None]


def motion(port: str) -> list[str]:
    """r and v of a port."""
    return [f"{port}.{part}.{i}" for part in "rv" for i in AXES]


def acceleration(port: str) -> list[str]:
    """a of a port."""
    return [f"{port}.a.{i}" for i in AXES]


def load(port: str, force: str = "F") -> list[str]:
    """Force and inertia of a port: `F` in a leader's slot, `F0` of a follower."""
    return [f"{port}.{force}.{i}" for i in AXES] + [f"{port}.M.{ij}" for ij in PAIRS]


@dataclass
class Node:
    """An element, its follower port, and where it hangs: the number of its leader in the tree and the port there."""

    instance: Instance
    root: str
    leader: int | None = None
    port: str | None = None
    #: Slot of the leader that takes the load, the port itself unless given.
    slot: str | None = None


class Passes:
    """Prepared Get and Set of one element."""

    def __init__(self, node: Node, ports: Sequence[str], slots: Sequence[str]):
        block = node.instance.block
        all_of = lambda names, of: [name for one in of for name in names(one)]
        hangs = [node.root] if node.leader is not None else []
        self.motion_in = block(all_of(motion, hangs))
        self.acceleration_in = block(all_of(acceleration, hangs))
        self.reaction = block(all_of(lambda port: load(port, "F0"), hangs))
        self.motion_out = block(all_of(motion, ports))
        self.acceleration_out = block(all_of(acceleration, ports))
        self.loads = block(all_of(load, slots))

    def write_inputs(self):
        """Set all coupled inputs once more, as they are in the buffers."""
        for block in (self.motion_in, self.acceleration_in, self.loads):
            block.write()


class Tree:
    """Elements with leaders before their followers."""

    def __init__(self, nodes: Sequence[Node]):
        self.nodes = list(nodes)
        self.instances = [node.instance for node in nodes]
        children = [[n for n in nodes if n.leader == i] for i in range(len(nodes))]
        if any(node.leader is not None and node.leader >= i for i, node in enumerate(nodes)):
            raise ValueError("an element comes before its leader")
        ports = [[child.port for child in c] for c in children]
        slots = [[child.slot or child.port for child in c] for c in children]
        if any(len(set(s)) < len(s) for s in slots):
            raise ValueError("two elements in one slot")
        self.passes = [Passes(*of) for of in zip(nodes, ports, slots)]
        # per pass: (block to read, [(its part, block to write)])
        self._out, self._back = [], []
        for i, own in enumerate(self.passes):
            followers = [(k, self.passes[j]) for k, j in enumerate(j for j, n in enumerate(nodes) if n.leader == i)]
            part = lambda block, k, size: block.values[k * size : (k + 1) * size]
            if followers:
                self._out.append(
                    (
                        own,
                        [(part(own.motion_out, k, MOTION), other.motion_in) for k, other in followers],
                        [
                            (part(own.acceleration_out, k, ACCELERATION), other.acceleration_in)
                            for k, other in followers
                        ],
                    )
                )
                self._back.append((own.loads, [(part(own.loads, k, LOAD), other.reaction) for k, other in followers]))
        self._back.reverse()

    def sweep(self):
        """All inputs consistent with the states of all elements."""
        for own, motions, _ in self._out:
            _pass_on(own.motion_out, motions)
        for loads, reactions in self._back:
            for part, reaction in reactions:
                part[:] = reaction.read()
            loads.write()
        for own, _, accelerations in self._out:
            _pass_on(own.acceleration_out, accelerations)

    def write_inputs(self):
        """Set the inputs of the last sweep once more."""
        for one in self.passes:
            one.write_inputs()

    def initialise(self, start: float = 0.0):
        """All elements through Initialization Mode, swept there and in Event Mode."""
        for instance in self.instances:
            instance.enter_initialisation(start)
        self.sweep()
        for instance in self.instances:
            instance.check("fmi3ExitInitializationMode")
        self.sweep()

    def each(self, do: Callable[[Instance], None]):
        """For all elements."""
        for instance in self.instances:
            do(instance)


def _pass_on(source: Block, parts: list[tuple[np.ndarray, Block]]):
    source.read()
    for values, target in parts:
        target.write(values)


# method `common` --------------------------------------------------------------------------------------------------
class Common:
    """The states of all elements (`Equations`) in one vector and their rates by a sweep."""

    def __init__(self, tree: Tree):
        self.tree = tree
        ends = np.cumsum([0] + [instance.nx for instance in tree.instances])
        self._parts = [(i, slice(a, b)) for i, a, b in zip(tree.instances, ends, ends[1:])]
        self.x = np.empty(ends[-1])

    def start(self, t: float):
        """Event Mode -> Continuous-Time Mode; takes the states over."""
        for instance, part in self._parts:
            instance.enter_continuous_time_mode()
            instance.set_time(t)
            self.x[part] = instance.x

    def place(self, t: float, x: np.ndarray):
        """All elements at these states, inputs swept."""
        for instance, part in self._parts:
            instance.set_time(t)
            instance.x[:] = x[part]
            instance.write_states()
        self.tree.sweep()

    def rates(self, t: float, x: np.ndarray) -> np.ndarray:
        """Right-hand side."""
        self.place(t, x)
        return np.concatenate([instance.read_derivatives() for instance, _ in self._parts])

    def complete(self, t: float):
        """End of a step: an element that asks for it gets its Event Mode (quaternions, events)."""
        if any([instance.completed_step() for instance, _ in self._parts]):
            self.tree.each(Instance.enter_event_mode)
            self.tree.sweep()
            self.start(t)

    def rk4(self, t: float, h: float):
        """One step of the classical Runge-Kutta method."""
        f, x = self.rates, self.x
        k1 = f(t, x)
        k2 = f(t + 0.5 * h, x + 0.5 * h * k1)
        k3 = f(t + 0.5 * h, x + 0.5 * h * k2)
        k4 = f(t + h, x + h * k3)
        self.x = x + h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
        self.place(t + h, self.x)
        self.complete(t + h)


def run_common(tree: Tree, t: np.ndarray, observe: Observer):
    """RK4 over the time points `t`; elements are instantiated and have their parameters, nothing else."""
    tree.initialise(t[0])
    common = Common(tree)
    common.start(t[0])
    observe(t[0])
    for at, after in zip(t, t[1:]):
        common.rk4(at, after - at)
        observe(after)


# method `cs` ------------------------------------------------------------------------------------------------------
class Treatment:
    """port.inputs and port.order of an element, set in Event Mode."""

    def __init__(self, instance: Instance):
        self._instance = instance
        self._inputs = instance.block(["port.inputs"], "Enumeration")
        self._order = instance.block(["port.order"], "Int32")

    def set(self, inputs: str, order: int):
        """Take the treatment over."""
        self._inputs.write([self._instance.fmu.coded("port.inputs", inputs)])
        self._order.write([order])


def run_cs(tree: Tree, t: np.ndarray, observe: Observer, order: int = 1, correct: bool = False):
    """Steps between the time points `t`, a sweep in Event Mode at each (elements with event_mode, instantiated).

    `order`: degree of the extrapolated inputs. `correct`: PECE, a second pass over each step with the inputs of its
    end, degree `order` + 1; otherwise `predict`, one doStep per step.
    """
    treatments = [Treatment(instance) for instance in tree.instances]

    def treat(inputs, degree):
        for treatment in treatments:
            treatment.set(inputs, degree)

    tree.initialise(t[0])
    treat("extrapolate", order)
    observe(t[0])
    for at, after in zip(t, t[1:]):
        H = after - at
        saved = [instance.save() for instance in tree.instances] if correct else []
        tree.each(Instance.enter_step_mode)
        tree.each(lambda instance: instance.step(at, H, final=not correct))
        tree.each(Instance.enter_event_mode)
        tree.sweep()
        if correct:
            for instance, state in zip(tree.instances, saved):
                instance.restore(state)
                instance.free_state(state)
            treat("endpoint", order + 1)
            tree.each(Instance.enter_step_mode)
            tree.write_inputs()
            tree.each(lambda instance: instance.step(at, H))
            tree.each(Instance.enter_event_mode)
            tree.sweep()
            treat("extrapolate", order)
        observe(after)
