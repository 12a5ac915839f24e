//! How a scene is stepped.

mod common;
mod cosimulation;
mod events;
mod exchange;
mod inputs;
mod settings;
mod step_control;

pub(crate) use common::{Run, RunState};
pub use settings::{Choices, Config, MethodKind, integrator_name};

use std::time::Instant;

use cpu_time::ThreadTime;

use crate::error::Error;
use crate::import::Interface;
use crate::record::Recorder;
use crate::sweep::Sweeper;

/// What a run tells while it goes on: the time reached [s].
pub type Progress<'a> = &'a mut dyn FnMut(f64);

/// Steps of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Steps {
    /// Accepted steps of the integrator or communication steps
    pub accepted: u64,
    /// Rejected ones
    pub rejected: u64,
    /// Evaluations of the common right-hand side
    pub rhs_evaluations: u64,
    /// Events carried out
    pub events: u64,
    /// Largest distance of a closing joint at a recorded time [m]
    pub gap: f64,
    /// Wall time from the first step to the last [s]
    pub seconds: f64,
    /// CPU time of the thread that steps, from the first step to the last [s]
    pub cpu: f64,
}

/// Wall and CPU time since it was started.
struct Clock(Instant, ThreadTime);

impl Clock {
    fn start() -> Self {
        Self(Instant::now(), ThreadTime::now())
    }

    /// (wall, CPU) time [s].
    fn read(&self) -> (f64, f64) {
        (self.0.elapsed().as_secs_f64(), self.1.elapsed().as_secs_f64())
    }
}

impl MethodKind {
    /// The interface that the method needs.
    #[must_use]
    pub fn interface(self) -> Interface {
        match self {
            Self::Common => Interface::ModelExchange,
            Self::CsPredict | Self::CsPece => Interface::CoSimulation,
            Self::Jacobi | Self::Seidel => Interface::PlainCoSimulation,
        }
    }
}

/// Runs from start to stop; the instances have their parameters.
///
/// # Errors
/// What the FMUs or the numerics refuse.
pub fn run(
    sweeper: &mut Sweeper,
    config: &Config,
    recorder: &mut Recorder,
    progress: Progress<'_>,
) -> Result<Steps, Error> {
    let result = match config.method {
        MethodKind::Common => common::run(sweeper, config, recorder, progress),
        MethodKind::CsPredict | MethodKind::CsPece => cosimulation::run(sweeper, config, recorder, progress),
        MethodKind::Jacobi | MethodKind::Seidel => exchange::run(sweeper, config, recorder, progress),
    };
    result.map_err(|error| match error {
        Error::Run(failed) => Error::Run(sweeper.explained(failed)),
        other => other,
    })
}
