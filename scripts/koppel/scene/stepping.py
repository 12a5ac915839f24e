"""What the methods on Co-Simulation have in common: input treatment, saved states, the check for divergence."""

from collections.abc import Iterable

import numpy as np

from ..fmu import Instance
from .errors import Diverged, SceneError
from .network import Network

#: A coupled value this many times its nominal value has diverged.
DIVERGED = 1e9


class Treatment:
    """port.inputs and port.order of the components that have them."""

    def __init__(self, instances: Iterable[Instance]):
        self._blocks = [
            (instance.fmu, instance.block(["port.inputs"], "Enumeration"), instance.block(["port.order"], "Int32"))
            for instance in instances
            if "port.inputs" in instance.fmu.variables
        ]

    def set(self, inputs: str, order: int):
        """hold, extrapolate or endpoint, with polynomials of this degree."""
        for fmu, kind, degree in self._blocks:
            kind.write([fmu.coded("port.inputs", inputs)])
            degree.write([order])


class Resets:
    """port.reset of the components that have it: a changed value announces a discontinuity."""

    def __init__(self, instances: Iterable[Instance]):
        self._blocks = [i.block(["port.reset"]) for i in instances if "port.reset" in i.fmu.variables]
        self._number = 0

    def announce(self):
        """Make the components forget the samples of their inputs."""
        self._number += 1
        for block in self._blocks:
            block.write([float(self._number)])


class Saved:
    """States of all components, to be given back."""

    def __init__(self, network: Network):
        for name, instance in network.instances.items():
            if not instance.fmu.capability("canGetAndSetFMUState"):
                raise SceneError(
                    f"{name} ({instance.fmu.path.name}) cannot save its state: use cs-predict, jacobi or seidel"
                )
        self._instances = list(network.instances.values())
        self._states: list = []

    def save(self):
        """Save all states."""
        self._states = [instance.save() for instance in self._instances]

    def restore(self):
        """Back to the saved states."""
        for instance, state in zip(self._instances, self._states):
            instance.restore(state)

    def free(self):
        """Forget them."""
        for instance, state in zip(self._instances, self._states):
            instance.free_state(state)
        self._states = []


class Bound:
    """Coupled outputs stay within a reasonable range."""

    def __init__(self, network: Network):
        self._y, self._largest = network.y, DIVERGED * network.nominal
        self._network = network

    def check(self, t: float):
        """Raises `Diverged`."""
        fine = np.abs(self._y) <= self._largest
        if not fine.all():
            worst = int(np.argmin(fine))
            name = self._network.output_name(worst)
            raise Diverged(t, f"{name} = {self._y[worst]:.3e}")
