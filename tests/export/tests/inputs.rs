//! Input polynomials inside an instance: what reaches the equations, what is kept, what is forgotten.

use export_tests::Named;
use export_tests::rod::Rod;
use fmu_export::Interface::{CoSimulation, CoSimulationWithEvents};
use fmu_export::{SolverMethod, Status};
use models::suspension::DoubleWishbone;

fn rod(settings: &[(&str, f64)]) -> Named<Rod> {
    let mut rod = Named::<Rod>::default();
    for (name, value) in settings {
        rod.set(name, *value).expect("setting");
    }
    rod.initialize().expect("start");
    rod
}

fn bits(values: Vec<f64>) -> Vec<u64> {
    values.into_iter().map(f64::to_bits).collect()
}

/// A leader with constant acceleration: position, velocity and the state behind the damper follow the
/// closed form through a step of any size, whatever the treatment of the acceleration.
///
/// `w' = 1 + 2 t - w` from 0: `w = 2 t - 1 + exp(-t)`; RK4 at 1e-3 s leaves 1e-14.
#[test]
fn motion_between_communication_points_is_integrated() {
    for treatment in [1.0, 2.0] {
        let mut rod = rod(&[("port.inputs", treatment), ("A.s", 0.5), ("A.v", 1.0), ("A.a", 2.0)]);
        let mut t = 0.0_f64;
        for h in [0.1, 0.25, 0.05, 0.4] {
            rod.step(h).expect("a step");
            t += h;
            for (name, expected) in [
                ("A.s", 0.5 + t + t * t),
                ("A.v", 1.0 + 2.0 * t),
                ("A.a", 2.0),
                ("w", 2.0 * t - 1.0 + (-t).exp()),
            ] {
                let value = rod.get(name).expect("value");
                assert!((value - expected).abs() < 1e-13, "{name} at {t}: {value} against {expected}");
            }
        }
    }
    // without integration every input is held
    let mut rod = rod(&[("port.inputs", 1.0), ("port.integrate_motion", 0.0), ("A.v", 1.0), ("A.a", 2.0)]);
    rod.step(0.5).expect("a step");
    assert!((rod.get("w").expect("w") - (1.0 - (-0.5_f64).exp())).abs() < 1e-13);
    assert!(rod.get("A.s").expect("A.s").abs() <= 0.0);
}

/// The same motion under the implicit methods, whose Jacobian knows how fast the inputs move (161, 48 steps);
/// without that rodas4 is off by 7e-7.
#[test]
fn implicit_methods_follow_moving_inputs() {
    for (method, most) in [(SolverMethod::Rodas4, 200.0), (SolverMethod::Radau5, 60.0)] {
        let method = f64::from(method as i32);
        let tolerances = [("solver.rtol", 1e-10), ("solver.atol", 1e-12), ("A.v", 1.0), ("A.a", 2.0)];
        let mut rod = rod(&[&[("solver.method", method)], &tolerances[..]].concat());
        rod.step(2.0).expect("a step");
        let w = rod.get("w").expect("w");
        assert!((w - (3.0 + (-2.0_f64).exp())).abs() < 1e-9, "{w}");
        let steps = rod.count("solver.steps");
        assert!(steps <= most, "{steps} steps");
    }
}

/// Outputs after a step belong to its end: they are computed with the inputs there.
#[test]
fn outputs_after_a_step_belong_to_its_end() {
    let mut rod = rod(&[("A.a", 1.0)]);
    rod.step(0.5).expect("a step");
    let w = rod.get("w").expect("w");
    let force = -3.0 * 0.125 - (0.5 - w) - 2.0;
    assert!((rod.get("A.F").expect("force") - force).abs() < 1e-14);
}

/// The inputs set before an endpoint step are its end values; the polynomial starts at the last sample.
#[test]
fn endpoint_interpolates_from_the_last_sample() {
    let mut rod = rod(&[("port.inputs", 3.0), ("port.integrate_motion", 0.0)]);
    rod.set("A.v", 1.0).expect("end value");
    rod.step(1.0).expect("a step");
    // w' = t - w from 0: w = t - 1 + exp(-t)
    assert!((rod.get("w").expect("w") - (-1.0_f64).exp()).abs() < 1e-13);
    assert!((rod.get("A.v").expect("v") - 1.0).abs() <= 0.0);
    rod.step(1.0).expect("the same end value again: constant");
    let w = 1.0 - (1.0 - (-1.0_f64).exp()) * (-1.0_f64).exp();
    assert!((rod.get("w").expect("w") - w).abs() < 1e-13);
}

/// A value that the host set once holds from the next step on; it does not run away along the slope that
/// it came with.
#[test]
fn an_input_that_is_not_set_again_holds() {
    let mut fmu = Named::<DoubleWishbone>::default();
    fmu.initialize().expect("start");
    fmu.step(0.1).expect("a step");
    fmu.set("P.F.x", 10.0).expect("once");
    for expected in [20.0, 10.0, 10.0, 10.0] {
        fmu.step(0.1).expect("a step");
        let value = fmu.get("P.F.x").expect("value");
        assert!((value - expected).abs() < 1e-12, "{value} against {expected}");
    }
}

fn feed(fmu: &mut Named<DoubleWishbone>, value: f64) -> f64 {
    fmu.set("P.F.x", value).expect("input");
    fmu.step(0.1).expect("a step");
    fmu.get("P.F.x").expect("value")
}

/// After a change of port.reset the next sample is the only one; the same value again resets nothing.
#[test]
fn a_reset_forgets_the_samples() {
    let mut fmu = Named::<DoubleWishbone>::default();
    fmu.set("port.order", 2.0).expect("order");
    fmu.set("port.reset", 4.0).expect("not a change yet");
    fmu.initialize().expect("start");
    let line = |v: f64| (v * 1e9).round() / 1e9;
    assert!((line(feed(&mut fmu, 0.0)) - 0.0).abs() < 1e-9);
    assert!((line(feed(&mut fmu, 1.0)) - 2.0).abs() < 1e-9);
    assert!((line(feed(&mut fmu, 2.0)) - 3.0).abs() < 1e-9);
    fmu.set("port.reset", 5.0).expect("a jump");
    assert!((line(feed(&mut fmu, 100.0)) - 100.0).abs() < 1e-9);
    fmu.set("port.reset", 5.0).expect("no change");
    assert!((line(feed(&mut fmu, 101.0)) - 102.0).abs() < 1e-9);

    // in Event Mode it is the update that forgets
    let mut fmu = Named::<DoubleWishbone>::with_interface(CoSimulationWithEvents);
    fmu.initialize().expect("start");
    fmu.pass_event_mode(CoSimulationWithEvents).expect("Step Mode");
    let feed = |fmu: &mut Named<DoubleWishbone>, value: f64, reset: f64| {
        fmu.instance.enter_event_mode().expect("Event Mode");
        fmu.set("P.F.x", value).expect("input");
        fmu.set("port.reset", reset).expect("reset");
        fmu.pass_event_mode(CoSimulationWithEvents).expect("Step Mode");
        fmu.step(0.1).expect("a step");
        fmu.get("P.F.x").expect("value")
    };
    let ends = [(0.0, 0.0), (1.0, 0.0), (7.0, 1.0), (8.0, 1.0)].map(|(v, r)| feed(&mut fmu, v, r));
    for (end, expected) in ends.iter().zip([0.0, 2.0, 7.0, 9.0]) {
        assert!((end - expected).abs() < 1e-12, "{ends:?}");
    }
}

/// Restore brings back the history: the same calls give the same bits, also after calls that filled it
/// with other samples, in all treatments and with and without Event Mode.
#[test]
fn restore_repeats_a_run_with_its_history() {
    for interface in [CoSimulation, CoSimulationWithEvents] {
        for (treatment, order) in [(1.0, 0.0), (2.0, 1.0), (2.0, 2.0), (3.0, 3.0)] {
            let mut fmu = Named::<DoubleWishbone>::with_interface(interface);
            fmu.set("port.inputs", treatment).expect("treatment");
            fmu.set("port.order", order).expect("order");
            fmu.initialize().expect("start");
            let events = interface == CoSimulationWithEvents;
            if events {
                fmu.pass_event_mode(interface).expect("Step Mode");
            }
            let go = |fmu: &mut Named<DoubleWishbone>, scale: f64| {
                for i in 0..4_i32 {
                    if events {
                        fmu.instance.enter_event_mode().expect("Event Mode");
                        fmu.pass_event_mode(interface).expect("Step Mode");
                    }
                    let t = fmu.instance.time();
                    fmu.set("P.F.z", scale * (7.0 * t).sin()).expect("input");
                    fmu.step(0.01 * f64::from(i + 1)).expect("a step");
                }
                bits(fmu.everything().expect("values"))
            };
            go(&mut fmu, 30.0);
            let saved = fmu.instance.save();
            let first = go(&mut fmu, 50.0);
            let other = go(&mut fmu, -20.0);
            assert_ne!(first, other);
            fmu.instance.restore(&saved).expect("restored");
            assert_eq!(go(&mut fmu, 50.0), first, "{interface}, {treatment}, {order}");
        }
    }
}

/// A discarded step leaves no sample behind: the run goes on as if it had not been tried.
#[test]
fn a_discarded_step_leaves_the_history_alone() {
    let started = || {
        let mut fmu = Named::<DoubleWishbone>::default();
        for (name, value) in [("port.order", 2.0), ("solver.step", 0.05)] {
            fmu.set(name, value).expect("setting");
        }
        fmu.initialize().expect("start");
        for value in [1.0, 4.0, 2.0] {
            feed(&mut fmu, value);
        }
        fmu
    };
    let (mut tried, mut plain) = (started(), started());
    tried.set("strut.c", 1e6).expect("too stiff");
    tried.set("port.reset", 1.0).expect("forget");
    let fault = tried.step(0.1).expect_err("unstable");
    assert_eq!(fault.status(), Status::Discard);
    tried.set("strut.c", 1000.0).expect("back");
    tried.set("port.reset", 0.0).expect("back");
    for value in [3.0, 5.0] {
        assert_eq!(feed(&mut tried, value).to_bits(), feed(&mut plain, value).to_bits());
    }
    assert_eq!(bits(tried.everything().expect("values")), bits(plain.everything().expect("values")));
}

/// Orders that do not fit the treatment are refused at the end of initialisation.
#[test]
fn orders_that_do_not_fit_are_refused() {
    for (treatment, order, allowed) in [(2.0, 3.0, "0 .. 2"), (3.0, 0.0, "1 .. 3")] {
        let mut fmu = Named::<DoubleWishbone>::default();
        fmu.set("port.inputs", treatment).expect("treatment");
        fmu.set("port.order", order).expect("order");
        let fault = fmu.initialize().expect_err("refused");
        assert_eq!(fault.status(), Status::Error);
        let text = fault.to_string();
        assert!(text.contains("port.order") && text.contains(allowed), "{text}");
    }
}
