//! What a run leaves alone, repeats and counts.
#![allow(clippy::unwrap_used, reason = "tests")]

mod support;

use host::import::{Fmu, Instance, Interface};
use host::methods::Choices;
use host::ssp::{Component, Package};
use support::{changed, common, fmus, inner, method, root, run, scene};

#[test]
fn runs_repeat_bit_for_bit() {
    let scene = scene("double_pendulum");
    for choices in [common("dopri5", 1.0), method("cs-pece", 1, 0.01), method("jacobi", 1, 0.01)] {
        let rows = || run(&scene, &choices, &inner(0.01)).unwrap().recorder.rows;
        assert_eq!(rows(), rows(), "{:?}", choices.method);
    }
}

#[test]
fn recording_changes_no_result() {
    let every = scene("double_pendulum");
    for choices in [common("dopri5", 1.0), common("rk4", 0.01), method("cs-pece", 1, 0.01)] {
        let last = |interval: f64| {
            let choices = Choices { interval: Some(interval), ..choices.clone() };
            run(&every, &choices, &inner(0.01)).unwrap().recorder.rows.last().cloned()
        };
        assert_eq!(last(0.05), last(2.0), "{:?}", choices.method);
    }
}

/// A component without connection and record is started and integrated, but no value of it is read or written.
#[test]
fn values_of_an_island_are_not_exchanged() {
    let with = changed("double_pendulum", |system| {
        let source = "resources/four_bar.fmu".into();
        system.components.push(Component { name: "island".into(), source, ..Component::default() });
    });
    let choices = Choices { interval: Some(2.0), ..method("cs-predict", 1, 0.01) };
    let [alone, beside] = [&scene("double_pendulum"), &with].map(|s| run(s, &choices, &inner(0.01)).unwrap());
    assert_eq!(alone.recorder.rows, beside.recorder.rows, "the pendulum does not feel it");
    assert_eq!(alone.cost.calls.get, beside.cost.calls.get);
}

/// One Get and one Set per element and pass: a chain of two links needs as many as its leader and follower.
#[test]
fn calls_of_a_tree_are_one_get_and_one_set_per_element_and_pass() {
    let choices = Choices { interval: Some(2.0), ..common("rk4", 0.01) };
    let cost = run(&scene("double_pendulum"), &choices, &[]).unwrap().cost;
    let sweeps = cost.sweeps;
    // upper: r v, a; lower: F0 M; and at the two samples one Get of each
    assert_eq!(cost.calls.get, 3 * sweeps + 4);
    // upper: F M; lower: r v, a; unchanged inputs are not set again
    assert!(cost.calls.set <= 3 * sweeps && cost.calls.set >= 3 * sweeps - 12, "{} {sweeps}", cost.calls.set);
}

#[test]
fn a_scene_in_an_archive_gives_the_same_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let archive = folder.path().join("double_pendulum.ssp");
    let source = root().join("scenes/double_pendulum");
    host::ssp::pack(&source, &fmus(), &root().join("tests/reference"), &archive).unwrap();
    let first = std::fs::read(&archive).unwrap();
    host::ssp::pack(&source, &fmus(), &root().join("tests/reference"), &archive).unwrap();
    assert_eq!(std::fs::read(&archive).unwrap(), first, "packing twice gives the same bytes");
    let nowhere = folder.path().join("no FMUs here");
    let packed = host::run::Scene::load(&archive, &nowhere, None).unwrap();
    let rows = |s| run(s, &common("rk4", 0.01), &[]).unwrap().recorder.rows;
    assert_eq!(rows(&packed), rows(&scene("double_pendulum")));
}

#[test]
fn paths_out_of_the_scene_are_refused() {
    let package = Package::open(&root().join("scenes/double_pendulum")).unwrap();
    assert!(package.read("../four_bar/SystemStructure.ssd").is_err());
    assert!(package.read("/etc/passwd").is_err());
}

/// A falling rod, hung at rest: theta'' = -3/2 g / L cos(theta), from the horizontal.
#[test]
fn a_model_exchange_instance_gives_the_rods_equation() {
    let fmu = Fmu::open(&fmus().join("link2.fmu")).unwrap();
    let mut rod = fmu.instantiate("rod", Interface::ModelExchange).unwrap();
    let description = &fmu.description;
    let reference = |name: &str| description.variable(name).unwrap().reference;
    rod.set(&[reference("length"), reference("gravity.z"), reference("angle.theta")], &[2.0, -10.0, 0.0])
        .unwrap();
    rod.enter_initialization(0.0, None).unwrap();
    rod.exit_initialization().unwrap();
    rod.update_discrete_states().unwrap();
    rod.enter_continuous_time_mode().unwrap();
    let n = description.states.len();
    let (mut x, mut dx) = (vec![0.0; n], vec![0.0; n]);
    let rate = description.states.iter().position(|r| *r == reference("angle_rate.theta")).unwrap();
    rod.get_states(&mut x).unwrap();
    rod.get_derivatives(&mut dx).unwrap();
    assert!((dx[rate] + 1.5 * 10.0 / 2.0).abs() < 1e-12, "{}", dx[rate]);
    // d theta'' / d a_z = -3/2 / L at the horizontal
    let derivative = description.variable("der(angle_rate.theta)").unwrap().reference;
    let mut sensitivity = [0.0];
    rod.directional(&[derivative], &[reference("A.a.z")], &[1.0], &mut sensitivity).unwrap();
    assert!((sensitivity[0] + 0.75).abs() < 1e-12, "{}", sensitivity[0]);
}

fn stepped(link: &mut Instance, from: f64) -> Vec<u64> {
    for i in 0..10 {
        link.do_step(from + 0.01 * f64::from(i), 0.01, true).unwrap();
    }
    let reference = |name: &str| link.fmu().description.variable(name).unwrap().reference;
    let references = ["angle.theta", "angle_rate.theta", "energy.kinetic"].map(reference);
    let mut values = [0.0; 3];
    link.get(&references, &mut values).unwrap();
    values.map(f64::to_bits).to_vec()
}

#[test]
fn restore_and_repeat_is_bit_identical() {
    let fmu = Fmu::open(&fmus().join("link2.fmu")).unwrap();
    let mut link = fmu.instantiate("link", Interface::PlainCoSimulation).unwrap();
    link.enter_initialization(0.0, None).unwrap();
    link.exit_initialization().unwrap();
    stepped(&mut link, 0.0);
    let mut saved = None;
    link.save(&mut saved).unwrap();
    let saved = saved.unwrap();
    let first = stepped(&mut link, 0.1);
    link.restore(&saved).unwrap();
    assert_eq!(stepped(&mut link, 0.1), first);
    link.forget(saved).unwrap();
}

#[test]
fn a_call_in_the_wrong_phase_is_an_error_and_not_the_end() {
    let fmu = Fmu::open(&fmus().join("link2.fmu")).unwrap();
    let mut link = fmu.instantiate("link", Interface::PlainCoSimulation).unwrap();
    let fault = link.do_step(0.0, 0.1, false).unwrap_err();
    assert_eq!(fault.to_string(), "fmi3DoStep returned Error");
    assert!(link.messages().iter().any(|m| m.contains("fmi3DoStep")), "the FMU says why");
}
