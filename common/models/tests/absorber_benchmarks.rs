//! Stiff benchmarks of the general Rayleigh-van-der-Pol oscillator by the solvers.
//!
//! ```text
//! m x'' = -kv x - (gamma/2)(nu m x'^2 + mu m W2 x^2 - E2) x'
//! ```

use std::convert::Infallible;

use integrators::{Jacobian, Method, Ode, Settings, Solver, Statistics};

/// The oscillator; `E2` and `W2` are squares of energy and frequency as in the reference's index.
struct Raw {
    m: f64,
    kv: f64,
    gamma: f64,
    nu: f64,
    mu: f64,
    w2: f64,
    e2: f64,
}

impl Ode<2> for Raw {
    type Error = Infallible;
    fn rhs(&self, _t: f64, &[x, w]: &[f64; 2]) -> Result<[f64; 2], Infallible> {
        let Self { m, kv, gamma, nu, mu, w2, e2 } = *self;
        Ok([w, (-kv * x - 0.5 * gamma * (nu * m * w * w + mu * m * w2 * x * x - e2) * w) / m])
    }
    fn jacobian(&self, _t: f64, &[x, w]: &[f64; 2], _f: &[f64; 2]) -> Result<Jacobian<2>, Infallible> {
        let Self { m, kv, gamma, nu, mu, w2, e2 } = *self;
        let by_x = (-kv - gamma * mu * m * w2 * x * w) / m;
        let by_w = -0.5 * gamma * (3.0 * nu * m * w * w + mu * m * w2 * x * x - e2) / m;
        Ok(([[0.0, 1.0], [by_x, by_w]], [0.0, 0.0]))
    }
    /// Velocities of the relaxation oscillations are up to 1e3.
    fn nominal(&self) -> [f64; 2] {
        [1.0, 1.0]
    }
}

fn solver(method: Method, rtol: f64) -> Solver {
    Solver::new(Settings { method, step: 1.0, rtol, atol: rtol }).expect("settings")
}

/// Largest difference of each column, relative to its largest value.
fn errors(raw: &Raw, start: [f64; 2], method: Method, rtol: f64, text: &str) -> [f64; 2] {
    let mut solver = solver(method, rtol);
    let (mut t, mut x, mut statistics) = (0.0, start, Statistics::default());
    let (mut worst, mut peak) = ([0.0_f64; 2], [0.0_f64; 2]);
    for row in text.lines().filter(|line| !line.starts_with('#')).skip(1) {
        let row: Vec<f64> = row.split(',').map(|v| v.parse().expect("a number")).collect();
        solver.advance(raw, t, row[0], &mut x, &mut statistics).expect("the oscillator moves");
        t = row[0];
        for i in 0..2 {
            worst[i] = worst[i].max((x[i] - row[i + 1]).abs());
            peak[i] = peak[i].max(row[i + 1].abs());
        }
    }
    [worst[0] / peak[0], worst[1] / peak[1]]
}

/// y'' = ((1 - y^2) y' - y)/eps.
fn van_der_pol(eps: f64) -> Raw {
    Raw { m: 1.0, kv: 1.0 / eps, gamma: 2.0 / eps, nu: 0.0, mu: 1.0, w2: 1.0, e2: 1.0 }
}

#[test]
fn van_der_pol_with_eps_1e_3_follows_the_reference() {
    let text = include_str!("../../../tests/reference/absorber/vdp_eps1e-3.csv");
    for method in [Method::Radau5, Method::Dop853] {
        let [x, w] = errors(&van_der_pol(1e-3), [2.0, 0.0], method, 1e-11, text);
        assert!(x <= 1e-8 && w <= 1e-8, "{method:?}: {x:.1e} {w:.1e}");
    }
}

/// Classical test set problem, twenty digits at t = 1 and t = 2.
#[test]
fn van_der_pol_with_eps_1e_6_has_the_published_values() {
    let mut solver = solver(Method::Radau5, 1e-11);
    let (mut x, mut statistics) = ([2.0, 0.0], Statistics::default());
    let exact = [
        [-1.863_646_254_808_133_9, 0.753_543_086_543_543_4],
        [1.706_167_732_170_465, -0.892_809_701_024_816_5],
    ];
    for (i, exact) in (0_i32..).zip(exact) {
        let t = f64::from(i);
        solver.advance(&van_der_pol(1e-6), t, t + 1.0, &mut x, &mut statistics).expect("moves");
        for (x, e) in x.iter().zip(exact) {
            assert!((x - e).abs() <= 1e-9, "t = {}: {x} instead of {e}", t + 1.0);
        }
    }
}

#[test]
fn the_general_oscillator_follows_the_reference() {
    let text = include_str!("../../../tests/reference/absorber/general_rvdp.csv");
    let raw = Raw { m: 1.0, kv: 1.0, gamma: 16.0, nu: 0.3, mu: 0.7, w2: 1.0, e2: 1.0 };
    for method in [Method::Radau5, Method::Dop853] {
        let [x, w] = errors(&raw, [0.1, 0.0], method, 1e-11, text);
        assert!(x <= 1e-8 && w <= 1e-8, "{method:?}: {x:.1e} {w:.1e}");
    }
}
