//! The part of FMI 3.0 that a co-simulation run needs, behind a safe interface.
#![allow(unsafe_code, reason = "calls into a C library; every block states why it is sound")]

use std::ffi::{CString, NulError, c_char};
use std::path::Path;

use fmi_capi::fmi3::{
    DoStep, EnterInitialization, FreeInstance, Get, Instance, InstantiateCoSimulation, Set, Simple,
};
use fmi_capi::{Library, Log, OK, Status, WARNING, log_message, status_name};

use crate::job::Value;

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
        Err(Fault { function, status: status_name(status), time })
    }
}

/// Why there is no instance.
#[derive(Debug, thiserror::Error)]
pub(crate) enum LoadError {
    #[error(transparent)]
    Library(#[from] fmi_capi::LoadError),
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
            Self::Library(fmi_capi::LoadError::Symbol { symbol, .. }) => symbol,
            Self::Library(_) | Self::ZeroByte(_) => "load",
            Self::Refused { .. } => "fmi3InstantiateCoSimulation",
        }
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
    set_boolean: Set<u8>,
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

impl Fmi {
    /// Loads the library and makes a co-simulation instance without event mode.
    pub(crate) fn instantiate(path: &Path, token: &str, resources: Option<&str>) -> Result<Self, LoadError> {
        let l = Library::open(path)?;
        let f = Functions {
            free_instance: l.symbol("fmi3FreeInstance")?,
            enter_initialization: l.symbol("fmi3EnterInitializationMode")?,
            exit_initialization: l.symbol("fmi3ExitInitializationMode")?,
            terminate: l.symbol("fmi3Terminate")?,
            reset: l.symbol("fmi3Reset")?,
            do_step: l.symbol("fmi3DoStep")?,
            get_float64: l.symbol("fmi3GetFloat64")?,
            get_int64: l.symbol("fmi3GetInt64")?,
            set_float64: l.symbol("fmi3SetFloat64")?,
            set_int32: l.symbol("fmi3SetInt32")?,
            set_int64: l.symbol("fmi3SetInt64")?,
            set_boolean: l.symbol("fmi3SetBoolean")?,
            set_string: l.symbol("fmi3SetString")?,
        };
        let instantiate: InstantiateCoSimulation = l.symbol("fmi3InstantiateCoSimulation")?;
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
                0,
                1,
                0,
                0,
                std::ptr::null(),
                0,
                std::ptr::from_ref::<Log>(&log).cast_mut().cast(),
                Some(log_message),
                None,
            )
        };
        if instance.is_null() {
            return Err(LoadError::Refused { messages: log.texts() });
        }
        Ok(Self { instance, f, log, _library: l })
    }

    /// What the FMU has said so far.
    pub(crate) fn messages(&self) -> Vec<String> {
        self.log.texts()
    }

    /// Sets start values one by one, in their order.
    pub(crate) fn set(&self, values: &[(u32, Value)]) -> Result<(), Fault> {
        for (vr, value) in values {
            match value {
                Value::Float64(value) => self.set_one("fmi3SetFloat64", self.f.set_float64, *vr, value),
                Value::Int32(value) => self.set_one("fmi3SetInt32", self.f.set_int32, *vr, value),
                Value::Int64(value) => self.set_one("fmi3SetInt64", self.f.set_int64, *vr, value),
                Value::Boolean(value) => {
                    self.set_one("fmi3SetBoolean", self.f.set_boolean, *vr, &u8::from(*value))
                }
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
        let status = unsafe { (self.f.enter_initialization)(self.instance, 0, 0.0, start, 1, stop) };
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
                1,
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
