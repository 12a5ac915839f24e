//! Control laws, design values and stability of the absorber against tables that were computed separately.

#![allow(non_snake_case, reason = "symbols of the specification")]

use std::f64::consts::PI;

use models::absorber::control_law::{ControlLaw, amplification, den_hartog};
use models::absorber::synchronisation::{Stability, multiplier};
use proptest::prelude::*;

/// Rows of a table in `tests/reference/absorber`.
fn table<const N: usize>(text: &str) -> Vec<[f64; N]> {
    let rows = text.lines().filter(|line| !line.starts_with('#')).skip(1);
    let numbers = |row: &str| -> Vec<f64> { row.split(',').map(|v| v.parse().expect("a number")).collect() };
    rows.map(|row| numbers(row).try_into().expect("as many columns")).collect()
}

macro_rules! reference {
    ($name:literal) => {
        table(include_str!(concat!("../../../tests/reference/absorber/", $name, ".csv")))
    };
}

#[track_caller]
fn close(is: f64, should: f64, scale: f64, limit: f64, what: &str) {
    assert!((is - should).abs() <= limit * scale.abs().max(should.abs()), "{what}: {is} instead of {should}");
}

/// n, eta, X and force of 60 points, X below zero among them. Terms of the law cancel, so its scale is that of the terms.
#[test]
fn the_papers_law_has_the_values_of_the_table() {
    let rows: Vec<[f64; 13]> = reference!("law_points");
    assert_eq!(rows.len(), 60);
    for [F_d, omega, alpha, m, c, gamma, H0, x, w, n, eta, X, F1] in rows {
        let (sin_alpha, cos_alpha) = alpha.sin_cos();
        let law = ControlLaw { m, c, d: 0.0, gamma, X, F_d, sin_alpha, cos_alpha, H0 };
        let design = law.paper_design(omega).expect("no pole");
        let force = 2.0 * F_d / (m * omega * omega) / (2.0 * H0 / m).sqrt() * omega;
        close(design.eta, eta, force, 1e-12, "eta"); // 2 F^ cos(alpha) - 1 may cancel
        close(design.n, n, 2.0 * F_d * omega * m / (gamma * H0), 1e-12, "n");
        close(design.X, X, 0.0, 1e-12, "X");
        let terms =
            [0.5 * gamma * m * w * w * w, m * omega * omega * x, F_d / X * x, F_d / (omega * X) * w, c * x];
        let scale = terms.iter().fold(0.0_f64, |largest, term| largest.max(term.abs()));
        close(law.paper(omega, x, w).expect("no pole"), F1, scale, 1e-12, "F1 (14)");
        close(law.direct(omega, x, w), F1, scale, 1e-12, "F1 (16)");
    }
}

proptest! {
    /// (14) and (16) are the same closed loop, relative to the largest term of either.
    #[test]
    fn both_laws_are_one_closed_loop(
        F_d in 0.0..50.0_f64, alpha in -PI..PI, gamma in 0.5..50.0_f64, H0 in 0.2..5.0_f64,
        x in -0.2..0.2_f64, w in -2.0..2.0_f64, omega in 3.0..30.0_f64,
    ) {
        let (sin_alpha, cos_alpha) = alpha.sin_cos();
        let mut law = ControlLaw { m: 5.0, c: 800.0, d: 2.5, gamma, X: 1.0, F_d, sin_alpha, cos_alpha, H0 };
        let design = law.paper_design(omega).expect("no pole at random");
        prop_assume!((design.n * design.eta).abs() > 1e-2); // next to a pole n, eta lose digits
        law.X = design.X;
        let l = (2.0 * H0 / 5.0).sqrt() / omega;
        let in_X = 0.5 * gamma * 5.0 * (omega * law.X).powi(2) * w;
        let terms = [0.5 * gamma * 5.0 * (w * w + omega * omega * l * l) * w, 5.0 * omega * omega * x, 800.0 * x,
            F_d / law.X * x, F_d / (omega * law.X) * w, in_X, 2.5 * w, 0.5 * gamma * 5.0 * omega * omega * x * x * w];
        let scale = terms.iter().fold(0.0_f64, |largest, term| largest.max(term.abs())) / (design.n * design.eta).abs().min(1.0);
        let difference = law.paper(omega, x, w).expect("no pole") - law.direct(omega, x, w);
        prop_assert!(difference.abs() <= 1e-13 * scale, "{difference:e} of {scale}");
        // the limit cycle found from X is this one or another one with the same amplitude; next to double roots half the digits,
        // next to a pole of (14) those that the difference n or eta of (13) leaves
        let found = law.direct_design(omega);
        if design.X > 0.0 && found.n != 0.0 {
            let energy = 0.5 * 5.0 * (omega * design.X / (found.n * found.eta)).powi(2);
            let again = ControlLaw { H0: energy, ..law }.paper_design(omega).expect("no pole");
            let limit = 1e-6_f64.max(16.0 * f64::EPSILON / found.n.abs().min(found.eta.abs()));
            prop_assert!((again.X - law.X).abs() < limit * law.X.abs(), "{} {}", again.X, law.X);
        }
    }
}

/// F_d = 0: n = eta = -1 and (14) = (16) with X = l^.
#[test]
fn without_design_force_the_limit_cycle_is_the_motion() {
    let law = ControlLaw {
        m: 5.0,
        c: 800.0,
        d: 0.0,
        gamma: 10.0,
        X: 0.05,
        F_d: 0.0,
        sin_alpha: 1.0,
        cos_alpha: 0.0,
        H0: 0.5 * 5.0 * (12.0_f64 * 0.05).powi(2),
    };
    let (direct, paper) = (law.direct_design(12.0), law.paper_design(12.0).expect("no pole"));
    for design in [direct, paper] {
        assert!((design.n + 1.0).abs() < 1e-12 && (design.eta + 1.0).abs() < 1e-12);
        assert!((design.X - 0.05).abs() < 1e-15 && design.f == 0.0);
    }
}

#[test]
fn den_hartogs_absorber_has_the_values_of_the_table() {
    let rows: Vec<[f64; 6]> = reference!("den_hartog");
    for [mu, f, zeta, peak, r, amplified] in rows {
        let (f_opt, zeta_opt, largest) = den_hartog(mu);
        for (is, should) in [(f_opt, f), (zeta_opt, zeta), (largest, peak)] {
            close(is, should, 0.0, 1e-12, "tuning");
        }
        close(amplification(mu, f_opt, zeta_opt, r), amplified, 0.0, 1e-12, "amplification");
    }
}

#[test]
fn multipliers_and_conditions_are_those_of_the_table() {
    let rows: Vec<[f64; 6]> = reference!("floquet");
    for [g, f, alpha, trace, determinant, rho] in rows {
        let found = Stability::new(g, f, alpha);
        close(found.trace, trace, g + f, 1e-12, "trace");
        close(found.determinant, determinant, g + f, 1e-12, "determinant");
        assert_eq!(found.trace > 0.0, trace > 0.0);
        assert_eq!(found.determinant > 0.0, determinant > 0.0);
        assert_eq!(found.predicted, rho < 1.0 && trace > 0.0 && determinant > 0.0);
        close(found.multiplier, rho, 0.0, 1e-8, "multiplier");
    }
}

/// g = 0: constant coefficients, z'' + f sin(alpha) z' + (1 + f cos(alpha)) z = 0; 1e-10 is the tolerance of the integration.
#[test]
fn multipliers_without_gain_are_exponentials() {
    for (f, alpha) in [(0.5, 0.3_f64), (2.0, 2.5), (0.2, -1.0), (3.0, 3.0)] {
        let (half, stiffness) = (0.5 * f * alpha.sin(), 1.0 + f * alpha.cos());
        let square = half * half - stiffness;
        let rate = if square > 0.0 { -half + square.sqrt() } else { -half };
        close(multiplier(0.0, f, alpha), (PI * rate).exp(), 0.0, 1e-10, "multiplier");
    }
}
