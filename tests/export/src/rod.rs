//! A follower: a mass m at A with a second one k behind a damper, moved by its leader.
//!
//! ```text
//! w' = d/k (v_A - w),   A.F0 = -c r_A - d (v_A - w),   A.M = m,   A.F = A.F0 - m a_A
//! ```

use model::{
    Dense, Documentation, EvaluationError, Experiment, Model, NoVariables, ParameterError, Scalar, System,
    Variables, Visitor,
};

/// Parameters.
#[derive(Debug, Clone, PartialEq, Variables)]
#[variables(parameter)]
pub struct Parameters {
    /// Mass at A [kg]
    #[var(name = "mass", start = 2.0, above = 0.0)]
    pub m: f64,
    /// Spring to the ground [N/m]
    #[var(name = "spring.c", start = 3.0, min = 0.0, tunable)]
    pub c: f64,
}

/// Motion of A, in one coordinate.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(input)]
pub struct Inputs<S> {
    /// Position [m]
    #[var(name = "A.s")]
    pub r: S,
    /// Velocity [m/s]
    #[var(name = "A.v")]
    pub v: S,
    /// Acceleration [m/s2]
    #[var(name = "A.a")]
    pub a: S,
}

/// The state.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Motion<S> {
    /// Velocity behind the damper [m/s]
    #[var(name = "w", state, rate_depends = ["A.v", "w"])]
    pub w: S,
}

/// The bias force and inertia at A.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Inertia<S> {
    /// Force at rest [N]
    #[var(name = "A.F0", depends = ["A.s", "A.v", "w"])]
    pub F0: S,
    /// Inertia [kg]
    #[var(name = "A.M")]
    pub M: S,
}

/// The force at A.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Dynamics<S> {
    /// Force on the leader [N]
    #[var(name = "A.F", depends = ["A.s", "A.v", "A.a", "w"])]
    pub F: S,
}

/// The follower; it counts how often each group is computed.
#[derive(Debug, Clone)]
pub struct Rod(Parameters);

thread_local! {
    /// Evaluations of the groups motion, inertia, dynamics since the start of the thread.
    pub static EVALUATIONS: std::cell::Cell<[u32; 3]> = const { std::cell::Cell::new([0; 3]) };
}

fn count(group: usize) {
    EVALUATIONS.with(|e| {
        let mut counts = e.get();
        counts[group] += 1;
        e.set(counts);
    });
}

impl Model for Rod {
    const NAME: &'static str = "rod";
    const DESCRIPTION: &'static str = "Follower with one state";
    const EXPERIMENT: Experiment = Experiment { stop: 1.0, step: 0.1 };
    const DOCUMENTATION: Documentation = crate::UNDOCUMENTED;
    type Parameters = Parameters;
    type Inputs<S: Scalar> = Inputs<S>;
    type Motion<S: Scalar> = Motion<S>;
    type Inertia<S: Scalar> = Inertia<S>;
    type Dynamics<S: Scalar> = Dynamics<S>;
    type Energy<S: Scalar> = NoVariables;
    type Discrete = ();

    fn new(parameters: &Parameters, _start: &Motion<f64>) -> Result<Self, ParameterError> {
        Ok(Self(parameters.clone()))
    }
    fn retune(&mut self, parameters: &Parameters) {
        self.0 = parameters.clone();
    }
    fn with_system<V: Visitor<Self>>(&self, visitor: V) -> V::Output {
        visitor.visit::<1, 0, _>(self)
    }
}

impl System<1, 0> for Rod {
    type Model = Self;
    type Spectrum = Dense;

    fn start(&self, _t: f64, _given: &Motion<f64>) -> Result<([f64; 1], ()), ParameterError> {
        Ok(([0.0], ()))
    }
    fn rates<S: Scalar>(&self, _t: S, x: &[S; 1], u: &Inputs<S>, _d: &()) -> Result<[S; 1], EvaluationError> {
        Ok([u.v - x[0]])
    }
    fn motion<S: Scalar>(
        &self,
        _t: S,
        x: &[S; 1],
        _u: &Inputs<S>,
        _d: &(),
    ) -> Result<Motion<S>, EvaluationError> {
        count(0);
        Ok(Motion { w: x[0] })
    }
    fn inertia<S: Scalar>(
        &self,
        _t: S,
        x: &[S; 1],
        u: &Inputs<S>,
        _d: &(),
    ) -> Result<Inertia<S>, EvaluationError> {
        count(1);
        Ok(Inertia { F0: -(u.r * self.0.c) - (u.v - x[0]), M: S::lift(self.0.m) })
    }
    fn dynamics<S: Scalar>(
        &self,
        _t: S,
        x: &[S; 1],
        u: &Inputs<S>,
        _d: &(),
    ) -> Result<Dynamics<S>, EvaluationError> {
        count(2);
        Ok(Dynamics { F: -(u.r * self.0.c) - (u.v - x[0]) - u.a * self.0.m })
    }
    fn energy<S: Scalar>(
        &self,
        _t: S,
        _x: &[S; 1],
        _u: &Inputs<S>,
        _d: &(),
    ) -> Result<NoVariables, EvaluationError> {
        Ok(NoVariables)
    }
    fn state_names(&self) -> [String; 1] {
        ["w".into()]
    }
}
