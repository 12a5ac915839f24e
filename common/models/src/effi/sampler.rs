//! What a sampled controller remembers of one coordinate from tick to tick.

use serde::{Deserialize, Serialize};

/// Longest queue of commands [ticks]
pub const LONGEST_DELAY: usize = 10;

/// Rate of a sampled signal: backward difference through a one-pole filter,
/// `v += beta ((l - l_last)/T - v)`, 0 at the first tick.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct RateFilter {
    last: Option<f64>,
    rate: f64,
}

impl RateFilter {
    /// beta of a filter with the cutoff frequency `f` [Hz], 0: no filter, at the period `T` [s].
    #[must_use]
    pub fn beta(f: f64, T: f64) -> f64 {
        if f > 0.0 { -(-std::f64::consts::TAU * f * T).exp_m1() } else { 1.0 }
    }

    /// The rate with a new sample.
    #[must_use]
    pub fn sample(&mut self, l: f64, T: f64, beta: f64) -> f64 {
        if let Some(last) = self.last {
            self.rate += beta * ((l - last) / T - self.rate);
        }
        self.last = Some(l);
        self.rate
    }
}

/// A queue of commands.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Delay {
    waiting: [f64; LONGEST_DELAY],
}

impl Delay {
    /// A queue full of the same command.
    #[must_use]
    pub fn filled(command: f64) -> Self {
        Self { waiting: [command; LONGEST_DELAY] }
    }

    /// The command of `samples` ticks ago, while a new one is put in.
    ///
    /// # Panics
    /// For more than [`LONGEST_DELAY`] samples.
    #[must_use]
    pub fn pass(&mut self, command: f64, samples: usize) -> f64 {
        if samples == 0 {
            return command;
        }
        let oldest = self.waiting[samples - 1];
        self.waiting.copy_within(0..samples - 1, 1);
        self.waiting[0] = command;
        oldest
    }
}

/// Work of a rendered force: `sum F_k (r_k+1 - r_k)`, exact for a force that is held between ticks; above zero: energy put into the
/// hand side.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Rendered {
    work: f64,
    F: f64,
    r: f64,
}

impl Rendered {
    /// The work up to the tick at which the coordinate is `r`, from where on `F` is held [J].
    #[must_use]
    pub fn sample(&mut self, r: f64, F: f64) -> f64 {
        self.work += self.F * (r - self.r);
        (self.r, self.F) = (r, F);
        self.work
    }
}
