//! What the user chooses.

use serde::{Deserialize, Serialize};

use crate::{Method, SettingsError};

/// Method and accuracy of a solver.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// The integration method.
    pub method: Method,
    /// Largest step of a fixed-step method [s]; adaptive methods choose their own.
    pub step: f64,
    /// Relative tolerance of an adaptive method [1].
    pub rtol: f64,
    /// Absolute tolerance of an adaptive method, in units of the nominal values [1].
    pub atol: f64,
}

/// Relative excess of the interval over a whole number of steps that is taken for rounding.
const SLACK: f64 = 1e-9;

impl Settings {
    /// Number of equal steps into which a fixed-step method divides `interval`: `max(1, ceil(interval/step - 1e-9))`.
    #[must_use]
    pub fn inner_steps(&self, interval: f64) -> f64 {
        (interval / self.step - SLACK).ceil().max(1.0)
    }

    /// Size of the steps into which a fixed-step method divides `interval` [s].
    #[must_use]
    pub fn inner_step(&self, interval: f64) -> f64 {
        interval / self.inner_steps(interval)
    }

    pub(crate) fn check(self) -> Result<Self, SettingsError> {
        for (name, value) in [("step", self.step), ("rtol", self.rtol), ("atol", self.atol)] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(SettingsError { name, value });
            }
        }
        Ok(self)
    }
}
