//! Equal steps.

use crate::error::all_finite;
use crate::one_step::{Call, OneStep};
use crate::run::{MAX_EVALUATIONS, Run, Watch};
use crate::{Ode, Settings, StepError};

/// Runs to `t_end` in `n` equal steps, see [`Settings::inner_steps`].
///
/// Times are `t_0 + i h`, not a running sum, and the last is `t_end` itself.
#[inline]
pub(crate) fn fixed<const N: usize, M: OneStep<N>, O: Ode<N>, W: Watch<N>>(
    method: &M,
    settings: &Settings,
    call: &mut Call<'_, N, O, M::Work>,
    run: &mut Run<N>,
    t_end: f64,
    watch: &mut W,
) -> Result<(), StepError<O::Error>> {
    let t_start = run.t;
    let span = t_end - t_start;
    let steps = settings.inner_steps(span);
    #[allow(clippy::cast_precision_loss, reason = "below 2^53")]
    if steps * f64::from(settings.method.stages()) > MAX_EVALUATIONS as f64 {
        return Err(StepError::TooMuchWork { t: t_start, t_end, h: settings.step });
    }
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "from 1 to MAX_EVALUATIONS")]
    let n = steps as u32;
    let h = span / steps;
    let mut slope = None;
    for i in 1..=n {
        let from = run.start(call, slope.take())?;
        method.begin(call, &from)?;
        let mut trial = method.step(call, &from, h)?;
        let t = if i == n { t_end } else { t_start + f64::from(i) * h };
        all_finite(t, M::state(&trial))?;
        if W::WATCHES {
            let dense = method.dense(call, &from, &mut trial, h)?;
            if run.watch(method, call, (&from, &dense), (t, i == n), watch)? {
                return Ok(());
            }
        }
        method.accepted(call.work, &trial, h);
        if !run.accept(call, t, M::state(&trial))? {
            slope = method.slope(&trial).copied();
        }
    }
    Ok(())
}
