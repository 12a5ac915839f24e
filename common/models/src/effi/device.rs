//! Kinematics and weight of the base device, which plant and controller share.
//!
//! ```text
//! l_i = |H - P_i|,   u_i = (H - P_i)/l_i,   t_i = (-u_iz, u_ix),   P_1 = A, P_2 = B          (1)
//! e = (B - A)/L,   xi = (l_1^2 - l_2^2 + L^2)/(2 L),   eta = branch sqrt(l_1^2 - xi^2),
//! H = A + xi e + eta (-e_z, e_x)                                                              (2)
//! l' = J v, rows u_i;   det J = u_1 x u_2                                                     (3)
//! ```

use mechanics::{Matrix, Scalar};
use model::{EvaluationError, ParameterError, Variables, Vector2, Vector3};

/// Matrix in the x-z plane.
pub type Matrix2<S> = Matrix<S, 2, 2>;

/// Shortest usable distance between a pivot and the handle [m]
const SHORTEST: f64 = 1e-9;

/// Part of a length that is rounding.
const ROUNDING: f64 = 1e-12;

/// Geometry, masses and limits of the device.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(parameter)]
pub struct Device {
    /// Pivot of the first cylinder [m]
    #[var(name = "A", start = [-0.35, 0.0])]
    pub A: Vector2<f64>,
    /// Pivot of the second cylinder [m]
    #[var(name = "B", start = [0.35, 0.0])]
    pub B: Vector2<f64>,
    /// Side of the line from A to B on which the handle is: 1 left, -1 right
    #[var(name = "branch", start = 1.0, min = -1.0, max = 1.0)]
    pub branch: i32,
    /// Mass of the handle [kg]
    #[var(name = "handle.mass", start = 2.0, above = 0.0)]
    pub m_H: f64,
    /// Mass of each rod [kg]
    #[var(name = "rod.mass", start = 3.0, min = 0.0)]
    pub m_rod: f64,
    /// Distance of a rod's centre of mass behind H [m]
    #[var(name = "rod.com", start = 0.25)]
    pub rod_com: f64,
    /// Mass of each housing [kg]
    #[var(name = "housing.mass", start = 8.0, min = 0.0)]
    pub m_housing: f64,
    /// Distance of a housing's centre of mass from its pivot [m]
    #[var(name = "housing.com", start = 0.15)]
    pub housing_com: f64,
    /// Largest force of an axis [N]
    #[var(name = "axis.F_peak", start = 2500.0, above = 0.0)]
    pub F_peak: f64,
    /// Gravity; y without effect [m/s2]
    #[var(name = "gravity", start = [0.0, 0.0, -9.81])]
    pub gravity: Vector3<f64>,
}

/// A cylinder between its pivot and the handle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Leg<S> {
    /// Length [m]
    pub l: S,
    /// Direction from the pivot to H
    pub u: Vector2<S>,
    /// Direction across, turned to the left
    pub t: Vector2<S>,
}

impl<S: Scalar> Leg<S> {
    /// Rate of the length and angular velocity of a leg whose end moves with `v` [m/s, rad/s].
    pub fn rates(&self, v: &Vector2<S>) -> (S, S) {
        (self.u.dot(v), self.t.dot(v) / self.l)
    }
}

impl Device {
    /// The parameters, if they make a device.
    ///
    /// # Errors
    /// Coinciding pivots, no side.
    pub fn checked(&self) -> Result<Self, ParameterError> {
        if self.A == self.B {
            return Err(ParameterError::refused("B.x", self.B.x, "the pivots A and B coincide", "B != A"));
        }
        if self.branch == 0 {
            return Err(ParameterError::refused("branch", 0.0, "no side of the line from A to B", "-1 or 1"));
        }
        Ok(*self)
    }

    fn pivots(&self) -> [Vector2<f64>; 2] {
        [self.A, self.B]
    }

    /// Gravity in the plane.
    fn g(&self) -> Vector2<f64> {
        Vector2::new(self.gravity.x, self.gravity.z)
    }

    /// The legs when the handle is at `H` (1).
    ///
    /// # Errors
    /// The handle at a pivot.
    #[inline]
    pub fn legs<S: Scalar>(&self, H: &Vector2<S>) -> Result<[Leg<S>; 2], EvaluationError> {
        let leg = |P: Vector2<f64>| {
            let d = H - P.map(S::lift);
            let l = d.norm_squared().sqrt();
            let u = d / l;
            Leg { l, u, t: Vector2::new(-u.y, u.x) }
        };
        let legs = self.pivots().map(leg);
        match legs.iter().find(|leg| leg.l.re() < SHORTEST) {
            None => Ok(legs),
            Some(leg) => Err(EvaluationError::Vanishes {
                quantity: "distance between the handle and a pivot",
                value: leg.l.re(),
                limit: SHORTEST,
            }),
        }
    }

    /// Where the handle is with legs of the lengths `l`, if these and the pivots make a triangle (2).
    #[must_use]
    pub fn pose(&self, l: [f64; 2]) -> Option<Vector2<f64>> {
        let AB = self.B - self.A;
        let L = AB.norm();
        let e = AB / L;
        let xi = (l[0] * l[0] - l[1] * l[1] + L * L) / (2.0 * L);
        let square = l[0] * l[0] - xi * xi;
        let eta = f64::from(self.branch) * square.sqrt();
        (square >= 0.0).then(|| self.A + e * xi + Vector2::new(-e.y, e.x) * eta)
    }

    /// Distance of `H` from the line through A and B, positive on the side of `branch` [m]
    #[must_use]
    pub fn side(&self, H: &Vector2<f64>) -> f64 {
        let AB = self.B - self.A;
        f64::from(self.branch) * cross(&AB, &(H - self.A)) / AB.norm()
    }

    /// A start pose, if it is on the side of `branch` and, with `stroke` = smallest and largest length, within the stroke.
    ///
    /// # Errors
    /// Other poses.
    pub fn start(&self, H: &Vector2<f64>, stroke: Option<[f64; 2]>) -> Result<[Leg<f64>; 2], ParameterError> {
        if self.side(H) < 0.0 {
            let reason = "the start pose is on the other side of the line from A to B";
            return Err(ParameterError::refused("H.start.z", H.y, reason, "the side of branch"));
        }
        let legs = self.legs(H)?;
        let Some([min, max]) = stroke else { return Ok(legs) };
        for (i, leg) in legs.iter().enumerate() {
            if leg.l < min * (1.0 - ROUNDING) || leg.l > max * (1.0 + ROUNDING) {
                let reason = format!("axis {} has the length {} m there", i + 1, leg.l);
                let allowed = format!("poses with both lengths in {min} .. {max} m");
                return Err(ParameterError::refused("H.start.z", H.y, reason, allowed));
            }
        }
        Ok(legs)
    }

    /// Generalised weight at H: the part of the bias without motion (5) [N]
    #[inline]
    pub fn weight<S: Scalar>(&self, legs: &[Leg<S>; 2]) -> Vector2<S> {
        let g = self.g().map(S::lift);
        legs.iter().fold(g * S::lift(-self.m_H), |sum, Leg { l, u, t }| {
            let along = g.dot(u) * self.m_rod;
            let across =
                g.dot(t) * ((*l - self.rod_com) * self.m_rod + self.m_housing * self.housing_com) / *l;
            sum - u * along - t * across
        })
    }

    /// Potential energy in the field of gravity [J]
    pub fn potential<S: Scalar>(&self, H: &Vector2<S>, legs: &[Leg<S>; 2]) -> S {
        let g = self.g().map(S::lift);
        let mut V = -g.dot(H) * self.m_H;
        for (P, leg) in self.pivots().iter().zip(legs) {
            let centre = |distance: S| P.map(S::lift) + leg.u * distance;
            V -= g.dot(&centre(leg.l - self.rod_com)) * self.m_rod;
            V -= g.dot(&centre(S::lift(self.housing_com))) * self.m_housing;
        }
        V
    }

    /// Axis forces that hold the weight [N]
    ///
    /// # Errors
    /// Rods that are aligned to rounding.
    pub fn balance(&self, legs: &[Leg<f64>; 2]) -> Result<Vector2<f64>, EvaluationError> {
        let det = determinant(legs);
        let inverse = jacobian(legs).try_inverse().filter(|_| det.abs() > ROUNDING);
        let inverse = inverse.ok_or(EvaluationError::Vanishes {
            quantity: "determinant of the Jacobian",
            value: det,
            limit: ROUNDING,
        })?;
        Ok(inverse.transpose() * self.weight(legs))
    }
}

/// z component of a cross product, x to z.
fn cross<S: Scalar>(a: &Vector2<S>, b: &Vector2<S>) -> S {
    a.x * b.y - a.y * b.x
}

/// J: rates of the lengths from the velocity of H (3).
pub fn jacobian<S: Scalar>(legs: &[Leg<S>; 2]) -> Matrix2<S> {
    let [a, b] = legs.map(|leg| leg.u);
    Matrix2::new(a.x, a.y, b.x, b.y)
}

/// det J: sine of the angle between the rods (3).
#[inline]
pub fn determinant<S: Scalar>(legs: &[Leg<S>; 2]) -> S {
    cross(&legs[0].u, &legs[1].u)
}

/// J^+: the inverse, damped where the determinant is below `eps` in size:
/// `J^T (J J^T + lambda^2 (1 - (det/eps)^2) 1)^-1`; `None` where it does not exist.
#[must_use]
pub fn damped_inverse(legs: &[Leg<f64>; 2], eps: f64, lambda: f64) -> Option<Matrix2<f64>> {
    let (J, det) = (jacobian(legs), determinant(legs));
    if det.abs() >= eps {
        return J.try_inverse();
    }
    let near = 1.0 - (det / eps).powi(2);
    let damped = J * J.transpose() + Matrix2::identity() * (lambda * lambda * near);
    damped.try_inverse().map(|inverse| J.transpose() * inverse)
}
