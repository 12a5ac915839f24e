//! End stops of a coordinate, with a rest of restitution.
//!
//! ```text
//! F = k p max(0, 1 + chi p')    p: penetration beyond lo or hi, p' its rate; pushes back, never pulls     (9), (19)
//! ```
//! Source: Hunt & Crossley (1975), exponent 1.

use mechanics::Scalar;

/// Stops at both ends of a range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stop {
    pub(crate) lo: f64,
    pub(crate) hi: f64,
    /// Stiffness
    pub(crate) k: f64,
    /// Damping relative to the elastic force, per speed
    pub(crate) chi: f64,
}

impl Stop {
    /// Penetration and the sign of its direction.
    fn beyond<S: Scalar>(&self, s: S) -> Option<(S, f64)> {
        if s.re() > self.hi {
            Some((s - self.hi, 1.0))
        } else if s.re() < self.lo {
            Some((-s + self.lo, -1.0))
        } else {
            None
        }
    }

    /// Force on the coordinate `s` that moves with `v`.
    #[inline]
    pub(crate) fn force<S: Scalar>(&self, s: S, v: S) -> S {
        let zero = S::lift(0.0);
        let Some((p, sign)) = self.beyond(s) else { return zero };
        let share = (v * (sign * self.chi) + 1.0).max(zero);
        p * share * (-sign * self.k)
    }

    /// Elastic energy.
    pub(crate) fn energy<S: Scalar>(&self, s: S) -> S {
        self.beyond(s).map_or(S::lift(0.0), |(p, _)| p * p * (0.5 * self.k))
    }

    /// Power turned into heat: what the force takes beyond its elastic part.
    pub(crate) fn heat<S: Scalar>(&self, s: S, v: S) -> S {
        let Some((p, sign)) = self.beyond(s) else { return S::lift(0.0) };
        -(self.force(s, v) + p * (sign * self.k)) * v
    }
}
