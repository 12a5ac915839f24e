//! The haptic interface's FMUs as a host uses them: ticks of the sampled controller, faults, extreme values.

#![allow(non_snake_case, reason = "symbols of the write-ups")]
#![allow(clippy::float_cmp, reason = "whole numbers, and values that must not differ")]

use export_tests::Named;
use fmu_export::{Event, Interface, Status};
use model::{Causality, Kind, Model};
use models::effi::{Arm, Controller, Mechanism, Plant, Wall};

const EVENTS: Interface = Interface::CoSimulationWithEvents;
/// Impedance rendering (`mode` = impedance).
const IMPEDANCE: f64 = 2.0;

fn started<M: Model>(interface: Interface, settings: &[(&str, f64)]) -> Named<M> {
    let mut fmu = Named::<M>::with_interface(interface);
    for (name, value) in settings {
        fmu.set(name, *value).expect("a setting");
    }
    fmu.initialize().expect("a start");
    fmu
}

fn get<M: Model>(fmu: &mut Named<M>, name: &str) -> f64 {
    fmu.get(name).expect("an output")
}

fn updated<M: Model>(fmu: &mut Named<M>) -> Event {
    fmu.instance.update_discrete_states().expect("an update")
}

/// Lengths of the axes when the handle is at (0, z).
fn length(z: f64) -> f64 {
    0.35_f64.hypot(z)
}

fn hold<const C: usize>(fmu: &mut Named<Controller>, names: [(&str, f64); C]) {
    for (name, value) in names {
        fmu.set(name, value).expect("an input");
    }
}

/// Without Event Mode a tick is processed at the start of the step that begins at it, with the inputs set before; communication
/// steps of 0.3 ms and 2.5 ms contain none, some or several of 1 ms.
#[test]
fn ticks_wait_for_the_step_that_begins_at_them() {
    for (h, counts) in [(3e-4, [1, 1, 1, 2, 2, 2, 3, 3]), (2.5e-3, [3, 5, 8, 10, 13, 15, 18, 20])] {
        let mut fmu = started::<Controller>(Interface::CoSimulation, &[]);
        for count in counts {
            fmu.step(h).expect("a step");
            assert_eq!(get(&mut fmu, "tick"), f64::from(count), "H = {h} at t = {}", fmu.instance.time());
        }
    }
}

/// The inputs of a tick are those of its time: what the host sets after the step that ends at the tick counts.
#[test]
fn a_tick_sees_the_inputs_of_its_time() {
    let mut fmu = started::<Controller>(Interface::CoSimulation, &[("delay", 0.0), ("mode", IMPEDANCE)]);
    fmu.step(1e-3).expect("tick 0");
    hold(&mut fmu, [("axis[1].position", length(0.61)), ("axis[2].position", length(0.61))]);
    assert!((get(&mut fmu, "V.r.z") - 0.6).abs() < 1e-12, "outputs change at ticks only");
    fmu.step(1e-3).expect("tick 1");
    assert!((get(&mut fmu, "V.r.z") - 0.61).abs() < 1e-12);
    // one difference through the filter of 200 Hz
    let beta = 1.0 - (-std::f64::consts::TAU * 0.2).exp();
    let rate = (length(0.61) - length(0.6)) / 1e-3 * beta;
    let expected = rate * length(0.61) / 0.61; // symmetric: l' = v z/l
    assert!((get(&mut fmu, "V.v.z") - expected).abs() < 1e-9);
}

/// With Event Mode a tick is announced, processed in the update after the inputs were set, and visible at once.
#[test]
fn ticks_are_time_events_of_event_mode() {
    let mut fmu = started::<Controller>(EVENTS, &[("delay", 0.0)]);
    assert_eq!(get(&mut fmu, "tick"), 0.0);
    let event = updated(&mut fmu);
    assert_eq!((event.again, event.next), (false, Some(1e-3)));
    assert_eq!(get(&mut fmu, "tick"), 1.0);
    let first = get(&mut fmu, "axis[2].force_command");
    fmu.instance.enter_step_mode().expect("Step Mode");
    assert!(fmu.step(1e-3).expect("a step"), "the tick at the end needs Event Mode");
    assert_eq!(get(&mut fmu, "tick"), 1.0);
    fmu.instance.enter_event_mode().expect("Event Mode");
    hold(&mut fmu, [("W.r.z", 0.06)]);
    updated(&mut fmu);
    assert_eq!(get(&mut fmu, "tick"), 2.0);
    assert!((get(&mut fmu, "axis[2].force_command") - first).abs() > 100.0);
    // a longer step passes ticks inside with the inputs as they are
    fmu.instance.enter_step_mode().expect("Step Mode");
    fmu.step(2.5e-3).expect("a step");
    assert_eq!(get(&mut fmu, "tick"), 4.0);
}

/// The force that a follower gives in answer to V.r of this tick acts at this tick: the update asks for another pass.
#[test]
fn a_wall_answers_within_the_tick() {
    let mut fmu = started::<Controller>(EVENTS, &[("delay", 0.0), ("mode", IMPEDANCE)]);
    hold(&mut fmu, [("axis[1].position", length(0.56)), ("axis[2].position", length(0.56))]);
    assert!(updated(&mut fmu).again, "V has changed");
    let free = get(&mut fmu, "axis[1].force_command");
    assert!((get(&mut fmu, "V.r.z") - 0.56).abs() < 1e-12);
    hold(&mut fmu, [("V.F.z", 200.0)]);
    let event = updated(&mut fmu);
    assert_eq!((event.again, event.next), (false, Some(1e-3)));
    assert_eq!(get(&mut fmu, "tick"), 1.0, "the same tick");
    let pushed = get(&mut fmu, "axis[1].force_command");
    let share = 100.0 * length(0.56) / 0.56; // two axes carry 200 N under the angle of the rods
    assert!((pushed - free - share).abs() < 1e-9, "{pushed} {free} {share}");
    assert!(!updated(&mut fmu).again, "nothing is left to do");
}

/// Ticks are counted, not summed up: a host that adds 1 ms ten thousand times sees one tick per step.
#[test]
fn ticks_are_where_hosts_expect_them() {
    for interface in [EVENTS, Interface::CoSimulation] {
        let mut fmu = started::<Controller>(interface, &[]);
        let (mut t, mut off) = (0.0_f64, 0.0_f64);
        for k in 1..=10_000_u32 {
            if interface == EVENTS {
                updated(&mut fmu);
                fmu.instance.enter_step_mode().expect("Step Mode");
            }
            fmu.instance.do_step(t, 1e-3).expect("a step");
            t += 1e-3;
            off = off.max((t - f64::from(k) * 1e-3).abs());
            assert_eq!(get(&mut fmu, "tick"), f64::from(k), "at t = {t:.17}");
            if interface == EVENTS {
                fmu.instance.enter_event_mode().expect("Event Mode");
            }
        }
        assert!(off > 1e-13, "the sum was exact: the test shows nothing");
    }
}

/// The queue of commands: `delay` ticks after the first command; with start.balanced that of the weight from the first tick on.
#[test]
fn commands_wait_in_the_queue() {
    for delay in [0_u32, 1, 3, 10] {
        for balanced in [0.0, 1.0] {
            let settings = [("delay", f64::from(delay)), ("mode", 1.0), ("start.balanced", balanced)];
            let mut fmu = started::<Controller>(Interface::CoSimulation, &settings);
            for k in 0..15 {
                fmu.step(1e-3).expect("a step");
                let command = get(&mut fmu, "axis[1].force_command");
                let expected = if k >= delay || balanced > 0.5 { 47.3 } else { 0.0 };
                assert!((command - expected).abs() < 0.05, "delay {delay}, tick {k}: {command}");
            }
        }
    }
}

/// Lengths without a pose: commands 0 at once and for good, W.F 0, a message with the values; reset clears it.
#[test]
fn a_fault_is_safe_and_latched() {
    let mut fmu = started::<Controller>(Interface::CoSimulation, &[]);
    hold(&mut fmu, [("sensor.F.x", 5.0)]);
    fmu.step(3e-3).expect("a step");
    assert!(get(&mut fmu, "axis[1].force_command").abs() > 1.0 && get(&mut fmu, "W.F.x") == 5.0);
    hold(&mut fmu, [("axis[1].position", 2.0)]);
    fmu.step(1e-3).expect("the run goes on");
    let messages = fmu.instance.take_warnings();
    assert_eq!(messages.len(), 1);
    assert!(messages[0].contains("axis[1].position = 2 m"), "{messages:?}");
    hold(&mut fmu, [("axis[1].position", length(0.6))]);
    for _ in 0..3 {
        for name in ["axis[1].force_command", "axis[2].force_command", "W.F.x"] {
            assert_eq!(get(&mut fmu, name), 0.0, "{name}");
        }
        assert_eq!(get(&mut fmu, "fault"), 1.0);
        fmu.step(1e-3).expect("the run goes on");
        assert!(!fmu.instance.has_warnings(), "said once");
    }
    fmu.instance.reset();
    fmu.initialize().expect("a start");
    fmu.step(1e-3).expect("a step");
    assert_eq!(get(&mut fmu, "fault"), 0.0);
}

/// Numbers that are finite but whose command is not: a fault as well.
#[test]
fn a_command_that_overflows_is_a_fault() {
    let mut fmu = started::<Controller>(Interface::CoSimulation, &[]);
    hold(&mut fmu, [("W.v.x", 1e308)]);
    fmu.step(1e-3).expect("the run goes on");
    assert_eq!((get(&mut fmu, "fault"), get(&mut fmu, "axis[1].force_command")), (1.0, 0.0));
    assert!(fmu.instance.take_warnings()[0].contains("not finite"));
}

/// A saved state goes on to the last bit, also between ticks and within the event iteration.
#[test]
fn a_saved_controller_goes_on_to_the_last_bit() {
    let mut fmu = started::<Controller>(Interface::CoSimulation, &[("delay", 3.0), ("ki", 100.0)]);
    let drive = |fmu: &mut Named<Controller>| {
        let mut seen = vec![];
        for _ in 0..20 {
            let l = length(0.6 + 0.01 * (30.0 * fmu.instance.time()).sin());
            hold(fmu, [("axis[1].position", l), ("axis[2].position", l), ("sensor.F.z", l)]);
            fmu.step(4e-4).expect("a step");
            seen.extend(fmu.everything().expect("values").into_iter().map(f64::to_bits));
        }
        seen
    };
    drive(&mut fmu);
    let saved = fmu.instance.save();
    let first = drive(&mut fmu);
    fmu.instance.restore(&saved).expect("its own state");
    assert_eq!(drive(&mut fmu), first);
}

fn refuses_what_is_not_finite<M: Model>() {
    let mut fmu = started::<M>(Interface::CoSimulation, &[]);
    let table = fmu.table().variables().to_vec();
    let inputs: Vec<_> = table.iter().filter(|v| v.entry.causality == Causality::Input).collect();
    assert!(!inputs.is_empty());
    for input in inputs {
        assert_eq!(input.entry.kind, Kind::Float64);
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let before = get(&mut fmu, &input.name);
            let fault = fmu.set(&input.name, value).expect_err("refused");
            assert_eq!(fault.status(), Status::Discard);
            assert!(fault.to_string().contains(&input.name), "{fault}");
            assert_eq!(get(&mut fmu, &input.name).to_bits(), before.to_bits());
        }
    }
    fmu.step(1e-3).expect("the run goes on");
}

#[test]
fn every_input_refuses_what_is_not_finite() {
    refuses_what_is_not_finite::<Plant>();
    refuses_what_is_not_finite::<Controller>();
    refuses_what_is_not_finite::<Mechanism>();
    refuses_what_is_not_finite::<Wall>();
    refuses_what_is_not_finite::<Arm>();
}

/// Parameters that do not fit together are refused with variable, value and what is allowed.
#[test]
fn parameters_that_do_not_fit_are_refused_by_name() {
    fn refused<M: Model>(settings: &[(&str, f64)], says: &[&str]) {
        let mut fmu = Named::<M>::default();
        for (name, value) in settings {
            fmu.set(name, *value).expect("in its range");
        }
        let fault = fmu.initialize().expect_err("refused");
        assert_eq!(fault.status(), Status::Error, "{fault}");
        for word in says {
            assert!(fault.to_string().contains(word), "{settings:?}: {fault}");
        }
    }
    refused::<Plant>(&[("B.x", -0.35)], &["B.x = -0.35", "B != A"]);
    refused::<Plant>(&[("branch", 0.0)], &["branch = 0", "-1 or 1"]);
    refused::<Plant>(&[("H.start.z", 0.3)], &["H.start.z = 0.3", "0.5 .. 0.9 m"]);
    refused::<Plant>(&[("H.start.z", -0.6)], &["H.start.z = -0.6", "the side of branch"]);
    refused::<Plant>(&[("axis.v_max", 0.4)], &["axis.v_max = 0.4", "> 0.4 m/s"]);
    refused::<Plant>(&[("stroke.max", 0.5)], &["stroke.max = 0.5", "> 0.5 m"]);
    refused::<Plant>(&[("friction.F_s", 50.0)], &["friction.F_s = 50", ">= 60 N"]);
    let at_pivot = [("use.stroke_stop", 0.0), ("H.start.x", -0.35), ("H.start.z", 0.0)];
    refused::<Plant>(&at_pivot, &["distance between the handle and a pivot"]);
    refused::<Plant>(&[("solver.method", 4.0)], &["dop853", "rk4 (2), dopri5 (3), rodas4 (5)"]);
    refused::<Controller>(&[("A.x", 0.35)], &["B.x = 0.35", "B != A"]);
    refused::<Mechanism>(&[("branch", 0.0)], &["branch = 0"]);
    refused::<Mechanism>(&[("stop.hi", -1.0)], &["stop.hi = -1", "> -0.9 rad"]);
    refused::<Mechanism>(&[("crank.length", 0.6)], &["room to close the four-bar"]);
    refused::<Mechanism>(&[("kind", 2.0), ("drawer.direction.x", 0.0)], &["drawer.direction.x = 0"]);
    refused::<Wall>(&[("normal.z", 1e-13)], &["normal.z", "|normal| >= 1e-12"]);
}

/// A handle that starts at either limit of the stroke, to rounding, is accepted.
#[test]
fn the_limits_of_the_stroke_are_inside() {
    for (name, l) in [("stroke.min", 0.5_f64), ("stroke.max", 0.9)] {
        let z = (l * l - 0.35 * 0.35).sqrt();
        let mut fmu = started::<Plant>(Interface::CoSimulation, &[("H.start.z", z), ("use.encoder", 0.0)]);
        assert!((get(&mut fmu, "axis[1].position") - l).abs() < 1e-15, "{name}");
        fmu.step(1e-3).expect("a step");
    }
}

/// Encoders round half up; resolution 0 and use.encoder = false give the length itself.
#[test]
fn encoders_round_half_up() {
    let exact = length(0.6);
    for (settings, expected) in [
        (vec![("encoder.resolution", 1e-3)], 0.695),
        (vec![("encoder.resolution", 0.0)], exact),
        (vec![("encoder.resolution", 1e-3), ("use.encoder", 0.0)], exact),
    ] {
        let mut fmu = started::<Plant>(Interface::CoSimulation, &settings);
        assert!((get(&mut fmu, "axis[1].position") - expected).abs() < 1e-15, "{settings:?}");
    }
}

/// The flag of the singular pose changes at its event, in Co-Simulation and Model Exchange; the plant moves through the pose.
#[test]
fn aligned_rods_raise_the_flag_and_nothing_else() {
    let settings = [
        ("A.x", -0.5),
        ("B.x", 0.5),
        ("use.stroke_stop", 0.0),
        ("friction.model", 1.0),
        ("use.gravity", 0.0),
        ("H.start.z", 0.004),
        ("H.start.v.z", -0.5),
    ];
    let mut fmu = started::<Plant>(Interface::CoSimulation, &settings);
    let mut raised = vec![];
    for _ in 0..32 {
        fmu.step(5e-4).expect("the pose is no obstacle");
        let (flag, det) = (get(&mut fmu, "singular"), get(&mut fmu, "jacobian.determinant"));
        assert_eq!(flag > 0.5, det.abs() < 1e-3, "det = {det}");
        raised.push(flag);
    }
    assert!(raised.contains(&1.0) && raised.last() == Some(&0.0), "{raised:?}");
}

/// Speed, stiffness and command far out: right or refused, never out of bounds.
#[test]
fn extreme_plants_stay_bounded() {
    // dopri5: the bristles' rate at 2 m/s is beyond the default step of rk4
    let full_speed = [("H.start.z", 0.75), ("H.start.v.z", 2.0), ("solver.method", 3.0)];
    let cases: [(&[(&str, f64)], f64); 4] = [
        (&full_speed, 1e9),
        (&[("friction.F_s", 180.0)], 200.0),
        (&[("friction.model", 1.0)], 1e9),
        (&[("friction.F_c", 0.0), ("friction.F_s", 0.0)], -1e9),
    ];
    for (settings, command) in cases {
        let mut fmu = started::<Plant>(Interface::CoSimulation, settings);
        for name in ["axis[1].force_command", "axis[2].force_command"] {
            fmu.set(name, command).expect("any finite command");
        }
        let start = get(&mut fmu, "energy.kinetic") + get(&mut fmu, "energy.potential");
        for _ in 0..300 {
            fmu.step(1e-3).expect("a step");
            let l = get(&mut fmu, "axis[1].position");
            assert!((0.45..0.95).contains(&l), "{settings:?}: l = {l}");
            assert!(get(&mut fmu, "axis[1].force").abs() <= 2500.0);
        }
        let stored = get(&mut fmu, "energy.kinetic") + get(&mut fmu, "energy.potential") - start;
        let (supplied, heat) = (get(&mut fmu, "energy.supplied"), get(&mut fmu, "energy.dissipated"));
        assert!(
            (stored + heat - supplied).abs() < 1e-3 * heat.abs().max(1.0),
            "{settings:?}: {stored} {heat} {supplied}"
        );
    }
}

/// Bristles of 1e9 N/m: the fixed step is refused with a usable one and the implicit methods named; rodas4 does it.
#[test]
fn stiff_bristles_need_an_implicit_method() {
    let stiff = [("friction.s0", 1e9), ("H.start.v.z", 0.3)];
    let mut fmu = started::<Plant>(Interface::CoSimulation, &stiff);
    let fault = fmu.step(1e-3).expect_err("refused");
    assert_eq!(fault.status(), Status::Discard);
    assert!(fault.to_string().contains("rodas4"), "{fault}");
    let mut fmu =
        started::<Plant>(Interface::CoSimulation, &[&stiff[..], &[("solver.method", 5.0)]].concat());
    for _ in 0..20 {
        fmu.step(1e-3).expect("a step");
    }
    assert!(get(&mut fmu, "H.v.z") > 0.0 && get(&mut fmu, "axis[1].friction").abs() < 200.0);
}

/// Letting go of a stretched grip: the force is gone, the hand keeps its velocity, the spring's energy is accounted for.
#[test]
fn a_released_grip_gives_no_impulse() {
    for interface in [Interface::CoSimulation, EVENTS] {
        let mut fmu = started::<Arm>(
            interface,
            &[("H.r.z", 0.57), ("port.inputs", 1.0), ("solver.method", 3.0), ("solver.rtol", 1e-10)],
        );
        let step = |fmu: &mut Named<Arm>, enabled: f64| {
            fmu.set("grip.enabled", enabled).expect("0 or 1");
            if interface == EVENTS {
                fmu.pass_event_mode(interface).expect("Step Mode");
            }
            fmu.step(1e-3).expect("a step");
            if interface == EVENTS {
                fmu.instance.enter_event_mode().expect("Event Mode");
            }
        };
        let law = |fmu: &mut Named<Arm>| {
            let of = |fmu: &mut Named<Arm>, name: &str| get(fmu, &format!("energy.{name}"));
            of(fmu, "kinetic") + of(fmu, "potential") + of(fmu, "dissipated") - of(fmu, "supplied")
        };
        let start = law(&mut fmu);
        for _ in 0..5 {
            step(&mut fmu, 1.0);
        }
        let (v, F) = (get(&mut fmu, "hand.v.z"), get(&mut fmu, "H.F.z"));
        assert!(F > 10.0 && v < -0.1);
        step(&mut fmu, 0.0);
        assert_eq!(get(&mut fmu, "H.F.z"), 0.0);
        assert!((get(&mut fmu, "hand.v.z") - v).abs() < 0.02, "no impulse");
        step(&mut fmu, 1.0);
        let now = law(&mut fmu);
        assert!((now - start).abs() < 1e-9, "{interface}: {now} after {start}");
        assert!(fmu.set("grip.enabled", 0.5).is_err());
    }
}
