"""The components of a scene as instances, coupled by the sweep.

    S1  leader -> follower   set r, v; get r, v
    S2  follower -> leader   get F0, M; set into the leader's slot
    S3  leader -> follower   get a; set a

All coupled values lie in two arrays, inputs `u` and outputs `y`, grouped by component and pass, so that one Get or Set of
a component and pass works on the array itself.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import ExitStack

import numpy as np

from ..fmu import Instance, Value
from . import ports
from .closure import Closure
from .definition import Component, Ref, Scene, start_values
from .errors import SceneError
from .graph import Graph, Put, Solve, Step, Take
from .loop import Loop
from .response import Response

Operation = Callable[[], None]


class Network:
    """Instances of all components, made and freed with the `with` block.

    `exchange`: Model Exchange. `event_mode`: Co-Simulation with Event Mode where the FMU has it. `values`: parameters for
    every component that has them.
    """

    def __init__(self, scene: Scene, *, exchange: bool, event_mode: bool, values: Mapping[str, Value], alpha: float):
        if not scene.components:
            raise SceneError(f"{scene.name} has no components")
        self.scene = scene
        self._exchange, self._event_mode, self._values = exchange, event_mode, values
        self.time = scene.start
        self.sweeps = 0
        self._stack = ExitStack()
        self.joints = [_JointPorts(scene, joint) for joint in scene.joints]
        self.graph = Graph(
            scene.components,
            scene.connections,
            feeds=[feed for joint in self.joints for feed in joint.feeds],
            wanted=[output for joint in self.joints for output in joint.wanted],
            depends=self.depends,
        )
        self._at_u = self._positions(self.graph.inputs)
        self._at_y = self._positions(self.graph.outputs)
        self.u, self.y = np.zeros(len(self._at_u)), np.zeros(len(self._at_y))
        self.nominal = np.array([self._component(ref).fmu.nominal(ref[1]) for ref in self._at_y])
        self.closure = Closure(self, self.joints, alpha) if self.joints else None

    def _component(self, ref: Ref) -> Component:
        return self.scene.components[ref[0]]

    def depends(self, output: Ref) -> list[Ref]:
        """Inputs on which an output is declared to depend."""
        fmu = self._component(output).fmu
        declared = fmu.dependencies(output[1])
        names = fmu.names("input") if declared is None else declared
        return [(output[0], name) for name in names]

    def _positions(self, refs: Iterable[Ref]) -> dict[Ref, int]:
        order = sorted(refs, key=lambda ref: (self.graph.rank[ref[0]], ports.pass_of(ref[1]), ref[1]))
        return {ref: i for i, ref in enumerate(order)}

    # instances ------------------------------------------------------------------------------------------------------
    def __enter__(self) -> "Network":
        try:
            self.instances: dict[str, Instance] = {
                name: self._stack.enter_context(self._instantiate(component))
                for name, component in self.scene.components.items()
            }
            self._offers_derivatives = {
                name: component.fmu.capability("providesDirectionalDerivatives")
                for name, component in self.scene.components.items()
            }
            for name, component in self.scene.components.items():
                self.instances[name].set(start_values(component, self._values))
            self._compile()
        except BaseException:
            self._stack.close()
            raise
        return self

    def __exit__(self, *_):
        self._stack.close()

    def _instantiate(self, component: Component) -> Instance:
        if self._exchange:
            if component.fmu.description.modelExchange is None:
                raise SceneError(
                    f"{component.name} ({component.fmu.path.name}) has no Model Exchange: use a method on Co-Simulation"
                )
            return component.fmu.equations(name=component.name)
        event_mode = self._event_mode and component.fmu.capability("hasEventMode")
        return component.fmu.instantiate(event_mode=event_mode, name=component.name)

    def each(self, do: Callable[[Instance], None]):
        """For all components."""
        for instance in self.instances.values():
            do(instance)

    def inputs_of(self, name: str) -> list[Ref]:
        """Coupled inputs of a component in the order of `u`."""
        return [ref for ref in self._at_u if ref[0] == name]

    def outputs_of(self, name: str) -> list[Ref]:
        """Coupled outputs of a component in the order of `y`."""
        return [ref for ref in self._at_y if ref[0] == name]

    def derivative(self, name: str, unknowns: Sequence[str], known: str) -> np.ndarray:
        """d(unknowns)/d(known) of a component, from the FMU or as the change by a unit of `known`."""
        instance = self.instances[name]
        if self._offers_derivatives[name]:
            return instance.directional_derivative(unknowns, [known], [1.0])
        outputs, value = instance.block(unknowns), instance.get(known)
        before = outputs.read().copy()
        instance.set({known: value + 1.0})
        after = outputs.read().copy()
        instance.set({known: value})
        return after - before

    # plans ----------------------------------------------------------------------------------------------------------
    def _compile(self):
        inputs, outputs = self.graph.inputs, self.graph.outputs
        #: Components without Event Mode answer from their linear response between steps.
        self.responses = {
            name: Response(self, name)
            for name, instance in self.instances.items()
            if self._event_mode and not self._exchange and not instance.event_mode
        }
        lasting = {o for o in outputs if ports.is_inertia(o[1]) and ports.constant(self._component(o).fmu, o[1])}
        discrete = {i for i in inputs if self.scene.variable(i).variability == "discrete"}
        fed_by = lambda sources: {i for i, c in self.graph.source.items() if c.source in sources}
        fixed = fed_by(lasting)
        # everything once; then what can change; between events no discrete inputs
        self._first = self.compiled(self.graph.plan(inputs, outputs))
        self._all = self.compiled(self.graph.plan(inputs - fixed, outputs - lasting))
        between = inputs - fixed - discrete
        read = {self.graph.source[i].source for i in between if i in self.graph.source}
        read |= {o for joint in self.joints for o in joint.wanted}
        self._between = self.compiled(self.graph.plan(between, read)) if discrete else self._all
        self.has_discrete = any(self.scene.variable(ref).variability == "discrete" for ref in inputs | outputs)
        self._write_all = [
            self._access(name, refs, self.u, self.inputs_at(refs), write=True)
            for name, refs in self._by_component(inputs - discrete)
        ]
        self._read_all = [self._take(Take(name, refs)) for name, refs in self._by_component(outputs)]
        if self.closure:
            self.closure.compile()

    def _by_component(self, refs: Iterable[Ref]) -> list[tuple[str, tuple[Ref, ...]]]:
        ordered = sorted(refs, key=(self._at_u | self._at_y).get)
        names = dict.fromkeys(ref[0] for ref in ordered)
        return [(name, tuple(ref for ref in ordered if ref[0] == name)) for name in names]

    def compiled(self, steps: Sequence[Step]) -> list[Operation]:
        """The steps as calls without arguments."""
        operations: list[Operation] = []
        for step in steps:
            if isinstance(step, Put):
                operations += [*self.transfers(step.inputs), self._put(step)]
            elif isinstance(step, Take):
                operations.append(self._take(step))
            elif isinstance(step, Solve):
                operations.append(Loop(self, step).solve)
        return operations

    def inputs_at(self, refs: Iterable[Ref]) -> np.ndarray:
        """Positions of inputs in `u`."""
        return np.array([self._at_u[ref] for ref in refs], dtype=int)

    def outputs_at(self, refs: Iterable[Ref]) -> np.ndarray:
        """Positions of outputs in `y`."""
        return np.array([self._at_y[ref] for ref in refs], dtype=int)

    def _put(self, step: Put) -> Operation:
        put = self._access(step.component, step.inputs, self.u, self.inputs_at(step.inputs), write=True)
        response = self.responses.get(step.component)
        return response.putting(put) if response else put

    def _take(self, step: Take) -> Operation:
        at = self.outputs_at(step.outputs)
        get = self._access(step.component, step.outputs, self.y, at, write=False)
        response = self.responses.get(step.component)
        return response.taking(get, at) if response else get

    def _access(self, name: str, refs: Sequence[Ref], array: np.ndarray, at: np.ndarray, write: bool) -> Operation:
        names = [ref[1] for ref in refs]
        if (np.diff(at) == 1).all():
            block = self.instances[name].block(names, memory=array[at[0] : at[-1] + 1])
            return block.set if write else block.get
        block = self.instances[name].block(names)

        def set_gathered():
            np.take(array, at, out=block.values)
            block.set()

        def get_scattered():
            block.get()
            array[at] = block.values

        return set_gathered if write else get_scattered

    def transfers(self, inputs: Iterable[Ref]) -> list[Operation]:
        """Copies from `y` to `u` for inputs with a source, runs of neighbours at once."""
        pairs = [
            (self._at_u[i], self._at_y[c.source], c.factor, c.offset)
            for i in inputs
            if (c := self.graph.source.get(i)) is not None
        ]
        runs: list[list[tuple]] = []
        for pair in sorted(pairs):
            last = runs[-1][-1] if runs else None
            if last and all(b - a == 1 for a, b in zip(last[:2], pair[:2])) and last[2:] == pair[2:]:
                runs[-1].append(pair)
            else:
                runs.append([pair])
        return [_copy(self.u, self.y, run) for run in runs]

    # sweeping -------------------------------------------------------------------------------------------------------
    def sweep(self, discrete: bool = True):
        """All inputs consistent with the states of all components, closing forces included.

        `discrete`: discrete inputs too (Initialization and Event Mode).
        """
        self._sweep(self._all if discrete else self._between)

    def first_sweep(self):
        """The sweep that also passes what stays constant."""
        self._sweep(self._first)

    def _sweep(self, operations: list[Operation]):
        self.sweeps += 1
        if self.closure:
            self.closure.release()
        for operation in operations:
            operation()
        if self.closure:
            self.closure.solve()

    def write_inputs(self):
        """Set all continuous coupled inputs as they are in `u`."""
        for write in self._write_all:
            write()

    def read_outputs(self):
        """Get all coupled outputs into `y`."""
        for read in self._read_all:
            read()

    # phases ---------------------------------------------------------------------------------------------------------
    def initialise(self, start: float, stop: float):
        """All components through Initialization Mode, swept there; the loop must be closed at the start."""
        self.time = start
        self.each(lambda instance: instance.enter_initialisation(start, stop))
        self.first_sweep()
        self._refuse_lost_inertia()
        if self.closure:
            self.closure.start()
        self.each(lambda instance: instance.check("fmi3ExitInitializationMode"))

    def _refuse_lost_inertia(self):
        """Bias force without inertia is the whole load of massless followers only."""
        for source in {c.source for c in self.graph.source.values()}:
            inertia = ports.inertia_of_bias(self._component(source).fmu, source[1])
            if not inertia or any((source[0], name) in self._at_y for name in inertia):
                continue
            values = self.instances[source[0]].get_all(inertia)
            heavy = {name: value for name, value in values.items() if value != 0.0}
            if heavy:
                name, value = next(iter(heavy.items()))
                raise SceneError(
                    f"{'.'.join(source)} is passed on without the inertia behind it, {name} = {value:g} kg: its leader "
                    "takes massless followers only"
                )

    def settle(self, sweep_first: bool = True) -> tuple[float, bool]:
        """Event Mode of all: sweep and update until none asks for more. Time of the next event; whether states moved."""
        moved = False
        for turn in range(100):
            if turn or sweep_first:
                self.sweep()
            updates = {name: instance.update_once() for name, instance in self.instances.items() if instance.event_mode}
            ended = [name for name, update in updates.items() if update.terminate]
            if ended:
                raise SceneError(f"{ended[0]} asks to end the simulation at t = {self.time:.9g} s")
            moved |= any(update.moved for update in updates.values())
            if not any(update.again or update.moved for update in updates.values()):
                if self.has_discrete:
                    self.sweep()
                return min((update.next_event for update in updates.values()), default=np.inf), moved
        raise SceneError(f"{self.scene.name}: the event iteration at t = {self.time:.9g} s does not end")

    def member(self, name: str) -> tuple[list[Operation], Operation, Operation]:
        """For a plain exchange: the copies into the inputs of a component, their Set, and the Get of its outputs."""
        inputs, outputs = self.inputs_of(name), self.outputs_of(name)
        put = self._put(Put(name, tuple(inputs))) if inputs else _nothing
        take = self._take(Take(name, tuple(outputs))) if outputs else _nothing
        return self.transfers(inputs), put, take

    # observing ------------------------------------------------------------------------------------------------------
    def gap(self) -> tuple[float, float]:
        """Largest distance and relative speed of the closing joints, as last swept [m, m/s]."""
        return self.closure.gap() if self.closure else (0.0, 0.0)

    def output_variables(self) -> list[str]:
        """Names of the variables in `y`."""
        return [ref[1] for ref in self._at_y]

    def output_name(self, position: int) -> str:
        """`component.variable` at a position in `y`."""
        return ".".join(list(self._at_y)[position])

    def counts(self) -> dict[str, dict[str, int]]:
        """Calls of each C function per component."""
        return {name: dict(instance.counts) for name, instance in self.instances.items()}


def _nothing():
    """No variables."""


def _copy(u: np.ndarray, y: np.ndarray, run: list[tuple]) -> Operation:
    (to, of, factor, offset), n = run[0], len(run)
    target, source = u[to : to + n], y[of : of + n]
    if factor == 1.0 and offset == 0.0:
        return lambda: target.__setitem__(slice(None), source)

    def transform():
        np.multiply(source, factor, out=target)
        np.add(target, offset, out=target)

    return transform


class _JointPorts:
    """Variables of a closing joint: forces on both leaders, and their motion, along the joint's axes."""

    def __init__(self, scene: Scene, joint):
        self.name = f"{joint.first} - {joint.second}"
        self.axes = scene.joint_axes(joint)
        self._ends = []
        for name in (joint.first, joint.second):
            component, port = scene.port(name)
            slot = scene.joint_slot(name)
            of = lambda part: [(component.name, variable) for variable in port.vector(part, self.axes)]
            self._ends.append({part: of(part) for part in (port.position, "v", "a")} | {"F": of(port.slot(slot, "F"))})
            self.position = port.position

    def pair(self, part: str) -> tuple[list[Ref], list[Ref]]:
        """A part (position, v, a, F) of the first and of the second port."""
        return self._ends[0][part], self._ends[1][part]

    @property
    def feeds(self) -> list[Ref]:
        """Inputs that the host feeds."""
        return [ref for end in self.pair("F") for ref in end]

    @property
    def wanted(self) -> list[Ref]:
        """Outputs that the host reads."""
        return [ref for part in (self.position, "v", "a") for end in self.pair(part) for ref in end]
