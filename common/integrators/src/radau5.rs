//! RADAU5: the collocation method of Radau with three stages, order 5, L-stable, for stiff problems.
//!
//! ```text
//! z_i = h sum_j a_ij f(t + c_j h, x + z_j),   x_new = x + z_3,   c = ((4 - sqrt 6)/10, (4 + sqrt 6)/10, 1)
//! ```
//! With `T^(-1) A^(-1) T = diag(gamma, [[alpha, -beta], [beta, alpha]])` and `w = T^(-1) z` an iteration of the simplified
//! Newton method is one real and one complex system of size `N`:
//! ```text
//! (gamma/h I - J) dw_1               = g_1 - gamma/h w_1                      g = T^(-1) f(x + z)
//! ((alpha + i beta)/h I - J) dw_(23) = g_2 + i g_3 - (alpha + i beta)/h (w_2 + i w_3)
//! ```
//! It starts from the collocation polynomial of the step before and ends when the increment, scaled as errors are,
//! promises to be small enough; the Jacobian stays while it converges fast, the matrices while the step size stays.
//! Error of order 3, filtered: `err = (gamma/h I - J)^(-1) (f(x) + (e_1 z_1 + e_2 z_2 + e_3 z_3)/h)`.
//!
//! Source: Hairer & Wanner II, section IV.8; eigenvectors as in their code RADAU5.

use crate::one_step::{Call, Estimate, OneStep, Start};
use crate::pace::Pace;
use crate::{Complex, Dense, Ode, StepError, stability};

pub(crate) mod system;
#[cfg(test)]
mod tests;
use system::{A, C, Matrices, POWERS, Stages, T, T_INVERSE, times};

/// Most Newton iterations.
pub(crate) const MOST: u32 = 10;
/// Rate of convergence up to which a Jacobian is used again.
pub(crate) const REUSE: f64 = 1e-3;
/// Longest growth that is not worth new matrices.
pub(crate) const KEEP: f64 = 1.2;

/// Its control of the step size.
pub(crate) const PACE: Pace = Pace { order: 4.0, beta: 0.0, shrink: 0.2, grow: 8.0, predictive: true };

/// The estimate has order 3 and the method 5: its step size goes with `rtol^(1/6)`, its error with `rtol^(5/6)`.
pub(crate) fn tolerance(rtol: f64) -> f64 {
    0.1 * rtol.powf(2.0 / 3.0)
}

/// What the size of an increment says about the Newton iteration.
pub(crate) enum Verdict {
    Arrived,
    GoesOn,
    /// It diverges, or is too slow to arrive
    Hopeless,
}

/// How the Newton iteration converges.
pub(crate) struct Convergence {
    /// Increment allowed: a part of the error allowed, above rounding
    tolerance: f64,
    /// Rate of convergence
    pub(crate) rate: f64,
    /// `rate / (1 - rate)`: error after an iteration over its increment
    pub(crate) eta: f64,
    /// Ratio of the last two increments
    last: f64,
    /// Increment before
    before: f64,
}

impl Convergence {
    /// Before the first iteration; `eta` of the last step.
    #[inline]
    pub(crate) fn new(eta: f64, rtol: f64) -> Self {
        let tolerance = rtol.sqrt().min(0.03).max(10.0 * f64::EPSILON / rtol);
        Self { tolerance, rate: 0.0, eta: eta.max(f64::EPSILON).powf(0.8), last: 0.0, before: 0.0 }
    }

    /// After iteration `k` with an increment of this size.
    #[inline]
    pub(crate) fn after(&mut self, k: u32, size: f64) -> Verdict {
        if !size.is_finite() {
            return Verdict::Hopeless;
        }
        if k > 1 {
            let ratio = size / self.before;
            self.rate = if k == 2 { ratio } else { (ratio * self.last).sqrt() };
            self.last = ratio;
            if self.rate < 0.99 {
                self.eta = self.rate / (1.0 - self.rate);
                // the first ratio tells little of a start far off
                if k > 2 && self.eta * size * self.rate.powi((MOST - k).cast_signed()) > self.tolerance {
                    return Verdict::Hopeless;
                }
            } else if size > self.tolerance {
                return Verdict::Hopeless;
            } else {
                self.eta = 1.0; // rounding is all that is left
            }
        }
        self.before = size;
        if self.eta * size <= self.tolerance { Verdict::Arrived } else { Verdict::GoesOn }
    }
}

/// Part of the step size that the error allows: less after many iterations.
pub(crate) fn safety(iterations: u32) -> f64 {
    let most = f64::from(MOST);
    0.9 * (2.0 * most + 1.0) / (2.0 * most + f64::from(iterations))
}

/// The method.
pub(crate) struct Radau5;

impl Radau5 {
    pub(crate) const ORDER: u32 = 5;
    /// With two iterations.
    pub(crate) const EVALUATIONS: u32 = 2 * 3 + 1;

    /// `R(z)` from the table.
    pub(crate) fn stability(z: Complex) -> Complex {
        stability::implicit(&A, &A[2], z)
    }
}

/// What the steps of a call share.
pub(crate) struct Work<const N: usize> {
    jacobian: Option<[[f64; N]; N]>,
    /// It belongs to the start of the step.
    current: bool,
    matrices: Option<Matrices<N>>,
    /// Rate of convergence of the last Newton iteration.
    rate: f64,
    /// `rate / (1 - rate)`: error after an iteration over its increment, for the first guess.
    eta: f64,
    /// Length and collocation polynomial of the step before.
    before: Option<(f64, Stages<N>)>,
}

impl<const N: usize> Default for Work<N> {
    fn default() -> Self {
        Self { jacobian: None, current: false, matrices: None, rate: 0.0, eta: 1.0, before: None }
    }
}

/// New state and stages of one step.
pub(crate) struct Trial<const N: usize> {
    x: [f64; N],
    z: Stages<N>,
    error: [f64; N],
    iterations: u32,
}

impl Radau5 {
    /// Matrices for the step size `h`.
    fn prepare<const N: usize, O: Ode<N>>(
        call: &mut Call<'_, N, O, Work<N>>,
        from: &Start<N>,
        h: f64,
    ) -> Result<(), StepError<O::Error>> {
        if call.work.jacobian.is_none() {
            call.work.jacobian = Some(call.jacobian(from)?.0);
            call.work.current = true;
            call.work.matrices = None;
        }
        #[allow(clippy::float_cmp, reason = "made for this very step size")]
        let ready = call.work.matrices.as_ref().is_some_and(|m| m.h == h);
        if !ready {
            call.statistics.decompositions += 1;
            call.work.matrices = call.work.jacobian.as_ref().and_then(|j| Matrices::new(j, h));
        }
        Ok(())
    }

    /// The stages and the number of iterations; `None` where they do not converge.
    #[inline]
    fn newton<const N: usize, O: Ode<N>>(
        call: &mut Call<'_, N, O, Work<N>>,
        from: &Start<N>,
        h: f64,
    ) -> Result<Option<(Stages<N>, u32)>, StepError<O::Error>> {
        let Start { t, x, .. } = from;
        let weights = call.norm.weights(x);
        let mut convergence = Convergence::new(call.work.eta, call.norm.rtol());
        let mut z = predicted(call.work.before.as_ref(), h);
        let mut w = times(&T_INVERSE, &z);
        for k in 1..=MOST {
            let mut f = [[0.0; N]; 3];
            for i in 0..3 {
                let stage = std::array::from_fn(|n| x[n] + z[i][n]);
                f[i] = call.rhs(t + C[i] * h, &stage)?;
            }
            let Some(matrices) = &call.work.matrices else {
                return Ok(None);
            };
            let increment = matrices.increment(&f, &w);
            let square: f64 = increment.iter().map(|d| call.norm.weighted(d, &weights).powi(2)).sum();
            let size = (square / 3.0).sqrt();
            for i in 0..3 {
                for n in 0..N {
                    w[i][n] += increment[i][n];
                }
            }
            z = times(&T, &w);
            match convergence.after(k, size) {
                Verdict::Arrived => {
                    call.work.rate = convergence.rate;
                    call.work.eta = convergence.eta;
                    return Ok(Some((z, k)));
                }
                Verdict::Hopeless => return Ok(None),
                Verdict::GoesOn => {}
            }
        }
        Ok(None)
    }
}

/// First guess of the stages of a step of length `h`: the step before goes on.
#[inline]
fn predicted<const N: usize>(before: Option<&(f64, Stages<N>)>, h: f64) -> Stages<N> {
    let Some((length, p)) = before else {
        return [[0.0; N]; 3];
    };
    C.map(|c| {
        // z(theta) - z(1), theta = 1 + s
        let s = c * h / length;
        std::array::from_fn(|n| {
            let [p_1, p_2, p_3] = [p[0][n], p[1][n], p[2][n]];
            s * (p_1 + 2.0 * p_2 + 3.0 * p_3 + s * (p_2 + 3.0 * p_3 + s * p_3))
        })
    })
}

impl<const N: usize> OneStep<N> for Radau5 {
    type Trial = Trial<N>;
    type Work = Work<N>;

    fn pace(&self) -> Pace {
        PACE
    }

    fn tolerance(&self, rtol: f64) -> f64 {
        tolerance(rtol)
    }

    #[inline]
    fn begin<O: Ode<N>>(
        &self,
        call: &mut Call<'_, N, O, Work<N>>,
        _from: &Start<N>,
    ) -> Result<(), StepError<O::Error>> {
        call.work.current = false;
        if call.work.rate > REUSE {
            call.work.jacobian = None;
        }
        Ok(())
    }

    #[inline]
    fn step<O: Ode<N>>(
        &self,
        call: &mut Call<'_, N, O, Work<N>>,
        from: &Start<N>,
        h: f64,
    ) -> Result<Trial<N>, StepError<O::Error>> {
        Self::prepare(call, from, h)?;
        let mut solved = Self::newton(call, from, h)?;
        if solved.is_none() && !call.work.current {
            call.work.jacobian = None;
            Self::prepare(call, from, h)?;
            solved = Self::newton(call, from, h)?;
        }
        let (Some((z, iterations)), Some(matrices)) = (solved, &call.work.matrices) else {
            return Err(StepError::NoSolution { t: from.t, h });
        };
        Ok(Trial {
            x: std::array::from_fn(|n| from.x[n] + z[2][n]),
            z,
            error: matrices.error(&from.slope, &z),
            iterations,
        })
    }

    fn state(trial: &Trial<N>) -> &[f64; N] {
        &trial.x
    }

    fn slope<'a>(&self, _trial: &'a Trial<N>) -> Option<&'a [f64; N]> {
        None
    }

    /// Far out the first estimate is too large for a start off the slow motion; filtered again it is not.
    #[inline]
    fn error<O: Ode<N>>(
        &self,
        call: &mut Call<'_, N, O, Work<N>>,
        from: &Start<N>,
        trial: &Trial<N>,
        _h: f64,
        fresh: bool,
    ) -> Estimate<N> {
        let mut parts = trial.error;
        let mut size = call.norm.of(&parts, &from.x, &trial.x);
        if fresh && size >= 1.0 {
            let moved = std::array::from_fn(|n| from.x[n] + parts[n]);
            if let (Ok(slope), Some(matrices)) = (call.rhs(from.t, &moved), &call.work.matrices) {
                parts = matrices.error(&slope, &trial.z);
                size = call.norm.of(&parts, &from.x, &trial.x);
            }
        }
        Estimate { size, parts }
    }

    fn dense<O: Ode<N>>(
        &self,
        _call: &mut Call<'_, N, O, Work<N>>,
        from: &Start<N>,
        trial: &mut Trial<N>,
        h: f64,
    ) -> Result<Dense<N>, StepError<O::Error>> {
        Ok(Dense::new(from, h, trial.x, &times(&POWERS, &trial.z)))
    }

    #[inline]
    fn accepted(&self, work: &mut Work<N>, trial: &Trial<N>, h: f64) {
        work.before = Some((h, times(&POWERS, &trial.z)));
    }

    #[inline]
    fn safety(&self, trial: &Trial<N>) -> f64 {
        safety(trial.iterations)
    }

    #[inline]
    fn keeps(&self, work: &Work<N>, growth: f64) -> bool {
        work.rate <= REUSE && (1.0..=KEEP).contains(&growth)
    }
}
