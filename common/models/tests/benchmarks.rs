//! Published benchmarks of multibody codes, built from the elements of the suspension.

#![allow(non_snake_case, clippy::unreadable_literal, reason = "symbols and numbers as published")]

use integrators::{Method, Ode, Settings, Solver, Statistics};
use mechanics::{
    Assembly, AssemblyError, ClosingJoint, Load, Member, Parent, Place, Planar, Rigid, SpringDamper, Vector,
};
use std::cell::Cell;

type V2 = Vector<f64, 2>;

/// An assembly of planar links under gravity and further loads as an initial value problem.
struct Linkage<const B: usize, const C: usize, const W: usize, L> {
    assembly: Assembly<Planar, 2, 1, B, C, W>,
    roots: Vec<V2>,
    gravity: V2,
    /// Further loads: element, its states' kinematics, what to add
    loads: L,
    project: bool,
    /// Evaluations in which the closing joints left a direction undetermined
    deficient: Cell<u32>,
}

type K<const B: usize> = mechanics::KinematicsOf<f64, Planar, 2, 1, B>;

impl<const B: usize, const C: usize, const W: usize, const X: usize, L> Ode<X> for Linkage<B, C, W, L>
where
    L: Fn(&K<B>, usize, &mut mechanics::Loaded<f64, 2, 1>),
{
    type Error = AssemblyError;

    fn rhs(&self, _t: f64, x: &[f64; X]) -> Result<[f64; X], AssemblyError> {
        let k = self.assembly.kinematics(x, |n| (self.roots[n], V2::zeros()));
        let bodies = self.assembly.bodies(&k);
        let tree = self.assembly.tree(
            &k,
            &bodies,
            |i, link| {
                link.add(&bodies[i].com, &Load::force(self.gravity * bodies[i].m));
                (self.loads)(&k, i, link);
            },
            None,
        )?;
        let a = self.assembly.accelerate(&k, tree, &self.assembly.gaps(&k), |_| V2::zeros(), None)?;
        self.deficient.set(self.deficient.get() + u32::from(a.deficient));
        let mut x_dot = [0.0; X];
        self.assembly.derivative(x, &a.q, &mut x_dot);
        Ok(x_dot)
    }

    fn project(&self, _t: f64, x: &mut [f64; X]) -> Result<bool, AssemblyError> {
        if self.project { self.assembly.project(x, |n| self.roots[n]) } else { Ok(false) }
    }
}

fn rigid(m: f64, c: V2, I: f64) -> Rigid<2> {
    let mut I_c = mechanics::Matrix::<f64, 3, 3>::zeros();
    I_c[(1, 1)] = I;
    Rigid { m, c, I_c }
}

fn v(x: f64, z: f64) -> V2 {
    V2::new(x, z)
}

fn none<const B: usize>(_: &K<B>, _: usize, _: &mut mechanics::Loaded<f64, 2, 1>) {}

/// IFToMM A02: N loops of 1 m, 1 kg rods. Elements: uprights 0..=N, then the horizontals.
fn n_four_bar<const B: usize, const N: usize>() -> Assembly<Planar, 2, 1, B, N, 2> {
    assert_eq!(B, 2 * N + 1);
    let rod = rigid(1.0, v(0.5, 0.0), 1.0 / 12.0);
    let tip = v(1.0, 0.0);
    Assembly {
        members: std::array::from_fn(|i| Member {
            joint: Planar,
            rigid: rod,
            parent: if i <= N { Parent::Root(i) } else { Parent::Element(i - N - 1, tip) },
        }),
        closures: std::array::from_fn(|i| ClosingJoint {
            first: Place { element: N + 1 + i, point: tip },
            second: Place { element: i + 1, point: tip },
        }),
        closed: N,
    }
}

/// Start of A02: uprights vertical, B0 moves with +1 m/s along x, horizontals at rest.
fn n_four_bar_start<const X: usize>(n: usize) -> [f64; X] {
    std::array::from_fn(|i| {
        let upright = i / 2 <= n;
        match (upright, i % 2) {
            (true, 0) => std::f64::consts::FRAC_PI_2,
            (true, _) => -1.0,
            _ => 0.0,
        }
    })
}

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
    let roots = (0..=n).map(|i| v(f64::from(i), 0.0)).collect();
    let linkage = Linkage {
        assembly: n_four_bar::<B, N>(),
        roots,
        gravity: v(0.0, -9.81),
        loads: none::<B>,
        project: true,
        deficient: Cell::new(0),
    };
    let mut x: [f64; X] = n_four_bar_start(N);
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
    let (error, fastest, _) = n_four_bar_error::<5, 2, 10>(20.0, 1e-3);
    assert!(error < 1e-6, "B0 off by {error:e} m");
    // 6.8396 m/s at the bottom; the samples are 0.05 s apart, near enough to the top speed
    assert!((fastest - 46.78_f64.sqrt()).abs() < 0.05, "{fastest}");
}

#[test]
fn one_and_forty_loops_follow_the_pendulum() {
    let (error, ..) = n_four_bar_error::<3, 1, 6>(20.0, 1e-3);
    assert!(error < 1e-6, "N = 1: B0 off by {error:e} m");
    let (error, ..) = n_four_bar_error::<81, 40, 162>(4.0, 5e-3);
    assert!(error < 1e-3, "N = 40: B0 off by {error:e} m");
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
