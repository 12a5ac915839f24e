//! FMUs: archive, model description, library, instances.

mod archive;
mod binding;
mod description;
mod instance;

pub use archive::{Archive, ArchiveError};
pub use binding::{Fault, LibraryError, Status, Stepped, Update};
pub use description::{
    Capabilities, Causality, Description, DescriptionError, Enumeration, Experiment, Initial, Item, Variable,
    VariableKind, Version,
};
pub use instance::{Counts, Instance, Interface, Saved};

use std::cell::OnceCell;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use tempfile::TempDir;

use crate::import::binding::{Identity, Library};

/// Folder of this platform's binaries in FMI 3.0 and 2.0.
const PLATFORM: (&str, &str) = if cfg!(target_os = "windows") {
    ("x86_64-windows", "win64")
} else if cfg!(target_os = "macos") {
    (if cfg!(target_arch = "aarch64") { "aarch64-darwin" } else { "x86_64-darwin" }, "darwin64")
} else if cfg!(target_arch = "aarch64") {
    ("aarch64-linux", "linux64")
} else {
    ("x86_64-linux", "linux64")
};
const EXTENSION: &str = std::env::consts::DLL_EXTENSION;

/// A value to be set.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// Of a Float64 or Real
    Real(f64),
    /// Of an integer or an enumeration
    Integer(i64),
    /// Of a Boolean
    Boolean(bool),
    /// Of a String
    String(String),
}

/// Why there is no FMU or no instance.
#[derive(Debug, thiserror::Error)]
pub enum ImportError {
    /// The archive
    #[error(transparent)]
    Archive(#[from] ArchiveError),
    /// The model description
    #[error("{path}: modelDescription.xml: {source}")]
    Description {
        /// FMU
        path: PathBuf,
        /// Cause
        source: DescriptionError,
    },
    /// The library
    #[error(transparent)]
    Library(#[from] LibraryError),
    /// No folder to unpack to
    #[error("no temporary folder: {0}")]
    Folder(std::io::Error),
    /// No binary of this platform
    #[error("{path} has no {entry}: it is not made for this platform")]
    Platform {
        /// FMU
        path: PathBuf,
        /// Binary looked for
        entry: String,
    },
    /// The FMU lacks the interface
    #[error("{path} does not offer {interface}")]
    Interface {
        /// FMU
        path: PathBuf,
        /// What is needed
        interface: Interface,
    },
    /// The FMU can be instantiated once only
    #[error("{path} declares that a process may hold one instance of it only")]
    Single {
        /// FMU
        path: PathBuf,
    },
    /// No instance was made
    #[error("{name}: no instance of {path}: {fault}{}", listed(messages))]
    Refused {
        /// Component
        name: String,
        /// FMU
        path: PathBuf,
        /// Cause
        fault: Fault,
        /// What the FMU said
        messages: Vec<String>,
    },
}

/// Messages of an FMU as lines below an error.
#[must_use]
pub fn listed(messages: &[String]) -> String {
    messages.iter().fold(String::new(), |text, message| text + "\n  " + message)
}

/// An FMU, unpacked when its first instance is made; all instances share the library.
pub struct Fmu {
    path: PathBuf,
    /// What it says about itself
    pub description: Description,
    unpacked: OnceCell<Unpacked>,
}

struct Unpacked {
    folder: Folder,
    library: Library,
    identifier: String,
}

/// Where an FMU is unpacked.
enum Folder {
    /// By this host, until it is closed
    Own(TempDir),
    /// By others
    Given(PathBuf),
}

impl Folder {
    fn path(&self) -> &Path {
        match self {
            Self::Own(folder) => folder.path(),
            Self::Given(folder) => folder,
        }
    }
}

impl Fmu {
    /// Reads the model description of an archive, or of a folder with the content of one.
    ///
    /// # Errors
    /// A file that is no FMU.
    pub fn open(path: &Path) -> Result<Rc<Self>, ImportError> {
        const DESCRIPTION: &str = "modelDescription.xml";
        let text = if path.is_dir() {
            let file = path.join(DESCRIPTION);
            std::fs::read(&file).map_err(|source| ArchiveError::Io { path: file, source })?
        } else {
            Archive::open(path)?.read(DESCRIPTION)?
        };
        let description = Description::read(&text)
            .map_err(|source| ImportError::Description { path: path.into(), source })?;
        Ok(Rc::new(Self { path: path.into(), description, unpacked: OnceCell::new() }))
    }

    /// The archive.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// What the FMU can do under an interface.
    #[must_use]
    pub fn capabilities(&self, interface: Interface) -> Option<&Capabilities> {
        match interface {
            Interface::CoSimulation | Interface::PlainCoSimulation => self.description.co_simulation.as_ref(),
            Interface::ModelExchange => self.description.model_exchange.as_ref(),
        }
    }

    /// Makes an instance.
    ///
    /// # Errors
    /// The FMU lacks the interface or a binary for this platform, its library cannot be loaded, or it refuses.
    pub fn instantiate(self: &Rc<Self>, name: &str, interface: Interface) -> Result<Instance, ImportError> {
        let Some(capabilities) = self.capabilities(interface) else {
            return Err(ImportError::Interface { path: self.path.clone(), interface });
        };
        if capabilities.single_instance && Rc::strong_count(self) > 2 {
            return Err(ImportError::Single { path: self.path.clone() });
        }
        let unpacked = self.unpacked(&capabilities.identifier)?;
        let resources = unpacked.folder.path().join("resources");
        let identity = Identity { name, token: &self.description.token, resources: &resources };
        Instance::new(Rc::clone(self), &unpacked.library, &identity, interface).map_err(
            |(fault, messages)| ImportError::Refused {
                name: name.into(),
                path: self.path.clone(),
                fault,
                messages,
            },
        )
    }

    fn unpacked(&self, identifier: &str) -> Result<&Unpacked, ImportError> {
        if let Some(unpacked) = self.unpacked.get() {
            if unpacked.identifier != identifier {
                // both interfaces of our FMUs live in one library; one scene uses one interface
                return Err(ImportError::Single { path: self.path.clone() });
            }
            return Ok(unpacked);
        }
        let unpacked = self.unpack(identifier)?;
        Ok(self.unpacked.get_or_init(|| unpacked))
    }

    fn unpack(&self, identifier: &str) -> Result<Unpacked, ImportError> {
        let version = self.description.version;
        let platform = match version {
            Version::V2 => PLATFORM.1,
            Version::V3 => PLATFORM.0,
        };
        let binaries = format!("binaries/{platform}/");
        let entry = format!("{binaries}{identifier}.{EXTENSION}");
        let folder = if self.path.is_dir() {
            Folder::Given(self.path.clone())
        } else {
            let mut archive = Archive::open(&self.path)?;
            let folder = tempfile::Builder::new().prefix("koppel-").tempdir().map_err(ImportError::Folder)?;
            archive.unpack(folder.path(), |name| {
                name.starts_with(&binaries) || name.starts_with("resources/")
            })?;
            Folder::Own(folder)
        };
        if !folder.path().join(&entry).is_file() {
            return Err(ImportError::Platform { path: self.path.clone(), entry });
        }
        let library = Library::load(&folder.path().join(&entry), version)?;
        Ok(Unpacked { folder, library, identifier: identifier.into() })
    }
}
