"""A massless spring and damper between a scalar port and the ground, for PythonFMU (FMI 2.0)."""

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class Spring(Fmi2Slave):
    """F = -k s - c v of the inputs as they are."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.k, self.c, self.s, self.v = 1.0, 0.0, 0.0, 0.0
        fixed = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.fixed}
        for name in ("k", "c"):
            self.register_variable(Real(name, **fixed))
        for name in ("s", "v"):
            access = {"getter": lambda name=name: getattr(self, name)}
            access["setter"] = lambda value, name=name: setattr(self, name, value)
            self.register_variable(Real(f"A.{name}", causality=Fmi2Causality.input, start=0.0, **access))
        force = lambda: -self.k * self.s - self.c * self.v
        self.register_variable(Real("A.F0", causality=Fmi2Causality.output, getter=force))

    def do_step(self, current_time, step_size):
        return True
