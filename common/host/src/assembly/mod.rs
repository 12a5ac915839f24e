//! A scene as one Co-Simulation FMU (method 4 of the coupling specification): method `common` inside.
//!
//! ```text
//! resources/SystemStructure.ssd    the scene
//! resources/fmus/NAME.fmu/         its elements, unpacked
//! binaries/.../SCENE.so            the library `assembly`, the same for all scenes
//! ```
//! An instance loads the scene, makes Model Exchange instances of the elements and moves them by
//! [`Run`](crate::methods::Run). The integrator keeps its own steps: it goes beyond a communication point, where the state
//! is read from the dense output, and goes on from there, so that the numbers are those of method `common`. Only where an
//! input or a tunable parameter changes it turns back to the communication point, and while inputs move its steps end there.

mod instance;
mod layout;
mod pack;
mod reach;
mod state;
mod step;
mod values;

pub use instance::Assembly;
pub use pack::{Packed, Packing, pack};
pub use state::AssemblyState;

use fmu_export::{Fault, Status};

use crate::error::{Error, RunError};
use crate::import::{self, ImportError};
use crate::scene::SceneError;
use crate::ssp::SspError;

/// Why a scene is no assembly.
#[derive(Debug, thiserror::Error)]
pub enum AssemblyError {
    /// The scene
    #[error(transparent)]
    Scene(Box<SceneError>),
    /// Its elements
    #[error(transparent)]
    Run(Box<RunError>),
    /// Two variables of one name
    #[error("two variables of the assembly would be named {0}: rename an element")]
    Twice(String),
    /// A name that is none in a program
    #[error(
        "{0:?} cannot be a name in an FMU: letters, digits and underscores are allowed, a letter comes first"
    )]
    Name(String),
    /// Two FMUs whose files have one name
    #[error("{0} and {1} are two FMUs of one file name: rename one")]
    SameFile(String, String),
    /// The archive
    #[error(transparent)]
    Pack(Box<fmu_export::PackError>),
    /// A file
    #[error("{path}: {source}")]
    Io {
        /// File
        path: std::path::PathBuf,
        /// Cause
        source: std::io::Error,
    },
}

impl From<SceneError> for AssemblyError {
    fn from(error: SceneError) -> Self {
        Self::Scene(Box::new(error))
    }
}

impl From<RunError> for AssemblyError {
    fn from(error: RunError) -> Self {
        Self::Run(Box::new(error))
    }
}

impl From<fmu_export::PackError> for AssemblyError {
    fn from(error: fmu_export::PackError) -> Self {
        Self::Pack(Box::new(error))
    }
}

impl From<SspError> for AssemblyError {
    fn from(error: SspError) -> Self {
        SceneError::from(error).into()
    }
}

impl From<ImportError> for AssemblyError {
    fn from(error: ImportError) -> Self {
        SceneError::from(error).into()
    }
}

impl From<Error> for AssemblyError {
    fn from(error: Error) -> Self {
        match error {
            Error::Scene(error) => Self::Scene(error),
            Error::Run(error) => error.into(),
            Error::Output { path, source } => Self::Io { path: path.into(), source },
        }
    }
}

/// What a failure in a run means for the call in which it happened: the numerics refuse, or an element is lost.
fn refused(error: impl Into<Error>) -> Fault {
    let error = error.into();
    let status = match &error {
        Error::Run(RunError::Call { fault, .. }) => match fault.status {
            import::Status::Fatal | import::Status::Null | import::Status::Missing => Status::Fatal,
            import::Status::Discard | import::Status::Terminate => Status::Discard,
            _ => Status::Error,
        },
        Error::Run(_) => Status::Discard,
        Error::Scene(_) | Error::Output { .. } => Status::Error,
    };
    Fault::Part { message: error.to_string(), status }
}
