//! Exact derivatives by dual numbers, and the eigenvalues of the state Jacobian.

use mechanics::Matrix;
use nalgebra::{Const, DefaultAllocator, DimDiff, DimSub, U1, allocator::Allocator};
use num_dual::Dual64;

use crate::{EvaluationError, Model, System, Variables};

/// The values `x` with the derivative `along`.
#[must_use]
pub fn directional<const N: usize>(x: &[f64; N], along: &[f64; N]) -> [Dual64; N] {
    std::array::from_fn(|i| Dual64::new(x[i], along[i]))
}

/// d rates / d x, exact.
///
/// # Errors
/// [`EvaluationError`] where the equations have no value.
pub fn state_jacobian<const N: usize, const Z: usize, Y: System<N, Z>>(
    system: &Y,
    t: f64,
    x: &[f64; N],
    u: &[f64],
    lifted: &mut [Dual64],
    d: &<Y::Model as Model>::Discrete,
) -> Result<Matrix<f64, N, N>, EvaluationError> {
    for (l, u) in lifted.iter_mut().zip(u) {
        *l = Dual64::from_re(*u);
    }
    let u = <Y::Model as Model>::Inputs::<Dual64>::load(lifted);
    let mut jacobian = Matrix::<f64, N, N>::zeros();
    let mut along = [0.0; N];
    for j in 0..N {
        along[j] = 1.0;
        let rates = system.rates(Dual64::from_re(t), &directional(x, &along), &u, d)?;
        along[j] = 0.0;
        for (i, rate) in rates.iter().enumerate() {
            jacobian[(i, j)] = rate.eps;
        }
    }
    Ok(jacobian)
}

/// Eigenvalues of a square matrix of size `N`.
pub trait Spectrum<const N: usize> {
    /// Real and imaginary parts; `None` if an element is not finite or the iteration does not end.
    fn eigenvalues(m: &Matrix<f64, N, N>) -> Option<[(f64, f64); N]>;
}

/// Iterations after which the Schur form is given up.
const MAX_ITERATIONS: usize = 1000;

/// Eigenvalues by the real Schur form, without allocation; accurate to rounding of the norm.
#[derive(Debug, Clone, Copy)]
pub struct Dense;

impl<const N: usize> Spectrum<N> for Dense
where
    Const<N>: DimSub<U1>,
    DefaultAllocator: Allocator<Const<N>, DimDiff<Const<N>, U1>> + Allocator<DimDiff<Const<N>, U1>>,
{
    fn eigenvalues(m: &Matrix<f64, N, N>) -> Option<[(f64, f64); N]> {
        let norm = m.norm();
        if !norm.is_finite() {
            return None;
        }
        // shifted by its norm: deflation is relative to the diagonal, which a chain of zero
        // eigenvalues does not have
        let shifted = m + Matrix::<f64, N, N>::from_diagonal_element(norm);
        let (_, t) = shifted.try_schur(f64::EPSILON, MAX_ITERATIONS)?.unpack();
        Some(of_quasi_triangle(&t).map(|(re, im)| (re - norm, im)))
    }
}

/// Of a system without states.
#[derive(Debug, Clone, Copy)]
pub struct NoStates;

impl Spectrum<0> for NoStates {
    fn eigenvalues(_m: &Matrix<f64, 0, 0>) -> Option<[(f64, f64); 0]> {
        Some([])
    }
}

/// Eigenvalues of a real Schur form: of its diagonal blocks of one or two rows.
///
/// A block of two whose eigenvalues are equal to rounding may have two real ones.
fn of_quasi_triangle<const N: usize>(t: &Matrix<f64, N, N>) -> [(f64, f64); N] {
    let mut lambda = [(0.0, 0.0); N];
    let mut i = 0;
    while i < N {
        if i + 1 == N || t[(i + 1, i)] == 0.0 {
            lambda[i] = (t[(i, i)], 0.0);
            i += 1;
            continue;
        }
        let mean = 0.5 * (t[(i, i)] + t[(i + 1, i + 1)]);
        let half = 0.5 * (t[(i, i)] - t[(i + 1, i + 1)]);
        let square = half * half + t[(i, i + 1)] * t[(i + 1, i)];
        let root = square.abs().sqrt();
        (lambda[i], lambda[i + 1]) = if square < 0.0 {
            ((mean, root), (mean, -root))
        } else {
            ((mean + root, 0.0), (mean - root, 0.0))
        };
        i += 2;
    }
    lambda
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sorted<const N: usize>(m: &Matrix<f64, N, N>) -> Vec<(f64, f64)>
    where
        Dense: Spectrum<N>,
    {
        let mut lambda = Dense::eigenvalues(m).expect("converges").to_vec();
        lambda.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        lambda
    }

    /// A chain of zero eigenvalues beside an undamped pair: the iteration ends, the pair is right.
    #[test]
    fn nilpotent_blocks_do_not_hold_up_the_iteration() {
        let mut m = Matrix::<f64, 6, 6>::zeros();
        (m[(0, 1)], m[(1, 0)]) = (1.0, -180.0); // lambda = +- i sqrt(180)
        (m[(2, 3)], m[(4, 5)], m[(5, 0)]) = (1.0, 1.0, 30.0);
        let lambda = sorted(&m);
        let largest = lambda.iter().map(|l| l.1).fold(0.0, f64::max);
        assert!((largest - 180.0_f64.sqrt()).abs() < 1e-10);
        assert!(lambda.iter().all(|l| l.0.abs() < 1e-4)); // a Jordan block of 2 at 1e-16: root of rounding
    }

    /// A block of two that is left over although its eigenvalues are real: equal to rounding, and apart.
    #[test]
    fn real_eigenvalues_of_a_block_of_two() {
        let t = Matrix::<f64, 3, 3>::new(2.0, 1e-9, 0.0, 1e-9, 2.0, 0.0, 0.0, 0.0, 5.0);
        let lambda = of_quasi_triangle(&t);
        assert!((lambda[0].0 - 2.0 - 1e-9).abs() < 1e-15 && (lambda[1].0 - 2.0 + 1e-9).abs() < 1e-15);
        assert!(lambda.iter().all(|l| l.1 == 0.0) && (lambda[2].0 - 5.0).abs() < 1e-15);
    }

    /// Companion matrix of (x - 1)(x - 2)(x + 3).
    #[test]
    fn roots_of_a_polynomial() {
        let m = Matrix::<f64, 3, 3>::new(0.0, 7.0, -6.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0);
        for (l, exact) in sorted(&m).iter().zip([-3.0, 1.0, 2.0]) {
            assert!((l.0 - exact).abs() < 1e-13 && l.1.abs() < 1e-13);
        }
    }
}
