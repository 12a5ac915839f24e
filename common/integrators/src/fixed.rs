//! Equal steps.

use crate::error::all_finite;
use crate::one_step::{OneStep, Start};
use crate::run::{MAX_STEPS, Run, Taken, Watch};
use crate::{Ode, StepError};

/// Relative excess of the interval over a whole number of steps that is taken for rounding.
const SLACK: f64 = 1e-9;

/// Runs to `t_end` in `n = max(1, ceil(H/step - 1e-9))` steps of `H/n`.
///
/// Times are `t_0 + i h`, not a running sum, and the last is `t_end` itself.
#[inline]
pub(crate) fn fixed<const N: usize, M: OneStep<N>, O: Ode<N>, W: Watch<N>>(
    method: &M,
    step: f64,
    ode: &O,
    run: &mut Run<N>,
    t_end: f64,
    watch: &mut W,
) -> Result<(), StepError<O::Error>> {
    let t_start = run.t;
    let span = t_end - t_start;
    let steps = (span / step - SLACK).ceil().max(1.0);
    if steps > f64::from(MAX_STEPS) {
        return Err(StepError::TooManySteps {
            t: t_start,
            t_end,
            h: step,
        });
    }
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "from 1 to MAX_STEPS"
    )]
    let n = steps as u32;
    let h = span / steps;
    let mut slope = None;
    for i in 1..=n {
        let from = Start {
            t: run.t,
            x: run.x,
            slope: match slope.take() {
                Some(slope) => slope,
                None => run.slope(ode)?,
            },
        };
        let trial = method.step(ode, &from, h, &mut run.statistics.rhs_evaluations)?;
        let t = if i == n { t_end } else { t_start + f64::from(i) * h };
        all_finite(t, M::state(&trial))?;
        if W::WATCHES {
            let taken = Taken {
                from: &from,
                trial: &trial,
                h,
                t,
                last: i == n,
            };
            if run.watch(method, ode, &taken, watch)? {
                return Ok(());
            }
        }
        if !run.accept(ode, t, M::state(&trial))? {
            slope = method.slope(&trial).copied();
        }
    }
    Ok(())
}
