//! What is said back.

use serde::Serialize;

use crate::fmi3::{Fault, Fmi, LoadError};

/// Answer to a run.
#[derive(Debug, Serialize)]
pub(crate) struct RunAnswer {
    pub(crate) status: &'static str,
    /// CPU and wall time of one run of the step loop [s]
    pub(crate) cpu_min: f64,
    pub(crate) cpu_median: f64,
    pub(crate) wall_min: f64,
    pub(crate) wall_median: f64,
    /// Timed runs.
    pub(crate) runs: u64,
    /// Calls of `fmi3DoStep` per run.
    pub(crate) steps: usize,
    /// The Int64 variables asked for, at the end of a run.
    pub(crate) counts: Vec<i64>,
    /// Rows of time and the Float64 variables asked for; null stands for a value that is not finite.
    pub(crate) samples: Vec<Vec<f64>>,
    pub(crate) messages: Vec<String>,
}

/// Answer to a measurement of single calls [ns].
#[derive(Debug, Serialize)]
pub(crate) struct OverheadAnswer {
    pub(crate) status: &'static str,
    /// Calls of `fmi3DoStep` per run.
    pub(crate) steps: usize,
    /// Timed sections of all measurements.
    pub(crate) sections: u64,
    /// `fmi3DoStep` alone.
    pub(crate) step_ns: f64,
    /// `fmi3DoStep` and one `fmi3GetFloat64` of all variables asked for.
    pub(crate) step_get_ns: f64,
    /// `fmi3GetFloat64` of all variables, repeated without a change in between; null when none are asked for.
    pub(crate) get_ns: Option<PerCall>,
    /// `fmi3SetFloat64` of the inputs; null when none are asked for.
    pub(crate) set_ns: Option<PerCall>,
    pub(crate) messages: Vec<String>,
}

/// Duration of a call with several values [ns].
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct PerCall {
    pub(crate) per_call: f64,
    pub(crate) per_value: f64,
}

/// Why there is no answer.
#[derive(Debug, Serialize)]
pub(crate) struct Failure {
    status: &'static str,
    function: String,
    /// Communication point of the failing step [s]
    time: Option<f64>,
    messages: Vec<String>,
}

impl Failure {
    /// The job itself is at fault, or the answer cannot be given.
    pub(crate) fn job(error: &dyn std::error::Error) -> Self {
        Self { status: "Error", function: "job".into(), time: None, messages: vec![with_causes(error)] }
    }

    /// A call failed; what the FMU said about it comes along.
    pub(crate) fn call(fault: Fault, fmi: &Fmi) -> Self {
        Self {
            status: fault.status,
            function: fault.function.into(),
            time: fault.time,
            messages: fmi.messages(),
        }
    }

    /// The library cannot be used.
    pub(crate) fn load(error: &LoadError) -> Self {
        let messages = std::iter::once(with_causes(error)).chain(error.messages().iter().cloned()).collect();
        Self { status: "Error", function: error.function().into(), time: None, messages }
    }

    pub(crate) fn to_json(&self) -> String {
        serde_json::to_string(self)
            .unwrap_or_else(|e| format!(r#"{{"status": "Error", "function": "answer: {e}"}}"#))
    }
}

/// An error and what lies behind it.
fn with_causes(error: &dyn std::error::Error) -> String {
    std::iter::successors(error.source(), |cause| cause.source()).map(ToString::to_string).fold(
        error.to_string(),
        |text, cause| {
            if text.contains(&cause) { text } else { text + ": " + &cause }
        },
    )
}

/// An answer as text.
pub(crate) fn to_json(answer: &impl Serialize) -> Result<String, Failure> {
    serde_json::to_string(answer).map_err(|e| Failure::job(&e))
}
