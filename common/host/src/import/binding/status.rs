//! Status codes and calls that went wrong.

use std::fmt;

/// Status of a call, as far as it is not OK or Warning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// Refused; the instance goes on
    Discard,
    /// The instance cannot go on
    Error,
    /// The instance is lost
    Fatal,
    /// FMI 2.0: an asynchronous step, which the host never asks for
    Pending,
    /// A code that FMI does not know
    Unknown(u32),
    /// The library lacks the function
    Missing,
    /// A null pointer came back
    Null,
    /// The FMU wants to end the run
    Terminate,
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Discard => f.write_str("returned Discard"),
            Self::Error => f.write_str("returned Error"),
            Self::Fatal => f.write_str("returned Fatal"),
            Self::Pending => f.write_str("returned Pending, which nobody asked for"),
            Self::Unknown(code) => write!(f, "returned the unknown status {code}"),
            Self::Missing => f.write_str("is missing in the library"),
            Self::Null => f.write_str("returned a null pointer"),
            Self::Terminate => f.write_str("asked to end the run"),
        }
    }
}

/// A call that did not return OK or Warning.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{function} {status}")]
pub struct Fault {
    /// The C function
    pub function: &'static str,
    /// What came back
    pub status: Status,
}

/// A status as FMI 2.0 and 3.0 number it.
#[inline]
pub(super) fn check(function: &'static str, code: u32) -> Result<(), Fault> {
    if code <= 1 { Ok(()) } else { Err(Fault { function, status: classify(code) }) }
}

#[cold]
fn classify(code: u32) -> Status {
    match code {
        2 => Status::Discard,
        3 => Status::Error,
        4 => Status::Fatal,
        5 => Status::Pending,
        code => Status::Unknown(code),
    }
}

/// Name of a status in a log message.
pub(super) fn name(code: u32) -> &'static str {
    ["OK", "Warning", "Discard", "Error", "Fatal", "Pending"].get(code as usize).unwrap_or(&"unknown status")
}
