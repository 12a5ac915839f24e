//! What counts as an event, and how often.

mod common;

use common::events::{Drift, Fall, When, event, until};
use common::{GENERAL, Kepler, Linear, fixed, solver};
use integrators::{Crossing, Method, Ode, Reached, Settings, Solver, Statistics};
use std::convert::Infallible;

const G: f64 = 9.81;

#[test]
fn earliest_event_wins() {
    let events = When(|t: f64, x: &[f64; 1]| [0.9 - x[0], x[0] - 0.3, 0.31 - t, 0.1 - t]);
    for method in Method::ALL {
        let mut x = [0.0];
        let (t, which) =
            event(until(&mut solver(method, 10.0, 1e-6), &Drift(1.0), &events, [0.2, 2.0], &mut x));
        assert!((t - 0.31).abs() < 1e-14);
        assert_eq!(which, [Crossing::None, Crossing::None, Crossing::Falling, Crossing::None]);
    }
}

/// Indicators that cross together are reported together, however differently they are scaled.
#[test]
fn simultaneous_events_come_together() {
    let events = When(|t: f64, x: &[f64; 1]| [x[0] - 0.7, 1e3 * (0.7 - t), (x[0] - 0.7).powi(3), 0.701 - t]);
    for method in Method::ALL {
        let mut x = [0.0];
        let mut solver = solver(method, 0.1, 1e-6);
        let (t, which) = event(until(&mut solver, &Drift(1.0), &events, [0.0, 2.0], &mut x));
        assert!((t - 0.7).abs() < 1e-3); // the cube is within its band from 0.7 - 4.6e-4 on
        assert_eq!(which, [Crossing::Rising, Crossing::Falling, Crossing::Rising, Crossing::None]);
        // and only once
        let (t, which) = event(until(&mut solver, &Drift(1.0), &events, [t, 2.0], &mut x));
        assert!((t - 0.701).abs() < 1e-14);
        assert_eq!(which, [Crossing::None, Crossing::None, Crossing::None, Crossing::Falling]);
    }
}

/// An indicator that starts at zero, or a rounding beside it, counts only when it has left and comes back.
#[test]
fn start_at_zero_is_no_event() {
    for method in Method::ALL {
        for step in [1e-3, 1.0] {
            for offset in [0.0, 1e-13, -1e-13] {
                let ground = When(|_, x: &[f64; 2]| [x[0]]);
                // thrown up: back at 2 v / g, also when that is a small part of the step
                for speed in [4.0, 0.01] {
                    let mut x = [offset, speed];
                    let (t, which) =
                        event(until(&mut solver(method, step, 1e-9), &Fall, &ground, [0.0, 2.0], &mut x));
                    assert!((t - 2.0 * speed / G).abs() < 1e-13 + 2e-13 / speed, "{method:?}: {t:e}");
                    assert_eq!(which, [Crossing::Falling]);
                }
                // let fall: leaves downwards and stays there
                let mut x = [offset, 0.0];
                let reached = until(&mut solver(method, step, 1e-9), &Fall, &ground, [0.0, 1.0], &mut x);
                assert_eq!(reached, Reached::End);
            }
        }
    }
}

/// After an event the run goes on from the state just behind it, without a second one.
#[test]
fn no_event_comes_twice() {
    for method in Method::ALL {
        let mut solver = solver(method, 0.1, 1e-9);
        let (mut t, mut x, mut times) = (0.0, [1.0, 0.0], Vec::new());
        while t < 20.0 {
            let zero = When(|_, x: &[f64; 2]| [x[0]]);
            match until(&mut solver, &Linear::OSCILLATOR, &zero, [t, 20.0], &mut x) {
                Reached::End => break,
                Reached::Event { t: at, which } => {
                    let falling = times.len() % 2 == 0;
                    assert_eq!(which, [if falling { Crossing::Falling } else { Crossing::Rising }]);
                    times.push(at);
                    t = at;
                }
            }
        }
        assert_eq!(times.len(), 6, "{method:?}: {times:?}"); // pi/2 + k pi below 20
    }
}

/// An event on a communication point is reported by the call that ends there or by the one that starts there: once.
#[test]
fn event_at_the_end_of_a_call_is_seen_once() {
    for method in Method::ALL {
        for step in [0.25, 0.1] {
            for offset in [0.0, 1e-12, -1e-12, 1e-15, -1e-15] {
                let mut solver = solver(method, step, 1e-9);
                let (mut x, mut seen) = ([0.0], Vec::new());
                let mut t = 0.0;
                for end in [0.25, 0.5, 0.75, 1.0] {
                    while t < end {
                        let events = When(|_, x: &[f64; 1]| [x[0] - 0.5 - offset]);
                        match until(&mut solver, &Drift(1.0), &events, [t, end], &mut x) {
                            Reached::End => t = end,
                            Reached::Event { t: at, .. } => {
                                seen.push(at);
                                t = at;
                            }
                        }
                    }
                }
                assert!(seen.len() == 1 && (seen[0] - 0.5).abs() < 1e-10, "{method:?} {offset:e}: {seen:?}");
            }
        }
    }
}

/// Touching zero without crossing is none.
#[test]
fn touching_is_no_event() {
    for method in Method::ALL {
        let mut x = [0.0];
        let touch = When(|t: f64, _: &[f64; 1]| [(t - 0.5).powi(2)]);
        let reached = until(&mut solver(method, 0.125, 1e-6), &Drift(1.0), &touch, [0.0, 1.0], &mut x);
        assert_eq!(reached, Reached::End);
        assert!((x[0] - 1.0).abs() < 1e-15);
    }
}

/// Out and back within one step is found where the excursion spans a quarter of the step.
#[test]
fn two_crossings_within_a_step_are_seen() {
    for method in Method::ALL {
        let mut x = [0.0];
        let slot = When(|t: f64, _: &[f64; 1]| [(t - 0.3) * (t - 0.6)]);
        let mut solver = fixed(method, 1.0);
        let (t, which) = event(until(&mut solver, &Drift(1.0), &slot, [0.0, 1.0], &mut x));
        assert!((t - 0.3).abs() < 1e-14);
        assert_eq!(which, [Crossing::Falling]);
        let (t, which) = event(until(&mut solver, &Drift(1.0), &slot, [t, 1.0], &mut x));
        assert!((t - 0.6).abs() < 1e-14);
        assert_eq!(which, [Crossing::Rising]);
    }
}

/// The way up to the event is the same, bit by bit, as without indicators.
#[test]
fn indicators_do_not_disturb_the_run() {
    for method in GENERAL {
        let orbit = Kepler { e: 0.6 };
        let never = When(|_, _: &[f64; 4]| [1.0]);
        let (mut x, mut y) = (orbit.exact(0.0), orbit.exact(0.0));
        let (mut s, mut r) = (Statistics::default(), Statistics::default());
        let mut one = solver(method, 0.01, 1e-7);
        let mut other = one;
        assert_eq!(one.advance_until(&orbit, &never, 0.0, 7.0, &mut x, &mut s), Ok(Reached::End));
        assert_eq!(other.advance(&orbit, 0.0, 7.0, &mut y, &mut r), Ok(()));
        if method == Method::Dop853 {
            r.rhs_evaluations += 3 * r.steps + 1; // its continuous extension, and the slope at the last state
        }
        assert_eq!((x.map(f64::to_bits), s, one), (y.map(f64::to_bits), r, other));
    }
}

/// Rotation, held on the unit circle: the projection moves the state a little beyond where the step ended.
struct Circle;

impl Ode<2> for Circle {
    type Error = Infallible;
    fn rhs(&self, _t: f64, x: &[f64; 2]) -> Result<[f64; 2], Infallible> {
        Ok([-x[1], x[0]])
    }
    fn project(&self, _t: f64, x: &mut [f64; 2]) -> Result<bool, Infallible> {
        let r = x[0].hypot(x[1]);
        *x = x.map(|x| x / r);
        Ok(true)
    }
}

/// A projection that carries the state over the edge between two steps does not hide the event.
#[test]
fn projection_across_zero_is_seen() {
    // Heun's step of 0.5 leaves the radius at sqrt(1 + h^4/4) = 1.0078: outside 1.004, and back after the projection
    let outside = When(|_, x: &[f64; 2]| [1.004 - x[0].hypot(x[1])]);
    let mut x = [1.0, 0.0];
    let mut solver =
        Solver::new(Settings { method: Method::Heun, step: 0.5, rtol: 1.0, atol: 1.0 }).expect("valid");
    let (t, which) = event(until(&mut solver, &Circle, &outside, [0.0, 2.0], &mut x));
    assert!(t > 0.0 && t < 0.5);
    assert_eq!(which, [Crossing::Falling]);
    assert!((x[0].hypot(x[1]) - 1.0).abs() < 1e-15, "projected at the event");
}
