//! What to do.

use std::ffi::{CString, NulError};
use std::path::PathBuf;

use serde::Deserialize;

/// One FMU, its start values, one step loop.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Job {
    /// The shared library.
    pub(crate) library: PathBuf,
    /// Instantiation token.
    pub(crate) token: String,
    /// Folder of the resources, as the FMU is told it.
    #[serde(default)]
    pub(crate) resources: Option<String>,
    /// Start values, set before initialisation in this order.
    #[serde(default, rename = "set")]
    start_values: Vec<StartValue>,
    /// First communication point [s]
    #[serde(default)]
    pub(crate) start: f64,
    /// Last communication point [s]
    pub(crate) stop: f64,
    /// Communication step size [s]
    #[serde(rename = "H")]
    pub(crate) step: f64,
    /// Float64 variables to record, or to read in the overhead measurement.
    #[serde(default)]
    pub(crate) get: Vec<u32>,
    /// Float64 variables to write in the overhead measurement.
    #[serde(default)]
    pub(crate) input_vrs: Vec<u32>,
    /// Measurements, after one that is dropped.
    #[serde(default = "seven")]
    pub(crate) repeat: usize,
    /// Least duration of a measurement [s]; shorter runs are repeated within it.
    #[serde(default = "fifty_milliseconds")]
    pub(crate) min_time: f64,
    /// Communication points per stored sample; 0: none are stored.
    #[serde(default)]
    pub(crate) sample_every: usize,
    /// Int64 variables read at the end of a run.
    #[serde(default)]
    pub(crate) count: Vec<u32>,
    /// What is measured.
    #[serde(default)]
    pub(crate) mode: Mode,
    #[serde(skip)]
    pub(crate) set: Vec<(u32, Value)>,
}

fn seven() -> usize {
    7
}

fn fifty_milliseconds() -> f64 {
    0.05
}

/// What is measured.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Mode {
    /// The step loop.
    #[default]
    Run,
    /// The single calls.
    Overhead,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct StartValue {
    vr: u32,
    #[serde(rename = "type")]
    kind: Kind,
    value: serde_json::Value,
}

/// Which Set function takes the value.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
pub(crate) enum Kind {
    Float64,
    Int32,
    Int64,
    Boolean,
    String,
}

/// A start value, ready to be passed on.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Value {
    Float64(f64),
    Int32(i32),
    Int64(i64),
    Boolean(bool),
    String(CString),
}

/// Why a job cannot be done.
#[derive(Debug, thiserror::Error)]
pub(crate) enum JobError {
    #[error("the job is not valid JSON for this program: {0}")]
    Json(#[from] serde_json::Error),
    #[error("value {value} of variable {vr} is no {kind:?}")]
    Value { vr: u32, kind: Kind, value: serde_json::Value },
    #[error("text of variable {vr} contains a zero byte")]
    ZeroByte { vr: u32, source: NulError },
    #[error("{name} is {value}; {allowed}")]
    Range { name: &'static str, value: f64, allowed: &'static str },
}

impl Job {
    pub(crate) fn parse(text: &str) -> Result<Self, JobError> {
        let mut job: Self = serde_json::from_str(text)?;
        let range = |ok: bool, name, value, allowed| {
            if ok { Ok(()) } else { Err(JobError::Range { name, value, allowed }) }
        };
        range(job.step > 0.0, "H", job.step, "it must be greater than 0 s")?;
        range(job.stop > job.start, "stop", job.stop, "it must be greater than start")?;
        range(job.min_time >= 0.0, "min_time", job.min_time, "it must not be negative")?;
        range(job.repeat > 0, "repeat", 0.0, "it must be at least 1")?;
        let steps = (job.stop - job.start) / job.step;
        range(steps <= 1e8, "H", job.step, "it must not divide the run into more than 1e8 steps")?;
        job.set = job.start_values.iter().map(StartValue::coded).collect::<Result<_, _>>()?;
        Ok(job)
    }

    /// Communication points `start + i H`; the last is `stop` itself, after a shorter step where `H` does not divide.
    pub(crate) fn points(&self) -> Vec<f64> {
        let steps = ((self.stop - self.start) / self.step - 1e-9).ceil().max(1.0);
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked: at most 1e8")]
        let n = steps as u32;
        (0..n).map(|i| self.start + f64::from(i) * self.step).chain([self.stop]).collect()
    }
}

impl StartValue {
    fn coded(&self) -> Result<(u32, Value), JobError> {
        let Self { vr, kind, value } = self;
        let whole = || {
            // a host that knows only floats sends 3.0
            #[allow(clippy::cast_possible_truncation, reason = "whole and below 2^53")]
            let from_float =
                |f: f64| (f.fract().abs() <= 0.0 && f.abs() < 2.0_f64.powi(53)).then_some(f as i64);
            value.as_i64().or_else(|| value.as_f64().and_then(from_float))
        };
        let coded = match kind {
            Kind::Float64 => value.as_f64().map(Value::Float64),
            Kind::Int32 => whole().and_then(|i| i32::try_from(i).ok()).map(Value::Int32),
            Kind::Int64 => whole().map(Value::Int64),
            Kind::Boolean => value
                .as_bool()
                .or_else(|| match whole() {
                    Some(0) => Some(false),
                    Some(1) => Some(true),
                    _ => None,
                })
                .map(Value::Boolean),
            Kind::String => match value.as_str() {
                Some(text) => {
                    let text = CString::new(text).map_err(|source| JobError::ZeroByte { vr: *vr, source })?;
                    Some(Value::String(text))
                }
                None => None,
            },
        };
        let coded = coded.ok_or_else(|| JobError::Value { vr: *vr, kind: *kind, value: value.clone() })?;
        Ok((*vr, coded))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by it")]
mod tests {
    use super::*;

    const LEAST: &str = r#"{"library": "/a.so", "token": "{x}", "stop": 1.0, "H": 0.25}"#;

    #[test]
    fn defaults_are_those_of_the_measurement_rules() {
        let job = Job::parse(LEAST).unwrap();
        assert_eq!((job.repeat, job.sample_every, job.mode), (7, 0, Mode::Run));
        assert!((job.min_time - 0.05).abs() < 1e-15 && job.start.abs() < 1e-15);
        assert!(job.set.is_empty() && job.get.is_empty() && job.count.is_empty() && job.resources.is_none());
    }

    #[test]
    fn a_full_job_is_read() {
        let job = Job::parse(
            r#"{ "library": "/a.so", "token": "{x}", "resources": null, "start": 0.0, "stop": 10.0, "H": 0.05,
                 "set": [ {"vr": 1, "type": "Float64", "value": 3}, {"vr": 2, "type": "Int32", "value": -3},
                          {"vr": 3, "type": "Int64", "value": 2.0}, {"vr": 4, "type": "Boolean", "value": true},
                          {"vr": 5, "type": "Boolean", "value": 0}, {"vr": 6, "type": "String", "value": "a b"} ],
                 "get": [7, 8], "repeat": 3, "min_time": 0.1, "sample_every": 2, "count": [9], "mode": "overhead",
                 "input_vrs": [10] }"#,
        )
        .unwrap();
        let expected = [
            (1, Value::Float64(3.0)),
            (2, Value::Int32(-3)),
            (3, Value::Int64(2)),
            (4, Value::Boolean(true)),
            (5, Value::Boolean(false)),
            (6, Value::String(c"a b".into())),
        ];
        assert_eq!(job.set, expected);
        assert_eq!(
            (job.get, job.count, job.input_vrs, job.mode),
            (vec![7, 8], vec![9], vec![10], Mode::Overhead)
        );
    }

    #[test]
    fn a_value_of_the_wrong_type_is_named() {
        for (kind, value) in [
            ("Float64", "true"),
            ("Int32", "2147483648"),
            ("Int64", "0.5"),
            ("Boolean", "2"),
            ("String", "1"),
            ("String", r#""a\u0000b""#),
        ] {
            let set = format!(r#""set": [{{"vr": 77, "type": "{kind}", "value": {value}}}], "stop""#);
            let error = Job::parse(&LEAST.replace(r#""stop""#, &set)).unwrap_err().to_string();
            assert!(error.contains("77"), "{error}");
        }
    }

    #[test]
    fn bad_jobs_are_refused() {
        for (from, to, says) in [
            (r#""H": 0.25"#, r#""H": 0.0"#, "H is 0"),
            (r#""H": 0.25"#, r#""H": 1e-9"#, "1e8 steps"),
            (r#""stop": 1.0"#, r#""stop": 0.0"#, "stop is 0"),
            (r#""H""#, r#""h""#, "unknown field `h`"),
            ("{x}\"", "{x}\", \"repeat\": 0", "repeat is 0"),
        ] {
            let error = Job::parse(&LEAST.replace(from, to)).unwrap_err().to_string();
            assert!(error.contains(says), "{error}");
        }
        assert!(matches!(Job::parse("{"), Err(JobError::Json(_))));
    }

    /// `start + i H`, ending exactly at `stop`; a rest is a shorter last step, rounding is none.
    #[test]
    fn communication_points_end_at_stop() {
        for (start, stop, step, count) in
            [(0.0, 1.0, 0.25, 5), (0.0, 10.0, 0.05, 201), (1.0, 2.05, 0.1, 12), (0.0, 1.0, 3.0, 2)]
        {
            let mut job = Job::parse(LEAST).unwrap();
            (job.start, job.stop, job.step) = (start, stop, step);
            let points = job.points();
            assert_eq!(points.len(), count);
            assert_eq!((points[0].to_bits(), points[count - 1].to_bits()), (start.to_bits(), stop.to_bits()));
            assert!(points.windows(2).all(|p| p[1] > p[0] && p[1] - p[0] < step * (1.0 + 1e-9)));
        }
    }
}
