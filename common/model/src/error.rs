//! What can go wrong in a model; each variant carries the values that make it fixable.

use mechanics::{InconsistentClosure, NotPositiveDefinite};

/// The equations have no value here.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum EvaluationError {
    /// A length or another divisor became too small.
    #[error("{quantity} vanishes: {value:.3e} (must stay above {limit:.0e})")]
    Vanishes {
        /// What became small
        quantity: &'static str,
        /// Its value
        value: f64,
        /// Its smallest usable value
        limit: f64,
    },
    /// An input that the equations have no value for, although each number by itself is in its range.
    #[error("{variable} {problem}: {value:.6e}; allowed: {allowed}")]
    Input {
        /// Name of the input or its group
        variable: &'static str,
        /// What is wrong
        problem: &'static str,
        /// The value that shows it
        value: f64,
        /// What would be accepted
        allowed: &'static str,
    },
    /// A state has grown beyond what the equations can square.
    #[error("{variable} = {value:.3e} is too large; allowed: |{variable}| <= {limit:.0e}")]
    TooLarge {
        /// Name of the state
        variable: &'static str,
        /// Its value
        value: f64,
        /// Its largest usable magnitude
        limit: f64,
    },
    /// The inertia of an element admits no unique motion.
    #[error("{element}: {source}")]
    Inertia {
        /// Name of the element
        element: &'static str,
        /// The cause
        source: NotPositiveDefinite,
    },
    /// A loop cannot be closed on accelerations.
    #[error(transparent)]
    Closure(#[from] InconsistentClosure),
}

/// Parameters or start values that do not fit together.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ParameterError {
    /// One value excludes the others.
    #[error("{variable} = {value} is refused: {reason}; allowed: {allowed}")]
    Refused {
        /// Name of the variable
        variable: &'static str,
        /// Its value
        value: f64,
        /// Why it cannot be used
        reason: String,
        /// What would be accepted
        allowed: String,
    },
    /// The equations have no value at the start.
    #[error("no consistent start: {0}")]
    Start(#[from] EvaluationError),
}

impl ParameterError {
    /// One value excludes the others.
    pub fn refused(
        variable: &'static str,
        value: f64,
        reason: impl Into<String>,
        allowed: impl Into<String>,
    ) -> Self {
        Self::Refused { variable, value, reason: reason.into(), allowed: allowed.into() }
    }
}
