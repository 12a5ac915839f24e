//! Linkage between a cylinder and its joint: stroke and its derivatives by the joint angle.
//!
//! All points lie in the plane of the frame before the joint, the joint at its origin.
//!
//! ```text
//! E = lever (cos(q + delta), sin(q + delta))                          fixed to the moving arm
//! direct:    D = E                                                    rod pin
//! four_bar:  d = E - B, alpha = (rocker^2 - coupler^2 + |d|^2)/(2 |d|), h = sqrt(rocker^2 - alpha^2)
//!            D = B + alpha d/|d| + branch h (-d_y, d_x)/|d|                                          (B5)
//! L = |D - C|,  s = L - length_min                                                                   (B6)
//! (D - B) . D' = 0,  (D - E) . (D' - E') = 0                                                         (B7)
//! (D - B) . D'' = -D' . D',  (D - E) . (D'' - E'') = -(D' - E') . (D' - E')
//! s' = e . D',  s'' = (D' . D' - s'^2)/L + e . D'',  e = (D - C)/L                                   (B8)
//! ```

use mechanics::Scalar;
use nalgebra::Vector2;
use serde::Deserialize;

/// How a cylinder moves its joint.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum Linkage {
    /// The rod is pinned to the arm.
    Direct {
        /// Pin of the barrel [m]
        #[serde(rename = "C")]
        c: [f64; 2],
        /// Distance of the arm's pin from the joint [m]
        lever: f64,
        /// Angle of this pin at q = 0 [rad]
        delta: f64,
    },
    /// The rod moves a rocker, which moves the arm by a coupler.
    FourBar {
        /// Pivot of the rocker [m]
        #[serde(rename = "B")]
        b: [f64; 2],
        /// Length of the rocker [m]
        rocker: f64,
        /// Length of the coupler [m]
        coupler: f64,
        /// Distance of the arm's pin from the joint [m]
        lever: f64,
        /// Angle of this pin at q = 0 [rad]
        delta: f64,
        /// Pin of the barrel [m]
        #[serde(rename = "C")]
        c: [f64; 2],
        /// On which side of BE the rocker's pin lies: 1 left, -1 right
        branch: Branch,
    },
}

/// One of the two positions of rocker and coupler.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(try_from = "i64")]
pub enum Branch {
    /// 1
    Left,
    /// -1
    Right,
}

impl TryFrom<i64> for Branch {
    type Error = String;
    fn try_from(number: i64) -> Result<Self, String> {
        match number {
            1 => Ok(Self::Left),
            -1 => Ok(Self::Right),
            other => Err(format!("branch = {other}; allowed: 1, -1")),
        }
    }
}

/// Stroke of a cylinder at one joint angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stroke<S> {
    /// Stroke [m]
    pub s: S,
    /// ds/dq [m/rad]
    pub slope: S,
    /// d2s/dq2 [m/rad2]
    pub curvature: S,
    /// Length pin to pin [m]
    pub length: S,
    /// Unit vector from the barrel's pin to the rod's
    pub e: Vector2<S>,
    /// Its derivative by the angle [1/rad]
    pub e_slope: Vector2<S>,
}

/// A point and its derivatives by the angle.
struct Moving<S> {
    at: Vector2<S>,
    first: Vector2<S>,
    second: Vector2<S>,
}

fn lift<S: Scalar>(p: [f64; 2]) -> Vector2<S> {
    Vector2::new(S::lift(p[0]), S::lift(p[1]))
}

/// The pin on the arm.
fn on_the_arm<S: Scalar>(q: S, lever: f64, delta: f64) -> Moving<S> {
    let (sin, cos) = (q + delta).sin_cos();
    let at = Vector2::new(cos * lever, sin * lever);
    Moving { at, first: Vector2::new(-at.y, at.x), second: -at }
}

/// The point x with p . x = a and q . x = b.
fn intersection<S: Scalar>(p: &Vector2<S>, q: &Vector2<S>, a: S, b: S) -> Vector2<S> {
    let det = p.x * q.y - p.y * q.x;
    Vector2::new((a * q.y - b * p.y) / det, (b * p.x - a * q.x) / det)
}

impl Linkage {
    /// Stroke and derivatives at the joint angle `q`.
    #[inline]
    pub fn stroke<S: Scalar>(&self, q: S, length_min: f64) -> Stroke<S> {
        let (c, D) = match *self {
            Self::Direct { c, lever, delta } => (c, on_the_arm(q, lever, delta)),
            Self::FourBar { c, lever, delta, .. } => (c, self.rocker_pin(&on_the_arm(q, lever, delta))),
        };
        let CD = D.at - lift(c);
        let length = CD.norm();
        let e = CD / length;
        let slope = e.dot(&D.first); // (B8)
        let e_slope = (D.first - e * slope) / length;
        let curvature = (D.first.dot(&D.first) - slope * slope) / length + e.dot(&D.second);
        Stroke { s: length - length_min, slope, curvature, length, e, e_slope }
    }

    /// The pin between rod, rocker and coupler (B5, B7); the arm's pin itself where there is no rocker.
    fn rocker_pin<S: Scalar>(&self, E: &Moving<S>) -> Moving<S> {
        let Self::FourBar { b, rocker, coupler, branch, .. } = *self else {
            return Moving { at: E.at, first: E.first, second: E.second };
        };
        let B = lift(b);
        let d = E.at - B;
        let square = d.dot(&d);
        let distance = square.sqrt();
        let alpha = (square + (rocker * rocker - coupler * coupler)) / (distance * 2.0);
        let h = (-(alpha * alpha) + rocker * rocker).sqrt();
        let side = match branch {
            Branch::Left => h,
            Branch::Right => -h,
        };
        let n = d / distance;
        let BD = n * alpha + Vector2::new(-n.y, n.x) * side;
        let at = B + BD;
        let ED = at - E.at;
        let first = intersection(&BD, &ED, S::lift(0.0), ED.dot(&E.first));
        let turn = first - E.first;
        let second = intersection(&BD, &ED, -first.dot(&first), ED.dot(&E.second) - turn.dot(&turn));
        Moving { at, first, second }
    }

    /// h^2 of (B5) [m2]: above zero where the linkage closes.
    pub(crate) fn height_squared(&self, q: f64) -> f64 {
        let Self::FourBar { b, rocker, coupler, lever, delta, .. } = *self else { return 1.0 };
        let square = (on_the_arm(q, lever, delta).at - lift::<f64>(b)).norm_squared();
        let sum = square + rocker * rocker - coupler * coupler;
        rocker * rocker - sum * sum / (4.0 * square)
    }

    /// Pin of the barrel [m].
    pub(crate) fn pin(&self) -> [f64; 2] {
        let (Self::Direct { c, .. } | Self::FourBar { c, .. }) = self;
        *c
    }

    /// All numbers with their keys, for checks.
    pub(crate) fn numbers(&self) -> Vec<(&'static str, f64)> {
        match *self {
            Self::Direct { c, lever, delta } => {
                vec![("C[0]", c[0]), ("C[1]", c[1]), ("lever", lever), ("delta", delta)]
            }
            Self::FourBar { b, rocker, coupler, lever, delta, c, .. } => vec![
                ("B[0]", b[0]),
                ("B[1]", b[1]),
                ("rocker", rocker),
                ("coupler", coupler),
                ("lever", lever),
                ("delta", delta),
                ("C[0]", c[0]),
                ("C[1]", c[1]),
            ],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_dual::Dual64;

    const FOUR_BAR: Linkage = Linkage::FourBar {
        b: [0.26825, 0.47995],
        rocker: 1.1745,
        coupler: 1.02515,
        lever: 0.6612,
        delta: -1.388,
        c: [-3.28135, -0.6351],
        branch: Branch::Left,
    };
    const DIRECT: Linkage = Linkage::Direct { c: [-0.1, -1.95], lever: 1.3, delta: -0.436_332_313 };

    /// Slope and curvature are the derivatives of stroke and slope (dual numbers).
    #[test]
    fn derivatives_of_the_stroke_are_consistent() {
        for (linkage, angles) in [(FOUR_BAR, [-3.1, -1.0, 0.0]), (DIRECT, [0.0, 0.7, 1.5])] {
            for q in angles {
                let at = linkage.stroke(Dual64::new(q, 1.0), 1.0);
                assert!((at.s.eps - at.slope.re).abs() < 1e-13);
                assert!((at.slope.eps - at.curvature.re).abs() < 1e-12);
                assert!((at.e.x.eps - at.e_slope.x.re).abs() < 1e-13);
            }
        }
    }
}
