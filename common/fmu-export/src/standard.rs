//! The versions of the interface standard that one binary serves.

use model::Kind;

/// A version of FMI.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Standard {
    /// FMI 2.0
    Fmi2,
    /// FMI 3.0
    Fmi3,
}

impl Standard {
    /// The version as the functions and the model description give it.
    #[must_use]
    pub const fn version(self) -> &'static str {
        match self {
            Self::Fmi2 => "2.0",
            Self::Fmi3 => "3.0",
        }
    }

    /// Name of a type of variables.
    #[must_use]
    pub const fn type_name(self, kind: Kind) -> &'static str {
        match (self, kind) {
            (Self::Fmi2, Kind::Float64) => "Real",
            (Self::Fmi2, Kind::Int32 | Kind::Int64) => "Integer",
            (Self::Fmi3, Kind::Float64) => "Float64",
            (Self::Fmi3, Kind::Int32) => "Int32",
            (Self::Fmi3, Kind::Int64) => "Int64",
            (_, Kind::Boolean) => "Boolean",
            (_, Kind::Enumeration(_)) => "Enumeration",
        }
    }

    /// Folder of the binaries of this platform inside an archive.
    pub(crate) const fn platform(self) -> &'static str {
        let (windows, mac) = (cfg!(target_os = "windows"), cfg!(target_os = "macos"));
        match self {
            Self::Fmi2 if windows => "win64",
            Self::Fmi2 if mac => "darwin64",
            Self::Fmi2 => "linux64",
            Self::Fmi3 if windows => "x86_64-windows",
            Self::Fmi3 if mac => "x86_64-darwin",
            Self::Fmi3 => "x86_64-linux",
        }
    }
}
