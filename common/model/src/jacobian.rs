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
    /// Real and imaginary parts; `None` if an element is not finite.
    fn eigenvalues(m: &Matrix<f64, N, N>) -> Option<[(f64, f64); N]>;
}

/// Eigenvalues by the real Schur form, without allocation.
#[derive(Debug, Clone, Copy)]
pub struct Dense;

impl<const N: usize> Spectrum<N> for Dense
where
    Const<N>: DimSub<U1>,
    DefaultAllocator: Allocator<Const<N>, DimDiff<Const<N>, U1>> + Allocator<DimDiff<Const<N>, U1>>,
{
    fn eigenvalues(m: &Matrix<f64, N, N>) -> Option<[(f64, f64); N]> {
        if !m.iter().all(|v| v.is_finite()) {
            return None; // the iteration would not end
        }
        let lambda = m.complex_eigenvalues();
        Some(std::array::from_fn(|i| (lambda[i].re, lambda[i].im)))
    }
}
