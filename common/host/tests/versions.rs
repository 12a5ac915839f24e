//! FMI 2.0 beside 3.0, and FMUs that offer less.
#![allow(clippy::unwrap_used, reason = "tests")]

mod support;

use std::fs::File;
use std::io::{Read, Write};
use std::path::Path;

use host::methods::Choices;
use host::run::Scene;
use support::{common, error, fmus, inner, method, reference, root, run, scene};
use zip::write::SimpleFileOptions;
use zip::{ZipArchive, ZipWriter};

fn pendulum(folder: &Path) -> Scene {
    Scene::load(&root().join("scenes/double_pendulum"), folder, None).unwrap()
}

/// The same library under both versions: states, derivatives and steps are the same.
#[test]
fn fmi_2_gives_the_numbers_of_fmi_3() {
    let folder = root().join("dist/fmi2");
    assert!(folder.join("link2.fmu").is_file(), "no FMI 2.0 FMUs in {}: run scripts/build", folder.display());
    for choices in
        [common("rk4", 0.01), common("dopri5", 1.0), method("jacobi", 1, 0.01), method("seidel", 1, 0.01)]
    {
        let rows = |scene: &Scene| run(scene, &choices, &inner(0.01)).unwrap().recorder.rows;
        let (two, three) = (rows(&pendulum(&folder)), rows(&scene("double_pendulum")));
        assert_eq!(two.len(), 201);
        for (a, b) in two.iter().flatten().zip(three.iter().flatten()) {
            assert!((a - b).abs() <= 1e-12, "{:?}: {a} {b}", choices.method);
        }
    }
}

/// The leader's acceptance of inertia is not affine: the error is half as large again, its order the same.
#[test]
fn fmi_2_answers_sweeps_by_its_linear_response() {
    let exact = reference("coupling/double_pendulum.csv");
    let reached = |scene: &Scene, k: i64, h: f64| {
        error(&run(scene, &method("cs-pece", k, h), &inner(h)).unwrap().recorder, &exact)
    };
    let (two, three) = (pendulum(&root().join("dist/fmi2")), scene("double_pendulum"));
    for k in [1, 2] {
        let errors = [5e-3, 2.5e-3].map(|h| reached(&two, k, h));
        assert!(errors[0] <= 1.5 * reached(&three, k, 5e-3), "k = {k}: {errors:?}");
        let order = (errors[0] / errors[1]).log2();
        let promised = [3.0, 4.0][usize::from(k == 2)];
        assert!((order - promised).abs() < 0.2, "k = {k}: {errors:?}");
    }
}

#[test]
fn an_fmu_with_neither_event_mode_nor_derivatives_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    altered(folder.path(), |text| {
        assert!(text.contains("hasEventMode=\"true\""));
        let text = text.replace("hasEventMode=\"true\"", "hasEventMode=\"false\"");
        text.replace("providesDirectionalDerivatives=\"true\"", "providesDirectionalDerivatives=\"false\"")
    });
    let message =
        run(&pendulum(folder.path()), &method("cs-predict", 1, 0.01), &[]).err().unwrap().to_string();
    for part in ["upper (link2)", "Event Mode or directional derivatives", "jacobi and seidel"] {
        assert!(message.contains(part), "{message}");
    }
}

/// `link2` with another model description.
fn altered(folder: &Path, change: impl Fn(String) -> String) {
    let mut old = ZipArchive::new(File::open(fmus().join("link2.fmu")).unwrap()).unwrap();
    let mut new = ZipWriter::new(File::create(folder.join("link2.fmu")).unwrap());
    for i in 0..old.len() {
        let mut entry = old.by_index(i).unwrap();
        let name = entry.name().unwrap().into_owned();
        let mut content = Vec::new();
        entry.read_to_end(&mut content).unwrap();
        if name == "modelDescription.xml" {
            let text = String::from_utf8(content).unwrap();
            let changed = change(text.clone());
            assert!(changed != text, "nothing changed");
            content = changed.into_bytes();
        }
        new.start_file(name, SimpleFileOptions::default()).unwrap();
        new.write_all(&content).unwrap();
    }
    new.finish().unwrap();
}

#[test]
fn an_fmu_without_state_saving_is_predicted_only() {
    let folder = tempfile::tempdir().unwrap();
    altered(folder.path(), |text| {
        text.replace("canGetAndSetFMUState=\"true\"", "canGetAndSetFMUState=\"false\"")
    });
    let scene = pendulum(folder.path());
    let message = run(&scene, &method("cs-pece", 1, 0.01), &[]).err().unwrap().to_string();
    assert!(message.contains("upper (link2)") && message.contains("canGetAndSetFMUState"), "{message}");
    assert!(run(&scene, &method("cs-predict", 1, 0.01), &[]).is_ok());
}

#[test]
fn hostile_model_descriptions_are_refused() {
    let refusal = |from: &str, to: &str| {
        let folder = tempfile::tempdir().unwrap();
        altered(folder.path(), |text| text.replace(from, to));
        let scene = Scene::load(&root().join("scenes/double_pendulum"), folder.path(), None);
        match scene {
            Err(error) => error.to_string(),
            Ok(scene) => run(&scene, &Choices { step: Some(0.01), ..Choices::default() }, &[])
                .err()
                .expect("refused")
                .to_string(),
        }
    };
    let identifier = refusal("modelIdentifier=\"link2\"", "modelIdentifier=\"../../link2\"");
    assert!(identifier.contains("not made for this platform"), "{identifier}");
    assert!(refusal("fmiVersion=\"3.0\"", "fmiVersion=\"1.0\"").contains("1.0"));
    assert!(refusal("</ModelVariables>", "").contains("XML"));
    assert!(refusal("name=\"length\"", "name=\"mass\"").contains("\"mass\""));
    assert!(refusal("instantiationToken=\"{", "instantiationToken=\"{0").contains("no instance"));
}
