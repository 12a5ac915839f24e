//! The linear system of closing joints: symmetric, positive semidefinite, sparse.
//!
//! ```text
//! K lambda = -(da + 2 alpha dv + alpha^2 dr)
//! ```
//! Directions that no force moves (planar mechanisms in space) are left out: first those of the axes, by the diagonal;
//! where a pivot still falls below `1e-10` of the largest, by the eigenvalues. A direction left out whose right-hand side
//! is not zero means that the joints do not fit together.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// Smallest pivot or eigenvalue relative to the largest.
const RANK: f64 = 1e-10;
/// Largest right-hand side of a direction left out, relative to the largest of all.
const CONSISTENT: f64 = 1e-6;

/// The unknown with the largest part in a direction left out, and the right-hand side along it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inconsistent {
    /// Index of the unknown
    pub unknown: usize,
    /// Right-hand side along the direction
    pub value: f64,
}

/// Matrix in rows from the first entry that may differ from zero to the diagonal, with room for its factor.
pub struct Closure {
    first: Vec<usize>,
    matrix: Vec<Vec<f64>>,
    factor: Vec<Vec<f64>>,
}

impl Closure {
    /// A system of unknowns whose pattern is given by the first nonzero column of each row.
    #[must_use]
    pub fn new(first: Vec<usize>) -> Self {
        let rows = || first.iter().enumerate().map(|(i, f)| vec![0.0; i + 1 - f]).collect();
        Self { matrix: rows(), factor: rows(), first }
    }

    /// Writes an entry of the lower triangle; others are ignored.
    pub fn put(&mut self, row: usize, column: usize, value: f64) {
        if column <= row && column >= self.first[row] {
            self.matrix[row][column - self.first[row]] = value;
        }
    }

    fn entry(&self, row: usize, column: usize) -> f64 {
        let (row, column) = (row.max(column), row.min(column));
        if column < self.first[row] { 0.0 } else { self.matrix[row][column - self.first[row]] }
    }

    /// Solves for `rhs`, which becomes the solution.
    ///
    /// # Errors
    /// A direction without force and with a right-hand side.
    pub fn solve(&mut self, rhs: &mut [f64]) -> Result<(), Inconsistent> {
        let n = rhs.len();
        let largest = (0..n).map(|i| self.entry(i, i)).fold(0.0, f64::max);
        let scale = rhs.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        if self.factorise(largest) {
            let left = rhs.iter().enumerate().filter(|(i, _)| self.is_left_out(*i));
            if let Some((unknown, value)) = left.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
                && value.abs() > CONSISTENT * scale
            {
                return Err(Inconsistent { unknown, value: *value });
            }
            self.substitute(rhs);
            return Ok(());
        }
        self.solve_by_eigenvalues(rhs, scale)
    }

    fn is_left_out(&self, i: usize) -> bool {
        self.factor[i][i - self.first[i]] <= 0.0
    }

    /// Cholesky's factor; a diagonal of 0 marks an axis left out. False: a pivot is too small.
    fn factorise(&mut self, largest: f64) -> bool {
        for i in 0..self.first.len() {
            let first = self.first[i];
            let (done, rest) = self.factor.split_at_mut(i);
            let row = &mut rest[0];
            let diagonal = self.matrix[i][i - first];
            if diagonal <= RANK * largest {
                row.fill(0.0);
                continue;
            }
            for j in first..i {
                let other = &done[j];
                let from = first.max(self.first[j]);
                let pivot = other[j - self.first[j]];
                let sum: f64 = (from..j).map(|k| row[k - first] * other[k - self.first[j]]).sum();
                row[j - first] = if pivot > 0.0 { (self.matrix[i][j - first] - sum) / pivot } else { 0.0 };
            }
            let square = diagonal - row[..i - first].iter().map(|l| l * l).sum::<f64>();
            if square <= RANK * largest {
                return false;
            }
            row[i - first] = square.sqrt();
        }
        true
    }

    fn substitute(&self, x: &mut [f64]) {
        let n = x.len();
        for i in 0..n {
            if self.is_left_out(i) {
                x[i] = 0.0;
                continue;
            }
            let (first, row) = (self.first[i], &self.factor[i]);
            let sum: f64 = (first..i).map(|k| row[k - first] * x[k]).sum();
            x[i] = (x[i] - sum) / row[i - first];
        }
        for i in (0..n).rev() {
            if self.is_left_out(i) {
                continue;
            }
            let (first, row) = (self.first[i], &self.factor[i]);
            x[i] /= row[i - first];
            for k in first..i {
                x[k] -= row[k - first] * x[i];
            }
        }
    }

    fn solve_by_eigenvalues(&self, rhs: &mut [f64], scale: f64) -> Result<(), Inconsistent> {
        let n = rhs.len();
        let eigen = SymmetricEigen::new(DMatrix::from_fn(n, n, |i, j| self.entry(i, j)));
        let largest = eigen.eigenvalues.amax();
        let b = DVector::from_column_slice(rhs);
        let mut x = DVector::zeros(n);
        for (value, direction) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
            let along = direction.dot(&b);
            if *value > RANK * largest {
                x.axpy(along / value, &direction, 1.0);
            } else if along.abs() > CONSISTENT * scale {
                return Err(Inconsistent { unknown: direction.icamax(), value: along });
            }
        }
        rhs.copy_from_slice(x.as_slice());
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;

    fn system(rows: &[&[f64]]) -> Closure {
        let first = rows.iter().map(|row| row.iter().position(|v| *v != 0.0).unwrap_or(row.len() - 1));
        let mut closure = Closure::new(first.collect());
        for (i, row) in rows.iter().enumerate() {
            for (j, value) in row.iter().enumerate() {
                closure.put(i, j, *value);
            }
        }
        closure
    }

    /// Solution in integers.
    #[test]
    fn banded_systems_are_solved() {
        let mut k = system(&[&[4.0], &[2.0, 5.0], &[0.0, 2.0, 5.0], &[0.0, 0.0, 2.0, 5.0]]);
        let mut x = [8.0, 18.0, 27.0, 26.0]; // K (1, 2, 3, 4)
        k.solve(&mut x).unwrap();
        for (x, exact) in x.iter().zip([1.0, 2.0, 3.0, 4.0]) {
            assert!((x - exact).abs() < 1e-14);
        }
    }

    #[test]
    fn an_axis_without_force_is_left_out() {
        let mut k = system(&[&[2.0], &[0.0, 0.0], &[1.0, 0.0, 2.0]]);
        let mut x = [4.0, 0.0, 5.0];
        k.solve(&mut x).unwrap();
        assert!((x[0] - 1.0).abs() < 1e-14 && x[1] == 0.0 && (x[2] - 2.0).abs() < 1e-14);
        assert_eq!(k.solve(&mut [1.0, 1.0, 0.0]), Err(Inconsistent { unknown: 1, value: 1.0 }));
    }

    /// K = (1, 1) (1, 1)^T: the least solution of x + y = 2.
    #[test]
    fn an_oblique_direction_without_force_is_left_out() {
        let mut k = system(&[&[1.0], &[1.0, 1.0]]);
        let mut x = [2.0, 2.0];
        k.solve(&mut x).unwrap();
        assert!((x[0] - 1.0).abs() < 1e-14 && (x[1] - 1.0).abs() < 1e-14);
        assert!(k.solve(&mut [1.0, -1.0]).is_err());
    }
}
