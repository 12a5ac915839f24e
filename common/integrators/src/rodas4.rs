//! RODAS4: a Rosenbrock method of order 4 with an embedded one of order 3, for stiff problems.
//!
//! Six linear systems with one matrix per step, no iteration; both methods L-stable and stiffly accurate:
//! ```text
//! (1/(h gamma) I - J) u_i = f(t + alpha_i h, x + sum_j a_ij u_j) + sum_j (c_ij / h) u_j + gamma_i h f_t,   j < i
//! x_new = x + sum_j a_6j u_j + u_6,     error = u_6
//! x(theta) = (1 - theta) x + theta (x_new + (1 - theta) (sum_j h_1j u_j + theta sum_j h_2j u_j))
//! ```
//! Source: Hairer & Wanner II, section IV.7; coefficients of their code RODAS (method 1, `gamma = 1/4`).

use crate::lu::Lu;
use crate::one_step::{Call, Estimate, OneStep, Start};
use crate::pace::Pace;
use crate::stability;
use crate::{Complex, Dense, Jacobian, Ode, StepError};

pub(crate) const STAGES: usize = 6;
pub(crate) const GAMMA: f64 = 0.25;

/// `a_ij`; the last two rows continue as `x + a u + u_5` and `x + a u + u_5 + u_6`.
pub(crate) const A: [[f64; STAGES]; STAGES] = [
    [0.0; STAGES],
    [1.544, 0.0, 0.0, 0.0, 0.0, 0.0],
    [0.946_678_528_081_582_6, 0.255_701_169_898_328_4, 0.0, 0.0, 0.0, 0.0],
    [3.314_825_187_068_521, 2.896_124_015_972_201, 0.998_641_913_997_781_7, 0.0, 0.0, 0.0],
    [1.221_224_509_226_641, 6.019_134_481_288_629, 12.537_083_329_320_87, -0.687_886_036_105_895, 0.0, 0.0],
    [1.221_224_509_226_641, 6.019_134_481_288_629, 12.537_083_329_320_87, -0.687_886_036_105_895, 1.0, 0.0],
];

/// `c_ij`
pub(crate) const C: [[f64; STAGES]; STAGES] = [
    [0.0; STAGES],
    [-5.6688, 0.0, 0.0, 0.0, 0.0, 0.0],
    [-2.430_093_356_833_875, -0.206_359_915_709_191_5, 0.0, 0.0, 0.0, 0.0],
    [-0.107_352_905_815_137_5, -9.594_562_251_023_355, -20.470_286_148_096_16, 0.0, 0.0, 0.0],
    [7.496_443_313_967_647, -10.246_804_314_643_52, -33.999_903_528_199_05, 11.708_908_932_061_6, 0.0, 0.0],
    [
        8.083_246_795_921_522,
        -7.981_132_988_064_893,
        -31.521_594_328_743_71,
        16.319_305_431_231_36,
        -6.058_818_238_834_054,
        0.0,
    ],
];

/// Times of the stages, and the weights of the change of `f` with time.
pub(crate) const ALPHA: [f64; STAGES] = [0.0, 0.386, 0.21, 0.63, 1.0, 1.0];
pub(crate) const GAMMA_I: [f64; STAGES] = [0.25, -0.1043, 0.1035, -0.0362, 0.0, 0.0];

/// Continuous extension.
pub(crate) const H: [[f64; STAGES - 1]; 2] = [
    [
        10.126_235_083_445_86,
        -7.487_995_877_610_167,
        -34.800_918_615_557_47,
        -7.992_771_707_568_823,
        1.025_137_723_295_662,
    ],
    [
        -0.676_280_339_280_125_3,
        6.087_714_651_680_015,
        16.430_843_208_924_78,
        24.767_225_114_183_86,
        -6.594_389_125_716_872,
    ],
];

/// Its control of the step size.
pub(crate) const PACE: Pace = Pace { order: 4.0, beta: 0.0, shrink: 1.0 / 6.0, grow: 5.0, predictive: true };

/// The method.
pub(crate) struct Rodas4;

impl Rodas4 {
    pub(crate) const ORDER: u32 = 4;
    #[allow(clippy::cast_possible_truncation, reason = "6")]
    pub(crate) const EVALUATIONS: u32 = STAGES as u32;

    /// `R(z)` from the table in its first form, `x_new = x + sum_i b_i k_i`,
    /// `k_i = h f(x + sum_j alpha_ij k_j) + h J sum_j gamma_ij k_j`.
    pub(crate) fn stability(z: Complex) -> Complex {
        let (alpha, gamma, b) = first_form();
        let sum = std::array::from_fn(|i| std::array::from_fn(|j| alpha[i][j] + gamma[i][j]));
        stability::implicit(&sum, &b, z)
    }
}

type Square = [[f64; STAGES]; STAGES];

/// `alpha_ij`, `gamma_ij` and `b_i` from `u = Gamma k`: `Gamma^(-1) = I/gamma - C`, `alpha = A Gamma`, `b = m Gamma`.
fn first_form() -> (Square, Square, [f64; STAGES]) {
    let mut gamma = [[0.0; STAGES]; STAGES];
    for i in 0..STAGES {
        gamma[i][i] = GAMMA;
        for j in 0..i {
            let sum: f64 = (j..i).map(|l| C[i][l] * gamma[l][j]).sum();
            gamma[i][j] = GAMMA * sum;
        }
    }
    let times_gamma = |row: &[f64; STAGES]| -> [f64; STAGES] {
        std::array::from_fn(|j| (0..STAGES).map(|l| row[l] * gamma[l][j]).sum())
    };
    let mut m = A[STAGES - 1];
    m[STAGES - 1] = 1.0;
    (A.map(|row| times_gamma(&row)), gamma, times_gamma(&m))
}

/// What the trials of a step share.
pub(crate) struct Work<const N: usize> {
    jacobian: Jacobian<N>,
}

impl<const N: usize> Default for Work<N> {
    fn default() -> Self {
        Self { jacobian: ([[0.0; N]; N], [0.0; N]) }
    }
}

/// New state and stages of one step.
pub(crate) struct Trial<const N: usize> {
    x: [f64; N],
    u: [[f64; N]; STAGES],
}

/// `sum_j weights_j u_j`
#[inline]
fn combine<const N: usize>(weights: &[f64], u: &[[f64; N]]) -> [f64; N] {
    let mut sum = [0.0; N];
    for (w, u) in weights.iter().zip(u) {
        for (sum, u) in sum.iter_mut().zip(u) {
            *sum += w * u;
        }
    }
    sum
}

impl<const N: usize> OneStep<N> for Rodas4 {
    type Trial = Trial<N>;
    type Work = Work<N>;

    fn pace(&self) -> Pace {
        PACE
    }

    #[inline]
    fn begin<O: Ode<N>>(
        &self,
        call: &mut Call<'_, N, O, Work<N>>,
        from: &Start<N>,
    ) -> Result<(), StepError<O::Error>> {
        call.work.jacobian = call.jacobian(from)?;
        Ok(())
    }

    #[inline]
    fn step<O: Ode<N>>(
        &self,
        call: &mut Call<'_, N, O, Work<N>>,
        from: &Start<N>,
        h: f64,
    ) -> Result<Trial<N>, StepError<O::Error>> {
        let Start { t, x, slope } = from;
        let (jacobian, f_t) = &call.work.jacobian;
        let f_t = *f_t;
        let mut matrix = jacobian.map(|row| row.map(|j| -j));
        for (i, row) in matrix.iter_mut().enumerate() {
            row[i] += 1.0 / (GAMMA * h);
        }
        call.statistics.decompositions += 1;
        let lu = Lu::new(&matrix).ok_or(StepError::NoSolution { t: *t, h })?;
        let mut u = [[0.0; N]; STAGES];
        let mut stage = *x;
        for i in 0..STAGES {
            let f = if i == 0 {
                *slope
            } else {
                let by = combine(&A[i][..i], &u[..i]);
                stage = std::array::from_fn(|n| x[n] + by[n]);
                call.rhs(t + ALPHA[i] * h, &stage)?
            };
            let coupling = combine(&C[i][..i], &u[..i]);
            u[i] = lu.solve(&std::array::from_fn(|n| f[n] + coupling[n] / h + GAMMA_I[i] * h * f_t[n]));
        }
        let x = std::array::from_fn(|n| stage[n] + u[STAGES - 1][n]);
        Ok(Trial { x, u })
    }

    fn state(trial: &Trial<N>) -> &[f64; N] {
        &trial.x
    }

    fn slope<'a>(&self, _trial: &'a Trial<N>) -> Option<&'a [f64; N]> {
        None
    }

    #[inline]
    fn error<O: Ode<N>>(
        &self,
        call: &mut Call<'_, N, O, Work<N>>,
        from: &Start<N>,
        trial: &Trial<N>,
        _h: f64,
        _fresh: bool,
    ) -> Estimate<N> {
        let parts = trial.u[STAGES - 1];
        Estimate { size: call.norm.of(&parts, &from.x, &trial.x), parts }
    }

    fn dense<O: Ode<N>>(
        &self,
        _call: &mut Call<'_, N, O, Work<N>>,
        from: &Start<N>,
        trial: &mut Trial<N>,
        h: f64,
    ) -> Result<Dense<N>, StepError<O::Error>> {
        let [bow, skew] = H.map(|row| combine(&row, &trial.u[..STAGES - 1]));
        let coefficients = [
            std::array::from_fn(|n| trial.x[n] - from.x[n] + bow[n]),
            std::array::from_fn(|n| skew[n] - bow[n]),
            skew.map(|s| -s),
        ];
        Ok(Dense::new(from, h, trial.x, &coefficients))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounding of coefficients printed to 16 digits, of size up to 34, in sums of up to six.
    const ROUNDING: f64 = 6.0 * 34.0 * 6.0 * f64::EPSILON;

    type Vector = [f64; STAGES];

    fn times(m: &Square, v: &Vector) -> Vector {
        m.map(|row| dot(&row, v))
    }

    fn dot(u: &Vector, v: &Vector) -> f64 {
        u.iter().zip(v).map(|(u, v)| u * v).sum()
    }

    /// The printed times are the row sums of `alpha_ij`, the printed `gamma_i` those of `gamma_ij`.
    #[test]
    fn rows_sum_to_the_printed_times() {
        let (alpha, gamma, _) = first_form();
        for i in 0..STAGES {
            assert!((alpha[i].iter().sum::<f64>() - ALPHA[i]).abs() < ROUNDING, "alpha, {i}");
            assert!((gamma[i].iter().sum::<f64>() - GAMMA_I[i]).abs() < ROUNDING, "gamma, {i}");
        }
    }

    /// Defects of the eight conditions of order 4 (Hairer & Wanner II, table IV.7.1), the first four up to order 3.
    fn defects(b: &Vector) -> [f64; 8] {
        let (alpha, gamma, _) = first_form();
        let beta: Square = std::array::from_fn(|i| std::array::from_fn(|j| alpha[i][j] + gamma[i][j]));
        let one = [1.0; STAGES];
        let beta_1 = times(&beta, &one);
        let square = ALPHA.map(|a| a * a);
        let product = |u: &Vector, v: &Vector| -> Vector { std::array::from_fn(|i| u[i] * v[i]) };
        [
            dot(b, &one) - 1.0,
            dot(b, &beta_1) - 1.0 / 2.0,
            dot(b, &square) - 1.0 / 3.0,
            dot(b, &times(&beta, &beta_1)) - 1.0 / 6.0,
            dot(b, &product(&square, &ALPHA)) - 1.0 / 4.0,
            dot(b, &product(&ALPHA, &times(&alpha, &beta_1))) - 1.0 / 8.0,
            dot(b, &times(&beta, &square)) - 1.0 / 12.0,
            dot(b, &times(&beta, &times(&beta, &beta_1))) - 1.0 / 24.0,
        ]
    }

    #[test]
    fn order_conditions_hold_up_to_4_and_3() {
        let (alpha, gamma, b) = first_form();
        let method = defects(&b);
        assert!(method.iter().all(|d| d.abs() < ROUNDING), "{method:?}");
        // the embedded method is the argument of the last stage
        let embedded = alpha[STAGES - 1];
        let defects = defects(&embedded);
        assert!(defects[..4].iter().all(|d| d.abs() < ROUNDING), "{defects:?}");
        assert!(defects[4..].iter().any(|d| d.abs() > 1e-3), "its order is not 4: {defects:?}");
        // both stiffly accurate: b_i = alpha_6i + gamma_6i, embedded_i = alpha_5i + gamma_5i
        for i in 0..STAGES {
            assert!((b[i] - alpha[5][i] - gamma[5][i]).abs() < ROUNDING);
            assert!((embedded[i] - alpha[4][i] - gamma[4][i]).abs() < ROUNDING);
        }
    }

    /// L-stable: `|R| <= 1` on the imaginary axis, and 0 far out.
    #[test]
    fn is_l_stable() {
        for i in 0..2000 {
            let y = 10.0_f64.powf(f64::from(i) / 250.0 - 2.0);
            let r = Rodas4::stability(Complex::new(0.0, y)).abs();
            assert!(r <= 1.0 + 100.0 * ROUNDING, "{y}: {r}");
        }
        for z in [-1e6, -1e12, -1e99, -1e200] {
            assert!(Rodas4::stability(Complex::new(z, 0.0)).abs() < 10.0 / -z.max(-1e12), "{z}");
        }
    }
}
