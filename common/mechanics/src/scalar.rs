//! The number type of all equations: `f64` for values, dual numbers for exact derivatives.

use std::ops::{Add, Div, Mul, Sub};

use nalgebra::{RealField, SMatrix};
use num_dual::Dual64;

/// A real number that the equations are written in.
///
/// Implemented for `f64` and for [`Dual64`] (value and derivative in one direction).
pub trait Scalar:
    RealField
    + Copy
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + Div<f64, Output = Self>
{
    /// A constant: derivative zero.
    fn lift(value: f64) -> Self;
    /// The value without its derivative.
    fn re(self) -> f64;
    /// True if value and derivative are exactly zero, so that a term may be left out.
    fn vanishes(self) -> bool;
}

impl Scalar for f64 {
    #[inline]
    fn lift(value: f64) -> Self {
        value
    }
    #[inline]
    fn re(self) -> f64 {
        self
    }
    #[inline]
    #[allow(clippy::float_cmp, reason = "exact zero is the point")]
    fn vanishes(self) -> bool {
        self == 0.0
    }
}

impl Scalar for Dual64 {
    #[inline]
    fn lift(value: f64) -> Self {
        Dual64::from_re(value)
    }
    #[inline]
    fn re(self) -> f64 {
        self.re
    }
    #[inline]
    fn vanishes(self) -> bool {
        self.re.vanishes() && self.eps.vanishes()
    }
}

/// Hyperbolic tangent, also beyond 710, where the hyperbolic sine and cosine of a dual number overflow.
#[inline]
#[must_use]
pub fn tanh<S: Scalar>(x: S) -> S {
    let negative = x.re() < 0.0;
    let e = ((if negative { -x } else { x }) * -2.0).exp_m1();
    let t = -e / (e + 2.0);
    if negative { -t } else { t }
}

/// A constant matrix or vector in the scalar of the equations.
#[inline]
#[must_use]
pub fn lift<S: Scalar, const R: usize, const C: usize>(m: &SMatrix<f64, R, C>) -> SMatrix<S, R, C> {
    m.map(S::lift)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Value and derivative 1 - tanh^2 of the standard library's function to rounding, for either sign of zero, and at any size.
    #[test]
    fn tanh_has_its_value_and_derivative() {
        for x in [-1e308, -1e3, -711.0, -2.0, -1e-9, -0.0, 0.0, 1e-300, 0.3, 19.0, 711.0, 1e308] {
            let found = tanh(Dual64::new(x, 1.0));
            let exact = f64::tanh(x);
            assert!((found.re - exact).abs() <= 4.0 * f64::EPSILON * exact.abs(), "{x}: {found}");
            let slope = 1.0 - exact * exact;
            assert!((found.eps - slope).abs() <= 4.0 * f64::EPSILON, "{x}: {found}");
            assert!((tanh(x) - exact).abs() <= 4.0 * f64::EPSILON * exact.abs(), "{x}");
        }
    }
}
