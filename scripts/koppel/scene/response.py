"""Components without Event Mode between two steps: no Get after Set is allowed there, so their outputs follow the inputs by
directional derivatives, y = y_old + D (u - u_old), which is exact for affine ports."""

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from .errors import SceneError

if TYPE_CHECKING:
    from .network import Network


class Response:
    """Outputs of one component as a linear function of its inputs."""

    def __init__(self, network: "Network", name: str):
        self._network, self._name = network, name
        #: Between steps; otherwise (Initialization Mode) values are read and set as always.
        self.active = False
        self._inputs, self._outputs = network.inputs_of(name), network.outputs_of(name)
        #: By input: the outputs that depend on it.
        on = [network.depends(output) for output in self._outputs]
        self._dependent = [[row for row, known in enumerate(on) if ref in known] for ref in self._inputs]
        fmu = network.scene.components[name].fmu
        if any(self._dependent) and not fmu.capability("providesDirectionalDerivatives"):
            raise SceneError(
                f"{name} ({fmu.path.name}) has neither Event Mode nor directional derivatives: use method jacobi or seidel"
            )
        instance = network.instances[name]
        self._u, self._y = network.inputs_at(self._inputs), network.outputs_at(self._outputs)
        self._read_u = instance.block([ref[1] for ref in self._inputs])
        self._read_y = instance.block([ref[1] for ref in self._outputs])
        self._D = np.zeros((len(self._outputs), len(self._inputs)))

    def after_step(self):
        """Take values and derivatives of the end of the step; inputs are those of its polynomials' ends."""
        self._u_old = self._read_u.read().copy()
        self._y_old = self._read_y.read().copy()
        for column, (ref, rows) in enumerate(zip(self._inputs, self._dependent)):
            if rows:
                unknowns = [self._outputs[row][1] for row in rows]
                self._D[rows, column] = self._network.derivative(self._name, unknowns, ref[1])
        self.active = True

    def before_step(self):
        """Set the inputs that the sweep has found."""
        self._read_u.write(self._network.u[self._u])

    def taking(self, get: Callable[[], None], at: np.ndarray) -> Callable[[], None]:
        """The Get `get` of outputs at the positions `at`, or their linear response."""
        rows = np.searchsorted(self._y, at)

        def take():
            if not self.active:
                get()
                return
            change = self._network.u[self._u] - self._u_old
            self._network.y[at] = self._y_old[rows] + self._D[rows] @ change

        return take

    def putting(self, set_inputs: Callable[[], None]) -> Callable[[], None]:
        """The Set `set_inputs`, left to `before_step` between steps."""

        def put():
            if not self.active:
                set_inputs()

        return put
