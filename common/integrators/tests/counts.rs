//! What a run costs, counted exactly.

mod common;

use common::{Kepler, Linear, distance, solver};
use integrators::{Crossing, Indicators, Jacobian, Method, Ode, Reached, Statistics};
use std::cell::Cell;
use std::convert::Infallible;

/// Rotation by 1 rad/s that counts its own calls and may put the state back on the unit circle.
#[derive(Default)]
struct Rotation {
    projects: bool,
    evaluations: Cell<u64>,
    projections: Cell<u64>,
}

impl Ode<2> for Rotation {
    type Error = Infallible;

    fn rhs(&self, _t: f64, x: &[f64; 2]) -> Result<[f64; 2], Infallible> {
        self.evaluations.set(self.evaluations.get() + 1);
        Ok([-x[1], x[0]])
    }

    fn jacobian(&self, _t: f64, _x: &[f64; 2], _f: &[f64; 2]) -> Result<Jacobian<2>, Infallible> {
        Ok(([[0.0, -1.0], [1.0, 0.0]], [0.0; 2]))
    }

    fn linear(&self) -> bool {
        true
    }

    fn project(&self, _t: f64, x: &mut [f64; 2]) -> Result<bool, Infallible> {
        self.projections.set(self.projections.get() + 1);
        if self.projects {
            let r = x[0].hypot(x[1]);
            *x = x.map(|x| x / r);
        }
        Ok(self.projects)
    }
}

fn run(method: Method, projects: bool, tolerance: f64) -> (Rotation, Statistics, [f64; 2]) {
    let ode = Rotation { projects, ..Rotation::default() };
    let (mut x, mut statistics) = ([1.0, 0.0], Statistics::default());
    solver(method, 0.1, tolerance).advance(&ode, 0.0, 3.0, &mut x, &mut statistics).expect("linear problem");
    (ode, statistics, x)
}

#[test]
fn fixed_steps_cost_two_and_four_evaluations() {
    for (method, stages) in [(Method::Heun, 2), (Method::Rk4, 4)] {
        assert_eq!(u64::from(method.stages()), stages);
        let (ode, statistics, _) = run(method, false, 1.0);
        assert_eq!(
            statistics,
            Statistics { steps: 30, rejected: 0, rhs_evaluations: 30 * stages, ..Statistics::default() }
        );
        assert_eq!(ode.evaluations.get(), 30 * stages);
    }
}

/// Six per trial, one for the first slope, one for the guess of the first step.
#[test]
fn dopri5_reuses_its_last_stage() {
    let (ode, statistics, _) = run(Method::Dopri5, false, 1e-8);
    assert!(statistics.steps > 10);
    assert_eq!(statistics.rhs_evaluations, 2 + 6 * (statistics.steps + statistics.rejected));
    assert_eq!(ode.evaluations.get(), statistics.rhs_evaluations);
}

/// Seven per step: the slope at the projected state is a new one; none is needed after the last step.
#[test]
fn dopri5_evaluates_anew_after_a_projection() {
    let (ode, statistics, x) = run(Method::Dopri5, true, 1e-8);
    assert_eq!(statistics.rejected, 0);
    assert_eq!(statistics.rhs_evaluations, 1 + 7 * statistics.steps);
    assert_eq!(ode.evaluations.get(), statistics.rhs_evaluations);
    assert!((x[0].hypot(x[1]) - 1.0).abs() <= f64::EPSILON);
}

#[test]
fn projection_is_called_once_per_accepted_step() {
    for method in Method::ALL {
        let (ode, statistics, _) = run(method, false, 1e-8);
        assert_eq!(ode.projections.get(), statistics.steps);
    }
}

/// `n = max(1, ceil(H/step - 1e-9))`: host steps that differ from a multiple in the last bits do not cost a step.
#[test]
fn step_count_forgives_rounding() {
    for (span, steps) in
        [(0.1, 1), (0.1 + 1e-13, 1), (0.1 + 1e-8, 2), (0.05, 1), (1e-9, 1), (0.3, 3), (1.6, 16)]
    {
        let (mut x, mut statistics) = ([1.0, 0.0], Statistics::default());
        let ode = Linear::OSCILLATOR;
        solver(Method::Heun, 0.1, 1.0)
            .advance(&ode, 7.0, 7.0 + span, &mut x, &mut statistics)
            .expect("linear");
        assert_eq!(statistics.steps, steps, "{span}");
    }
}

#[test]
fn empty_interval_costs_nothing() {
    for method in Method::ALL {
        let (mut x, mut statistics) = ([1.0, 0.5], Statistics::default());
        solver(method, 0.1, 1.0)
            .advance(&Linear::OSCILLATOR, 7.0, 7.0, &mut x, &mut statistics)
            .expect("linear");
        assert_eq!((x, statistics), ([1.0, 0.5], Statistics::default()));
    }
}

/// A rejected step costs six evaluations more; the count is that of the right-hand side itself.
#[test]
fn rejections_are_counted() {
    let orbit = Kepler { e: 0.9 };
    let (mut x, mut statistics) = (orbit.exact(0.0), Statistics::default());
    solver(Method::Dopri5, 1.0, 1e-6).advance(&orbit, 0.0, 12.0, &mut x, &mut statistics).expect("smooth");
    assert!(statistics.rejected > 0);
    assert_eq!(statistics.rhs_evaluations, 2 + 6 * (statistics.steps + statistics.rejected));
}

/// The step size of one call starts the next one: short calls cost one step each and no guess after the first.
#[test]
fn proposal_lives_on_between_calls() {
    let ode = Linear::OSCILLATOR;
    let (mut x, mut statistics) = ([1.0, 0.0], Statistics::default());
    let mut solver = solver(Method::Dopri5, 1.0, 1e-6);
    solver.advance(&ode, 0.0, 10.0, &mut x, &mut statistics).expect("linear");
    let natural = solver.memory().step;
    let before = statistics;
    for i in 0..100 {
        let t = 10.0 + 0.01 * f64::from(i);
        solver.advance(&ode, t, t + 0.01, &mut x, &mut statistics).expect("linear");
    }
    assert_eq!(statistics.steps - before.steps, 100);
    assert_eq!(statistics.rhs_evaluations - before.rhs_evaluations, 700);
    assert!(solver.memory().step >= natural, "a short call does not shrink the proposal");
    assert!(distance(&x, &ode.exact(11.0, &[1.0, 0.0])) < 20.0 * 1e-6); // one tolerance per step
}

/// The last two steps are equal: no tiny rest.
#[test]
fn last_steps_are_balanced() {
    let ode = Linear::OSCILLATOR;
    for t_end in [1.0, 3.0, 5.0, 7.7] {
        let (mut x, mut statistics, mut steps) = ([1.0, 0.0], Statistics::default(), Vec::new());
        solver(Method::Dopri5, 1.0, 1e-6)
            .advance_dense(&ode, 0.0, t_end, &mut x, &mut statistics, |step| {
                steps.push(step.h);
            })
            .expect("linear");
        let [.., one, other] = steps[..] else { panic!("at least two steps") };
        assert!((one - other).abs() < 1e-12 || other >= one, "{steps:?}");
        assert!((steps.iter().sum::<f64>() - t_end).abs() < 1e-12);
    }
}

struct Height;

impl Indicators<2, 1> for Height {
    fn indicators(&self, _t: f64, x: &[f64; 2]) -> [f64; 1] {
        [x[0]]
    }
}

/// A call that ends in an event counts the shortened step as one, projects once, and counts the repeated steps.
#[test]
fn event_location_is_counted() {
    for method in Method::ALL {
        let ode = Rotation::default();
        let (mut x, mut statistics) = ([1.0, 0.0], Statistics::default());
        let reached =
            solver(method, 0.1, 1e-9).advance_until(&ode, &Height, 0.0, 3.0, &mut x, &mut statistics);
        assert!(matches!(reached, Ok(Reached::Event { which: [Crossing::Falling], .. })));
        assert_eq!(ode.evaluations.get(), statistics.rhs_evaluations);
        assert_eq!(ode.projections.get(), statistics.steps);
        let least = u64::from(method.stages()) * statistics.steps;
        eprintln!("{method:?}: {} evaluations, {least} without the event", statistics.rhs_evaluations);
        // the root is known from the dense output: a handful of repeated steps narrows it to the resolution of time
        assert!(statistics.rhs_evaluations <= least + 12 * u64::from(method.stages()));
    }
}
