"""What a run of a scene gives."""

from dataclasses import dataclass, field

import numpy as np

from ..fmu import Result


@dataclass(frozen=True)
class EnergyAudit:
    """Energies of the whole scene over the samples [J]."""

    stored: np.ndarray
    dissipated: np.ndarray
    #: Work from outside the scene.
    supplied: np.ndarray
    #: Sum of the works that the components received through connected and open ports.
    ports: np.ndarray
    #: Largest change of any energy of any component.
    largest: float

    @property
    def balance(self) -> float:
        """Largest |stored + dissipated - supplied - stored at the start| over the largest change of any single energy.

        Port works are among `supplied`: where both sides of every connection are in the scene they cancel.
        """
        wrong = float(np.abs(self.stored - self.stored[0] + self.dissipated - self.supplied).max())
        return wrong / self.largest if self.largest > 0.0 else 0.0


@dataclass
class SceneResult(Result):
    """Samples of a run, counts, energies and gaps: `result["component.variable"]` is an array over `result.t`."""

    method: str = ""
    #: Calls per component and C function, of the whole run.
    calls: dict[str, dict[str, int]] = field(default_factory=dict)
    #: Largest distance [m] and relative speed [m/s] of the closing joints at each sample.
    gap: np.ndarray = field(default_factory=lambda: np.zeros(0))
    gap_rate: np.ndarray = field(default_factory=lambda: np.zeros(0))
    energy: EnergyAudit | None = None
    #: Components in use and archives at hand; coupled variables and all inputs and outputs of the components.
    components: tuple[int, int] = (0, 0)
    variables: tuple[int, int] = (0, 0)
    #: Wall and CPU time of the loop over the steps [s].
    wall: float = 0.0
    cpu: float = 0.0
    #: Simulated time [s].
    simulated: float = 0.0

    @property
    def real_time_factor(self) -> float:
        """Simulated time over wall time."""
        return self.simulated / self.wall if self.wall > 0.0 else float("inf")

    def summary(self) -> str:
        """What was loaded, exchanged and called."""
        calls = ", ".join(f"{name} {count}" for name, count in self.counts.items())
        return (
            f"{self.method}: components {self.components[0]} of {self.components[1]}, variables exchanged "
            f"{self.variables[0]} of {self.variables[1]}; {calls}"
        )


def _external(refs: list[tuple[str, str]], values: np.ndarray, connected: set[str]) -> np.ndarray:
    """Work from outside the scene: of every component all but what came through ports.

    A source (load, guide) stores nothing: what leaves it through its port has come from outside. The ports of a
    component that nothing is connected to are outside.
    """
    storing = {name for name, energy in refs if energy == "energy.kinetic"}
    work = np.zeros(len(values))
    for i, (name, energy) in enumerate(refs):
        if energy == "energy.port" and name in connected:
            work -= values[:, i]
        elif energy == "energy.supplied" and name in storing:
            work += values[:, i]
    return work


def audited(refs: list[tuple[str, str]], values: np.ndarray, connected: set[str]) -> EnergyAudit | None:
    """Energies of the scene from those of its components, None without any; `connected`: components with connections."""
    if not refs:
        return None
    total = lambda name: sum((values[:, i] for i, ref in enumerate(refs) if ref[1] == name), np.zeros(len(values)))
    return EnergyAudit(
        stored=total("energy.kinetic") + total("energy.potential"),
        dissipated=total("energy.dissipated"),
        supplied=_external(refs, values, connected),
        ports=total("energy.port"),
        largest=float(np.abs(values - values[0]).max()),
    )


# names of the counts of C functions in a result
_KINDS = {
    "Get": "fmi3GetFloat64",
    "Set": "fmi3SetFloat64",
    "doStep": "fmi3DoStep",
    "save": "fmi3GetFMUState",
    "restore": "fmi3SetFMUState",
    "derivatives": "fmi3GetContinuousStateDerivatives",
    "set states": "fmi3SetContinuousStates",
    "set time": "fmi3SetTime",
    "directional": "fmi3GetDirectionalDerivative",
}


def kinds(calls: dict[str, dict[str, int]]) -> dict[str, int]:
    """Calls of all components by kind, and all together."""
    total = lambda function: sum(of.get(function, 0) for of in calls.values())
    counted = {kind: total(function) for kind, function in _KINDS.items()}
    return {"calls": sum(sum(of.values()) for of in calls.values())} | {k: n for k, n in counted.items() if n}
