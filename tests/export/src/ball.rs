//! A ball that bounces on the ground and is kicked once: state and time events with closed-form times.

use model::{
    Dense, Documentation, EvaluationError, Experiment, Model, NoVariables, ParameterError, Scalar, System,
    Variables, Visitor,
};

/// Gravity [m/s2]
pub const G: f64 = 10.0;

/// Parameters.
#[derive(Debug, Clone, PartialEq, Variables)]
#[variables(parameter)]
pub struct Parameters {
    /// Height at the start [m]
    #[var(name = "height", start = 1.25, above = 0.0)]
    pub height: f64,
    /// Fraction of the speed that is left after a bounce
    #[var(name = "restitution", start = 0.8, min = 0.0, max = 1.0, tunable)]
    pub restitution: f64,
    /// Time of the kick; 0: none [s]
    #[var(name = "kick.time", start = 0.0, min = 0.0)]
    pub kick: f64,
}

/// Height and velocity.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Motion<S> {
    /// Height [m]
    #[var(name = "z", state, rate_depends = ["v"])]
    pub z: S,
    /// Velocity [m/s]
    #[var(name = "v", state)]
    pub v: S,
    /// Orientation that never turns, off its unit length at the start
    #[var(name = "q", state, rate_depends = ["q"])]
    pub q: S,
}

/// The ball.
#[derive(Debug, Clone)]
pub struct Ball(Parameters);

impl Model for Ball {
    const NAME: &'static str = "ball";
    const DESCRIPTION: &'static str = "Bouncing ball";
    const EXPERIMENT: Experiment = Experiment { stop: 1.0, step: 0.1 };
    const DOCUMENTATION: Documentation = crate::UNDOCUMENTED;
    const INDICATORS: &'static [&'static str] = &["ground.distance"];
    type Parameters = Parameters;
    type Inputs<S: Scalar> = NoVariables;
    type Motion<S: Scalar> = Motion<S>;
    type Inertia<S: Scalar> = NoVariables;
    type Dynamics<S: Scalar> = NoVariables;
    type Energy<S: Scalar> = NoVariables;
    /// The kick has happened
    type Discrete = bool;

    fn new(parameters: &Parameters, _start: &Motion<f64>) -> Result<Self, ParameterError> {
        Ok(Self(parameters.clone()))
    }
    fn retune(&mut self, parameters: &Parameters) {
        self.0 = parameters.clone();
    }
    fn with_system<V: Visitor<Self>>(&self, visitor: V) -> V::Output {
        visitor.visit::<3, 1, _>(self)
    }
}

impl System<3, 1> for Ball {
    type Model = Self;
    type Spectrum = Dense;

    fn start(&self, _t: f64, _given: &Motion<f64>) -> Result<([f64; 3], bool), ParameterError> {
        Ok(([self.0.height, 0.0, 1.0], self.0.kick <= 0.0))
    }
    /// q' = 1e-3 q: an orientation that loses its unit length.
    fn rates<S: Scalar>(
        &self,
        _t: S,
        x: &[S; 3],
        _u: &NoVariables,
        _d: &bool,
    ) -> Result<[S; 3], EvaluationError> {
        let [_, v, q] = *x;
        Ok([v, S::lift(-G), q * 1e-3])
    }
    fn motion<S: Scalar>(
        &self,
        _t: S,
        x: &[S; 3],
        _u: &NoVariables,
        _d: &bool,
    ) -> Result<Motion<S>, EvaluationError> {
        let [z, v, q] = *x;
        Ok(Motion { z, v, q })
    }
    fn inertia<S: Scalar>(
        &self,
        _t: S,
        _x: &[S; 3],
        _u: &NoVariables,
        _d: &bool,
    ) -> Result<NoVariables, EvaluationError> {
        Ok(NoVariables)
    }
    fn dynamics<S: Scalar>(
        &self,
        _t: S,
        _x: &[S; 3],
        _u: &NoVariables,
        _d: &bool,
    ) -> Result<NoVariables, EvaluationError> {
        Ok(NoVariables)
    }
    fn energy<S: Scalar>(
        &self,
        _t: S,
        _x: &[S; 3],
        _u: &NoVariables,
        _d: &bool,
    ) -> Result<NoVariables, EvaluationError> {
        Ok(NoVariables)
    }
    fn state_names(&self) -> [String; 3] {
        ["z", "v", "q"].map(String::from)
    }
    fn off_manifold(&self, x: &[f64; 3]) -> f64 {
        (x[2] - 1.0).abs()
    }
    fn normalise(&self, x: &mut [f64; 3]) -> bool {
        x[2] = 1.0;
        true
    }
    fn indicators(&self, _t: f64, x: &[f64; 3], _u: &NoVariables, _d: &bool) -> [f64; 1] {
        [x[0]]
    }
    fn next_event(&self, kicked: &bool) -> Option<f64> {
        (!kicked).then_some(self.0.kick)
    }
    /// Reflects at the ground; the kick adds 1 m/s.
    fn update(&self, t: f64, x: &mut [f64; 3], _u: &NoVariables, kicked: &bool) -> bool {
        let [z, v, _] = x;
        if *z < 1e-6 && *v < 0.0 {
            *v *= -self.0.restitution;
        }
        if !kicked && t >= self.0.kick {
            *v += 1.0;
            return true;
        }
        *kicked
    }
}
