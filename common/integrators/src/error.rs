//! Everything that can go wrong.

/// A setting that no method can work with.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("solver {name} is {value}; it must be finite and greater than 0")]
pub struct SettingsError {
    /// Field of [`Settings`](crate::Settings).
    pub name: &'static str,
    /// Its value.
    pub value: f64,
}

/// Why a call could not reach its end; state, time, counters and solver memory are as before it.
///
/// `E` is the error of the right-hand side.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum StepError<E> {
    /// The interval is not one forward in time.
    #[error("cannot integrate from t = {t} s to t = {t_end} s")]
    Interval {
        /// Start of the call [s].
        t: f64,
        /// End asked for [s].
        t_end: f64,
    },
    /// A state, or at the start of a step its derivative, is infinite or not a number.
    #[error("state {index} or its derivative is {value} at t = {t:.6} s")]
    NotFinite {
        /// Time [s].
        t: f64,
        /// Which state, from 0.
        index: usize,
        /// What it became.
        value: f64,
    },
    /// An event indicator is infinite or not a number.
    #[error("event indicator {index} is {value} at t = {t:.6} s")]
    IndicatorNotFinite {
        /// Time [s].
        t: f64,
        /// Which indicator, from 0.
        index: usize,
        /// What it became.
        value: f64,
    },
    /// The step size of an adaptive method fell to the resolution of time.
    #[error("step size fell to {h:.3e} s at t = {t:.6} s (below {min:.0e}); stiffest state: {index}")]
    StepTooSmall {
        /// Start of the step [s].
        t: f64,
        /// Step size that the error estimate asks for [s].
        h: f64,
        /// Smallest step size allowed [s].
        min: f64,
        /// State with the largest scaled error, from 0.
        index: usize,
    },
    /// The equations of an implicit step have no solution near its start, whatever the step size.
    #[error("the equations of an implicit step of {h:.3e} s at t = {t:.6} s could not be solved")]
    NoSolution {
        /// Start of the step [s].
        t: f64,
        /// Its length [s].
        h: f64,
    },
    /// The method is for linear systems only.
    #[error(
        "the method exact is for linear systems x' = A x + b; this one does not declare itself linear (t = {t:.6} s)"
    )]
    NotLinear {
        /// Start of the call [s].
        t: f64,
    },
    /// The call needs more work than [`MAX_EVALUATIONS`](crate::MAX_EVALUATIONS).
    #[error(
        "more than {} evaluations of the equations are needed: at t = {t:.6} s of {t_end:.6} s steps are {h:.3e} s long",
        crate::MAX_EVALUATIONS
    )]
    TooMuchWork {
        /// Where the solver gave up [s].
        t: f64,
        /// End asked for [s].
        t_end: f64,
        /// Step size there [s].
        h: f64,
    },
    /// The right-hand side or the projection failed.
    #[error("at t = {t:.6} s: {source}")]
    Rhs {
        /// Time of the evaluation [s].
        t: f64,
        /// What the model says.
        source: E,
    },
}

/// The first entry that is not finite, as an error.
#[inline]
pub(crate) fn all_finite<const N: usize, E>(t: f64, values: &[f64; N]) -> Result<(), StepError<E>> {
    if values.iter().fold(true, |all, v| all & v.is_finite()) {
        return Ok(());
    }
    let index = values.iter().position(|v| !v.is_finite()).unwrap_or(0);
    Err(StepError::NotFinite { t, index, value: values[index] })
}
