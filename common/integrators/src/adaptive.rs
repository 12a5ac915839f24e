//! Steps as long as the tolerance allows: `norm.rs` measures the error, `pace.rs` chooses the next step.
//!
//! The step counts if the error is at most 1.

use crate::error::all_finite;
use crate::first_step;
use crate::one_step::{Call, OneStep, Start};
use crate::pace::{LEAST_ERROR, RESOLUTION, SAFETY, SHRINK, Taken, fit};
use crate::run::{MAX_EVALUATIONS, Run, Watch};
use crate::solver::Memory;
use crate::{Dense, Ode, StepError};

/// Part of a step that is tried next where the equations of an implicit step had no solution.
pub(crate) const HALF: f64 = 0.5;

/// Runs to `t_end` and leaves in `memory` what the next call starts with.
#[inline]
pub(crate) fn adaptive<const N: usize, M: OneStep<N>, O: Ode<N>, W: Watch<N>>(
    method: &M,
    memory: &mut Memory,
    call: &mut Call<'_, N, O, M::Work>,
    run: &mut Run<N>,
    t_end: f64,
    watch: &mut W,
) -> Result<(), StepError<O::Error>> {
    let most_work = call.statistics.work(N) + MAX_EVALUATIONS;
    let control = Control { method, t_end, most_work, watched: W::WATCHES };
    let pace = method.pace();
    let mut slope = None;
    let mut before = None;
    while run.t < t_end {
        let from = run.start(call, slope.take())?;
        all_finite(from.t, &from.slope)?;
        let remaining = t_end - from.t;
        if memory.step <= 0.0 {
            memory.step = control.first_step(call, &from);
        }
        let wanted = memory.step.max(control.least_step(from.t));
        method.begin(call, &from)?;
        let first = before.is_none();
        let Accepted { trial, now, rejected, dense } =
            control.accepted(call, &from, fit(wanted, remaining), first)?;

        let h = now.h;
        let last = h >= remaining;
        let t = if last { t_end } else { from.t + h };
        if let Some(dense) = dense
            && run.watch(method, call, (&from, &dense), (t, last), watch)?
        {
            return Ok(());
        }
        let mut growth = pace.next(method.safety(&trial), now, memory.error, before);
        method.accepted(call.work, &trial, h);
        if rejected {
            growth = growth.min(1.0);
        } else if method.keeps(call.work, growth) {
            growth = 1.0;
        }
        let mut next = h * growth;
        if !rejected && next >= h {
            next = next.max(wanted); // cut short by the end of the call, not by its error
        }
        *memory = Memory { step: next, error: now.error.max(LEAST_ERROR) };
        before = Some(now);
        if !run.accept(call, t, M::state(&trial))? {
            slope = method.slope(&trial).copied();
        }
    }
    Ok(())
}

/// A step within the tolerance.
struct Accepted<T, const N: usize> {
    trial: T,
    now: Taken,
    /// Longer steps were tried before.
    rejected: bool,
    /// Where somebody looks.
    dense: Option<Dense<N>>,
}

/// What the choice of step sizes needs to know.
struct Control<'a, M> {
    method: &'a M,
    t_end: f64,
    /// The work at which the call is given up
    most_work: u64,
    watched: bool,
}

impl<M> Control<'_, M> {
    /// Smallest step at `t` [s].
    fn least_step(&self, t: f64) -> f64 {
        RESOLUTION * t.abs().max(self.t_end.abs())
    }

    /// Tries `h` and shorter steps until one keeps the tolerance.
    #[inline]
    fn accepted<const N: usize, O: Ode<N>>(
        &self,
        call: &mut Call<'_, N, O, M::Work>,
        from: &Start<N>,
        mut h: f64,
        first: bool,
    ) -> Result<Accepted<M::Trial, N>, StepError<O::Error>>
    where
        M: OneStep<N>,
    {
        let Self { method, t_end, .. } = *self;
        let t = from.t;
        let min = self.least_step(t);
        let mut rejected = false;
        loop {
            if call.statistics.work(N) > self.most_work {
                return Err(StepError::TooMuchWork { t, t_end, h });
            }
            let (shorter, reason) = match self.attempt(call, from, h, first || rejected) {
                Ok(Attempt::Within { trial, error, dense }) => {
                    return Ok(Accepted { trial, now: Taken { h, error }, rejected, dense });
                }
                Ok(Attempt::Beyond { safety, error, index }) => {
                    let pace = method.pace();
                    #[allow(
                        clippy::manual_clamp,
                        reason = "clamp would pass on an error that is not a number"
                    )]
                    let shorter = h * pace.factor(safety, error).max(pace.shrink).min(SAFETY);
                    (shorter, StepError::StepTooSmall { t, h: shorter, min, index })
                }
                Err(reason @ StepError::NoSolution { .. }) => (h * HALF, reason),
                Err(reason) => (h * SHRINK, reason),
            };
            rejected = true;
            call.statistics.rejected += 1;
            if shorter < min {
                return Err(reason);
            }
            h = shorter;
        }
    }

    /// One step of length `h` and its error.
    #[inline]
    fn attempt<const N: usize, O: Ode<N>>(
        &self,
        call: &mut Call<'_, N, O, M::Work>,
        from: &Start<N>,
        h: f64,
        fresh: bool,
    ) -> Result<Attempt<M::Trial, N>, StepError<O::Error>>
    where
        M: OneStep<N>,
    {
        let method = self.method;
        let mut trial = method.step(call, from, h)?;
        all_finite(from.t + h, M::state(&trial))?;
        let estimate = method.error(call, from, &trial, h, fresh);
        if estimate.size <= 1.0 {
            let dense = if self.watched { Some(method.dense(call, from, &mut trial, h)?) } else { None };
            return Ok(Attempt::Within { trial, error: estimate.size, dense });
        }
        Ok(Attempt::Beyond {
            safety: method.safety(&trial),
            error: estimate.size,
            index: call.norm.worst(&estimate.parts, &from.x),
        })
    }

    /// Start step, see `first_step.rs`.
    fn first_step<const N: usize, O: Ode<N>>(
        &self,
        call: &mut Call<'_, N, O, M::Work>,
        from: &Start<N>,
    ) -> f64
    where
        M: OneStep<N>,
    {
        let Start { t, x, slope } = from;
        let remaining = self.t_end - t;
        let d_0 = call.norm.of(x, x, x);
        let d_1 = call.norm.of(slope, x, x);
        let h_0 = first_step::euler(d_0, d_1, remaining);
        let euler: [f64; N] = std::array::from_fn(|i| x[i] + h_0 * slope[i]);
        let Ok(turned) = call.rhs(t + h_0, &euler) else {
            return h_0;
        };
        let change: [f64; N] = std::array::from_fn(|i| turned[i] - slope[i]);
        let d_2 = call.norm.of(&change, x, x) / h_0;
        first_step::length([d_1, d_2], h_0, self.method.pace().order, remaining)
    }
}

/// How a step came out.
enum Attempt<T, const N: usize> {
    Within { trial: T, error: f64, dense: Option<Dense<N>> },
    Beyond { safety: f64, error: f64, index: usize },
}
