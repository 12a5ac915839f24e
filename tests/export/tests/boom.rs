//! The boom against an independent program (54 poses, two profiles of commands), and its invariants.

use std::collections::HashMap;

use export_tests::{Named, Random};
use models::boom::Boom;

type Row = HashMap<String, String>;

/// Rows of a reference file, by column.
fn read(name: &str) -> Vec<Row> {
    let path = format!("{}/../reference/boom/{name}", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(path).expect("a reference file");
    let mut lines = text.lines().filter(|l| !l.starts_with('#'));
    let names: Vec<_> = lines.next().expect("names").split(',').collect();
    lines.map(|l| names.iter().map(ToString::to_string).zip(l.split(',').map(String::from)).collect()).collect()
}

fn number(row: &Row, name: &str) -> f64 {
    row.get(name).and_then(|v| v.parse().ok()).unwrap_or_else(|| panic!("column {name}"))
}

fn set(fmu: &mut Named<Boom>, name: &str, value: f64) {
    fmu.set(name, value).unwrap_or_else(|e| panic!("{name} = {value}: {e}"));
}

fn get(fmu: &mut Named<Boom>, name: &str) -> f64 {
    fmu.get(name).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// A boom in the pose of a row, with the settings.
fn posed(row: &Row, settings: &[(&str, f64)]) -> Named<Boom> {
    let mut fmu = Named::<Boom>::default();
    for i in 1..=6 {
        set(&mut fmu, &format!("joint[{i}].angle_start"), number(row, &format!("q{i}")));
    }
    settings.iter().for_each(|(name, value)| set(&mut fmu, name, *value));
    fmu
}

/// Largest errors by quantity, each with its limit.
#[derive(Default)]
struct Errors(HashMap<&'static str, (f64, f64)>);

impl Errors {
    fn see(&mut self, what: &'static str, limit: f64, error: f64) {
        let worst = self.0.entry(what).or_insert((0.0, limit));
        worst.0 = worst.0.max(if error.is_nan() { f64::INFINITY } else { error });
    }

    fn check(&self, case: &str) {
        let beyond: Vec<_> = self.0.iter().filter(|(_, (error, limit))| error > limit).collect();
        assert!(beyond.is_empty(), "{case}: {beyond:?}");
        eprintln!("{case}: {:?}", self.0);
    }
}

/// A1 to A4: centre of mass, tip-over angles, strokes, slopes, levers, distances, torques of the weight.
#[test]
fn static_poses_agree_with_the_reference() {
    let mut errors = Errors::default();
    for row in &read("static_poses.csv") {
        let support = if row["support"] == "full" { 1.0 } else { 2.0 };
        let mut fmu = posed(
            row,
            &[
                ("machine.support", support),
                ("boom.concrete_fill", number(row, "concrete_fill")),
                ("tip.mass", number(row, "tip_mass")),
                ("use.limiter", 0.0),
            ],
        );
        for i in 1..=6 {
            set(&mut fmu, &format!("joint[{i}].velocity_command"), 1.0);
        }
        fmu.initialize().expect("a pose");
        let mut see = |what, limit, name: &str, column: &str| {
            let expected = number(row, column);
            errors.see(what, limit, (get(&mut fmu, name) - expected).abs());
        };
        see("mass", 1e-6, "com.mass", "com.mass");
        // twelve digits are written: 5e-11 m at 50 m
        for c in ["x", "y", "z"] {
            see("com", 1e-9, &format!("com.r.{c}"), &format!("com.{c}"));
            see("tip", 1e-9, &format!("TIP.r.{c}"), &format!("tip.{c}"));
        }
        for k in 1..=4 {
            see("beta", 1e-9, &format!("stability.beta[{k}]"), &format!("beta{k}"));
        }
        see("edge", 0.0, "stability.edge", "edge");
        for i in 2..=6 {
            see("stroke", 1e-9, &format!("cylinder[{i}].stroke"), &format!("stroke{i}"));
            see("slope", 1e-9, &format!("cylinder[{i}].slope"), &format!("slope{i}"));
            see("distance", 1e-7, &format!("distance.arm[{i}]"), &format!("dist{i}"));
            see("nearest", 0.0, &format!("distance.nearest[{i}]"), &format!("nearest{i}"));
            see("z", 1e-9, &format!("K[{}].r.z", i - 1), &format!("z{}", i - 1));
        }
        for i in 1..=6 {
            let expected = number(row, &format!("gravity{i}"));
            let torque = get(&mut fmu, &format!("joint[{i}].torque.gravity"));
            errors.see("gravity", 1e-6, ((torque - expected).abs() - 0.5) / expected.abs().max(1.0));
            let blocked = get(&mut fmu, &format!("limiter.stage[{i}]")) > 0.0;
            if !blocked {
                let lever = |k: usize| format!("joint[{i}].tangential[{k}]");
                let longest = (i..=6).map(|k| get(&mut fmu, &lever(k)).abs()).fold(0.0, f64::max);
                errors.see("lever", 1e-9, (longest - number(row, &format!("rho_max{i}"))).abs());
            }
        }
    }
    errors.check("static poses");
}

/// A5 to A7 along a profile.
fn follow(file: &str, variant: f64, support: f64) {
    let rows = read(file);
    let mut fmu = posed(&rows[0], &[("machine.variant", variant), ("machine.support", support)]);
    let mut errors = Errors::default();
    for (n, row) in rows.iter().enumerate() {
        let command = |row: &Row, i: usize| number(row, &format!("cmd{i}"));
        if n == 0 {
            (1..=6).for_each(|i| set(&mut fmu, &format!("joint[{i}].velocity_command"), command(row, i)));
            fmu.initialize().expect("a start");
        } else {
            let h = number(row, "time") - number(&rows[n - 1], "time");
            fmu.step(h).unwrap_or_else(|e| panic!("{file} row {n}: {e}"));
            (1..=6).for_each(|i| set(&mut fmu, &format!("joint[{i}].velocity_command"), command(row, i)));
        }
        let mut see = |what, limit, name: &str, column: &str| {
            let (found, expected) = (get(&mut fmu, name), number(row, column));
            errors.see(what, limit, (found - expected).abs());
        };
        for i in 1..=6 {
            see("angle", 1e-6, &format!("joint[{i}].angle"), &format!("q{i}"));
            see("rate", 1e-6, &format!("joint[{i}].velocity"), &format!("qd{i}"));
        }
        see("flow", 1e-9, "slew.flow", "flow1");
        for i in 2..=6 {
            see("flow", 1e-9, &format!("cylinder[{i}].flow"), &format!("flow{i}"));
            see("distance", 1e-5, &format!("distance.arm[{i}]"), &format!("dist{i}"));
        }
        see("total flow", 1e-9, "hydraulics.flow_total", "flow_total");
        see("beta", 1e-6, "stability.beta_min", "beta_min");
        for c in ["x", "y", "z"] {
            see("tip r", 1e-4, &format!("TIP.r.{c}"), &format!("tip.r.{c}"));
            see("tip v", 1e-5, &format!("TIP.v.{c}"), &format!("tip.v.{c}"));
            see("tip a", 1e-5, &format!("TIP.a.{c}"), &format!("tip.a.{c}"));
        }
        see("potential", 1.0, "energy.potential", "potential");
        for i in 1..=6 {
            let (w4, w5) = (format!("margin.w4[{i}]"), format!("margin.w5[{i}]"));
            if variant > 1.0 {
                errors.see("tangential limit", 1e-9, -get(&mut fmu, &w4));
            }
            errors.see("flow limit", 1e-12, -get(&mut fmu, &w5));
        }
        errors.see("total flow limit", 1e-12, -get(&mut fmu, "margin.w6"));
    }
    errors.check(file);
}

#[test]
fn profile_of_variant_a_agrees_with_the_reference() {
    follow("profile_rate_A.csv", 1.0, 1.0);
}

#[test]
fn profile_of_variant_b_agrees_with_the_reference() {
    follow("profile_flow_B.csv", 2.0, 2.0);
}

fn command_all(fmu: &mut Named<Boom>, values: [f64; 6]) {
    (1..=6).zip(values).for_each(|(i, u)| set(fmu, &format!("joint[{i}].velocity_command"), u));
}

/// E1, E7, E8: every joint ends exactly at its limit whatever the step, leaves it on command, motion without parts is the same.
#[test]
fn joints_stop_at_their_ranges_and_leave_them() {
    let max = [3.228_858_116_2, 1.535_889_741_8, 0.087_266_462_6, 3.106_686_068_5, 0.087_266_462_6, 3.132_866_007_3];
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
                assert!(angle.to_bits() == f64::to_bits(max), "joint {i} at {angle}, lag {lag}, variant {variant}");
                assert!(get(&mut fmu, &format!("joint[{i}].velocity")).abs() <= 0.0);
            }
            assert!((get(&mut fmu, "solver.events") - 6.0).abs() < 0.5, "{}", get(&mut fmu, "solver.events"));
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
    assert!(get(&mut fmu, "joint[1].angle").abs() <= 0.0 && (get(&mut fmu, "limiter.stage[1]") - 1.0).abs() < 0.5);
    command_all(&mut fmu, [0.0; 6]);
    fmu.step(1.0).expect("a step");
    command_all(&mut fmu, [f64::NAN; 6]);
    fmu.step(1.0).expect("a step");
    assert_eq!(fmu.instance.take_warnings().len(), 1);
}

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
        let evaluations = get(&mut fmu, "solver.distance_evaluations");
        assert!(if on > 0.5 { evaluations >= 5.0 } else { evaluations.abs() <= 0.0 });
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
        for (name, value) in [("TIP.F.x", 300.0), ("TIP.F.y", -200.0), ("TIP.F.z", -1500.0), ("TIP.M.xx", mass)] {
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
            let tip = |fmu: &mut Named<Boom>, what: &str| ["x", "y", "z"].map(|c| get(fmu, &format!("TIP.{what}.{c}")));
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
