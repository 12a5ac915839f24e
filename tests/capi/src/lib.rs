//! A shared library with FMI functions, for programs that test it: types of the functions, symbols, messages.
//!
//! Calling the functions stays unsafe and is left to the programs.

#![allow(
    unsafe_code,
    reason = "opens a C library and receives its callbacks; every block states why it is sound"
)]

pub mod fmi2;
pub mod fmi3;
mod library;
mod log;

pub use library::{Library, LoadError};
pub use log::{Log, Message, log_format, log_message};

use std::ffi::c_int;

/// Status of a call as it arrives: any integer.
pub type Status = c_int;

/// `fmi3OK`
pub const OK: Status = 0;
/// `fmi3Warning`
pub const WARNING: Status = 1;
/// `fmi3Discard`
pub const DISCARD: Status = 2;
/// `fmi3Error`
pub const ERROR: Status = 3;

/// Name of a status.
#[must_use]
pub fn status_name(status: Status) -> &'static str {
    ["OK", "Warning", "Discard", "Error", "Fatal"]
        .get(usize::try_from(status).unwrap_or(usize::MAX))
        .copied()
        .unwrap_or("unknown status")
}
