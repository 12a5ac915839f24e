//! Exact steps under moving inputs and a harmonic drive: closed forms, and the adaptive method of order 8.
#![allow(missing_docs, non_snake_case, reason = "a test; symbols of the equations")]
#![allow(clippy::unwrap_used, clippy::float_cmp, reason = "a test; values that nothing has touched")]

use std::convert::Infallible;

use integrators::{
    Jacobian, LinearForm, LinearSteps, MAX_EVALUATIONS, Method, Ode, Settings, Solver, Statistics, StepError,
};
use proptest::prelude::*;

/// `m s'' + c s' + k s = sum_l p_l t^l + F sin(omega t + phase)`, and the heat `int c s'^2`.
#[derive(Clone, Copy, Debug)]
struct Mass {
    m: f64,
    c: f64,
    k: f64,
    p: [f64; 6],
    F: f64,
    omega: f64,
    phase: f64,
    /// The mass grows by this [kg/s]
    growth: f64,
}

const REST: Mass = Mass { m: 2.0, c: 0.0, k: 8.0, p: [0.0; 6], F: 0.0, omega: 0.0, phase: 0.0, growth: 0.0 };

impl Ode<3> for Mass {
    type Error = Infallible;
    fn rhs(&self, t: f64, x: &[f64; 3]) -> Result<[f64; 3], Infallible> {
        let Self { m, c, k, p, F, omega, phase, growth } = *self;
        let push = p.iter().rev().fold(0.0, |sum, p| sum * t + p) + F * (omega * t + phase).sin();
        Ok([x[1], (push - c * x[1] - k * x[0]) / (m + growth * t), c * x[1] * x[1]])
    }
    fn jacobian(&self, t: f64, x: &[f64; 3], _f: &[f64; 3]) -> Result<Jacobian<3>, Infallible> {
        let Self { m, c, k, growth, .. } = *self;
        let m = m + growth * t;
        Ok(([[0.0, 1.0, 0.0], [-k / m, -c / m, 0.0], [0.0, 2.0 * c * x[1], 0.0]], [0.0; 3]))
    }
}

impl Mass {
    fn form(&self) -> LinearForm<3> {
        LinearForm {
            states: 2,
            amplitude: [0.0, self.F / self.m, 0.0],
            omega: self.omega,
            phase: self.phase,
            steady: self.growth == 0.0 && self.p[1..].iter().all(|p| *p == 0.0),
        }
    }
}

/// Steps of at most `step`.
fn steps_of(step: f64) -> Settings {
    Settings { method: Method::Exact, step, rtol: 1e-6, atol: 1e-9 }
}

/// State after one call over `interval` in steps of at most `step`.
fn exact(mass: &Mass, interval: f64, step: f64, mut x: [f64; 3]) -> ([f64; 3], Statistics) {
    let mut statistics = Statistics::default();
    LinearSteps::default()
        .advance(mass, &mass.form(), (0.0, interval), &steps_of(step), &mut x, &mut statistics)
        .unwrap();
    (x, statistics)
}

#[track_caller]
fn near(a: f64, b: f64, tolerance: f64) {
    assert!((a - b).abs() <= tolerance, "{a} and {b} differ by {:e}", a - b);
}

#[test]
fn a_free_oscillator_is_exact_over_any_step() {
    for (interval, step) in [(0.01, 0.01), (1.0, 1.0), (50.0, 50.0), (50.0, 1e-3)] {
        let ([s, v, _], statistics) = exact(&REST, interval, step, [1.0, 0.0, 0.0]);
        let phase = 2.0 * interval;
        // the rounding of the matrix comes back in every part
        #[allow(clippy::cast_precision_loss, reason = "small")]
        let tolerance = f64::EPSILON * (10.0 + statistics.steps as f64);
        near(s, phase.cos(), tolerance);
        near(v, -2.0 * phase.sin(), 2.0 * tolerance);
    }
}

/// s = (sin wt - w t cos wt) / (2 w^2) F/m
#[test]
fn resonance_without_damping_grows_as_it_should() {
    let mass = Mass { F: 3.0, omega: 2.0, ..REST };
    for t in [0.3, 5.0, 40.0] {
        let ([s, v, _], _) = exact(&mass, t, t, [0.0; 3]);
        let (sin, cos) = (2.0 * t).sin_cos();
        near(s, 1.5 * (sin - 2.0 * t * cos) / 8.0, 1e-13 * (1.0 + t));
        near(v, 1.5 * t * sin / 2.0, 1e-13 * (1.0 + t));
    }
}

/// Critical damping: s = (1 + w t) e^-wt; the heat is the energy that is gone.
#[test]
fn critical_damping_turns_energy_into_heat() {
    let mass = Mass { c: 8.0, ..REST };
    let ([s, v, heat], _) = exact(&mass, 1.5, 0.1, [1.0, 0.0, 0.0]);
    let decay = (-3.0_f64).exp();
    near(s, 4.0 * decay, 1e-14);
    near(v, -6.0 * decay, 1e-14);
    near(heat, 4.0 - 4.0 * s * s - v * v, 1e-13);
}

#[test]
fn stiffness_of_a_billion_stays_exact_within_rounding() {
    let mass = Mass { k: 2e9, ..REST };
    let omega = 1e9_f64.sqrt();
    let ([s, _, _], statistics) = exact(&mass, 0.01, 1e-3, [1.0, 0.0, 0.0]);
    near(s, (omega * 0.01).cos(), 1e-11);
    assert!(statistics.steps >= 316, "one part turns by one radian at most: {}", statistics.steps);
}

#[test]
fn a_matrix_that_moves_is_refused() {
    let mass = Mass { growth: 0.1, ..REST };
    let (mut x, mut statistics) = ([1.0, 0.0, 0.0], Statistics::default());
    let result = LinearSteps::default().advance(
        &mass,
        &mass.form(),
        (0.0, 1.0),
        &steps_of(0.1),
        &mut x,
        &mut statistics,
    );
    assert!(matches!(result, Err(StepError::NotLinear { .. })));
    assert_eq!((x, statistics), ([1.0, 0.0, 0.0], Statistics::default()));
}

#[test]
fn too_many_parts_are_refused_before_they_begin() {
    let mass = Mass { c: 1e12, ..REST };
    let (mut x, mut statistics) = ([1.0, 0.0, 0.0], Statistics::default());
    let result = LinearSteps::default().advance(
        &mass,
        &mass.form(),
        (0.0, 1.0),
        &steps_of(0.1),
        &mut x,
        &mut statistics,
    );
    assert!(matches!(result, Err(StepError::TooMuchWork { .. })), "{MAX_EVALUATIONS}");
    assert_eq!(x, [1.0, 0.0, 0.0]);
}

#[test]
fn kept_matrices_change_nothing() {
    let mass = Mass { c: 1.0, F: 1.0, omega: 3.0, p: [0.5, 1.0, 0.0, 0.0, 0.0, 0.2], ..REST };
    let (mut kept, mut fresh) = ([1.0, 0.0, 0.0], [1.0, 0.0, 0.0]);
    let (mut steps, mut counted) = (LinearSteps::default(), Statistics::default());
    for (t, interval) in [(0.0, 0.1), (0.1, 0.1), (0.2, 0.03), (0.23, 0.1)] {
        steps.advance(&mass, &mass.form(), (t, interval), &steps_of(0.05), &mut kept, &mut counted).unwrap();
        LinearSteps::default()
            .advance(&mass, &mass.form(), (t, interval), &steps_of(0.05), &mut fresh, &mut counted)
            .unwrap();
    }
    assert_eq!(kept.map(f64::to_bits), fresh.map(f64::to_bits));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn moving_inputs_agree_with_the_method_of_order_8(
        c in 0.0..20.0_f64, k in 0.0..100.0_f64, p in prop::array::uniform6(-2.0..2.0_f64),
        F in -3.0..3.0_f64, omega in 0.0..10.0_f64, phase in -3.0..3.0_f64, step in 0.05..1.0_f64,
    ) {
        let mass = Mass { c, k, p, F, omega, phase, ..REST };
        let start = [0.3, -0.2, 0.1];
        let (found, _) = exact(&mass, 1.0, step, start);
        let settings = Settings { method: Method::Dop853, step: 1.0, rtol: 1e-13, atol: 1e-14 };
        let (mut x, mut statistics) = (start, Statistics::default());
        Solver::new(settings).unwrap().advance(&mass, 0.0, 1.0, &mut x, &mut statistics).unwrap();
        for n in 0..3 {
            // Gauss on a square that turns by two radians: (6!)^4 / (13 (12!)^3) 2^12 = 8e-13 of a power of some tens of W
            let tolerance = if n == 2 { 5e-11 } else { 2e-12 };
            prop_assert!((found[n] - x[n]).abs() < tolerance * (1.0 + x[n].abs()), "{n}: {} {}", found[n], x[n]);
        }
    }
}
