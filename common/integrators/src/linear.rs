//! Exact steps of linear systems under moving inputs and a harmonic drive.
//!
//! ```text
//! y' = A y + b(t) + c sin(omega t + phase)      b: polynomial of degree up to 5 in each step
//! y(t + h) = E y + sum_j W_j b(t + c_j h) + H (sin, cos)(omega t + phase)
//! E = e^(A h),   W_j = w_j sum_m (2m + 1) P_m(c_j) int_0^h e^(A (h - s)) P_m(s/h) ds
//! H = upper right of e^(A' h),   A' = [A c 0; 0 0 omega; 0 -omega 0]
//! q' = r(t, y):   q(t + h) = q + h sum_j w_j r(t + c_j h, y(t + c_j h))
//! ```
//! `c_j`, `w_j` are the six nodes and weights of Gauss on [0, 1], `P_m` the Legendre polynomials there: six values of `b`
//! give its polynomial. Integrals `q` of the solution (work, heat) have no influence on it and are summed up along it; a
//! step is divided so that the fastest mode turns by at most one radian in each part, where that sum is right to 1e-12.
//!
//! Sources: Hochbruck & Ostermann, Acta Numerica 19 (2010) (exponential collocation); Van Loan, IEEE Trans. Autom. Control
//! 23 (1978) (integrals from the exponential of a larger matrix).

use std::sync::LazyLock;

use crate::matrix::{Matrix, norm, product, times};
use crate::run::clear_subnormal;
use crate::{MAX_EVALUATIONS, Ode, Settings, Statistics, StepError};

/// Number of nodes: `b` may be a polynomial of one degree less.
const NODES: usize = 6;
/// Gauss on [0, 1].
const NODE: [f64; NODES] = [
    0.033_765_242_898_423_99,
    0.169_395_306_766_867_74,
    0.380_690_406_958_401_55,
    0.619_309_593_041_598_5,
    0.830_604_693_233_132_3,
    0.966_234_757_101_576,
];
const WEIGHT: [f64; NODES] = [
    0.085_662_246_189_585_17,
    0.180_380_786_524_069_3,
    0.233_956_967_286_345_52,
    0.233_956_967_286_345_52,
    0.180_380_786_524_069_3,
    0.085_662_246_189_585_17,
];
/// Coefficients of the Legendre polynomials on [0, 1], by rising powers.
const LEGENDRE: [[f64; NODES]; NODES] = [
    [1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [-1.0, 2.0, 0.0, 0.0, 0.0, 0.0],
    [1.0, -6.0, 6.0, 0.0, 0.0, 0.0],
    [-1.0, 12.0, -30.0, 20.0, 0.0, 0.0],
    [1.0, -20.0, 90.0, -140.0, 70.0, 0.0],
    [-1.0, 30.0, -210.0, 560.0, -630.0, 252.0],
];
/// Terms of the exponential series; the last is below `1/24!` = 2e-24 for modes that turn by one radian.
const TERMS: usize = 24;
/// Evaluations of the right-hand side in one part of a step: forces and integrals at the nodes.
const EVALUATIONS: u64 = 2 * NODES as u64;

/// In which way a right-hand side is linear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearForm<const N: usize> {
    /// Number of linear states; the rates of the others do not depend on the others.
    pub states: usize,
    /// Drive `amplitude sin(omega t + phase)` of each state's rate: the part that is no polynomial in time.
    pub amplitude: [f64; N],
    /// [rad/s]
    pub omega: f64,
    /// At t = 0 [rad]
    pub phase: f64,
    /// `A` is constant for sure and what is left of `b` too, so that one evaluation gives them.
    pub steady: bool,
}

/// The matrices of one point of a step.
#[derive(Clone, Debug)]
struct Point<const N: usize> {
    carry: Matrix<N>,
    weights: [Matrix<N>; NODES],
    /// Sum of the weights
    all: Matrix<N>,
    /// Response to the sine and to the cosine
    turn: [[f64; N]; 2],
}

/// The matrices of one step size: at the nodes and, last, at the end.
///
/// No part of a saved state: what is kept is used only where it is the same to the bit.
#[derive(Clone, Debug)]
pub struct LinearSteps<const N: usize> {
    /// `A`, amplitude and frequency of the drive, and the interval
    key: Option<(Matrix<N>, [f64; N], f64, f64)>,
    parts: u64,
    h: f64,
    points: Vec<Point<N>>,
}

/// Coefficients of the powers of `A h` at each point, the same for all systems.
static SERIES: LazyLock<[[Terms; NODES + 1]; TERMS]> =
    LazyLock::new(|| std::array::from_fn(|k| std::array::from_fn(|point| Terms::new(point, k))));

/// Of one power at one point: exponential, its integral, integrals over the Legendre polynomials of each node.
#[derive(Clone, Copy, Debug)]
struct Terms {
    carry: f64,
    all: f64,
    weights: [f64; NODES],
}

impl Terms {
    fn new(point: usize, k: usize) -> Self {
        let c = NODE.get(point).copied().unwrap_or(1.0);
        let weights = std::array::from_fn(|j| weight(j, c, k));
        Self { carry: inverse_factorial(c, k), all: inverse_factorial(c, k + 1), weights }
    }
}

impl<const N: usize> Default for LinearSteps<N> {
    fn default() -> Self {
        let zero = [[0.0; N]; N];
        LazyLock::force(&SERIES); // not in the first step
        let point = Point { carry: zero, weights: [zero; NODES], all: zero, turn: [[0.0; N]; 2] };
        Self { key: None, parts: 1, h: 0.0, points: vec![point; NODES + 1] }
    }
}

impl<const N: usize> LinearSteps<N> {
    /// Integrates `x` from `t` over `interval` in equal steps, as long as a fixed-step method would take them or shorter.
    ///
    /// # Errors
    /// [`StepError::NotLinear`] where `A` moves inside the interval, [`StepError::TooMuchWork`], values that are not finite,
    /// errors of the right-hand side. Then `x` and the statistics are as before.
    pub fn advance<O: Ode<N>>(
        &mut self,
        ode: &O,
        form: &LinearForm<N>,
        (t, interval): (f64, f64),
        settings: &Settings,
        x: &mut [f64; N],
        statistics: &mut Statistics,
    ) -> Result<(), StepError<O::Error>> {
        let mut counted = *statistics;
        let a = constant_matrix(ode, form, (t, interval), &mut counted)?;
        self.prepare(&a, form, (t, interval), settings)?;
        let mut y = *x;
        for part in 0..self.parts {
            #[allow(clippy::cast_precision_loss, reason = "fewer than MAX_EVALUATIONS")]
            let from = t + part as f64 * self.h;
            y = self.part(ode, form, from, &y, &mut counted)?;
        }
        if let Some(index) = y.iter().position(|y| !y.is_finite()) {
            return Err(StepError::NotFinite { t: t + interval, index, value: y[index] });
        }
        clear_subnormal(&mut y);
        *x = y;
        *statistics = counted;
        Ok(())
    }

    /// One part of the step.
    fn part<O: Ode<N>>(
        &self,
        ode: &O,
        form: &LinearForm<N>,
        t: f64,
        x: &[f64; N],
        counted: &mut Statistics,
    ) -> Result<[f64; N], StepError<O::Error>> {
        let linear = form.states;
        let mut rhs = |t: f64, x: &[f64; N]| {
            counted.rhs_evaluations += 1;
            ode.rhs(t, x).map_err(|source| StepError::Rhs { t, source })
        };
        // the polynomial part of the forces, which the states have no share in
        let mut b = [[0.0; N]; NODES];
        let forced = if form.steady { 1 } else { NODES };
        for j in 0..forced {
            let at = t + NODE[j] * self.h;
            let rate = rhs(at, &[0.0; N])?;
            let sine = (form.omega * at + form.phase).sin();
            for n in 0..linear {
                b[j][n] = rate[n] - form.amplitude[n] * sine;
            }
        }
        let (sin, cos) = (form.omega * t + form.phase).sin_cos();
        let state = |point: &Point<N>| {
            let mut y = *x;
            let carried = times(&point.carry, x);
            y[..linear].copy_from_slice(&carried[..linear]);
            let mut add = |weights: &Matrix<N>, b: &[f64; N]| {
                let pushed = times(weights, b);
                for n in 0..linear {
                    y[n] += pushed[n];
                }
            };
            if forced == 1 {
                add(&point.all, &b[0]);
            } else {
                point.weights.iter().zip(&b).for_each(|(weights, b)| add(weights, b));
            }
            for n in 0..linear {
                y[n] += point.turn[0][n] * sin + point.turn[1][n] * cos;
            }
            y
        };
        let mut y = state(&self.points[NODES]);
        if linear < N {
            for j in 0..NODES {
                let rate = rhs(t + NODE[j] * self.h, &state(&self.points[j]))?;
                for n in linear..N {
                    y[n] += self.h * WEIGHT[j] * rate[n];
                }
            }
        }
        counted.steps += 1;
        Ok(y)
    }

    /// Matrices for this system and interval, made again where anything has changed.
    fn prepare<E>(
        &mut self,
        a: &Matrix<N>,
        form: &LinearForm<N>,
        (t, interval): (f64, f64),
        settings: &Settings,
    ) -> Result<(), StepError<E>> {
        let fastest = spectral_radius(a).max(form.omega.abs());
        let parts = settings.inner_steps(interval).max((fastest * interval).ceil());
        #[allow(clippy::cast_precision_loss, reason = "a bound")]
        let most = (MAX_EVALUATIONS / EVALUATIONS) as f64;
        if parts.is_nan() || parts > most {
            return Err(StepError::TooMuchWork { t, t_end: t + interval, h: interval / parts });
        }
        self.h = interval / parts;
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "whole, checked above")]
        {
            self.parts = parts as u64;
        }
        let key = (*a, form.amplitude, form.omega, self.h);
        if self.key != Some(key) {
            self.key = Some(key);
            self.fill(a, form);
        }
        Ok(())
    }

    fn fill(&mut self, a: &Matrix<N>, form: &LinearForm<N>) {
        let h = self.h;
        // powers of A h, and of the larger matrix its columns of the drive
        let mut power = [[0.0; N]; N];
        (0..N).for_each(|n| power[n][n] = 1.0);
        let scaled = a.map(|row| row.map(|entry| entry * h));
        let push = form.amplitude.map(|c| c * h);
        // (sin, cos)' = omega (cos, -sin): row of the powers of its matrix that the drive sees
        let mut turned = [1.0, 0.0];
        let mut columns = [[0.0; N]; 2];
        for point in &mut self.points {
            *point = Point {
                carry: [[0.0; N]; N],
                weights: [[[0.0; N]; N]; NODES],
                all: [[0.0; N]; N],
                turn: columns,
            };
        }
        for terms in SERIES.iter() {
            for (point, terms) in self.points.iter_mut().zip(terms) {
                add(&mut point.carry, terms.carry, &power);
                for side in 0..2 {
                    (0..N).for_each(|n| point.turn[side][n] += terms.carry * columns[side][n]);
                }
                add(&mut point.all, h * terms.all, &power);
                for (weights, term) in point.weights.iter_mut().zip(terms.weights) {
                    add(weights, h * term, &power);
                }
            }
            // [A c; 0 R]^(k+1) = [A^(k+1), A columns + c row; 0, R^(k+1)]
            for side in 0..2 {
                columns[side] = times(&scaled, &columns[side]);
                (0..N).for_each(|n| columns[side][n] += push[n] * turned[side]);
            }
            turned = [-turned[1] * form.omega * h, turned[0] * form.omega * h];
            power = product(&scaled, &power);
        }
    }
}

/// `A`, if it is the same all over the interval.
fn constant_matrix<const N: usize, O: Ode<N>>(
    ode: &O,
    form: &LinearForm<N>,
    (t, interval): (f64, f64),
    counted: &mut Statistics,
) -> Result<Matrix<N>, StepError<O::Error>> {
    let linear = form.states;
    let mut matrix = |t: f64| {
        counted.jacobians += 1;
        let (mut a, _) =
            ode.jacobian(t, &[0.0; N], &[0.0; N]).map_err(|source| StepError::Rhs { t, source })?;
        for (i, row) in a.iter_mut().enumerate() {
            let kept = if i < linear { linear } else { 0 };
            row[kept..].fill(0.0);
        }
        match a.as_flattened().iter().position(|entry| !entry.is_finite()) {
            Some(i) => Err(StepError::NotFinite { t, index: i / N, value: a.as_flattened()[i] }),
            None => Ok(a),
        }
    };
    let a = matrix(t)?;
    if !form.steady {
        // a polynomial of degree 5 that has one value at seven places is constant
        for c in NODE {
            if matrix(t + c * interval)? != a {
                return Err(StepError::NotLinear { t });
            }
        }
    }
    Ok(a)
}

/// `sum += factor term`
fn add<const N: usize>(sum: &mut Matrix<N>, factor: f64, term: &Matrix<N>) {
    for (sum, term) in sum.as_flattened_mut().iter_mut().zip(term.as_flattened()) {
        *sum += factor * term;
    }
}

/// `c^k / k!`
fn inverse_factorial(c: f64, k: usize) -> f64 {
    #[allow(clippy::cast_precision_loss, reason = "small")]
    (1..=k).fold(1.0, |product, i| product * c / i as f64)
}

/// Coefficient of `h (A h)^k` in the weight of node `j` at the point `c h`.
fn weight(j: usize, c: f64, k: usize) -> f64 {
    let mut sum = 0.0;
    for (m, legendre) in LEGENDRE.iter().enumerate() {
        let value = legendre.iter().rev().fold(0.0, |value, p| value * NODE[j] + p);
        // int_0^c (c - s)^k / k! s^l ds = l! c^(k+l+1) / (k+l+1)!
        let mut integral = 0.0;
        let mut factorial = 1.0;
        for (l, p) in legendre.iter().enumerate() {
            #[allow(clippy::cast_precision_loss, reason = "small")]
            if l > 0 {
                factorial *= l as f64;
            }
            integral += p * factorial * inverse_factorial(c, k + l + 1);
        }
        #[allow(clippy::cast_precision_loss, reason = "small")]
        let degree = m as f64;
        sum += WEIGHT[j] * (2.0 * degree + 1.0) * value * integral;
    }
    sum
}

/// Upper estimate of the largest eigenvalue's magnitude: `|A^32|^(1/32)`.
fn spectral_radius<const N: usize>(a: &Matrix<N>) -> f64 {
    const SQUARINGS: i32 = 5;
    let (mut b, mut log) = (*a, 0.0);
    for _ in 0..SQUARINGS {
        let size = norm(&b);
        if size == 0.0 {
            return 0.0;
        }
        b = b.map(|row| row.map(|entry| entry / size));
        log = 2.0 * (log + size.ln());
        b = product(&b, &b);
    }
    let size = norm(&b);
    if size == 0.0 { 0.0 } else { ((log + size.ln()) / f64::from(1 << SQUARINGS)).exp() }
}
