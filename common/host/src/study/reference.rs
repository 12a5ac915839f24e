//! What the runs of a study are compared with.
//!
//! A reference file is a CSV table in SI units with the first column `t`. Lines that start with `#` say where it comes from;
//! `# variable: theta1 = lower.angle.theta` names the variable of a column, other columns have the variable's name.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use crate::record::Recorder;
use crate::ssp::{Package, outside_reference};

/// Times that differ by less are one [s].
const SAME_TIME: f64 = 1e-9;

/// Why a reference file is of no use.
#[derive(Debug, thiserror::Error)]
pub enum ReferenceError {
    /// In neither place
    #[error("reference {file} is neither in the scene nor, as {outside}, among the references")]
    Missing {
        /// As the scene names it
        file: String,
        /// Where else it was looked for
        outside: PathBuf,
    },
    /// Not a table of numbers
    #[error("reference {file}, line {line}: {what}")]
    Table {
        /// File
        file: String,
        /// Line
        line: usize,
        /// What is wrong
        what: String,
    },
    /// Nothing to compare
    #[error("reference {file} has none of the recorded variables; it has {known}")]
    Nothing {
        /// File
        file: String,
        /// Its variables
        known: String,
    },
    /// The samples do not meet
    #[error(
        "reference {file}: only {shared} of {needed} samples are times of the run; choose --interval so that they are"
    )]
    Samples {
        /// File
        file: String,
        /// Samples that are
        shared: usize,
        /// Samples up to the end of the shorter of both
        needed: usize,
    },
}

/// Samples of a solution by variable.
pub struct Reference {
    /// Where it comes from
    pub source: String,
    /// Errors below are its own
    pub accuracy: f64,
    times: Vec<f64>,
    columns: HashMap<String, Vec<f64>>,
}

/// Errors of one variable over the samples, relative to max(max |reference|, nominal).
#[derive(Clone, Debug)]
pub struct SignalError {
    /// Variable
    pub name: String,
    /// Largest
    pub largest: f64,
    /// Root of the mean square
    pub rms: f64,
}

impl Reference {
    /// A recorded run.
    pub(crate) fn recorded(recorder: &Recorder, source: String, accuracy: f64) -> Self {
        let column = |i: usize| recorder.rows.iter().map(|row| row[i]).collect();
        let columns = recorder.names.iter().enumerate().map(|(i, name)| (name.clone(), column(i)));
        Self { source, accuracy, times: recorder.times.clone(), columns: columns.collect() }
    }

    /// The file that a scene names: from the scene, otherwise from `fallback` without the first folder of its path.
    ///
    /// # Errors
    /// A file that is missing or is no reference.
    pub(super) fn file(
        package: &Package,
        file: &str,
        fallback: &Path,
        accuracy: f64,
    ) -> Result<Self, ReferenceError> {
        let content = package.read(file).or_else(|_| {
            let outside = outside_reference(fallback, file);
            std::fs::read(&outside).map_err(|_| ReferenceError::Missing { file: file.into(), outside })
        })?;
        Self::parse(&String::from_utf8_lossy(&content), file, accuracy)
    }

    fn parse(text: &str, file: &str, accuracy: f64) -> Result<Self, ReferenceError> {
        let wrong =
            |line: usize, what: String| ReferenceError::Table { file: file.into(), line: line + 1, what };
        let mut variables = HashMap::new();
        let mut names: Vec<String> = Vec::new();
        let mut values: Vec<Vec<f64>> = Vec::new();
        for (number, line) in text.lines().enumerate() {
            if let Some(comment) = line.strip_prefix('#') {
                let named = comment.trim().strip_prefix("variable:").and_then(|c| c.split_once('='));
                variables
                    .extend(named.map(|(column, name)| (column.trim().to_owned(), name.trim().to_owned())));
            } else if names.is_empty() {
                names = line.split(',').map(|name| name.trim().to_owned()).collect();
                values = vec![Vec::new(); names.len()];
                if names[0] != "t" {
                    return Err(wrong(number, format!("the first column is {:?}, not t", names[0])));
                }
            } else if !line.is_empty() {
                let cells: Vec<&str> = line.split(',').collect();
                if cells.len() != names.len() {
                    return Err(wrong(number, format!("{} cells, not {}", cells.len(), names.len())));
                }
                for (column, cell) in values.iter_mut().zip(cells) {
                    let value = cell.trim().parse().ok().filter(|v: &f64| v.is_finite());
                    column.push(value.ok_or_else(|| wrong(number, format!("{cell:?} is no finite number")))?);
                }
            }
        }
        if values.first().is_none_or(Vec::is_empty) {
            return Err(wrong(0, "no samples".into()));
        }
        let times = values.remove(0);
        let names = names.drain(1..).map(|name| variables.remove(&name).unwrap_or(name));
        let columns = names.zip(values).collect();
        Ok(Self { source: file.into(), accuracy, times, columns })
    }

    /// Errors of all recorded variables that the reference has; `nominal` gives typical magnitudes.
    ///
    /// # Errors
    /// No variable or too few samples in common: samples are never interpolated.
    pub fn errors(
        &self,
        recorder: &Recorder,
        nominal: impl Fn(&str) -> f64,
    ) -> Result<Vec<SignalError>, ReferenceError> {
        let shared = self.shared(&recorder.times)?;
        let mut errors = Vec::new();
        for (i, name) in recorder.names.iter().enumerate() {
            let Some(exact) = self.columns.get(name) else { continue };
            let largest = shared.iter().map(|&(_, at)| exact[at].abs()).fold(0.0, f64::max);
            let scale = nominal(name).max(largest);
            let all = shared.iter().map(|&(row, at)| (recorder.rows[row][i] - exact[at]).abs() / scale);
            let (worst, squares) =
                all.fold((0.0_f64, 0.0), |(worst, squares), e| (worst.max(e), squares + e * e));
            #[allow(clippy::cast_precision_loss, reason = "hundreds of samples")]
            let rms = (squares / shared.len() as f64).sqrt();
            errors.push(SignalError { name: name.clone(), largest: worst, rms });
        }
        if errors.is_empty() {
            let mut known: Vec<_> = self.columns.keys().map(String::as_str).collect();
            known.sort_unstable();
            return Err(ReferenceError::Nothing { file: self.source.clone(), known: known.join(", ") });
        }
        Ok(errors)
    }

    /// Rows of a run and samples of the reference at the same times.
    fn shared(&self, times: &[f64]) -> Result<Vec<(usize, usize)>, ReferenceError> {
        let mut shared = Vec::new();
        for (row, &t) in times.iter().enumerate() {
            let at = self.times.partition_point(|&sample| sample < t - SAME_TIME);
            if self.times.get(at).is_some_and(|&sample| sample <= t + SAME_TIME) {
                shared.push((row, at));
            }
        }
        let last = |times: &[f64]| times.last().copied().unwrap_or(0.0);
        let end = last(times).min(last(&self.times)) + SAME_TIME;
        let until = |times: &[f64]| times.iter().filter(|&&t| t <= end).count();
        let needed = until(times).min(until(&self.times));
        if shared.len() < needed || shared.is_empty() {
            return Err(ReferenceError::Samples { file: self.source.clone(), shared: shared.len(), needed });
        }
        Ok(shared)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;

    #[test]
    fn columns_get_the_names_of_their_variables() {
        let text = "# source: by hand\n# variable: x = a.s[1]\nt,x,b.v\n0,1,2\n0.5,3,4\n";
        let reference = Reference::parse(text, "r.csv", 0.0).unwrap();
        assert_eq!(reference.columns["a.s[1]"], [1.0, 3.0]);
        assert_eq!(reference.columns["b.v"], [2.0, 4.0]);
        assert_eq!(reference.shared(&[0.0, 0.25, 0.5, 0.75]).unwrap(), [(0, 0), (2, 1)]);
        assert!(matches!(reference.shared(&[0.0, 0.3]), Ok(shared) if shared == [(0, 0)]));
        assert!(matches!(reference.shared(&[0.1, 0.6]), Err(ReferenceError::Samples { needed: 1, .. })));
    }

    #[test]
    fn what_is_no_table_is_refused_with_its_line() {
        for (text, line, what) in [
            ("t,x\n0,nan\n", 2, "no finite number"),
            ("time,x\n0,1\n", 1, "not t"),
            ("t,x\n0,1\n1\n", 3, "1 cells, not 2"),
            ("t,x\n", 1, "no samples"),
        ] {
            let refused = Reference::parse(text, "r.csv", 0.0).err().unwrap().to_string();
            assert!(refused.starts_with(&format!("reference r.csv, line {line}: ")), "{refused}");
            assert!(refused.contains(what), "{refused}");
        }
    }
}
