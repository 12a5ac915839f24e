//! The part of FMI 3.0 that a co-simulation run needs, behind a safe interface.
#![allow(unsafe_code, reason = "calls into a C library; every block states why it is sound")]

use std::cell::RefCell;
use std::ffi::{CStr, CString, NulError, c_char, c_int, c_void};
use std::path::{Path, PathBuf};

use libloading::Library;

use crate::job::Value;

/// `fmi3Instance`, never null here.
type Instance = *mut c_void;
/// `fmi3Status` as it arrives: any integer.
type Status = c_int;
/// `fmi3Boolean` where the FMU writes it: any byte.
type Flag = u8;

type LogMessage = unsafe extern "C" fn(*mut c_void, Status, *const c_char, *const c_char);
type IntermediateUpdate = unsafe extern "C" fn();

type Instantiate = unsafe extern "C" fn(
    name: *const c_char,
    token: *const c_char,
    resources: *const c_char,
    visible: bool,
    logging_on: bool,
    event_mode_used: bool,
    early_return_allowed: bool,
    required: *const u32,
    n_required: usize,
    environment: *mut c_void,
    log: Option<LogMessage>,
    intermediate_update: Option<IntermediateUpdate>,
) -> Instance;
type FreeInstance = unsafe extern "C" fn(Instance);
type Simple = unsafe extern "C" fn(Instance) -> Status;
type EnterInitialization = unsafe extern "C" fn(Instance, bool, f64, f64, bool, f64) -> Status;
type DoStep = unsafe extern "C" fn(
    instance: Instance,
    point: f64,
    step: f64,
    no_set_state_prior: bool,
    event_needed: *mut Flag,
    terminate: *mut Flag,
    early_return: *mut Flag,
    last_time: *mut f64,
) -> Status;
type Get<T> = unsafe extern "C" fn(Instance, *const u32, usize, *mut T, usize) -> Status;
type Set<T> = unsafe extern "C" fn(Instance, *const u32, usize, *const T, usize) -> Status;

const OK: Status = 0;
const WARNING: Status = 1;

/// Messages kept of one instance; more are dropped and counted.
const MOST_MESSAGES: usize = 200;

fn name_of(status: Status) -> &'static str {
    ["OK", "Warning", "Discard", "Error", "Fatal"]
        .get(usize::try_from(status).unwrap_or(usize::MAX))
        .copied()
        .unwrap_or("unknown status")
}

/// A call that did not return OK or Warning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Fault {
    pub(crate) function: &'static str,
    pub(crate) status: &'static str,
    /// Communication point, where there is one [s]
    pub(crate) time: Option<f64>,
}

fn check(function: &'static str, status: Status, time: Option<f64>) -> Result<(), Fault> {
    if status == OK || status == WARNING {
        Ok(())
    } else {
        Err(Fault { function, status: name_of(status), time })
    }
}

/// Why there is no instance.
#[derive(Debug, thiserror::Error)]
pub(crate) enum LoadError {
    #[error("cannot load {path}: {source}")]
    Library { path: PathBuf, source: libloading::Error },
    #[error("{symbol} is missing: {source}")]
    Symbol { symbol: &'static str, source: libloading::Error },
    #[error("text with a zero byte: {0}")]
    ZeroByte(#[from] NulError),
    #[error("no instance was made")]
    Refused { messages: Vec<String> },
}

impl LoadError {
    /// What the FMU said.
    pub(crate) fn messages(&self) -> &[String] {
        if let Self::Refused { messages } = self { messages } else { &[] }
    }

    /// The function to blame.
    pub(crate) fn function(&self) -> &'static str {
        match self {
            Self::Library { .. } | Self::ZeroByte(_) => "load",
            Self::Symbol { symbol, .. } => symbol,
            Self::Refused { .. } => "fmi3InstantiateCoSimulation",
        }
    }
}

/// What the FMU said, in order.
#[derive(Default)]
struct Log {
    messages: RefCell<Vec<String>>,
}

/// Receives the FMU's messages.
unsafe extern "C" fn log_message(
    environment: *mut c_void,
    status: Status,
    category: *const c_char,
    message: *const c_char,
) {
    // SAFETY: the environment is the log given at instantiation; it outlives the instance and belongs to this thread,
    // in which all calls are made.
    let Some(log) = (unsafe { environment.cast::<Log>().as_ref() }) else {
        return;
    };
    let text = |pointer: *const c_char| {
        if pointer.is_null() {
            return "".into();
        }
        // SAFETY: not null, and FMI strings end with a zero byte and live during the call.
        unsafe { CStr::from_ptr(pointer) }.to_string_lossy()
    };
    let Ok(mut messages) = log.messages.try_borrow_mut() else {
        return;
    };
    match messages.len() {
        0..MOST_MESSAGES => {
            messages.push(format!("{} [{}] {}", name_of(status), text(category), text(message)));
        }
        MOST_MESSAGES => messages.push("further messages are left out".into()),
        _ => {}
    }
}

/// The functions in use.
struct Functions {
    free_instance: FreeInstance,
    enter_initialization: EnterInitialization,
    exit_initialization: Simple,
    terminate: Simple,
    reset: Simple,
    do_step: DoStep,
    get_float64: Get<f64>,
    get_int64: Get<i64>,
    set_float64: Set<f64>,
    set_int32: Set<i32>,
    set_int64: Set<i64>,
    set_boolean: Set<bool>,
    set_string: Set<*const c_char>,
}

/// One instance of an FMU; freed, and its library closed, when dropped.
pub(crate) struct Fmi {
    instance: Instance,
    f: Functions,
    log: Box<Log>,
    // last: closed after the instance is freed
    _library: Library,
}

/// Looks up one function; its type is that of the field or variable it goes to.
fn symbol<T: Copy>(library: &Library, symbol: &'static str) -> Result<T, LoadError> {
    // SAFETY: the symbols of an FMI 3.0 library have the types that the standard gives them, which are the ones above;
    // the pointer is used only while the library is open.
    let found = unsafe { library.get::<T>(symbol) };
    found.map(|f| *f).map_err(|source| LoadError::Symbol { symbol, source })
}

impl Fmi {
    /// Loads the library and makes a co-simulation instance without event mode.
    pub(crate) fn instantiate(path: &Path, token: &str, resources: Option<&str>) -> Result<Self, LoadError> {
        // SAFETY: loading runs the library's initialisers; it is the FMU that the caller wants to run.
        let library = unsafe { Library::new(path) }
            .map_err(|source| LoadError::Library { path: path.into(), source })?;
        let l = &library;
        let f = Functions {
            free_instance: symbol(l, "fmi3FreeInstance")?,
            enter_initialization: symbol(l, "fmi3EnterInitializationMode")?,
            exit_initialization: symbol(l, "fmi3ExitInitializationMode")?,
            terminate: symbol(l, "fmi3Terminate")?,
            reset: symbol(l, "fmi3Reset")?,
            do_step: symbol(l, "fmi3DoStep")?,
            get_float64: symbol(l, "fmi3GetFloat64")?,
            get_int64: symbol(l, "fmi3GetInt64")?,
            set_float64: symbol(l, "fmi3SetFloat64")?,
            set_int32: symbol(l, "fmi3SetInt32")?,
            set_int64: symbol(l, "fmi3SetInt64")?,
            set_boolean: symbol(l, "fmi3SetBoolean")?,
            set_string: symbol(l, "fmi3SetString")?,
        };
        let instantiate: Instantiate = symbol(l, "fmi3InstantiateCoSimulation")?;
        let token = CString::new(token)?;
        let resources = resources.map(CString::new).transpose()?;
        let log = Box::<Log>::default();
        // SAFETY: all strings end with a zero byte and live during the call; the log outlives the instance (it is
        // dropped after `drop` has freed it); no intermediate variables are asked for, so there is no callback for them.
        let instance = unsafe {
            instantiate(
                c"instance".as_ptr(),
                token.as_ptr(),
                resources.as_ref().map_or(std::ptr::null(), |r| r.as_ptr()),
                false,
                true,
                false,
                false,
                std::ptr::null(),
                0,
                std::ptr::from_ref::<Log>(&log).cast_mut().cast(),
                Some(log_message),
                None,
            )
        };
        if instance.is_null() {
            return Err(LoadError::Refused { messages: log.messages.take() });
        }
        Ok(Self { instance, f, log, _library: library })
    }

    /// What the FMU has said so far.
    pub(crate) fn messages(&self) -> Vec<String> {
        self.log.messages.borrow().clone()
    }

    /// Sets start values one by one, in their order.
    pub(crate) fn set(&self, values: &[(u32, Value)]) -> Result<(), Fault> {
        for (vr, value) in values {
            match value {
                Value::Float64(value) => self.set_one("fmi3SetFloat64", self.f.set_float64, *vr, value),
                Value::Int32(value) => self.set_one("fmi3SetInt32", self.f.set_int32, *vr, value),
                Value::Int64(value) => self.set_one("fmi3SetInt64", self.f.set_int64, *vr, value),
                Value::Boolean(value) => self.set_one("fmi3SetBoolean", self.f.set_boolean, *vr, value),
                Value::String(value) => {
                    self.set_one("fmi3SetString", self.f.set_string, *vr, &value.as_ptr())
                }
            }?;
        }
        Ok(())
    }

    fn set_one<T>(&self, name: &'static str, set: Set<T>, vr: u32, value: &T) -> Result<(), Fault> {
        // SAFETY: the instance is live; one reference and one value are passed by pointers to them.
        check(name, unsafe { set(self.instance, &raw const vr, 1, value, 1) }, None)
    }

    /// Initialisation mode in and out.
    pub(crate) fn initialise(&self, start: f64, stop: f64) -> Result<(), Fault> {
        // SAFETY: the instance is live.
        let status = unsafe { (self.f.enter_initialization)(self.instance, false, 0.0, start, true, stop) };
        check("fmi3EnterInitializationMode", status, Some(start))?;
        self.simple("fmi3ExitInitializationMode", self.f.exit_initialization, Some(start))
    }

    pub(crate) fn reset(&self) -> Result<(), Fault> {
        self.simple("fmi3Reset", self.f.reset, None)
    }

    pub(crate) fn terminate(&self) -> Result<(), Fault> {
        self.simple("fmi3Terminate", self.f.terminate, None)
    }

    fn simple(&self, name: &'static str, function: Simple, time: Option<f64>) -> Result<(), Fault> {
        // SAFETY: the instance is live.
        check(name, unsafe { function(self.instance) }, time)
    }

    /// One communication step; an FMU that wants to terminate is taken as failed.
    #[inline]
    pub(crate) fn step(&self, t: f64, step: f64) -> Result<(), Fault> {
        let (mut event, mut terminate, mut early) = (0, 0, 0);
        let mut last_time = 0.0;
        // SAFETY: the instance is live; the results are written to variables of their types.
        let status = unsafe {
            (self.f.do_step)(
                self.instance,
                t,
                step,
                true,
                &raw mut event,
                &raw mut terminate,
                &raw mut early,
                &raw mut last_time,
            )
        };
        check("fmi3DoStep", status, Some(t))?;
        if terminate == 0 {
            return Ok(());
        }
        Err(Fault { function: "fmi3DoStep", status: "terminateSimulation", time: Some(t) })
    }

    /// Reads as many values as there are references.
    #[inline]
    pub(crate) fn get_float64(&self, vrs: &[u32], values: &mut [f64]) -> Result<(), Fault> {
        self.get("fmi3GetFloat64", self.f.get_float64, vrs, values)
    }

    /// Reads as many values as there are references.
    pub(crate) fn get_int64(&self, vrs: &[u32], values: &mut [i64]) -> Result<(), Fault> {
        self.get("fmi3GetInt64", self.f.get_int64, vrs, values)
    }

    #[inline]
    fn get<T>(&self, name: &'static str, get: Get<T>, vrs: &[u32], values: &mut [T]) -> Result<(), Fault> {
        assert_eq!(vrs.len(), values.len(), "scalar variables");
        // SAFETY: the instance is live; both pointers are to arrays of the given lengths.
        let status =
            unsafe { get(self.instance, vrs.as_ptr(), vrs.len(), values.as_mut_ptr(), values.len()) };
        check(name, status, None)
    }

    /// Writes as many values as there are references.
    #[inline]
    pub(crate) fn set_float64(&self, vrs: &[u32], values: &[f64]) -> Result<(), Fault> {
        assert_eq!(vrs.len(), values.len(), "scalar variables");
        // SAFETY: the instance is live; both pointers are to arrays of the given lengths.
        let status = unsafe {
            (self.f.set_float64)(self.instance, vrs.as_ptr(), vrs.len(), values.as_ptr(), values.len())
        };
        check("fmi3SetFloat64", status, None)
    }
}

impl Drop for Fmi {
    fn drop(&mut self) {
        // SAFETY: the instance is live and not used after this; library and log are dropped after it.
        unsafe { (self.f.free_instance)(self.instance) }
    }
}
