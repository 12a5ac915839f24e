//! How the step size follows the error.
//!
//! ```text
//! h_new = h min(grow, max(shrink, 0.9 err^(-alpha) err_old^beta)),   alpha = 1/p - 3/4 beta
//! h_new <= 0.9 h (h / h_old) (err_old / err^2)^(1/p)                        (predictive, for stiff problems)
//! ```
//! Source: Hairer, Nørsett & Wanner, sections II.4 and (Hairer & Wanner) IV.2 (PI control), IV.8 (predictive control);
//! K. Gustafsson, ACM TOMS 17 (1991) and 20 (1994).

use serde::{Deserialize, Serialize};

/// Smallest error remembered, so that one lucky step does not rule the next.
pub(crate) const LEAST_ERROR: f64 = 1e-4;
/// The same for predictive control.
const LEAST_PREDICTED: f64 = 1e-2;

/// Longest part of a rejected step that is tried next.
pub(crate) const SAFETY: f64 = 0.9;
/// The same after an error of the model.
pub(crate) const SHRINK: f64 = 0.2;
/// Smallest step in units of the rounding of time.
pub(crate) const RESOLUTION: f64 = 8.0 * f64::EPSILON;

/// The step size next to `h` that leaves no tiny rest: what remains is done in one step or in two halves.
pub(crate) fn fit(h: f64, remaining: f64) -> f64 {
    if h >= remaining {
        remaining
    } else if 2.0 * h > remaining {
        0.5 * remaining
    } else {
        h
    }
}

/// The numbers of a method's control.
#[derive(Clone, Copy)]
pub(crate) struct Pace {
    /// Exponent `p` of the step size in the error estimate of one step.
    pub(crate) order: f64,
    pub(crate) beta: f64,
    /// Limits of the change from step to step.
    pub(crate) shrink: f64,
    pub(crate) grow: f64,
    pub(crate) predictive: bool,
}

/// Of a step that counts.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(crate) struct Taken {
    pub(crate) h: f64,
    pub(crate) error: f64,
}

impl Pace {
    /// For fixed steps.
    pub(crate) const NONE: Self = Self { order: 1.0, beta: 0.0, shrink: 1.0, grow: 1.0, predictive: false };

    /// How much longer the step may be for an error of 1, `err_old` aside.
    pub(crate) fn factor(&self, safety: f64, error: f64) -> f64 {
        safety * error.powf(0.75 * self.beta - 1.0 / self.order)
    }

    /// Size of the step after `now` relative to it, between the limits.
    pub(crate) fn next(&self, safety: f64, now: Taken, error_before: f64, before: Option<Taken>) -> f64 {
        let mut factor = self.factor(safety, now.error);
        if self.beta > 0.0 {
            factor *= error_before.powf(self.beta);
        }
        if let (true, Some(before)) = (self.predictive, before) {
            let error = now.error.max(f64::MIN_POSITIVE.sqrt());
            let ratio = before.error.max(LEAST_PREDICTED) / (error * error);
            factor = factor.min(safety * now.h / before.h * ratio.powf(1.0 / self.order));
        }
        factor.clamp(self.shrink, self.grow)
    }
}
