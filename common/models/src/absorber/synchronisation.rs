//! Stability of the synchronised motion x = X sin(Omega t), (17) to (21).

use std::convert::Infallible;
use std::f64::consts::PI;

use integrators::{Method, Ode, Settings, Solver, Statistics};
use serde::{Deserialize, Serialize};

/// What decides whether the synchronised motion is stable.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Stability {
    /// `2 f sin(alpha) + g` (19)
    pub trace: f64,
    /// `f + g sin(alpha)` (20)
    pub determinant: f64,
    /// `1 + f cos(alpha)` (21)
    pub stiffness: f64,
    /// Largest modulus of the multipliers over half a period (18); infinite if it cannot be computed
    pub multiplier: f64,
    /// The motion is stable
    pub predicted: bool,
}

impl Stability {
    /// From design force `f = F_d/(m Omega^2 X)`, gain `g = gamma Omega X^2` and phase.
    ///
    /// With f = 0 there is nothing to synchronise with: the free oscillation is stable if its trace is, its phase is indifferent.
    #[must_use]
    pub fn new(g: f64, f: f64, alpha: f64) -> Self {
        // X < 0: the same motion with the phase turned by pi
        let (f, alpha) = if f < 0.0 { (-f, alpha + PI) } else { (f, alpha) };
        let (sin, cos) = alpha.sin_cos();
        let (trace, determinant, stiffness) = (2.0 * f * sin + g, f + g * sin, 1.0 + f * cos);
        let multiplier = multiplier(g, f, alpha);
        let predicted = trace > 0.0 && (f <= 0.0 || determinant > 0.0 && multiplier < 1.0);
        Self { trace, determinant, stiffness, multiplier, predicted }
    }
}

/// The variational equation (18), two solutions side by side.
struct Variation {
    g: f64,
    f_sin: f64,
    f_cos: f64,
}

impl Ode<4> for Variation {
    type Error = Infallible;
    fn rhs(&self, s: f64, z: &[f64; 4]) -> Result<[f64; 4], Infallible> {
        let (sin, cos) = s.sin_cos();
        let damping = self.g * cos * cos + self.f_sin;
        let stiffness = 1.0 + self.f_cos + self.g * sin * cos;
        let [p, p_dot, q, q_dot] = *z;
        Ok([p_dot, -damping * p_dot - stiffness * p, q_dot, -damping * q_dot - stiffness * q])
    }
}

/// Gain above which an implicit method is cheaper.
const STIFF: f64 = 1e3;

/// Largest modulus of the eigenvalues of the transition of (18) over [0, pi]; infinite where it cannot be computed.
///
/// The determinant of the transition is known (Liouville), the trace comes from integration.
#[must_use]
pub fn multiplier(g: f64, f: f64, alpha: f64) -> f64 {
    let (f_sin, f_cos) = (f * alpha.sin(), f * alpha.cos());
    let method = if g > STIFF { Method::Radau5 } else { Method::Dop853 };
    let settings = Settings { method, step: 1.0, rtol: 1e-12, atol: 1e-20 };
    let mut z = [1.0, 0.0, 0.0, 1.0];
    let integrated = Solver::new(settings).ok().and_then(|mut solver| {
        let ode = Variation { g, f_sin, f_cos };
        solver.advance(&ode, 0.0, PI, &mut z, &mut Statistics::default()).ok()
    });
    if integrated.is_none() {
        return f64::INFINITY;
    }
    let half = 0.5 * (z[0] + z[3]);
    let determinant = (-PI * (0.5 * g + f_sin)).exp();
    let square = half * half - determinant;
    let largest = if square < 0.0 { determinant.sqrt() } else { half.abs() + square.sqrt() };
    if largest.is_finite() { largest } else { f64::INFINITY }
}
