//! Method `common`: the states of all FMUs in one vector, one integrator, Model Exchange.

mod run;

pub(crate) use run::{Run, RunState};

use std::ops::Range;

use integrators::{DynamicOde, NoSolver, StepError};

use super::{Clock, Config, Progress, Steps};
use crate::error::{Error, RunError};
use crate::record::Recorder;
use crate::scene::SceneError;
use crate::start;
use crate::sweep::Sweeper;

/// Runs from start to stop.
pub(super) fn run(
    sweeper: &mut Sweeper,
    config: &Config,
    recorder: &mut Recorder,
    progress: Progress<'_>,
) -> Result<Steps, Error> {
    start::initialise(sweeper, config)?;
    let mut run = Run::start(sweeper, config)?;
    recorder.offer(sweeper, config, run.t)?;
    let begin = Clock::start();
    while run.t < config.stop {
        run.advance(sweeper, config, config.stop)?;
        while let Some(sample) = recorder.due_before(config, run.reached()) {
            run.look(sweeper, sample)?;
            recorder.record(sweeper, sample)?;
        }
        run.accept(sweeper)?;
        recorder.offer(sweeper, config, run.t)?;
        progress(run.t);
    }
    let (seconds, cpu) = begin.read();
    let statistics = run.statistics();
    Ok(Steps {
        accepted: statistics.steps,
        rejected: statistics.rejected,
        rhs_evaluations: statistics.rhs_evaluations,
        events: run.events,
        gap: recorder.gap(),
        seconds,
        cpu,
    })
}

/// The right-hand side of the whole scene.
struct Whole<'a> {
    sweeper: &'a mut Sweeper,
    ranges: &'a [Range<usize>],
}

impl DynamicOde for Whole<'_> {
    type Error = RunError;

    #[inline]
    fn rhs(&mut self, t: f64, x: &[f64], dx: &mut [f64]) -> Result<(), RunError> {
        self.place(t, x)?;
        self.sweeper.sweep()?;
        for node in 0..self.ranges.len() {
            let range = self.ranges[node].clone();
            if !range.is_empty() {
                self.sweeper.instances[node]
                    .get_derivatives(&mut dx[range])
                    .map_err(|fault| self.sweeper.failed(node, fault))?;
            }
        }
        Ok(())
    }
}

impl Whole<'_> {
    /// Time and states into the FMUs.
    #[inline]
    fn place(&mut self, t: f64, x: &[f64]) -> Result<(), RunError> {
        let moved = t.to_bits() != self.sweeper.t.to_bits();
        self.sweeper.t = t;
        self.sweeper.drive(t)?;
        for (node, range) in self.ranges.iter().enumerate() {
            let instance = &mut self.sweeper.instances[node];
            let mut result = if moved { instance.set_time(t) } else { Ok(()) };
            if result.is_ok() && !range.is_empty() {
                result = instance.set_states(&x[range.clone()]);
            }
            result.map_err(|fault| self.sweeper.failed(node, fault))?;
        }
        Ok(())
    }

    /// States out of the FMUs.
    fn fetch(&mut self, x: &mut [f64]) -> Result<(), RunError> {
        let ranges = self.ranges;
        self.sweeper.each(|node, instance| match ranges[node].clone() {
            range if range.is_empty() => Ok(()),
            range => instance.get_states(&mut x[range]),
        })
    }
}

fn integrator(error: StepError<RunError>) -> Error {
    match error {
        StepError::Rhs { source, .. } => Error::Run(source),
        other => Error::Run(RunError::Integrator(other.to_string())),
    }
}

fn refused(error: NoSolver) -> Error {
    let wanted = error.to_string();
    SceneError::Setting { name: "integrator", value: String::new(), wanted }.into()
}
