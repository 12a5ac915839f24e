//! Types of the functions of FMI 3.0, as in `fmi3FunctionTypes.h`.
//!
//! `fmi3Boolean` is a byte: what comes from a library may be any.

use std::ffi::{c_char, c_int, c_void};

use crate::Status;

/// `fmi3Instance`
pub type Instance = *mut c_void;
/// `fmi3FMUState`
pub type State = *mut c_void;
/// `fmi3Boolean`
pub type Flag = u8;

/// `fmi3LogMessageCallback`
pub type LogMessage = unsafe extern "C" fn(*mut c_void, Status, *const c_char, *const c_char);
/// Callbacks that are never given.
pub type NoCallback = Option<unsafe extern "C" fn()>;

/// `fmi3InstantiateCoSimulation`: name, token, resources, visible, logging on, event mode used, early return allowed,
/// intermediate variables and their number, environment, log, intermediate update
pub type InstantiateCoSimulation = unsafe extern "C" fn(
    *const c_char,
    *const c_char,
    *const c_char,
    Flag,
    Flag,
    Flag,
    Flag,
    *const u32,
    usize,
    *mut c_void,
    Option<LogMessage>,
    NoCallback,
) -> Instance;
/// `fmi3InstantiateModelExchange`: name, token, resources, visible, logging on, environment, log
pub type InstantiateModelExchange = unsafe extern "C" fn(
    *const c_char,
    *const c_char,
    *const c_char,
    Flag,
    Flag,
    *mut c_void,
    Option<LogMessage>,
) -> Instance;
/// `fmi3FreeInstance`
pub type FreeInstance = unsafe extern "C" fn(Instance);
/// Functions of an instance alone: transitions, `fmi3Reset`, ...
pub type Simple = unsafe extern "C" fn(Instance) -> Status;
/// `fmi3SetDebugLogging`: on, number of categories, categories
pub type SetDebugLogging = unsafe extern "C" fn(Instance, Flag, usize, *const *const c_char) -> Status;
/// `fmi3EnterInitializationMode`: tolerance defined, tolerance, start, stop defined, stop
pub type EnterInitialization = unsafe extern "C" fn(Instance, Flag, f64, f64, Flag, f64) -> Status;
/// `fmi3DoStep`: time, step, no state before will be set, event handling needed, terminate, early return, time reached
pub type DoStep =
    unsafe extern "C" fn(Instance, f64, f64, Flag, *mut Flag, *mut Flag, *mut Flag, *mut f64) -> Status;
/// `fmi3UpdateDiscreteStates`: update again, terminate, nominals changed, states changed, next event defined, its time
pub type UpdateDiscreteStates =
    unsafe extern "C" fn(Instance, *mut Flag, *mut Flag, *mut Flag, *mut Flag, *mut Flag, *mut f64) -> Status;
/// `fmi3CompletedIntegratorStep`: no state before will be set, enter event mode, terminate
pub type CompletedIntegratorStep = unsafe extern "C" fn(Instance, Flag, *mut Flag, *mut Flag) -> Status;
/// `fmi3SetTime`
pub type SetTime = unsafe extern "C" fn(Instance, f64) -> Status;
/// `fmi3Get{VariableType}`: references, their number, values, their number
pub type Get<T> = unsafe extern "C" fn(Instance, *const u32, usize, *mut T, usize) -> Status;
/// `fmi3Set{VariableType}`
pub type Set<T> = unsafe extern "C" fn(Instance, *const u32, usize, *const T, usize) -> Status;
/// Lists of numbers: states, derivatives, nominals, indicators
pub type GetList = unsafe extern "C" fn(Instance, *mut f64, usize) -> Status;
/// `fmi3SetContinuousStates`
pub type SetList = unsafe extern "C" fn(Instance, *const f64, usize) -> Status;
/// Number of states, of indicators
pub type Count = unsafe extern "C" fn(Instance, *mut usize) -> Status;
/// `fmi3GetDirectionalDerivative`: unknowns, knowns, seed, sensitivity, each with its number
pub type DirectionalDerivative = unsafe extern "C" fn(
    Instance,
    *const u32,
    usize,
    *const u32,
    usize,
    *const f64,
    usize,
    *mut f64,
    usize,
) -> Status;
/// `fmi3GetNumberOfVariableDependencies`
pub type CountDependencies = unsafe extern "C" fn(Instance, u32, *mut usize) -> Status;
/// `fmi3GetVariableDependencies`: dependent, its elements, independents, their elements, kinds, number
pub type Dependencies =
    unsafe extern "C" fn(Instance, u32, *mut usize, *mut u32, *mut usize, *mut c_int, usize) -> Status;
/// `fmi3GetFMUState`, `fmi3FreeFMUState`
pub type StateSlot = unsafe extern "C" fn(Instance, *mut State) -> Status;
/// `fmi3SetFMUState`
pub type SetState = unsafe extern "C" fn(Instance, State) -> Status;
/// `fmi3SerializedFMUStateSize`
pub type StateSize = unsafe extern "C" fn(Instance, State, *mut usize) -> Status;
/// `fmi3SerializeFMUState`
pub type Serialize = unsafe extern "C" fn(Instance, State, *mut u8, usize) -> Status;
/// `fmi3DeserializeFMUState`
pub type Deserialize = unsafe extern "C" fn(Instance, *const u8, usize, *mut State) -> Status;
