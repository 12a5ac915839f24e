//! Loop closure: the force between two tips that must move together.
//!
//! ```text
//! (Y1 + Y2) F = b2' - b1'                                               (18)
//! ```
//!
//! The matrix is symmetric and positive semidefinite. It loses rank where a mechanism passes a
//! change point, and always in the direction in which a plane mechanism cannot move; such
//! directions carry no force (minimum norm).

use crate::{Dim, Matrix, Scalar, Space, Vector};

/// Eigenvalues below this fraction of the largest are dropped.
const RANK_TOLERANCE: f64 = 1e-12;
/// A right side this large (relative) in a dropped direction contradicts the closure.
const CONSISTENCY_TOLERANCE: f64 = 1e-6;

/// Solution of a closure.
#[derive(Debug, Clone, Copy)]
pub struct Closure<S, const D: usize> {
    /// Force of the second tip on the first [N]
    pub F: Vector<S, D>,
    /// Number of directions that carry a force
    pub rank: usize,
    /// Largest over smallest kept eigenvalue of Y1 + Y2
    pub condition: S,
}

/// The two tips are asked to separate in a direction in which nothing can move.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error(
    "inconsistent or singular closure: acceleration gap {gap:.3e} m/s2 in a direction in which the mechanism cannot move (allowed {allowed:.3e})"
)]
pub struct InconsistentClosure {
    /// Part of the right side in the dropped directions [m/s2]
    pub gap: f64,
    /// Largest part that counts as rounding [m/s2]
    pub allowed: f64,
}

/// Solve (18) by symmetric eigendecomposition, minimum norm where the rank is deficient.
///
/// The decomposition is that of the values; one step of refinement with the full matrix makes the
/// result exact to first order, derivatives included.
///
/// # Errors
/// [`InconsistentClosure`] if the right side has a part in a dropped direction.
#[inline]
pub fn close<S: Scalar, const D: usize>(
    Y: &Matrix<S, D, D>,
    rhs: &Vector<S, D>,
) -> Result<Closure<S, D>, InconsistentClosure>
where
    Dim<D>: Space<D>,
{
    let (lambda, V) = Dim::<D>::symmetric_eigen(&Y.map(S::re));
    let (imax, largest) = lambda.argmax();
    let mut P = Matrix::<f64, D, D>::zeros();
    let mut rank = 0;
    let mut imin = imax;
    let size = rhs.map(S::re).norm();
    for i in 0..D {
        let v = V.column(i);
        if lambda[i] > RANK_TOLERANCE * largest {
            P += v * v.transpose() / lambda[i];
            rank += 1;
            if lambda[i] < lambda[imin] {
                imin = i;
            }
        } else {
            let gap = v.dot(&rhs.map(S::re)).abs();
            let allowed = CONSISTENCY_TOLERANCE * size;
            if gap > allowed {
                return Err(InconsistentClosure { gap, allowed });
            }
        }
    }
    let P = P.map(S::lift);
    let mut F = P * rhs;
    F += P * (rhs - Y * F);
    let along = |i: usize| {
        let v = V.column(i).map(S::lift);
        v.dot(&(Y * v))
    };
    Ok(Closure { F, rank, condition: along(imax) / along(imin) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};
    use num_dual::Dual64;

    #[test]
    fn full_rank_solves_the_system() {
        let Y = Matrix2::new(2.0, 1.0, 1.0, 3.0);
        let x = close(&Y, &Vector2::new(3.0, 4.0)).expect("regular");
        assert!((x.F - Vector2::new(1.0, 1.0)).norm() < 1e-15);
        assert_eq!(x.rank, 2);
        // eigenvalues (5 +- sqrt 5)/2
        let s = 5.0_f64.sqrt();
        assert!((x.condition - (5.0 + s) / (5.0 - s)).abs() < 1e-14);
    }

    #[test]
    fn a_direction_that_cannot_move_carries_no_force() {
        let Y = Matrix3::new(2.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 3.0);
        let x = close(&Y, &Vector3::new(3.0, 0.0, 4.0)).expect("consistent");
        assert!((x.F - Vector3::new(1.0, 0.0, 1.0)).norm() < 1e-15);
        assert_eq!(x.rank, 2);
        assert!(close(&Y, &Vector3::new(3.0, 0.1, 4.0)).is_err());
    }

    /// d/ds of Y(s)^-1 rhs = -Y^-1 Y' Y^-1 rhs, against the closed form of a 2x2 inverse.
    #[test]
    fn derivative_is_exact() {
        let d = |re: f64, eps: f64| Dual64::new(re, eps);
        let Y = Matrix2::new(d(2.0, 0.3), d(1.0, -0.2), d(1.0, -0.2), d(3.0, 0.5));
        let x = close(&Y, &Vector2::new(d(3.0, 0.0), d(4.0, 1.0))).expect("regular");
        let det = Y[(0, 0)] * Y[(1, 1)] - Y[(0, 1)] * Y[(1, 0)];
        let r = Vector2::new(d(3.0, 0.0), d(4.0, 1.0));
        let exact = Vector2::new(Y[(1, 1)] * r.x - Y[(0, 1)] * r.y, Y[(0, 0)] * r.y - Y[(1, 0)] * r.x);
        for (a, b) in x.F.iter().zip(exact.iter()) {
            let b = *b / det;
            assert!((a.re - b.re).abs() < 1e-14 && (a.eps - b.eps).abs() < 1e-14);
        }
    }
}
