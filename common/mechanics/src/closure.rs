//! Loop closure: the force between two tips that must move together.
//!
//! ```text
//! (Y1 + Y2) F = b2' - b1'                                               (18)
//! ```
//!
//! The matrix is symmetric and positive semidefinite. It loses rank where a mechanism passes a
//! change point, and always in the direction in which a plane mechanism cannot move; such
//! directions carry no force (minimum norm).

use nalgebra::{DMatrix, DVector};

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
/// eigendecomposition with minimum norm (then the flag is true).
///
/// # Errors
/// [`InconsistentClosure`] if the right side has a part in a direction that cannot move.
#[inline]
pub fn close<S: Scalar, const D: usize>(
    Y: &Matrix<S, D, D>,
    rhs: &Vector<S, D>,
) -> Result<(Vector<S, D>, bool), InconsistentClosure>
where
    Dim<D>: Space<D>,
{
    if let Some(factor) = Y.cholesky() {
        let pivots = factor.l_dirty().diagonal().map(|p| p.re() * p.re());
        if pivots.min() > PIVOT_TOLERANCE * pivots.max() {
            return Ok((factor.solve(rhs), false));
        }
    }
    Ok((close_with_deficient_rank(Y, rhs)?, true))
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
    for (lambda_i, v) in lambda.iter().zip(V.column_iter()) {
        if *lambda_i > RANK_TOLERANCE * lambda.max() {
            P += v * v.transpose() / *lambda_i;
        } else {
            consistent(v.dot(&rhs_re).abs(), rhs_re.norm())?;
        }
    }
    let P = P.map(S::lift);
    let F = P * rhs;
    Ok(F + P * (rhs - Y * F))
}

/// The symmetric matrix of all closing joints of an assembly: `C` block rows of which `W` blocks from
/// the diagonal on are kept.
#[derive(Debug, Clone, Copy)]
pub struct Band<S, const D: usize, const C: usize, const W: usize> {
    rows: [[Matrix<S, D, D>; W]; C],
    used: usize,
}

impl<S: Scalar, const D: usize, const C: usize, const W: usize> Band<S, D, C, W>
where
    Dim<D>: Space<D>,
{
    /// A zero matrix of `used` block rows.
    #[inline]
    #[must_use]
    pub fn new(used: usize) -> Self {
        Self { rows: [[Matrix::<S, D, D>::zeros(); W]; C], used }
    }

    /// Set the block of rows `i`, columns `j >= i`.
    #[inline]
    pub fn set(&mut self, i: usize, j: usize, block: Matrix<S, D, D>) {
        self.rows[i][j - i] = block;
    }

    /// The diagonal block of closing joint `c`.
    pub fn diagonal(&self, c: usize) -> &Matrix<S, D, D> {
        &self.rows[c][0]
    }

    #[inline]
    fn at(&self, i: usize, j: usize) -> S {
        self.rows[i / D][j / D - i / D][(i % D, j % D)]
    }

    #[inline]
    fn at_mut(&mut self, i: usize, j: usize) -> &mut S {
        &mut self.rows[i / D][j / D - i / D][(i % D, j % D)]
    }

    /// One past the last column of row `i` that is kept.
    #[inline]
    fn end(&self, i: usize) -> usize {
        D * (i / D + W).min(self.used)
    }

    /// Solve for the closing forces: in `x` the right sides, out the forces. True if the rank was
    /// deficient and the eigendecomposition had to be made.
    ///
    /// # Errors
    /// [`InconsistentClosure`] if the right side has a part in a direction that cannot move.
    #[inline]
    pub fn solve(&self, x: &mut [Vector<S, D>; C]) -> Result<bool, InconsistentClosure> {
        if C == 1 {
            let (F, deficient) = close(&self.rows[0][0], &x[0])?;
            x[0] = F;
            return Ok(deficient);
        }
        let mut factor = *self;
        if factor.factorise() {
            factor.substitute(x);
            return Ok(false);
        }
        self.solve_with_deficient_rank(x)?;
        Ok(true)
    }

    /// In place R^T R by rows of the band; false if a pivot is small.
    fn factorise(&mut self) -> bool {
        let n = D * self.used;
        let largest = (0..n).map(|i| self.at(i, i).re()).fold(0.0, f64::max);
        for i in 0..n {
            let pivot = self.at(i, i);
            if pivot.re() <= PIVOT_TOLERANCE * largest || pivot.re().is_nan() {
                return false;
            }
            let root = pivot.sqrt();
            let end = self.end(i);
            for j in i..end {
                let scaled = self.at(i, j) / root;
                *self.at_mut(i, j) = scaled;
            }
            for k in i + 1..end {
                let factor = self.at(i, k);
                for j in k..end {
                    let product = factor * self.at(i, j);
                    *self.at_mut(k, j) -= product;
                }
            }
        }
        true
    }

    /// R^T y = b, R x = y.
    fn substitute(&self, x: &mut [Vector<S, D>; C]) {
        let n = D * self.used;
        for i in 0..n {
            let y = x[i / D][i % D] / self.at(i, i);
            x[i / D][i % D] = y;
            for j in i + 1..self.end(i) {
                x[j / D][j % D] -= self.at(i, j) * y;
            }
        }
        for i in (0..n).rev() {
            let mut y = x[i / D][i % D];
            for j in i + 1..self.end(i) {
                y -= self.at(i, j) * x[j / D][j % D];
            }
            x[i / D][i % D] = y / self.at(i, i);
        }
    }

    /// Minimum norm by the eigendecomposition of the whole matrix; the only place that allocates.
    #[cold]
    fn solve_with_deficient_rank(&self, x: &mut [Vector<S, D>; C]) -> Result<(), InconsistentClosure> {
        let n = D * self.used;
        let kept = |i: usize, j: usize| {
            if j < self.end(i) { self.at(i, j) } else { S::lift(0.0) }
        };
        let K = DMatrix::from_fn(n, n, |i, j| kept(i.min(j), i.max(j)));
        let rhs = DVector::from_fn(n, |i, _| x[i / D][i % D]);
        let eigen = K.map(S::re).symmetric_eigen();
        let P = pseudo_inverse(eigen.eigenvalues.iter().copied(), &eigen.eigenvectors, &rhs.map(S::re))?;
        let P = P.map(S::lift);
        let F = &P * &rhs;
        let F = &F + &P * (&rhs - &K * &F);
        for (i, f) in F.iter().enumerate() {
            x[i / D][i % D] = *f;
        }
        Ok(())
    }
}

/// The pseudo-inverse from eigenvalues and eigenvectors; a right side with a part in a dropped
/// direction is refused.
fn pseudo_inverse(
    lambda: impl Iterator<Item = f64> + Clone,
    V: &DMatrix<f64>,
    rhs: &DVector<f64>,
) -> Result<DMatrix<f64>, InconsistentClosure> {
    let largest = lambda.clone().fold(0.0, f64::max);
    let mut P = DMatrix::zeros(V.nrows(), V.nrows());
    for (lambda, v) in lambda.zip(V.column_iter()) {
        if lambda > RANK_TOLERANCE * largest {
            P += v * v.transpose() / lambda;
        } else {
            consistent(v.dot(rhs).abs(), rhs.norm())?;
        }
    }
    Ok(P)
}

/// Refuse a right side of size `norm` with the part `gap` in a dropped direction.
fn consistent(gap: f64, norm: f64) -> Result<(), InconsistentClosure> {
    let allowed = CONSISTENCY_TOLERANCE * norm;
    if gap > allowed { Err(InconsistentClosure { gap, allowed }) } else { Ok(()) }
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
    let smallest = (0..D).filter(kept).min_by(|a, b| lambda[*a].total_cmp(&lambda[*b])).unwrap_or(largest);
    let along = |i: usize| {
        let v = V.column(i).map(S::lift);
        v.dot(&(Y * v))
    };
    Conditioning { rank: (0..D).filter(kept).count(), condition: along(largest) / along(smallest) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};
    use num_dual::Dual64;

    #[test]
    fn full_rank_solves_the_system() {
        let Y = Matrix2::new(2.0, 1.0, 1.0, 3.0);
        let (x, deficient) = close(&Y, &Vector2::new(3.0, 4.0)).expect("regular");
        assert!(!deficient);
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
        let (x, deficient) = close(&Y, &Vector3::new(3.0, 0.0, 4.0)).expect("consistent");
        assert!(deficient);
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
        let (x, _) = close(&Y, &rhs).expect("regular");
        let by_eigenvalues = close_with_deficient_rank(&Y, &rhs).expect("regular");
        let det = Y[(0, 0)] * Y[(1, 1)] - Y[(0, 1)] * Y[(1, 0)];
        let r = rhs;
        let exact = Vector2::new(Y[(1, 1)] * r.x - Y[(0, 1)] * r.y, Y[(0, 0)] * r.y - Y[(1, 0)] * r.x);
        for (a, b) in x.iter().chain(by_eigenvalues.iter()).zip(exact.iter().chain(exact.iter())) {
            let b = *b / det;
            assert!((a.re - b.re).abs() < 1e-14 && (a.eps - b.eps).abs() < 1e-14);
        }
    }

    /// A band of three loops against the dense solution, and with a direction that cannot move.
    #[test]
    fn band_solves_like_a_dense_matrix() {
        let block = |d: f64, o: f64| Matrix2::new(d, o, o, d + 1.0);
        let mut band = Band::<f64, 2, 3, 2>::new(3);
        let mut dense = DMatrix::<f64>::zeros(6, 6);
        for i in 0..3 {
            let diagonal = block(5.0 + f64::from(u8::try_from(i).expect("small")), 0.5);
            band.set(i, i, diagonal);
            dense.view_mut((2 * i, 2 * i), (2, 2)).copy_from(&diagonal);
            if i < 2 {
                let upper = Matrix2::new(1.0, 0.3, -0.2, 0.7);
                band.set(i, i + 1, upper);
                dense.view_mut((2 * i, 2 * i + 2), (2, 2)).copy_from(&upper);
                dense.view_mut((2 * i + 2, 2 * i), (2, 2)).copy_from(&upper.transpose());
            }
        }
        let rhs = [Vector2::new(1.0, 2.0), Vector2::new(-3.0, 0.5), Vector2::new(0.1, 4.0)];
        let mut x = rhs;
        assert!(!band.solve(&mut x).expect("regular"));
        let flat =
            |v: &[Vector2<f64>; 3]| DVector::from_iterator(6, v.iter().flat_map(|v| v.iter().copied()));
        assert!((&dense * flat(&x) - flat(&rhs)).norm() < 1e-14);
        let mut y = rhs;
        band.solve_with_deficient_rank(&mut y).expect("regular");
        assert!((flat(&x) - flat(&y)).norm() < 1e-14);
        // take the last direction away
        band.set(2, 2, Matrix2::new(7.0, 0.0, 0.0, 0.0));
        band.set(1, 2, Matrix2::new(1.0, 0.0, -0.2, 0.0));
        let mut x = [rhs[0], rhs[1], Vector2::new(0.1, 0.0)];
        assert!(band.solve(&mut x).expect("consistent"));
        assert!(x[2].y.abs() < 1e-15);
    }
}
