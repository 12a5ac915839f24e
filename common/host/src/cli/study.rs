//! `koppel study`

use std::fmt::Write as _;
use std::path::Path;

use serde_json::json;

use super::arguments::Study as Arguments;
use super::progress::Progress;
use super::{Answer, CommandError};
use crate::study::{self, Options, Point, Study, StudyError};

/// Columns of the file, as the Python study writes them.
const COLUMNS: [&str; 23] = [
    "scene",
    "method",
    "H",
    "rtol",
    "e_max",
    "e_rms",
    "energy",
    "gap",
    "wall_min",
    "wall_median",
    "cpu",
    "real_time_factor",
    "steps",
    "rejected",
    "evaluations",
    "sweeps",
    "calls",
    "Get",
    "Set",
    "doStep",
    "save",
    "restore",
    "order",
];

pub(super) fn study(arguments: &Arguments) -> Result<Answer, CommandError> {
    let (scene, raw) = (arguments.run.scene()?, arguments.run.raw_scene()?);
    let mut progress = Progress::new();
    let (choices, overrides) = (arguments.run.choices(), arguments.run.overrides()?);
    let options = Options {
        choices: &choices,
        overrides: &overrides,
        references: &arguments.references,
        runs: arguments.runs,
    };
    let result = study::study(&scene, &raw, &options, &mut |part| progress.show(part));
    drop(progress);
    let study = result.map_err(|failure| match failure {
        StudyError::Scene(error) => (*error).into(),
        other => CommandError::Study(other),
    })?;
    if let Some(path) = &arguments.output {
        write(&study, path)?;
    }
    Ok(Answer { text: table(&study), json: json!(study) })
}

fn write(study: &Study, path: &Path) -> Result<(), CommandError> {
    let error = |source| CommandError::Write { path: path.into(), source };
    let mut csv = csv::Writer::from_path(path).map_err(|e| error(e.into()))?;
    let header = COLUMNS.iter().copied().chain(["status"]);
    csv.write_record(header).map_err(|e| error(e.into()))?;
    for point in &study.points {
        csv.write_record(row(&study.scene, point)).map_err(|e| error(e.into()))?;
    }
    csv.flush().map_err(error)
}

/// A row of the file; empty where a column does not apply.
fn row(scene: &str, p: &Point) -> Vec<String> {
    let number = |value: Option<f64>| value.map_or(String::new(), |v| v.to_string());
    let count = |value: Option<u64>| value.map_or(String::new(), |v| v.to_string());
    let cost = p.cost.as_ref();
    let mut row = vec![scene.to_owned(), p.method.clone()];
    row.extend([p.step, p.rtol, p.e_max, p.e_rms, p.energy, p.gap].map(number));
    row.extend([p.wall_min, p.wall_median, p.cpu, p.real_time_factor].map(number));
    let (steps, calls) = (cost.map(|c| c.steps), cost.map(|c| c.calls));
    row.extend(
        [
            steps.map(|s| s.accepted),
            steps.map(|s| s.rejected),
            p.evaluations,
            cost.map(|c| c.sweeps),
            calls.map(|c| c.total()),
            calls.map(|c| c.get),
            calls.map(|c| c.set),
            calls.map(|c| c.do_step),
            calls.map(|c| c.save),
            calls.map(|c| c.restore),
        ]
        .map(count),
    );
    row.extend([number(p.order), p.status.clone()]);
    row
}

fn table(study: &Study) -> String {
    let number = |value: Option<f64>| value.map_or("-".into(), |v| format!("{v:.2e}"));
    let milliseconds = |value: Option<f64>| value.map_or("-".into(), |v| format!("{:.3}", 1e3 * v));
    let mut text = format!("{}; reference: {}\n", study.scene, study.reference);
    let _ = writeln!(
        text,
        "{:20}{:>10}{:>10}{:>10}{:>10}{:>10}{:>10}{:>10}{:>9}{:>9}  status",
        "method", "H or rtol", "e_max", "e_rms", "energy", "gap/m", "wall/ms", "cpu/ms", "calls", "evals"
    );
    for p in &study.points {
        let _ = writeln!(
            text,
            "{:20}{:>10}{:>10}{:>10}{:>10}{:>10}{:>10}{:>10}{:>9}{:>9}  {}",
            p.method,
            number(p.step.or(p.rtol)),
            number(p.e_max),
            number(p.e_rms),
            number(p.energy),
            number(p.gap),
            milliseconds(p.wall_min),
            milliseconds(p.cpu),
            p.cost.as_ref().map_or(0, |cost| cost.calls.total()),
            p.evaluations.unwrap_or(0),
            p.status,
        );
    }
    let mut methods: Vec<&Point> = study.points.iter().collect();
    methods.dedup_by(|a, b| a.method == b.method);
    for p in methods {
        if let Some(order) = p.order {
            let _ = writeln!(text, "order of {}: {order:.2}", p.method);
        }
    }
    text
}
