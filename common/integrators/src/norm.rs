//! Errors in units of the tolerance.
//!
//! ```text
//! size = sqrt(mean_i (value_i / scale_i)^2),   scale_i = atol nominal_i + rtol max(|x_i|, |x_new_i|)
//! ```
//! A component with an infinite nominal value, e.g. an energy integral, does not count.

use crate::{Ode, Settings};

/// `value` in units of the tolerance at a component of magnitude `x`; 0 for what does not count.
#[inline]
pub(crate) fn scaled(value: f64, nominal: f64, x: f64, [rtol, atol]: [f64; 2]) -> f64 {
    if nominal.is_finite() { value / (atol * nominal + rtol * x) } else { 0.0 }
}

/// Number of components that count, at least 1.
pub(crate) fn counted(nominal: &[f64]) -> f64 {
    nominal.iter().map(|n| if n.is_finite() { 1.0 } else { 0.0 }).sum::<f64>().max(1.0)
}

/// Measures errors in units of the tolerance.
pub(crate) struct Norm<const N: usize> {
    nominal: [f64; N],
    /// Components with a finite nominal value.
    counted: f64,
    rtol: f64,
    atol: f64,
}

impl<const N: usize> Norm<N> {
    /// `rtol` is what the method makes of the tolerance wanted; `atol` keeps its ratio to it.
    pub(crate) fn new<O: Ode<N>>(ode: &O, settings: &Settings, rtol: f64) -> Self {
        let nominal = ode.nominal();
        Self { nominal, counted: counted(&nominal), rtol, atol: settings.atol * (rtol / settings.rtol) }
    }

    pub(crate) fn rtol(&self) -> f64 {
        self.rtol
    }

    #[inline]
    fn scaled(&self, value: f64, i: usize, x: f64) -> f64 {
        scaled(value, self.nominal[i], x, [self.rtol, self.atol])
    }

    /// Size of `values` against the larger of two states.
    #[inline]
    pub(crate) fn of(&self, values: &[f64; N], x: &[f64; N], x_new: &[f64; N]) -> f64 {
        let sum: f64 =
            (0..N).map(|i| self.scaled(values[i], i, x[i].abs().max(x_new[i].abs())).powi(2)).sum();
        (sum / self.counted).sqrt()
    }

    /// `1 / scale_i` at `x`, 0 for what does not count.
    #[inline]
    pub(crate) fn weights(&self, x: &[f64; N]) -> [f64; N] {
        std::array::from_fn(|i| self.scaled(1.0, i, x[i].abs()))
    }

    /// Size of `values` under given weights.
    #[inline]
    pub(crate) fn weighted(&self, values: &[f64; N], weights: &[f64; N]) -> f64 {
        let sum: f64 = values.iter().zip(weights).map(|(v, w)| (v * w).powi(2)).sum();
        (sum / self.counted).sqrt()
    }

    /// The component that asks for the smallest step.
    pub(crate) fn worst(&self, values: &[f64; N], x: &[f64; N]) -> usize {
        let size = |i: usize| self.scaled(values[i], i, x[i].abs()).abs();
        (0..N).max_by(|&i, &j| size(i).total_cmp(&size(j))).unwrap_or(0)
    }
}
