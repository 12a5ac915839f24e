"""Methods `jacobi` and `seidel`: what a plain host does. Get along the connections, Set, doStep; nothing else."""

import numpy as np

from .definition import Scene
from .errors import NotApplicable, SceneError
from .network import Network
from .ports import constant, is_inertia, is_motion, is_true_force
from .sampling import points_between
from .stepping import Bound, Treatment


class Exchange:
    """One exchange per step. jacobi: all values of the step's start; seidel: leaders step first and pass what they reach."""

    def __init__(self, network: Network, H: float, order: int, seidel: bool, raw: bool):
        scene = network.scene
        if scene.joints:
            raise NotApplicable(
                f"{scene.name}: jacobi and seidel cannot solve closing joints; use common, cs, or a compliant joint (bushing)"
            )
        if not raw:
            refuse_raw(scene)
        self._network, self._H, self._seidel = network, H, seidel
        self._bound = Bound(network)
        followers = {c.target[0] for c in scene.connections if is_motion(c.target[1])} if seidel else set()
        instances = network.instances
        self._leading = Treatment(instances[name] for name in instances if name not in followers)
        self._following = Treatment(instances[name] for name in followers)
        self._order = order
        self._members = [
            (instances[name], network.member(name)) for name in (_leaders_first(scene) if seidel else instances)
        ]
        self.evaluations = self.steps = self.rejected = 0

    #: Passes over the simulated time.
    passes = 1.0

    def start(self, samples: np.ndarray, recorder):
        """Initialization, first sample."""
        for a, b in zip(samples, samples[1:]):
            points_between(a, b, self._H)
        self._network.initialise(samples[0], samples[-1])
        self._leading.set("extrapolate", self._order)
        self._following.set("endpoint", max(1, self._order))
        self._network.read_outputs()
        recorder.take()

    def loop(self, samples: np.ndarray, recorder):
        """From the first sample to the last."""
        step = self._seidel_step if self._seidel else self._jacobi_step
        for a, b in zip(samples, samples[1:]):
            points = points_between(a, b, self._H).tolist()
            for t, after in zip(points, points[1:]):
                step(t, after - t)
                self._network.time = after
                self.steps += 1
                self._bound.check(after)
            recorder.take()

    def _jacobi_step(self, t: float, H: float):
        for _, (pass_on, put, _) in self._members:
            for copy in pass_on:
                copy()
            put()
        for instance, _ in self._members:
            instance.step(t, H)
        for _, (_, _, take) in self._members:
            take()

    def _seidel_step(self, t: float, H: float):
        for instance, (pass_on, put, take) in self._members:
            for copy in pass_on:
                copy()
            put()
            instance.step(t, H)
            take()


def refuse_raw(scene: Scene):
    """A plain exchange of the true force of a follower with inertia diverges above some ratio of masses."""
    for connection in scene.connections:
        (name, variable), target = connection.source, connection.target
        fmu = scene.components[name].fmu
        if not (is_true_force(variable) and is_true_force(target[1])):
            continue
        port = variable[: -len(".F")] if variable.endswith(".F") else variable.rsplit(".F.", 1)[0]
        inertia = [v for v in fmu.variables if v.startswith(f"{port}.M") and is_inertia(v)]
        if any(not constant(fmu, v) for v in inertia):
            raise SceneError(
                f"raw connection of {name}.{port} to {target[0]}: the follower has inertia (M), and a plain exchange of its "
                "true force diverges with its mass; connect it with raw=False, or run with raw=True to see it"
            )


def _leaders_first(scene: Scene) -> list[str]:
    """Sampled components, then leaders before their followers."""
    leaders = {name: set() for name in scene.components}
    for connection in scene.connections:
        if is_motion(connection.source[1]):
            leaders[connection.target[0]].add(connection.source[0])
    sampled = lambda name: any(
        v.causality == "output" and v.variability == "discrete" for v in scene.components[name].fmu.variables.values()
    )
    order: list[str] = []
    waiting = sorted(scene.components, key=lambda name: not sampled(name))
    while waiting:
        free = [name for name in waiting if sampled(name) or leaders[name] <= set(order)]
        # components that lead each other go as they come
        order.append((free or waiting)[0])
        waiting.remove(order[-1])
    return order
