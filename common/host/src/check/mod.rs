//! Stiff and extreme cases: each run of an FMU or a scene is right, refused with a message, or wrong.
//!
//! ```text
//! reference  two tight runs by different methods (1e-11) that agree to a tenth of the bound; one that is refused leaves the other
//! error      max_k |y(t_k) - ref(t_k)| / max(max_k |ref|, nominal), and of known values at the end
//! energy     as in studies; shown, not judged: energies are integrals beside the states and follow the steps made for these
//! wrong      an error above its bound, a value that is no number, a refusal without a word, an expectation that is missed
//! ```

mod plan;

use std::path::PathBuf;

use serde::Serialize;

pub use plan::{Case, Expected, Plan, Trial};

use crate::audit::Audit;
use crate::error::{Error, RunError};
use crate::methods::{Choices, Config};
use crate::record::Recorder;
use crate::run::Scene;
use crate::scene::{Override, SceneError};
use crate::ssp::{ParameterValue, SspError};
use crate::study::{Reference, nominal};

/// Name of a plan.
pub const FILE: &str = "check.toml";
/// Samples of a run.
const SAMPLES: f64 = 20.0;
/// Relative and absolute tolerance of the reference.
const TIGHT: (f64, f64) = (1e-11, 1e-14);
/// Agreement of the references as a part of the smallest bound.
const AGREEMENT: f64 = 0.1;

/// Why there is no table.
#[derive(Debug, thiserror::Error)]
pub enum CheckError {
    /// A plan cannot be read
    #[error("{path}: {source}")]
    Read {
        /// File
        path: PathBuf,
        /// Cause
        source: std::io::Error,
    },
    /// A plan is wrong
    #[error("{path}: {problem}")]
    Plan {
        /// File
        path: PathBuf,
        /// What is wrong
        problem: String,
    },
    /// A scene or an FMU
    #[error(transparent)]
    Scene(Box<SceneError>),
}

impl From<SceneError> for CheckError {
    fn from(error: SceneError) -> Self {
        Self::Scene(Box::new(error))
    }
}

impl From<SspError> for CheckError {
    fn from(error: SspError) -> Self {
        SceneError::from(error).into()
    }
}

/// What a run came to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Outcome {
    /// Within the bound
    Right,
    /// Refused with a message
    Refused,
    /// Anything else
    Wrong,
}

/// One line of the table.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// FMU or scene
    pub target: String,
    /// Case in words
    pub case: String,
    /// Method
    pub method: String,
    /// Communication step [s]
    #[serde(rename = "H")]
    pub step: f64,
    /// What it came to
    pub outcome: Outcome,
    /// Largest error, relative to the scale
    pub error: Option<f64>,
    /// Bound of the error
    pub bound: f64,
    /// Energy balance over the largest energy
    pub energy: Option<f64>,
    /// What was said, or what is wrong
    pub note: String,
}

/// A finished run.
struct Finished {
    recorder: Recorder,
    energy: Option<f64>,
}

/// All runs of one case.
///
/// # Errors
/// A plan that does not fit its FMU or scene; what a run ends in is a row.
pub fn check(plan: &Plan, scene: &Scene, case: &Case) -> Result<Vec<Row>, CheckError> {
    let overrides = plan.overrides(case)?;
    for (name, _) in &overrides {
        scene.network.find(name, "set")?;
    }
    let run = |method: &str, step: f64, tight: bool| run(plan, scene, case, &overrides, method, step, tight);
    let trials = plan.trials(case);
    let agreement = AGREEMENT * trials.iter().map(|trial| trial.bound).fold(f64::INFINITY, f64::min);
    let reference = reference(plan, scene, case, agreement, &run)?;
    let mut rows = Vec::new();
    for Trial { method, step, bound } in trials {
        let mut row = Row {
            target: plan.name.clone(),
            case: case.name.clone(),
            method: method.clone(),
            step,
            outcome: Outcome::Right,
            error: None,
            bound,
            energy: None,
            note: String::new(),
        };
        match run(&method, step, false)? {
            Err(error) => refused(&error, &mut row),
            Ok(finished) => judge(plan, scene, case, reference.as_ref(), &finished, &mut row),
        }
        let missed = case.expect.is_some_and(|expected| match expected {
            Expected::Right => row.outcome == Outcome::Refused,
            Expected::Refused => row.outcome == Outcome::Right,
        });
        if missed {
            row.outcome = Outcome::Wrong;
            row.note = format!("expected otherwise; {}", row.note);
        }
        rows.push(row);
    }
    Ok(rows)
}

/// The row of a run that did not reach its end.
fn refused(error: &Error, row: &mut Row) {
    row.note = error.to_string().split_whitespace().collect::<Vec<_>>().join(" ");
    row.outcome = match error {
        Error::Run(RunError::NotFinite { .. }) => Outcome::Wrong,
        Error::Run(RunError::Call { messages, .. }) if messages.is_empty() => Outcome::Wrong,
        Error::Scene(scene) => match &**scene {
            SceneError::Refused { messages, .. } if messages.is_empty() => Outcome::Wrong,
            _ => Outcome::Refused,
        },
        _ => Outcome::Refused,
    };
}

/// The row of a run that reached its end.
fn judge(
    plan: &Plan,
    scene: &Scene,
    case: &Case,
    reference: Option<&Reference>,
    run: &Finished,
    row: &mut Row,
) {
    row.energy = run.energy;
    let mut error = 0.0_f64;
    match reference.map(|reference| reference.errors(&run.recorder, |name| nominal(scene, name))) {
        Some(Ok(errors)) => error = errors.iter().map(|e| e.largest).fold(error, f64::max),
        Some(Err(problem)) => row.note = problem.to_string(),
        None if case.values.is_empty() => {
            row.note = "no reference: the tight runs are refused or differ".into();
        }
        None => {}
    }
    for (name, value) in &case.values {
        let name = plan.qualified(name);
        match run.recorder.column(&name).as_deref() {
            Some([.., last]) => {
                error = error.max((last - value).abs() / value.abs().max(nominal(scene, &name)));
            }
            _ => row.note = format!("{name} is not recorded"),
        }
    }
    row.error = Some(error);
    if row.note.is_empty() && error > row.bound {
        row.note = "error above its bound".into();
    }
    if !row.note.is_empty() {
        row.outcome = Outcome::Wrong;
    }
}

type Outcomes<'a> = &'a dyn Fn(&str, f64, bool) -> Result<Result<Finished, Error>, CheckError>;

/// Tight runs that agree; none if they are all refused or do not.
fn reference(
    plan: &Plan,
    scene: &Scene,
    case: &Case,
    agreement: f64,
    run: Outcomes<'_>,
) -> Result<Option<Reference>, CheckError> {
    let step = plan.stop(case) / SAMPLES;
    let mut found: Option<Reference> = None;
    for method in plan.references(case) {
        let Ok(finished) = run(&method, step, true)? else { continue };
        match &found {
            None => found = Some(Reference::recorded(&finished.recorder, method, agreement)),
            Some(first) => {
                let errors = first.errors(&finished.recorder, |name| nominal(scene, name));
                let apart =
                    errors.map_or(f64::INFINITY, |all| all.iter().map(|e| e.largest).fold(0.0, f64::max));
                if apart > agreement {
                    return Ok(None);
                }
            }
        }
    }
    Ok(found)
}

/// One run; the inner result is what it ended in.
fn run(
    plan: &Plan,
    scene: &Scene,
    case: &Case,
    overrides: &[Override],
    method: &str,
    step: f64,
    tight: bool,
) -> Result<Result<Finished, Error>, CheckError> {
    let stop = plan.stop(case);
    let mut choices = Choices { stop: Some(stop), interval: Some(stop / SAMPLES), ..Choices::default() };
    choices.step = Some(step);
    let mut all = Vec::new();
    if plan.is_of_fmu() {
        choices.method = Some("jacobi".into());
        all.push((plan.qualified("solver.method"), ParameterValue::Item(method.into())));
        if tight {
            all.push((plan.qualified("solver.rtol"), ParameterValue::Real(TIGHT.0)));
            all.push((plan.qualified("solver.atol"), ParameterValue::Real(TIGHT.1)));
        }
    } else {
        let mut words = method.split_whitespace().map(String::from);
        (choices.method, choices.integrator) = (words.next(), words.next());
        if tight {
            (choices.rtol, choices.atol) = (Some(TIGHT.0), Some(TIGHT.1));
        }
    }
    all.extend_from_slice(overrides);
    let config = Config::new(&scene.system, &choices)?;
    let (audit, energies) = Audit::of(&scene.network);
    let mut recorder = Recorder::new(&scene.network, &energies, config.interval);
    let first = scene.network.recorded.len();
    Ok(scene.run(&config, &all, &mut recorder, &mut |_| ()).map(|_| {
        let energy = audit.balance(&recorder.rows, first);
        recorder.keep(first);
        Finished { recorder, energy }
    }))
}
