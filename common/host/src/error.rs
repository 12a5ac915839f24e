//! What can go wrong in a run.

use crate::import::{Fault, listed};
use crate::scene::SceneError;

/// Why a run did not start or did not reach its end.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The scene cannot be run
    #[error(transparent)]
    Scene(Box<SceneError>),
    /// The run failed
    #[error(transparent)]
    Run(#[from] RunError),
    /// A result cannot be written
    #[error("{path}: {source}")]
    Output {
        /// File
        path: String,
        /// Cause
        source: std::io::Error,
    },
}

impl From<SceneError> for Error {
    fn from(error: SceneError) -> Self {
        Self::Scene(Box::new(error))
    }
}

/// Why a run failed.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// An FMU refused a call
    #[error("t = {t:.6} s: {component}: {fault}{}", listed(messages))]
    Call {
        /// Time [s]
        t: f64,
        /// Component
        component: String,
        /// Cause
        fault: Fault,
        /// What the FMU said
        messages: Vec<String>,
    },
    /// The closing joints do not fit together
    #[error(
        "t = {t:.6} s: inconsistent or singular closure at joint {joint}: a direction that no force moves has the relative acceleration {acceleration:.3e} m/s2"
    )]
    Closure {
        /// Time [s]
        t: f64,
        /// The joint with the largest part in it
        joint: String,
        /// Relative acceleration there [m/s2]
        acceleration: f64,
    },
    /// The affine loop of raw connections has no solution
    #[error(
        "t = {t:.6} s: the loop of raw connections through {input} has no solution (singular or not affine)"
    )]
    Loop {
        /// Time [s]
        t: f64,
        /// An input of the loop
        input: String,
    },
    /// The joints are open at the start
    #[error(
        "joint {joint} is open at the start: {position:.3e} m, {velocity:.3e} m/s (limit 1e-9); list start parameters in assemble, or correct the start values"
    )]
    Gap {
        /// The joint
        joint: String,
        /// Distance [m]
        position: f64,
        /// Relative velocity [m/s]
        velocity: f64,
    },
    /// The start parameters cannot close the joints
    #[error(
        "the start parameters listed in assemble do not close the joints: {gap:.3e} m are left after {passes} passes"
    )]
    Assemble {
        /// Distance left [m]
        gap: f64,
        /// Newton passes
        passes: u32,
    },
    /// The integrator
    #[error("{0}")]
    Integrator(String),
    /// The step control of Co-Simulation gives up
    #[error("t = {t:.6} s: communication step fell to {h:.3e} s; worst signal: {signal}")]
    StepTooSmall {
        /// Time [s]
        t: f64,
        /// Step [s]
        h: f64,
        /// Signal with the largest error
        signal: String,
    },
    /// A signal is no number
    #[error("t = {t:.6} s: {signal} is {value}")]
    NotFinite {
        /// Time [s]
        t: f64,
        /// Component and variable
        signal: String,
        /// What it became
        value: f64,
    },
    /// A signal has run away
    #[error("diverged at t = {t:.4} s: {signal} = {value:.3e}")]
    Diverged {
        /// Time [s]
        t: f64,
        /// Component and variable
        signal: String,
        /// What it became
        value: f64,
    },
    /// Events without end
    #[error("t = {t:.6} s: the FMUs ask for updates of their discrete states without end ({passes} passes)")]
    EventLoop {
        /// Time [s]
        t: f64,
        /// Passes
        passes: u32,
    },
}
