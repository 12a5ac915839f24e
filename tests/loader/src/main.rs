//! Runs an FMI 3.0 co-simulation FMU and times its step loop, without an interpreter in between.
//!
//! One job as JSON on standard input (or in the file given as argument), one answer as JSON on standard output;
//! exit code 1 and `{"status", "function", "time", "messages"}` when something failed. The fields are those of
//! [`job::Job`] and [`answer`]. Only the loop of `fmi3DoStep` is timed: loading, initialisation and recording are
//! outside.

#![allow(rustdoc::broken_intra_doc_links, reason = "units stand in brackets")]

mod answer;
mod clock;
mod fmi3;
mod job;
mod overhead;
mod run;

use std::io::{Read, Write};
use std::process::ExitCode;

use answer::Failure;
use job::{Job, Mode};

fn main() -> ExitCode {
    let (text, code) = match work() {
        Ok(text) => (text, ExitCode::SUCCESS),
        Err(failure) => (failure.to_json(), ExitCode::FAILURE),
    };
    let mut out = std::io::stdout().lock();
    match writeln!(out, "{text}").and_then(|()| out.flush()) {
        Ok(()) => code,
        Err(_) => ExitCode::FAILURE, // nobody reads
    }
}

fn work() -> Result<String, Failure> {
    let mut text = String::new();
    match std::env::args_os().nth(1) {
        Some(path) => text = std::fs::read_to_string(&path).map_err(|e| Failure::job(&e))?,
        None => std::io::stdin().read_to_string(&mut text).map(|_| ()).map_err(|e| Failure::job(&e))?,
    }
    let job = Job::parse(&text).map_err(|e| Failure::job(&e))?;
    match job.mode {
        Mode::Run => answer::to_json(&run::run(&job)?),
        Mode::Overhead => answer::to_json(&overhead::overhead(&job)?),
    }
}
