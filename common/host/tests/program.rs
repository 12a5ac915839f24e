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

/// alpha = 2 1/s: steps above half a second are too long, the tests' steps are not.
#[test]
fn a_step_too_long_for_the_stabilisation_is_warned_of() {
    fmus();
    let warned = |options: &[&str]| {
        let output = koppel(&[&["validate", "scenes/four_bar"], options].concat());
        assert!(output.status.success(), "{output:?}");
        String::from_utf8(output.stderr).unwrap().contains("alpha H = ")
    };
    let fixed = ["--integrator", "rk4", "--H"];
    assert!(warned(&[&fixed[..], &["0.75"]].concat()));
    assert!(!warned(&[&fixed[..], &["0.5"]].concat()));
    assert!(!warned(&["--H", "0.75"]), "dopri5 chooses its steps");
    assert!(!warned(&[&fixed[..], &["0.75", "--alpha", "1"]].concat()));
}

#[test]
fn a_study_of_true_forces_diverges_and_closing_joints_refuse_plain_exchange() {
    fmus();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("study.csv");
    let study = |scene: &str, options: &[&str]| {
        let arguments = [&["study", scene, "--runs", "0", "-o", file.to_str().unwrap(), "--json"], options];
        json(&koppel(&arguments.concat()))["points"].as_array().unwrap().clone()
    };
    let of = |points: &[Value], method: &str| -> Vec<Value> {
        points.iter().filter(|p| p["method"] == method).cloned().collect()
    };
    let points = study("scenes/two_mass", &["--stop", "0.5"]);
    assert!(points.iter().all(|p| p["wall_min"].is_null()), "no times are asked for");
    for point in of(&points, "raw jacobi") {
        assert!(point["status"].as_str().unwrap().starts_with("diverged at t = "), "{point}");
        assert!(point["e_max"].is_null());
    }
    // the audit sees the error of the integrator: the energies balance at its order
    let energies: Vec<f64> =
        of(&points, "common rk4").iter().map(|p| p["energy"].as_f64().unwrap()).collect();
    assert!(energies[2] > 0.0 && energies[2] < energies[0] / 30.0, "{energies:?}");
    let text = fs::read_to_string(&file).unwrap();
    let columns = "scene,method,H,rtol,e_max,e_rms,energy,gap,wall_min,wall_median,cpu,real_time_factor,steps,rejected,evaluations,sweeps,calls,Get,Set,doStep,save,restore,order,status";
    assert_eq!(text.lines().next(), Some(columns));
    assert_eq!(text.lines().count(), 1 + points.len());

    let points = study("scenes/four_bar", &["--stop", "0.15"]);
    for method in ["jacobi order 0", "seidel order 1", "raw jacobi"] {
        let refused = of(&points, method);
        assert_eq!(refused.len(), 1);
        assert!(refused[0]["status"].as_str().unwrap().starts_with("not applicable: "));
    }
    assert!(of(&points, "cs-pece order 2").iter().all(|p| p["gap"].as_f64().unwrap() > 0.0));
}

#[test]
fn an_archive_holds_its_reference() {
    fmus();
    let folder = tempfile::tempdir().unwrap();
    let archive = folder.path().join("pendulum.ssp");
    let archive = archive.to_str().unwrap();
    assert_eq!(code(&["pack", PENDULUM, "--output", archive]), 0);
    let options = ["--references", "nowhere", "--runs", "0", "--stop", "0.02"];
    assert_eq!(code(&[&["study", archive], &options[..]].concat()), 0);
    let refused = koppel(&[&["study", PENDULUM], &options[..]].concat());
    assert_eq!(refused.status.code(), Some(3));
    let said = String::from_utf8(refused.stderr).unwrap();
    assert!(
        said.contains("reference extra/coupling/double_pendulum.csv is neither in the scene nor"),
        "{said}"
    );
}

#[test]
fn a_study_with_other_parameters_makes_its_reference() {
    fmus();
    let options = ["--runs", "0", "--stop", "0.02", "--set", "upper.mass=2", "--json"];
    let study = json(&koppel(&[&["study", PENDULUM], &options[..]].concat()));
    assert!(study["reference"].as_str().unwrap().starts_with("common dop853 and dopri5 at 1e-12, apart by "));
}

#[test]
fn a_study_finds_the_orders() {
    fmus();
    let study = json(&koppel(&["study", PENDULUM, "--runs", "0", "--stop", "0.5", "--json"]));
    let order = |name: &str| {
        let points = study["points"].as_array().unwrap();
        points.iter().find(|p| p["method"] == name).unwrap()["order"].as_f64().unwrap()
    };
    for (name, expected) in [("common heun", 2.0), ("cs-predict order 1", 2.0), ("jacobi order 0", 1.0)] {
        assert!((order(name) - expected).abs() < 0.3, "{name}: {}", order(name));
    }
    assert_eq!(study["reference"], "extra/coupling/double_pendulum.csv");
}
