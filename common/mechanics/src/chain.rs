//! Two elements in a row, the inner one on a root at rest, seen from the far tip.
//!
//! ```text
//! (1 + Y1 M2) a = Y1 (G2 F + f2) + b1                                   (17) with a_A = 0
//! S = (1 + Y1 M2)^-1,  a0 = S (Y1 f2 + b1)
//! Y = Y2 + G2^T S Y1 G2,   b = b2 + G2^T a0
//! ```
//!
//! Always uniquely solvable: Y1 and M2 are positive semidefinite, so the eigenvalues of
//! `1 + Y1 M2` are at least 1. No fixed-point pass is ever made.

use crate::{Hinged, Matrix, Scalar, Tip, Vector};

/// The composite of two elements at its far tip.
#[derive(Debug, Clone, Copy)]
pub struct Chain<S, const D: usize> {
    /// Mobility at the tip [1/kg]
    pub Y: Matrix<S, D, D>,
    /// Tip acceleration at F = 0 [m/s2]
    pub b: Vector<S, D>,
    /// Acceleration of the joint between the elements at F = 0 [m/s2]
    a0: Vector<S, D>,
    /// d (joint acceleration) / d F
    T: Matrix<S, D, D>,
    M2: Matrix<S, D, D>,
    G2: Matrix<S, D, D>,
    f2: Vector<S, D>,
}

impl<S: Scalar, const D: usize> Chain<S, D> {
    /// The chain `inner` - `outer` with the tip `end` on the outer element (17).
    #[inline]
    pub fn new<const N1: usize, const N2: usize>(
        inner: &Tip<S, D, N1>,
        outer: &Hinged<S, D, N2>,
        end: &Tip<S, D, N2>,
    ) -> Self {
        let interface = Matrix::<S, D, D>::identity() + inner.Y * outer.M;
        // eigenvalues >= 1: the inverse exists; not-a-number passes through and is caught as such
        let inverse = interface.try_inverse().unwrap_or(interface);
        let a0 = inverse * (inner.Y * outer.f + inner.b);
        let T = inverse * (inner.Y * end.G);
        Self {
            Y: end.Y + end.G.transpose() * T,
            b: end.b + end.G.transpose() * a0,
            a0,
            T,
            M2: outer.M,
            G2: end.G,
            f2: outer.f,
        }
    }

    /// Acceleration of the joint between the elements under the tip force `F` [m/s2].
    #[inline]
    pub fn joint_acceleration(&self, F: &Vector<S, D>) -> Vector<S, D> {
        self.a0 + self.T * F
    }

    /// Force on the inner element from the outer one, given the joint's acceleration [N].
    #[inline]
    pub fn joint_force(&self, a: &Vector<S, D>, F: &Vector<S, D>) -> Vector<S, D> {
        self.f2 - self.M2 * a + self.G2 * F
    }

    /// Change of joint acceleration and joint force by a change of the tip force, nothing else.
    #[inline]
    pub fn response(&self, F: &Vector<S, D>) -> (Vector<S, D>, Vector<S, D>) {
        let a = self.T * F;
        (a, self.G2 * F - self.M2 * a)
    }
}
