//! What holds for any system, step and start.

mod common;

use common::{GENERAL, Kepler, Linear, distance, solver};
use integrators::{Complex, Method, Solver, Statistics};
use proptest::prelude::*;

fn advance(solver: &mut Solver, ode: &Linear, t: f64, t_end: f64, x: &mut [f64; 2]) -> Statistics {
    let mut statistics = Statistics::default();
    solver.advance(ode, t, t_end, x, &mut statistics).expect("linear problem");
    statistics
}

fn state() -> impl Strategy<Value = [f64; 2]> {
    prop::array::uniform2(-1.0..1.0)
}

fn linear() -> impl Strategy<Value = Linear> {
    prop::array::uniform2(prop::array::uniform2(-3.0..3.0)).prop_map(|a| Linear { a })
}

proptest! {
    /// Calls that end on the steps of one call give the same, bit by bit (steps and times are binary fractions).
    #[test]
    fn split_calls_equal_one_call(
        ode in linear(), x in state(), first in 1..200_u32, second in 1..200_u32, power in 4..10_i32,
    ) {
        for method in [Method::Heun, Method::Rk4] {
            let h = f64::from(-power).exp2();
            let mut solver = solver(method, h, 1.0);
            let [middle, end] = [f64::from(first) * h, f64::from(first + second) * h];
            let (mut one, mut two) = (x, x);
            let whole = advance(&mut solver, &ode, 0.0, end, &mut one);
            let mut parts = advance(&mut solver, &ode, 0.0, middle, &mut two);
            let rest = advance(&mut solver, &ode, middle, end, &mut two);
            parts.steps += rest.steps;
            prop_assert_eq!(one.map(f64::to_bits), two.map(f64::to_bits));
            prop_assert_eq!(whole.steps, parts.steps);
        }
    }

    /// The same with any step: equal up to the rounding of the step size.
    #[test]
    fn split_calls_agree_up_to_rounding(ode in linear(), h in 1e-3..0.05, first in 1..50_u32, second in 1..50_u32) {
        for method in [Method::Heun, Method::Rk4] {
            let mut solver = solver(method, h, 1.0);
            let [middle, end] = [f64::from(first) * h, f64::from(first + second) * h];
            let (mut one, mut two) = ([1.0, 0.5], [1.0, 0.5]);
            let steps = advance(&mut solver, &ode, 0.0, end, &mut one).steps;
            prop_assert_eq!(steps, u64::from(first + second));
            advance(&mut solver, &ode, 0.0, middle, &mut two);
            advance(&mut solver, &ode, middle, end, &mut two);
            // step size and state are rounded at each of up to 100 steps; the eigenvalues are below 6
            let scale = 1.0 + (6.0 * end).exp();
            prop_assert!(distance(&one, &two) < 100.0 * 4.0 * f64::EPSILON * scale);
        }
    }

    /// Fixed steps against the closed form of the matrix exponential: `n` local errors of size `(|A| h)^(p+1)`.
    #[test]
    fn linear_systems_follow_the_matrix_exponential(ode in linear(), x in state()) {
        let norm = ode.a.as_flattened().iter().map(|a| a * a).sum::<f64>().sqrt();
        let exact = ode.exact(1.0, &x);
        for (method, factorial) in [(Method::Heun, 6.0), (Method::Rk4, 120.0)] {
            let mut end = x;
            advance(&mut solver(method, 0.01, 1.0), &ode, 0.0, 1.0, &mut end);
            let z = 0.01 * norm;
            let local = z.powi(method.order().cast_signed() + 1) / factorial;
            // local errors grow with exp(|A| t); e^z covers the rest of the series
            let bound = 100.0 * local * z.exp() * norm.exp() * 2.0_f64.sqrt() + 1e-13 * norm.exp();
            prop_assert!(distance(&end, &exact) <= bound, "{:e} {bound:e}", distance(&end, &exact));
        }
    }

    /// The adaptive method keeps its tolerance, up to the growth of the system and the number of steps.
    #[test]
    fn adaptive_steps_follow_the_matrix_exponential(ode in linear(), x in state(), digits in 4..11_i32) {
        let tolerance = 0.1_f64.powi(digits);
        let norm = ode.a.as_flattened().iter().map(|a| a * a).sum::<f64>().sqrt();
        let mut end = x;
        let statistics = advance(&mut solver(Method::Dopri5, 1.0, tolerance), &ode, 0.0, 2.0, &mut end);
        let scale = (2.0 * norm).exp();
        let steps = f64::from(u32::try_from(statistics.steps).expect("few steps"));
        let bound = 2.0 * steps * tolerance * (1.0 + scale) * scale;
        let error = distance(&end, &ode.exact(2.0, &x));
        prop_assert!(error <= bound, "{error:e} {bound:e}");
    }

    /// A mode that the guard lets pass does not grow by more than it says, for any state.
    #[test]
    fn growth_per_step_is_the_stability_function(s in -4.0..1.0, w in 0.1..4.0, h in 0.01..1.0, x in state()) {
        let ode = Linear { a: [[s, w], [-w, s]] }; // eigenvalues s +- i w, normal: lengths grow by |R| exactly
        for method in [Method::Heun, Method::Rk4] {
            let mut end = x;
            advance(&mut solver(method, 1.0, 1.0), &ode, 0.0, h, &mut end);
            let r = method.stability(h * Complex::new(s, w)).abs();
            let growth = distance(&end, &[0.0; 2]);
            let expected = r * distance(&x, &[0.0; 2]);
            prop_assert!((growth - expected).abs() < 1e-13 * (1.0 + expected)); // terms of up to 5^4/24
        }
    }

    /// Two runs with the same input agree in every bit, also when the second goes on from a saved memory.
    #[test]
    fn runs_are_bit_reproducible(e in 0.0..0.8, calls in 1..20_u32) {
        for method in GENERAL {
            let orbit = Kepler { e };
            let time = |i: u32| 3.0 * f64::from(i) / f64::from(calls);
            let mut one = solver(method, 0.01, 1e-7);
            let (mut x, mut s) = (orbit.exact(0.0), Statistics::default());
            let (mut y, mut r) = (x, s);
            let mut memory = one.memory();
            for i in 0..calls {
                one.advance(&orbit, time(i), time(i + 1), &mut x, &mut s).expect("smooth");
                let mut other = solver(method, 0.01, 1e-7);
                other.restore(memory);
                other.advance(&orbit, time(i), time(i + 1), &mut y, &mut r).expect("smooth");
                memory = other.memory();
                prop_assert_eq!((x.map(f64::to_bits), s, one), (y.map(f64::to_bits), r, other));
            }
        }
    }
}
