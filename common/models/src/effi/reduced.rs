//! A mechanism with one coordinate q, reduced to it.

use mechanics::Scalar;
use model::Vector2;

/// A point and its derivatives by the coordinate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point<S> {
    /// Position
    pub r: Vector2<S>,
    /// dr/dq
    pub r_1: Vector2<S>,
    /// d2r/dq2
    pub r_2: Vector2<S>,
}

/// Inertia and potential of the mechanism, and the point where the hand is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Reduced<S> {
    pub(super) M: S,
    /// dM/dq
    pub(super) M_1: S,
    pub(super) V: S,
    /// dV/dq
    pub(super) V_1: S,
    pub(super) H: Point<S>,
}

/// Potential of a detent, a well of the depth `E` and the width `w` at `centre`, and its derivative.
pub(super) fn detent<S: Scalar>(q: S, E: f64, centre: f64, w: f64) -> [S; 2] {
    let off = (q - centre) / w;
    let well = (-(off * off)).exp() * E;
    [-well, well * off * (2.0 / w)]
}
