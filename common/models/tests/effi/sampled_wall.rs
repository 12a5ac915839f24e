//! The sampled wall on a mass with a damper: the controller's own sampler against exact maps and eigenvalues.
//!
//! ```text
//! m x'' + b x' = f,   f = u held over a period, or tau f' = u - f
//! u_k = -K x_k - B (x_k - x_k-1)/T, d samples later
//! ```

use model::{Model, Vector3};
use models::effi::sampler::{Delay, RateFilter, Rendered};
use models::effi::virtual_wall::{self as wall, Wall};
use nalgebra::{DMatrix, DVector};

use crate::csv::{Reference, close};

/// A case.
#[derive(Debug, Clone, Copy)]
struct Loop {
    m: f64,
    b: f64,
    T: f64,
    B: f64,
    delay: usize,
    tau: f64,
}

impl Loop {
    /// States x, v and, with a lag, f; the exact map over a period, and that of the held command.
    fn map(&self) -> (DMatrix<f64>, DVector<f64>) {
        let n = if self.tau > 0.0 { 3 } else { 2 };
        let mut rates = DMatrix::zeros(n + 1, n + 1);
        rates[(0, 1)] = 1.0;
        rates[(1, 1)] = -self.b / self.m;
        if self.tau > 0.0 {
            rates[(1, 2)] = 1.0 / self.m;
            rates[(2, 2)] = -1.0 / self.tau;
            rates[(2, 3)] = 1.0 / self.tau;
        } else {
            rates[(1, 2)] = 1.0 / self.m;
        }
        let whole = (rates * self.T).exp();
        (whole.view((0, 0), (n, n)).into_owned(), whole.view((0, n), (n, 1)).column(0).into_owned())
    }

    /// Spectral radius of the loop with the stiffness `K`.
    fn radius(&self, K: f64) -> f64 {
        let (A, G) = self.map();
        let (n, d) = (G.len(), self.delay);
        let size = n + 1 + d; // x_k-1 and the waiting commands follow
        let mut command = DVector::zeros(size); // u_k = command . state
        command[0] = -K - self.B / self.T;
        command[n] = self.B / self.T;
        let mut next = DMatrix::zeros(size, size);
        next.view_mut((0, 0), (n, n)).copy_from(&A);
        let mut applied = DVector::zeros(size);
        if d == 0 {
            applied.copy_from(&command);
        } else {
            applied[n + d] = 1.0;
            next.row_mut(n + 1).copy_from(&command.transpose());
            for i in 2..=d {
                next[(n + i, n + i - 1)] = 1.0;
            }
        }
        for i in 0..n {
            let force = applied.transpose() * G[i];
            let row = next.row(i) + force;
            next.row_mut(i).copy_from(&row);
        }
        next[(n, 0)] = 1.0;
        // units in which all states are of one size: rounding of the eigenvalues goes with the norm
        let unit = |i: usize| match i {
            1 => 1.0 / self.T,
            2 if n == 3 => K,
            i if i > n => K,
            _ => 1.0,
        };
        for i in 0..size {
            for j in 0..size {
                next[(i, j)] *= unit(j) / unit(i);
            }
        }
        next.complex_eigenvalues().iter().fold(0.0, |r, l| l.norm().max(r))
    }

    /// Smallest stiffness at which the loop stops being stable, searched upwards from `from`.
    fn limit(&self, from: f64) -> f64 {
        let mut high = from;
        while self.radius(high) < 1.0 {
            high *= 1.05;
        }
        let mut low = high / 1.05;
        while high - low > 1e-9 * high {
            let middle = 0.5 * (low + high);
            if self.radius(middle) < 1.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        0.5 * (low + high)
    }

    /// (11)
    fn closed_form(&self) -> f64 {
        let Self { m, b, T, .. } = *self;
        let q = b * T / m;
        let series = q < 1e-3;
        // 1 - E and (1 - E)/q - E
        let gone = -(-q).exp_m1();
        let rest = if series { q * (0.5 - q * (1.0 / 3.0 - q * 0.125)) } else { gone / q - (-q).exp() };
        // 1 - (1 - E)/q
        let ahead = if series { q * (0.5 - q * (1.0 / 6.0 - q / 24.0)) } else { 1.0 - gone / q };
        let (g_1, g_0) = (T * ahead, T * rest);
        let first = b * gone / g_0;
        if g_1 > g_0 { first.min(2.0 * b * (1.0 + (-q).exp()) / (g_1 - g_0)) } else { first }
    }

    /// Growth of the loop of sampler and exact map: the largest excursion of the last tenth of `ticks` over that of the tenth at
    /// half of them.
    fn growth(&self, K: f64, ticks: usize) -> f64 {
        let (A, G) = self.map();
        let lag = self.tau > 0.0;
        let (mut x, mut v, mut f) = (1.0, 0.0, 0.0);
        let (mut rate, mut delay) = (RateFilter::default(), Delay::default());
        let (mut early, mut late) = (0.0_f64, 0.0_f64);
        for k in 0..ticks {
            let u = delay.pass(-K * x - self.B * rate.sample(x, self.T, 1.0), self.delay);
            let third = if lag { [A[(0, 2)], A[(1, 2)], A[(2, 2)]].map(|a| a * f) } else { [0.0; 3] };
            let next = [0, 1].map(|i| A[(i, 0)] * x + A[(i, 1)] * v + third[i] + G[i] * u);
            if lag {
                f = third[2] + G[2] * u;
            }
            [x, v] = next;
            if (ticks / 2..ticks / 2 + ticks / 10).contains(&k) {
                early = early.max(x.abs());
            } else if k >= ticks - ticks / 10 {
                late = late.max(x.abs());
            }
        }
        late / early
    }
}

fn cases() -> Vec<(Loop, [f64; 2])> {
    let reference = Reference::read("wall_boundary");
    let of = |row: &Vec<f64>| {
        let [m, b, T, B, d, tau] = reference.all(row, ["m", "b", "T", "B", "delay", "tau"]);
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "whole and small")]
        let case = Loop { m, b, T, B, delay: d as usize, tau };
        (case, reference.all(row, ["K_stable_max", "K_closed_form"]))
    };
    reference.rows.iter().map(of).collect()
}

/// Eigenvalue boundary within 1e-6, closed form within 1e-9, over the whole table.
#[test]
fn stability_boundary_agrees_with_the_table() {
    for (case, [K_max, closed]) in cases() {
        if K_max.is_finite() {
            let K = case.limit(0.5 * K_max);
            close(&format!("{case:?}"), K, K_max, K_max, 1e-6);
        }
        if closed.is_finite() {
            close(&format!("closed form of {case:?}"), case.closed_form(), closed, closed, 1e-9);
        }
    }
}

/// The sampler's loop decays at 99.9 % of the exact limit and grows at 100.1 %, for 20 sets.
#[test]
fn simulated_limit_is_the_exact_one_within_a_thousandth() {
    let moderate = |case: &Loop| case.b * case.T / case.m > 5e-3;
    let sets: Vec<_> = cases().into_iter().filter(|(case, [K, _])| K.is_finite() && moderate(case)).collect();
    let stride = sets.len() / 20;
    let chosen: Vec<_> = sets.into_iter().step_by(stride).take(20).collect();
    assert_eq!(chosen.len(), 20);
    for (case, [K_max, _]) in chosen {
        // a thousandth of the limit moves the spectral radius by about a thousandth of b T/m
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "up to some millions")]
        let ticks = (2e4 / (case.b * case.T / case.m).min(1.0)) as usize;
        let (below, above) = (case.growth(0.999 * K_max, ticks), case.growth(1.001 * K_max, ticks));
        assert!(below < 1.0 && (above > 1.0 || above.is_nan()), "{case:?}: {below} below, {above} above");
    }
}

struct Run {
    name: &'static str,
    case: Loop,
    K: f64,
    v: f64,
    quantum: f64,
    /// Ticks between rows
    stride: usize,
}

/// The mass meets the wall: position, velocity, force and rendered energy at every row.
fn impact(run: &Run) -> Vec<[f64; 4]> {
    let Run { case, K, v, quantum, stride, .. } = *run;
    let law = wall::Parameters {
        n: Vector3::x(),
        r_w: Vector3::zeros(),
        K,
        B: case.B,
        ..wall::Parameters::default()
    };
    let wall = Wall::new(&law, &model::NoVariables).expect("a wall");
    let (A, G) = case.map();
    let (mut x, mut v) = (0.0, v);
    let (mut rate, mut delay, mut rendered) = (RateFilter::default(), Delay::default(), Rendered::default());
    let mut rows = vec![];
    for k in 0..=400 * stride {
        let measured = if quantum > 0.0 { (x / quantum + 0.5_f64).floor() * quantum } else { x };
        let velocity = rate.sample(measured, case.T, 1.0);
        let F = wall.contact(&Vector3::new(measured, 0.0, 0.0), &Vector3::new(velocity, 0.0, 0.0)).F.x;
        let energy = rendered.sample(x, F);
        let held = delay.pass(F, case.delay);
        if k % stride == 0 {
            rows.push([x, v, F, energy]);
        }
        (x, v) = (A[(0, 0)] * x + A[(0, 1)] * v + G[0] * held, A[(1, 0)] * x + A[(1, 1)] * v + G[1] * held);
    }
    rows
}

/// Exact held-force maps: 1e-9 while the motion is bounded; quantised ones up to the first rounding tie.
#[test]
fn impacts_follow_the_exact_maps() {
    let device = Loop { m: 40.0, b: 300.0, T: 1e-3, B: 0.0, delay: 0, tau: 0.0 };
    let slow = Loop { m: 1.0, b: 5.0, T: 0.01, B: 1.0, ..device };
    let of = |name, case, K, v, quantum, stride| Run { name, case, K, v, quantum, stride };
    for run in [
        of("wall_run_passive", device, 4e5, -0.1, 0.0, 8),
        of("wall_run_passive_q", device, 4e5, -0.1, 1e-5, 8),
        of("wall_run_stiff", device, 1e7, -0.1, 0.0, 1),
        of("wall_run_stiff_q", device, 1e7, -0.1, 1e-5, 1),
        of("wall_run_slow", slow, 800.0, -0.2, 0.0, 1),
        of("wall_run_slow_q", slow, 800.0, -0.2, 1e-5, 1),
    ] {
        let reference = Reference::read(run.name);
        let peaks = ["x", "v", "F", "E_rendered"].map(|name| reference.peak(name));
        for (row, own) in reference.rows.iter().zip(impact(&run)) {
            if row[1].abs() > 1e3 || row.iter().any(|v| v.is_nan()) {
                break; // the last row has no force: nothing follows it
            }
            for (i, value) in own.into_iter().enumerate() {
                let what = format!("{} at t = {}, column {}", run.name, row[0], i + 1);
                close(&what, value, row[i + 1], peaks[i], 1e-9);
            }
        }
    }
}

/// Measured leaks of the specification (section 3), and passivity: the leak stays below what b takes, above the limit it does not.
#[test]
fn leak_of_a_cycle_is_covered_by_the_damper_below_the_limit_only() {
    let device = Loop { m: 40.0, b: 300.0, T: 1e-3, B: 0.0, delay: 0, tau: 0.0 };
    let cases = [
        (1e5, 0.0821, 0.0130),
        (4e5, 0.0959, 0.0306),
        (5.9e5, 0.0998, 0.0383),
        (6.1e5, 0.0999, 0.0395),
        (1.2e6, 0.1066, 0.0590),
    ];
    for (K, exit, leak) in cases {
        let run = Run { name: "", case: device, K, v: -0.1, quantum: 0.0, stride: 1 };
        let rows = impact(&run);
        let out = rows.iter().position(|[x, ..]| *x > 0.0).expect("it leaves");
        let [_, v, _, energy] = rows[out];
        close("exit speed", v, exit, 1.0, 6e-5);
        close("leak", energy, leak, 1.0, 6e-5);
        // rendered energy less the damper's loss is what the mass has gained
        let gained = 20.0 * (v * v - 0.01);
        if K < 2.0 * device.b / device.T {
            assert!(gained <= 1e-9, "K = {K}: net generation of {gained} J");
        } else if K >= 1.2e6 {
            assert!(gained > 0.02, "K = {K}: no net generation");
        }
    }
}
