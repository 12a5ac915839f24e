//! Error norm and step size, see `norm.rs`, `pace.rs` and `adaptive.rs`.

use super::{DynamicOde, rhs};
use crate::adaptive::HALF;
use crate::first_step;
use crate::norm::{counted, scaled};
use crate::pace::{LEAST_ERROR, Pace, RESOLUTION, SAFETY, SHRINK, Taken, fit};
use crate::solver::Memory;
use crate::{Settings, Statistics, StepError};
use serde::{Deserialize, Serialize};

/// Measures errors in units of the tolerance.
pub(super) struct Norm {
    pub(super) nominal: Vec<f64>,
    counted: f64,
    /// rtol, atol
    tolerances: [f64; 2],
}

impl Norm {
    /// `rtol` is what the method makes of the tolerance wanted; atol keeps its ratio to it.
    pub(super) fn new(settings: &Settings, rtol: f64, nominal: Vec<f64>) -> Self {
        let tolerances = [rtol, settings.atol * (rtol / settings.rtol)];
        Self { counted: counted(&nominal), nominal, tolerances }
    }

    pub(super) fn rtol(&self) -> f64 {
        self.tolerances[0]
    }

    /// Root mean square of values scaled with magnitudes.
    pub(super) fn with(&self, values: &[f64], magnitude: impl Fn(usize) -> f64) -> f64 {
        let square =
            |(i, v): (usize, &f64)| scaled(*v, self.nominal[i], magnitude(i), self.tolerances).powi(2);
        (values.iter().enumerate().map(square).sum::<f64>() / self.counted).sqrt()
    }

    /// Size of values against the larger of two states.
    pub(super) fn of(&self, values: &[f64], x: &[f64], end: &[f64]) -> f64 {
        self.with(values, |i| x[i].abs().max(end[i].abs()))
    }

    /// The component that asks for the smallest step.
    pub(super) fn worst(&self, values: &[f64], x: &[f64], end: &[f64]) -> usize {
        let magnitude = |i: usize| x[i].abs().max(end[i].abs());
        let size = |i: usize| scaled(values[i], self.nominal[i], magnitude(i), self.tolerances).abs();
        (0..values.len()).max_by(|&i, &j| size(i).total_cmp(&size(j))).unwrap_or(0)
    }
}

/// Where a step begins.
#[derive(Clone, Copy)]
pub(super) struct Start<'a> {
    pub(super) t: f64,
    pub(super) x: &'a [f64],
    /// `f(t, x)`
    pub(super) slope: &'a [f64],
}

/// How a trial came out.
pub(super) struct Attempt {
    /// Error in units of the tolerance
    pub(super) error: f64,
    /// Part of the step size that the error allows
    pub(super) safety: f64,
    /// The component that asks for a smaller step, where the error is above 1
    pub(super) worst: usize,
}

/// A step within the tolerance.
pub(super) struct Accepted {
    pub(super) now: Taken,
    safety: f64,
    rejected: bool,
    wanted: f64,
}

/// What the next step starts with.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(super) struct Sizes {
    memory: Memory,
    before: Option<Taken>,
}

impl Sizes {
    /// No step has been taken yet, or a jump came after it: its length is to be guessed.
    pub(super) fn guess<O: DynamicOde>(
        &mut self,
        ode: &mut O,
        from: Start<'_>,
        remaining: f64,
        (norm, pace): (&Norm, Pace),
        statistics: &mut Statistics,
    ) {
        if self.memory.step > 0.0 {
            return;
        }
        let Start { t, x, slope } = from;
        let at_start = |values: &[f64]| norm.with(values, |i| x[i].abs());
        let sizes = [at_start(x), at_start(slope)];
        let h_0 = first_step::euler(sizes[0], sizes[1], remaining);
        let euler: Vec<f64> = x.iter().zip(slope).map(|(x, slope)| x + h_0 * slope).collect();
        let mut turned = vec![0.0; x.len()];
        if rhs(ode, t + h_0, &euler, &mut turned, statistics).is_err() {
            self.memory.step = h_0;
            return;
        }
        for (turned, slope) in turned.iter_mut().zip(slope) {
            *turned -= slope;
        }
        let rate = at_start(&turned) / h_0;
        self.memory.step = first_step::length([sizes[1], rate], h_0, pace.order, remaining);
    }

    /// Tries shorter and shorter steps from `t` until one keeps the tolerance; `trial(h, fresh)` takes one, `fresh`: no step
    /// of this length has been taken just before.
    pub(super) fn accepted<E>(
        &self,
        [t, t_end]: [f64; 2],
        pace: Pace,
        statistics: &mut Statistics,
        mut trial: impl FnMut(&mut Statistics, f64, bool) -> Result<Attempt, StepError<E>>,
    ) -> Result<Accepted, StepError<E>> {
        let min = RESOLUTION * t.abs().max(t_end.abs());
        let wanted = self.memory.step.max(min);
        let mut h = fit(wanted, t_end - t);
        let mut rejected = false;
        loop {
            let (shorter, reason) = match trial(statistics, h, rejected || self.before.is_none()) {
                Ok(Attempt { error, safety, .. }) if error <= 1.0 => {
                    return Ok(Accepted { now: Taken { h, error }, safety, rejected, wanted });
                }
                Ok(Attempt { error, safety, worst }) => {
                    #[allow(
                        clippy::manual_clamp,
                        reason = "clamp would pass on an error that is not a number"
                    )]
                    let shorter = h * pace.factor(safety, error).max(pace.shrink).min(SAFETY);
                    (shorter, StepError::StepTooSmall { t, h: shorter, min, index: worst })
                }
                Err(reason @ StepError::NoSolution { .. }) => (h * HALF, reason),
                Err(reason) => (h * SHRINK, reason),
            };
            rejected = true;
            statistics.rejected += 1;
            if shorter < min {
                return Err(reason);
            }
            h = shorter;
        }
    }

    /// Takes note of a step; `keeps`: the same size again is worth more than one longer by that factor.
    pub(super) fn note(&mut self, step: &Accepted, pace: Pace, keeps: impl FnOnce(f64) -> bool) {
        let Accepted { now, safety, rejected, wanted } = *step;
        let mut growth = pace.next(safety, now, self.memory.error, self.before);
        if rejected {
            growth = growth.min(1.0);
        } else if keeps(growth) {
            growth = 1.0;
        }
        let mut next = now.h * growth;
        if !rejected && next >= now.h {
            next = next.max(wanted); // cut short by the end of the call, not by its error
        }
        self.memory = Memory { step: next, error: now.error.max(LEAST_ERROR) };
        self.before = Some(now);
    }
}
