//! What the drivers share: the moving state, and who looks at the steps.

use crate::error::all_finite;
use crate::one_step::{Call, OneStep, Start};
use crate::{Dense, Ode, StepError};

/// Most work that one call may take, as [`Statistics::work`](crate::Statistics::work) counts it: a million steps of
/// the classical Runge-Kutta method, and a quarter more.
///
/// A step size of 1e-300 s, a motion at 1e9 rad/s or an explicit method on a very stiff problem then ends in an error
/// after seconds and not in a hang.
pub const MAX_EVALUATIONS: u64 = 5_000_000;

/// Working copy of what a call changes; handed over only when it succeeds.
#[derive(Clone, Copy)]
pub(crate) struct Run<const N: usize> {
    pub(crate) t: f64,
    pub(crate) x: [f64; N],
}

impl<const N: usize> Run<N> {
    /// Where the next step begins; `slope` if it is known already.
    #[inline]
    pub(crate) fn start<O: Ode<N>, W>(
        &self,
        call: &mut Call<'_, N, O, W>,
        slope: Option<[f64; N]>,
    ) -> Result<Start<N>, StepError<O::Error>> {
        let slope = match slope {
            Some(slope) => slope,
            None => call.rhs(self.t, &self.x)?,
        };
        Ok(Start { t: self.t, x: self.x, slope })
    }

    /// Moves on to a new state, projects it and clears what has died away; the result says whether that changed it.
    #[inline]
    pub(crate) fn accept<O: Ode<N>, W>(
        &mut self,
        call: &mut Call<'_, N, O, W>,
        t: f64,
        x: &[f64; N],
    ) -> Result<bool, StepError<O::Error>> {
        self.t = t;
        self.x = *x;
        call.statistics.steps += 1;
        let projected = call.ode.project(t, &mut self.x).map_err(|source| StepError::Rhs { t, source })?;
        if projected {
            all_finite(t, &self.x)?;
        }
        Ok(clear_subnormal(&mut self.x) || projected)
    }

    /// Shows a step to the observer; true if it ends the run, which then stands where the observer wants it.
    ///
    /// `t` is the end of the step (`from.t + h` but for rounding), and `last` says that it ends the call.
    pub(crate) fn watch<M: OneStep<N>, O: Ode<N>, W: Watch<N>>(
        &mut self,
        method: &M,
        call: &mut Call<'_, N, O, M::Work>,
        (from, dense): (&Start<N>, &Dense<N>),
        (t, last): (f64, bool),
        watch: &mut W,
    ) -> Result<bool, StepError<O::Error>> {
        let h = dense.h;
        let restep = |theta: f64| Ok(*M::state(&method.step(call, from, theta * h)?));
        let Some(Stop { theta, x }) = watch.inspect(dense, last, restep)? else {
            return Ok(false);
        };
        if theta > 0.0 {
            let t = if theta >= 1.0 { t } else { from.t + theta * h };
            all_finite(t, &x)?;
            self.accept(call, t, &x)?;
        }
        Ok(true)
    }
}

/// Sets subnormal states to zero; true if there were any.
///
/// A state that dies away would stay at the smallest subnormal number (5e-324 times 0.9 is rounded to 5e-324), and
/// processors that handle such numbers in microcode take many times as long for every operation on them.
#[inline]
pub(crate) fn clear_subnormal<const N: usize>(x: &mut [f64; N]) -> bool {
    let mut found = false;
    for x in x {
        if x.is_subnormal() {
            *x = 0.0;
            found = true;
        }
    }
    found
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
