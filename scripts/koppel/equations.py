"""An FMU instance for Model Exchange."""

from ctypes import byref, c_size_t
from typing import TYPE_CHECKING

import numpy as np
from fmpy import fmi3

from .instance import Instance

if TYPE_CHECKING:
    from .fmu import Fmu


class Equations(Instance):
    """A Model Exchange instance: `x`, `x_dot` and `z` are the buffers of its continuous states, their
    derivatives and the event indicators."""

    INTERFACE = "ModelExchange"

    def __init__(self, fmu: "Fmu", logging: bool = False, name: str = "instance"):
        if fmu.description.modelExchange is None:
            raise ValueError(f"{fmu.path.name} has no Model Exchange interface")
        super().__init__(fmu, True, logging, name)
        self.nx, self.nz = self._number("ContinuousStates"), self._number("EventIndicators")
        x, x_dot = (fmi3.fmi3Float64 * self.nx)(), (fmi3.fmi3Float64 * self.nx)()
        z = (fmi3.fmi3Float64 * self.nz)()
        self.x, self.x_dot, self.z = (
            np.ctypeslib.as_array(array) if len(array) else np.empty(0) for array in (x, x_dot, z)
        )
        self._t = fmi3.fmi3Float64()
        self._write_time = self.prepared("fmi3SetTime", self._t)
        self._read_states = self.prepared("fmi3GetContinuousStates", x, self.nx)
        self._write_states = self.prepared("fmi3SetContinuousStates", x, self.nx)
        self._read_derivatives = self.prepared("fmi3GetContinuousStateDerivatives", x_dot, self.nx)
        self._read_indicators = self.prepared("fmi3GetEventIndicators", z, self.nz)

    def _number(self, of: str) -> int:
        count = c_size_t()
        self.check(f"fmi3GetNumberOf{of}", byref(count))
        return count.value

    def _open(self, **options):
        return fmi3.FMU3Model(modelIdentifier=self.fmu.description.modelExchange.modelIdentifier, **options)

    def _options(self):
        return {}

    def exit_initialisation(self):
        """Initialization Mode -> Continuous-Time Mode; `x` is read."""
        self.check("fmi3ExitInitializationMode")
        self.enter_continuous_time_mode()

    def enter_continuous_time_mode(self):
        """Event Mode -> Continuous-Time Mode; `x` is read."""
        self.update_discrete_states()
        self.go_on()

    def go_on(self):
        """Event Mode, with all updates done, -> Continuous-Time Mode; `x` is read."""
        self.check("fmi3EnterContinuousTimeMode")
        self.read_states()

    def read_states(self):
        """Get the states into `x`."""
        if self.nx:
            self._read_states()

    def nominals(self) -> np.ndarray:
        """Nominal values of the states."""
        nominals = (fmi3.fmi3Float64 * self.nx)()
        if self.nx:
            self.check("fmi3GetNominalsOfContinuousStates", nominals, self.nx)
        return np.array(nominals)

    def set_time(self, t: float):
        """SetTime."""
        self.time = self._t.value = t
        self._write_time()

    def write_states(self):
        """Set the states in `x`."""
        if self.nx:
            self._write_states()

    def read_derivatives(self) -> np.ndarray:
        """Get the derivatives; returns `x_dot`."""
        if self.nx:
            self._read_derivatives()
        return self.x_dot

    def read_indicators(self) -> np.ndarray:
        """Get the event indicators; returns `z`."""
        if self.nz:
            self._read_indicators()
        return self.z

    def completed_step(self, final: bool = True) -> bool:
        """completedIntegratorStep; true if the FMU asks for Event Mode."""
        event, terminate = self._flags[:2]
        self.check("fmi3CompletedIntegratorStep", final, byref(event), byref(terminate))
        return event.value
