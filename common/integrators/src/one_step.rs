//! What the drivers ask of a method.

use crate::error::all_finite;
use crate::norm::Norm;
use crate::pace::Pace;
use crate::{Dense, Jacobian, Ode, Statistics, StepError};

/// Where a step begins.
#[derive(Clone, Copy)]
pub(crate) struct Start<const N: usize> {
    pub(crate) t: f64,
    pub(crate) x: [f64; N],
    /// `f(t, x)`
    pub(crate) slope: [f64; N],
}

/// What the steps of one call share.
pub(crate) struct Call<'a, const N: usize, O, W> {
    pub(crate) ode: &'a O,
    pub(crate) norm: Norm<N>,
    pub(crate) statistics: Statistics,
    /// What the method keeps from step to step, e.g. a Jacobian.
    pub(crate) work: &'a mut W,
}

impl<const N: usize, O: Ode<N>, W> Call<'_, N, O, W> {
    /// `f(t, x)`, counted even when it fails.
    #[inline]
    pub(crate) fn rhs(&mut self, t: f64, x: &[f64; N]) -> Result<[f64; N], StepError<O::Error>> {
        self.statistics.rhs_evaluations += 1;
        self.ode.rhs(t, x).map_err(|source| StepError::Rhs { t, source })
    }

    /// Derivatives at the start of a step, counted.
    pub(crate) fn jacobian(&mut self, from: &Start<N>) -> Result<Jacobian<N>, StepError<O::Error>> {
        self.statistics.jacobians += 1;
        let t = from.t;
        let (j, f_t) =
            self.ode.jacobian(t, &from.x, &from.slope).map_err(|source| StepError::Rhs { t, source })?;
        for row in &j {
            all_finite(t, row)?;
        }
        all_finite(t, &f_t)?;
        Ok((j, f_t))
    }
}

/// Estimate of a local error.
pub(crate) struct Estimate<const N: usize> {
    /// In units of the tolerance; the step counts up to 1.
    pub(crate) size: f64,
    /// Of each component.
    pub(crate) parts: [f64; N],
}

impl<const N: usize> Estimate<N> {
    /// Of a method without an estimate.
    pub(crate) const NONE: Self = Self { size: 0.0, parts: [0.0; N] };
}

/// A method that needs no past: one step from one state.
///
/// What it keeps in its `Work` makes later steps cheaper, never possible.
pub(crate) trait OneStep<const N: usize> {
    /// What a step leaves behind: the new state and all that error estimate and dense output need.
    type Trial;

    /// What the steps of a call share.
    type Work;

    /// How the step size follows the error.
    fn pace(&self) -> Pace;

    /// The tolerance for the error estimate, where its order lies far below that of the method.
    fn tolerance(&self, rtol: f64) -> f64 {
        rtol
    }

    /// Before the trials of a step.
    #[inline]
    fn begin<O: Ode<N>>(
        &self,
        _call: &mut Call<'_, N, O, Self::Work>,
        _from: &Start<N>,
    ) -> Result<(), StepError<O::Error>> {
        Ok(())
    }

    /// One step of length `h`.
    fn step<O: Ode<N>>(
        &self,
        call: &mut Call<'_, N, O, Self::Work>,
        from: &Start<N>,
        h: f64,
    ) -> Result<Self::Trial, StepError<O::Error>>;

    /// The new state.
    fn state(trial: &Self::Trial) -> &[f64; N];

    /// The slope at the new state, where it is known already.
    fn slope<'a>(&self, trial: &'a Self::Trial) -> Option<&'a [f64; N]>;

    /// The local error; `fresh`: no step of this length has been taken just before.
    fn error<O: Ode<N>>(
        &self,
        call: &mut Call<'_, N, O, Self::Work>,
        from: &Start<N>,
        trial: &Self::Trial,
        h: f64,
        fresh: bool,
    ) -> Estimate<N>;

    /// The solution inside the step.
    fn dense<O: Ode<N>>(
        &self,
        call: &mut Call<'_, N, O, Self::Work>,
        from: &Start<N>,
        trial: &mut Self::Trial,
        h: f64,
    ) -> Result<Dense<N>, StepError<O::Error>>;

    /// The step counts.
    #[inline]
    fn accepted(&self, _work: &mut Self::Work, _trial: &Self::Trial, _h: f64) {}

    /// Part of the step size that the error allows.
    #[inline]
    fn safety(&self, _trial: &Self::Trial) -> f64 {
        0.9
    }

    /// Whether the same step size again is worth more than one longer by `growth`.
    #[inline]
    fn keeps(&self, _work: &Self::Work, _growth: f64) -> bool {
        false
    }
}
