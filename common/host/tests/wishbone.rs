//! The double wishbone from its elements against the monolithic FMU, which shares the equations but not the coupling,
//! and against the reference of the paper's case.
#![allow(clippy::unwrap_used, reason = "tests")]

mod support;

use host::methods::Choices;
use host::ssp::{Component, Settings};
use support::{changed, common, reference, run, scene, set};

const ANGLES: [&str; 3] = ["lower.angle.theta", "carrier.angle.psi", "upper.angle.theta"];

/// Angles of the monolith, integrated by the same host from its own derivatives.
fn monolith(choices: &Choices, kind: &str) -> Vec<Vec<f64>> {
    let scene = changed("double_wishbone", |system| {
        let source = "resources/double_wishbone.fmu".into();
        system.components = vec![Component { name: "whole".into(), source, ..Component::default() }];
        system.connections.clear();
        let record = ANGLES.iter().map(|name| format!("whole.{name}")).collect();
        system.settings = Settings { record, interval: Some(0.05), ..Settings::default() };
    });
    run(&scene, choices, &[set("whole.stabilisation.kind", kind)]).unwrap().recorder.rows
}

#[test]
fn elements_equal_the_monolith() {
    for (kind, alpha) in [("none", 0.0), ("baumgarte", 20.0)] {
        for (integrator, step, stop) in [("heun", 0.05, 10.0), ("rk4", 0.05, 10.0), ("rk4", 0.01, 2.0)] {
            let choices = Choices { alpha: Some(alpha), stop: Some(stop), ..common(integrator, step) };
            let elements = run(&scene("double_wishbone"), &choices, &[]).unwrap().recorder;
            let whole = monolith(&choices, kind);
            assert_eq!(elements.rows.len(), whole.len());
            let mut amplitude = 0.0_f64;
            for (column, name) in ANGLES.iter().enumerate() {
                let ours = elements.column(name).unwrap();
                for (a, b) in ours.iter().zip(whole.iter().map(|row| row[column])) {
                    assert!((a - b).abs() <= 1e-12, "{kind} {integrator} {step} {name}: {a} {b}");
                    amplitude = amplitude.max((a - ours[0]).abs());
                }
            }
            assert!(amplitude > 1e-3, "it moves");
        }
    }
}

/// Counted over the whole run, start, Event Mode and completed steps included.
#[test]
fn right_hand_side_costs_at_most_65_calls() {
    let choices = Choices { interval: Some(10.0), ..common("rk4", 0.05) };
    let cost = run(&scene("double_wishbone"), &choices, &[]).unwrap().cost;
    let (calls, rhs) = (cost.calls.total(), cost.steps.rhs_evaluations);
    eprintln!("{calls} calls, {rhs} right-hand sides, {} each", calls / rhs);
    assert!(calls <= 65 * rhs, "{calls} calls of {rhs} right-hand sides");
    assert!(calls >= 20 * rhs, "one Set and one Get in each pass of each of four elements");
}

/// Limits of the monolith: theta1 [rad], gap [m].
#[test]
fn elements_follow_the_reference() {
    let paper = reference("suspension/wishbone_paper.csv");
    for (integrator, step, limit, gap) in
        [("heun", 0.05, 1e-3, 1e-6), ("rk4", 0.05, 3e-5, 1e-6), ("rk4", 0.01, 5e-8, 1e-9)]
    {
        let run = run(&scene("double_wishbone"), &common(integrator, step), &[]).unwrap();
        let theta = run.recorder.column(ANGLES[0]).unwrap();
        let mut worst = 0.0_f64;
        for (t, value) in run.recorder.times.iter().zip(theta) {
            let exact = paper.iter().find(|row| (row[0] - t).abs() < 1e-9).unwrap()[1];
            worst = worst.max((value - exact).abs());
        }
        eprintln!("{integrator} {step}: {worst:.3e}, gap {:.3e}", run.cost.steps.gap);
        assert!(worst <= limit && run.cost.steps.gap <= gap, "{integrator} {step}: {worst:e}");
    }
}

/// Measured by a separate program: 9.9e-6, 2.4e-9.
#[test]
fn two_chains_follow_the_reference() {
    let paper = reference("suspension/wishbone_paper.csv");
    for (integrator, limit) in [("heun", 3e-5), ("rk4", 1e-8)] {
        let recorder =
            run(&scene("double_wishbone_two_chain"), &common(integrator, 0.005), &[]).unwrap().recorder;
        let theta = recorder.column(ANGLES[0]).unwrap();
        for (t, value) in recorder.times.iter().zip(theta) {
            let exact = paper.iter().find(|row| (row[0] - t).abs() < 1e-9).unwrap()[1];
            assert!((value - exact).abs() <= limit, "{integrator} t = {t}: {value} {exact}");
        }
    }
}
