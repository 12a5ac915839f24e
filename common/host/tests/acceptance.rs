//! The benchmark scenes by every method against solutions that share no code with the product (`tests/oracle`).
//!
//! Errors are the largest of all states at 20 equal samples; components step by RK4, one inner step per H. In brackets
//! what a separate program reached.
#![allow(clippy::unwrap_used, reason = "tests")]

mod support;

use host::error::Error;
use host::methods::Choices;
use host::run::Scene;
use host::ssp::Package;
use support::{common, error, fmus, inner, method, reference, root, run, scene, set};

const SAMPLES: f64 = 20.0;

/// Length of each scene [s].
fn stop(name: &str) -> f64 {
    if name == "four_bar" { 3.0 } else { 2.0 }
}

#[track_caller]
fn stays_within(name: &str, choices: Choices, limit: f64) {
    let step = choices.step.unwrap();
    let overrides = if choices.method.as_deref() == Some("common") { vec![] } else { inner(step) };
    let choices = Choices { interval: Some(stop(name) / SAMPLES), ..choices };
    let run = run(&scene(name), &choices, &overrides).unwrap();
    let reached = error(&run.recorder, &reference(&format!("coupling/{name}.csv")));
    eprintln!("{name} {choices:?}: {reached:.3e} (limit {limit:e})");
    assert!(run.recorder.times.len() == 21 && reached <= limit, "{reached:e} > {limit:e}");
}

#[test]
fn two_mass_by_jacobi() {
    stays_within("two_mass", method("jacobi", 1, 5e-3), 2e-2); // (1.3e-2)
    stays_within("two_mass", method("jacobi", 1, 1.25e-3), 1.2e-3); // (7.8e-4)
}

#[test]
fn two_mass_by_pece() {
    stays_within("two_mass", method("cs-pece", 1, 5e-3), 1.2e-4); // (7.8e-5)
}

#[test]
fn double_pendulum_by_jacobi() {
    stays_within("double_pendulum", method("jacobi", 1, 5e-3), 6e-2); // (4.2e-2)
    stays_within("double_pendulum", method("jacobi", 1, 1.25e-3), 4e-3); // (2.6e-3)
}

#[test]
fn double_pendulum_by_prediction_and_correction() {
    stays_within("double_pendulum", method("cs-predict", 1, 1.25e-3), 3e-3); // (1.9e-3)
    stays_within("double_pendulum", method("cs-pece", 1, 5e-3), 1e-3); // (5.9e-4)
    stays_within("double_pendulum", method("cs-pece", 2, 5e-3), 5e-5); // (2.9e-5)
}

#[test]
fn double_pendulum_in_common() {
    stays_within("double_pendulum", common("rk4", 5e-3), 3e-6); // (1.8e-6)
}

#[test]
fn four_bar_in_common() {
    stays_within("four_bar", Choices { alpha: Some(0.0), ..common("rk4", 10e-3) }, 8e-6); // (5.0e-6)
}

#[test]
fn four_bar_by_correction() {
    let pece = |step| Choices { alpha: Some(0.0), ..method("cs-pece", 2, step) };
    stays_within("four_bar", pece(10e-3), 2e-2); // (1.0e-2)
    stays_within("four_bar", pece(2.5e-3), 8e-5); // (5.1e-5)
}

#[test]
fn gap_of_the_four_bar_stays_closed() {
    let choices =
        Choices { alpha: Some(2.0), stop: Some(30.0), interval: Some(30.0), ..common("rk4", 10e-3) };
    let gap = run(&scene("four_bar"), &choices, &[]).unwrap().cost.steps.gap;
    assert!(gap > 0.0 && gap <= 2e-7, "{gap:e}"); // (9.5e-8)
}

/// Any ratio of masses is stable with inertial ports; the reference for each is method common at a tight tolerance, which
/// follows the exact solution at the ratio that has one.
#[test]
fn any_ratio_of_masses_is_stable() {
    let scene = scene("two_mass");
    for mass in ["0.1", "1", "10", "100"] {
        let root = set("follower.root.mass", mass);
        let tight =
            Choices { rtol: Some(1e-11), atol: Some(1e-12), interval: Some(0.1), ..common("dop853", 1.0) };
        let exact = run(&scene, &tight, std::slice::from_ref(&root)).unwrap().recorder;
        for choices in [method("jacobi", 1, 2e-3), method("cs-predict", 1, 2e-3), method("cs-pece", 1, 2e-3)]
        {
            let mut overrides = inner(2e-3);
            overrides.push(root.clone());
            let choices = Choices { interval: Some(0.1), ..choices };
            let rows = run(&scene, &choices, &overrides).unwrap().recorder.rows;
            let differences =
                rows.iter().flatten().zip(exact.rows.iter().flatten()).map(|(a, b)| (a - b).abs());
            let worst = differences.fold(0.0, f64::max);
            assert!(worst <= 1e-2, "{:?} mass {mass}: {worst:e}", choices.method);
        }
    }
}

fn raw(name: &str) -> Scene {
    let package = Package::open(&root().join("scenes").join(name)).unwrap();
    let system = package.system().unwrap().raw();
    Scene::build(package, system, &fmus()).unwrap()
}

/// It must: this shows that the inertial connections are needed and that divergence is seen.
#[test]
fn raw_exchange_of_a_heavy_follower_diverges() {
    let scene = raw("two_mass");
    for name in ["jacobi", "seidel"] {
        for order in 0..=2 {
            let result = run(&scene, &method(name, order, 5e-3), &inner(5e-3));
            let diverged = match result {
                Err(Error::Run(_)) => true,
                Err(error) => panic!("{error}"),
                Ok(run) => run.recorder.rows.iter().flatten().any(|v| v.abs() > 1e6),
            };
            assert!(diverged, "{name} order {order}");
        }
    }
}

/// The true force of a heavy follower under `common`: one affine loop per stage, the numbers of the inertial ports.
#[test]
fn a_raw_loop_is_solved_where_the_host_may() {
    for name in ["two_mass", "double_pendulum"] {
        let choices = Choices { interval: Some(0.1), ..common("rk4", 5e-3) };
        let rows = |scene: &Scene| run(scene, &choices, &[]).unwrap().recorder.rows;
        let (loops, ports) = (rows(&raw(name)), rows(&scene(name)));
        for (a, b) in loops.iter().flatten().zip(ports.iter().flatten()) {
            assert!((a - b).abs() <= 1e-10, "{name}: {a} {b}");
        }
    }
}
