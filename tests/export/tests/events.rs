//! Event Mode in Co-Simulation: the same numbers as without it, cheap sweeps, events at the end of a step.

use export_tests::ball::Ball;
use export_tests::rod::{EVALUATIONS, Rod};
use export_tests::{Named, Random};
use fmu_export::Interface::{CoSimulation, CoSimulationWithEvents};
use fmu_export::{Fault, Status};
use model::Causality;
use models::suspension::DoubleWishbone;

/// A run with inputs that change at every communication point, all values as bits.
fn run(events: bool, treatment: f64, order: f64) -> Vec<Vec<u64>> {
    let interface = if events { CoSimulationWithEvents } else { CoSimulation };
    let mut fmu = Named::<DoubleWishbone>::with_interface(interface);
    for (name, value) in [
        ("port.inputs", treatment),
        ("port.order", order),
        ("force.kind", 1.0),
        ("force.pulse.duration", 0.1),
    ] {
        fmu.set(name, value).expect("setting");
    }
    fmu.initialize().expect("start");
    if events {
        fmu.pass_event_mode(interface).expect("Step Mode");
    }
    let endpoint = treatment > 2.5;
    let mut samples = Vec::new();
    for i in 0..20 {
        let h = 0.01 * f64::from(1 + i % 3);
        let set = |fmu: &mut Named<DoubleWishbone>, t: f64| {
            fmu.set("P.F.z", 10.0 * (10.0 * t).sin()).expect("input");
            fmu.set("P.M.zz", 1.0 + t).expect("input");
        };
        let t = fmu.instance.time();
        if events {
            fmu.instance.enter_event_mode().expect("Event Mode");
            if !endpoint {
                set(&mut fmu, t);
            }
            fmu.pass_event_mode(interface).expect("Step Mode");
        } else if !endpoint {
            set(&mut fmu, t);
        }
        if endpoint {
            set(&mut fmu, t + h);
        }
        fmu.step(h).expect("a step");
        samples.push(fmu.everything().expect("values").into_iter().map(f64::to_bits).collect());
    }
    samples
}

#[test]
fn event_mode_changes_no_number() {
    for (treatment, order) in [(1.0, 0.0), (2.0, 0.0), (2.0, 1.0), (2.0, 2.0), (3.0, 1.0), (3.0, 3.0)] {
        assert_eq!(
            run(true, treatment, order),
            run(false, treatment, order),
            "port.inputs {treatment}, port.order {order}"
        );
    }
}

/// A sweep computes each group once, and only the groups that depend on what was set.
#[test]
fn a_sweep_computes_what_is_asked_for_and_changed() {
    let mut rod = Named::<Rod>::with_interface(CoSimulationWithEvents);
    rod.initialize().expect("start");
    let counted = |rod: &mut Named<Rod>, set: &[&str], get: &[&str]| {
        let before = EVALUATIONS.with(std::cell::Cell::get);
        for name in set {
            let value = rod.get(name).expect("input");
            rod.set(name, value + 1.0).expect("input");
        }
        for name in get {
            rod.get(name).expect("output");
        }
        let after = EVALUATIONS.with(std::cell::Cell::get);
        [0, 1, 2].map(|i| after[i] - before[i])
    };
    assert_eq!(counted(&mut rod, &["A.s", "A.v"], &["A.F0", "A.M"]), [0, 1, 0]);
    assert_eq!(counted(&mut rod, &["A.a"], &["A.F0", "A.M"]), [0, 0, 0]);
    assert_eq!(counted(&mut rod, &[], &["A.F"]), [0, 0, 1]);
    assert_eq!(counted(&mut rod, &["A.a"], &["A.F", "A.F", "w"]), [0, 0, 1]);
    assert_eq!(counted(&mut rod, &["port.reset"], &["A.F", "A.F0", "w"]), [0, 0, 0]);
    assert_eq!(counted(&mut rod, &["A.s"], &[]), [0, 0, 0]);
    // a value that is set again changes nothing
    let same = rod.get("A.s").expect("input");
    counted(&mut rod, &[], &["A.F", "A.F0"]);
    let before = EVALUATIONS.with(std::cell::Cell::get);
    rod.set("A.s", same).expect("input");
    rod.get("A.F").expect("output");
    assert_eq!(EVALUATIONS.with(std::cell::Cell::get), before);
}

/// After any sequence of Sets every value is the one of an instance in which all groups are computed
/// afresh: the declared dependencies, which say what a Set makes stale, cover locals too.
#[test]
fn lazy_values_are_fresh_values() {
    let mut random = Random(3);
    for settings in [&[][..], &[("scene.motion", 2.0), ("use.tie", 1.0), ("stabilisation.kind", 2.0)]] {
        let mut lazy = Named::<DoubleWishbone>::with_interface(CoSimulationWithEvents);
        for (name, value) in settings {
            lazy.set(name, *value).expect("setting");
        }
        lazy.initialize().expect("start");
        let variables = lazy.table().variables().iter();
        let inputs = variables.filter(|v| v.entry.causality == Causality::Input);
        let inputs: Vec<_> = inputs.map(|v| v.name.clone()).collect();
        let diagonal = |name: &&String| ["xx", "yy", "zz"].iter().any(|d| name.ends_with(d));
        let mut values: Vec<_> = inputs.iter().map(|n| if diagonal(&n) { 30.0 } else { 0.1 }).collect();
        for (name, value) in inputs.iter().zip(&values) {
            lazy.set(name, *value).expect("input");
        }
        for _ in 0..40 {
            let count = f64::from(u32::try_from(inputs.len()).expect("few"));
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "an index")]
            let i = random.between(0.0, count) as usize;
            values[i] += random.between(0.0, 0.5);
            lazy.set(&inputs[i], values[i]).expect("input");
            let got = lazy.everything().expect("values");
            let mut fresh = Named::<DoubleWishbone>::with_interface(CoSimulationWithEvents);
            for (name, value) in settings {
                fresh.set(name, *value).expect("setting");
            }
            for (name, value) in inputs.iter().zip(&values) {
                fresh.set(name, *value).expect("input");
            }
            fresh.initialize().expect("start");
            let bits = |v: Vec<f64>| v.into_iter().map(f64::to_bits).collect::<Vec<_>>();
            assert_eq!(bits(got), bits(fresh.everything().expect("values")), "after {}", inputs[i]);
        }
    }
}

/// An event at the very end of a step waits for Event Mode, so that inputs of that time count; without
/// Event Mode, and with a host that goes on without it, it is carried out all the same.
#[test]
fn an_event_at_the_end_of_a_step_is_left_to_event_mode() {
    let at_end = |interface| {
        let mut ball = Named::<Ball>::with_interface(interface);
        ball.set("kick.time", 0.25).expect("kick");
        ball.initialize().expect("start");
        if interface == CoSimulationWithEvents {
            ball.pass_event_mode(interface).expect("Step Mode");
        }
        assert!(!ball.step(0.125).expect("a step"));
        let left = ball.step(0.125).expect("a step");
        (ball, left)
    };
    let v = |ball: &mut Named<Ball>| ball.get("v").expect("v");
    let (mut plain, left) = at_end(CoSimulation);
    assert!(!left && (v(&mut plain) + 1.5).abs() < 1e-13);
    let (mut ball, left) = at_end(CoSimulationWithEvents);
    assert!(left && (v(&mut ball) + 2.5).abs() < 1e-13);
    ball.instance.enter_event_mode().expect("Event Mode");
    assert!(ball.instance.update_discrete_states().expect("update").states_changed);
    assert_eq!(v(&mut ball).to_bits(), v(&mut plain).to_bits());
    let (mut on, _) = at_end(CoSimulationWithEvents);
    on.step(0.125).expect("a step");
    plain.step(0.125).expect("a step");
    assert_eq!(v(&mut on).to_bits(), v(&mut plain).to_bits());
}

#[test]
fn values_that_wait_for_event_mode_are_refused_in_step_mode() {
    let mut fmu = Named::<DoubleWishbone>::with_interface(CoSimulationWithEvents);
    fmu.initialize().expect("start");
    fmu.pass_event_mode(CoSimulationWithEvents).expect("Step Mode");
    fmu.set("P.F.z", 1.0).expect("a continuous input");
    for name in ["strut.c", "port.reset", "port.order"] {
        let fault = fmu.set(name, 1.0).expect_err("refused");
        assert!(matches!(fault, Fault::NotSettable { .. }) && fault.status() == Status::Error);
        assert!(fault.to_string().contains(name), "{fault}");
    }
    // orders that do not fit are refused where the step begins, and may then be mended
    fmu.instance.enter_event_mode().expect("Event Mode");
    fmu.set("port.order", 3.0).expect("allowed with endpoint");
    let fault = fmu.pass_event_mode(CoSimulationWithEvents).expect_err("extrapolate");
    let text = fault.to_string();
    assert!(
        fault.status() == Status::Error && text.contains("port.order = 3") && text.contains("0 .. 2"),
        "{text}"
    );
    fmu.set("port.inputs", 3.0).expect("endpoint");
    fmu.pass_event_mode(CoSimulationWithEvents).expect("Step Mode");
}
