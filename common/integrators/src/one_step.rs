//! What the drivers ask of a method.

use crate::{Dense, Ode, StepError};

/// Where a step begins.
#[derive(Clone, Copy)]
pub(crate) struct Start<const N: usize> {
    pub(crate) t: f64,
    pub(crate) x: [f64; N],
    /// `f(t, x)`
    pub(crate) slope: [f64; N],
}

/// A method that needs no past: one step from one state.
pub(crate) trait OneStep<const N: usize> {
    /// What a step leaves behind: the new state and all that error estimate and dense output need.
    type Trial;

    /// Exponent of the step size in the global error, and in the error estimate of one step.
    fn order(&self) -> u32;

    /// One step of length `h`; evaluations are counted even when one of them fails.
    fn step<O: Ode<N>>(
        &self,
        ode: &O,
        from: &Start<N>,
        h: f64,
        evaluations: &mut u64,
    ) -> Result<Self::Trial, StepError<O::Error>>;

    /// The new state.
    fn state(trial: &Self::Trial) -> &[f64; N];

    /// The slope at the new state, where the step has evaluated it already.
    fn slope<'a>(&self, trial: &'a Self::Trial) -> Option<&'a [f64; N]>;

    /// Estimate of the local error; zero for methods without one.
    fn error(&self, trial: &Self::Trial, h: f64) -> [f64; N];

    /// The solution inside the step.
    fn dense(&self, from: &Start<N>, trial: &Self::Trial, h: f64) -> Dense<N>;
}
