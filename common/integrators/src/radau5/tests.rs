//! The table against the simplifying assumptions; orders with forced steps and a tight Newton iteration.

use super::system::{ALPHA_BETA, E, GAMMA, Square};
use super::*;
use crate::common::stiff::Kaps;
use crate::common::{Kepler, Swing, assert_order_within, distance};
use crate::fixed::fixed;
use crate::norm::Norm;
use crate::run::{Run, Unwatched};
use crate::{Method, Settings, Statistics};

/// Rounding of sums of three terms of size up to 4.4.
const ROUNDING: f64 = 3.0 * 4.4 * 2.0 * f64::EPSILON;

fn moment(row: &[f64; 3], q: i32) -> f64 {
    row.iter().zip(C).map(|(a, c)| a * c.powi(q)).sum()
}

/// B(5), C(3): `sum b_i c_i^(q-1) = 1/q` up to 5, `sum a_ij c_j^(q-1) = c_i^q/q` up to 3; `b` is the last row.
#[test]
fn table_satisfies_the_simplifying_assumptions() {
    for q in 1..7_i32 {
        let defect = moment(&A[2], q - 1) - 1.0 / f64::from(q);
        assert_eq!(defect.abs() < ROUNDING, q <= 5, "b, q = {q}: {defect:e}");
        for (row, c) in A.iter().zip(C) {
            let defect = moment(row, q - 1) - c.powi(q) / f64::from(q);
            assert!(q > 3 || defect.abs() < ROUNDING, "a, q = {q}: {defect:e}");
        }
    }
}

fn product(a: &Square, b: &Square) -> Square {
    a.map(|row| std::array::from_fn(|j| (0..3).map(|k| row[k] * b[k][j]).sum()))
}

fn close(a: &Square, b: &Square) -> bool {
    a.as_flattened().iter().zip(b.as_flattened()).all(|(a, b)| (a - b).abs() < 4.0 * ROUNDING)
}

#[test]
fn eigenvectors_make_the_inverse_diagonal() {
    let unit = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    assert!(close(&product(&T_INVERSE, &T), &unit));
    let Complex { re, im } = ALPHA_BETA;
    let eigenvalues = [[GAMMA, 0.0, 0.0], [0.0, re, -im], [0.0, im, re]];
    assert!(close(&product(&A, &product(&T, &eigenvalues)), &T)); // A^(-1) T = T Lambda
}

/// `f(0) + sum e_i z_i = 0` for slopes 1, t, t^2: the estimate has order 3; not for t^3.
#[test]
fn estimate_has_order_3() {
    for q in 0..4 {
        let sum = moment(&E, q + 1) / f64::from(q + 1) + if q == 0 { 1.0 } else { 0.0 };
        assert_eq!(sum.abs() < 2.0 * ROUNDING, q < 3, "q = {q}: {sum:e}");
    }
}

/// The polynomial of the extension runs through the stages, and the prediction goes on along it.
#[test]
fn collocation_polynomial_runs_through_the_stages() {
    let z = [[0.3], [-0.7], [1.1]];
    let p = times(&POWERS, &z);
    let at = |theta: f64| theta * (p[0][0] + theta * (p[1][0] + theta * p[2][0]));
    for (c, z) in C.iter().zip(z) {
        assert!((at(*c) - z[0]).abs() < 10.0 * ROUNDING);
    }
    let guess = predicted(Some(&(2.0, p)), 0.5);
    for (c, guess) in C.iter().zip(guess) {
        assert!((at(1.0 + 0.25 * c) - at(1.0) - guess[0]).abs() < 100.0 * ROUNDING);
    }
}

/// `R` is the Padé approximant (2, 3) of the exponential (Hairer & Wanner II, table IV.3.1), 0 far out.
#[test]
fn stability_function_is_the_published_one() {
    for (re, im) in [(-1.0, 0.0), (0.3, 2.0), (-20.0, 5.0), (0.0, 100.0)] {
        let z = Complex::new(re, im);
        let one = Complex::new(1.0, 0.0);
        let numerator = one + 0.4 * z + 0.05 * (z * z);
        let denominator = one - 0.6 * z + 0.15 * (z * z) - (1.0 / 60.0) * (z * z * z);
        assert!((Radau5::stability(z) - numerator / denominator).abs() < 1e-14);
    }
    assert!(Radau5::stability(Complex::new(-1e12, 0.0)).abs() < 1e-11);
}

/// End of `n` equal steps, Newton's iteration to 1e-12.
fn forced<const N: usize, O: Ode<N>>(ode: &O, t_end: f64, n: u32, x: [f64; N]) -> [f64; N]
where
    O::Error: std::fmt::Debug,
{
    let settings = Settings { method: Method::Radau5, step: t_end / f64::from(n), rtol: 1e-8, atol: 1e-8 };
    let mut call = Call {
        ode,
        norm: Norm::new(ode, &settings, 1e-8),
        statistics: Statistics::default(),
        work: &mut Work::default(),
    };
    let mut run = Run { t: 0.0, x };
    fixed(&Radau5, &settings, &mut call, &mut run, t_end, &mut Unwatched).expect("smooth problem");
    run.x
}

#[test]
fn forced_steps_have_order_5() {
    let errors =
        [40, 80, 160].map(|n| distance(&forced(&Swing, 5.0, n, Swing::exact(0.0)), &Swing::exact(5.0)));
    assert_order_within(&errors, 5.0, 0.2);
    let orbit = Kepler { e: 0.3 };
    let errors =
        [40, 80, 160].map(|n| distance(&forced(&orbit, 5.0, n, orbit.exact(0.0)), &orbit.exact(5.0)));
    assert_order_within(&errors, 5.0, 0.2);
}

/// Kaps' problem from not stiff to 1e8 times faster than its solution: order 5 at both ends, and at least the stage
/// order 3 between them (Hairer & Wanner II, section VI.1).
#[test]
fn stiff_orders_on_kaps_problem() {
    for (eps, least) in [(1.0, 4.5), (1e-2, 3.0), (1e-4, 3.0), (1e-8, 4.5)] {
        let errors = [16, 32, 64]
            .map(|n| distance(&forced(&Kaps { eps }, 1.0, n, Kaps::exact(0.0)), &Kaps::exact(1.0)));
        let order = crate::common::slope(&errors);
        eprintln!("eps = {eps:e}: order {order:.2}, errors {errors:?}");
        assert!(order > least, "eps = {eps:e}: order {order:.2}, errors {errors:?}");
    }
}
