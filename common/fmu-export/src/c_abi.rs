//! The C boundary of FMI 3.0: the only module with unsafe code on the export side.
//!
//! Every function of the standard is exported by [`export!`]; each one checks its pointers, catches
//! panics and turns faults into a status with a log message. Nothing else happens here.

#![allow(unsafe_code, reason = "C interface; every block states why it is sound")]
#![allow(non_snake_case, reason = "names of the standard")]
#![allow(clippy::missing_safety_doc, reason = "one contract for all: the pointers follow FMI 3.0")]
#![allow(clippy::too_many_arguments, reason = "signatures of the standard")]

use std::ffi::{CStr, CString, c_char, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};

use model::{Kind, Model};

use crate::phase::{self, Interface, Rule};
use crate::{Fault, Instance, SerialisedStateError, State, Status};

/// `fmi3LogMessageCallback`
pub type LogMessage = unsafe extern "C" fn(*mut c_void, Status, *const c_char, *const c_char);

/// `fmi3Boolean` as it comes over the boundary: any non-zero byte is true.
pub type Bool = u8;

const ERROR_CATEGORY: &CStr = c"logStatusError";
const DISCARD_CATEGORY: &CStr = c"logStatusDiscard";
const WARNING_CATEGORY: &CStr = c"logStatusWarning";
const FATAL_CATEGORY: &CStr = c"logStatusFatal";

/// The log categories with their meaning, as declared in the model description.
pub const LOG_CATEGORIES: [(&CStr, &str); 4] = [
    (WARNING_CATEGORY, "Allowed, but probably not meant"),
    (DISCARD_CATEGORY, "A step or value is refused; nothing has changed and the run may go on"),
    (ERROR_CATEGORY, "A wrong call, or parameters that do not fit together"),
    (FATAL_CATEGORY, "Internal error; the instance is lost"),
];

/// Where messages go. Messages about refusals are always sent; a list of categories filters them.
struct Log {
    environment: *mut c_void,
    callback: Option<LogMessage>,
    categories: Option<Vec<CString>>,
}

impl Log {
    fn send(&self, status: Status, category: &CStr, message: &str) {
        let Some(callback) = self.callback else { return };
        if let Some(chosen) = &self.categories
            && !chosen.iter().any(|c| c.as_c_str() == category)
        {
            return;
        }
        let text = CString::new(message.replace('\0', " ")).unwrap_or_default();
        // SAFETY: the host gave this callback together with its environment pointer; both strings
        // are null-terminated and live until the call returns.
        unsafe { callback(self.environment, status, category.as_ptr(), text.as_ptr()) }
    }

    fn fault(&self, function: &str, fault: &Fault) {
        let status = fault.status();
        let category = match status {
            Status::Discard => DISCARD_CATEGORY,
            Status::Fatal => FATAL_CATEGORY,
            _ => ERROR_CATEGORY,
        };
        self.send(status, category, &format!("{function}: {fault}"));
    }
}

/// What an `fmi3Instance` points to.
struct Component<M: Model> {
    instance: Instance<M>,
    log: Log,
}

/// Run `body` on the instance: null check, phase rule, panic barrier, message, status.
///
/// # Safety
/// `instance` is null or came from [`instantiate`] and was not freed.
unsafe fn call<M: Model>(
    instance: *mut c_void,
    rule: &Rule,
    body: impl FnOnce(&mut Component<M>) -> Result<(), Fault>,
) -> Status {
    // SAFETY: by the contract of this function; FMI forbids concurrent calls on one instance.
    let Some(component) = (unsafe { instance.cast::<Component<M>>().as_mut() }) else {
        return Status::Error;
    };
    let result = catch_unwind(AssertUnwindSafe(|| {
        component.instance.enter(rule)?;
        body(component)
    }));
    let fault = match result {
        Ok(Ok(())) => return Status::Ok,
        Ok(Err(fault)) => fault,
        Err(panic) => {
            component.instance.break_down();
            let message = panic
                .downcast_ref::<&str>()
                .map(ToString::to_string)
                .or_else(|| panic.downcast_ref::<String>().cloned())
                .unwrap_or_else(|| "panic".into());
            Fault::Panic { message }
        }
    };
    component.log.fault(rule.function, &fault);
    fault.status()
}

/// The data behind a C array; null is an empty array if `n` is 0.
///
/// # Safety
/// `pointer` is null or points to `n` values that live and do not change during the call.
unsafe fn array<'a, T>(argument: &'static str, pointer: *const T, n: usize) -> Result<&'a [T], Fault> {
    if n == 0 {
        return Ok(&[]);
    }
    if pointer.is_null() {
        return Err(Fault::Null { argument });
    }
    // SAFETY: not null; the rest by the contract of this function.
    Ok(unsafe { std::slice::from_raw_parts(pointer, n) })
}

/// The same, to be written.
///
/// # Safety
/// As [`array`], and nothing else refers to the values.
unsafe fn array_mut<'a, T>(argument: &'static str, pointer: *mut T, n: usize) -> Result<&'a mut [T], Fault> {
    if n == 0 {
        return Ok(&mut []);
    }
    if pointer.is_null() {
        return Err(Fault::Null { argument });
    }
    // SAFETY: not null; the rest by the contract of this function.
    Ok(unsafe { std::slice::from_raw_parts_mut(pointer, n) })
}

/// Text of a C string; null and invalid UTF-8 give replacement text.
///
/// # Safety
/// `pointer` is null or points to a null-terminated string.
unsafe fn text(pointer: *const c_char) -> String {
    if pointer.is_null() {
        return String::new();
    }
    // SAFETY: not null; the rest by the contract of this function.
    unsafe { CStr::from_ptr(pointer) }.to_string_lossy().into_owned()
}

#[doc(hidden)]
#[must_use]
pub fn fmi3GetVersion() -> *const c_char {
    c"3.0".as_ptr()
}

/// A new instance, or null with a message.
///
/// # Safety
/// The token is null or a null-terminated string; callback and environment as FMI defines them.
unsafe fn instantiate<M: Model>(
    function: &str,
    interface: Interface,
    token: *const c_char,
    environment: *mut c_void,
    log_message: Option<LogMessage>,
) -> *mut c_void {
    let log = Log { environment, callback: log_message, categories: None };
    let refuse = |message: &str| {
        log.send(Status::Error, ERROR_CATEGORY, &format!("{function}: {message}"));
        std::ptr::null_mut()
    };
    let created = catch_unwind(|| {
        // SAFETY: by the contract of this function.
        let (given, expected) = (unsafe { text(token) }, Instance::<M>::token());
        if given != expected {
            return Err(format!("instantiationToken is \"{given}\"; this binary belongs to \"{expected}\""));
        }
        if interface == Interface::ModelExchange && !M::MODEL_EXCHANGE {
            return Err("Model Exchange is not supported: this is a Co-Simulation FMU".into());
        }
        Ok(Instance::<M>::with_interface(interface))
    });
    match created {
        Ok(Ok(instance)) => Box::into_raw(Box::new(Component { instance, log })).cast(),
        Ok(Err(message)) => refuse(&message),
        Err(_) => refuse("internal error"),
    }
}

#[doc(hidden)]
pub unsafe fn fmi3InstantiateCoSimulation<M: Model>(
    token: *const c_char,
    event_mode_used: Bool,
    environment: *mut c_void,
    log_message: Option<LogMessage>,
) -> *mut c_void {
    let interface =
        if event_mode_used == 0 { Interface::CoSimulation } else { Interface::CoSimulationWithEvents };
    // SAFETY: the arguments as the host passes them.
    unsafe { instantiate::<M>("fmi3InstantiateCoSimulation", interface, token, environment, log_message) }
}

#[doc(hidden)]
pub unsafe fn fmi3InstantiateModelExchange<M: Model>(
    token: *const c_char,
    environment: *mut c_void,
    log_message: Option<LogMessage>,
) -> *mut c_void {
    // SAFETY: the arguments as the host passes them.
    unsafe {
        instantiate::<M>(
            "fmi3InstantiateModelExchange",
            Interface::ModelExchange,
            token,
            environment,
            log_message,
        )
    }
}

#[doc(hidden)]
pub unsafe fn refuse_instance(
    function: &str,
    reason: &str,
    environment: *mut c_void,
    log_message: Option<LogMessage>,
) -> *mut c_void {
    let log = Log { environment, callback: log_message, categories: None };
    log.send(Status::Error, ERROR_CATEGORY, &format!("{function} is not supported: {reason}"));
    std::ptr::null_mut()
}

#[doc(hidden)]
pub unsafe fn fmi3FreeInstance<M: Model>(instance: *mut c_void) {
    if !instance.is_null() {
        // SAFETY: not null, created by `Box::into_raw` above, freed once (FMI).
        let component = unsafe { Box::from_raw(instance.cast::<Component<M>>()) };
        let _ = catch_unwind(AssertUnwindSafe(|| drop(component)));
    }
}

#[doc(hidden)]
pub unsafe fn fmi3SetDebugLogging<M: Model>(
    instance: *mut c_void,
    logging_on: Bool,
    n: usize,
    categories: *const *const c_char,
) -> Status {
    // SAFETY: FMI pointers, checked for null by `call` and `array`.
    unsafe {
        call::<M>(instance, &phase::SET_DEBUG_LOGGING, |c| {
            let names = array("categories", categories, n)?;
            let mut chosen = Vec::with_capacity(n);
            for name in names {
                let name = text(*name);
                let Some((category, _)) =
                    LOG_CATEGORIES.iter().find(|(c, _)| c.to_bytes() == name.as_bytes())
                else {
                    return Err(Fault::Unsupported {
                        function: "this log category",
                        reason: "see LogCategories in the model description",
                    });
                };
                chosen.push(CString::from(*category));
            }
            c.log.categories = (logging_on != 0 && n > 0).then_some(chosen);
            Ok(())
        })
    }
}

#[doc(hidden)]
pub unsafe fn fmi3EnterInitializationMode<M: Model>(
    instance: *mut c_void,
    start: f64,
    stop_defined: Bool,
    stop: f64,
) -> Status {
    // SAFETY: FMI instance, checked for null by `call`; the same for the functions below.
    unsafe {
        call::<M>(instance, &phase::ENTER_INITIALIZATION, |c| {
            c.instance.enter_initialization(start, (stop_defined != 0).then_some(stop))
        })
    }
}

#[doc(hidden)]
pub unsafe fn fmi3ExitInitializationMode<M: Model>(instance: *mut c_void) -> Status {
    let mut warned = false;
    // SAFETY: see above.
    let status = unsafe {
        call::<M>(instance, &phase::EXIT_INITIALIZATION, |c| {
            c.instance.exit_initialization()?;
            for warning in c.instance.take_warnings() {
                c.log.send(Status::Warning, WARNING_CATEGORY, &warning);
                warned = true;
            }
            Ok(())
        })
    };
    if status == Status::Ok && warned { Status::Warning } else { status }
}

#[doc(hidden)]
pub unsafe fn fmi3Terminate<M: Model>(instance: *mut c_void) -> Status {
    // SAFETY: see above.
    unsafe {
        call::<M>(instance, &phase::TERMINATE, |c| {
            c.instance.terminate();
            Ok(())
        })
    }
}

#[doc(hidden)]
pub unsafe fn fmi3Reset<M: Model>(instance: *mut c_void) -> Status {
    // SAFETY: see above.
    unsafe {
        call::<M>(instance, &phase::RESET, |c| {
            c.instance.reset();
            Ok(())
        })
    }
}

#[doc(hidden)]
pub unsafe fn fmi3DoStep<M: Model>(
    instance: *mut c_void,
    t: f64,
    step: f64,
    event_handling_needed: *mut Bool,
    terminate_simulation: *mut Bool,
    early_return: *mut Bool,
    last_successful_time: *mut f64,
) -> Status {
    // SAFETY: FMI pointers, checked for null by `call` and `array_mut`.
    unsafe {
        call::<M>(instance, &phase::DO_STEP, |c| {
            let flags = [
                ("eventHandlingNeeded", event_handling_needed),
                ("terminateSimulation", terminate_simulation),
                ("earlyReturn", early_return),
            ];
            for (argument, flag) in flags {
                array_mut(argument, flag, 1)?[0] = 0;
            }
            let last = &mut array_mut("lastSuccessfulTime", last_successful_time, 1)?[0];
            *last = c.instance.time();
            let event = c.instance.do_step(t, step)?;
            *last = c.instance.time();
            if event {
                array_mut("eventHandlingNeeded", event_handling_needed, 1)?[0] = 1;
            }
            Ok(())
        })
    }
}

/// Functions without arguments.
macro_rules! transitions {
    ($($name:ident $rule:ident $method:ident;)*) => {
        $(
            #[doc(hidden)]
            pub unsafe fn $name<M: Model>(instance: *mut c_void) -> Status {
                // SAFETY: FMI instance, checked for null by `call`.
                unsafe { call::<M>(instance, &phase::$rule, |c| c.instance.$method()) }
            }
        )*
    };
}
transitions! {
    fmi3EnterEventMode ENTER_EVENT_MODE enter_event_mode;
    fmi3EnterStepMode ENTER_STEP_MODE enter_step_mode;
    fmi3EnterContinuousTimeMode ENTER_CONTINUOUS_TIME_MODE enter_continuous_time_mode;
}

#[doc(hidden)]
pub unsafe fn fmi3UpdateDiscreteStates<M: Model>(
    instance: *mut c_void,
    need_update: *mut Bool,
    terminate: *mut Bool,
    nominals_changed: *mut Bool,
    values_changed: *mut Bool,
    next_event_defined: *mut Bool,
    next_event: *mut f64,
) -> Status {
    // SAFETY: FMI pointers, checked for null by `call` and `array_mut`.
    unsafe {
        call::<M>(instance, &phase::UPDATE_DISCRETE_STATES, |c| {
            let flags = [
                ("discreteStatesNeedUpdate", need_update),
                ("terminateSimulation", terminate),
                ("nominalsOfContinuousStatesChanged", nominals_changed),
                ("valuesOfContinuousStatesChanged", values_changed),
                ("nextEventTimeDefined", next_event_defined),
            ];
            for (argument, flag) in flags {
                array_mut(argument, flag, 1)?[0] = 0;
            }
            let next = &mut array_mut("nextEventTime", next_event, 1)?[0];
            let event = c.instance.update_discrete_states()?;
            let set = |(argument, flag), value: bool| -> Result<(), Fault> {
                array_mut(argument, flag, 1)?[0] = u8::from(value);
                Ok(())
            };
            set(flags[0], event.again)?;
            set(flags[3], event.states_changed)?;
            set(flags[4], event.next.is_some())?;
            if let Some(t) = event.next {
                *next = t;
            }
            Ok(())
        })
    }
}

#[doc(hidden)]
pub unsafe fn fmi3CompletedIntegratorStep<M: Model>(
    instance: *mut c_void,
    _no_set_state_prior: Bool,
    enter_event_mode: *mut Bool,
    terminate: *mut Bool,
) -> Status {
    // SAFETY: FMI pointers, checked for null by `call` and `array_mut`.
    unsafe {
        call::<M>(instance, &phase::COMPLETED_INTEGRATOR_STEP, |c| {
            array_mut("terminateSimulation", terminate, 1)?[0] = 0;
            let event = &mut array_mut("enterEventMode", enter_event_mode, 1)?[0];
            *event = u8::from(c.instance.completed_integrator_step()?);
            Ok(())
        })
    }
}

#[doc(hidden)]
pub unsafe fn fmi3SetTime<M: Model>(instance: *mut c_void, t: f64) -> Status {
    // SAFETY: FMI instance, checked for null by `call`.
    unsafe { call::<M>(instance, &phase::SET_TIME, |c| c.instance.set_time(t)) }
}

#[doc(hidden)]
pub unsafe fn fmi3SetContinuousStates<M: Model>(
    instance: *mut c_void,
    states: *const f64,
    n: usize,
) -> Status {
    // SAFETY: FMI pointers, checked for null.
    unsafe {
        call::<M>(instance, &phase::SET_CONTINUOUS_STATES, |c| {
            c.instance.set_continuous_states(array("continuousStates", states, n)?)
        })
    }
}

/// Functions that fill one list of numbers.
macro_rules! lists {
    ($($name:ident $rule:ident $method:ident;)*) => {
        $(
            #[doc(hidden)]
            pub unsafe fn $name<M: Model>(instance: *mut c_void, values: *mut f64, n: usize) -> Status {
                // SAFETY: FMI pointers, checked for null.
                unsafe {
                    call::<M>(instance, &phase::$rule, |c| {
                        c.instance.$method(array_mut("values", values, n)?)
                    })
                }
            }
        )*
    };
}
lists! {
    fmi3GetContinuousStates GET_CONTINUOUS_STATES get_continuous_states;
    fmi3GetContinuousStateDerivatives GET_DERIVATIVES get_derivatives;
    fmi3GetNominalsOfContinuousStates GET_NOMINALS get_nominals;
    fmi3GetEventIndicators GET_INDICATORS get_indicators;
}

/// Functions that give one count.
macro_rules! counts {
    ($($name:ident $rule:ident $method:ident;)*) => {
        $(
            #[doc(hidden)]
            pub unsafe fn $name<M: Model>(instance: *mut c_void, n: *mut usize) -> Status {
                // SAFETY: FMI pointers, checked for null.
                unsafe {
                    call::<M>(instance, &phase::$rule, |c| {
                        array_mut("count", n, 1)?[0] = c.instance.$method();
                        Ok(())
                    })
                }
            }
        )*
    };
}
counts! {
    fmi3GetNumberOfContinuousStates COUNT_STATES state_count;
    fmi3GetNumberOfEventIndicators COUNT_INDICATORS indicator_count;
}

#[doc(hidden)]
pub unsafe fn fmi3GetFloat64<M: Model>(
    instance: *mut c_void,
    references: *const u32,
    n: usize,
    values: *mut f64,
    n_values: usize,
) -> Status {
    // SAFETY: FMI pointers, checked for null.
    unsafe {
        call::<M>(instance, &phase::GET_FLOAT64, |c| {
            let references = array("valueReferences", references, n)?;
            c.instance.get_float64(references, array_mut("values", values, n_values)?)
        })
    }
}

#[doc(hidden)]
pub unsafe fn fmi3SetFloat64<M: Model>(
    instance: *mut c_void,
    references: *const u32,
    n: usize,
    values: *const f64,
    n_values: usize,
) -> Status {
    // SAFETY: FMI pointers, checked for null.
    unsafe {
        call::<M>(instance, &phase::SET_FLOAT64, |c| {
            let (references, values) =
                (array("valueReferences", references, n)?, array("values", values, n_values)?);
            crate::values::same_length(n, n_values)?;
            c.instance.set(references, "Float64", |k| k == Kind::Float64, |i| values[i])
        })
    }
}

/// Get and Set of a type whose values are stored as whole numbers.
macro_rules! whole_number_access {
    ($get:ident $get_rule:ident $set:ident $set_rule:ident $c_type:ty, $called:literal, $is:pat, $from:expr, $to:expr) => {
        #[doc(hidden)]
        pub unsafe fn $get<M: Model>(
            instance: *mut c_void,
            references: *const u32,
            n: usize,
            values: *mut $c_type,
            n_values: usize,
        ) -> Status {
            // SAFETY: FMI pointers, checked for null.
            unsafe {
                call::<M>(instance, &phase::$get_rule, |c| {
                    let references = array("valueReferences", references, n)?;
                    let values = array_mut("values", values, n_values)?;
                    crate::values::same_length(n, n_values)?;
                    let to: fn(f64) -> $c_type = $to;
                    c.instance.get_whole(references, $called, |k| matches!(k, $is), |i, v| values[i] = to(v))
                })
            }
        }

        #[doc(hidden)]
        pub unsafe fn $set<M: Model>(
            instance: *mut c_void,
            references: *const u32,
            n: usize,
            values: *const $c_type,
            n_values: usize,
        ) -> Status {
            // SAFETY: FMI pointers, checked for null.
            unsafe {
                call::<M>(instance, &phase::$set_rule, |c| {
                    let references = array("valueReferences", references, n)?;
                    let values = array("values", values, n_values)?;
                    crate::values::same_length(n, n_values)?;
                    let from: fn($c_type) -> f64 = $from;
                    c.instance.set(references, $called, |k| matches!(k, $is), |i| from(values[i]))
                })
            }
        }
    };
}

#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    reason = "stored values are whole and below 2^53"
)]
mod whole {
    use super::{Bool, Kind, Model, Status, array, array_mut, c_void, call, phase};
    whole_number_access!(fmi3GetInt64 GET_INT64 fmi3SetInt64 SET_INT64 i64, "Int64", Kind::Int64 | Kind::Enumeration(_), |v| v as f64, |v| v as i64);
    whole_number_access!(fmi3GetInt32 GET_INT32 fmi3SetInt32 SET_INT32 i32, "Int32", Kind::Int32, f64::from, |v| v as i32);
    whole_number_access!(fmi3GetBoolean GET_BOOLEAN fmi3SetBoolean SET_BOOLEAN Bool, "Boolean", Kind::Boolean, |v| f64::from(u8::from(v != 0)), |v| u8::from(v > 0.5));
}
#[doc(hidden)]
pub use whole::*;

/// Get or Set of a type of which there are no variables: right for none, an error for any.
#[doc(hidden)]
pub unsafe fn no_variables<M: Model>(
    instance: *mut c_void,
    get: bool,
    called: &'static str,
    references: *const u32,
    n: usize,
) -> Status {
    let rule = if get { &phase::GET_OTHER } else { &phase::SET_OTHER };
    // SAFETY: FMI pointers, checked for null.
    unsafe {
        call::<M>(instance, rule, |c| {
            let references = array("valueReferences", references, n)?;
            c.instance.get_whole(references, called, |_| false, |_, _| {})
        })
    }
}

/// A function that this FMU does not declare.
#[doc(hidden)]
pub unsafe fn unsupported<M: Model>(
    instance: *mut c_void,
    function: &'static str,
    reason: &'static str,
) -> Status {
    // SAFETY: FMI instance, checked for null by `call`.
    unsafe { call::<M>(instance, &phase::UNSUPPORTED, |_| Err(Fault::Unsupported { function, reason })) }
}

#[doc(hidden)]
pub unsafe fn fmi3GetFMUState<M: Model>(instance: *mut c_void, state: *mut *mut c_void) -> Status {
    // SAFETY: FMI pointers, checked for null; a state that is not null came from this function.
    unsafe {
        call::<M>(instance, &phase::GET_FMU_STATE, |c| {
            let slot = &mut array_mut("FMUState", state, 1)?[0];
            match slot.cast::<State<M>>().as_mut() {
                Some(copy) => c.instance.save_into(copy),
                None => *slot = Box::into_raw(c.instance.save()).cast(),
            }
            Ok(())
        })
    }
}

#[doc(hidden)]
pub unsafe fn fmi3SetFMUState<M: Model>(instance: *mut c_void, state: *mut c_void) -> Status {
    // SAFETY: a state that is not null came from `fmi3GetFMUState` and was not freed (FMI).
    unsafe { call::<M>(instance, &phase::SET_FMU_STATE, |c| c.instance.restore(saved::<M>(state)?)) }
}

/// A saved state.
///
/// # Safety
/// `state` is null or a state that was given out and not freed.
unsafe fn saved<'a, M: Model>(state: *mut c_void) -> Result<&'a State<M>, Fault> {
    // SAFETY: by the contract of this function.
    unsafe { state.cast::<State<M>>().as_ref() }.ok_or(Fault::Null { argument: "FMUState" })
}

#[doc(hidden)]
pub unsafe fn fmi3FreeFMUState<M: Model>(instance: *mut c_void, state: *mut *mut c_void) -> Status {
    // SAFETY: a state that is not null came from `Box::into_raw` in `fmi3GetFMUState`.
    unsafe {
        call::<M>(instance, &phase::FREE_FMU_STATE, |_| {
            let slot = &mut array_mut("FMUState", state, 1)?[0];
            if !slot.is_null() {
                drop(Box::from_raw(slot.cast::<State<M>>()));
                *slot = std::ptr::null_mut();
            }
            Ok(())
        })
    }
}

#[doc(hidden)]
pub unsafe fn fmi3SerializedFMUStateSize<M: Model>(
    instance: *mut c_void,
    state: *mut c_void,
    size: *mut usize,
) -> Status {
    // SAFETY: FMI pointers, checked for null; a state that is not null is one of ours (FMI).
    unsafe {
        call::<M>(instance, &phase::SERIALISED_SIZE, |c| {
            let saved = saved::<M>(state)?;
            array_mut("size", size, 1)?[0] = c.instance.serialise(saved)?.len();
            Ok(())
        })
    }
}

#[doc(hidden)]
pub unsafe fn fmi3SerializeFMUState<M: Model>(
    instance: *mut c_void,
    state: *mut c_void,
    data: *mut u8,
    size: usize,
) -> Status {
    // SAFETY: FMI pointers, checked for null; a state that is not null is one of ours (FMI).
    unsafe {
        call::<M>(instance, &phase::SERIALISE, |c| {
            let bytes = c.instance.serialise(saved::<M>(state)?)?;
            if size != bytes.len() {
                return Err(SerialisedStateError::length(size, bytes.len()).into());
            }
            array_mut("serializedState", data, size)?.copy_from_slice(&bytes);
            Ok(())
        })
    }
}

#[doc(hidden)]
pub unsafe fn fmi3DeserializeFMUState<M: Model>(
    instance: *mut c_void,
    data: *const u8,
    size: usize,
    state: *mut *mut c_void,
) -> Status {
    // SAFETY: FMI pointers, checked for null.
    unsafe {
        call::<M>(instance, &phase::DESERIALISE, |c| {
            let slot = &mut array_mut("FMUState", state, 1)?[0];
            *slot = Box::into_raw(c.instance.deserialise(array("serializedState", data, size)?)?).cast();
            Ok(())
        })
    }
}

#[doc(hidden)]
pub unsafe fn fmi3GetDirectionalDerivative<M: Model>(
    instance: *mut c_void,
    unknowns: *const u32,
    n_unknowns: usize,
    knowns: *const u32,
    n_knowns: usize,
    seed: *const f64,
    n_seed: usize,
    sensitivity: *mut f64,
    n_sensitivity: usize,
) -> Status {
    // SAFETY: FMI pointers, checked for null.
    unsafe {
        call::<M>(instance, &phase::DIRECTIONAL_DERIVATIVE, |c| {
            let unknowns = array("unknowns", unknowns, n_unknowns)?;
            let knowns = array("knowns", knowns, n_knowns)?;
            let seed = array("seed", seed, n_seed)?;
            c.instance.directional_derivative(
                unknowns,
                knowns,
                seed,
                array_mut("sensitivity", sensitivity, n_sensitivity)?,
            )
        })
    }
}

#[doc(hidden)]
pub unsafe fn fmi3GetNumberOfVariableDependencies<M: Model>(
    instance: *mut c_void,
    reference: u32,
    n: *mut usize,
) -> Status {
    // SAFETY: FMI pointers, checked for null.
    unsafe {
        call::<M>(instance, &phase::DEPENDENCIES, |c| {
            array_mut("nDependencies", n, 1)?[0] = c.instance.dependencies(reference)?.len();
            Ok(())
        })
    }
}

#[doc(hidden)]
pub unsafe fn fmi3GetVariableDependencies<M: Model>(
    instance: *mut c_void,
    dependent: u32,
    elements_of_dependent: *mut usize,
    independents: *mut u32,
    elements_of_independents: *mut usize,
    kinds: *mut i32,
    n: usize,
) -> Status {
    /// `fmi3Dependent`
    const DEPENDENT: i32 = 4;
    // SAFETY: FMI pointers, checked for null.
    unsafe {
        call::<M>(instance, &phase::DEPENDENCIES, |c| {
            let found = c.instance.dependencies(dependent)?;
            crate::values::same_length(found.len(), n)?;
            array_mut("elementIndicesOfDependent", elements_of_dependent, n)?.fill(0);
            array_mut("elementIndicesOfIndependents", elements_of_independents, n)?.fill(0);
            array_mut("dependencyKinds", kinds, n)?.fill(DEPENDENT);
            for (slot, i) in array_mut("independents", independents, n)?.iter_mut().zip(found) {
                *slot = u32::try_from(i).unwrap_or(u32::MAX);
            }
            Ok(())
        })
    }
}

/// Export a model: all functions of FMI 3.0 with the model behind them.
///
/// The whole text of an FMU crate: `fmu_export::export!(models::suspension::DoubleWishbone);`
#[macro_export]
macro_rules! export {
    ($model:ty) => {
        $crate::functions! { $model,
            // inquire and log
            fmi3SetDebugLogging(logging_on: u8, n: usize, categories: *const *const c_char);
            // initialise, reset, end
            fmi3ExitInitializationMode();
            fmi3Terminate();
            fmi3Reset();
            // events
            fmi3EnterEventMode();
            fmi3UpdateDiscreteStates(need_update: *mut u8, terminate: *mut u8, nominals_changed: *mut u8, values_changed: *mut u8, next_event_defined: *mut u8, next_event: *mut f64);
            fmi3EnterStepMode();
            // Model Exchange
            fmi3EnterContinuousTimeMode();
            fmi3CompletedIntegratorStep(no_set_state_prior: u8, enter_event_mode: *mut u8, terminate: *mut u8);
            fmi3SetTime(time: f64);
            fmi3SetContinuousStates(states: *const f64, n: usize);
            fmi3GetContinuousStates(states: *mut f64, n: usize);
            fmi3GetContinuousStateDerivatives(derivatives: *mut f64, n: usize);
            fmi3GetNominalsOfContinuousStates(nominals: *mut f64, n: usize);
            fmi3GetEventIndicators(indicators: *mut f64, n: usize);
            fmi3GetNumberOfContinuousStates(n: *mut usize);
            fmi3GetNumberOfEventIndicators(n: *mut usize);
            // values
            fmi3GetFloat64(vr: *const u32, n: usize, values: *mut f64, n_values: usize);
            fmi3GetInt32(vr: *const u32, n: usize, values: *mut i32, n_values: usize);
            fmi3GetInt64(vr: *const u32, n: usize, values: *mut i64, n_values: usize);
            fmi3GetBoolean(vr: *const u32, n: usize, values: *mut u8, n_values: usize);
            fmi3SetFloat64(vr: *const u32, n: usize, values: *const f64, n_values: usize);
            fmi3SetInt32(vr: *const u32, n: usize, values: *const i32, n_values: usize);
            fmi3SetInt64(vr: *const u32, n: usize, values: *const i64, n_values: usize);
            fmi3SetBoolean(vr: *const u32, n: usize, values: *const u8, n_values: usize);
            // structure and derivatives
            fmi3GetNumberOfVariableDependencies(vr: u32, n: *mut usize);
            fmi3GetVariableDependencies(dependent: u32, i_dependent: *mut usize, independents: *mut u32, i_independents: *mut usize, kinds: *mut i32, n: usize);
            fmi3GetDirectionalDerivative(unknowns: *const u32, n_unknowns: usize, knowns: *const u32, n_knowns: usize, seed: *const f64, n_seed: usize, sensitivity: *mut f64, n_sensitivity: usize);
            // state
            fmi3GetFMUState(state: *mut *mut c_void);
            fmi3SetFMUState(state: *mut c_void);
            fmi3FreeFMUState(state: *mut *mut c_void);
            fmi3SerializedFMUStateSize(state: *mut c_void, size: *mut usize);
            fmi3SerializeFMUState(state: *mut c_void, data: *mut u8, size: usize);
            fmi3DeserializeFMUState(data: *const u8, size: usize, state: *mut *mut c_void);
        }
        $crate::no_variables! { $model,
            fmi3GetFloat32 "Float32" true *mut f32; fmi3GetInt8 "Int8" true *mut i8; fmi3GetUInt8 "UInt8" true *mut u8;
            fmi3GetInt16 "Int16" true *mut i16; fmi3GetUInt16 "UInt16" true *mut u16; fmi3GetUInt32 "UInt32" true *mut u32;
            fmi3GetUInt64 "UInt64" true *mut u64; fmi3GetString "String" true *mut *const c_char;
            fmi3SetFloat32 "Float32" false *const f32; fmi3SetInt8 "Int8" false *const i8; fmi3SetUInt8 "UInt8" false *const u8;
            fmi3SetInt16 "Int16" false *const i16; fmi3SetUInt16 "UInt16" false *const u16; fmi3SetUInt32 "UInt32" false *const u32;
            fmi3SetUInt64 "UInt64" false *const u64; fmi3SetString "String" false *const *const c_char;
        }
        $crate::unsupported! { $model,
            "there are no Binary variables":
            fmi3GetBinary(vr: *const u32, n: usize, sizes: *mut usize, values: *mut *const u8, n_values: usize);
            fmi3SetBinary(vr: *const u32, n: usize, sizes: *const usize, values: *const *const u8, n_values: usize);
            "there are no clocks":
            fmi3GetClock(vr: *const u32, n: usize, values: *mut u8);
            fmi3SetClock(vr: *const u32, n: usize, values: *const u8);
            fmi3GetIntervalDecimal(vr: *const u32, n: usize, intervals: *mut f64, qualifiers: *mut i32);
            fmi3GetIntervalFraction(vr: *const u32, n: usize, counters: *mut u64, resolutions: *mut u64, qualifiers: *mut i32);
            fmi3GetShiftDecimal(vr: *const u32, n: usize, shifts: *mut f64);
            fmi3GetShiftFraction(vr: *const u32, n: usize, counters: *mut u64, resolutions: *mut u64);
            fmi3SetIntervalDecimal(vr: *const u32, n: usize, intervals: *const f64);
            fmi3SetIntervalFraction(vr: *const u32, n: usize, counters: *const u64, resolutions: *const u64);
            fmi3SetShiftDecimal(vr: *const u32, n: usize, shifts: *const f64);
            fmi3SetShiftFraction(vr: *const u32, n: usize, counters: *const u64, resolutions: *const u64);
            fmi3EvaluateDiscreteStates();
            fmi3ActivateModelPartition(clock: u32, time: f64);
            "there are no structural parameters":
            fmi3EnterConfigurationMode();
            fmi3ExitConfigurationMode();
            "adjoint derivatives are not declared":
            fmi3GetAdjointDerivative(unknowns: *const u32, n_unknowns: usize, knowns: *const u32, n_knowns: usize, seed: *const f64, n_seed: usize, sensitivity: *mut f64, n_sensitivity: usize);
            "output derivatives are not declared":
            fmi3GetOutputDerivatives(vr: *const u32, n: usize, orders: *const i32, values: *mut f64, n_values: usize);
        }

        #[allow(unsafe_code, non_snake_case, missing_docs, unused_variables, clippy::too_many_arguments, clippy::missing_safety_doc, reason = "C interface of FMI 3.0")]
        mod fmi3_lifecycle {
            use std::ffi::{c_char, c_void};
            use $crate::{Status, c_abi};

            #[unsafe(no_mangle)]
            pub extern "C" fn fmi3GetVersion() -> *const c_char {
                c_abi::fmi3GetVersion()
            }
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmi3InstantiateCoSimulation(
                name: *const c_char, token: *const c_char, resources: *const c_char, visible: u8, logging_on: u8,
                event_mode_used: u8, early_return_allowed: u8, intermediate: *const u32, n_intermediate: usize,
                environment: *mut c_void, log_message: Option<c_abi::LogMessage>, intermediate_update: *const c_void,
            ) -> *mut c_void {
                // SAFETY: the arguments as the host passes them.
                unsafe { c_abi::fmi3InstantiateCoSimulation::<$model>(token, event_mode_used, environment, log_message) }
            }
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmi3InstantiateModelExchange(
                name: *const c_char, token: *const c_char, resources: *const c_char, visible: u8, logging_on: u8,
                environment: *mut c_void, log_message: Option<c_abi::LogMessage>,
            ) -> *mut c_void {
                // SAFETY: the arguments as the host passes them.
                unsafe { c_abi::fmi3InstantiateModelExchange::<$model>(token, environment, log_message) }
            }
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmi3InstantiateScheduledExecution(
                name: *const c_char, token: *const c_char, resources: *const c_char, visible: u8, logging_on: u8,
                environment: *mut c_void, log_message: Option<c_abi::LogMessage>, clock_update: *const c_void,
                lock_preemption: *const c_void, unlock_preemption: *const c_void,
            ) -> *mut c_void {
                // SAFETY: the arguments as the host passes them.
                unsafe { c_abi::refuse_instance("fmi3InstantiateScheduledExecution", "there are no clocks", environment, log_message) }
            }
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmi3FreeInstance(instance: *mut c_void) {
                // SAFETY: the instance as the host passes it.
                unsafe { c_abi::fmi3FreeInstance::<$model>(instance) }
            }
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmi3EnterInitializationMode(
                instance: *mut c_void, tolerance_defined: u8, tolerance: f64, start: f64, stop_defined: u8, stop: f64,
            ) -> Status {
                // SAFETY: the arguments as the host passes them.
                unsafe { c_abi::fmi3EnterInitializationMode::<$model>(instance, start, stop_defined, stop) }
            }
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmi3DoStep(
                instance: *mut c_void, t: f64, step: f64, no_set_state_prior: u8, event_handling_needed: *mut u8,
                terminate: *mut u8, early_return: *mut u8, last_successful_time: *mut f64,
            ) -> Status {
                // SAFETY: the arguments as the host passes them.
                unsafe { c_abi::fmi3DoStep::<$model>(instance, t, step, event_handling_needed, terminate, early_return, last_successful_time) }
            }
        }
    };
}

/// Exported functions that hand all their arguments to the function of the same name here.
#[doc(hidden)]
#[macro_export]
macro_rules! functions {
    ($model:ty, $($name:ident($($arg:ident: $type:ty),*);)*) => {
        #[allow(unsafe_code, non_snake_case, missing_docs, clippy::too_many_arguments, clippy::missing_safety_doc, reason = "C interface of FMI 3.0")]
        mod fmi3_functions {
            use std::ffi::{c_char, c_void};
            use $crate::{Status, c_abi};
            $(
                #[unsafe(no_mangle)]
                pub unsafe extern "C" fn $name(instance: *mut c_void, $($arg: $type),*) -> Status {
                    // SAFETY: the arguments as the host passes them.
                    unsafe { c_abi::$name::<$model>(instance, $($arg),*) }
                }
            )*
        }
    };
}

/// Exported Get and Set functions of types without variables.
#[doc(hidden)]
#[macro_export]
macro_rules! no_variables {
    ($model:ty, $($name:ident $called:literal $get:literal $type:ty;)*) => {
        #[allow(unsafe_code, non_snake_case, missing_docs, unused_variables, clippy::missing_safety_doc, reason = "C interface of FMI 3.0")]
        mod fmi3_other_types {
            use std::ffi::{c_char, c_void};
            use $crate::{Status, c_abi};
            $(
                #[unsafe(no_mangle)]
                pub unsafe extern "C" fn $name(instance: *mut c_void, vr: *const u32, n: usize, values: $type, n_values: usize) -> Status {
                    // SAFETY: the arguments as the host passes them.
                    unsafe { c_abi::no_variables::<$model>(instance, $get, $called, vr, n) }
                }
            )*
        }
    };
}

/// Exported functions that are refused with a reason.
#[doc(hidden)]
#[macro_export]
macro_rules! unsupported {
    ($model:ty, $($reason:literal: $($name:ident($($arg:ident: $type:ty),*);)*)*) => {
        #[allow(unsafe_code, non_snake_case, missing_docs, unused_variables, clippy::too_many_arguments, clippy::missing_safety_doc, reason = "C interface of FMI 3.0")]
        mod fmi3_unsupported {
            use std::ffi::{c_char, c_void};
            use $crate::{Status, c_abi};
            $($(
                #[unsafe(no_mangle)]
                pub unsafe extern "C" fn $name(instance: *mut c_void, $($arg: $type),*) -> Status {
                    // SAFETY: the arguments as the host passes them.
                    unsafe { c_abi::unsupported::<$model>(instance, stringify!($name), $reason) }
                }
            )*)*
        }
    };
}
