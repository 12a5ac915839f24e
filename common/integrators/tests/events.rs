//! Events at times known in closed form.

mod common;

use common::events::{Fall, When, event, until};
use common::{Kepler, Pendulum, assert_order_within, fixed, solver};
use integrators::{Crossing, Method, Reached};

const G: f64 = 9.81;

/// A projectile from height 2 m at 3 m/s upwards lands at `(v + sqrt(v^2 + 2 g h))/g`, whatever the steps.
#[test]
fn projectile_lands_on_time() {
    let landing = (3.0 + (9.0 + 2.0 * G * 2.0_f64).sqrt()) / G;
    for method in Method::ALL {
        for step in [0.01, 0.1, 0.7, 5.0] {
            for start in [0.0, 1000.0] {
                let mut x = [2.0, 3.0];
                let ground = When(|_, x: &[f64; 2]| [x[0]]);
                let reached =
                    until(&mut solver(method, step, 1e-9), &Fall, &ground, [start, start + 5.0], &mut x);
                let (t, which) = event(reached);
                // rounding of the height, and of time at 1000 s; both over the speed of 7 m/s
                let bound = 1e-13 + 4.0 * f64::EPSILON * start;
                assert!((t - start - landing).abs() < bound, "{method:?} {step}: {:e}", t - start - landing);
                assert_eq!(which, [Crossing::Falling]);
                assert!(x[0] <= 0.0 && x[0] > -1e-10, "just below the ground: {:e}", x[0]);
            }
        }
    }
}

/// A ball that keeps `e` of its speed at each bounce lands for the k-th time at `t_1 (1 + 2 (e + .. + e^(k-1)))`.
#[test]
fn ball_bounces_in_geometric_progression() {
    let (h, e) = (1.0_f64, 0.8_f64);
    let first = (2.0 * h / G).sqrt();
    for method in Method::ALL {
        for step in [0.01, 0.3] {
            let mut solver = solver(method, step, 1e-9);
            let (mut t, mut x, mut expected, mut flight) = (0.0, [h, 0.0], first, 2.0 * first);
            for bounce in 0..15 {
                let ground = When(|_, x: &[f64; 2]| [x[0]]);
                (t, _) = event(until(&mut solver, &Fall, &ground, [t, 10.0], &mut x));
                // each landing adds rounding in speed, felt as long as the ball flies
                assert!((t - expected).abs() < 1e-12, "bounce {bounce}: {:e}", t - expected);
                x[1] *= -e;
                flight *= e;
                expected += flight;
                solver.reset();
            }
        }
    }
}

/// The pendulum passes its lowest point after a quarter period, known by the arithmetic-geometric mean (Gauss).
fn quarter_period_errors(method: Method, steps: u32) -> [f64; 4] {
    let exact = Pendulum::quarter_period(2.0);
    [1, 2, 4, 8].map(|k| {
        let h = exact / (f64::from(k * steps) + 0.37); // the event lies inside a step
        let mut x = [2.0, 0.0];
        let mut solver = fixed(method, h);
        let mut t = 0.0;
        loop {
            let lowest = When(|_, x: &[f64; 2]| [x[0]]);
            match until(&mut solver, &Pendulum, &lowest, [t, t + h], &mut x) {
                Reached::End => t += h,
                Reached::Event { t, which } => {
                    assert_eq!(which, [Crossing::Falling]);
                    let speed = -2.0 * 1.0_f64.sin(); // -2 sin(amplitude/2), from the energy
                    return (t - exact).abs() + (x[1] - speed).abs();
                }
            }
        }
    })
}

/// Time and state of an event have the order of the method.
#[test]
fn events_have_the_order_of_the_method() {
    for (method, steps, tolerance) in [
        (Method::Heun, 40, 0.15),
        (Method::Rk4, 20, 0.15),
        (Method::Dopri5, 20, 0.15),
        (Method::Dop853, 3, 0.3),
        (Method::Rodas4, 80, 0.15),
    ] {
        assert_order_within(&quarter_period_errors(method, steps), f64::from(method.order()), tolerance);
    }
}

/// Adaptive steps: the time of an event follows the tolerance.
#[test]
fn event_times_follow_the_tolerance() {
    let orbit = Kepler { e: 0.5 };
    for tolerance in [1e-6, 1e-8, 1e-10] {
        let mut x = orbit.exact(0.0);
        let apocentre = When(|_, x: &[f64; 4]| [x[1]]); // half a turn
        let reached =
            until(&mut solver(Method::Dopri5, 1.0, tolerance), &orbit, &apocentre, [0.0, 6.0], &mut x);
        let (t, which) = event(reached);
        assert_eq!(which, [Crossing::Falling]);
        assert!((t - std::f64::consts::PI).abs() < 100.0 * tolerance, "{t}"); // some ten steps, growing along the track
    }
}
