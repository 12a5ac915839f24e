//! The C interface of FMUs: the one module of the host that holds unsafe code.
//!
//! The bindings are those of the crate `fmi-sys`. Around them stand: a missing function is an error and not a panic, any
//! status and any Boolean byte is taken, log texts may be null, an instance that reported Fatal is never touched again.

#![allow(unsafe_code, reason = "calls into C libraries; every block states why it is sound")]

pub(super) mod fmi2;
pub(super) mod fmi3;
mod log;
mod status;

pub use status::{Fault, Status};

use std::path::Path;
use std::sync::Arc;

use super::Version;

/// A loaded shared library; shared by all instances of an FMU.
#[derive(Clone)]
pub(super) enum Library {
    /// Of an FMI 2.0 FMU
    V2(Arc<fmi_sys::fmi2::Fmi2Binding>),
    /// Of an FMI 3.0 FMU
    V3(Arc<fmi_sys::fmi3::Fmi3Binding>),
}

impl Library {
    /// Loads a library.
    ///
    /// # Errors
    /// A file that the system's loader refuses.
    pub(super) fn load(path: &Path, version: Version) -> Result<Self, LibraryError> {
        // SAFETY: loading runs the initialisers of the library: it is the FMU that the user asked to run. The function
        // types are those of the FMI headers for the version that the model description declares.
        let loaded = unsafe {
            match version {
                Version::V2 => fmi_sys::fmi2::Fmi2Binding::new(path).map(|b| Self::V2(Arc::new(b))),
                Version::V3 => fmi_sys::fmi3::Fmi3Binding::new(path).map(|b| Self::V3(Arc::new(b))),
            }
        };
        loaded.map_err(|error| LibraryError { path: path.display().to_string(), cause: error.to_string() })
    }
}

/// A shared library cannot be loaded.
#[derive(Debug, thiserror::Error)]
#[error("cannot load {path}: {cause}")]
pub struct LibraryError {
    path: String,
    cause: String,
}

/// What an instance is made with.
pub(super) struct Identity<'a> {
    /// Name in the scene
    pub(super) name: &'a str,
    /// `instantiationToken` or `guid`
    pub(super) token: &'a str,
    /// Folder `resources` of the unpacked FMU
    pub(super) resources: &'a Path,
}

/// What `UpdateDiscreteStates` or `NewDiscreteStates` says.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Update {
    /// Another update is needed
    pub again: bool,
    /// The FMU wants to end the run
    pub terminate: bool,
    /// Continuous states have new values
    pub states_changed: bool,
    /// Next time event [s]
    pub next_event: Option<f64>,
}

/// What `DoStep` says.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stepped {
    /// The FMU wants Event Mode
    pub event: bool,
    /// The FMU wants to end the run
    pub terminate: bool,
}
