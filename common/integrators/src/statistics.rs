//! What a run costs.

use serde::{Deserialize, Serialize};

/// Counters over all calls that succeeded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Statistics {
    /// Accepted steps.
    pub steps: u64,
    /// Trial steps thrown away by an adaptive method.
    pub rejected: u64,
    /// Evaluations of the right-hand side, those of rejected steps, start guesses and event location included.
    ///
    /// Those inside [`Ode::jacobian`](crate::Ode::jacobian) are not: by the default, `N + 1` for each of `jacobians`.
    pub rhs_evaluations: u64,
    /// Jacobians of an implicit method.
    pub jacobians: u64,
    /// Matrices decomposed by an implicit method; Radau5's real and complex one together count as one.
    pub decompositions: u64,
}

impl Statistics {
    /// The work on `n` states, in evaluations of the right-hand side: a Jacobian counts as `2 (n + 1)` of them (in dual
    /// numbers each costs up to two), a decomposition as `n`.
    #[must_use]
    pub const fn work(&self, n: usize) -> u64 {
        let n = n as u64;
        self.rhs_evaluations + 2 * (n + 1) * self.jacobians + n * self.decompositions
    }
}
