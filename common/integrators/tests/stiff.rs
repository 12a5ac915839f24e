//! Stiff and linear problems against published solutions and closed forms.

mod common;

use common::stiff::{Beam, Kaps, POINTS, Robertson, VanDerPol};
use common::{GENERAL, Linear, assert_order_within, distance, fixed, in_calls, solver};
use integrators::{Dense, Jacobian, Memory, Method, Ode, Settings, Solver, Statistics, Transition};
use std::convert::Infallible;

const IMPLICIT: [Method; 2] = [Method::Rodas4, Method::Radau5];

fn run<const N: usize, O: Ode<N>>(
    solver: &mut Solver,
    ode: &O,
    t_end: f64,
    x: [f64; N],
) -> ([f64; N], Statistics)
where
    O::Error: std::fmt::Debug,
{
    let (mut x, mut statistics) = (x, Statistics::default());
    solver.advance(ode, 0.0, t_end, &mut x, &mut statistics).expect("solvable");
    (x, statistics)
}

fn relative<const N: usize>(x: &[f64; N], exact: &[f64; N]) -> f64 {
    let errors = x.iter().zip(exact).map(|(x, e)| ((x - e) / e).abs());
    errors.fold(0.0, f64::max)
}

/// The published end values at `eps = 1e-6`, and at 1e-3 those of two other codes; errors follow the tolerance.
#[test]
fn van_der_pol_ends_where_published() {
    for (eps, exact) in [(1e-6, VanDerPol::PUBLISHED), (1e-3, VanDerPol::MILD)] {
        for method in IMPLICIT {
            for digits in [4, 6, 8, 10] {
                let tolerance = 0.1_f64.powi(digits);
                let (x, s) = run(
                    &mut solver(method, 1.0, tolerance),
                    &VanDerPol { eps },
                    VanDerPol::T_END,
                    VanDerPol::START,
                );
                let error = relative(&x, &exact);
                eprintln!("{eps:e} {method:?} {tolerance:.0e}: {error:.2e}, {s:?}");
                // local errors of one tolerance each, damped but for a shift in time at each of the three jumps
                assert!(error < 30.0 * tolerance, "{eps:e} {method:?} {tolerance:e}: {error:e}");
                assert!(s.rejected < 20 && s.jacobians <= s.steps + s.rejected);
            }
        }
    }
}

/// On the slow motion the step follows it and not the fast one, be that 1e5 or 1e8 times faster.
#[test]
fn stiffness_does_not_count_steps() {
    let [soft, hard] = [1e-5, 1e-8].map(|eps| {
        run(&mut solver(Method::Radau5, 1.0, 1e-4), &VanDerPol { eps }, 0.5, VanDerPol::START).1.steps
    });
    eprintln!("{soft} and {hard} steps");
    assert!(hard < 60 && hard <= soft + 20, "{soft} {hard}");
}

#[test]
fn robertson_reacts_as_published() {
    for method in IMPLICIT {
        let (x, _) = run(&mut solver(method, 1.0, 1e-8), &Robertson, 40.0, Robertson::START);
        assert!(relative(&x, &Robertson::AT_40) < 2e-4, "{method:?} {x:?}"); // four digits are printed
        let settings = Settings { method, step: 1.0, rtol: 1e-8, atol: 1e-16 };
        // in calls to 0.4, 4, .. 4e10, as such runs are printed
        let mut solver = Solver::new(settings).expect("valid");
        let (mut x, mut s, mut t) = (Robertson::START, Statistics::default(), 0.0);
        for decade in 0..12 {
            let t_end = (0.4 * 10.0_f64.powi(decade)).min(1e11);
            solver.advance(&Robertson, t, t_end, &mut x, &mut s).expect("solvable");
            t = t_end;
        }
        solver.advance(&Robertson, t, 1e11, &mut x, &mut s).expect("solvable");
        let error = relative(&x, &Robertson::AT_1E11);
        eprintln!("{method:?}: {error:.2e}, {s:?}");
        // a slow decay, on which earlier errors fade
        assert!(error < 10.0 * 1e-8, "{method:?}: {error:e}");
        assert!((x.iter().sum::<f64>() - 1.0).abs() < 1e-12, "mass is kept, a linear invariant");
    }
}

/// Rodas4 keeps its order 4 at both ends of stiffness (Hairer & Wanner II, section VI.3); between them, where the fast
/// motion is neither resolved nor gone, errors of size `eps h^2` show, below those that matter there.
#[test]
fn stiff_orders_of_rodas4_on_kaps_problem() {
    for (eps, least) in [(1.0, 3.8), (1e-2, 3.8), (1e-8, 3.8)] {
        let errors = [8, 16, 32, 64].map(|n| {
            let end =
                in_calls(&mut fixed(Method::Rodas4, 10.0), &Kaps { eps }, [0.0, 1.0], n, Kaps::exact(0.0));
            distance(&end, &Kaps::exact(1.0))
        });
        let order = common::slope(&errors);
        eprintln!("eps = {eps:e}: order {order:.2}, errors {errors:?}");
        assert!(order > least, "eps = {eps:e}: order {order:.2}, errors {errors:?}");
    }
}

/// Deflections and speeds of a beam of 20 states against its modes in closed form.
fn beam_error(x: &[f64; 2 * POINTS], t: f64) -> f64 {
    let exact = Beam::exact(t);
    let part = |from: usize| {
        let largest = exact[from..from + POINTS].iter().map(|e| e.abs()).fold(0.0, f64::max);
        let errors = (from..from + POINTS).map(|i| (x[i] - exact[i]).abs());
        errors.fold(0.0, f64::max) / largest
    };
    part(0).max(part(POINTS))
}

#[test]
fn beam_follows_its_modes() {
    assert!(distance(&Beam::exact(0.0), &Beam::start()) < 1e-15, "the modes add up to the start");
    for method in GENERAL.into_iter().filter(|m| m.is_adaptive()) {
        for tolerance in [1e-6, 1e-8] {
            let (x, s) = run(&mut solver(method, 1.0, tolerance), &Beam, 0.2, Beam::start());
            let error = beam_error(&x, 0.2);
            eprintln!("{method:?} {tolerance:e}: {error:.2e}, {s:?}");
            // scales are 1 mm and 1 m/s, motions 0.3 mm and 30 mm/s by then; three periods of the slowest mode
            assert!(error < 3e3 * tolerance, "{method:?}: {error:e}");
        }
    }
}

/// `exact` has no error but rounding, with any step, over any time, from a cache or not.
#[test]
fn exact_is_exact_on_the_beam() {
    let mut kept = Transition::default();
    for step in [1.0, 0.1, 0.01, 1e-4] {
        for t_end in [0.003, 0.2, 1.0] {
            let (x, s) = run(&mut solver(Method::Exact, step, 1.0), &Beam, t_end, Beam::start());
            let error = beam_error(&x, t_end);
            // rounding of the phase, 100 rad in 1 s, after ten squarings, of a motion that has shrunk by e^(4.7 t)
            assert!(error < 1e-9, "{step} {t_end}: {error:e}");
            assert_eq!((s.rhs_evaluations, s.jacobians, s.decompositions), (s.steps, 1, 1));
            let (mut y, mut r) = (Beam::start(), Statistics::default());
            kept.forget();
            solver(Method::Exact, step, 1.0)
                .advance_cached(&Beam, &mut kept, 0.0, t_end, &mut y, &mut r)
                .expect("linear");
            assert_eq!((x.map(f64::to_bits), s), (y.map(f64::to_bits), r));
        }
    }
}

/// Host steps of 1 ms that differ in their last bits use one matrix, and a run of them keeps its phase.
#[test]
fn exact_keeps_its_matrix_over_calls() {
    let (mut kept, mut s) = (Transition::default(), Statistics::default());
    let mut solver = solver(Method::Exact, 1.0, 1.0);
    let mut x = [0.6, -0.8];
    for i in 0..10_000 {
        let [t, t_end] = [f64::from(i) * 0.001, f64::from(i + 1) * 0.001];
        solver.advance_cached(&Linear::OSCILLATOR, &mut kept, t, t_end, &mut x, &mut s).expect("linear");
    }
    assert_eq!((s.steps, s.rhs_evaluations, s.jacobians, s.decompositions), (10_000, 10_000, 1, 1));
    let error = distance(&x, &Linear::OSCILLATOR.exact(10.0, &[0.6, -0.8]));
    assert!(error < 10_000.0 * f64::EPSILON, "{error:e}"); // one rounding per step
}

/// A constant input that changes between calls needs no new matrix: `x' = -x + b` step by step.
#[test]
fn exact_takes_new_inputs_with_the_old_matrix() {
    struct Lag(f64);
    impl Ode<1> for Lag {
        type Error = Infallible;
        fn rhs(&self, _t: f64, x: &[f64; 1]) -> Result<[f64; 1], Infallible> {
            Ok([self.0 - x[0]])
        }
        fn jacobian(&self, _t: f64, _x: &[f64; 1], _f: &[f64; 1]) -> Result<Jacobian<1>, Infallible> {
            Ok(([[-1.0]], [0.0]))
        }
        fn linear(&self) -> bool {
            true
        }
    }
    let (mut kept, mut s, mut x) = (Transition::default(), Statistics::default(), [0.0]);
    let mut expected = 0.0;
    for (i, b) in [1.0, -2.0, 0.5].into_iter().enumerate() {
        let t = f64::from(u8::try_from(i).expect("three"));
        solver(Method::Exact, 0.5, 1.0)
            .advance_cached(&Lag(b), &mut kept, t, t + 1.0, &mut x, &mut s)
            .expect("linear");
        expected = b + (expected - b) * (-1.0_f64).exp();
        assert!((x[0] - expected).abs() < 1e-15);
    }
    assert_eq!(s.decompositions, 1);
}

/// Dense output of the implicit methods and of `exact` inside their steps: local orders 4, 4 and 6.
#[test]
fn dense_output_of_the_stiff_methods_has_its_order() {
    let ode = Linear { a: [[-0.2, 1.0], [-1.0, -0.1]] };
    for (method, order) in [(Method::Rodas4, 4.0), (Method::Radau5, 4.0), (Method::Exact, 6.0)] {
        let errors = [0.4, 0.2, 0.1].map(|h| {
            let (mut x, mut s, mut worst) = ([0.6, -0.8], Statistics::default(), 0.0_f64);
            let compare = |step: &Dense<2>| {
                for theta in [0.2, 0.5, 0.9] {
                    worst = worst.max(distance(&step.at(theta), &ode.exact(theta * h, &[0.6, -0.8])));
                }
            };
            fixed(method, 1.0).advance_dense(&ode, 0.0, h, &mut x, &mut s, compare).expect("linear");
            worst
        });
        assert_order_within(&errors, order, 0.3);
    }
}

/// A spring of 1e8 N/m under a sine, with the energy that it takes up: that integral counts in no norm.
struct Bushing {
    nominal: f64,
}

impl Bushing {
    const K: f64 = 1e8;
    const C: f64 = 1e4;
}

impl Ode<3> for Bushing {
    type Error = Infallible;
    fn rhs(&self, t: f64, x: &[f64; 3]) -> Result<[f64; 3], Infallible> {
        let [r, v, _] = *x;
        let load = 200.0 * (10.0 * t).sin();
        Ok([v, load - Self::K * r - Self::C * v, load * v])
    }
    fn nominal(&self) -> [f64; 3] {
        [1.0, 1.0, self.nominal]
    }
}

/// Neither the error norm nor Newton's iteration hears of an infinite nominal value: step sizes are those of the system
/// without the integral, while a finite one asks for more. Newton's test is on the scaled increment: forces of 1e8 N/m
/// times the rounding of a position of 1 m never stop it.
#[test]
fn quadratures_do_not_spoil_the_steps() {
    for method in IMPLICIT {
        let [ignored, counted] = [f64::INFINITY, 1e-12]
            .map(|nominal| run(&mut solver(method, 1.0, 1e-7), &Bushing { nominal }, 1.0, [0.0; 3]));
        eprintln!("{method:?}: {:?} and {:?}", ignored.1, counted.1);
        assert!(ignored.1.steps < 400, "{method:?}: {:?}", ignored.1);
        assert!(counted.1.steps > ignored.1.steps);
        // quasi-static: r = F/k, E = F^2/(2k), up to the damper's lag c w / k = 1e-3
        let load = 200.0 * 10.0_f64.sin();
        assert!((ignored.0[0] * Bushing::K / load - 1.0).abs() < 5e-3, "{:?}", ignored.0);
    }
}

/// A call of 10 ms starts anew: with the proposed step kept, one step, one Jacobian and one decomposition each.
#[test]
fn restarts_cost_one_step_each() {
    for method in IMPLICIT {
        let ode = VanDerPol { eps: 1e-6 };
        let (mut x, mut s) = (VanDerPol::START, Statistics::default());
        let mut solver = solver(method, 1.0, 1e-6);
        solver.advance(&ode, 0.0, 0.1, &mut x, &mut s).expect("smooth");
        let before = s;
        for i in 10..20 {
            let t = f64::from(i) / 100.0;
            solver.advance(&ode, t, t + 0.01, &mut x, &mut s).expect("smooth");
        }
        let [steps, jacobians, decompositions] = [
            s.steps - before.steps,
            s.jacobians - before.jacobians,
            s.decompositions - before.decompositions,
        ];
        eprintln!(
            "{method:?}: {steps} steps, {jacobians} Jacobians, {decompositions} decompositions in 10 calls"
        );
        assert!(steps <= 30 && jacobians <= steps && decompositions <= steps + 2);
    }
}

/// Newton's iteration far from its start fails and the step is halved until it does not: no step too long is an error.
#[test]
fn a_proposal_far_too_long_is_shortened() {
    for method in IMPLICIT {
        let mut solver = solver(method, 1.0, 1e-6);
        solver.restore(Memory { step: 2.0, ..Memory::default() });
        let (x, s) = run(&mut solver, &VanDerPol { eps: 1e-3 }, VanDerPol::T_END, VanDerPol::START);
        assert!(relative(&x, &VanDerPol::MILD) < 3e-5, "{method:?} {x:?}");
        assert!(s.rejected > 0);
    }
}
