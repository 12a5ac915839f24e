//! `koppel check`

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;
use serde_json::json;

use super::arguments::Check;
use super::progress::Progress;
use super::{Answer, CommandError};
use crate::check::{self, CheckError, Outcome, Plan, Row};

/// Folders whose subfolders may have plans.
const PLACES: [&str; 2] = ["fmus", "scenes"];

pub(super) fn check(options: &Check) -> Result<Answer, CommandError> {
    let folders = if options.folders.is_empty() { planned()? } else { options.folders.clone() };
    let mut cases = Vec::new();
    for folder in &folders {
        let plan = Plan::read(folder)?;
        cases.extend((0..plan.cases.len()).map(|case| (plan.clone(), case)));
    }
    let progress = Mutex::new((Progress::new(), 0.0));
    let rows: Vec<Result<Vec<Row>, CheckError>> = cases
        .par_iter()
        .map(|(plan, case)| {
            let rows = check::check(plan, &plan.scene(&options.fmus)?, &plan.cases[*case])?;
            let mut progress = progress.lock().unwrap_or_else(PoisonError::into_inner);
            progress.1 += 1.0;
            #[allow(clippy::cast_precision_loss, reason = "a hundred cases")]
            let part = progress.1 / cases.len() as f64;
            progress.0.show(part);
            Ok(rows)
        })
        .collect();
    drop(progress);
    let rows: Vec<Row> = rows.into_iter().collect::<Result<Vec<_>, _>>()?.into_iter().flatten().collect();
    if let Some(path) = &options.output {
        fs::write(path, table(&rows, path.extension().is_some_and(|e| e == "csv"))?)
            .map_err(|source| CommandError::Write { path: path.clone(), source })?;
    }
    let wrong = rows.iter().filter(|row| row.outcome == Outcome::Wrong).count();
    if wrong > 0 {
        let shown = rows.iter().filter(|row| row.outcome == Outcome::Wrong).map(line).collect();
        return Err(CommandError::Wrong { wrong, runs: rows.len(), shown });
    }
    Ok(Answer { text: text(&rows), json: json!({"runs": rows.len(), "wrong": wrong, "rows": rows}) })
}

/// All folders with a plan, in the order of their names.
fn planned() -> Result<Vec<PathBuf>, CommandError> {
    let mut folders = Vec::new();
    for place in PLACES.map(Path::new).into_iter().filter(|place| place.is_dir()) {
        let failed = |source| CommandError::Read { path: place.into(), source };
        for entry in fs::read_dir(place).map_err(failed)? {
            let folder = entry.map_err(failed)?.path();
            if folder.join(check::FILE).is_file() {
                folders.push(folder);
            }
        }
    }
    folders.sort();
    if folders.is_empty() {
        return Err(CommandError::NoPlan);
    }
    Ok(folders)
}

fn outcome(row: &Row) -> &'static str {
    match row.outcome {
        Outcome::Right => "right",
        Outcome::Refused => "refused",
        Outcome::Wrong => "wrong",
    }
}

fn line(row: &Row) -> String {
    let mut line =
        format!("{:20} {:36} {:18} H = {:<8} {:8}", row.target, row.case, row.method, row.step, outcome(row));
    if let Some(error) = row.error {
        let _ = write!(line, " error {error:.0e} of {:.0e}", row.bound);
    }
    if let Some(energy) = row.energy {
        let _ = write!(line, ", energy {energy:.0e}");
    }
    if !row.note.is_empty() {
        let _ = write!(line, " {}", row.note);
    }
    line
}

fn text(rows: &[Row]) -> String {
    let mut text: String = rows.iter().map(|row| line(row) + "\n").collect();
    let count = |wanted| rows.iter().filter(|row| row.outcome == wanted).count();
    let drift = rows.iter().filter_map(|row| row.energy).fold(0.0, f64::max);
    let _ = writeln!(
        text,
        "{} runs: {} right, {} refused, {} wrong; worst energy balance {drift:.0e}",
        rows.len(),
        count(Outcome::Right),
        count(Outcome::Refused),
        count(Outcome::Wrong),
    );
    text
}

/// The table as CSV, or as Markdown with one line per case and outcome.
fn table(rows: &[Row], csv: bool) -> Result<Vec<u8>, CommandError> {
    if !csv {
        return Ok(markdown(rows).into_bytes());
    }
    let mut writer = csv::Writer::from_writer(Vec::new());
    for row in rows {
        writer.serialize(row).map_err(CommandError::Table)?;
    }
    writer.into_inner().map_err(|error| CommandError::Table(error.into_error().into()))
}

fn markdown(rows: &[Row]) -> String {
    let mut text = String::from(
        "# Stiff and extreme cases\n\nWritten by `koppel check`: what each FMU or scene does under each method and communication step. \
         Errors, bounds and energy balances are the largest of the line, relative to their scale. Energies are integrals beside the \
         states: a stiff method that steps over a fast decay is right in the states and misses the energy lost in it.\n\n\
         | of | case | right | error | bound | energy | refused |\n| --- | --- | --- | --- | --- | --- | --- |\n",
    );
    for case in rows.chunk_by(|a, b| (&a.target, &a.case) == (&b.target, &b.case)) {
        let methods = |wanted: Outcome| {
            let mut names: Vec<&str> = Vec::new();
            for row in case.iter().filter(|row| row.outcome == wanted) {
                if !names.contains(&row.method.as_str()) {
                    names.push(&row.method);
                }
            }
            names.join(", ")
        };
        let largest = |value: fn(&Row) -> Option<f64>| {
            let values = case.iter().filter(|row| row.outcome == Outcome::Right).filter_map(value);
            values.reduce(f64::max).map_or(String::new(), |value| format!("{value:.0e}"))
        };
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {} | {} | {} |",
            case[0].target,
            case[0].case,
            methods(Outcome::Right),
            largest(|row| row.error),
            largest(|row| row.error.map(|_| row.bound)),
            largest(|row| row.energy),
            methods(Outcome::Refused),
        );
    }
    text
}
