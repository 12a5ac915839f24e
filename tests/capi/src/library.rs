//! Opening a library and looking up its functions.

use std::path::{Path, PathBuf};

/// Why a library cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// The file is no library that can be loaded.
    #[error("cannot load {path}: {source}")]
    Library {
        /// The file
        path: PathBuf,
        /// Cause
        source: libloading::Error,
    },
    /// A function is missing.
    #[error("{symbol} is missing: {source}")]
    Symbol {
        /// The function
        symbol: &'static str,
        /// Cause
        source: libloading::Error,
    },
}

/// An open library; closed when dropped.
#[derive(Debug)]
pub struct Library(libloading::Library);

impl Library {
    /// Open the library.
    ///
    /// # Errors
    /// [`LoadError::Library`].
    pub fn open(path: &Path) -> Result<Self, LoadError> {
        // SAFETY: loading runs the library's initialisers; it is the FMU that the caller wants to run.
        let library = unsafe { libloading::Library::new(path) };
        library.map(Self).map_err(|source| LoadError::Library { path: path.into(), source })
    }

    /// The function `symbol`; `T` is its type as the standard has it, see [`crate::fmi3`].
    ///
    /// # Errors
    /// [`LoadError::Symbol`].
    pub fn symbol<T: Copy>(&self, symbol: &'static str) -> Result<T, LoadError> {
        // SAFETY: the symbols of an FMI library have the types that the standard gives them, which the caller names;
        // calling them is unsafe and allowed only while the library is open.
        let found = unsafe { self.0.get::<T>(symbol) };
        found.map(|f| *f).map_err(|source| LoadError::Symbol { symbol, source })
    }
}
