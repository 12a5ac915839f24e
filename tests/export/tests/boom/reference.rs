//! 54 poses and two profiles of commands of an independent program.

use std::collections::HashMap;

use export_tests::Named;
use models::boom::Boom;

use crate::{boom, get, set, set_angles};

type Row = HashMap<String, String>;

/// Rows of a reference file, by column.
fn read(name: &str) -> Vec<Row> {
    let path = format!("{}/../reference/boom/{name}", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(path).expect("a reference file");
    let mut lines = text.lines().filter(|l| !l.starts_with('#'));
    let names: Vec<_> = lines.next().expect("names").split(',').collect();
    lines
        .map(|l| names.iter().map(ToString::to_string).zip(l.split(',').map(String::from)).collect())
        .collect()
}

fn number(row: &Row, name: &str) -> f64 {
    row.get(name).and_then(|v| v.parse().ok()).unwrap_or_else(|| panic!("column {name}"))
}

/// A boom in the pose of a row, with the settings.
fn posed(row: &Row, settings: &[(&str, f64)]) -> Named<Boom> {
    let mut fmu = boom(settings);
    set_angles(&mut fmu, std::array::from_fn(|i| number(row, &format!("q{}", i + 1))));
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
