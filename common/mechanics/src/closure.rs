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

/// A pivot below this fraction of the largest calls for the eigendecomposition.
const PIVOT_TOLERANCE: f64 = 1e-10;
/// Eigenvalues below this fraction of the largest are dropped.
const RANK_TOLERANCE: f64 = 1e-12;
/// A right side this large (relative) in a dropped direction contradicts the closure.
const CONSISTENCY_TOLERANCE: f64 = 1e-6;

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

/// Force of the second tip on the first (18): by Cholesky's factors, and where a pivot is small by
/// eigendecomposition with minimum norm.
///
/// # Errors
/// [`InconsistentClosure`] if the right side has a part in a direction that cannot move.
#[inline]
pub fn close<S: Scalar, const D: usize>(
    Y: &Matrix<S, D, D>,
    rhs: &Vector<S, D>,
) -> Result<Vector<S, D>, InconsistentClosure>
where
    Dim<D>: Space<D>,
{
    if let Some(factor) = Y.cholesky() {
        let pivots = factor.l_dirty().diagonal().map(|p| p.re() * p.re());
        if pivots.min() > PIVOT_TOLERANCE * pivots.max() {
            return Ok(factor.solve(rhs));
        }
    }
    close_with_deficient_rank(Y, rhs)
}

/// The minimum-norm solution. The decomposition is that of the values; one step of refinement with
/// the full matrix makes the result exact to first order, derivatives included.
#[cold]
fn close_with_deficient_rank<S: Scalar, const D: usize>(
    Y: &Matrix<S, D, D>,
    rhs: &Vector<S, D>,
) -> Result<Vector<S, D>, InconsistentClosure>
where
    Dim<D>: Space<D>,
{
    let (lambda, V) = Dim::<D>::symmetric_eigen(&Y.map(S::re));
    let mut P = Matrix::<f64, D, D>::zeros();
    let rhs_re = rhs.map(S::re);
    let allowed = CONSISTENCY_TOLERANCE * rhs_re.norm();
    for (lambda_i, v) in lambda.iter().zip(V.column_iter()) {
        if *lambda_i > RANK_TOLERANCE * lambda.max() {
            P += v * v.transpose() / *lambda_i;
        } else {
            let gap = v.dot(&rhs_re).abs();
            if gap > allowed {
                return Err(InconsistentClosure { gap, allowed });
            }
        }
    }
    let P = P.map(S::lift);
    let F = P * rhs;
    Ok(F + P * (rhs - Y * F))
}

/// How well a closure is determined.
#[derive(Debug, Clone, Copy)]
pub struct Conditioning<S> {
    /// Number of directions that carry a force
    pub rank: usize,
    /// Largest over smallest kept eigenvalue of Y1 + Y2
    pub condition: S,
}

/// Rank and condition of a closure; the condition is exact to first order.
pub fn conditioning<S: Scalar, const D: usize>(Y: &Matrix<S, D, D>) -> Conditioning<S>
where
    Dim<D>: Space<D>,
{
    let (lambda, V) = Dim::<D>::symmetric_eigen(&Y.map(S::re));
    let largest = lambda.imax();
    let kept = |i: &usize| lambda[*i] > RANK_TOLERANCE * lambda[largest];
    let smallest = (0..D)
        .filter(kept)
        .min_by(|a, b| lambda[*a].total_cmp(&lambda[*b]))
        .unwrap_or(largest);
    let along = |i: usize| {
        let v = V.column(i).map(S::lift);
        v.dot(&(Y * v))
    };
    Conditioning {
        rank: (0..D).filter(kept).count(),
        condition: along(largest) / along(smallest),
    }
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
        assert!((x - Vector2::new(1.0, 1.0)).norm() < 1e-15);
        let Conditioning { rank, condition } = conditioning(&Y);
        assert_eq!(rank, 2);
        // eigenvalues (5 +- sqrt 5)/2
        let s = 5.0_f64.sqrt();
        assert!((condition - (5.0 + s) / (5.0 - s)).abs() < 1e-14);
    }

    #[test]
    fn a_direction_that_cannot_move_carries_no_force() {
        let Y = Matrix3::new(2.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 3.0);
        let x = close(&Y, &Vector3::new(3.0, 0.0, 4.0)).expect("consistent");
        assert!((x - Vector3::new(1.0, 0.0, 1.0)).norm() < 1e-15);
        assert_eq!(conditioning(&Y).rank, 2);
        assert!(close(&Y, &Vector3::new(3.0, 0.1, 4.0)).is_err());
    }

    /// d/ds of Y(s)^-1 rhs = -Y^-1 Y' Y^-1 rhs, against the closed form of a 2x2 inverse, on both ways.
    #[test]
    fn derivative_is_exact() {
        let d = |re: f64, eps: f64| Dual64::new(re, eps);
        let Y = Matrix2::new(d(2.0, 0.3), d(1.0, -0.2), d(1.0, -0.2), d(3.0, 0.5));
        let rhs = Vector2::new(d(3.0, 0.0), d(4.0, 1.0));
        let x = close(&Y, &rhs).expect("regular");
        let by_eigenvalues = close_with_deficient_rank(&Y, &rhs).expect("regular");
        let det = Y[(0, 0)] * Y[(1, 1)] - Y[(0, 1)] * Y[(1, 0)];
        let r = rhs;
        let exact = Vector2::new(
            Y[(1, 1)] * r.x - Y[(0, 1)] * r.y,
            Y[(0, 0)] * r.y - Y[(1, 0)] * r.x,
        );
        for (a, b) in x
            .iter()
            .chain(by_eigenvalues.iter())
            .zip(exact.iter().chain(exact.iter()))
        {
            let b = *b / det;
            assert!((a.re - b.re).abs() < 1e-14 && (a.eps - b.eps).abs() < 1e-14);
        }
    }
}
