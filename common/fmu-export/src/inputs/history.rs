//! The last samples of the inputs.

use serde::{Deserialize, Serialize};

/// Samples that a polynomial of degree 3 to the end of a step needs before it.
const SAMPLES: usize = 3;

/// The last samples of all inputs.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct History {
    /// Times, newest first
    pub(super) t: [f64; SAMPLES],
    /// Values, newest sample first
    pub(super) u: Vec<f64>,
    pub(super) len: usize,
    /// So many of the newest samples are known to be the inputs as set
    same: usize,
}

impl History {
    /// No samples of `count` inputs.
    #[must_use]
    pub fn new(count: usize) -> Self {
        Self { t: [0.0; SAMPLES], u: vec![0.0; SAMPLES * count], len: 0, same: 0 }
    }

    /// True if it may be a history of `count` inputs.
    #[must_use]
    pub fn fits(&self, count: usize) -> bool {
        self.u.len() == SAMPLES * count && self.len <= SAMPLES && self.same <= self.len
    }

    /// Overwrite with another history, without allocation.
    pub fn copy_from(&mut self, other: &Self) {
        self.u.clone_from(&other.u);
        (self.t, self.len, self.same) = (other.t, other.len, other.same);
    }

    /// The inputs, or their treatment, are no longer those of the samples.
    pub fn unsettle(&mut self) {
        self.same = 0;
    }

    /// True if all samples are the inputs as set, so that no polynomial moves.
    #[must_use]
    pub fn settled(&self) -> bool {
        self.same == SAMPLES
    }

    /// Forget all samples.
    pub fn clear(&mut self) {
        (self.len, self.same) = (0, 0);
    }

    /// Add a sample at `t` of the inputs as set, which are [settled](Self::settled).
    pub fn push_again(&mut self, t: f64) {
        if t > self.t[0] {
            self.t = [t, self.t[0], self.t[1]];
        }
    }

    /// Add the values `u` at `t`; samples that are not older are replaced.
    pub fn push(&mut self, t: f64, u: &[f64]) {
        let n = u.len();
        let newer = self.newer(t);
        let kept = (self.len - newer).min(SAMPLES - 1);
        let same = match newer {
            0 if self.len > 0 && identical(self.sample(0), u) => self.same.max(1) + 1,
            1 if identical(self.sample(0), u) => self.same.max(1),
            _ => 1,
        };
        if newer != 1 {
            self.t.copy_within(newer..newer + kept, 1);
            self.u.copy_within(newer * n..(newer + kept) * n, n);
        }
        self.t[0] = t;
        self.u[..n].copy_from_slice(u);
        self.len = kept + 1;
        self.same = same.min(self.len);
    }

    /// Number of samples that are not older than `t`.
    pub(super) fn newer(&self, t: f64) -> usize {
        self.t[..self.len].iter().take_while(|s| **s >= t).count()
    }

    pub(super) fn sample(&self, i: usize) -> &[f64] {
        let n = self.u.len() / SAMPLES;
        &self.u[i * n..(i + 1) * n]
    }
}

/// True if the bits are the same.
pub(super) fn identical(a: &[f64], b: &[f64]) -> bool {
    a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits())
}
