//! Method `common` on the benchmark scenes.
#![allow(clippy::unwrap_used, reason = "tests")]
use std::path::{Path, PathBuf};

use host::methods::{Choices, Config};
use host::run::Scene;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

#[test]
fn cs() {
    for (method, order, step) in [
        ("jacobi", 1, 0.005),
        ("jacobi", 1, 0.00125),
        ("seidel", 1, 0.005),
        ("cs-predict", 1, 0.00125),
        ("cs-pece", 1, 0.005),
        ("cs-pece", 2, 0.005),
    ] {
        let scene = Scene::load(
            &Path::new("/tmp/scenes_copy").join("double_pendulum"),
            &root().join("dist/fmi3"),
            None,
        )
        .unwrap();
        let choices = Choices {
            method: Some(method.into()),
            order: Some(order),
            step: Some(step),
            ..Choices::default()
        };
        let config = Config::new(&scene.system, &choices).unwrap();
        let mut recorder = scene.recorder(&config);
        let o: Vec<_> = ["upper", "lower"]
            .iter()
            .flat_map(|n| {
                [
                    (format!("{n}.solver.step"), host::ssp::ParameterValue::Real(step)),
                    (format!("{n}.solver.method"), host::ssp::ParameterValue::Text("rk4".into())),
                ]
            })
            .collect();
        match scene.run(&config, &o, &mut recorder, &mut |_| ()) {
            Ok(cost) => {
                eprintln!("{method} {order} {step} {:?}", recorder.rows.last());
                eprintln!("{cost:?}");
            }
            Err(e) => eprintln!("{method}: {e}"),
        }
    }
}

#[test]
fn dp() {
    for (name, step) in [
        ("double_pendulum", 0.005),
        ("four_bar", 0.01),
        ("double_wishbone", 0.005),
        ("double_wishbone_two_chain", 0.005),
    ] {
        let scene =
            Scene::load(&Path::new("/tmp/scenes_copy").join(name), &root().join("dist/fmi3"), None).unwrap();
        let choices = Choices { integrator: Some("rk4".into()), step: Some(step), ..Choices::default() };
        let config = Config::new(&scene.system, &choices).unwrap();
        let mut recorder = scene.recorder(&config);
        match scene.run(&config, &[], &mut recorder, &mut |_| ()) {
            Ok(cost) => {
                eprintln!("{name} {:?} {:?}", recorder.names, recorder.rows.last());
                eprintln!(
                    "{cost:?} calls per rhs {}",
                    cost.calls.total() as f64 / cost.steps.rhs_evaluations as f64
                );
            }
            Err(e) => eprintln!("{name}: {e}"),
        }
    }
}
