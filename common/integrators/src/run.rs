//! What the drivers share: the moving state, and who looks at the steps.

use crate::error::all_finite;
use crate::one_step::{OneStep, Start};
use crate::{Dense, Ode, Statistics, StepError};

/// Most steps that one call may take, rejected ones included: a hundredfold of the longest sensible call.
///
/// A step size of 1e-300 s, or an explicit method on a very stiff problem, then ends in an error and not in a hang.
pub const MAX_STEPS: u32 = 10_000_000;

/// Working copy of what a call changes; handed over only when it succeeds.
#[derive(Clone, Copy)]
pub(crate) struct Run<const N: usize> {
    pub(crate) t: f64,
    pub(crate) x: [f64; N],
    pub(crate) statistics: Statistics,
}

impl<const N: usize> Run<N> {
    /// `f(t, x)`, counted.
    #[inline]
    pub(crate) fn slope<O: Ode<N>>(&mut self, ode: &O) -> Result<[f64; N], StepError<O::Error>> {
        self.statistics.rhs_evaluations += 1;
        ode.rhs(self.t, &self.x).map_err(|source| StepError::Rhs { t: self.t, source })
    }

    /// Moves on to a new state and projects it; the result says whether the projection changed it.
    #[inline]
    pub(crate) fn accept<O: Ode<N>>(
        &mut self,
        ode: &O,
        t: f64,
        x: &[f64; N],
    ) -> Result<bool, StepError<O::Error>> {
        self.t = t;
        self.x = *x;
        self.statistics.steps += 1;
        let changed = ode.project(t, &mut self.x).map_err(|source| StepError::Rhs { t, source })?;
        if changed {
            all_finite(t, &self.x)?;
        }
        Ok(changed)
    }

    /// Shows a step to the observer; true if it ends the run, which then stands where the observer wants it.
    pub(crate) fn watch<M: OneStep<N>, O: Ode<N>, W: Watch<N>>(
        &mut self,
        method: &M,
        ode: &O,
        taken: &Taken<N, M::Trial>,
        watch: &mut W,
    ) -> Result<bool, StepError<O::Error>> {
        let Taken { from, trial, h, t, .. } = *taken;
        let restep = |theta: f64| {
            let trial = method.step(ode, from, theta * h, &mut self.statistics.rhs_evaluations)?;
            Ok(*M::state(&trial))
        };
        let Some(Stop { theta, x }) = watch.inspect(&method.dense(from, trial, h), taken.last, restep)?
        else {
            return Ok(false);
        };
        if theta > 0.0 {
            let t = if theta >= 1.0 { t } else { from.t + theta * h };
            all_finite(t, &x)?;
            self.accept(ode, t, &x)?;
        }
        Ok(true)
    }
}

/// A step that a driver is about to accept.
pub(crate) struct Taken<'a, const N: usize, T> {
    pub(crate) from: &'a Start<N>,
    pub(crate) trial: &'a T,
    pub(crate) h: f64,
    /// Its end; `from.t + h` but for rounding.
    pub(crate) t: f64,
    /// It ends the call.
    pub(crate) last: bool,
}

/// Where an observer ends the run.
pub(crate) struct Stop<const N: usize> {
    /// Fraction of the step.
    pub(crate) theta: f64,
    pub(crate) x: [f64; N],
}

/// Looks at every accepted step before the run moves on.
pub(crate) trait Watch<const N: usize> {
    /// False: dense output is never made.
    const WATCHES: bool;

    /// `restep(theta)` repeats the step with the length `theta h`; `last` says that the step ends the call.
    fn inspect<E>(
        &mut self,
        step: &Dense<N>,
        last: bool,
        restep: impl FnMut(f64) -> Result<[f64; N], StepError<E>>,
    ) -> Result<Option<Stop<N>>, StepError<E>>;
}

/// Nobody looks.
pub(crate) struct Unwatched;

impl<const N: usize> Watch<N> for Unwatched {
    const WATCHES: bool = false;

    fn inspect<E>(
        &mut self,
        _step: &Dense<N>,
        _last: bool,
        _restep: impl FnMut(f64) -> Result<[f64; N], StepError<E>>,
    ) -> Result<Option<Stop<N>>, StepError<E>> {
        Ok(None)
    }
}

/// Shows each step to a closure and never stops.
pub(crate) struct Show<F>(pub(crate) F);

impl<const N: usize, F: FnMut(&Dense<N>)> Watch<N> for Show<F> {
    const WATCHES: bool = true;

    fn inspect<E>(
        &mut self,
        step: &Dense<N>,
        _last: bool,
        _restep: impl FnMut(f64) -> Result<[f64; N], StepError<E>>,
    ) -> Result<Option<Stop<N>>, StepError<E>> {
        (self.0)(step);
        Ok(None)
    }
}
