#![doc = include_str!("load.md")]

use mechanics::Scalar;
use model::{
    Dense, Documentation, EvaluationError, Experiment, Model, NoVariables, ParameterError, SymmetricTensor,
    System, Variables, Vector3, Visitor,
};

use crate::force_law::{LoadLaw, LoadParameters, PulsePhase};
use crate::port::Root;

/// Parameters of a load.
#[derive(Debug, Clone, PartialEq, Variables)]
#[variables(parameter)]
pub struct Parameters {
    #[var(prefix = "force.")]
    #[allow(missing_docs, reason = "a group")]
    pub force: LoadParameters,
    /// Energy integral
    #[var(name = "use.energy", start = true)]
    pub use_energy: bool,
}

/// Inputs of a load.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(input)]
pub struct Inputs<S> {
    #[var(prefix = "A.")]
    #[allow(missing_docs, reason = "follower port A")]
    pub A: Root<S>,
}

/// What the leader at A has to carry.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Inertia<S> {
    /// Force on the leader; the same as A.F [N]
    #[var(name = "A.F0", nominal = 1e1)]
    pub F0: Vector3<S>,
    /// Inertia behind port A: always zero [kg]
    #[var(name = "A.M")]
    pub M: SymmetricTensor<S>,
}

/// The force.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Dynamics<S> {
    /// Force on the leader [N]
    #[var(name = "A.F", nominal = 1e1)]
    pub F: Vector3<S>,
}

/// Work of the force.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Energy<S> {
    /// Work of the load on its leader since the start [J]
    #[var(name = "energy.supplied", state, rate_depends = ["A.v"])]
    pub supplied: S,
    /// Work through port A on the load since the start: what is supplied leaves there [J]
    #[var(name = "energy.port", depends = ["energy.supplied"])]
    pub port: S,
}

/// A load.
#[derive(Debug, Clone)]
pub struct Load {
    law: LoadLaw<3>,
    energy: bool,
}

impl Model for Load {
    const NAME: &'static str = "load";
    const DESCRIPTION: &'static str =
        "Force as a law of time on the leader at A: constant, sine and half-sine pulse";
    const EXPERIMENT: Experiment = Experiment { stop: 10.0, step: 0.05 };
    const DOCUMENTATION: Documentation =
        model::documentation!("load", plots = [("Force on the leader", ["A.F.z"])]);
    type Parameters = Parameters;
    type Inputs<S: Scalar> = Inputs<S>;
    type Motion<S: Scalar> = NoVariables;
    type Inertia<S: Scalar> = Inertia<S>;
    type Dynamics<S: Scalar> = Dynamics<S>;
    type Energy<S: Scalar> = Energy<S>;
    type Discrete = PulsePhase;

    fn new(p: &Parameters, _start: &NoVariables) -> Result<Self, ParameterError> {
        Ok(Self { law: LoadLaw::new(&p.force), energy: p.use_energy })
    }

    fn retune(&mut self, _p: &Parameters) {}

    fn with_system<V: Visitor<Self>>(&self, visitor: V) -> V::Output {
        visitor.visit::<1, 0, _>(self)
    }
}

impl System<1, 0> for Load {
    type Model = Self;
    type Spectrum = Dense;

    fn start(&self, t: f64, _given: &NoVariables) -> Result<([f64; 1], PulsePhase), ParameterError> {
        Ok(([0.0], self.law.phase(t)))
    }

    #[inline]
    fn rates<S: Scalar>(
        &self,
        t: S,
        _x: &[S; 1],
        u: &Inputs<S>,
        d: &PulsePhase,
    ) -> Result<[S; 1], EvaluationError> {
        Ok([if self.energy { self.law.force(t, *d).dot(&u.A.v) } else { S::lift(0.0) }])
    }

    fn motion<S: Scalar>(
        &self,
        _t: S,
        _x: &[S; 1],
        _u: &Inputs<S>,
        _d: &PulsePhase,
    ) -> Result<NoVariables, EvaluationError> {
        Ok(NoVariables)
    }

    fn inertia<S: Scalar>(
        &self,
        t: S,
        _x: &[S; 1],
        _u: &Inputs<S>,
        d: &PulsePhase,
    ) -> Result<Inertia<S>, EvaluationError> {
        Ok(Inertia { F0: self.law.force(t, *d), M: SymmetricTensor::zero() })
    }

    fn dynamics<S: Scalar>(
        &self,
        t: S,
        _x: &[S; 1],
        _u: &Inputs<S>,
        d: &PulsePhase,
    ) -> Result<Dynamics<S>, EvaluationError> {
        Ok(Dynamics { F: self.law.force(t, *d) })
    }

    fn energy<S: Scalar>(
        &self,
        _t: S,
        x: &[S; 1],
        _u: &Inputs<S>,
        _d: &PulsePhase,
    ) -> Result<Energy<S>, EvaluationError> {
        let [supplied] = *x;
        Ok(Energy { supplied, port: -supplied })
    }

    fn state_names(&self) -> [String; 1] {
        ["energy.supplied".into()]
    }

    fn next_event(&self, d: &PulsePhase) -> Option<f64> {
        self.law.next_event(*d)
    }

    fn update(&self, t: f64, _x: &mut [f64; 1], _u: &Inputs<f64>, _d: &PulsePhase) -> PulsePhase {
        self.law.phase(t)
    }
}
