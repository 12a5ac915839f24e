//! The numbers of Radau5 and the linear systems of its Newton iteration.

use crate::Complex;
use crate::lu::Lu;

pub(crate) type Square = [[f64; 3]; 3];

pub(super) const SQRT_6: f64 = 2.449_489_742_783_178;
pub(crate) const A: Square = [
    [(88.0 - 7.0 * SQRT_6) / 360.0, (296.0 - 169.0 * SQRT_6) / 1800.0, (-2.0 + 3.0 * SQRT_6) / 225.0],
    [(296.0 + 169.0 * SQRT_6) / 1800.0, (88.0 + 7.0 * SQRT_6) / 360.0, (-2.0 - 3.0 * SQRT_6) / 225.0],
    [(16.0 - SQRT_6) / 36.0, (16.0 + SQRT_6) / 36.0, 1.0 / 9.0],
];
pub(crate) const C: [f64; 3] = [(4.0 - SQRT_6) / 10.0, (4.0 + SQRT_6) / 10.0, 1.0];
/// Weights of the error estimate: `gamma_0 (b - embedded)` on the stages `z`, `gamma_0 = 1/gamma`, times `gamma`.
pub(crate) const E: [f64; 3] = [-(13.0 + 7.0 * SQRT_6) / 3.0, (-13.0 + 7.0 * SQRT_6) / 3.0, -1.0 / 3.0];

/// Eigenvalues of the inverse of `A`.
pub(crate) const GAMMA: f64 = 3.637_834_252_744_496;
pub(crate) const ALPHA_BETA: Complex = Complex::new(2.681_082_873_627_752_3, 3.050_430_199_247_410_5);
/// Its eigenvectors: real, and real and imaginary part.
pub(crate) const T: Square = [
    [0.091_232_394_870_892_95, -0.141_255_295_020_954_2, -0.030_029_194_105_147_424],
    [0.241_717_932_707_107, 0.204_129_352_293_799_94, 0.382_942_112_757_261_9],
    [0.966_048_182_615_093, 1.0, 0.0],
];
pub(crate) const T_INVERSE: Square = [
    [4.325_579_890_063_155, 0.339_199_251_815_809_84, 0.541_770_539_935_874_9],
    [-4.178_718_591_551_905, -0.327_682_820_761_062_37, 0.476_623_554_500_550_44],
    [-0.502_872_634_945_786_8, 2.571_926_949_855_605, -0.596_039_204_828_224_9],
];
/// `z(theta) = sum_p theta^(p+1) sum_i POWERS_pi z_i` runs through the stages: the collocation polynomial.
pub(crate) const POWERS: Square = powers_of_theta();

/// Inverse of the matrix with the rows `(c_i, c_i^2, c_i^3)`, by Lagrange's polynomials with the node 0.
const fn powers_of_theta() -> Square {
    let mut powers = [[0.0; 3]; 3];
    let mut i = 0;
    while i < 3 {
        let [p, q] = [C[(i + 1) % 3], C[(i + 2) % 3]];
        let scale = 1.0 / (C[i] * (C[i] - p) * (C[i] - q));
        powers[0][i] = scale * p * q;
        powers[1][i] = -scale * (p + q);
        powers[2][i] = scale;
        i += 1;
    }
    powers
}

/// Three vectors, one for each stage.
pub(super) type Stages<const N: usize> = [[f64; N]; 3];

/// `m v`
#[inline]
pub(super) fn times<const N: usize>(m: &Square, v: &Stages<N>) -> Stages<N> {
    m.map(|[a, b, c]| std::array::from_fn(|n| a * v[0][n] + b * v[1][n] + c * v[2][n]))
}

/// The decomposed matrices of one step size.
pub(super) struct Matrices<const N: usize> {
    pub(super) h: f64,
    real: Lu<f64, N>,
    complex: Lu<Complex, N>,
}

impl<const N: usize> Matrices<N> {
    #[inline]
    pub(super) fn new(jacobian: &[[f64; N]; N], h: f64) -> Option<Self> {
        let mut real = jacobian.map(|row| row.map(|j| -j));
        let mut complex = real.map(|row| row.map(|j| Complex::new(j, 0.0)));
        for i in 0..N {
            real[i][i] += GAMMA / h;
            complex[i][i] = complex[i][i] + (1.0 / h) * ALPHA_BETA;
        }
        Some(Self { h, real: Lu::new(&real)?, complex: Lu::new(&complex)? })
    }

    /// Increment of `w` in one iteration.
    #[inline]
    pub(super) fn increment(&self, f: &Stages<N>, w: &Stages<N>) -> Stages<N> {
        let g = times(&T_INVERSE, f);
        let per_h = 1.0 / self.h;
        let first = self.real.solve(&std::array::from_fn(|n| g[0][n] - GAMMA * per_h * w[0][n]));
        let others = self.complex.solve(&std::array::from_fn(|n| {
            Complex::new(g[1][n], g[2][n]) - per_h * (ALPHA_BETA * Complex::new(w[1][n], w[2][n]))
        }));
        [first, others.map(|z| z.re), others.map(|z| z.im)]
    }

    /// Estimate of the local error from the slope at its start, or at the start moved by a first estimate.
    #[inline]
    pub(super) fn error(&self, slope: &[f64; N], z: &Stages<N>) -> [f64; N] {
        let per_h = 1.0 / self.h;
        self.real.solve(&std::array::from_fn(|n| {
            slope[n] + per_h * (E[0] * z[0][n] + E[1] * z[1][n] + E[2] * z[2][n])
        }))
    }
}
