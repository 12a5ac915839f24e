//! Stiff problems with published or closed solutions; the work-precision table uses them too.
#![allow(dead_code, reason = "each user takes its part")]

use integrators::{Jacobian, Ode};
use std::convert::Infallible;

/// Van der Pol's oscillator, `x'' = ((1 - x^2) x' - x) / eps`.
#[derive(Clone, Copy)]
pub(crate) struct VanDerPol {
    pub(crate) eps: f64,
}

impl VanDerPol {
    pub(crate) const START: [f64; 2] = [2.0, 0.0];
    pub(crate) const T_END: f64 = 2.0;
    /// Solution at `T_END` for `eps = 1e-6`: F. Mazzia, C. Magherini, Test Set for IVP Solvers (Bari 2008), VDPOL.
    pub(crate) const PUBLISHED: [f64; 2] = [1.706_167_732_170_483, -0.892_809_701_024_797_5];
    /// The same for `eps = 1e-3`: SciPy's DOP853 and Radau at 3e-14 agree in these digits.
    pub(crate) const MILD: [f64; 2] = [1.763_234_540_203_4, -0.835_688_681_677_67];
}

impl Ode<2> for VanDerPol {
    type Error = Infallible;
    #[inline]
    fn rhs(&self, _t: f64, x: &[f64; 2]) -> Result<[f64; 2], Infallible> {
        let [x, v] = *x;
        Ok([v, ((1.0 - x * x) * v - x) / self.eps])
    }
    #[inline]
    fn jacobian(&self, _t: f64, x: &[f64; 2], _f: &[f64; 2]) -> Result<Jacobian<2>, Infallible> {
        let [x, v] = *x;
        let row = [(-2.0 * x * v - 1.0) / self.eps, (1.0 - x * x) / self.eps];
        Ok(([[0.0, 1.0], row], [0.0; 2]))
    }
}

/// Three chemical reactions of Robertson (1966), from `(1, 0, 0)`.
pub(crate) struct Robertson;

impl Robertson {
    /// Solution at `t = 40`: A. C. Hindmarsh, LSODE (1980), four digits.
    pub(crate) const AT_40: [f64; 3] = [0.7158, 9.185e-6, 0.2842];
    /// Solution at `t = 1e11`: F. Mazzia, C. Magherini, Test Set for IVP Solvers (Bari 2008), ROBER.
    pub(crate) const AT_1E11: [f64; 3] =
        [2.083_340_149_701_255e-8, 8.333_360_770_334_713e-14, 0.999_999_979_166_505];
    pub(crate) const START: [f64; 3] = [1.0, 0.0, 0.0];
}

impl Ode<3> for Robertson {
    type Error = Infallible;
    fn rhs(&self, _t: f64, y: &[f64; 3]) -> Result<[f64; 3], Infallible> {
        let [a, b, c] = *y;
        let [slow, fast, very_fast] = [0.04 * a, 1e4 * b * c, 3e7 * b * b];
        Ok([-slow + fast, slow - fast - very_fast, very_fast])
    }
    fn jacobian(&self, _t: f64, y: &[f64; 3], _f: &[f64; 3]) -> Result<Jacobian<3>, Infallible> {
        let [_, b, c] = *y;
        let rows = [[-0.04, 1e4 * c, 1e4 * b], [0.04, -1e4 * c - 6e7 * b, -1e4 * b], [0.0, 6e7 * b, 0.0]];
        Ok((rows, [0.0; 3]))
    }
    fn nominal(&self) -> [f64; 3] {
        [1.0, 1e-4, 1.0]
    }
}

/// Kaps' problem, `y_1' = -(1/eps + 2) y_1 + y_2^2 / eps`, `y_2' = y_1 - y_2 - y_2^2`, solution `(e^(-2t), e^(-t))` for
/// every `eps` (Dekker & Verwer 1984).
pub(crate) struct Kaps {
    pub(crate) eps: f64,
}

impl Kaps {
    pub(crate) fn exact(t: f64) -> [f64; 2] {
        [(-2.0 * t).exp(), (-t).exp()]
    }
}

impl Ode<2> for Kaps {
    type Error = Infallible;
    fn rhs(&self, _t: f64, y: &[f64; 2]) -> Result<[f64; 2], Infallible> {
        let [y_1, y_2] = *y;
        Ok([-2.0 * y_1 - (y_1 - y_2 * y_2) / self.eps, y_1 - y_2 - y_2 * y_2])
    }
    fn jacobian(&self, _t: f64, y: &[f64; 2], _f: &[f64; 2]) -> Result<Jacobian<2>, Infallible> {
        let rows = [[-2.0 - 1.0 / self.eps, 2.0 * y[1] / self.eps], [1.0, -1.0 - 2.0 * y[1]]];
        Ok((rows, [0.0; 2]))
    }
}

/// Pinned beam under its weight, ten points, bending `w` and speed `v`: 20 states, damping proportional to stiffness.
///
/// ```text
/// w'' = -a^2 B w - a^2 tau B w' - g,   B = D^2,   D w = (w_(i-1) - 2 w_i + w_(i+1)) / dx^2,   dx = L/11
/// ```
/// The modes are `sin(i k pi/11)`, the eigenvalues of `D` are `-4/dx^2 sin^2(k pi/22)`: closed form.
pub(crate) struct Beam;

pub(crate) const POINTS: usize = 10;

impl Beam {
    /// `EI / (rho A)` [m^4/s^2]
    const STIFFNESS: f64 = 100.0;
    /// Relaxation time [s]: the fastest mode is overdamped, eigenvalue -2.1e4 1/s, the slowest decays with 4.7 1/s.
    const TAU: f64 = 1e-3;
    const GRAVITY: f64 = 9.81;
    pub(crate) const T_END: f64 = 1.0;

    /// Pulled by 10 mm at the fourth point.
    pub(crate) fn start() -> [f64; 2 * POINTS] {
        let mut x = [0.0; 2 * POINTS];
        x[3] = 0.01;
        x
    }

    fn second_difference(w: &[f64; POINTS]) -> [f64; POINTS] {
        std::array::from_fn(|i| {
            let left = if i > 0 { w[i - 1] } else { 0.0 };
            let right = if i + 1 < POINTS { w[i + 1] } else { 0.0 };
            (left - 2.0 * w[i] + right) * 121.0
        })
    }

    /// Each mode `q'' + a^2 mu^2 (tau q' + q) = p` by its two eigenvalues.
    pub(crate) fn exact(t: f64) -> [f64; 2 * POINTS] {
        let start = Self::start();
        let index = |i: usize| f64::from(u8::try_from(i).expect("few points"));
        let shape = |i: usize, k: usize| (index(i + 1) * index(k) * std::f64::consts::PI / 11.0).sin();
        let mut x = [0.0; 2 * POINTS];
        for k in 1..=POINTS {
            let project = |value: &dyn Fn(usize) -> f64| -> f64 {
                (0..POINTS).map(|i| value(i) * shape(i, k) * 2.0 / 11.0).sum()
            };
            let mu = 484.0 * (index(k) * std::f64::consts::PI / 22.0).sin().powi(2);
            let square = Self::STIFFNESS * mu * mu;
            let rest = project(&|_| -Self::GRAVITY) / square;
            let q = project(&|i| start[i]) - rest;
            let decay = 0.5 * square * Self::TAU;
            let root = decay * decay - square;
            let w = root.abs().sqrt();
            // q e^(-d t) (C + d S), its rate -q omega^2 e^(-d t) S; cosh and sinh with the decay drawn in
            let (cosine, sine) = if root > 0.0 {
                let [slow, fast] = [((w - decay) * t).exp(), (-(w + decay) * t).exp()];
                (0.5 * (slow + fast), 0.5 * (slow - fast) / w)
            } else {
                let decayed = (-decay * t).exp();
                (decayed * (w * t).cos(), decayed * (w * t).sin() / w)
            };
            let (now, rate) = (rest + q * (cosine + decay * sine), -q * square * sine);
            for i in 0..POINTS {
                x[i] += now * shape(i, k);
                x[POINTS + i] += rate * shape(i, k);
            }
        }
        x
    }
}

impl Ode<{ 2 * POINTS }> for Beam {
    type Error = Infallible;
    #[inline]
    fn rhs(&self, _t: f64, x: &[f64; 2 * POINTS]) -> Result<[f64; 2 * POINTS], Infallible> {
        let strained = std::array::from_fn(|i| x[i] + Self::TAU * x[POINTS + i]);
        let bent = Self::second_difference(&Self::second_difference(&strained));
        Ok(std::array::from_fn(|i| {
            if i < POINTS { x[POINTS + i] } else { -Self::STIFFNESS * bent[i - POINTS] - Self::GRAVITY }
        }))
    }
    fn jacobian(
        &self,
        t: f64,
        _x: &[f64; 2 * POINTS],
        _f: &[f64; 2 * POINTS],
    ) -> Result<Jacobian<{ 2 * POINTS }>, Infallible> {
        let weight = self.rhs(t, &[0.0; 2 * POINTS])?;
        let mut rows = [[0.0; 2 * POINTS]; 2 * POINTS];
        for j in 0..2 * POINTS {
            let mut unit = [0.0; 2 * POINTS];
            unit[j] = 1.0;
            let column = self.rhs(t, &unit)?;
            for i in 0..2 * POINTS {
                rows[i][j] = column[i] - weight[i];
            }
        }
        Ok((rows, [0.0; 2 * POINTS]))
    }
    fn nominal(&self) -> [f64; 2 * POINTS] {
        std::array::from_fn(|i| if i < POINTS { 1e-3 } else { 1.0 })
    }
    fn linear(&self) -> bool {
        true
    }
}
