//! Drawer or guided tool in its opening.

use mechanics::{Scalar, tanh};
use model::{ParameterError, Vector2};

use super::mechanism_variables::{DrawerParameters, Use};
use super::reduced::{Point, Reduced, detent};

/// The drawer.
#[derive(Debug, Clone)]
pub(super) struct Drawer {
    p: DrawerParameters,
    parts: Use,
    /// Gravity in the plane [m/s2]
    g: Vector2<f64>,
}

impl Drawer {
    /// The drawer, if its parameters fit together.
    ///
    /// # Errors
    /// A direction without length.
    pub(super) fn new(p: &DrawerParameters, parts: Use, g: Vector2<f64>) -> Result<Self, ParameterError> {
        let length = p.e.norm();
        if length < f64::MIN_POSITIVE {
            let reason = "the direction has no length";
            return Err(ParameterError::refused("drawer.direction.x", p.e.x, reason, "|direction| > 0"));
        }
        Ok(Self { p: DrawerParameters { e: p.e / length, ..*p }, parts, g })
    }

    /// Reduced to the opening.
    pub(super) fn reduced<S: Scalar>(&self, s: S) -> Reduced<S> {
        let p = &self.p;
        let zero = S::lift(0.0);
        let e = p.e.map(S::lift);
        let H = Point { r: p.H_0.map(S::lift) + e * s, r_1: e, r_2: Vector2::zeros() };
        let weight = self.g.dot(&p.e) * p.m;
        let mut V = s * -weight;
        let mut V_1 = S::lift(-weight);
        if self.parts.detent {
            let [well, slope] = detent(s, p.E_det, p.s_det, p.w_det);
            V += well;
            V_1 += slope;
        }
        if self.parts.soft_close {
            let left = (-s + p.l_s).max(zero);
            V -= left * left * (0.5 * p.k_s);
            V_1 += left * p.k_s;
        }
        Reduced { M: S::lift(p.m), M_1: zero, V, V_1, H }
    }

    /// Friction and damping of soft close against a velocity [N]
    pub(super) fn friction<S: Scalar>(&self, s: S, v: S) -> S {
        let p = &self.p;
        let mut F = v * p.visc + tanh(v / p.v_c) * p.coul;
        if self.parts.soft_close {
            let share = (-s / p.l_s + 1.0).clamp(S::lift(0.0), S::lift(1.0));
            F += share * v * p.c_s;
        }
        F
    }
}
