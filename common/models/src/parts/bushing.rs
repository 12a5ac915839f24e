#![doc = include_str!("bushing.md")]

use mechanics::Scalar;
use model::{
    Dense, Documentation, EvaluationError, Experiment, Model, NoVariables, ParameterError, SymmetricTensor,
    System, Variables, Vector3, Visitor,
};

use crate::port::Root;

/// Parameters of a bushing.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(parameter)]
pub struct Parameters {
    /// Stiffness in every direction [N/m]
    #[var(name = "stiffness", start = 1e6, min = 0.0, tunable)]
    pub k: f64,
    /// Damping in every direction [N.s/m]
    #[var(name = "damping", start = 1e3, min = 0.0, tunable)]
    pub c: f64,
    /// Energy integrals
    #[var(name = "use.energy", start = true)]
    pub use_energy: bool,
}

/// Inputs of a bushing.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(input)]
pub struct Inputs<S> {
    #[var(prefix = "A.")]
    #[allow(missing_docs, reason = "follower port A")]
    pub A: Root<S>,
    #[var(prefix = "B.")]
    #[allow(missing_docs, reason = "follower port B")]
    pub B: Root<S>,
}

/// Motion of both points, by component.
const TENSION: &[&str] = &["A.r.@", "A.v.@", "B.r.@", "B.v.@"];

/// What the leaders have to carry.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Inertia<S> {
    /// Force on the leader at A; the same as A.F [N]
    #[var(name = "A.F0", nominal = 1e2, depends = TENSION)]
    pub A_F0: Vector3<S>,
    /// Inertia behind port A: always zero [kg]
    #[var(name = "A.M")]
    pub A_M: SymmetricTensor<S>,
    /// Force on the leader at B; the same as B.F [N]
    #[var(name = "B.F0", nominal = 1e2, depends = TENSION)]
    pub B_F0: Vector3<S>,
    /// Inertia behind port B: always zero [kg]
    #[var(name = "B.M")]
    pub B_M: SymmetricTensor<S>,
}

/// The forces.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Dynamics<S> {
    /// Force on the leader at A [N]
    #[var(name = "A.F", nominal = 1e2, depends = TENSION)]
    pub A_F: Vector3<S>,
    /// Force on the leader at B [N]
    #[var(name = "B.F", nominal = 1e2, depends = TENSION)]
    pub B_F: Vector3<S>,
}

/// Energies; kinetic is always zero.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Energy<S> {
    /// Kinetic energy: always zero [J]
    #[var(name = "energy.kinetic")]
    pub kinetic: S,
    /// Energy of the spring [J]
    #[var(name = "energy.potential", depends = ["A.r", "B.r"])]
    pub potential: S,
    /// Energy turned into heat since the start [J]
    #[var(name = "energy.dissipated", state, rate_depends = ["A.v", "B.v"])]
    pub dissipated: S,
    /// Work of both leaders on the bushing since the start [J]
    #[var(name = "energy.supplied", state, rate_depends = ["A.r", "A.v", "B.r", "B.v"])]
    pub supplied: S,
    /// The same: all of it comes through ports [J]
    #[var(name = "energy.port", depends = ["energy.supplied"])]
    pub port: S,
}

/// A spring-damper between two points.
#[derive(Debug, Clone)]
pub struct Bushing(Parameters);

impl Bushing {
    /// Displacement, its rate, force on the leader at A.
    fn stretched<S: Scalar>(&self, u: &Inputs<S>) -> [Vector3<S>; 3] {
        let (d, d_dot) = (u.A.r - u.B.r, u.A.v - u.B.v);
        [d, d_dot, -(d * S::lift(self.0.k)) - d_dot * S::lift(self.0.c)]
    }
}

impl Model for Bushing {
    const NAME: &'static str = "bushing";
    const DESCRIPTION: &'static str = "Spring and damper without mass between the leaders at A and B";
    const EXPERIMENT: Experiment = Experiment { stop: 1.0, step: 0.001 };
    const DOCUMENTATION: Documentation = model::documentation!(
        "bushing",
        inputs,
        plots = [
            ("Force on both leaders", ["A.F.z", "B.F.z"]),
            ("Energies", ["energy.potential", "energy.dissipated", "energy.supplied"])
        ]
    );
    type Parameters = Parameters;
    type Inputs<S: Scalar> = Inputs<S>;
    type Motion<S: Scalar> = NoVariables;
    type Inertia<S: Scalar> = Inertia<S>;
    type Dynamics<S: Scalar> = Dynamics<S>;
    type Energy<S: Scalar> = Energy<S>;
    type Discrete = ();

    fn new(p: &Parameters, _start: &NoVariables) -> Result<Self, ParameterError> {
        Ok(Self(*p))
    }

    fn retune(&mut self, p: &Parameters) {
        (self.0.k, self.0.c) = (p.k, p.c);
    }

    fn with_system<V: Visitor<Self>>(&self, visitor: V) -> V::Output {
        visitor.visit::<2, 0, _>(self)
    }
}

impl System<2, 0> for Bushing {
    type Model = Self;
    type Spectrum = Dense;

    fn start(&self, _t: f64, _given: &NoVariables) -> Result<([f64; 2], ()), ParameterError> {
        Ok(([0.0; 2], ()))
    }

    #[inline]
    fn rates<S: Scalar>(
        &self,
        _t: S,
        _x: &[S; 2],
        u: &Inputs<S>,
        _d: &(),
    ) -> Result<[S; 2], EvaluationError> {
        if !self.0.use_energy {
            return Ok([S::lift(0.0); 2]);
        }
        let [_, d_dot, F] = self.stretched(u);
        Ok([d_dot.dot(&d_dot) * self.0.c, -F.dot(&d_dot)])
    }

    fn motion<S: Scalar>(
        &self,
        _t: S,
        _x: &[S; 2],
        _u: &Inputs<S>,
        _d: &(),
    ) -> Result<NoVariables, EvaluationError> {
        Ok(NoVariables)
    }

    fn inertia<S: Scalar>(
        &self,
        _t: S,
        _x: &[S; 2],
        u: &Inputs<S>,
        _d: &(),
    ) -> Result<Inertia<S>, EvaluationError> {
        let [.., F] = self.stretched(u);
        let zero = SymmetricTensor::zero();
        Ok(Inertia { A_F0: F, A_M: zero, B_F0: -F, B_M: zero })
    }

    fn dynamics<S: Scalar>(
        &self,
        _t: S,
        _x: &[S; 2],
        u: &Inputs<S>,
        _d: &(),
    ) -> Result<Dynamics<S>, EvaluationError> {
        let [.., F] = self.stretched(u);
        Ok(Dynamics { A_F: F, B_F: -F })
    }

    fn energy<S: Scalar>(
        &self,
        _t: S,
        x: &[S; 2],
        u: &Inputs<S>,
        _d: &(),
    ) -> Result<Energy<S>, EvaluationError> {
        let [d, ..] = self.stretched(u);
        let [dissipated, supplied] = *x;
        let potential = d.dot(&d) * (0.5 * self.0.k);
        Ok(Energy { kinetic: S::lift(0.0), potential, dissipated, supplied, port: supplied })
    }

    fn state_names(&self) -> [String; 2] {
        ["energy.dissipated", "energy.supplied"].map(String::from)
    }
}
