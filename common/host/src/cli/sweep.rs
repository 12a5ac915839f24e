//! `koppel sweep`: a scene over a grid of parameters, runs in parallel, resumable.
//!
//! ```toml
//! scene = "scenes/double_pendulum"     # relative to the plan
//! method = "common"                    # and further settings as the options of simulate
//! [grid]
//! "upper.mass" = [0.5, 1.0, 2.0]       # all combinations
//! "lower.joint.kind" = ["planar"]
//! ```

use std::collections::{BTreeMap, HashMap};
use std::fs::{self, File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;
use serde::Deserialize;
use serde_json::{Value, json};

use super::arguments::Sweep;
use super::progress::Progress;
use super::{Answer, CommandError};
use crate::methods::{Choices, Config};
use crate::run::Scene;
use crate::scene::{Override, SceneError};
use crate::ssp::ParameterValue;

/// Why a plan is not read.
#[derive(Debug, thiserror::Error)]
pub(super) enum PlanError {
    #[error(transparent)]
    Toml(#[from] toml::de::Error),
    #[error(transparent)]
    Json(#[from] serde_json::Error),
    #[error("grid entry {0:?} has no values, or values that are no numbers, texts or Booleans")]
    Values(String),
    #[error(
        "the results that are there belong to another plan: their columns are {found}, those of the plan {wanted}"
    )]
    Columns { found: String, wanted: String },
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Plan {
    scene: PathBuf,
    structure: Option<String>,
    method: Option<String>,
    integrator: Option<String>,
    #[serde(rename = "H")]
    step: Option<f64>,
    rtol: Option<f64>,
    atol: Option<f64>,
    order: Option<i64>,
    alpha: Option<f64>,
    stop: Option<f64>,
    interval: Option<f64>,
    grid: BTreeMap<String, Vec<Value>>,
}

impl Plan {
    fn read(path: &Path) -> Result<Self, CommandError> {
        let text =
            fs::read_to_string(path).map_err(|source| CommandError::Read { path: path.into(), source })?;
        let plan = if path.extension().is_some_and(|e| e == "json") {
            serde_json::from_str(&text).map_err(PlanError::Json)
        } else {
            toml::from_str(&text).map_err(PlanError::Toml)
        };
        plan.map_err(|source| CommandError::Plan { path: path.into(), source })
    }

    fn choices(&self) -> Choices {
        Choices {
            method: self.method.clone(),
            integrator: self.integrator.clone(),
            step: self.step,
            rtol: self.rtol,
            atol: self.atol,
            order: self.order,
            alpha: self.alpha,
            stop: self.stop,
            interval: self.interval,
        }
    }

    /// All combinations, the last name fastest.
    fn combinations(&self) -> Result<Vec<Vec<Override>>, PlanError> {
        let mut all: Vec<Vec<Override>> = vec![Vec::new()];
        for (name, values) in &self.grid {
            let texts: Option<Vec<String>> = values.iter().map(text).collect();
            let texts = texts.filter(|t| !t.is_empty()).ok_or_else(|| PlanError::Values(name.clone()))?;
            all = all
                .into_iter()
                .flat_map(|chosen| {
                    texts.iter().map(move |text| {
                        let mut chosen = chosen.clone();
                        chosen.push((name.clone(), ParameterValue::Text(text.clone())));
                        chosen
                    })
                })
                .collect();
        }
        Ok(all)
    }
}

fn text(value: &Value) -> Option<String> {
    match value {
        Value::Number(n) => Some(n.to_string()),
        Value::Bool(b) => Some(b.to_string()),
        Value::String(s) => Some(s.clone()),
        _ => None,
    }
}

/// The file of results.
struct Results {
    path: PathBuf,
    header: Vec<String>,
    writer: Mutex<csv::Writer<File>>,
}

pub(super) fn sweep(options: &Sweep) -> Result<Answer, CommandError> {
    let plan = Plan::read(&options.plan)?;
    let folder = options.plan.parent().unwrap_or(Path::new("."));
    let scene_path = folder.join(&plan.scene);
    let load = || Scene::load(&scene_path, &options.fmus, plan.structure.as_deref());
    let wrong = |source| CommandError::Plan { path: options.plan.clone(), source };
    let combinations = plan.combinations().map_err(wrong)?;
    let scene = load()?;
    let config = Config::new(&scene.system, &plan.choices())?;
    for name in plan.grid.keys() {
        scene.network.find(name, "grid")?;
    }
    let header = header(&plan, &scene);
    drop(scene);
    let (results, done) = Results::open(&options.output, header)?;
    let open: Vec<usize> = (0..combinations.len()).filter(|i| !done.contains_key(i)).collect();
    let progress = Mutex::new((Progress::new(), 0.0));
    let rows: Vec<Result<bool, CommandError>> = open
        .par_iter()
        .map_init(load, |scene, &index| {
            let row = row(scene.as_ref(), &config, index, &combinations[index])?;
            let failed = row.get(1).is_some_and(|status| status != "ok");
            results.append(&row)?;
            let mut progress = progress.lock().unwrap_or_else(PoisonError::into_inner);
            progress.1 += 1.0;
            #[allow(clippy::cast_precision_loss, reason = "fewer than 2^52 runs")]
            let part = progress.1 / open.len() as f64;
            progress.0.show(part);
            Ok(failed)
        })
        .collect();
    drop(progress);
    let mut failed = done.values().filter(|ok| !**ok).count();
    for row in rows {
        failed += usize::from(row?);
    }
    sort(&results.path, &results.header)?;
    if failed > 0 {
        return Err(CommandError::Sweep { failed, runs: combinations.len(), path: options.output.clone() });
    }
    let text =
        format!("{} runs, {} of them now: {}\n", combinations.len(), open.len(), options.output.display());
    let json = json!({"runs": combinations.len(), "now": open.len(), "output": options.output});
    Ok(Answer { text, json })
}

/// Columns: index, status, grid, then last, smallest and largest value of each recorded variable.
fn header(plan: &Plan, scene: &Scene) -> Vec<String> {
    let mut header = vec!["run".to_owned(), "status".to_owned()];
    header.extend(plan.grid.keys().cloned());
    for recorded in &scene.network.recorded {
        header.extend(["last", "min", "max"].map(|what| format!("{} {what}", recorded.name)));
    }
    header
}

/// One run as a row; a run that fails is a row, too.
fn row(
    scene: Result<&Scene, &SceneError>,
    config: &Config,
    index: usize,
    chosen: &[Override],
) -> Result<Vec<String>, CommandError> {
    let scene = match scene {
        Ok(scene) => scene,
        Err(error) => {
            // it could be loaded before: a file has gone
            let path = PathBuf::from(error.to_string());
            return Err(CommandError::Read { path, source: io::ErrorKind::NotFound.into() });
        }
    };
    let mut recorder = scene.recorder(config);
    let result = scene.run(config, chosen, &mut recorder, &mut |_| ());
    let status = result.as_ref().err().map_or("ok".into(), |e| e.to_string().replace('\n', " "));
    let mut row = vec![index.to_string(), status];
    row.extend(chosen.iter().map(|(_, value)| match value {
        ParameterValue::Text(text) => text.clone(),
        _ => String::new(),
    }));
    for column in 0..recorder.names.len() {
        let values = || recorder.rows.iter().map(|row| row[column]);
        let shown =
            |value: Option<f64>| value.filter(|_| result.is_ok()).map_or(String::new(), |v| v.to_string());
        row.push(shown(values().next_back()));
        row.push(shown(values().reduce(f64::min)));
        row.push(shown(values().reduce(f64::max)));
    }
    Ok(row)
}

impl Results {
    /// Opens the file and says which runs are done, and whether well.
    fn open(path: &Path, header: Vec<String>) -> Result<(Self, HashMap<usize, bool>), CommandError> {
        let error = |source| CommandError::Write { path: path.into(), source };
        let new = !path.exists();
        let done = if new { HashMap::new() } else { Self::done(path, &header)? };
        if !new {
            sort(path, &header)?; // drops a row that was cut off
        }
        let file = OpenOptions::new().create(true).append(true).open(path).map_err(error)?;
        let mut writer = csv::Writer::from_writer(file);
        if new {
            writer.write_record(&header).map_err(|e| error(e.into()))?;
            writer.flush().map_err(error)?;
        }
        Ok((Self { path: path.into(), header, writer: Mutex::new(writer) }, done))
    }

    fn done(path: &Path, header: &[String]) -> Result<HashMap<usize, bool>, CommandError> {
        let read = |e: csv::Error| CommandError::Read { path: path.into(), source: e.into() };
        let mut reader = csv::ReaderBuilder::new().flexible(true).from_path(path).map_err(read)?;
        let found: Vec<String> = reader.headers().map_err(read)?.iter().map(String::from).collect();
        if found != header {
            let source = PlanError::Columns { found: found.join(", "), wanted: header.join(", ") };
            return Err(CommandError::Plan { path: path.into(), source });
        }
        // a row cut off by an interruption is run again
        let whole = reader.records().filter_map(Result::ok).filter(|r| r.len() == header.len());
        Ok(whole.filter_map(|r| Some((r.get(0)?.parse().ok()?, r.get(1)? == "ok"))).collect())
    }

    fn append(&self, row: &[String]) -> Result<(), CommandError> {
        let error = |source| CommandError::Write { path: self.path.clone(), source };
        let mut writer = self.writer.lock().unwrap_or_else(PoisonError::into_inner);
        writer.write_record(row).map_err(|e| error(e.into()))?;
        writer.flush().map_err(error)
    }
}

/// Whole rows in the order of the grid.
fn sort(path: &Path, header: &[String]) -> Result<(), CommandError> {
    let error = |source| CommandError::Write { path: path.into(), source };
    let failed = |e: csv::Error| error(e.into());
    let mut reader = csv::ReaderBuilder::new().flexible(true).from_path(path).map_err(failed)?;
    let mut rows: BTreeMap<usize, csv::StringRecord> = BTreeMap::new();
    for record in reader.records().filter_map(Result::ok).filter(|r| r.len() == header.len()) {
        if let Some(index) = record.get(0).and_then(|i| i.parse().ok()) {
            rows.insert(index, record);
        }
    }
    let mut sorted = csv::Writer::from_path(path).map_err(failed)?;
    sorted.write_record(header).map_err(failed)?;
    for record in rows.values() {
        sorted.write_record(record).map_err(failed)?;
    }
    sorted.flush().map_err(error)
}
