//! The program: commands, output as text or JSON, exit codes.
//!
//! | code | meaning |
//! | --- | --- |
//! | 0 | done |
//! | 1 | a result cannot be written |
//! | 2 | the command line or the input is wrong |
//! | 3 | a run failed |

mod arguments;
mod check;
mod info;
mod pack;
mod progress;
mod simulate;
mod study;
mod sweep;
mod validate;

use std::io::{self, Write};
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use serde_json::{Value, json};

use crate::error::Error;
use crate::scene::SceneError;
use crate::study::StudyError;
use arguments::{Arguments, Command};

/// Why a command ended early.
#[derive(Debug, thiserror::Error)]
enum CommandError {
    #[error(transparent)]
    Run(Box<Error>),
    #[error(transparent)]
    Study(#[from] StudyError),
    #[error("{path}: {source}")]
    Read { path: PathBuf, source: io::Error },
    #[error("{path}: {source}")]
    Plan { path: PathBuf, source: sweep::PlanError },
    #[error("{path}: {source}")]
    Write { path: PathBuf, source: io::Error },
    #[error("{failed} of {runs} runs failed; {path} says why")]
    Sweep { failed: usize, runs: usize, path: PathBuf },
    #[error(transparent)]
    Assembly(Box<crate::assembly::AssemblyError>),
    #[error(transparent)]
    Check(#[from] crate::check::CheckError),
    #[error("no check.toml in the folders below fmus and scenes; name folders that have one")]
    NoPlan,
    #[error("{wrong} of {runs} runs are wrong:\n{}", shown.join("\n"))]
    Wrong { wrong: usize, runs: usize, shown: Vec<String> },
    #[error("the table cannot be made: {0}")]
    Table(csv::Error),
    #[error("--set {0:?}: component.variable=value is needed")]
    Assignment(String),
}

impl From<Error> for CommandError {
    fn from(error: Error) -> Self {
        Self::Run(Box::new(error))
    }
}

impl From<SceneError> for CommandError {
    fn from(error: SceneError) -> Self {
        Error::from(error).into()
    }
}

impl CommandError {
    fn code(&self) -> u8 {
        match self {
            Self::Run(error) => match **error {
                Error::Output { .. } => 1,
                Error::Scene(_) => 2,
                Error::Run(_) => 3,
            },
            Self::Write { .. } | Self::Table(_) => 1,
            Self::Check(_)
            | Self::NoPlan
            | Self::Assembly(_)
            | Self::Read { .. }
            | Self::Plan { .. }
            | Self::Assignment(_) => 2,
            Self::Sweep { .. } | Self::Wrong { .. } | Self::Study(_) => 3,
        }
    }
}

/// What a command has to say: lines for people, an object for programs.
struct Answer {
    text: String,
    json: Value,
}

/// Runs the program with the arguments of the process.
#[must_use]
pub fn main() -> ExitCode {
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => {
            let code = if error.use_stderr() { 2 } else { 0 };
            let _ = error.print(); // nowhere to say that the terminal is gone
            return ExitCode::from(code);
        }
    };
    let json = arguments.json;
    let (code, shown) = match answer(&arguments) {
        Ok(answer) if json => (0, format!("{}\n", answer.json)),
        Ok(answer) => (0, answer.text),
        Err(error) => {
            let _ = writeln!(io::stderr(), "error: {error}"); // nowhere else to say it
            let code = error.code();
            (
                code,
                if json {
                    format!("{}\n", json!({"error": error.to_string(), "code": code}))
                } else {
                    String::new()
                },
            )
        }
    };
    match io::stdout().write_all(shown.as_bytes()) {
        Ok(()) => ExitCode::from(code),
        Err(_) => ExitCode::from(1), // a closed pipe
    }
}

fn answer(arguments: &Arguments) -> Result<Answer, CommandError> {
    match &arguments.command {
        Command::Simulate(options) => simulate::simulate(options),
        Command::Info(options) => info::info(options),
        Command::Validate(options) => validate::validate(options),
        Command::Study(options) => study::study(options),
        Command::Sweep(options) => sweep::sweep(options),
        Command::Check(options) => check::check(options),
        Command::Pack(options) => pack::pack(options),
    }
}
