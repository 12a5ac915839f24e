//! The solution inside a step.

use crate::one_step::Start;

/// Largest degree in theta of any method's continuous extension.
const DEGREE: usize = 7;

/// Continuous extension of one accepted step.
///
/// ```text
/// x(t + theta h) = x_0 + theta (c_1 + theta (c_2 + .. + theta c_7)),   0 <= theta <= 1
/// ```
/// Its local error is `O(h^3)` for Heun, `O(h^4)` for RK4, `O(h^5)` for Dopri5 and `O(h^8)` for Dop853, so that values
/// read from it keep the order of the method; `O(h^4)` for Rodas4 and Radau5 and `O(h^6)` for Exact. `theta = 1` is the method's new state before any projection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dense<const N: usize> {
    /// Start of the step [s]
    pub t: f64,
    /// Length of the step [s]
    pub h: f64,
    start: [f64; N],
    end: [f64; N],
    coefficients: [[f64; N]; DEGREE],
}

impl<const N: usize> Dense<N> {
    pub(crate) fn new<const P: usize>(
        from: &Start<N>,
        h: f64,
        end: [f64; N],
        coefficients: &[[f64; N]; P],
    ) -> Self {
        Self {
            t: from.t,
            h,
            start: from.x,
            end,
            coefficients: std::array::from_fn(|p| coefficients.get(p).copied().unwrap_or([0.0; N])),
        }
    }

    /// State at the fraction `theta` of the step, from 0 to 1.
    #[inline]
    #[must_use]
    pub fn at(&self, theta: f64) -> [f64; N] {
        if theta >= 1.0 {
            return self.end; // not x_0 + rounding
        }
        let mut sum = [0.0; N];
        for c in self.coefficients.iter().rev() {
            for (sum, c) in sum.iter_mut().zip(c) {
                *sum = theta * (*sum + c);
            }
        }
        std::array::from_fn(|i| self.start[i] + sum[i])
    }

    /// State at the time `t` inside the step [s].
    #[inline]
    #[must_use]
    pub fn at_time(&self, t: f64) -> [f64; N] {
        self.at((t - self.t) / self.h)
    }
}
