//! Parts that are left out, energy, accelerations, saved states, limits at random poses.

use export_tests::{Named, Random};
use models::boom::Boom;
use models::boom::machine::Machine;

use crate::{boom, command_all, count, get, set, set_angles};

/// A10: motion is bit-identical without collision and stability, which then are not computed.
#[test]
fn parts_that_are_left_out_change_no_motion() {
    let mut ends = Vec::new();
    for on in [1.0, 0.0] {
        let mut fmu = Named::<Boom>::default();
        set(&mut fmu, "machine.variant", 2.0);
        set(&mut fmu, "use.collision", on);
        set(&mut fmu, "use.stability", on);
        fmu.initialize().expect("a start");
        command_all(&mut fmu, [0.05, 0.05, 0.02, -0.01, 0.01, -0.02]);
        for _ in 0..20 {
            fmu.step(1.0).expect("a step");
        }
        let evaluations = count(&mut fmu, "solver.distance_evaluations");
        assert!(if on > 0.5 { evaluations >= 5 } else { evaluations == 0 });
        let bits = |i: usize| get(&mut fmu, &format!("joint[{i}].angle")).to_bits();
        ends.push((1..=6).map(bits).collect::<Vec<_>>());
    }
    assert_eq!(ends[0], ends[1]);
}

/// A8, A9: V(t) - V(0) = supplied; the torques of the load do the negative work of the tip's load.
#[test]
fn energy_balances_under_load() {
    for (lag, mass) in [(0.0, 0.0), (0.5, 200.0)] {
        let mut fmu = Named::<Boom>::default();
        set(&mut fmu, "machine.variant", 2.0);
        set(&mut fmu, "actuator.time_constant", lag);
        for (name, value) in
            [("TIP.F.x", 300.0), ("TIP.F.y", -200.0), ("TIP.F.z", -1500.0), ("TIP.M.xx", mass)]
        {
            set(&mut fmu, name, value);
        }
        fmu.initialize().expect("a start");
        let start = get(&mut fmu, "energy.potential");
        let mut largest = 0.0_f64;
        command_all(&mut fmu, [0.05, 0.06, 0.01, -0.01, 0.01, -0.02]);
        for _ in 0..60 {
            fmu.step(1.0).expect("a step");
            let gained = get(&mut fmu, "energy.potential") - start;
            let supplied = get(&mut fmu, "energy.supplied");
            largest = largest.max(gained.abs()).max(get(&mut fmu, "energy.port").abs());
            assert!((gained - supplied).abs() <= 1e-5 * largest, "{gained} {supplied}");
            let mut sum = 0.0;
            for i in 1..=6 {
                let of = |fmu: &mut Named<Boom>, what: &str| get(fmu, &format!("joint[{i}].{what}"));
                sum += of(&mut fmu, "torque.load") * of(&mut fmu, "velocity");
            }
            let mut power = 0.0;
            for c in ["x", "y", "z"] {
                power += get(&mut fmu, &format!("TIP.load.{c}")) * get(&mut fmu, &format!("TIP.v.{c}"));
            }
            assert!((sum + power).abs() <= 1e-9 * power.abs().max(1.0), "{sum} {power}");
        }
    }
}

/// A9a: behind a lag, TIP.a is the derivative of TIP.v (central difference over 0.1 ms; random commands, variants A, B, C).
#[test]
fn acceleration_behind_a_lag_is_the_derivative_of_the_velocity() {
    let (h, mut random) = (1e-4, Random(3));
    for variant in [1.0, 2.0, 3.0] {
        for _ in 0..5 {
            let mut fmu = Named::<Boom>::default();
            set(&mut fmu, "machine.variant", variant);
            set(&mut fmu, "actuator.time_constant", 0.5);
            for (name, value) in [("solver.rtol", 1e-12), ("solver.atol", 1e-14)] {
                set(&mut fmu, name, value);
            }
            for (i, q) in (1..=6).zip([0.4, 1.2, -1.6, 1.0, -1.2, 0.8]) {
                set(&mut fmu, &format!("joint[{i}].angle_start"), q);
            }
            fmu.initialize().expect("a start");
            command_all(&mut fmu, std::array::from_fn(|_| random.between(-0.1, 0.1)));
            fmu.step(0.7).expect("a step");
            let tip = |fmu: &mut Named<Boom>, what: &str| {
                ["x", "y", "z"].map(|c| get(fmu, &format!("TIP.{what}.{c}")))
            };
            let before = tip(&mut fmu, "v");
            fmu.step(h).expect("a step");
            let a = tip(&mut fmu, "a");
            fmu.step(h).expect("a step");
            let after = tip(&mut fmu, "v");
            for c in 0..3 {
                let difference = (after[c] - before[c]) / (2.0 * h);
                assert!((a[c] - difference).abs() < 1e-5, "variant {variant}: {} {difference}", a[c]);
            }
        }
    }
}

/// TIP.M has to be positive semidefinite: else the step is refused and changes nothing.
#[test]
fn an_indefinite_inertia_is_refused() {
    let mut fmu = Named::<Boom>::default();
    fmu.initialize().expect("a start");
    set(&mut fmu, "TIP.M.xx", -1.0);
    let message = fmu.step(1.0).expect_err("refused").to_string();
    assert!(message.contains("TIP.M") && message.contains("positive semidefinite"), "{message}");
    set(&mut fmu, "TIP.M.xx", 1.0);
    fmu.step(1.0).expect("a step");
}

/// A10: after a return to a saved state all values are the same to the bit, behind a lag and with joints at their ends too.
#[test]
fn a_saved_state_goes_on_to_the_bit() {
    for lag in [0.0, 0.5] {
        let mut fmu = boom(&[("machine.variant", 3.0), ("actuator.time_constant", lag), ("TIP.F.z", -500.0)]);
        fmu.initialize().expect("a start");
        command_all(&mut fmu, [0.05, 0.05, -0.1, 0.0, 0.02, 0.02]);
        for _ in 0..10 {
            fmu.step(0.7).expect("a step");
        }
        let saved = fmu.instance.save();
        let mut ends = Vec::new();
        for _ in 0..2 {
            fmu.instance.restore(&saved).expect("the same model");
            for _ in 0..10 {
                fmu.step(0.9).expect("a step");
            }
            let counters =
                ["steps", "rhs_evaluations", "rejected", "events"].map(|c| fmu.count(&format!("solver.{c}")));
            let values = fmu.everything().expect("values").into_iter().chain(counters);
            ends.push(values.map(f64::to_bits).collect::<Vec<_>>());
        }
        assert_eq!(ends[0], ends[1]);
    }
}

/// A7 at random poses and commands: no limit is exceeded, every rate has its command's sign and is not larger.
#[test]
fn limits_hold_at_random_poses() {
    let mut random = Random(11);
    let machine = Machine::compiled_in();
    for n in 0..300_u32 {
        let variant = machine.variant((n % 3) as usize);
        let mut fmu = boom(&[("machine.variant", f64::from(n % 3 + 1)), ("use.collision", 0.0)]);
        set_angles(&mut fmu, std::array::from_fn(|i| random.between(machine.min[i], machine.max[i])));
        let commands: [f64; 6] = std::array::from_fn(|_| random.between(-0.2, 0.2));
        command_all(&mut fmu, commands);
        fmu.initialize().expect("a start");
        for (i, command) in (1..=6).zip(commands) {
            let rate = get(&mut fmu, &format!("joint[{i}].velocity"));
            assert!(rate * command >= 0.0 && rate.abs() <= command.abs(), "{rate} for {command}");
            assert!(rate.abs() <= variant.rate_max[i - 1]);
            assert!((get(&mut fmu, &format!("limiter.scale[{i}]")) - rate / command).abs() < 1e-15);
            assert!(get(&mut fmu, &format!("margin.w5[{i}]")) >= -1e-9 * variant.flow_max_extend[i - 1]);
            if variant.tangential_active {
                assert!(get(&mut fmu, &format!("margin.w4[{i}]")) >= -1e-9 * variant.tangential_max[i - 1]);
            }
        }
        assert!(get(&mut fmu, "margin.w6") >= -1e-9 * variant.flow_total_max);
    }
}
