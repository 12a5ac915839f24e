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

/// A constant matrix or vector in the scalar of the equations.
#[inline]
#[must_use]
pub fn lift<S: Scalar, const R: usize, const C: usize>(m: &SMatrix<f64, R, C>) -> SMatrix<S, R, C> {
    m.map(S::lift)
}
