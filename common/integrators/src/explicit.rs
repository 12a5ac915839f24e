//! Explicit Runge-Kutta methods: one code for every table.

use crate::dense::Dense;
use crate::one_step::{Call, Estimate, OneStep, Start};
use crate::pace::Pace;
use crate::{Ode, StepError};

/// Powers of theta in the continuous extension of a table.
pub(crate) const POWERS: usize = 4;

/// The numbers of an explicit method with `S` stages.
///
/// ```text
/// k_i      = f(t + c_i h, x + h sum_(j<i) a_ij k_j)
/// x_new    = x + h sum_i b_i k_i
/// error    = h sum_i error_i k_i                                      (b minus the embedded weights)
/// x(theta) = x + h sum_i k_i sum_p dense_ip theta^p,  p = 1..4        (continuous extension)
/// ```
pub(crate) struct Tableau<const S: usize> {
    pub(crate) order: u32,
    pub(crate) pace: Pace,
    pub(crate) a: [[f64; S]; S],
    pub(crate) b: [f64; S],
    pub(crate) c: [f64; S],
    pub(crate) error: [f64; S],
    pub(crate) dense: [[f64; POWERS]; S],
    /// The last stage is evaluated at the new state ("first same as last"): its row of `a` is `b`.
    pub(crate) first_same_as_last: bool,
}

/// New state and stages of one step.
pub(crate) struct Trial<const N: usize, const S: usize> {
    x: [f64; N],
    k: [[f64; N]; S],
}

/// `x + h sum_j weights_j k_j`
#[inline]
fn combine<const N: usize>(x: &[f64; N], h: f64, weights: &[f64], k: &[[f64; N]]) -> [f64; N] {
    let mut sum = [0.0; N];
    for (w, k) in weights.iter().zip(k) {
        for i in 0..N {
            sum[i] += w * k[i];
        }
    }
    std::array::from_fn(|i| x[i] + h * sum[i])
}

impl<const N: usize, const S: usize> OneStep<N> for Tableau<S> {
    type Trial = Trial<N, S>;
    type Work = ();

    #[inline]
    fn pace(&self) -> Pace {
        self.pace
    }

    #[inline]
    fn step<O: Ode<N>>(
        &self,
        call: &mut Call<'_, N, O, ()>,
        from: &Start<N>,
        h: f64,
    ) -> Result<Trial<N, S>, StepError<O::Error>> {
        let mut k = [[0.0; N]; S];
        let mut x = from.x;
        k[0] = from.slope;
        for i in 1..S {
            x = combine(&from.x, h, &self.a[i][..i], &k[..i]);
            k[i] = call.rhs(from.t + self.c[i] * h, &x)?;
        }
        if !self.first_same_as_last {
            x = combine(&from.x, h, &self.b, &k);
        }
        Ok(Trial { x, k })
    }

    #[inline]
    fn state(trial: &Trial<N, S>) -> &[f64; N] {
        &trial.x
    }

    #[inline]
    fn slope<'a>(&self, trial: &'a Trial<N, S>) -> Option<&'a [f64; N]> {
        self.first_same_as_last.then(|| &trial.k[S - 1])
    }

    #[inline]
    fn error<O: Ode<N>>(
        &self,
        call: &mut Call<'_, N, O, ()>,
        from: &Start<N>,
        trial: &Trial<N, S>,
        h: f64,
        _fresh: bool,
    ) -> Estimate<N> {
        let parts = combine(&[0.0; N], h, &self.error, &trial.k);
        Estimate { size: call.norm.of(&parts, &from.x, &trial.x), parts }
    }

    #[inline]
    fn dense<O: Ode<N>>(
        &self,
        _call: &mut Call<'_, N, O, ()>,
        from: &Start<N>,
        trial: &mut Trial<N, S>,
        h: f64,
    ) -> Result<Dense<N>, StepError<O::Error>> {
        let coefficients: [[f64; N]; POWERS] = std::array::from_fn(|p| {
            let weights: [f64; S] = std::array::from_fn(|i| self.dense[i][p]);
            combine(&[0.0; N], h, &weights, &trial.k)
        });
        Ok(Dense::new(from, h, trial.x, &coefficients))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{dopri5::DOPRI5, heun::HEUN, rk4::RK4};

    /// Rounding of sums of up to seven terms of size up to 12 (the largest entry of Dopri5).
    const ROUNDING: f64 = 7.0 * 12.0 * f64::EPSILON;

    fn rows_sum_to_c<const S: usize>(m: &Tableau<S>) {
        for (row, c) in m.a.iter().zip(m.c) {
            assert!((row.iter().sum::<f64>() - c).abs() < ROUNDING);
        }
    }

    /// Quadrature conditions: `sum b_i c_i^q = 1/(q+1)` for q < order, and none by accident beyond.
    fn integrates_powers_of_time<const S: usize>(m: &Tableau<S>) {
        for q in 0..=m.order {
            let sum: f64 = m.b.iter().zip(m.c).map(|(b, c)| b * c.powi(q.cast_signed())).sum();
            let defect = (sum - 1.0 / f64::from(q + 1)).abs();
            assert_eq!(defect < ROUNDING, q < m.order, "q = {q}: {defect:e}");
        }
    }

    /// The same inside the step: `sum b_i(theta) c_i^q = theta^(q+1)/(q+1)` for q < order of the extension, and
    /// `b_i(1) = b_i`.
    fn extension_integrates_powers_of_time<const S: usize>(m: &Tableau<S>, order: i32) {
        let weight =
            |i: usize, theta: f64| -> f64 { m.dense[i].iter().rev().fold(0.0, |sum, d| (sum + d) * theta) };
        for i in 0..S {
            assert!((weight(i, 1.0) - m.b[i]).abs() < ROUNDING);
        }
        for theta in [0.1, 0.5, 0.9] {
            for q in 0..order {
                let sum: f64 = (0..S).map(|i| weight(i, theta) * m.c[i].powi(q)).sum();
                assert!((sum - theta.powi(q + 1) / f64::from(q + 1)).abs() < ROUNDING, "q = {q}");
            }
        }
    }

    #[test]
    fn tables_satisfy_the_order_conditions_of_quadrature() {
        rows_sum_to_c(&HEUN);
        rows_sum_to_c(&RK4);
        rows_sum_to_c(&DOPRI5);
        integrates_powers_of_time(&HEUN);
        integrates_powers_of_time(&RK4);
        integrates_powers_of_time(&DOPRI5);
        extension_integrates_powers_of_time(&HEUN, 2);
        extension_integrates_powers_of_time(&RK4, 3);
        extension_integrates_powers_of_time(&DOPRI5, 4);
    }

    #[test]
    fn embedded_weights_of_dopri5_have_order_4() {
        for q in 0..4 {
            let sum: f64 = DOPRI5.error.iter().zip(DOPRI5.c).map(|(e, c)| e * c.powi(q)).sum();
            assert!(sum.abs() < ROUNDING);
        }
    }

    #[test]
    #[allow(clippy::float_cmp, reason = "the two rows are the same constants")]
    fn last_row_of_dopri5_is_its_weights() {
        assert_eq!(DOPRI5.a[6], DOPRI5.b);
    }
}
