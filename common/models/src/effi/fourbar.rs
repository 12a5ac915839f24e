//! Four-bar in its crank angle: closing, kinematic coefficients, reduced inertia and potential.
//!
//! Equations (15) to (18) of the write-up of `virtual_mechanism`; primes are derivatives by the crank angle.

use mechanics::{Scalar, tanh};
use model::{EvaluationError, ParameterError, Vector2};

use super::mechanism_variables::{FourbarParameters, Use};
use super::reduced::{Point, Reduced, detent};

/// Shortest gas strut that has a direction [m]
const SHORTEST: f64 = 1e-12;

/// The four-bar.
#[derive(Debug, Clone)]
pub struct Fourbar {
    p: FourbarParameters,
    parts: Use,
    /// Gravity in the plane [m/s2]
    g: Vector2<f64>,
}

/// The closed loop at a crank angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Loop<S> {
    /// Joint of crank and coupler, with its derivatives
    pub P: Point<S>,
    /// Angle of the coupler and its derivatives
    pub psi: S,
    /// psi'
    pub psi_1: S,
    /// psi''
    pub psi_2: S,
    /// chi': derivative of the rocker's angle
    pub chi_1: S,
    /// chi''
    pub chi_2: S,
    /// Sine of the angle between coupler and rocker, before it is held
    pub toggle: S,
    t: Vector2<S>,
    n: Vector2<S>,
}

fn cross<S: Scalar>(a: &Vector2<S>, b: &Vector2<S>) -> S {
    a.x * b.y - a.y * b.x
}

impl<S: Scalar> Loop<S> {
    /// A point of the coupler, given in its frame.
    fn point(&self, p: &Vector2<f64>) -> Point<S> {
        let turned = self.t * S::lift(p.x) + self.n * S::lift(p.y);
        let across = self.n * S::lift(p.x) - self.t * S::lift(p.y);
        let Point { r, r_1, r_2 } = self.P;
        Point {
            r: r + turned,
            r_1: r_1 + across * self.psi_1,
            r_2: r_2 + across * self.psi_2 - turned * (self.psi_1 * self.psi_1),
        }
    }
}

impl Fourbar {
    /// The four-bar, if its parameters fit together.
    ///
    /// # Errors
    /// No branch, stops in the wrong order.
    pub fn new(p: &FourbarParameters, parts: Use, g: Vector2<f64>) -> Result<Self, ParameterError> {
        if p.branch == 0 {
            return Err(ParameterError::refused("branch", 0.0, "the loop closes in two ways", "-1 or 1"));
        }
        if p.stop.hi <= p.stop.lo {
            let allowed = format!("> {} rad", p.stop.lo);
            return Err(ParameterError::refused("stop.hi", p.stop.hi, "no travel is left", allowed));
        }
        Ok(Self { p: *p, parts, g })
    }

    /// The loop at a crank angle (15), (16); the sine at the toggle is held at `toggle.tolerance` in size.
    ///
    /// # Errors
    /// The loop cannot be closed.
    pub fn close<S: Scalar>(&self, phi: S) -> Result<Loop<S>, EvaluationError> {
        let FourbarParameters { a, b, c, .. } = self.p;
        let (sin, cos) = phi.sin_cos();
        let arm = Vector2::new(cos, sin) * S::lift(a);
        let r_1 = Vector2::new(-arm.y, arm.x);
        let P = Point { r: self.p.O_1.map(S::lift) + arm, r_1, r_2: -arm };
        let e = self.p.O_2.map(S::lift) - P.r;
        let L = e.norm_squared().sqrt();
        let angle = (L * L + (b * b - c * c)) / (L * (2.0 * b));
        let room = 1.0 - angle.re().abs();
        if room.is_nan() || room < 0.0 {
            let quantity = "room to close the four-bar (1 - |cosine of the angle at the coupler|)";
            return Err(EvaluationError::Vanishes { quantity, value: room, limit: 0.0 });
        }
        let psi = e.y.atan2(e.x) + angle.acos() * f64::from(self.p.branch);
        let (sin, cos) = psi.sin_cos();
        let (t, n) = (Vector2::new(cos, sin), Vector2::new(-sin, cos));
        let r = P.r + t * S::lift(b) - self.p.O_2.map(S::lift);
        let toggle = r.dot(&n) / c;
        let held = if toggle.re().abs() < self.p.toggle {
            S::lift(self.p.toggle.copysign(toggle.re()))
        } else {
            toggle
        };
        let lever = held * (b * c);
        let psi_1 = -r.dot(&P.r_1) / lever;
        let Q_1 = P.r_1 + n * (psi_1 * b);
        let psi_2 = -(Q_1.norm_squared() + r.dot(&P.r_2) - psi_1 * psi_1 * r.dot(&t) * b) / lever;
        let Q_2 = P.r_2 + n * (psi_2 * b) - t * (psi_1 * psi_1 * b);
        let [chi_1, chi_2] = [Q_1, Q_2].map(|Q| cross(&r, &Q) / (c * c));
        Ok(Loop { P, psi, psi_1, psi_2, chi_1, chi_2, toggle, t, n })
    }

    /// Reduced to the crank angle (17), (18).
    pub(super) fn reduced<S: Scalar>(&self, phi: S) -> Result<Reduced<S>, EvaluationError> {
        let p = &self.p;
        let l = self.close(phi)?;
        let [C, H] = [l.point(&p.com), l.point(&p.hand)];
        let turning = l.psi_1 * l.psi_1 * p.I + l.chi_1 * l.chi_1 * p.I_2 + p.I_1;
        let M = turning + C.r_1.norm_squared() * p.m + H.r_1.norm_squared() * p.m_hand;
        let M_1 = (C.r_1.dot(&C.r_2) * p.m
            + l.psi_1 * l.psi_2 * p.I
            + l.chi_1 * l.chi_2 * p.I_2
            + H.r_1.dot(&H.r_2) * p.m_hand)
            * 2.0;
        let g = self.g.map(S::lift);
        let mut V = -(g.dot(&C.r) * p.m + g.dot(&H.r) * p.m_hand);
        let mut V_1 = -(g.dot(&C.r_1) * p.m + g.dot(&H.r_1) * p.m_hand);
        if self.parts.gas {
            let G = l.point(&p.gas_point);
            let strut = G.r - p.gas_base.map(S::lift);
            let length = strut.norm_squared().sqrt();
            if length.re() < SHORTEST {
                let quantity = "length of the gas strut";
                return Err(EvaluationError::Vanishes { quantity, value: length.re(), limit: SHORTEST });
            }
            let stretch = length - p.l_gas;
            V += stretch * stretch * (0.5 * p.k_gas) - length * p.F_gas;
            V_1 += (stretch * p.k_gas - p.F_gas) * (strut.dot(&G.r_1) / length);
        }
        if self.parts.detent {
            let [well, slope] = detent(phi, p.E_det, p.phi_det, p.w_det);
            V += well;
            V_1 += slope;
        }
        Ok(Reduced { M, M_1, V, V_1, H })
    }

    /// Friction against a rate [N.m]
    pub(super) fn friction<S: Scalar>(&self, rate: S) -> S {
        rate * self.p.visc + tanh(rate / self.p.w_c) * self.p.coul
    }
}
