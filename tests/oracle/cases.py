"""The cases of the oracle: parameters, sample times, tolerances and the text that heads each file."""

from dataclasses import dataclass

import numpy as np

from .wishbone import Wishbone, vec

#: Weight of the drop [m/s2].
GRAVITY = -9.80665


@dataclass(frozen=True)
class Case:
    """One file `oracle_<name>.csv`."""

    name: str
    note: str
    model: Wishbone
    stop: float
    step: float
    rtol: float = 3e-14
    #: Scalar, or one value per state.
    atol: object = 1e-17

    def times(self):
        """Sample times [s]."""
        return np.round(np.arange(round(self.stop / self.step) + 1) * self.step, 12)

    def table(self, rows=None):
        """Samples of the case, or only its first `rows`."""
        return self.model.table(self.times()[:rows], self.rtol, self.atol)


# With a bushing the force carries the rounding of the deflection times its stiffness; tolerances below that noise only
# shrink the step. Against rtol 1e-12, atol 1e-15 the angles differ by 6e-16 rad and the force at D by 4e-8 N (1e8 N/m).
BUSHING = {"rtol": 1e-11, "atol": [1e-14] * 3 + [1e-11] * 3 + [1e-13] * 2, "stop": 1.0, "step": 0.01}
LOAD = vec(0.0, 200.0)

CASES = {
    case.name: case
    for case in (
        Case(
            "tiny",
            "wishbone_paper with an upper link of 2.5e-3 kg (1 : 1e4 to the carrier)",
            Wishbone(m_upper=2.5e-3),
            stop=10.0,
            step=0.05,
        ),
        Case(
            "drop",
            "no damper, no load, no preload; gravity (0, 0, -9.80665) lets go at the design position",
            Wishbone(c=0.0, amplitude=vec(0.0, 0.0), gravity=vec(0.0, GRAVITY)),
            stop=10.0,
            step=0.05,
        ),
        Case(
            "start",
            "free motion from lower.angle.theta = design - 0.08 rad with +0.5 rad/s, no load",
            Wishbone(amplitude=vec(0.0, 0.0), start_angle=-0.08, start_rate=0.5),
            stop=2.0,
            step=0.05,
        ),
        Case("load200", "P.F.z = 200 sin(10 t) N, rigid joint at D", Wishbone(amplitude=LOAD), stop=1.0, step=0.01),
        Case(
            "bushing_1e8",
            "P.F.z = 200 sin(10 t) N, bushing at D: k = 1e8 N/m, c = 1e4 N s/m",
            Wishbone(amplitude=LOAD, bushing=(1e8, 1e4)),
            **BUSHING,
        ),
        Case(
            "bushing_2.2e10",
            "P.F.z = 200 sin(10 t) N, bushing at D: k = 2.2e10 N/m, c = 2e5 N s/m",
            Wishbone(amplitude=LOAD, bushing=(2.2e10, 2e5)),
            **BUSHING,
        ),
    )
}
