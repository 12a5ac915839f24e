//! What is wrong with a scene is said with names, values and what is allowed.
#![allow(clippy::unwrap_used, reason = "tests")]

mod support;

use host::error::{Error, RunError};
use host::methods::Choices;
use host::run::Scene;
use host::scene::SceneError;
use host::ssp::{Component, Connection, Package, ParameterValue, Settings, System};
use support::{changed, common, fmus, method, root, run, scene, set};

fn refused(name: &str, change: impl FnOnce(&mut System)) -> String {
    let package = Package::open(&root().join("scenes").join(name)).unwrap();
    let mut system = package.system().unwrap();
    change(&mut system);
    Scene::build(package, system, &fmus()).err().expect("refused").to_string()
}

#[track_caller]
fn says(message: &str, parts: &[&str]) {
    for part in parts {
        assert!(message.contains(part), "{message:?} lacks {part:?}");
    }
}

fn connection(from: (&str, &str), to: (&str, &str)) -> Connection {
    let end = |(component, variable): (&str, &str)| (component.to_owned(), variable.to_owned());
    Connection { from: end(from), to: end(to), factor: 1.0, offset: 0.0 }
}

#[test]
fn missing_connector() {
    let extra = connection(("upper", "B.q.x"), ("lower", "A.r.x"));
    let message = refused("double_pendulum", |system| system.connections = vec![extra]);
    says(&message, &["upper.B.q.x -> lower.A.r.x", "link2", "\"B.q.x\"", "similar"]);
}

#[test]
fn missing_component() {
    let extra = connection(("nobody", "B.r.x"), ("lower", "A.r.x"));
    let message = refused("double_pendulum", |system| system.connections.push(extra));
    says(&message, &["\"nobody\"", "components: upper, lower"]);
}

#[test]
fn unit_mismatch() {
    let wrong = connection(("upper", "B.v.x"), ("lower", "A.r.x"));
    let message = refused("double_pendulum", |system| system.connections = vec![wrong]);
    says(&message, &["upper.B.v.x -> lower.A.r.x", "\"m/s\"", "\"m\""]);
}

#[test]
fn two_sources_of_an_input() {
    let second = connection(("upper", "B.r.z"), ("lower", "A.r.x"));
    let message = refused("double_pendulum", |system| system.connections.push(second));
    says(&message, &["lower.A.r.x", "upper.B.r.x", "upper.B.r.z", "P.slot[2]"]);
}

#[test]
fn an_output_as_a_sink() {
    let wrong = connection(("upper", "B.r.x"), ("lower", "B.r.x"));
    says(
        &refused("double_pendulum", |s| s.connections.push(wrong)),
        &["lower.B.r.x is not a real scalar input"],
    );
}

#[test]
fn missing_fmu() {
    let message = refused("double_pendulum", |s| s.components[0].source = "resources/absent.fmu".into());
    says(&message, &["resources/absent.fmu", "--fmus"]);
}

#[test]
fn unknown_parameter_and_enumeration_item() {
    let scene = scene("double_pendulum");
    let choices = common("rk4", 0.01);
    let message = |name, value| run(&scene, &choices, &[set(name, value)]).err().unwrap().to_string();
    says(&message("upper.weight", "1"), &["upper (link2) has no variable \"weight\""]);
    says(
        &message("upper.joint.kind", "ball"),
        &["upper.joint.kind", "\"ball\"", "planar, revolute, universal"],
    );
    says(&message("upper.mass", "heavy"), &["upper.mass = heavy", "a number is needed"]);
    says(&message("upper.mass", "-1"), &["upper.mass = -1", "Discard", "mass"]);
    says(&message("*.weight", "1"), &["*.weight", "none has it"]);
}

#[test]
fn an_integer_fits_a_real_but_no_boolean() {
    let wrong =
        |value| changed("double_pendulum", |s| s.components[0].parameters.push(("use.energy".into(), value)));
    let result = run(&wrong(ParameterValue::Real(1.0)), &common("rk4", 0.01), &[]);
    says(&result.err().unwrap().to_string(), &["upper.use.energy = 1", "true or false"]);
    let scene = changed("double_pendulum", |s| {
        s.components[0].parameters.push(("mass".into(), ParameterValue::Integer(1)));
    });
    assert!(run(&scene, &common("rk4", 0.01), &[]).is_ok());
}

#[test]
fn an_open_loop() {
    let result = run(&scene("four_bar"), &common("rk4", 0.01), &[set("link3.angle.theta", "2")]);
    says(&result.err().unwrap().to_string(), &["link2.B - link3.B is open at the start", "m", "assemble"]);
    let moving = run(&scene("four_bar"), &common("rk4", 0.01), &[set("link3.angle_rate.theta", "1e-6")]);
    assert!(matches!(moving.err(), Some(Error::Run(RunError::Gap { velocity, .. })) if velocity > 1e-6));
}

/// Two rods that just span the distance of their fixed points: along the line no force can do what the motion would need.
#[test]
fn a_singular_closure() {
    let link = |name: &str, theta: f64, x: f64| Component {
        name: name.into(),
        source: "resources/link2.fmu".into(),
        connectors: vec![],
        parameters: [("mass", 1.0), ("length", 1.0), ("angle.theta", theta), ("A.r.x", x)]
            .map(|(name, value)| (name.to_owned(), ParameterValue::Real(value)))
            .to_vec(),
    };
    let scene = changed("four_bar", |system| {
        system.components = vec![link("left", 0.0, 0.0), link("right", std::f64::consts::PI, 2.0)];
        system.connections.clear();
        let joints = vec![("left.B".into(), "right.B".into())];
        system.settings = Settings { joints, ..Settings::default() };
    });
    let error = run(&scene, &common("rk4", 0.005), &[]).err().unwrap();
    says(&error.to_string(), &["inconsistent or singular closure", "left.B - right.B"]);
}

/// From start angles off by up to 0.05 rad back to the benchmark's, the crank kept.
#[test]
fn assemble_finds_the_closed_loop() {
    let scene = changed("four_bar", |system| {
        system.settings.assemble = vec!["link2.angle.theta".into(), "link3.angle.theta".into()];
    });
    let exact = [1.283_927_331_843_103_5, -4.306_228_319_614_897];
    let off = [
        set("link2.angle.theta", &(exact[0] + 0.05).to_string()),
        set("link3.angle.theta", &(exact[1] - 0.03).to_string()),
    ];
    let choices = Choices { stop: Some(0.03), ..common("rk4", 0.015) };
    let recorder = run(&scene, &choices, &off).unwrap().recorder;
    for (name, exact) in ["link2.angle.theta", "link3.angle.theta"].iter().zip(exact) {
        let start = recorder.column(name).unwrap()[0];
        assert!((start - exact).abs() < 1e-9, "{name}: {start}");
    }
    let far = [set("link3.A.r.x", "9")];
    let error = run(&scene, &choices, &far).err();
    assert!(matches!(error, Some(Error::Run(RunError::Assemble { .. }))), "{error:?}");
}

#[test]
fn settings_out_of_range() {
    let scene = scene("double_pendulum");
    let message = |choices: &Choices| run(&scene, choices, &[]).err().unwrap().to_string();
    let base = common("rk4", 0.01);
    says(
        &message(&Choices { method: Some("magic".into()), ..base.clone() }),
        &["\"magic\"", "common, cs-predict"],
    );
    says(&message(&Choices { integrator: Some("rk5".into()), ..base.clone() }), &["rk5", "heun, rk4"]);
    says(&message(&Choices { step: Some(0.0), ..base.clone() }), &["step", "0", "greater than 0"]);
    says(&message(&Choices { rtol: Some(f64::NAN), ..base.clone() }), &["rtol", "NaN"]);
    says(&message(&Choices { stop: Some(-1.0), ..base.clone() }), &["stop must come after start"]);
    says(&message(&Choices { order: Some(3), ..base }), &["order", "0, 1 or 2"]);
    says(&message(&Choices { step: None, ..method("jacobi", 1, 0.1) }), &["--H"]);
}

#[test]
fn a_closing_joint_needs_a_host_that_closes() {
    let result = run(&scene("four_bar"), &method("jacobi", 1, 0.01), &[]);
    assert!(
        matches!(result.err(), Some(Error::Scene(error)) if matches!(*error, SceneError::Setting { .. }))
    );
}
