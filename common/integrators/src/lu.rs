//! Linear equations of a fixed size, real and complex, by Gaussian elimination with row pivots.
//!
//! Written for any `N` without a bound on it (nalgebra's decompositions ask for one that a generic method cannot give).
//! Source: Golub & Van Loan, *Matrix Computations*, section 3.4.

use crate::Complex;
use std::ops::{Div, Mul, Sub};

/// Numbers that can be eliminated.
pub(crate) trait Field: Copy + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> {
    const ONE: Self;
    /// What pivots are chosen by; 0 only for zero.
    fn size(self) -> f64;
}

impl Field for f64 {
    const ONE: Self = 1.0;
    #[inline]
    fn size(self) -> f64 {
        self.abs()
    }
}

impl Field for Complex {
    const ONE: Self = Self::new(1.0, 0.0);
    #[inline]
    fn size(self) -> f64 {
        self.re.abs() + self.im.abs()
    }
}

/// `P A = L U`
#[derive(Clone, Copy)]
pub(crate) struct Lu<T, const N: usize> {
    /// `L` below the diagonal, `U` above it, and the inverse pivots on it.
    factors: [[T; N]; N],
    /// Row of `A` that comes i-th.
    order: [usize; N],
}

impl<T: Field, const N: usize> Lu<T, N> {
    /// `None` for a matrix that is singular or not finite.
    #[inline]
    pub(crate) fn new(mut a: [[T; N]; N]) -> Option<Self> {
        let mut order: [usize; N] = std::array::from_fn(|i| i);
        for k in 0..N {
            let (mut pivot, mut largest) = (k, a[k][k].size());
            for (i, row) in a.iter().enumerate().skip(k + 1) {
                if row[k].size() > largest {
                    (pivot, largest) = (i, row[k].size());
                }
            }
            if !(largest > 0.0 && largest.is_finite()) {
                return None;
            }
            if pivot != k {
                a.swap(k, pivot);
                order.swap(k, pivot);
            }
            let (above, below) = a.split_at_mut(k + 1);
            let top = &mut above[k];
            let inverse = T::ONE / top[k];
            top[k] = inverse;
            for row in below {
                let factor = row[k] * inverse;
                row[k] = factor;
                for j in k + 1..N {
                    row[j] = row[j] - factor * top[j];
                }
            }
        }
        Some(Self { factors: a, order })
    }

    /// `A^(-1) b`
    #[inline]
    pub(crate) fn solve(&self, b: &[T; N]) -> [T; N] {
        let a = &self.factors;
        let mut x = self.order.map(|i| b[i]);
        for i in 1..N {
            let mut sum = x[i];
            for j in 0..i {
                sum = sum - a[i][j] * x[j];
            }
            x[i] = sum;
        }
        for i in (0..N).rev() {
            let mut sum = x[i];
            for j in i + 1..N {
                sum = sum - a[i][j] * x[j];
            }
            x[i] = sum * a[i][i];
        }
        x
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Hilbert's matrix times ones, solved: ones, up to its condition number 1.5e7 (N = 6, known in closed form).
    #[test]
    fn solves_hilberts_equations() {
        let index = |i: usize| f64::from(u8::try_from(i).expect("small"));
        let a: [[f64; 6]; 6] =
            std::array::from_fn(|i| std::array::from_fn(|j| 1.0 / (index(i) + index(j) + 1.0)));
        let b = a.map(|row| row.iter().sum());
        let x = Lu::new(a).expect("regular").solve(&b);
        assert!(x.iter().all(|x| (x - 1.0).abs() < 1.5e7 * f64::EPSILON), "{x:?}");
    }

    /// `[[0, i], [1 + i, 2]]` needs a row exchange; inverse by Cramer's rule.
    #[test]
    fn solves_a_complex_system_with_a_zero_pivot() {
        let c = Complex::new;
        let a = [[c(0.0, 0.0), c(0.0, 1.0)], [c(1.0, 1.0), c(2.0, 0.0)]];
        let x = Lu::new(a).expect("regular").solve(&[c(3.0, 0.0), c(0.0, 5.0)]);
        // i y = 3; (1 + i) x + 2 y = 5 i
        let y = c(0.0, -3.0);
        let x_exact = c(0.0, 11.0) / c(1.0, 1.0);
        assert!(
            (x[1] - y).abs() < 1e-15 && (x[0] - x_exact).abs() < 1e-14,
            "{x:?}"
        );
    }

    #[test]
    fn singular_and_infinite_matrices_are_refused() {
        assert!(Lu::new([[1.0, 2.0], [2.0, 4.0]]).is_none());
        assert!(Lu::new([[f64::NAN, 2.0], [2.0, 4.0]]).is_none());
        assert!(Lu::new([[1.0, 2.0], [f64::INFINITY, 4.0]]).is_none());
    }
}
