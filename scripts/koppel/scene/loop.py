"""A loop of raw connections: u = L y(u) + offset, y affine in u, solved by the host.

(I - L D) du = L y(u) + offset - u,   D = dy/du from directional derivatives
"""

from typing import TYPE_CHECKING

import numpy as np

from .errors import SceneError
from .graph import Put, Solve, Take

if TYPE_CHECKING:
    from .network import Network

#: Newton passes; an affine loop needs one.
PASSES = 3
#: Largest residual over the largest value in the loop, or 1.
SOLVED = 1e-11


class Loop:
    """The inputs and outputs of one loop in a network."""

    def __init__(self, network: "Network", step: Solve):
        self._network = network
        self._inputs, self._outputs = step.inputs, step.outputs
        graph = network.graph
        self._u = network.inputs_at(step.inputs)
        connections = [graph.source[i] for i in step.inputs]
        self._y = network.outputs_at(c.source for c in connections)
        self._factor, self._offset = (np.array([getattr(c, of) for c in connections]) for of in ("factor", "offset"))
        components = dict.fromkeys(ref[0] for ref in (*step.inputs, *step.outputs))
        of = lambda name, refs: tuple(ref for ref in refs if ref[0] == name)
        self._members = [(name, of(name, step.inputs), of(name, step.outputs)) for name in components]
        self._put, self._take = [], []
        for name, inputs, outputs in self._members:
            self._put += network.compiled([Put(name, inputs)])[-1:] if inputs else []
            self._take += network.compiled([Take(name, outputs)])

    def _residual(self) -> np.ndarray:
        for operation in (*self._put, *self._take):
            operation()
        return self._factor * self._network.y[self._y] + self._offset - self._network.u[self._u]

    def _matrix(self) -> np.ndarray:
        """I - L D."""
        of_output = {ref: i for i, ref in enumerate(self._outputs)}
        D = np.zeros((len(self._outputs), len(self._inputs)))
        column = 0
        for name, inputs, outputs in self._members:
            rows = [of_output[ref] for ref in outputs]
            for _, known in inputs:
                D[rows, column] = self._network.derivative(name, [o[1] for o in outputs], known)
                column += 1
        sources = [of_output[self._network.graph.source[i].source] for i in self._inputs]
        return np.eye(len(self._inputs)) - self._factor[:, None] * D[sources]

    def solve(self):
        """Inputs and outputs of the loop that fit each other."""
        u = self._network.u
        residual = self._residual()
        for _ in range(PASSES):
            u[self._u] += np.linalg.solve(self._matrix(), residual)
            residual = self._residual()
            if np.abs(residual).max() <= SOLVED * max(1.0, np.abs(u[self._u]).max()):
                return
        worst = int(np.argmax(np.abs(residual)))
        raise SceneError(
            f"the loop through {'.'.join(self._inputs[worst])} is not solved at t = {self._network.time:.6g} s after {PASSES} "
            f"Newton passes: {residual[worst]:.3g} left (is the follower's force affine in its acceleration?)"
        )
