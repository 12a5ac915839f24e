"""A massless spring and damper between a scalar port and the ground, for PythonFMU3 (FMI 3.0)."""

from pythonfmu3 import Fmi3Causality, Fmi3Slave, Fmi3Status, Fmi3StepResult, Fmi3Variability, Float64


class Spring(Fmi3Slave):
    """F = -k s - c v of the inputs as they are."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.time = 0.0
        self.k, self.c, self.s, self.v = 1.0, 0.0, 0.0, 0.0
        self.register_variable(
            Float64("time", causality=Fmi3Causality.independent, variability=Fmi3Variability.continuous)
        )
        fixed = {"causality": Fmi3Causality.parameter, "variability": Fmi3Variability.fixed}
        for name in ("k", "c"):
            self.register_variable(Float64(name, start=getattr(self, name), **fixed))
        for name in ("s", "v"):
            access = {"getter": lambda name=name: getattr(self, name)}
            access["setter"] = lambda value, name=name: setattr(self, name, value)
            self.register_variable(Float64(f"A.{name}", causality=Fmi3Causality.input, start=0.0, **access))
        force = lambda: -self.k * self.s - self.c * self.v
        self.register_variable(Float64("A.F0", causality=Fmi3Causality.output, getter=force))

    def do_step(self, current_time, step_size):
        return Fmi3StepResult(status=Fmi3Status.ok)
