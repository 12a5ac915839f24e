//! The command line.

use std::path::{Path, PathBuf};
use std::process::Command;

/// What is wrong with the command line.
#[derive(Debug, thiserror::Error)]
pub(crate) enum OptionsError {
    #[error(
        "usage: fmu-fuzz FMU [--sequences N] [--seconds S] [--seed S] [--limit S] [--library FILE] [--other FMU] [--keep I,J,...]"
    )]
    Usage,
    #[error("{option}: {value} is no value for it")]
    Value { option: String, value: String },
}

/// What to do.
#[derive(Debug, Clone)]
pub(crate) struct Options {
    pub(crate) fmu: PathBuf,
    /// Another library than the one inside
    pub(crate) library: Option<PathBuf>,
    /// FMU of another model, whose states have to be refused
    pub(crate) other: Option<PathBuf>,
    /// First sequence
    pub(crate) seed: u64,
    /// Ends: after so many sequences, after so much time [s]
    pub(crate) sequences: Option<u64>,
    pub(crate) seconds: Option<f64>,
    /// A call that takes longer hangs [s]
    pub(crate) limit: u64,
    /// Only these calls of a sequence
    pub(crate) keep: Option<Vec<usize>>,
    /// File for the number of the present sequence; present in the process that runs them
    pub(crate) worker: Option<PathBuf>,
}

fn read<T: std::str::FromStr>(option: &str, value: &str) -> Result<T, OptionsError> {
    value.parse().map_err(|_| OptionsError::Value { option: option.into(), value: value.into() })
}

impl Options {
    pub(crate) fn parse(arguments: impl Iterator<Item = String>) -> Result<Self, OptionsError> {
        let mut options = Self {
            fmu: PathBuf::new(),
            library: None,
            other: None,
            seed: 0,
            sequences: None,
            seconds: None,
            limit: 120,
            keep: None,
            worker: None,
        };
        let mut arguments = arguments.peekable();
        while let Some(argument) = arguments.next() {
            if !argument.starts_with("--") {
                options.fmu = argument.into();
                continue;
            }
            let value = arguments.next().ok_or(OptionsError::Usage)?;
            match argument.as_str() {
                "--library" => options.library = Some(value.into()),
                "--other" => options.other = Some(value.into()),
                "--seed" => options.seed = read(&argument, &value)?,
                "--sequences" => options.sequences = Some(read(&argument, &value)?),
                "--seconds" => options.seconds = Some(read(&argument, &value)?),
                "--limit" => options.limit = read(&argument, &value)?,
                "--keep" => {
                    let kept = value.split(',').filter(|i| !i.is_empty());
                    options.keep = Some(kept.map(|i| read(&argument, i)).collect::<Result<_, _>>()?);
                }
                "--worker" => options.worker = Some(value.into()),
                _ => return Err(OptionsError::Usage),
            }
        }
        if options.fmu.as_os_str().is_empty() {
            return Err(OptionsError::Usage);
        }
        if options.sequences.is_none() && options.seconds.is_none() {
            options.sequences = Some(10_000);
        }
        Ok(options)
    }

    /// This program with the same options, to run the sequences.
    pub(crate) fn command(&self, progress: &Path) -> std::io::Result<Command> {
        let mut command = Command::new(std::env::current_exe()?);
        command.arg(&self.fmu).arg("--worker").arg(progress);
        command.args(["--seed", &self.seed.to_string(), "--limit", &self.limit.to_string()]);
        let mut option = |name: &str, value: Option<String>| {
            if let Some(value) = value {
                command.args([name, &value]);
            }
        };
        option("--sequences", self.sequences.map(|n| n.to_string()));
        option("--seconds", self.seconds.map(|s| s.to_string()));
        let list = |kept: &Vec<usize>| kept.iter().map(ToString::to_string).collect::<Vec<_>>().join(",");
        option("--keep", self.keep.as_ref().map(list));
        for (name, file) in [("--library", &self.library), ("--other", &self.other)] {
            if let Some(file) = file {
                command.arg(name).arg(file);
            }
        }
        Ok(command)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by it")]
mod tests {
    use super::*;

    fn parse(line: &str) -> Result<Options, OptionsError> {
        Options::parse(line.split_whitespace().map(String::from))
    }

    #[test]
    fn options_survive_the_way_to_the_other_process() {
        let options = parse("a.fmu --seed 7 --sequences 1 --keep 0,3 --limit 9").unwrap();
        let command = options.command(Path::new("p")).unwrap();
        let words: Vec<_> = command.get_args().map(|a| a.to_string_lossy().into_owned()).collect();
        let again = Options::parse(words.into_iter()).unwrap();
        assert_eq!((again.seed, again.sequences, again.limit), (7, Some(1), 9));
        assert_eq!((again.keep, again.worker), (Some(vec![0, 3]), Some("p".into())));
    }

    #[test]
    fn bad_lines_are_refused() {
        for line in ["", "--seed 1", "a.fmu --seed", "a.fmu --seed x", "a.fmu --what 1"] {
            assert!(parse(line).is_err(), "{line}");
        }
    }
}
