//! `koppel study`

use std::fmt::Write as _;
use std::path::Path;

use serde_json::json;

use super::arguments::Study as Options;
use super::progress::Progress;
use super::{Answer, CommandError};
use crate::study::{self, Study, StudyError};

pub(super) fn study(options: &Options) -> Result<Answer, CommandError> {
    let scene = options.run.scene()?;
    let mut progress = Progress::new();
    let overrides = options.run.overrides()?;
    let result = study::study(&scene, &options.run.choices(), &overrides, options.runs, &mut |part| {
        progress.show(part);
    });
    drop(progress);
    let study = result.map_err(|failure| match failure {
        StudyError::Scene(error) => (*error).into(),
        other => CommandError::Study(other),
    })?;
    if let Some(path) = &options.output {
        write(&study, path)?;
    }
    Ok(Answer { text: table(&study), json: json!(study) })
}

fn write(study: &Study, path: &Path) -> Result<(), CommandError> {
    let error = |source| CommandError::Write { path: path.into(), source };
    let mut csv = csv::Writer::from_path(path).map_err(|e| error(e.into()))?;
    for point in &study.points {
        csv.serialize(point).map_err(|e| error(e.into()))?;
    }
    csv.flush().map_err(error)
}

fn table(study: &Study) -> String {
    let shown = |value: Option<f64>| value.map_or("-".into(), |v| format!("{v:.3e}"));
    let mut text = format!("{}: references agree to {:.1e}\n", study.scene, study.reference_agreement);
    let _ = writeln!(
        text,
        "{:22} {:>10} {:>10} {:>10} {:>10} {:>9} {:>9} {:>9}  status",
        "method", "H or tol", "e_max", "e_rms", "time [s]", "rhs", "doStep", "calls"
    );
    for p in &study.points {
        let _ = writeln!(
            text,
            "{:22} {:>10.3e} {:>10} {:>10} {:>10} {:>9} {:>9} {:>9}  {}",
            p.method,
            p.setting,
            shown(p.e_max),
            shown(p.e_rms),
            shown(p.seconds_min),
            p.rhs_evaluations,
            p.do_steps,
            p.calls,
            p.status,
        );
    }
    for order in &study.orders {
        let _ = writeln!(text, "order of {}: {:.2}", order.method, order.order);
    }
    text
}
