"""Closing joints: forces lambda between leader ports, + on the first and - on the second, that keep them together.

    lambda = 0: sweep, da = a_1 - a_2; dv, dr likewise
    each axis: lambda = 1 N, column of K = change of da
    K lambda = -(da + 2 alpha dv + alpha^2 dr)

All joints are solved together. K is symmetric and positive semidefinite: a planar mechanism in space, or links in line,
drop its rank, which the eigenvalues show.
"""

from typing import TYPE_CHECKING

import numpy as np

from .errors import SceneError

if TYPE_CHECKING:
    from .network import Network

#: Eigenvalues of K below this part of the largest count as zero.
RANK = 1e-10
#: Part of the largest right-hand side that may lie in a dropped direction; below `REST` [m/s2] it is rounding.
CONSISTENT, REST = 1e-6, 1e-9
#: Largest gap at the start [m, m/s].
CLOSED = 1e-9


class Closure:
    """All closing joints of a network."""

    def __init__(self, network: "Network", joints, alpha: float):
        self._network, self._joints, self.alpha = network, joints, alpha
        end = lambda i, part: [ref for joint in joints for ref in joint.pair(part or joint.position)[i]]
        self._on = [network.inputs_at(end(i, "F")) for i in range(2)]
        self._a, self._v, self._r = ([network.outputs_at(end(i, part)) for i in range(2)] for part in ("a", "v", None))
        self.size = len(self._on[0])
        ends = np.cumsum([0] + [len(joint.pair("F")[0]) for joint in joints])
        self._columns = [range(a, b) for a, b in zip(ends, ends[1:])]
        #: Forces of the last sweep [N], number of directions that K has, and its condition there.
        self.force, self.rank, self.condition = np.zeros(self.size), 0, 1.0

    def compile(self):
        """Plans of the sweeps: of one joint up to the accelerations of all, and of all joints to every input."""
        graph, compiled = self._network.graph, self._network.compiled
        accelerations = [ref for joint in self._joints for end in joint.pair("a") for ref in end]
        self._try = []
        for joint in self._joints:
            inputs, outputs = graph.needed(accelerations, *graph.affected(joint.feeds))
            self._try.append(compiled(graph.plan(inputs, outputs)))
        inputs, outputs = graph.affected([feed for joint in self._joints for feed in joint.feeds])
        outputs = {connection.source for i, connection in graph.source.items() if i in inputs} & outputs
        self._apply = compiled(graph.plan(inputs, outputs))

    def _put(self, force: np.ndarray):
        self._network.u[self._on[0]] = force
        self._network.u[self._on[1]] = -force

    def release(self):
        """lambda = 0 in the inputs."""
        self._put(np.zeros(self.size))

    def _difference(self, of: list[np.ndarray]) -> np.ndarray:
        y = self._network.y
        return y[of[0]] - y[of[1]]

    def solve(self):
        """After a sweep with lambda = 0: the closing forces, and all inputs with them."""
        da = self._difference(self._a)
        wrong = da + 2.0 * self.alpha * self._difference(self._v) + self.alpha**2 * self._difference(self._r)
        self.force = self.solve_for(self.mobility(da), -wrong)
        self._put(self.force)
        for operation in self._apply:
            operation()

    def mobility(self, da: np.ndarray) -> np.ndarray:
        """K: relative accelerations of all joints per unit of each closing force."""
        K = np.zeros((self.size, self.size))
        for number, (operations, columns) in enumerate(zip(self._try, self._columns)):
            for column in columns:
                unit = np.zeros(self.size)
                unit[column] = 1.0
                self._put(unit)
                for operation in operations:
                    operation()
                K[:, column] = self._difference(self._a) - da
            if number + 1 < len(self._try):
                self.release()
                for operation in operations:
                    operation()
        return 0.5 * (K + K.T)

    def solve_for(self, K: np.ndarray, right: np.ndarray) -> np.ndarray:
        """K^-1 right within the directions that K has."""
        values, vectors = np.linalg.eigh(K)
        within = vectors.T @ right
        kept = values > RANK * values[-1]
        self.rank = int(kept.sum())
        lost = np.abs(within[~kept]).max(initial=0.0)
        if not values[-1] > 0.0 or lost > max(CONSISTENT * np.abs(within).max(), REST):
            raise SceneError(
                f"inconsistent or singular closure of {', '.join(joint.name for joint in self._joints)} at "
                f"t = {self._network.time:.6g} s: eigenvalues of K {values} 1/kg, {lost:.3g} m/s2 in a direction without force"
            )
        self.condition = float(values[-1] / values[kept][0])
        return vectors[:, kept] @ (within[kept] / values[kept])

    def gap(self) -> tuple[float, float]:
        """Largest distance and relative speed at the joints [m, m/s]."""
        return tuple(float(np.abs(self._difference(of)).max()) for of in (self._r, self._v))

    # start ----------------------------------------------------------------------------------------------------------
    def start(self):
        """In Initialization Mode: close the gap with the start values that may change, or say how large it is."""
        if max(self.gap()) > CLOSED and self._network.scene.assembled:
            self._assemble()
        gap, speed = self.gap()
        if not max(gap, speed) <= CLOSED:
            hint = (
                "" if self._network.scene.assembled else "; `assemble` names start values that may change to close it"
            )
            raise SceneError(
                f"{', '.join(joint.name for joint in self._joints)}: open at the start by {gap:.3g} m and {speed:.3g} m/s "
                f"(allowed: {CLOSED:g}){hint}"
            )

    def _residual(self, values: np.ndarray) -> np.ndarray:
        scene = self._network.scene
        for name, value in zip(scene.assembled, values):
            component, variable = scene.ref(name)
            self._network.instances[component].set({variable: value})
        self._network.first_sweep()
        return np.concatenate([self._difference(self._r), self._difference(self._v)])

    def _assemble(self):
        """Newton's method; of all solutions the one next to the given start."""
        scene = self._network.scene
        refs = [scene.ref(name) for name in scene.assembled]
        values = np.array([float(self._network.instances[name].get(variable)) for name, variable in refs])
        residual = self._residual(values)
        for _ in range(20):
            if np.abs(residual).max() <= 1e-3 * CLOSED:
                return
            steps = 1e-7 * np.maximum(1.0, np.abs(values))
            columns = [
                (self._residual(values + step * unit) - residual) / step
                for step, unit in zip(steps, np.eye(len(values)))
            ]
            change = np.linalg.lstsq(np.array(columns).T, -residual, rcond=1e-9)[0]
            for _ in range(10):
                new = self._residual(values + change)
                if np.abs(new).max() < np.abs(residual).max():
                    break
                change = 0.5 * change
            else:
                self._residual(values)
                return
            values, residual = values + change, new
