//! Stability functions, tied to the steps themselves and to published bounds.

mod common;

use common::{EXPLICIT, Linear, distance, fixed, in_calls};
use integrators::{Complex, MAX_AMPLIFICATION, Method, largest_stable_step, violates};
use proptest::prelude::*;

/// `R(z) = sum z^k / k!` up to the order of Heun and RK4; Dopri5 has `z^6/600` more (Hairer & Wanner II, IV.2).
#[test]
fn stability_functions_are_the_published_ones() {
    for z in [-3.0, -1.0, -0.1, 0.1, 1.0] {
        for (method, degree, extra) in
            [(Method::Heun, 2, 0.0), (Method::Rk4, 4, 0.0), (Method::Dopri5, 5, 1.0 / 600.0)]
        {
            let (mut term, mut exact) = (1.0, 1.0);
            for k in 1..=degree {
                term *= z / f64::from(k);
                exact += term;
            }
            exact += extra * z.powi(6);
            let r = method.stability(Complex::new(z, 0.0));
            assert!((r.re - exact).abs() < 1e-14 && r.im.abs() < 1e-15, "{method:?} {z}: {r:?}"); // sums of terms < 10
        }
    }
}

/// One step multiplies the amplitude of the oscillator `x'' = -x` by `|R(ih)|`.
#[test]
fn oscillator_grows_by_the_stability_function() {
    for method in Method::ALL {
        for h in [0.01, 0.3, 1.0, 2.5] {
            let x = [0.6, -0.8];
            let growth =
                distance(&in_calls(&mut fixed(method, 5.0), &Linear::OSCILLATOR, [0.0, h], 1, x), &[0.0; 2]);
            let r = method.stability(Complex::new(0.0, h)).abs();
            assert!((growth - r).abs() < 1e-14 * r.max(1.0), "{method:?} {h}: {growth} {r}");
        }
    }
}

/// Ends of the stability region on the real and imaginary axis with the bound 1; here with 1.1 they lie further
/// out, where `|R| = 1.1` exactly.
#[test]
fn largest_step_is_where_growth_reaches_the_bound() {
    let lambdas = [(-5.0, 0.0), (-1.0, 3.0), (0.0, 40.0), (0.2, 1.0), (-6197.0, 9090.0)].map(Complex::from);
    for method in EXPLICIT {
        for lambda in lambdas {
            let h = largest_stable_step(method, &[lambda]);
            let growth = method.stability(h * lambda).abs();
            assert!((growth - MAX_AMPLIFICATION).abs() < 1e-11, "{method:?} {lambda:?}: {growth}");
            assert!(!violates(method, h, lambda) && violates(method, h * (1.0 + 1e-12), lambda));
            for i in 0..1000 {
                assert!(!violates(method, h * f64::from(i) / 1000.0, lambda), "every smaller step is usable");
            }
        }
        let all = largest_stable_step(method, &lambdas);
        assert!((all - largest_stable_step(method, &lambdas[4..])).abs() < 1e-18, "the fastest mode decides");
    }
}

/// Closed forms on the axes with `R = 1.1`: Heun, `1 + z + z^2/2 = 1.1` at `-1 - sqrt(1.2)`; `1 + y^4/4 = 1.21`;
/// RK4, `1 - y^6/72 + y^8/576 = 1.21`; a growing mode `1 + z + z^2/2 = 1.1` at `sqrt(1.2) - 1`.
#[test]
fn largest_steps_of_heun_and_rk4_in_closed_form() {
    let largest = |method, re, im| largest_stable_step(method, &[Complex::new(re, im)]);
    assert!((largest(Method::Heun, -1.0, 0.0) - 1.0 - 1.2_f64.sqrt()).abs() < 1e-14);
    assert!((largest(Method::Heun, 0.0, 1.0) - 0.84_f64.powf(0.25)).abs() < 1e-14);
    assert!((largest(Method::Heun, 1.0, 0.0) - (1.2_f64.sqrt() - 1.0)).abs() < 1e-14);
    let y = largest(Method::Rk4, 0.0, 1.0);
    assert!((1.0 - y.powi(6) / 72.0 + y.powi(8) / 576.0 - 1.21).abs() < 1e-13);
    // the bound 1 gives the textbook limits: 2 for Heun, 2.785 and 2.828 for RK4, 3.307 for Dopri5 on the real axis
    for (method, re, im) in [
        (Method::Heun, -2.0, 0.0),
        (Method::Rk4, -2.785_293_563_405_282, 0.0),
        (Method::Rk4, 0.0, 8.0_f64.sqrt()),
    ] {
        assert!((method.stability(Complex::new(re, im)).abs() - 1.0).abs() < 1e-14);
    }
    assert!((Method::Dopri5.stability(Complex::new(-3.3066, 0.0)).abs() - 1.0).abs() < 1e-3);
}

/// A-stable: `|R| <= 1` wherever the solution does not grow, so no step is refused.
#[test]
fn implicit_methods_allow_any_step() {
    for method in Method::ALL.into_iter().filter(|m| m.is_a_stable()) {
        for i in 0..=60 {
            for size in [1e-3, 0.1, 1.0, 3.0, 10.0, 1e2, 1e4, 1e8, 1e200] {
                let angle = std::f64::consts::PI * (0.5 + f64::from(i) / 60.0);
                let z = Complex::new(size * angle.cos().min(0.0), size * angle.sin());
                let r = method.stability(z).abs();
                assert!(r <= 1.0 + 1e-12, "{method:?} {z:?}: {r}"); // rounding of coefficients up to 34
                assert!(!violates(method, 1.0, z) && largest_stable_step(method, &[z]).is_infinite());
            }
        }
        // R = e^z + O(z^(p+1)), and far out 0
        let z = Complex::new(-0.3, 0.2);
        let error = (method.stability(z) - z.exp()).abs();
        assert!(error < z.abs().powi(method.order().cast_signed() + 1), "{method:?}: {error:e}");
        assert!(method.stability(Complex::new(-1e8, 1e3)).abs() < 1e-6, "{method:?}");
    }
}

#[test]
fn nothing_limits_a_system_at_rest() {
    for method in Method::ALL {
        assert!(largest_stable_step(method, &[]).is_infinite());
        assert!(largest_stable_step(method, &[Complex::default()]).is_infinite());
        assert!(!violates(method, 1e300, Complex::default()));
    }
}

#[test]
fn eigenvalues_that_are_not_finite_allow_no_step() {
    for method in Method::ALL {
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert!(violates(method, 0.1, Complex::new(bad, 0.0)));
            assert!(violates(method, 0.1, Complex::new(0.0, bad)));
            assert!(largest_stable_step(method, &[Complex::new(bad, 1.0)]).abs() < f64::MIN_POSITIVE);
        }
        // overflow inside the polynomial counts as growth
        let far = Complex::new(-1e200, 1e200);
        assert_eq!(violates(method, 1e200, far), EXPLICIT.contains(&method));
    }
}

proptest! {
    /// The largest step scales with the inverse of the eigenvalue and is the same for its conjugate.
    #[test]
    fn largest_step_scales_with_the_eigenvalue(angle in 0.0..std::f64::consts::PI, size in -3.0..6.0_f64) {
        for method in EXPLICIT {
            let unit = Complex::new(-angle.sin(), angle.cos());
            let scaled = 10.0_f64.powf(size) * unit;
            let one = largest_stable_step(method, &[unit]);
            let other = largest_stable_step(method, &[scaled, Complex::new(scaled.re, -scaled.im)]);
            prop_assert!((other * 10.0_f64.powf(size) / one - 1.0).abs() < 1e-9, "{one} {other}");
        }
    }
}
