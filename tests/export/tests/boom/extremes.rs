//! Section 5 of the specification, E1 to E10 (E4, boxes in contact, stands beside the distances).

use export_tests::Named;
use models::boom::Boom;
use models::boom::machine::Machine;

use crate::{boom, command_all, count, get, set, set_angles};

/// E1, E7, E8: every joint ends exactly at its limit whatever the step, leaves it on command, motion without parts is the same.
#[test]
fn joints_stop_at_their_ranges_and_leave_them() {
    let max = Machine::compiled_in().max;
    for lag in [0.0, 0.5] {
        for (variant, step) in [(1.0, 3600.0), (2.0, 600.0), (3.0, 10.0)] {
            let mut fmu = Named::<Boom>::default();
            set(&mut fmu, "machine.variant", variant);
            set(&mut fmu, "actuator.time_constant", lag);
            fmu.initialize().expect("a start");
            command_all(&mut fmu, [1e6; 6]);
            while fmu.instance.time() < 3600.0 {
                fmu.step(step).expect("a step");
                for i in 1..=6 {
                    assert!(get(&mut fmu, &format!("margin.w5[{i}]")) >= -1e-12);
                }
            }
            for (i, max) in (1..=6).zip(max) {
                let angle = get(&mut fmu, &format!("joint[{i}].angle"));
                assert!(
                    angle.to_bits() == f64::to_bits(max),
                    "joint {i} at {angle}, lag {lag}, variant {variant}"
                );
                assert!(get(&mut fmu, &format!("joint[{i}].velocity")).abs() <= 0.0);
            }
            assert_eq!(count(&mut fmu, "solver.events"), 6);
            command_all(&mut fmu, [-1e-3; 6]);
            fmu.step(10.0).expect("a step");
            for (i, max) in (1..=6).zip(max) {
                assert!(get(&mut fmu, &format!("joint[{i}].angle")) < max - 1e-3);
            }
        }
    }
}

/// E6: a command that is not finite acts as 0, with a flag and one message per streak.
#[test]
fn bad_commands_act_as_zero() {
    let mut fmu = Named::<Boom>::default();
    fmu.initialize().expect("a start");
    command_all(&mut fmu, [f64::NAN, 0.01, f64::INFINITY, f64::NEG_INFINITY, 0.0, 0.0]);
    fmu.step(1.0).expect("a step");
    assert_eq!(fmu.instance.take_warnings().len(), 1);
    fmu.step(1.0).expect("a step");
    assert!(fmu.instance.take_warnings().is_empty());
    assert!(get(&mut fmu, "flag.bad_command") > 0.5 && get(&mut fmu, "joint[2].angle") > 0.01);
    assert!(
        get(&mut fmu, "joint[1].angle").abs() <= 0.0 && (get(&mut fmu, "limiter.stage[1]") - 1.0).abs() < 0.5
    );
    command_all(&mut fmu, [0.0; 6]);
    fmu.step(1.0).expect("a step");
    command_all(&mut fmu, [f64::NAN; 6]);
    fmu.step(1.0).expect("a step");
    assert_eq!(fmu.instance.take_warnings().len(), 1);
}

/// E2: a stretched boom slews within the tangential limit, a vertical one up to the mechanical rate.
#[test]
fn slewing_follows_the_lever_of_the_boom() {
    let machine = Machine::compiled_in();
    for luff in [0.0, 88.0_f64.to_radians().min(machine.max[1])] {
        let mut fmu = boom(&[("machine.variant", 2.0), ("use.hydraulics", 0.0)]);
        set_angles(&mut fmu, [0.0, luff, 0.0, 0.0, 0.0, 0.0]);
        command_all(&mut fmu, [1e6, 0.0, 0.0, 0.0, 0.0, 0.0]);
        fmu.initialize().expect("a start");
        let rate = get(&mut fmu, "joint[1].velocity");
        let reach = (1..=6)
            .map(|k| {
                if k < 6 {
                    (format!("K[{k}].r.x"), format!("K[{k}].r.y"))
                } else {
                    ("TIP.r.x".into(), "TIP.r.y".into())
                }
            })
            .map(|(x, y)| get(&mut fmu, &x).hypot(get(&mut fmu, &y)))
            .fold(0.0, f64::max);
        let expected = machine.variant(1).rate_max[0].min(machine.variant(1).tangential_max[0] / reach);
        assert!((rate - expected).abs() < 1e-12, "{rate} {expected}");
    }
}

/// E3: the folded boom without commands keeps every value to the bit over 1e5 steps.
#[test]
fn a_boom_at_rest_stays_there() {
    let mut fmu = boom(&[]);
    fmu.initialize().expect("a start");
    let bits = |fmu: &mut Named<Boom>| {
        let values = fmu.everything().expect("values");
        values[1..].iter().map(|v| v.to_bits()).collect::<Vec<_>>() // without time
    };
    let start = bits(&mut fmu);
    for n in 0..100_000_u32 {
        fmu.step(0.1).expect("a step");
        if n % 10_000 == 0 {
            assert_eq!(bits(&mut fmu), start);
        }
    }
    assert_eq!(bits(&mut fmu), start);
}

/// E5: without oil nothing moves, and no value is undefined.
#[test]
fn without_flow_there_is_no_motion() {
    let mut fmu = boom(&[("machine.variant", 3.0), ("hydraulics.flow_total_max", 0.0)]);
    fmu.initialize().expect("a start");
    command_all(&mut fmu, [0.1; 6]);
    let before = get(&mut fmu, "joint[2].angle");
    fmu.step(10.0).expect("a step");
    assert!(fmu.everything().expect("values").iter().all(|v| v.is_finite()));
    assert_eq!(get(&mut fmu, "joint[2].angle").to_bits(), before.to_bits());
    assert!(
        get(&mut fmu, "limiter.scale[2]").abs() <= 0.0 && get(&mut fmu, "hydraulics.flow_total").abs() <= 0.0
    );
}

/// E8: one step of an hour and steps of 0.1 s end alike, as do one step of 0.1 s and 1e5 of a microsecond: 1e-7 rad.
#[test]
fn the_length_of_steps_does_not_matter() {
    let end = |step: f64, steps: u32| {
        let mut fmu = boom(&[("machine.variant", 2.0), ("use.energy", 0.0)]);
        fmu.initialize().expect("a start");
        command_all(&mut fmu, [0.02, 0.01, 0.004, -0.003, 0.01, -0.005]);
        for _ in 0..steps {
            fmu.step(step).expect("a step");
        }
        std::array::from_fn::<f64, 6, _>(|i| get(&mut fmu, &format!("joint[{}].angle", i + 1)))
    };
    for (a, b) in [(end(3600.0, 1), end(0.1, 36_000)), (end(0.1, 1), end(1e-6, 100_000))] {
        assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-7), "{a:?} {b:?}");
    }
}

/// E9: commands that jump between 1e6 and -1e6 every millisecond keep all limits and lead nowhere.
#[test]
fn alternating_commands_keep_the_limits() {
    for lag in [0.0, 0.5] {
        let mut fmu = boom(&[("machine.variant", 3.0), ("actuator.time_constant", lag)]);
        let start = [0.4, 1.2, -1.6, 1.0, -1.2, 0.8];
        set_angles(&mut fmu, start);
        fmu.initialize().expect("a start");
        for n in 0..2000 {
            command_all(&mut fmu, [if n % 2 == 0 { 1e6 } else { -1e6 }; 6]);
            fmu.step(1e-3).expect("a step");
            assert!(get(&mut fmu, "margin.w6") >= -1e-12);
        }
        for (i, q) in (1..=6).zip(start) {
            assert!((get(&mut fmu, &format!("joint[{i}].angle")) - q).abs() < 1e-3);
        }
    }
}

/// E10: the stretched boom slews to the narrow side of the partial support: the machine tips, flags say so, it moves on.
#[test]
fn the_machine_tips_over_the_narrow_side() {
    let mut tipped = 0;
    for way in [1.0, -1.0] {
        let mut fmu = boom(&[("machine.variant", 3.0), ("machine.support", 2.0)]);
        set_angles(&mut fmu, [0.0; 6]);
        fmu.initialize().expect("a start");
        command_all(&mut fmu, [0.05 * way, 0.0, 0.0, 0.0, 0.0, 0.0]);
        assert!(get(&mut fmu, "stability.beta_min") > 0.0 && get(&mut fmu, "flag.tip_over") < 0.5);
        while get(&mut fmu, "joint[1].angle").abs() < 1.57 {
            let before = get(&mut fmu, "joint[1].angle");
            fmu.step(1.0).expect("a step");
            let (beta, flag) = (get(&mut fmu, "stability.beta_min"), get(&mut fmu, "flag.tip_over"));
            assert_eq!(beta <= 0.0, flag > 0.5);
            assert!(get(&mut fmu, "flag.below_threshold") >= flag);
            assert!(way * (get(&mut fmu, "joint[1].angle") - before) > 0.0);
        }
        tipped += u32::from(get(&mut fmu, "flag.tip_over") > 0.5);
    }
    assert_eq!(tipped, 1);
}
