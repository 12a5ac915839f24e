//! Random sequences of FMI calls against an FMU of FMI 2.0 or 3.0.
//!
//! ```text
//! fmu-fuzz FMU [--sequences N] [--seconds S] [--seed S] [--limit S] [--library FILE] [--other FMU] [--keep I,J,...]
//! ```
//! Every sequence comes from a number, `--seed` and those after it. It uses up to three instances (Model Exchange,
//! Co-Simulation with and without Event Mode) and three saved states, in and out of phase, with values that break things.
//! [`machine`] judges every answer by the standard ([`standard`]) and the rules of this project: the right status, a message
//! that names what is refused, no value that is not finite, lastSuccessfulTime, restored states. [`check`] repeats the
//! sequence without the refused calls and without the reading ones. A call that takes longer than `--limit` is a hang.
//!
//! The sequences run in a process of their own, so that one that crashes is reported too. A failure is printed with
//! the calls it needs and the command that repeats it (`--seed` with `--keep`).
//!
//! `--other` is an FMU of another model: its serialised state has to be refused.

#![allow(rustdoc::private_intra_doc_links, reason = "a program")]

mod api;
mod archive;
mod call;
mod check;
mod description;
mod expect;
mod generate;
mod machine;
mod options;
mod random;
mod saved;
mod standard;
mod values;
mod watchdog;

use std::ffi::CString;
use std::io::Write;
use std::process::ExitCode;
use std::time::{Duration, Instant};
use std::{fs, process};

use crate::api::Api;
use crate::archive::Opened;
use crate::call::Call;
use crate::check::Counts;
use crate::machine::{Fmu, Violation};
use crate::options::Options;

/// Everything that can go wrong before the first call.
#[derive(Debug, thiserror::Error)]
enum FuzzError {
    #[error("{0}")]
    Options(#[from] options::OptionsError),
    #[error(transparent)]
    Archive(#[from] archive::ArchiveError),
    #[error(transparent)]
    Load(#[from] fmi_capi::LoadError),
    #[error("instantiation token: {0}")]
    Token(#[from] std::ffi::NulError),
    #[error("the process of its own: {0}")]
    Process(#[from] std::io::Error),
}

/// A line on standard output; nothing is left to report to if it is closed.
pub(crate) fn say(line: &str) {
    let _ = writeln!(std::io::stdout(), "{line}");
}

fn main() -> ExitCode {
    let result = Options::parse(std::env::args().skip(1))
        .map_err(FuzzError::from)
        .and_then(|options| if options.worker.is_some() { work(&options) } else { supervise(&options) });
    match result {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            let _ = writeln!(std::io::stderr(), "fmu-fuzz: {error}");
            ExitCode::from(2)
        }
    }
}

/// Run the sequences in another process; true if all went well.
fn supervise(options: &Options) -> Result<bool, FuzzError> {
    let progress = std::env::temp_dir().join(format!("fmu-fuzz-{}", process::id()));
    fs::create_dir_all(&progress)?;
    let status = options.command(&progress.join("seed"))?.status()?;
    let well = status.success();
    if !well && status.code() != Some(1) {
        let seed = fs::read(progress.join("seed"))?;
        let seed = u64::from_le_bytes(seed.try_into().unwrap_or_default());
        say(&format!("{}: sequence {seed} ends the process: {status}", options.fmu.display()));
        report_crash(options, seed, &progress.join("seed"))?;
    }
    fs::remove_dir_all(&progress)?;
    Ok(well)
}

/// Find the calls that end the process, each attempt in a process of its own.
fn report_crash(options: &Options, seed: u64, progress: &std::path::Path) -> Result<(), FuzzError> {
    let Opened { description, .. } = archive::open(&options.fmu, options.library.as_deref(), &folder())?;
    let calls = generate::sequence(seed, &description);
    let crashes = |kept: &[usize]| {
        let one = Options { seed, sequences: Some(1), keep: Some(kept.to_vec()), ..options.clone() };
        let run = one.command(progress).and_then(|mut c| c.stdout(process::Stdio::null()).status());
        run.is_ok_and(|status| !status.success())
    };
    print_sequence(options, seed, &calls, &check::minimise(calls.len(), crashes));
    Ok(())
}

fn folder() -> std::path::PathBuf {
    std::env::temp_dir().join(format!("fmu-fuzz-{}", process::id()))
}

/// Run the sequences here; true if all went well.
fn work(options: &Options) -> Result<bool, FuzzError> {
    watchdog::start(Duration::from_secs(options.limit));
    let opened = archive::open(&options.fmu, options.library.as_deref(), &folder())?;
    let result = options
        .other
        .as_deref()
        .map_or(Ok(Vec::new()), foreign_state)
        .and_then(|foreign| sequences(options, opened, foreign));
    let _ = fs::remove_dir_all(folder());
    result
}

/// Run the sequences on an open FMU.
fn sequences(options: &Options, opened: Opened, foreign: Vec<u8>) -> Result<bool, FuzzError> {
    let api = Api::load(&opened)?;
    let description = opened.description;
    let token = CString::new(description.token.clone())?;
    let fmu = Fmu { api, description, token, foreign };
    let begin = Instant::now();
    let (mut total, mut done) = (Counts::default(), 0);
    while options.sequences.is_none_or(|n| done < n)
        && options.seconds.is_none_or(|s| begin.elapsed().as_secs_f64() < s)
    {
        let seed = options.seed.wrapping_add(done);
        if let Some(progress) = &options.worker {
            fs::write(progress, seed.to_le_bytes())?;
        }
        let calls = generate::sequence(seed, &fmu.description);
        let chosen = |kept: &[usize]| kept.iter().filter_map(|i| calls.get(*i)).cloned().collect::<Vec<_>>();
        let all: Vec<usize> = options.keep.clone().unwrap_or_else(|| (0..calls.len()).collect());
        match check::check(&fmu, &chosen(&all), observes(seed)) {
            Ok(counts) => {
                total.calls += counts.calls;
                total.refused += counts.refused;
            }
            Err(first) => {
                let fails = |kept: &[usize]| {
                    let kept: Vec<_> = kept.iter().map(|i| all[*i]).collect();
                    check::check(&fmu, &chosen(&kept), observes(seed)).is_err()
                };
                let kept: Vec<_> = check::minimise(all.len(), fails).iter().map(|i| all[*i]).collect();
                let violation = check::check(&fmu, &chosen(&kept), observes(seed)).err().unwrap_or(first);
                print_sequence(options, seed, &calls, &kept);
                print_violation(&violation, kept.len());
                return Ok(false);
            }
        }
        done += 1;
    }
    say(&format!(
        "{} {:?}: {done} sequences, {} calls, {} of them refused, {:.1} s",
        fmu.description.identifier,
        fmu.description.version,
        total.calls,
        total.refused,
        begin.elapsed().as_secs_f64()
    ));
    Ok(true)
}

/// The serialised state of another FMU, just made.
fn foreign_state(path: &std::path::Path) -> Result<Vec<u8>, FuzzError> {
    let opened = archive::open(path, None, &folder().join("other"))?;
    let api = Api::load(&opened)?;
    let description = opened.description;
    let token = CString::new(description.token.clone())?;
    let interfaces = standard::Interface::of(description.version);
    let instance = interfaces.last().and_then(|interface| api.instantiate(*interface, &token).ok());
    let mut state = api::SavedState::NONE;
    api.save(instance.as_ref(), &mut state);
    let (_, bytes) = api.serialize(instance.as_ref(), &state, 0);
    api.free_state(instance.as_ref(), &mut state);
    api.free(instance);
    Ok(bytes)
}

/// Every second sequence looks at everything when states are saved and restored.
fn observes(seed: u64) -> bool {
    seed % 2 == 1
}

fn print_sequence(options: &Options, seed: u64, calls: &[Call], kept: &[usize]) {
    for (place, i) in kept.iter().enumerate() {
        say(&format!("  {place:3}  {}", calls[*i]));
    }
    let keep: Vec<_> = kept.iter().map(ToString::to_string).collect();
    let fmu = options.fmu.display();
    say(&format!("repeat: fmu-fuzz {fmu} --seed {seed} --sequences 1 --keep {}", keep.join(",")));
}

fn print_violation(violation: &Violation, calls: usize) {
    if violation.call < calls {
        say(&format!("call {}: {}", violation.call, violation.text));
    } else {
        say(&format!("reading everything at the end: {}", violation.text));
    }
}
