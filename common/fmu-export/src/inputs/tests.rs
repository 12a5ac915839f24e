//! The polynomials are the ones that the samples came from.

use proptest::prelude::*;

use super::*;

/// Two plain inputs, a discrete one, and a port in one coordinate with its acceleration.
const NAMES: [&str; 6] = ["P.F.x", "chassis.a.z", "trigger", "P.s", "P.v", "P.a"];
const N: usize = NAMES.len();

fn channels() -> Channels {
    let of = |(i, name): (usize, &&'static str)| (*name, i != 2, f64::NEG_INFINITY, f64::INFINITY, 1.0);
    Channels::new(NAMES.iter().enumerate().map(of))
}

fn treatment(inputs: InputTreatment, order: i32) -> PortParameters {
    PortParameters { inputs, order, integrate_motion: true, limit: 0.0 }
}

/// Polynomial with coefficients `c`, its first and second integrals from 0.
fn value(c: &[f64], t: f64) -> f64 {
    c.iter().rev().fold(0.0, |sum, c| sum * t + c)
}

fn integral(c: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0];
    out.extend(c.iter().zip(1..).map(|(c, n)| c / f64::from(n)));
    out
}

/// All inputs at `t`: polynomials `c`; motion is the integral of the acceleration `c`.
fn inputs(c: &[f64], t: f64) -> [f64; N] {
    let (v, s) = (integral(c), integral(&integral(c)));
    let moved = |p: &[f64]| value(p, t);
    [value(c, t), -value(c, t), 1.0, 5.0 + moved(&s), moved(&v), value(c, t)]
}

struct Course {
    channels: Channels,
    history: History,
    polynomials: Polynomials,
}

impl Course {
    /// A history of samples at `times` on the polynomial `c`.
    fn sampled(c: &[f64], times: &[f64]) -> Self {
        let channels = channels();
        let mut history = History::new(N);
        for t in times {
            history.push(*t, &inputs(c, *t));
        }
        Self { polynomials: Polynomials::new(&channels), channels, history }
    }

    /// Inputs at `t` of a step for which `u` was set.
    fn at(&mut self, p: &PortParameters, (from, to): (f64, f64), u: &[f64; N], t: f64) -> [f64; N] {
        let span = Span { from, to };
        self.polynomials.plan(&self.channels, &self.history, p, span, u, false);
        let mut values = *u;
        self.polynomials.evaluate(t, &mut values);
        values
    }
}

fn close(a: [f64; N], b: [f64; N], tolerance: f64) -> Result<(), TestCaseError> {
    for (i, (a, b)) in a.iter().zip(&b).enumerate() {
        prop_assert!((a - b).abs() <= tolerance, "{}: {a} against {b}", NAMES[i]);
    }
    Ok(())
}

/// Times of samples with unequal steps, and a fraction of the last step.
fn times() -> impl Strategy<Value = ([f64; 4], f64)> {
    (prop::array::uniform4(0.02..0.2_f64), 0.0..=1.0_f64).prop_map(|(h, theta)| {
        let mut t = 0.0;
        (
            h.map(|h| {
                t += h;
                t
            }),
            theta,
        )
    })
}

// Divided differences of steps above 0.02 s amplify the rounding of values below 30 by up to
// 2^3 / (0.02^3) of their last bits, and the extrapolation multiplies by (0.2)^3 again.
const ROUNDING: f64 = 1e-9;

proptest! {
    /// Degree k is extrapolated exactly from k + 1 samples, whatever the step sizes; so are the
    /// integrals of the acceleration.
    #[test]
    fn extrapolation_reproduces_polynomials(
        (t, theta) in times(),
        c in prop::array::uniform3(-3.0..3.0_f64),
        order in 0..=2_i32,
    ) {
        let c = &c[..=usize::try_from(order).expect("small")];
        let mut course = Course::sampled(c, &t[..2]);
        let at = t[2] + theta * (t[3] - t[2]);
        let p = treatment(InputTreatment::Extrapolate, order);
        close(course.at(&p, (t[2], t[3]), &inputs(c, t[2]), at), inputs(c, at), ROUNDING)?;
    }

    /// Degree k is interpolated exactly from k samples and the value at the end.
    #[test]
    fn interpolation_to_the_end_reproduces_polynomials(
        (t, theta) in times(),
        c in prop::array::uniform4(-3.0..3.0_f64),
        order in 1..=3_i32,
    ) {
        let c = &c[..=usize::try_from(order).expect("small")];
        let mut course = Course::sampled(c, &t[..3]);
        let at = t[2] + theta * (t[3] - t[2]);
        let p = treatment(InputTreatment::Endpoint, order);
        close(course.at(&p, (t[2], t[3]), &inputs(c, t[3]), at), inputs(c, at), ROUNDING)?;
    }
}

/// With fewer samples than the order needs, the degree is lower: one sample holds, two go on straight.
#[test]
fn a_short_history_lowers_the_degree() {
    let c = [1.0, 2.0, -3.0];
    let p = treatment(InputTreatment::Extrapolate, 2);
    let mut course = Course::sampled(&c, &[]);
    let u = inputs(&c, 0.5);
    assert!((course.at(&p, (0.5, 0.6), &u, 0.6)[0] - u[0]).abs() < 1e-15);
    let mut course = Course::sampled(&c, &[0.4]);
    let slope = (value(&c, 0.5) - value(&c, 0.4)) / 0.1;
    assert!((course.at(&p, (0.5, 0.6), &u, 0.6)[0] - (u[0] + 0.1 * slope)).abs() < 1e-14);
}

/// At the start of an extrapolated and the end of an interpolated step stands what was set, to the bit.
#[test]
fn the_set_value_is_met_exactly() {
    let c = [0.1, 0.2, 0.3];
    let mut course = Course::sampled(&c, &[0.1, 0.2]);
    let u = inputs(&c, 0.3);
    let extrapolate = treatment(InputTreatment::Extrapolate, 2);
    let endpoint = treatment(InputTreatment::Endpoint, 2);
    let start = course.at(&extrapolate, (0.3, 0.4), &u, 0.3);
    let end = course.at(&endpoint, (0.2, 0.3), &u, 0.3);
    for i in 0..2 {
        assert_eq!((start[i].to_bits(), end[i].to_bits()), (u[i].to_bits(), u[i].to_bits()));
    }
}

#[test]
fn equal_samples_move_nothing() {
    let mut course = Course::sampled(&[2.0], &[]);
    let mut u = inputs(&[2.0], 0.0);
    u[4] = 0.0;
    u[5] = 0.0;
    for t in [0.0, 0.1, 0.2, 0.3] {
        course.history.push(t, &u);
    }
    assert!(course.history.settled());
    course.at(&treatment(InputTreatment::Extrapolate, 2), (0.3, 0.4), &u, 0.4);
    assert!(course.polynomials.constant());
}

/// Discrete inputs are held whatever their samples say.
#[test]
fn discrete_inputs_are_held() {
    let mut course = Course::sampled(&[0.0, 1.0], &[0.0]);
    let mut u = inputs(&[0.0, 1.0], 0.1);
    u[2] = 7.0;
    let at = course.at(&treatment(InputTreatment::Extrapolate, 1), (0.1, 0.2), &u, 0.2);
    assert!((at[2] - 7.0).abs() < 1e-15 && (at[0] - 0.2).abs() < 1e-15);
}

#[test]
fn a_second_sample_at_the_same_time_replaces_the_first() {
    let mut history = History::new(1);
    for (t, u) in [(0.0, 1.0), (0.1, 2.0), (0.2, 3.0), (0.2, 4.0), (0.3, 5.0)] {
        history.push(t, &[u]);
    }
    assert_eq!((history.len, history.t), (3, [0.3, 0.2, 0.1]));
    assert_eq!(history.u, [5.0, 4.0, 2.0]);
}

/// Beyond the limit, relative to the larger of the last two values and the nominal value, an input is
/// held; so it is where it would leave its range.
#[test]
fn the_limit_holds_what_would_go_too_far() {
    let mut course = Course::sampled(&[0.0, 10.0], &[0.0]);
    let u = inputs(&[0.0, 10.0], 0.1); // 1, and 2 at the end
    let mut p = treatment(InputTreatment::Extrapolate, 1);
    for (limit, end) in [(0.0, 2.0), (1.01, 2.0), (0.99, 1.0)] {
        p.limit = limit;
        assert!((course.at(&p, (0.1, 0.2), &u, 0.2)[0] - end).abs() < 1e-14, "{limit}");
    }
    let positive = [("m", true, 0.0, f64::INFINITY, 1.0)];
    let mut history = History::new(1);
    history.push(0.0, &[3.0]);
    let mut course = Polynomials::new(&Channels::new(positive.into_iter()));
    let p = treatment(InputTreatment::Extrapolate, 1);
    let span = Span { from: 0.1, to: 0.2 };
    course.plan(&Channels::new(positive.into_iter()), &history, &p, span, &[1.0], false);
    assert!(course.constant(), "-1 at the end");
}

/// Integrals go on from position and velocity as set, also where the acceleration is constant; without
/// them, positions are extrapolated like any other input.
#[test]
fn motion_is_the_integral_of_acceleration_or_an_input_like_others() {
    let mut course = Course::sampled(&[0.0], &[0.0]);
    let mut u = [0.0; N];
    (u[3], u[4], u[5]) = (1.0, 2.0, 4.0);
    let mut p = treatment(InputTreatment::Hold, 0);
    let at = course.at(&p, (0.1, 0.6), &u, 0.6);
    assert!((at[3] - 2.5).abs() < 1e-15 && (at[4] - 4.0).abs() < 1e-15 && (at[5] - 4.0).abs() < 1e-15);
    p.integrate_motion = false;
    let at = course.at(&p, (0.1, 0.6), &u, 0.6);
    assert_eq!(at.map(f64::to_bits), u.map(f64::to_bits));
}

#[test]
fn orders_that_do_not_fit_the_treatment_are_refused() {
    for (inputs, order, fits) in [
        (InputTreatment::Hold, 3, true),
        (InputTreatment::Extrapolate, 0, true),
        (InputTreatment::Extrapolate, 2, true),
        (InputTreatment::Extrapolate, 3, false),
        (InputTreatment::Endpoint, 0, false),
        (InputTreatment::Endpoint, 3, true),
    ] {
        assert_eq!(treatment(inputs, order).checked().is_ok(), fits, "{inputs:?} {order}");
    }
}
