//! Method `common` on the benchmark scenes.
#![allow(clippy::unwrap_used, reason = "tests")]
use std::path::{Path, PathBuf};

use host::methods::{Choices, Config};
use host::run::Scene;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
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
