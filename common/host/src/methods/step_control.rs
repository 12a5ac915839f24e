//! The communication step that follows the error.
//!
//! ```text
//! first     1e-3 of the run
//! step      to the next sample, time event or stop if H reaches it; half the way if two steps are left; else H
//! after it  H <- h min(2, max(0.2, 0.9 error^(-1/(k + 2)))), and not shorter than before where h was cut by such a point and
//!           the error lets it grow; beyond an error of 1 the step is repeated
//! least     1e-10 of the run
//! ```

use super::Config;

/// First step, relative to the length of the run.
const FIRST_STEP: f64 = 1e-3;
/// Smallest step, relative to the length of the run.
const LEAST_STEP: f64 = 1e-10;
/// Smallest error that counts: a lucky step grows by no more than the largest factor anyway.
const LEAST_ERROR: f64 = 1e-10;
/// Part of a step that counts as no rest: steps that are doubled and halved meet the limit but for rounding.
const NO_REST: f64 = 1e-9;
const SAFETY: f64 = 0.9;
const SHRINK: f64 = 0.2;
const GROW: f64 = 2.0;

/// How long the next step is.
#[derive(Clone, Copy, Debug)]
pub(super) struct StepControl {
    /// Next step [s]
    pub(super) step: f64,
    least: f64,
    exponent: f64,
}

impl StepControl {
    pub(super) fn new(config: &Config) -> Self {
        let length = config.stop - config.start;
        #[allow(clippy::cast_precision_loss, reason = "1 or 2")]
        let exponent = -1.0 / (config.order as f64 + 2.0);
        Self { step: FIRST_STEP * length, least: LEAST_STEP * length, exponent }
    }

    /// End of a step from `t` that leaves no tiny rest before `limit`.
    pub(super) fn end(&self, t: f64, limit: f64) -> f64 {
        let remaining = limit - t;
        if self.step >= remaining * (1.0 - NO_REST) {
            limit
        } else if 2.0 * self.step > remaining {
            t + 0.5 * remaining
        } else {
            t + self.step
        }
    }

    /// Takes note of a step of length `h` with its error in units of the tolerance; whether it counts.
    pub(super) fn judge(&mut self, h: f64, error: f64) -> bool {
        let factor = (SAFETY * error.max(LEAST_ERROR).powf(self.exponent)).clamp(SHRINK, GROW);
        let accepted = error <= 1.0;
        let next = h * factor;
        self.step = if accepted && factor >= 1.0 { self.step.max(next) } else { next };
        accepted
    }

    /// The step has become too small to go on.
    pub(super) fn is_exhausted(&self) -> bool {
        self.step < self.least
    }
}
