//! Model Exchange: the equations are those of the own solver, events are found and carried out.

use export_tests::Named;
use export_tests::ball::{Ball, G};
use fmu_export::Interface::{CoSimulation, ModelExchange};
use fmu_export::{Fault, Status};
use model::{Kind, Model};
use models::suspension::DoubleWishbone;

/// One step of the classical Runge-Kutta method through the functions of Model Exchange.
fn rk4<M: Model>(fmu: &mut Named<M>, h: f64) {
    let (t, n) = (fmu.instance.time(), fmu.instance.state_count());
    let mut x = vec![0.0; n];
    fmu.instance.get_continuous_states(&mut x).expect("states");
    let mut sum = vec![0.0; n];
    let mut k = vec![0.0; n];
    for (c, weight) in [(0.0, 1.0), (0.5, 2.0), (0.5, 2.0), (1.0, 1.0)] {
        let stage: Vec<_> = x.iter().zip(&k).map(|(x, k)| x + c * h * k).collect();
        fmu.instance.set_time(t + c * h).expect("time");
        fmu.instance.set_continuous_states(&stage).expect("states");
        fmu.instance.get_derivatives(&mut k).expect("derivatives");
        for (s, k) in sum.iter_mut().zip(&k) {
            *s += weight * k;
        }
    }
    let end: Vec<_> = x.iter().zip(&sum).map(|(x, s)| x + h / 6.0 * s).collect();
    fmu.instance.set_time(t + h).expect("time");
    fmu.instance.set_continuous_states(&end).expect("states");
}

const SETTINGS: &[&[(&str, f64)]] = &[
    &[("stabilisation.kind", 1.0)],
    &[("stabilisation.kind", 2.0)],
    &[("closure.kind", 2.0), ("closure.k", 1e5), ("closure.c", 100.0)],
    &[("scene.motion", 2.0), ("use.tie", 1.0), ("stabilisation.kind", 2.0)],
    &[("scene.motion", 2.0), ("arm.joint", 2.0), ("carrier.joint", 2.0), ("stabilisation.kind", 1.0)],
];

fn started(interface: fmu_export::Interface, settings: &[(&str, f64)]) -> Named<DoubleWishbone> {
    let mut fmu = Named::<DoubleWishbone>::with_interface(interface);
    let common = [("solver.step", 0.002), ("P.F.y", 20.0), ("P.F.z", 50.0), ("P.M.xx", 2.0)];
    for (name, value) in common.iter().chain(settings) {
        fmu.set(name, *value).expect("setting");
    }
    fmu.initialize().expect("start");
    if interface == ModelExchange {
        fmu.pass_event_mode(interface).expect("Continuous-Time Mode");
    }
    fmu
}

/// Steps done by hand and by doStep agree. Rounding of sums in another order: 1e-15 of values below 10,
/// over five steps; a quaternion is normalised after each step inside only.
#[test]
fn states_and_derivatives_are_those_of_the_own_solver() {
    for settings in SETTINGS {
        let mut own = started(CoSimulation, settings);
        let mut foreign = started(ModelExchange, settings);
        for step in 0..5 {
            own.step(0.002).expect("a step");
            rk4(&mut foreign, 0.002);
            if foreign.instance.completed_integrator_step().expect("done") {
                foreign.instance.enter_event_mode().expect("Event Mode");
                foreign.pass_event_mode(ModelExchange).expect("normalised");
            }
            let names: Vec<_> =
                own.table().variables().iter().map(|v| (v.name.clone(), v.entry.kind)).collect();
            let (a, b) = (own.everything().expect("values"), foreign.everything().expect("values"));
            let floats = names.iter().filter(|(_, k)| *k == Kind::Float64);
            for ((name, _), (a, b)) in floats.zip(a.iter().zip(&b)) {
                let tolerance = if name.starts_with("loop.") { 1e-9 } else { 1e-12 };
                let scale = 1.0 + a.abs() + f64::from(u8::from(name.contains("F."))) * 1e3;
                assert!(
                    (a - b).abs() <= tolerance * scale,
                    "{settings:?}, step {step}: {name} is {a} and {b}"
                );
            }
        }
    }
}

/// States of joint kinds that are not used keep their values, whatever a host sets.
#[test]
fn unused_states_stay() {
    let mut fmu = started(ModelExchange, &[]);
    let n = fmu.instance.state_count();
    assert_eq!(n, 24);
    let (mut x, mut x_dot) = (vec![0.0; n], vec![0.0; n]);
    fmu.instance.get_continuous_states(&mut x).expect("states");
    let moved: Vec<_> = x.iter().map(|x| x + 1e-3).collect();
    fmu.instance.set_continuous_states(&moved).expect("states");
    fmu.instance.get_derivatives(&mut x_dot).expect("derivatives");
    let mut after = vec![0.0; n];
    fmu.instance.get_continuous_states(&mut after).expect("states");
    let unused = (0..n).filter(|i| after[*i].to_bits() == x[*i].to_bits());
    let unused: Vec<_> = unused.collect();
    assert_eq!(unused.len(), 24 - 9, "planar motion has 9 states");
    assert!(unused.iter().all(|i| x_dot[*i].abs() <= 0.0));
    let variables = fmu.table().states().to_vec();
    for (i, reference) in variables.iter().enumerate() {
        let name = fmu.table().variables()[*reference].name.clone();
        assert_eq!(fmu.get(&name).expect("value").to_bits(), after[i].to_bits(), "{name}");
    }
    let mut nominals = vec![0.0; n];
    fmu.instance.get_nominals(&mut nominals).expect("nominals");
    assert!(nominals.iter().all(|v| *v > 0.0 && v.is_finite()));
}

#[test]
fn a_state_that_is_not_finite_is_refused_by_name_and_changes_nothing() {
    let mut fmu = started(ModelExchange, &[]);
    let mut x = vec![0.0; fmu.instance.state_count()];
    fmu.instance.get_continuous_states(&mut x).expect("states");
    let before = x.clone();
    x[0] = 1.0;
    x[2] = f64::NAN;
    let fault = fmu.instance.set_continuous_states(&x).expect_err("refused");
    assert_eq!(fault.status(), Status::Discard);
    assert!(fault.to_string().contains("lower.angle_rate.theta"), "{fault}");
    fmu.instance.get_continuous_states(&mut x).expect("states");
    assert_eq!(x, before);
    for t in [f64::NAN, f64::INFINITY] {
        assert!(matches!(fmu.instance.set_time(t), Err(Fault::Argument { .. })));
    }
}

/// Free fall from 1.25 m at 10 m/s2 lands after 0.5 s with 5 m/s; four fifths of it are left.
#[test]
fn a_crossed_indicator_is_an_event_that_changes_states() {
    let mut ball = Named::<Ball>::with_interface(ModelExchange);
    ball.initialize().expect("start");
    ball.pass_event_mode(ModelExchange).expect("start");
    assert_eq!(ball.instance.indicator_count(), 1);
    let mut z = [0.0];
    rk4(&mut ball, 0.4);
    ball.instance.get_indicators(&mut z).expect("indicator");
    assert!((z[0] - 0.45).abs() < 1e-15);
    // entering Event Mode without a crossing changes nothing but the orientation, which is astray
    assert!(ball.instance.completed_integrator_step().expect("done"));
    ball.instance.enter_event_mode().expect("Event Mode");
    assert!(ball.instance.update_discrete_states().expect("update").states_changed);
    assert!((ball.get("v").expect("v") + 4.0).abs() < 1e-14);
    assert!((ball.get("q").expect("q") - 1.0).abs() <= 0.0);
    ball.pass_event_mode(ModelExchange).expect("again");
    assert!(!ball.instance.completed_integrator_step().expect("done"));
    rk4(&mut ball, 0.1 + 1e-12);
    ball.instance.enter_event_mode().expect("Event Mode");
    let event = ball.instance.update_discrete_states().expect("update");
    assert!(event.states_changed && !event.again && event.next.is_none());
    assert!((ball.get("v").expect("v") - 0.8 * 0.5 * G).abs() < 1e-10);
    // leaving the ground is no event
    ball.pass_event_mode(ModelExchange).expect("again");
    rk4(&mut ball, 0.1);
    ball.instance.enter_event_mode().expect("Event Mode");
    let v = ball.get("v").expect("v");
    ball.instance.update_discrete_states().expect("update");
    assert!((ball.get("v").expect("v") - v).abs() <= 0.0);
}

/// A time event is announced and carried out at its time, once; Co-Simulation passes it by itself.
#[test]
fn a_time_event_is_announced_and_carried_out() {
    let mut ball = Named::<Ball>::with_interface(ModelExchange);
    ball.set("kick.time", 0.25).expect("kick");
    ball.initialize().expect("start");
    let event = ball.instance.update_discrete_states().expect("update");
    assert_eq!(event.next, Some(0.25));
    ball.instance.enter_continuous_time_mode().expect("mode");
    rk4(&mut ball, 0.25);
    ball.instance.enter_event_mode().expect("Event Mode");
    let event = ball.instance.update_discrete_states().expect("update");
    assert!(event.states_changed && event.next.is_none());
    assert!((ball.get("v").expect("v") + 1.5).abs() < 1e-14);

    let mut own = Named::<Ball>::default();
    own.set("kick.time", 0.25).expect("kick");
    own.initialize().expect("start");
    own.step(0.4).expect("a step");
    assert!((own.get("v").expect("v") + 3.0).abs() < 1e-13);
}

/// Saving and restoring includes mode, time, states, discrete states and sides of the indicators.
#[test]
fn restore_repeats_a_run_to_the_bit() {
    let mut ball = Named::<Ball>::with_interface(ModelExchange);
    ball.set("kick.time", 0.6).expect("kick");
    ball.initialize().expect("start");
    ball.pass_event_mode(ModelExchange).expect("start");
    rk4(&mut ball, 0.3);
    let saved = ball.instance.save();
    let on = |ball: &mut Named<Ball>| {
        rk4(ball, 0.3);
        ball.instance.enter_event_mode().expect("Event Mode");
        ball.pass_event_mode(ModelExchange).expect("update");
        rk4(ball, 0.1);
        ball.everything().expect("values").into_iter().map(f64::to_bits).collect::<Vec<_>>()
    };
    let first = on(&mut ball);
    ball.instance.enter_event_mode().expect("Event Mode");
    ball.instance.restore(&saved).expect("restored");
    assert_eq!(on(&mut ball), first);
    let mut other = Named::<Ball>::default();
    assert!(matches!(other.instance.restore(&saved), Err(Fault::ForeignState { .. })));
}

#[test]
fn only_continuous_inputs_change_between_events() {
    let mut fmu = started(ModelExchange, &[]);
    fmu.set("P.F.z", 3.0).expect("an input");
    for name in ["strut.c", "port.reset", "port.inputs"] {
        let fault = fmu.set(name, 1.0).expect_err("refused");
        assert_eq!(fault.status(), Status::Error);
        assert!(fault.to_string().contains(name), "{fault}");
    }
    fmu.instance.enter_event_mode().expect("Event Mode");
    for name in ["strut.c", "port.reset", "port.inputs"] {
        fmu.set(name, 1.0).expect("in Event Mode");
    }
}

/// FMI 3.0.2, 3.2.1: states may be set one by one in Continuous-Time Mode, and only there; guesses before initialisation.
#[test]
fn a_single_state_is_set_like_all_of_them() {
    let name = "lower.angle_rate.theta";
    let mut one = started(ModelExchange, &[]);
    let mut all = started(ModelExchange, &[]);
    let mut x = vec![0.0; all.instance.state_count()];
    all.instance.get_continuous_states(&mut x).expect("states");
    let i = all.table().states().iter().position(|s| all.table().variables()[*s].name == name);
    x[i.expect("a state")] = 0.25;
    all.instance.set_continuous_states(&x).expect("states");
    one.set(name, 0.25).expect("a state in Continuous-Time Mode");
    let (one_by_one, together) = (one.everything().expect("values"), all.everything().expect("values"));
    assert_eq!(one_by_one, together);
    one.instance.enter_event_mode().expect("Event Mode");
    assert_eq!(one.set(name, 0.5).expect_err("refused").status(), Status::Error);

    let mut starting = Named::<DoubleWishbone>::with_interface(ModelExchange);
    starting.set(name, 0.1).expect("a guess");
    starting.instance.enter_initialization(0.0, None).expect("Initialization Mode");
    let fault = starting.set(name, 0.2).expect_err("refused");
    assert!(fault.status() == Status::Error && fault.to_string().contains("initial = approx"), "{fault}");
}

/// A quaternion whose length overflows cannot be normalised: the event is discarded and the states stay.
#[test]
fn an_event_that_would_break_the_states_is_discarded() {
    let mut fmu = started(ModelExchange, &[("scene.motion", 2.0), ("carrier.joint", 1.0)]);
    let mut x = vec![0.0; fmu.instance.state_count()];
    fmu.instance.get_continuous_states(&mut x).expect("states");
    let before = x.clone();
    x.fill(1e200);
    fmu.instance.set_continuous_states(&x).expect("finite");
    fmu.instance.enter_event_mode().expect("Event Mode");
    let mut set = vec![0.0; x.len()];
    fmu.instance.get_continuous_states(&mut set).expect("states");
    assert_ne!(set, before);
    let fault = fmu.instance.update_discrete_states().expect_err("discarded");
    assert!(fault.status() == Status::Discard && fault.to_string().contains("orientation"), "{fault}");
    let mut after = vec![0.0; x.len()];
    fmu.instance.get_continuous_states(&mut after).expect("states");
    assert_eq!(after, set);
}
