//! Steps as long as the tolerance allows.
//!
//! ```text
//! err   = sqrt(mean_i (error_i / scale_i)^2),   scale_i = atol nominal_i + rtol max(|x_i|, |x_new_i|)
//! h_new = h min(10, max(1/5, 0.9 err^(-alpha) err_old^beta)),   beta = 0.04, alpha = 1/p - 3/4 beta
//! ```
//! The step counts if `err <= 1`. Source: Hairer, Nørsett & Wanner, sections II.4 (start) and IV.2 (PI control);
//! K. Gustafsson, ACM TOMS 17 (1991).

use crate::error::all_finite;
use crate::one_step::{OneStep, Start};
use crate::run::{MAX_STEPS, Run, Taken, Watch};
use crate::solver::Memory;
use crate::{Ode, Settings, StepError};

const BETA: f64 = 0.04;
const SAFETY: f64 = 0.9;
const SHRINK: f64 = 0.2;
const GROW: f64 = 10.0;
/// Smallest error remembered, so that one lucky step does not rule the next.
const LEAST_ERROR: f64 = 1e-4;
/// Smallest step in units of the rounding of time.
const RESOLUTION: f64 = 8.0 * f64::EPSILON;

/// Measures errors in units of the tolerance.
struct Norm<const N: usize> {
    nominal: [f64; N],
    /// Components with a finite nominal value.
    counted: f64,
    rtol: f64,
    atol: f64,
}

impl<const N: usize> Norm<N> {
    fn new<O: Ode<N>>(ode: &O, settings: &Settings) -> Self {
        let nominal = ode.nominal();
        let counted = nominal.iter().map(|n| if n.is_finite() { 1.0 } else { 0.0 }).sum::<f64>().max(1.0);
        Self { nominal, counted, rtol: settings.rtol, atol: settings.atol }
    }

    #[inline]
    fn scaled(&self, value: f64, i: usize, x: f64) -> f64 {
        if self.nominal[i].is_finite() { value / (self.atol * self.nominal[i] + self.rtol * x) } else { 0.0 }
    }

    /// Root mean square of `values` against the larger of two states.
    #[inline]
    fn of(&self, values: &[f64; N], x: &[f64; N], x_new: &[f64; N]) -> f64 {
        let sum: f64 =
            (0..N).map(|i| self.scaled(values[i], i, x[i].abs().max(x_new[i].abs())).powi(2)).sum();
        (sum / self.counted).sqrt()
    }

    /// The component that asks for the smallest step.
    fn worst(&self, values: &[f64; N], x: &[f64; N]) -> usize {
        let size = |i: usize| self.scaled(values[i], i, x[i].abs()).abs();
        (0..N).max_by(|&i, &j| size(i).total_cmp(&size(j))).unwrap_or(0)
    }
}

/// Runs to `t_end` and leaves in `memory` what the next call starts with.
#[inline]
pub(crate) fn adaptive<const N: usize, M: OneStep<N>, O: Ode<N>, W: Watch<N>>(
    method: &M,
    settings: &Settings,
    memory: &mut Memory,
    ode: &O,
    run: &mut Run<N>,
    t_end: f64,
    watch: &mut W,
) -> Result<(), StepError<O::Error>> {
    let norm = Norm::new(ode, settings);
    let exponent = 1.0 / f64::from(method.order());
    let control = Control { method, ode, norm, exponent, t_end };
    let mut slope = None;
    let mut trials = 0;
    while run.t < t_end {
        let from = Start {
            t: run.t,
            x: run.x,
            slope: match slope.take() {
                Some(slope) => slope,
                None => run.slope(ode)?,
            },
        };
        all_finite(from.t, &from.slope)?;
        let remaining = t_end - from.t;
        if memory.step <= 0.0 {
            memory.step = control.first_step(run, &from);
        }
        let wanted = memory.step.max(control.least_step(from.t));
        let Accepted { trial, h, error, rejected } =
            control.accepted(run, &from, fit(wanted, remaining), &mut trials)?;

        let last = h >= remaining;
        let t = if last { t_end } else { from.t + h };
        if W::WATCHES && run.watch(method, ode, &Taken { from: &from, trial: &trial, h, t, last }, watch)? {
            return Ok(());
        }
        let factor = control.factor(error) * memory.error.powf(BETA);
        let mut next = h * factor.clamp(SHRINK, if rejected { 1.0 } else { GROW });
        if !rejected && next >= h {
            next = next.max(wanted); // cut short by the end of the call, not by its error
        }
        *memory = Memory { step: next, error: error.max(LEAST_ERROR) };
        if !run.accept(ode, t, M::state(&trial))? {
            slope = method.slope(&trial).copied();
        }
    }
    Ok(())
}

/// A step within the tolerance.
struct Accepted<T> {
    trial: T,
    h: f64,
    /// In units of the tolerance, up to 1.
    error: f64,
    /// Longer steps were tried before.
    rejected: bool,
}

/// What the choice of step sizes needs to know.
struct Control<'a, const N: usize, M, O> {
    method: &'a M,
    ode: &'a O,
    norm: Norm<N>,
    /// `1/p`
    exponent: f64,
    t_end: f64,
}

impl<const N: usize, M: OneStep<N>, O: Ode<N>> Control<'_, N, M, O> {
    /// Smallest step at `t` [s].
    fn least_step(&self, t: f64) -> f64 {
        RESOLUTION * t.abs().max(self.t_end.abs())
    }

    /// `0.9 err^(-alpha)`: how much longer the step may be for an error of 1.
    fn factor(&self, error: f64) -> f64 {
        SAFETY * error.powf(0.75 * BETA - self.exponent)
    }

    /// Tries `h` and shorter steps until one keeps the tolerance.
    #[inline]
    fn accepted(
        &self,
        run: &mut Run<N>,
        from: &Start<N>,
        mut h: f64,
        trials: &mut u32,
    ) -> Result<Accepted<M::Trial>, StepError<O::Error>> {
        let t = from.t;
        let min = self.least_step(t);
        let mut rejected = false;
        loop {
            *trials += 1;
            if *trials > MAX_STEPS {
                return Err(StepError::TooManySteps { t, t_end: self.t_end, h });
            }
            let tried = self
                .method
                .step(self.ode, from, h, &mut run.statistics.rhs_evaluations)
                .and_then(|trial| all_finite(t + h, M::state(&trial)).map(|()| trial));
            let (shorter, reason) = match tried {
                Ok(trial) => {
                    let errors = self.method.error(&trial, h);
                    let error = self.norm.of(&errors, &from.x, M::state(&trial));
                    if error <= 1.0 {
                        return Ok(Accepted { trial, h, error, rejected });
                    }
                    #[allow(
                        clippy::manual_clamp,
                        reason = "clamp would pass on an error that is not a number"
                    )]
                    let shorter = h * self.factor(error).max(SHRINK).min(SAFETY);
                    let index = self.norm.worst(&errors, &from.x);
                    (shorter, StepError::StepTooSmall { t, h: shorter, min, index })
                }
                Err(reason) => (h * SHRINK, reason),
            };
            rejected = true;
            run.statistics.rejected += 1;
            if shorter < min {
                return Err(reason);
            }
            h = shorter;
        }
    }

    /// Start step of Hairer, Nørsett & Wanner, II.4: an Euler step shows how fast the slope turns.
    ///
    /// ```text
    /// h_0 = 0.01 |x| / |f|,   h_1 = (0.01 / max(|f|, |f(x + h_0 f) - f| / h_0))^(1/p),   h = min(100 h_0, h_1)
    /// ```
    fn first_step(&self, run: &mut Run<N>, from: &Start<N>) -> f64 {
        let Start { t, x, slope } = from;
        let remaining = self.t_end - t;
        let d_0 = self.norm.of(x, x, x);
        let d_1 = self.norm.of(slope, x, x);
        let h_0 = if d_0 < 1e-5 || d_1 < 1e-5 { 1e-6 } else { 0.01 * d_0 / d_1 }.min(remaining);
        let euler: [f64; N] = std::array::from_fn(|i| x[i] + h_0 * slope[i]);
        run.statistics.rhs_evaluations += 1;
        let Ok(turned) = self.ode.rhs(t + h_0, &euler) else {
            return h_0;
        };
        let change: [f64; N] = std::array::from_fn(|i| turned[i] - slope[i]);
        let d_2 = self.norm.of(&change, x, x) / h_0;
        let steepest = d_1.max(d_2);
        let h_1 =
            if steepest <= 1e-15 { (1e-3 * h_0).max(1e-6) } else { (0.01 / steepest).powf(self.exponent) };
        let h = (100.0 * h_0).min(h_1).min(remaining);
        if h > 0.0 { h } else { h_0 } // not a number
    }
}

/// The step size next to `h` that leaves no tiny rest: what remains is done in one step or in two halves.
fn fit(h: f64, remaining: f64) -> f64 {
    if h >= remaining {
        remaining
    } else if 2.0 * h > remaining {
        0.5 * remaining
    } else {
        h
    }
}
