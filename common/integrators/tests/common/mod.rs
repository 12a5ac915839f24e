//! Problems with known solutions, and a ruler for orders.
#![allow(dead_code, reason = "each test file uses its part")]

pub(crate) mod events;
pub(crate) mod stiff;

use integrators::{Jacobian, Memory, Method, Ode, Settings, Solver, Statistics};
use std::convert::Infallible;

/// Methods for any system.
pub(crate) const GENERAL: [Method; 6] =
    [Method::Heun, Method::Rk4, Method::Dopri5, Method::Dop853, Method::Rodas4, Method::Radau5];

/// Methods with a bounded stability region.
pub(crate) const EXPLICIT: [Method; 4] = [Method::Heun, Method::Rk4, Method::Dopri5, Method::Dop853];

/// A solver that does each call of length up to `step` in one step: Dopri5 with tolerances that any step meets.
pub(crate) fn fixed(method: Method, step: f64) -> Solver {
    let mut solver = solver(method, step, 1e9);
    solver.restore(Memory { step, ..Memory::default() });
    solver
}

/// A solver with `rtol = atol = tolerance`.
pub(crate) fn solver(method: Method, step: f64, tolerance: f64) -> Solver {
    Solver::new(Settings { method, step, rtol: tolerance, atol: tolerance }).expect("valid settings")
}

/// Runs `x` over `n` calls of equal length.
pub(crate) fn in_calls<const N: usize, O: Ode<N>>(
    solver: &mut Solver,
    ode: &O,
    [t, t_end]: [f64; 2],
    n: u32,
    x: [f64; N],
) -> [f64; N]
where
    O::Error: std::fmt::Debug,
{
    let mut x = x;
    let mut statistics = Statistics::default();
    let time = |i: u32| t + (t_end - t) * f64::from(i) / f64::from(n);
    for i in 0..n {
        solver.advance(ode, time(i), time(i + 1), &mut x, &mut statistics).expect("smooth problem");
    }
    assert_eq!(statistics.steps, u64::from(n), "one step per call");
    x
}

/// Least-squares slope of `log error` over `log h` for `h`, `h/2`, `h/4`, ...
pub(crate) fn slope(errors: &[f64]) -> f64 {
    let points: Vec<(f64, f64)> =
        errors.iter().zip(0_i32..).map(|(e, i)| (f64::from(-i), e.log2())).collect();
    let n = points.iter().map(|_| 1.0).sum::<f64>();
    let (x, y) = points.iter().fold((0.0, 0.0), |(x, y), p| (x + p.0 / n, y + p.1 / n));
    let (xy, xx) =
        points.iter().fold((0.0, 0.0), |(xy, xx), p| (xy + (p.0 - x) * (p.1 - y), xx + (p.0 - x).powi(2)));
    xy / xx
}

/// The measured order must match the promised one.
#[track_caller]
pub(crate) fn assert_order(errors: &[f64], order: f64) {
    assert_order_within(errors, order, 0.15);
}

/// The same with a tolerance: where rounding leaves room for coarse steps only.
#[track_caller]
pub(crate) fn assert_order_within(errors: &[f64], order: f64, tolerance: f64) {
    let measured = slope(errors);
    eprintln!("order {measured:.3} (promised {order}), errors {errors:?}");
    assert!((measured - order).abs() < tolerance, "order {measured:.3}, errors {errors:?}");
}

pub(crate) fn distance<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

/// `x' = -x^2 cos t`, solution `1 / (2 + sin t)`.
pub(crate) struct Swing;

impl Swing {
    pub(crate) fn exact(t: f64) -> [f64; 1] {
        [1.0 / (2.0 + t.sin())]
    }
}

impl Ode<1> for Swing {
    type Error = Infallible;
    fn rhs(&self, t: f64, x: &[f64; 1]) -> Result<[f64; 1], Infallible> {
        Ok([-x[0] * x[0] * t.cos()])
    }
    fn jacobian(&self, t: f64, x: &[f64; 1], _f: &[f64; 1]) -> Result<Jacobian<1>, Infallible> {
        Ok(([[-2.0 * x[0] * t.cos()]], [x[0] * x[0] * t.sin()]))
    }
}

/// Two-body problem, eccentricity `e`, semi-major axis 1, period 2 pi, from the pericentre.
///
/// `E - e sin E = t`, position `(cos E - e, sqrt(1 - e^2) sin E)`.
pub(crate) struct Kepler {
    pub(crate) e: f64,
}

impl Kepler {
    pub(crate) fn exact(&self, t: f64) -> [f64; 4] {
        let e = self.e;
        let mut anomaly = t;
        for _ in 0..50 {
            anomaly -= (anomaly - e * anomaly.sin() - t) / (1.0 - e * anomaly.cos());
        }
        let (sin, cos) = anomaly.sin_cos();
        let b = (1.0 - e * e).sqrt();
        let rate = 1.0 / (1.0 - e * cos);
        [cos - e, b * sin, -sin * rate, b * cos * rate]
    }
}

impl Ode<4> for Kepler {
    type Error = Infallible;
    fn rhs(&self, _t: f64, x: &[f64; 4]) -> Result<[f64; 4], Infallible> {
        let [q_x, q_y, v_x, v_y] = *x;
        let r_3 = q_x.hypot(q_y).powi(3);
        Ok([v_x, v_y, -q_x / r_3, -q_y / r_3])
    }
    fn jacobian(&self, _t: f64, x: &[f64; 4], _f: &[f64; 4]) -> Result<Jacobian<4>, Infallible> {
        let [q_x, q_y, ..] = *x;
        let r = q_x.hypot(q_y);
        let [r_3, r_5] = [r.powi(3), r.powi(5)];
        let [xx, xy, yy] = [q_x * q_x, q_x * q_y, q_y * q_y].map(|q| 3.0 * q / r_5);
        let rows = [
            [0.0, 0.0, 1.0, 0.0],
            [0.0, 0.0, 0.0, 1.0],
            [xx - 1.0 / r_3, xy, 0.0, 0.0],
            [xy, yy - 1.0 / r_3, 0.0, 0.0],
        ];
        Ok((rows, [0.0; 4]))
    }
}

/// Mathematical pendulum `phi'' = -sin phi`.
pub(crate) struct Pendulum;

impl Pendulum {
    /// A quarter of the period when released at rest from `amplitude`: `pi / (2 agm(1, cos(amplitude/2)))` (Gauss).
    pub(crate) fn quarter_period(amplitude: f64) -> f64 {
        let (mut a, mut b) = (1.0, (0.5 * amplitude).cos());
        for _ in 0..10 {
            (a, b) = (0.5 * (a + b), (a * b).sqrt());
        }
        std::f64::consts::FRAC_PI_2 / a
    }

    pub(crate) fn energy(x: &[f64; 2]) -> f64 {
        0.5 * x[1] * x[1] + 1.0 - x[0].cos()
    }
}

impl Ode<2> for Pendulum {
    type Error = Infallible;
    fn rhs(&self, _t: f64, x: &[f64; 2]) -> Result<[f64; 2], Infallible> {
        let [phi, omega] = *x;
        Ok([omega, -phi.sin()])
    }
    fn jacobian(&self, _t: f64, x: &[f64; 2], _f: &[f64; 2]) -> Result<Jacobian<2>, Infallible> {
        Ok(([[0.0, 1.0], [-x[0].cos(), 0.0]], [0.0; 2]))
    }
}

/// Linear system `x' = A x` with the closed form of its exponential.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Linear {
    pub(crate) a: [[f64; 2]; 2],
}

impl Linear {
    /// `omega^2`-oscillator, undamped.
    pub(crate) const OSCILLATOR: Self = Self { a: [[0.0, 1.0], [-1.0, 0.0]] };

    /// Half trace `s` and discriminant `q` of the eigenvalues `s +- sqrt(q)`.
    pub(crate) fn spectrum(&self) -> (f64, f64) {
        let [[a, b], [c, d]] = self.a;
        (0.5 * (a + d), 0.25 * (a - d).powi(2) + b * c)
    }

    /// `exp(A t) x = e^(s t) (C x + S (A - s) x)` with `C = cosh(sqrt(q) t)`, `S = sinh(sqrt(q) t) / sqrt(q)`.
    pub(crate) fn exact(&self, t: f64, x: &[f64; 2]) -> [f64; 2] {
        let (s, q) = self.spectrum();
        let w = q.abs().sqrt();
        let (cosh, sinh) = if w * t < 1e-8 {
            (1.0, t)
        } else if q > 0.0 {
            ((w * t).cosh(), (w * t).sinh() / w)
        } else {
            ((w * t).cos(), (w * t).sin() / w)
        };
        let [[a, b], [c, d]] = self.a;
        let growth = (s * t).exp();
        [
            growth * (cosh * x[0] + sinh * ((a - s) * x[0] + b * x[1])),
            growth * (cosh * x[1] + sinh * (c * x[0] + (d - s) * x[1])),
        ]
    }
}

impl Ode<2> for Linear {
    type Error = Infallible;
    fn rhs(&self, _t: f64, x: &[f64; 2]) -> Result<[f64; 2], Infallible> {
        let [[a, b], [c, d]] = self.a;
        Ok([a * x[0] + b * x[1], c * x[0] + d * x[1]])
    }
    fn jacobian(&self, _t: f64, _x: &[f64; 2], _f: &[f64; 2]) -> Result<Jacobian<2>, Infallible> {
        Ok((self.a, [0.0; 2]))
    }
    fn linear(&self) -> bool {
        true
    }
}
