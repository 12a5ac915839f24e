//! Friction of an axis.
//!
//! ```text
//! g(v) = F_c + (F_s - F_c) exp(-(v/v_s)^2)
//! lugre        z' = v - s0 |v| z/g(v),   F = s0 z + s1 exp(-(v/v_d)^2) z' + s2 v               (8)
//! regularised  F = s2 v + g(v) tanh(v/(0.1 v_s))
//! viscous      F = s2 v
//! ```
//! Source: Canudas de Wit et al. (1995); the weight of s1 falls with the speed against the non-passivity of a constant s1
//! (Olsson 1996).

use mechanics::{Scalar, tanh};
use model::{Enumeration, ParameterError, Variables};

/// Law of friction
#[derive(Debug, Clone, Copy, PartialEq, Eq, Enumeration)]
pub enum FrictionModel {
    /// None
    None = 1,
    /// Proportional to the velocity
    Viscous = 2,
    /// Viscous and Coulomb friction, smooth through zero velocity
    Regularised = 3,
    /// Bristles: sticks, slides, breaks away
    Lugre = 4,
}

/// Parameters of friction.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(parameter)]
pub struct Friction {
    /// Law of friction
    #[var(name = "model", item = FrictionModel::Lugre)]
    pub model: FrictionModel,
    /// Stiffness of the bristles [N/m]
    #[var(name = "s0", start = 2e6, above = 0.0)]
    pub s0: f64,
    /// Damping of the bristles at rest [N.s/m]
    #[var(name = "s1", start = 5000.0, min = 0.0)]
    pub s1: f64,
    /// Velocity at which the damping of the bristles has fallen to 1/e [m/s]
    #[var(name = "v_d", start = 0.005, above = 0.0)]
    pub v_d: f64,
    /// Viscous friction [N.s/m]
    #[var(name = "s2", start = 300.0, min = 0.0)]
    pub s2: f64,
    /// Coulomb friction; 0: no bristles [N]
    #[var(name = "F_c", start = 60.0, min = 0.0)]
    pub F_c: f64,
    /// Static friction, at least F_c [N]
    #[var(name = "F_s", start = 90.0, min = 0.0)]
    pub F_s: f64,
    /// Stribeck velocity [m/s]
    #[var(name = "v_s", start = 0.005, above = 0.0)]
    pub v_s: f64,
}

/// Friction of one axis at a moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Rubbing<S> {
    /// Against the motion [N]
    pub(super) F: S,
    /// Rate of the bristle's deflection [m/s]
    pub(super) z_dot: S,
}

impl Friction {
    /// The parameters, if they fit together.
    pub(super) fn checked(&self) -> Result<Self, ParameterError> {
        if self.F_s < self.F_c {
            let reason = format!("below the Coulomb friction friction.F_c = {}", self.F_c);
            let allowed = format!(">= {} N", self.F_c);
            return Err(ParameterError::refused("friction.F_s", self.F_s, reason, allowed));
        }
        Ok(*self)
    }

    fn bell<S: Scalar>(v: S, width: f64) -> S {
        let r = v / width;
        (-(r * r)).exp()
    }

    /// Friction at the velocity `v` with bristles deflected by `z` (8).
    #[inline]
    pub(super) fn at<S: Scalar>(&self, v: S, z: S) -> Rubbing<S> {
        let still = S::lift(0.0);
        let viscous = v * self.s2;
        let g = || Self::bell(v, self.v_s) * (self.F_s - self.F_c) + self.F_c;
        match self.model {
            FrictionModel::None => Rubbing { F: still, z_dot: still },
            FrictionModel::Lugre if self.F_c > 0.0 => {
                let z_dot = v - v.abs() * z * self.s0 / g();
                Rubbing { F: z * self.s0 + Self::bell(v, self.v_d) * z_dot * self.s1 + viscous, z_dot }
            }
            FrictionModel::Regularised => {
                Rubbing { F: viscous + g() * tanh(v / (0.1 * self.v_s)), z_dot: still }
            }
            FrictionModel::Viscous | FrictionModel::Lugre => Rubbing { F: viscous, z_dot: still },
        }
    }
}
