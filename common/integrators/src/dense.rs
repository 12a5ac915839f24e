//! The solution inside a step.

/// Largest degree in theta of any method's continuous extension.
pub(crate) const DEGREE: usize = 4;

/// Continuous extension of one accepted step.
///
/// ```text
/// x(t + theta h) = x_0 + theta (c_1 + theta (c_2 + theta (c_3 + theta c_4))),   0 <= theta <= 1
/// ```
/// Its local error is `O(h^3)` for Heun, `O(h^4)` for RK4 and `O(h^5)` for Dopri5, so that values read from it
/// keep the order of the method. `theta = 1` is the method's new state before any projection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dense<const N: usize> {
    /// Start of the step [s]
    pub t: f64,
    /// Length of the step [s]
    pub h: f64,
    pub(crate) start: [f64; N],
    pub(crate) end: [f64; N],
    pub(crate) coefficients: [[f64; N]; DEGREE],
}

impl<const N: usize> Dense<N> {
    /// State at the fraction `theta` of the step, from 0 to 1.
    #[inline]
    #[must_use]
    pub fn at(&self, theta: f64) -> [f64; N] {
        if theta >= 1.0 {
            return self.end; // not x_0 + rounding
        }
        let [c_1, c_2, c_3, c_4] = &self.coefficients;
        std::array::from_fn(|i| {
            self.start[i] + theta * (c_1[i] + theta * (c_2[i] + theta * (c_3[i] + theta * c_4[i])))
        })
    }

    /// State at the time `t` inside the step [s].
    #[inline]
    #[must_use]
    pub fn at_time(&self, t: f64) -> [f64; N] {
        self.at((t - self.t) / self.h)
    }
}
