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

/// `P A = L U`, kept by columns: the inner loops then run along memory and carry no sum.
#[derive(Clone, Copy)]
pub(crate) struct Lu<T, const N: usize> {
    /// Columns: `U` above the diagonal, the inverse pivot on it, `L` below.
    columns: [[T; N]; N],
    /// Row of `A` that comes i-th.
    order: [usize; N],
}

/// `y -= factor x` from index `from` on.
#[inline]
fn subtract<T: Field, const N: usize>(y: &mut [T; N], factor: T, x: &[T; N], from: usize) {
    for (y, x) in y[from..].iter_mut().zip(&x[from..]) {
        *y = *y - factor * *x;
    }
}

impl<T: Field, const N: usize> Lu<T, N> {
    /// Of the matrix with the given rows; `None` if it is singular or not finite.
    #[inline]
    pub(crate) fn new(rows: &[[T; N]; N]) -> Option<Self> {
        let mut columns: [[T; N]; N] = std::array::from_fn(|j| std::array::from_fn(|i| rows[i][j]));
        let mut order: [usize; N] = std::array::from_fn(|i| i);
        for k in 0..N {
            let (mut pivot, mut largest) = (k, columns[k][k].size());
            for i in k + 1..N {
                let size = columns[k][i].size();
                if size > largest {
                    (pivot, largest) = (i, size);
                }
            }
            if !(largest > 0.0 && largest.is_finite()) {
                return None;
            }
            if pivot != k {
                for column in &mut columns {
                    column.swap(k, pivot);
                }
                order.swap(k, pivot);
            }
            let (left, right) = columns.split_at_mut(k + 1);
            let lower = &mut left[k];
            let inverse = T::ONE / lower[k];
            lower[k] = inverse;
            for i in k + 1..N {
                lower[i] = lower[i] * inverse;
            }
            for column in right {
                let factor = column[k];
                subtract(column, factor, lower, k + 1);
            }
        }
        Some(Self { columns, order })
    }

    /// `A^(-1) b`
    #[inline]
    pub(crate) fn solve(&self, b: &[T; N]) -> [T; N] {
        let mut x = self.order.map(|i| b[i]);
        for k in 0..N {
            let found = x[k];
            subtract(&mut x, found, &self.columns[k], k + 1);
        }
        for k in (0..N).rev() {
            let column = &self.columns[k];
            let found = x[k] * column[k];
            x[k] = found;
            for i in 0..k {
                x[i] = x[i] - found * column[i];
            }
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
        let x = Lu::new(&a).expect("regular").solve(&b);
        assert!(x.iter().all(|x| (x - 1.0).abs() < 1.5e7 * f64::EPSILON), "{x:?}");
    }

    /// `[[0, i], [1 + i, 2]]` needs a row exchange; inverse by Cramer's rule.
    #[test]
    fn solves_a_complex_system_with_a_zero_pivot() {
        let c = Complex::new;
        let a = [[c(0.0, 0.0), c(0.0, 1.0)], [c(1.0, 1.0), c(2.0, 0.0)]];
        let x = Lu::new(&a).expect("regular").solve(&[c(3.0, 0.0), c(0.0, 5.0)]);
        // i y = 3; (1 + i) x + 2 y = 5 i
        let y = c(0.0, -3.0);
        let x_exact = c(0.0, 11.0) / c(1.0, 1.0);
        assert!((x[1] - y).abs() < 1e-15 && (x[0] - x_exact).abs() < 1e-14, "{x:?}");
    }

    #[test]
    fn singular_and_infinite_matrices_are_refused() {
        assert!(Lu::new(&[[1.0, 2.0], [2.0, 4.0]]).is_none());
        assert!(Lu::new(&[[f64::NAN, 2.0], [2.0, 4.0]]).is_none());
        assert!(Lu::new(&[[1.0, 2.0], [f64::INFINITY, 4.0]]).is_none());
    }
}
