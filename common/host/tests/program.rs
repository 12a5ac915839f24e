//! The program: exit codes, JSON, files.
#![allow(clippy::unwrap_used, reason = "tests")]

mod support;

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;
use support::{fmus, root};

fn koppel(arguments: &[&str]) -> Output {
    let scenes = root();
    Command::new(env!("CARGO_BIN_EXE_koppel")).args(arguments).current_dir(scenes).output().unwrap()
}

fn json(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).unwrap_or_else(|e| panic!("{e}: {output:?}"))
}

fn code(arguments: &[&str]) -> i32 {
    koppel(arguments).status.code().unwrap()
}

const PENDULUM: &str = "scenes/double_pendulum";

#[test]
fn simulate_writes_a_table_and_says_what_it_did() {
    fmus();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("result.csv");
    let file = file.to_str().unwrap();
    let output = koppel(&["simulate", PENDULUM, "--integrator", "rk4", "--H", "0.01", "-o", file, "--json"]);
    let said = json(&output);
    assert_eq!(output.status.code(), Some(0));
    assert_eq!(said["cost"]["steps"]["accepted"], 200);
    assert_eq!(said["cost"]["steps"]["rhs_evaluations"], 801);
    assert!(output.stderr.is_empty(), "nothing beside the answer on a pipe");
    let text = fs::read_to_string(file).unwrap();
    let rows: Vec<&str> = text.lines().collect();
    assert!(rows[0].starts_with("time,upper.angle.theta,"));
    assert_eq!(rows.len(), 202, "a header and 201 samples");
    let last: f64 = rows[201].split(',').nth(1).unwrap().parse().unwrap();
    assert_eq!(Some(last), said["values"]["upper.angle.theta"].as_f64());
}

#[test]
fn exit_codes_tell_input_from_failure() {
    fmus();
    assert_eq!(code(&["info", PENDULUM]), 0);
    assert_eq!(code(&["validate", "scenes/four_bar"]), 0);
    assert_eq!(code(&["--help"]), 0);
    assert_eq!(code(&["simulate"]), 2);
    assert_eq!(code(&["simulate", "scenes/absent"]), 2);
    assert_eq!(code(&["simulate", PENDULUM, "--set", "upper.absent=1"]), 2);
    assert_eq!(code(&["simulate", PENDULUM, "--set", "upper.mass"]), 2);
    assert_eq!(code(&["simulate", "scenes/four_bar", "--set", "link3.angle.theta=0"]), 3);
    assert_eq!(code(&["simulate", PENDULUM, "-o", "/absent/folder/x.csv"]), 1);
}

#[test]
fn errors_are_json_too() {
    fmus();
    let output = koppel(&["simulate", PENDULUM, "--method", "magic", "--json"]);
    let said = json(&output);
    assert_eq!(said["code"], 2);
    assert!(said["error"].as_str().unwrap().contains("magic"));
}

#[test]
fn info_tells_ports_and_closures() {
    fmus();
    let link = json(&koppel(&["info", "dist/fmi3/link2.fmu", "--json"]));
    assert_eq!(link["leads"], serde_json::json!(["B"]));
    assert_eq!(link["follows"], serde_json::json!(["A"]));
    let scene = json(&koppel(&["info", "scenes/four_bar", "--json"]));
    assert_eq!(scene["closures"], serde_json::json!(["joint link2.B - link3.B"]));
}

fn plan(folder: &Path, masses: &str) -> String {
    let path = folder.join("plan.toml");
    let scene = root().canonicalize().unwrap().join(PENDULUM);
    let text = format!(
        "scene = \"{}\"\nintegrator = \"rk4\"\nH = 0.01\n[grid]\n\"upper.mass\" = {masses}\n\"lower.length\" = [0.5, 1]\n",
        scene.display()
    );
    fs::write(&path, text).unwrap();
    path.to_str().unwrap().into()
}

#[test]
fn a_sweep_goes_on_where_it_was_interrupted() {
    fmus();
    let folder = tempfile::tempdir().unwrap();
    let plan = plan(folder.path(), "[1, 2, 3]");
    let file = folder.path().join("out.csv");
    let name = file.to_str().unwrap();
    assert_eq!(code(&["sweep", &plan, "-o", name]), 0);
    let whole = fs::read_to_string(&file).unwrap();
    assert_eq!(whole.lines().count(), 7, "a header and six runs");
    // four rows, the last of them cut off
    let cut: Vec<&str> = whole.lines().take(4).collect();
    fs::write(&file, format!("{}\n3,ok,0.", cut.join("\n"))).unwrap();
    let again = json(&koppel(&["sweep", &plan, "-o", name, "--json"]));
    assert_eq!(again["now"], 3);
    assert_eq!(fs::read_to_string(&file).unwrap(), whole);
}

#[test]
fn a_run_that_fails_is_a_row_of_the_sweep() {
    fmus();
    let folder = tempfile::tempdir().unwrap();
    let plan = plan(folder.path(), "[1, -1]");
    let file = folder.path().join("out.csv");
    assert_eq!(code(&["sweep", &plan, "-o", file.to_str().unwrap()]), 3);
    let text = fs::read_to_string(&file).unwrap();
    assert_eq!(text.lines().filter(|l| l.contains(",ok,")).count(), 2);
    assert_eq!(text.lines().filter(|l| l.contains("upper.mass = -1")).count(), 2);
}

#[test]
fn a_study_finds_the_orders() {
    fmus();
    let study = json(&koppel(&["study", PENDULUM, "--runs", "1", "--stop", "0.5", "--json"]));
    let order = |name: &str| {
        let orders = study["orders"].as_array().unwrap();
        orders.iter().find(|o| o["method"] == name).unwrap()["order"].as_f64().unwrap()
    };
    for (name, expected) in [("common heun", 2.0), ("cs-predict order 1", 2.0), ("jacobi order 0", 1.0)] {
        assert!((order(name) - expected).abs() < 0.3, "{name}: {}", order(name));
    }
    assert!(study["reference_agreement"].as_f64().unwrap() <= 1e-9);
}
