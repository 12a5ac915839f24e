//! Scenes, runs and references of the tests.
#![allow(dead_code, reason = "each test file uses its part")]

use std::fs;
use std::path::{Path, PathBuf};

use host::error::Error;
use host::methods::{Choices, Config};
use host::record::Recorder;
use host::run::{Cost, Scene};
use host::scene::Override;
use host::ssp::{Package, ParameterValue, System};

/// Root of the repository.
pub(crate) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Folder of the packed FMUs.
pub(crate) fn fmus() -> PathBuf {
    let folder = root().join("dist/fmi3");
    assert!(folder.join("link2.fmu").is_file(), "no FMUs in {}: run scripts/build", folder.display());
    folder
}

pub(crate) fn scene(name: &str) -> Scene {
    Scene::load(&root().join("scenes").join(name), &fmus(), None).unwrap()
}

/// A scene with a changed system.
pub(crate) fn changed(name: &str, change: impl FnOnce(&mut System)) -> Scene {
    let package = Package::open(&root().join("scenes").join(name)).unwrap();
    let mut system = package.system().unwrap();
    change(&mut system);
    Scene::build(package, system, &fmus()).unwrap()
}

pub(crate) struct Run {
    pub(crate) recorder: Recorder,
    pub(crate) cost: Cost,
}

pub(crate) fn set(name: &str, value: &str) -> Override {
    (name.into(), ParameterValue::Text(value.into()))
}

/// The FMUs' own solver takes one RK4 step per communication step.
pub(crate) fn inner(step: f64) -> Vec<Override> {
    vec![set("*.solver.method", "rk4"), set("*.solver.step", &step.to_string())]
}

pub(crate) fn run(scene: &Scene, choices: &Choices, overrides: &[Override]) -> Result<Run, Error> {
    let config = Config::new(&scene.system, choices)?;
    let mut recorder = scene.recorder(&config);
    let cost = scene.run(&config, overrides, &mut recorder, &mut |_| ())?;
    Ok(Run { recorder, cost })
}

pub(crate) fn common(integrator: &str, step: f64) -> Choices {
    let (integrator, step) = (Some(integrator.into()), Some(step));
    Choices { method: Some("common".into()), integrator, step, ..Choices::default() }
}

pub(crate) fn method(name: &str, order: i64, step: f64) -> Choices {
    Choices { method: Some(name.into()), order: Some(order), step: Some(step), ..Choices::default() }
}

/// Rows of a reference file: time, then the values.
pub(crate) fn reference(name: &str) -> Vec<Vec<f64>> {
    let path = root().join("tests/reference").join(name);
    let text = fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let rows = text.lines().filter(|l| !l.starts_with('#')).skip(1);
    rows.map(|l| l.split(',').map(|v| v.parse().unwrap()).collect()).collect()
}

/// Largest difference to a reference at its times, columns in the same order.
pub(crate) fn error(recorder: &Recorder, reference: &[Vec<f64>]) -> f64 {
    let mut largest = 0.0_f64;
    for (t, row) in recorder.times.iter().zip(&recorder.rows) {
        let exact = reference.iter().find(|r| (r[0] - t).abs() < 1e-9).expect("a reference at each sample");
        for (value, exact) in row.iter().zip(&exact[1..]) {
            largest = largest.max((value - exact).abs());
        }
    }
    largest
}
