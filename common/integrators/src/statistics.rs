//! What a run costs.

/// Counters over all calls that succeeded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Statistics {
    /// Accepted steps.
    pub steps: u64,
    /// Trial steps thrown away by an adaptive method.
    pub rejected: u64,
    /// Evaluations of the right-hand side, those of rejected steps, start guesses and event location included.
    pub rhs_evaluations: u64,
}
