//! Stages of Rodas4, see `rodas4.rs`.

use nalgebra::{DMatrix, DVector};

use super::control::{Norm, Start};
use super::implicit::{jacobian, rate};
use super::{DynamicOde, rhs};
use crate::rodas4::{A, ALPHA, C, GAMMA, GAMMA_I, H, STAGES};
use crate::{Statistics, StepError};

/// What the trials of a step share.
pub(super) struct Rosenbrock {
    jacobian: DMatrix<f64>,
    /// `df/dt`
    f_t: Vec<f64>,
}

/// `sum_j weights_j u_j` of one component
fn combined(weights: &[f64], u: &[Vec<f64>], i: usize) -> f64 {
    weights.iter().zip(u).map(|(w, u)| w * u[i]).sum()
}

impl Rosenbrock {
    pub(super) fn new(n: usize) -> Self {
        Self { jacobian: DMatrix::zeros(n, n), f_t: vec![0.0; n] }
    }

    pub(super) fn begin<O: DynamicOde>(
        &mut self,
        ode: &mut O,
        from: Start<'_>,
        norm: &Norm,
        statistics: &mut Statistics,
    ) -> Result<(), StepError<O::Error>> {
        self.jacobian = jacobian(ode, from, &norm.nominal, statistics)?;
        self.f_t = rate(ode, from, statistics)?;
        Ok(())
    }

    /// One step of length `h`: `u` and the new state.
    pub(super) fn trial<O: DynamicOde>(
        &self,
        ode: &mut O,
        from: Start<'_>,
        h: f64,
        (u, end): (&mut [Vec<f64>], &mut [f64]),
        statistics: &mut Statistics,
    ) -> Result<(), StepError<O::Error>> {
        let Start { t, x, slope } = from;
        let n = x.len();
        statistics.decompositions += 1;
        let lu = (DMatrix::identity(n, n) / (GAMMA * h) - &self.jacobian).lu();
        let mut f = slope.to_vec();
        end.copy_from_slice(x);
        for stage in 0..STAGES {
            if stage > 0 {
                for i in 0..n {
                    end[i] = x[i] + combined(&A[stage][..stage], u, i);
                }
                rhs(ode, t + ALPHA[stage] * h, end, &mut f, statistics)?;
            }
            let right = |i: usize| {
                let coupling = combined(&C[stage][..stage], u, i);
                f[i] + coupling / h + GAMMA_I[stage] * h * self.f_t[i]
            };
            let mut solution = DVector::from_fn(n, |i, _| right(i));
            if !lu.solve_mut(&mut solution) {
                return Err(StepError::NoSolution { t, h });
            }
            u[stage].copy_from_slice(solution.as_slice());
        }
        for (end, u) in end.iter_mut().zip(&u[STAGES - 1]) {
            *end += u;
        }
        Ok(())
    }
}

/// State at the fraction `theta` of a step.
pub(super) fn inside((x, end): (&[f64], &[f64]), u: &[Vec<f64>], theta: f64, out: &mut [f64]) {
    for (i, out) in out.iter_mut().enumerate() {
        let [bow, skew] = H.map(|row| combined(&row, u, i));
        *out = x[i] + theta * (end[i] - x[i] + bow + theta * (skew - bow - theta * skew));
    }
}
