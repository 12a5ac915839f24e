"""Samples of recorded variables, and the points of time of a run."""

import numpy as np

from .definition import Scene
from .errors import SceneError

ENERGIES = ("energy.kinetic", "energy.potential", "energy.dissipated", "energy.supplied", "energy.port")


def sample_times(start: float, stop: float, interval: float | None) -> np.ndarray:
    """Equidistant samples; 200 intervals unless their length is given."""
    if not stop > start:
        raise SceneError(f"stop = {stop}: must be after start = {start}")
    count = 200 if interval is None else round((stop - start) / interval)
    if interval is not None and (count < 1 or abs(count * interval - (stop - start)) > 1e-9 * (stop - start)):
        raise SceneError(f"interval = {interval} s does not divide {stop - start:g} s")
    return start + (stop - start) * np.arange(count + 1) / count


def points_between(t0: float, t1: float, H: float) -> np.ndarray:
    """Communication points from one sample to the next, which H must divide."""
    count = round((t1 - t0) / H)
    if count < 1 or abs(count * H - (t1 - t0)) > 1e-6 * H:
        raise SceneError(f"H = {H} s does not divide the distance of the samples, {t1 - t0:.9g} s")
    points = t0 + (t1 - t0) * np.arange(count + 1) / count
    points[-1] = t1
    return points


class Recorder:
    """Reads the recorded variables of a network, one Get per component, and its energies if they are asked for."""

    def __init__(self, network, names: list[str], audit: bool, samples: int):
        scene: Scene = network.scene
        refs = [scene.ref(name) for name in names]
        energies = [
            (name, energy)
            for name, component in scene.components.items()
            for energy in ENERGIES
            if audit and energy in component.fmu.variables
        ]
        self._network = network
        self.names, self.energy_refs = names, energies
        self.values, self.energies = np.empty((samples, len(refs))), np.empty((samples, len(energies)))
        self.gaps = np.empty((samples, 2))
        self._reads = self._blocks(refs, self.values) + self._blocks(energies, self.energies)
        self._next = 0

    def _blocks(self, refs, target):
        names = dict.fromkeys(ref[0] for ref in refs)
        blocks = []
        for name in names:
            columns = [i for i, ref in enumerate(refs) if ref[0] == name]
            variables = [refs[i][1] for i in columns]
            blocks.append((self._network.instances[name].block(variables), target, columns))
        return blocks

    def take(self):
        """One sample; all components are at its time and their outputs belong together."""
        for block, target, columns in self._reads:
            target[self._next, columns] = block.read()
        self.gaps[self._next] = self._network.gap()
        self._next += 1

    @property
    def taken(self) -> int:
        """Samples so far."""
        return self._next


class Unrecorded:
    """Records nothing and costs nothing."""

    taken = 0

    def take(self):
        """Nothing."""
