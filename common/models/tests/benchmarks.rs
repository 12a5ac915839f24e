//! Published benchmarks of multibody codes, built from the elements of the suspension.

#![allow(non_snake_case, clippy::unreadable_literal, reason = "symbols and numbers as published")]

use std::cell::Cell;

use integrators::{Method, Ode, Settings, Solver, Statistics};
use mechanics::{
    Assembly, AssemblyError, ClosingJoint, Load, Member, Parent, Place, Planar, SpringDamper, Vector,
};

mod linkage;
use linkage::{K, Linkage, V2, n_four_bar, n_four_bar_state, rigid, v};

/// All uprights stay parallel: [(N+1)/3 + N] phi'' = -[(N+1)/2 + N] g cos phi (23).
struct Pendulum(f64);

impl Ode<2> for Pendulum {
    type Error = AssemblyError;
    fn rhs(&self, _t: f64, &[phi, rate]: &[f64; 2]) -> Result<[f64; 2], AssemblyError> {
        let n = self.0;
        Ok([rate, -(1.5 * n + 0.5) / (4.0 / 3.0 * n + 1.0 / 3.0) * 9.81 * phi.cos()])
    }
}

fn rk4(step: f64) -> Solver {
    Solver::new(Settings { method: Method::Rk4, step, rtol: 1e-6, atol: 1e-9 }).expect("settings")
}

fn tight() -> Solver {
    Solver::new(Settings { method: Method::Dopri5, step: 1.0, rtol: 1e-12, atol: 1e-13 }).expect("settings")
}

/// Largest distance of B0 from the exact pendulum over `stop` seconds, and the deficient evaluations.
fn n_four_bar_error<const B: usize, const N: usize, const X: usize>(stop: f64, step: f64) -> (f64, f64, u32) {
    let n = u32::try_from(N).expect("small");
    let linkage = n_four_bar::<B, N, 2>();
    // start of A02: uprights vertical, B0 moves with +1 m/s along x
    let mut x: [f64; X] = n_four_bar_state(N, std::f64::consts::FRAC_PI_2);
    let mut exact = [std::f64::consts::FRAC_PI_2, -1.0];
    let (mut solver, mut oracle) = (rk4(step), tight());
    let (mut worst, mut fastest, mut statistics) = (0.0_f64, 0.0_f64, Statistics::default());
    let samples = 400;
    for i in 0..samples {
        let at = |i: u32| stop * f64::from(i) / f64::from(samples);
        solver.advance(&linkage, at(i), at(i + 1), &mut x, &mut statistics).expect("the linkage moves");
        oracle
            .advance(&Pendulum(f64::from(n)), at(i), at(i + 1), &mut exact, &mut Statistics::default())
            .expect("a pendulum");
        let (b, e) = (v(x[0].cos(), x[0].sin()), v(exact[0].cos(), exact[0].sin()));
        worst = worst.max((b - e).norm());
        fastest = fastest.max(x[1].abs());
    }
    (worst, fastest, linkage.deficient.get())
}

/// Published tolerance on B0: 1e-3 for 20 s, high precision; the aligned position is passed twice per turn.
#[test]
fn two_loops_follow_the_pendulum_through_the_change_point() {
    let (error, fastest, deficient) = n_four_bar_error::<5, 2, 10>(20.0, 1e-3);
    assert!(error < 1e-6, "B0 off by {error:e} m");
    // 6.8396 m/s at the bottom; the samples are 0.05 s apart, near enough to the top speed
    assert!((fastest - 46.78_f64.sqrt()).abs() < 0.05, "{fastest}");
    // the steps fall beside the aligned position, where the factorisation still holds
    assert_eq!(deficient, 0, "evaluations repeated by eigendecomposition");
}

#[test]
fn one_and_forty_loops_follow_the_pendulum() {
    let (error, _, one) = n_four_bar_error::<3, 1, 6>(20.0, 1e-3);
    assert!(error < 1e-6, "N = 1: B0 off by {error:e} m");
    let (error, _, forty) = n_four_bar_error::<81, 40, 162>(4.0, 5e-3);
    assert!(error < 1e-3, "N = 40: B0 off by {error:e} m");
    assert_eq!((one, forty), (0, 0), "evaluations repeated by eigendecomposition");
}

/// On the aligned position itself K has lost a direction per loop. The evaluation is repeated by
/// eigendecomposition once; its accelerations keep the loops closed: phi_i'' + h_i'' = phi_(i+1)''. (More cannot be asked of it:
/// the linkage may leave this position in several ways, and equations at one instant do not choose.)
#[test]
fn the_aligned_position_is_solved_by_eigendecomposition() {
    let linkage = n_four_bar::<9, 4, 2>();
    let x_dot: [f64; 18] = linkage.rhs(0.0, &n_four_bar_state(4, 0.0)).expect("consistent");
    assert_eq!(linkage.deficient.get(), 1);
    let q_ddot = |element: usize| x_dot[2 * element + 1];
    for i in 0..4 {
        let gap = q_ddot(i) + q_ddot(5 + i) - q_ddot(i + 1);
        assert!(gap.abs() < 1e-12 * 9.81, "loop {i} opens with {gap:e} m/s2");
    }
    assert!((0..9).any(|i| q_ddot(i).abs() > 1.0), "it falls");
}

/// Loops that share an upright with their neighbours only: a band of two blocks holds all of K.
#[test]
fn the_band_holds_the_whole_closure_matrix() {
    let x = std::array::from_fn(|i| f64::from(u32::try_from(i * i).expect("small")).sin());
    let band: [f64; 26] = n_four_bar::<13, 6, 2>().rhs(0.0, &x).expect("regular");
    let full: [f64; 26] = n_four_bar::<13, 6, 6>().rhs(0.0, &x).expect("regular");
    let size = full.iter().fold(0.0_f64, |m, a| m.max(a.abs()));
    for (a, b) in band.iter().zip(&full) {
        assert!((a - b).abs() < 1e-12 * size, "{a} against {b}");
    }
}

/// IVP test set, Andrews' squeezer: seven bodies, three closing joints at E.
fn squeezer() -> (Assembly<Planar, 2, 1, 7, 3, 3>, [f64; 14]) {
    let (d, da, e, ea, rr, ra) = (0.028, 0.0115, 0.02, 0.01421, 0.007, 0.00092);
    let (ss, sa, sb, _sc, _sd) = (0.035, 0.01874, 0.01043, 0.018, 0.02);
    let (ta, tb, u, ua, ub, zf, zt, fa) = (0.02308, 0.00916, 0.04, 0.01228, 0.00449, 0.02, 0.04, 0.01421);
    let (m, I) = (
        [0.04325, 0.00365, 0.02373, 0.00706, 0.07050, 0.00706, 0.05498],
        [2.194e-6, 4.410e-7, 5.255e-6, 5.667e-7, 1.169e-5, 5.667e-7, 1.912e-5],
    );
    let member =
        |k: usize, c: V2, parent| Member { joint: Planar, rigid: rigid(m[k - 1], c, I[k - 1]), parent };
    // order K1 K2 K3 K5 K4 K7 K6; roots O, B, A
    let members = [
        member(1, v(ra, 0.0), Parent::Root(0)),
        member(2, v(-da, 0.0), Parent::Element(0, v(rr, 0.0))),
        member(3, v(sa, sb), Parent::Root(1)),
        member(5, v(ta, tb), Parent::Root(2)),
        member(4, v(0.0, -(e - ea)), Parent::Element(3, v(zt, 0.0))),
        member(7, v(ua, ub), Parent::Root(2)),
        member(6, v(zf - fa, 0.0), Parent::Element(5, v(0.0, -u))),
    ];
    let E = [
        Place { element: 1, point: v(-d, 0.0) },
        Place { element: 2, point: v(0.0, -ss) },
        Place { element: 4, point: v(0.0, -e) },
        Place { element: 6, point: v(zf, 0.0) },
    ];
    let closures = [1, 2, 3].map(|i| ClosingJoint { first: E[0], second: E[i] });
    let (beta, Theta, gamma, Phi) = (-0.0617138900142764, 0.0, 0.45527981916307, 0.222668390165886);
    let (delta, Omega, epsilon) = (0.487364979543843, -0.222668390165886, 1.23054744454982);
    let angles = [beta, beta + Theta, gamma, delta, Phi + delta, epsilon, Omega + epsilon];
    let x = std::array::from_fn(|i| if i % 2 == 0 { angles[i / 2] } else { 0.0 });
    (Assembly { members, closures, closed: 3 }, x)
}

fn squeezer_loads(k: &K<7>, i: usize, link: &mut mechanics::Loaded<f64, 2, 1>) {
    if i == 0 {
        link.drive(&Vector::<f64, 1>::new(0.033));
    } else if i == 2 {
        let spring = SpringDamper { k: 4530.0, c: None, l0: 0.07785, F_pre: 0.0 };
        let D = k.point(&Place { element: 2, point: v(0.02, -0.018) });
        let (r, _) = k.motion(2, &D);
        let state = spring.state(&(v(0.014, 0.072) - r), &V2::zeros()).expect("the spring has a length");
        link.add(&D, &Load::force(state.e * state.F_s));
    }
}

/// Published start accelerations and end values at 0.03 s (PSIDE, 1e-14), relative 1e-6.
#[test]
fn andrews_squeezer_reproduces_the_published_solution() {
    let (assembly, mut x) = squeezer();
    let roots = vec![v(0.0, 0.0), v(-0.03635, 0.03273), v(-0.06934, -0.00227)];
    let squeezer = Linkage {
        assembly,
        roots,
        gravity: v(0.0, 0.0),
        loads: squeezer_loads,
        project: true,
        deficient: Cell::new(0),
    };
    let start = squeezer.rhs(0.0, &x).expect("regular");
    assert!((start[1] - 14222.44391995).abs() < 1e-3, "beta'' {}", start[1]);
    assert!((start[3] - start[1] + 10666.83293997).abs() < 1e-3, "Theta'' {}", start[3] - start[1]);
    let settings = Settings { method: Method::Dopri5, step: 1.0, rtol: 1e-10, atol: 1e-12 };
    let mut solver = Solver::new(settings).expect("settings");
    solver.advance(&squeezer, 0.0, 0.03, &mut x, &mut Statistics::default()).expect("moves");
    let [beta, K2, gamma, delta, K4, epsilon, K6] = [0, 2, 4, 6, 8, 10, 12].map(|i| x[i]);
    let published = [
        (beta, 15.81077119629904),
        (K2 - beta, -15.75637105984298),
        (gamma, 0.04082224013073101),
        (K4 - delta, -0.5347301163226948),
        (delta, 0.5244099658805304),
        (K6 - epsilon, 0.5347301163226948),
        (epsilon, 1.048080741042263),
    ];
    for (ours, theirs) in published {
        assert!((ours - theirs).abs() < 1e-6 * theirs.abs(), "{ours} against {theirs}");
    }
}
