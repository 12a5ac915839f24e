//! Types of the functions of FMI 2.0, as in `fmi2FunctionTypes.h`; those that FMI 3.0 has too are in [`fmi3`](crate::fmi3).

use std::ffi::{c_char, c_int, c_void};

use crate::Status;
use crate::fmi3::{Instance, NoCallback};

/// `fmi2Boolean`
pub type Flag = c_int;

/// `fmi2CallbackLogger`: environment, instance, status, category, format and its arguments
pub type Logger =
    unsafe extern "C" fn(*mut c_void, *const c_char, Status, *const c_char, *const c_char, *const c_char);

/// `fmi2CallbackFunctions`
#[repr(C)]
#[derive(Debug)]
pub struct Callbacks {
    /// Takes messages with one text each, see [`log_format`](crate::log_format)
    pub logger: Option<Logger>,
    /// Memory, not offered
    pub allocate: NoCallback,
    /// Memory, not offered
    pub free: NoCallback,
    /// End of a step in the background, not offered
    pub step_finished: NoCallback,
    /// First argument of the callbacks
    pub environment: *mut c_void,
}

/// `fmi2EventInfo`
#[repr(C)]
#[derive(Debug, Default, Clone, Copy)]
pub struct EventInfo {
    /// Update again, terminate, nominals changed, states changed, next event defined
    pub flags: [Flag; 5],
    /// `nextEventTime`
    pub next: f64,
}

/// `fmi2Instantiate`: name, type, GUID, resources, callbacks, visible, logging on
pub type Instantiate = unsafe extern "C" fn(
    *const c_char,
    c_int,
    *const c_char,
    *const c_char,
    *const Callbacks,
    Flag,
    Flag,
) -> Instance;
/// `fmi2SetDebugLogging`: on, number of categories, categories
pub type SetDebugLogging = unsafe extern "C" fn(Instance, Flag, usize, *const *const c_char) -> Status;
/// `fmi2SetupExperiment`: tolerance defined, tolerance, start, stop defined, stop
pub type SetupExperiment = unsafe extern "C" fn(Instance, Flag, f64, f64, Flag, f64) -> Status;
/// `fmi2DoStep`: time, step, no state before will be set
pub type DoStep = unsafe extern "C" fn(Instance, f64, f64, Flag) -> Status;
/// `fmi2NewDiscreteStates`
pub type NewDiscreteStates = unsafe extern "C" fn(Instance, *mut EventInfo) -> Status;
/// `fmi2CompletedIntegratorStep`: no state before will be set, enter event mode, terminate
pub type CompletedIntegratorStep = unsafe extern "C" fn(Instance, Flag, *mut Flag, *mut Flag) -> Status;
/// `fmi2GetReal` and alike: references, their number, values
pub type Get<T> = unsafe extern "C" fn(Instance, *const u32, usize, *mut T) -> Status;
/// `fmi2SetReal` and alike
pub type Set<T> = unsafe extern "C" fn(Instance, *const u32, usize, *const T) -> Status;
/// `fmi2GetDirectionalDerivative`: unknowns, knowns with their numbers, seed, sensitivity
pub type DirectionalDerivative =
    unsafe extern "C" fn(Instance, *const u32, usize, *const u32, usize, *const f64, *mut f64) -> Status;
/// `fmi2GetRealStatus` and alike: kind, value
pub type GetStatus<T> = unsafe extern "C" fn(Instance, c_int, *mut T) -> Status;
/// `fmi2GetRealOutputDerivatives`: references, their number, orders, values
pub type OutputDerivatives =
    unsafe extern "C" fn(Instance, *const u32, usize, *const c_int, *mut f64) -> Status;
/// `fmi2SetRealInputDerivatives`
pub type InputDerivatives =
    unsafe extern "C" fn(Instance, *const u32, usize, *const c_int, *const f64) -> Status;
