//! Stages of Radau5, see `radau5.rs`.

use nalgebra::{Complex, DMatrix, DVector, Dyn, LU};
use serde::{Deserialize, Serialize};

use super::control::{Norm, Start};
use super::implicit::jacobian;
use super::{DynamicOde, rhs};
use crate::radau5::system::{ALPHA_BETA, C, E, GAMMA, POWERS, Square, T, T_INVERSE};
use crate::radau5::{Convergence, KEEP, MOST, REUSE, Verdict};
use crate::{Statistics, StepError};

/// What steps share.
#[derive(Default)]
pub(super) struct Newton {
    jacobian: Option<DMatrix<f64>>,
    /// It belongs to the start of the step
    current: bool,
    matrices: Option<Matrices>,
    /// Rate of convergence of the last Newton iteration
    rate: f64,
    /// Error after an iteration over its increment, for the first guess
    eta: f64,
    /// Length and collocation polynomial of the step before
    before: Option<(f64, Vec<Vec<f64>>)>,
}

/// The decomposed matrices of one step size.
struct Matrices {
    h: f64,
    real: LU<f64, Dyn, Dyn>,
    complex: LU<Complex<f64>, Dyn, Dyn>,
}

/// What goes on; the matrices are made again.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct NewtonState {
    jacobian: Option<Vec<f64>>,
    current: bool,
    matrices: Option<f64>,
    rate: f64,
    eta: f64,
    before: Option<(f64, Vec<Vec<f64>>)>,
}

/// `m v` of one component
fn times(m: &Square, v: &[Vec<f64>], i: usize) -> [f64; 3] {
    m.map(|[a, b, c]| a * v[0][i] + b * v[1][i] + c * v[2][i])
}

/// All components of `m v`
fn product(m: &Square, v: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let n = v[0].len();
    (0..3).map(|row| (0..n).map(|i| times(m, v, i)[row]).collect()).collect()
}

impl Matrices {
    fn new(jacobian: &DMatrix<f64>, h: f64) -> Option<Self> {
        let n = jacobian.nrows();
        let real = (DMatrix::identity(n, n) * (GAMMA / h) - jacobian).lu();
        let shift = Complex::new(ALPHA_BETA.re / h, ALPHA_BETA.im / h);
        let complex = (DMatrix::identity(n, n) * shift - jacobian.map(|j| Complex::new(j, 0.0))).lu();
        (real.is_invertible() && complex.is_invertible()).then_some(Self { h, real, complex })
    }

    /// Increment of `w` in one iteration.
    fn increment(&self, f: &[Vec<f64>], w: &[Vec<f64>]) -> Option<[DVector<f64>; 3]> {
        let (n, per_h) = (w[0].len(), 1.0 / self.h);
        let mut real = DVector::from_fn(n, |i, _| times(&T_INVERSE, f, i)[0] - GAMMA * per_h * w[0][i]);
        let shift = per_h * ALPHA_BETA;
        let shift = Complex::new(shift.re, shift.im);
        let mut complex = DVector::from_fn(n, |i, _| {
            let [_, g_2, g_3] = times(&T_INVERSE, f, i);
            Complex::new(g_2, g_3) - shift * Complex::new(w[1][i], w[2][i])
        });
        let solved = self.real.solve_mut(&mut real) && self.complex.solve_mut(&mut complex);
        solved.then(|| [real, complex.map(|z| z.re), complex.map(|z| z.im)])
    }

    /// Estimate of the local error from the slope at its start, or at the start moved by a first estimate.
    fn error(&self, slope: &[f64], z: &[Vec<f64>]) -> Vec<f64> {
        let per_h = 1.0 / self.h;
        let right = |i: usize| slope[i] + per_h * (E[0] * z[0][i] + E[1] * z[1][i] + E[2] * z[2][i]);
        let mut parts = DVector::from_fn(slope.len(), |i, _| right(i));
        self.real.solve_mut(&mut parts);
        parts.as_slice().to_vec()
    }
}

impl Newton {
    pub(super) fn new() -> Self {
        Self { eta: 1.0, ..Self::default() }
    }

    pub(super) fn save(&self) -> NewtonState {
        NewtonState {
            jacobian: self.jacobian.as_ref().map(|j| j.as_slice().to_vec()),
            current: self.current,
            matrices: self.matrices.as_ref().map(|m| m.h),
            rate: self.rate,
            eta: self.eta,
            before: self.before.clone(),
        }
    }

    pub(super) fn restore(&mut self, state: &NewtonState, n: usize) {
        let NewtonState { jacobian, current, matrices, rate, eta, before } = state.clone();
        self.jacobian = jacobian.map(|values| DMatrix::from_vec(n, n, values));
        self.matrices = self.jacobian.as_ref().zip(matrices).and_then(|(j, h)| Matrices::new(j, h));
        (self.current, self.rate, self.eta, self.before) = (current, rate, eta, before);
    }

    pub(super) fn begin(&mut self) {
        self.current = false;
        if self.rate > REUSE {
            self.jacobian = None;
        }
    }

    /// First guess of the stages of a step of length `h`: the step before goes on.
    pub(super) fn guess(&self, h: f64, z: &mut [Vec<f64>]) {
        for (z, c) in z.iter_mut().zip(C) {
            match &self.before {
                None => z.fill(0.0),
                Some((length, p)) => {
                    // z(theta) - z(1), theta = 1 + s
                    let s = c * h / length;
                    for (i, z) in z.iter_mut().enumerate() {
                        let [p_1, p_2, p_3] = [p[0][i], p[1][i], p[2][i]];
                        *z = s * (p_1 + 2.0 * p_2 + 3.0 * p_3 + s * (p_2 + 3.0 * p_3 + s * p_3));
                    }
                }
            }
        }
    }

    /// Matrices for the step size `h`.
    fn prepare<O: DynamicOde>(
        &mut self,
        ode: &mut O,
        from: Start<'_>,
        h: f64,
        norm: &Norm,
        statistics: &mut Statistics,
    ) -> Result<(), StepError<O::Error>> {
        if self.jacobian.is_none() {
            self.jacobian = Some(jacobian(ode, from, &norm.nominal, statistics)?);
            self.current = true;
            self.matrices = None;
        }
        #[allow(clippy::float_cmp, reason = "made for this very step size")]
        let ready = self.matrices.as_ref().is_some_and(|m| m.h == h);
        if !ready {
            statistics.decompositions += 1;
            self.matrices = self.jacobian.as_ref().and_then(|j| Matrices::new(j, h));
        }
        Ok(())
    }

    /// One step of length `h` from a first guess of `z`: `z`, the new state, and the number of iterations.
    pub(super) fn trial<O: DynamicOde>(
        &mut self,
        ode: &mut O,
        from: Start<'_>,
        h: f64,
        norm: &Norm,
        (z, end): (&mut [Vec<f64>], &mut [f64]),
        statistics: &mut Statistics,
    ) -> Result<u32, StepError<O::Error>> {
        let guess = z.to_vec();
        self.prepare(ode, from, h, norm, statistics)?;
        let mut solved = self.iterate(ode, from, h, norm, z, statistics)?;
        if solved.is_none() && !self.current {
            self.jacobian = None;
            self.prepare(ode, from, h, norm, statistics)?;
            z.clone_from_slice(&guess);
            solved = self.iterate(ode, from, h, norm, z, statistics)?;
        }
        for (i, end) in end.iter_mut().enumerate() {
            *end = from.x[i] + z[2][i];
        }
        solved.ok_or(StepError::NoSolution { t: from.t, h })
    }

    /// The number of iterations; `None` where they do not converge.
    fn iterate<O: DynamicOde>(
        &mut self,
        ode: &mut O,
        from: Start<'_>,
        h: f64,
        norm: &Norm,
        z: &mut [Vec<f64>],
        statistics: &mut Statistics,
    ) -> Result<Option<u32>, StepError<O::Error>> {
        let Start { t, x, .. } = from;
        let Some(matrices) = &self.matrices else { return Ok(None) };
        let mut w = product(&T_INVERSE, z);
        let mut f = vec![vec![0.0; x.len()]; 3];
        let mut convergence = Convergence::new(self.eta, norm.rtol());
        for k in 1..=MOST {
            for (stage, f) in f.iter_mut().enumerate() {
                let at: Vec<f64> = x.iter().zip(&z[stage]).map(|(x, z)| x + z).collect();
                rhs(ode, t + C[stage] * h, &at, f, statistics)?;
            }
            let Some(increment) = matrices.increment(&f, &w) else { return Ok(None) };
            let square: f64 = increment.iter().map(|d| norm.with(d.as_slice(), |i| x[i].abs()).powi(2)).sum();
            for (w, increment) in w.iter_mut().zip(&increment) {
                w.iter_mut().zip(increment.iter()).for_each(|(w, d)| *w += d);
            }
            z.clone_from_slice(&product(&T, &w));
            match convergence.after(k, (square / 3.0).sqrt()) {
                Verdict::Arrived => {
                    (self.rate, self.eta) = (convergence.rate, convergence.eta);
                    return Ok(Some(k));
                }
                Verdict::Hopeless => return Ok(None),
                Verdict::GoesOn => {}
            }
        }
        Ok(None)
    }

    /// Parts of the local error. Far out the first estimate is too large for a start off the slow motion; filtered again it
    /// is not.
    pub(super) fn error<O: DynamicOde>(
        &self,
        ode: &mut O,
        from: Start<'_>,
        fresh: bool,
        norm: &Norm,
        (z, end): (&[Vec<f64>], &[f64]),
        statistics: &mut Statistics,
    ) -> Vec<f64> {
        let Some(matrices) = &self.matrices else { return vec![f64::INFINITY; end.len()] };
        let parts = matrices.error(from.slope, z);
        if !(fresh && norm.of(&parts, from.x, end) >= 1.0) {
            return parts;
        }
        let moved: Vec<f64> = from.x.iter().zip(&parts).map(|(x, part)| x + part).collect();
        let mut slope = vec![0.0; moved.len()];
        match rhs(ode, from.t, &moved, &mut slope, statistics) {
            Ok(()) => matrices.error(&slope, z),
            Err(_) => parts,
        }
    }

    pub(super) fn accepted(&mut self, h: f64, z: &[Vec<f64>]) {
        self.before = Some((h, product(&POWERS, z)));
    }

    pub(super) fn keeps(&self, growth: f64) -> bool {
        self.rate <= REUSE && (1.0..=KEEP).contains(&growth)
    }
}

impl NewtonState {
    pub(super) fn fits(&self, n: usize) -> bool {
        let polynomial = |(_, p): &(f64, Vec<Vec<f64>>)| p.len() == 3 && p.iter().all(|v| v.len() == n);
        self.jacobian.as_ref().is_none_or(|j| j.len() == n * n) && self.before.as_ref().is_none_or(polynomial)
    }
}

/// State at the fraction `theta` of a step.
pub(super) fn inside(x: &[f64], z: &[Vec<f64>], theta: f64, out: &mut [f64]) {
    for (i, out) in out.iter_mut().enumerate() {
        *out = x[i] + at(z, theta, i);
    }
}

/// `z(theta)` of one component.
fn at(z: &[Vec<f64>], theta: f64, i: usize) -> f64 {
    let [p_1, p_2, p_3] = times(&POWERS, z, i);
    theta * (p_1 + theta * (p_2 + theta * p_3))
}

/// First guess of the stages of a step that is shorter by `theta`.
pub(super) fn shortened(z: &[Vec<f64>], theta: f64, guess: &mut [Vec<f64>]) {
    for (guess, c) in guess.iter_mut().zip(C) {
        for (i, guess) in guess.iter_mut().enumerate() {
            *guess = at(z, c * theta, i);
        }
    }
}
