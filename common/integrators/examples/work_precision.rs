//! Work-precision table: final error beside time and counts, as CSV.
//!
//! `cargo run --release -p integrators --example work_precision [problem ...]`; `scripts/bench_cvode.py` runs it beside
//! SUNDIALS CVODE. The error is `max_i |x_i - exact_i| / scale_i`; the time is the shortest of many runs, each with a new
//! solver. `exact` is measured with a transition matrix made in the run, and with one kept from the run before.
#![allow(clippy::print_stdout, reason = "its purpose")]

#[path = "../tests/common/mod.rs"]
mod common;

use common::Pendulum;
use common::stiff::{Beam, VanDerPol};
use integrators::{Method, Ode, Settings, Solver, Statistics, Transition};
use std::fmt::Debug;
use std::hint::black_box;
use std::time::{Duration, Instant};

/// One initial value problem with its solution.
struct Problem<const N: usize, O> {
    name: &'static str,
    ode: O,
    start: [f64; N],
    t_end: f64,
    exact: [f64; N],
    scale: [f64; N],
}

const ADAPTIVE: [Method; 4] = [Method::Dopri5, Method::Dop853, Method::Rodas4, Method::Radau5];
/// Time spent on each line.
const PATIENCE: Duration = Duration::from_millis(150);

fn main() {
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    let asked = |name: &str| wanted.is_empty() || wanted.iter().any(|w| w == name);
    println!(
        "problem,method,rtol,step,error,microseconds,steps,rejected,rhs_evaluations,jacobians,decompositions"
    );
    for (name, eps, exact) in [("vdp_1e-3", 1e-3, VanDerPol::MILD), ("vdp_1e-6", 1e-6, VanDerPol::PUBLISHED)]
    {
        let problem = Problem {
            name,
            ode: VanDerPol { eps },
            start: VanDerPol::START,
            t_end: VanDerPol::T_END,
            exact,
            scale: exact.map(f64::abs),
        };
        if asked(name) {
            // an explicit method needs a million steps at 1e-6
            problem.adaptive(if eps < 1e-4 { &ADAPTIVE[2..] } else { &ADAPTIVE });
        }
    }
    if asked("pendulum") {
        let problem = Problem {
            name: "pendulum",
            ode: Pendulum,
            start: [2.0, 0.0],
            t_end: 4.0 * Pendulum::quarter_period(2.0),
            exact: [2.0, 0.0],
            scale: [2.0, 2.0],
        };
        problem.adaptive(&ADAPTIVE);
        problem.fixed(&[Method::Heun, Method::Rk4], &[0.1, 0.03, 0.01, 0.003, 0.001]);
    }
    if asked("beam") {
        let exact = Beam::exact(Beam::T_END);
        let largest = |part: &[f64]| part.iter().map(|v| v.abs()).fold(0.0, f64::max);
        let (w, v) = exact.split_at(exact.len() / 2);
        let (w, v) = (largest(w), largest(v));
        let problem = Problem {
            name: "beam",
            ode: Beam,
            start: Beam::start(),
            t_end: Beam::T_END,
            exact,
            scale: std::array::from_fn(|i| if i < exact.len() / 2 { w } else { v }),
        };
        problem.adaptive(&ADAPTIVE);
        problem.fixed(&[Method::Rk4], &[1e-4, 3e-5]);
        problem.exact(&[1.0, 0.01, 0.001]);
    }
}

impl<const N: usize, O: Ode<N>> Problem<N, O>
where
    O::Error: Debug,
{
    fn adaptive(&self, methods: &[Method]) {
        for &method in methods {
            for half in 6..=20_i32 {
                let rtol = 10.0_f64.powf(-0.5 * f64::from(half));
                self.line(&format!("{method:?}").to_lowercase(), (method, rtol, 1.0), None);
            }
        }
    }

    fn fixed(&self, methods: &[Method], steps: &[f64]) {
        for &method in methods {
            for &step in steps {
                self.line(&format!("{method:?}").to_lowercase(), (method, 1.0, step), None);
            }
        }
    }

    fn exact(&self, steps: &[f64]) {
        for &step in steps {
            self.line("exact", (Method::Exact, 1.0, step), None);
            self.line("exact_kept", (Method::Exact, 1.0, step), Some(&mut Transition::default()));
        }
    }

    /// Measures and prints.
    fn line(
        &self,
        name: &str,
        (method, rtol, step): (Method, f64, f64),
        mut kept: Option<&mut Transition<N>>,
    ) {
        let settings = Settings { method, step, rtol, atol: rtol };
        let mut run = || {
            let mut solver = Solver::new(settings).expect("valid");
            let (mut x, mut statistics) = (self.start, Statistics::default());
            match &mut kept {
                None => solver.advance(black_box(&self.ode), 0.0, self.t_end, &mut x, &mut statistics),
                Some(kept) => solver.advance_cached(
                    black_box(&self.ode),
                    kept,
                    0.0,
                    self.t_end,
                    &mut x,
                    &mut statistics,
                ),
            }
            .expect("solvable");
            (black_box(x), statistics)
        };
        run();
        let (mut best, mut runs, begin) = (Duration::MAX, 0, Instant::now());
        while runs < 5 || begin.elapsed() < PATIENCE {
            let start = Instant::now();
            run();
            best = best.min(start.elapsed());
            runs += 1;
        }
        let (x, s) = run();
        let error = (0..N).map(|i| ((x[i] - self.exact[i]) / self.scale[i]).abs()).fold(0.0, f64::max);
        let adaptive = method.is_adaptive();
        println!(
            "{},{name},{},{},{error:.3e},{:.3},{},{},{},{},{}",
            self.name,
            if adaptive { format!("{rtol:.1e}") } else { String::new() },
            if adaptive { String::new() } else { format!("{step:e}") },
            best.as_secs_f64() * 1e6,
            s.steps,
            s.rejected,
            s.rhs_evaluations,
            s.jacobians,
            s.decompositions,
        );
    }
}
