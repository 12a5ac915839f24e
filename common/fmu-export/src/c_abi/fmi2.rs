//! FMI 2.0: its signatures, and what only it has.

use std::ffi::{CStr, CString, c_char, c_void};

use model::Kind;

use super::log::{Callback, Log, Logger};
use super::shared::{self, forward, lists, methods, whole_numbers};
use super::{array, array_mut, call, put, text};
use crate::phase::{Interface, fmi2 as phase};
use crate::resources::path_of_uri;
use crate::{Exported, Fault, Status};

/// `fmi2Boolean`: any value but 0 is true.
pub type Bool = i32;

/// `fmi2CallbackFunctions`
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct CallbackFunctions {
    /// For messages
    pub logger: Option<Logger>,
    /// Not used
    pub allocate_memory: Option<unsafe extern "C" fn(usize, usize) -> *mut c_void>,
    /// Not used
    pub free_memory: Option<unsafe extern "C" fn(*mut c_void)>,
    /// Not used: no step goes on in the background
    pub step_finished: Option<unsafe extern "C" fn(*mut c_void, Status)>,
    /// First argument of the callbacks
    pub environment: *mut c_void,
}

/// `fmi2EventInfo`
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct EventInfo {
    /// `newDiscreteStatesNeeded`
    pub again: Bool,
    /// `terminateSimulation`
    pub terminate: Bool,
    /// `nominalsOfContinuousStatesChanged`
    pub nominals_changed: Bool,
    /// `valuesOfContinuousStatesChanged`
    pub states_changed: Bool,
    /// `nextEventTimeDefined`
    pub next_defined: Bool,
    /// `nextEventTime`
    pub next: f64,
}

#[doc(hidden)]
#[must_use]
pub fn fmi2GetTypesPlatform() -> *const c_char {
    c"default".as_ptr()
}

#[doc(hidden)]
#[must_use]
pub fn fmi2GetVersion() -> *const c_char {
    c"2.0".as_ptr()
}

#[doc(hidden)]
#[must_use]
pub unsafe fn fmi2Instantiate<I: Exported>(
    name: *const c_char,
    interface: u32,
    guid: *const c_char,
    resources: *const c_char,
    functions: *const CallbackFunctions,
) -> *mut c_void {
    // SAFETY: null, or the host's structure and string; both are copied.
    let (functions, name) = unsafe {
        let name = if name.is_null() { CString::default() } else { CStr::from_ptr(name).to_owned() };
        (functions.as_ref(), name)
    };
    let environment = functions.map_or(std::ptr::null_mut(), |f| f.environment);
    let log = Log::new(environment, Callback::Fmi2(functions.and_then(|f| f.logger), name));
    let interface = match interface {
        0 => Interface::ModelExchange2,
        1 => Interface::CoSimulation2,
        other => return log.refusal("fmi2Instantiate", &format!("fmuType = {other}; allowed: 0, 1")),
    };
    // SAFETY: the arguments as the host passes them.
    unsafe {
        let resources = path_of_uri(&text(resources));
        super::instantiate::<I>("fmi2Instantiate", interface, ("fmuGUID", guid), resources.as_deref(), log)
    }
}

#[doc(hidden)]
pub unsafe fn fmi2FreeInstance<I: Exported>(instance: *mut c_void) {
    // SAFETY: the instance as the host passes it.
    unsafe { super::free_instance::<I>(instance) }
}

#[doc(hidden)]
pub unsafe fn fmi2SetDebugLogging<I: Exported>(
    instance: *mut c_void,
    on: Bool,
    n: usize,
    categories: *const *const c_char,
) -> Status {
    // SAFETY: the arguments as the host passes them.
    unsafe { shared::set_debug_logging::<I>(instance, &phase::SET_DEBUG_LOGGING, on != 0, n, categories) }
}

#[doc(hidden)]
pub unsafe fn fmi2SetupExperiment<I: Exported>(
    instance: *mut c_void,
    start: f64,
    stop_defined: Bool,
    stop: f64,
) -> Status {
    // SAFETY: FMI instance, checked for null by `call`.
    unsafe {
        call::<I>(instance, &phase::SETUP_EXPERIMENT, |c| {
            c.instance.setup_experiment(start, (stop_defined != 0).then_some(stop))
        })
    }
}

forward! {
    fmi2ExitInitializationMode() EXIT_INITIALIZATION exit_initialization;
    fmi2Terminate() TERMINATE terminate;
    fmi2Reset() RESET reset;
    fmi2SetContinuousStates(states: *const f64, n: usize) SET_CONTINUOUS_STATES set_continuous_states;
    fmi2GetFMUstate(state: *mut *mut c_void) GET_FMU_STATE get_state;
    fmi2SetFMUstate(state: *mut c_void) SET_FMU_STATE set_state;
    fmi2FreeFMUstate(state: *mut *mut c_void) FREE_FMU_STATE free_state;
    fmi2SerializedFMUstateSize(state: *mut c_void, size: *mut usize) SERIALISED_SIZE serialised_size;
}
methods! {
    fmi2EnterInitializationMode() ENTER_INITIALIZATION begin_initialization;
    fmi2EnterEventMode() ENTER_EVENT_MODE enter_event_mode;
    fmi2EnterContinuousTimeMode() ENTER_CONTINUOUS_TIME_MODE enter_continuous_time_mode;
    fmi2SetTime(t: f64) SET_TIME set_time;
}
lists! {
    fmi2GetContinuousStates GET_CONTINUOUS_STATES get_continuous_states;
    fmi2GetDerivatives GET_DERIVATIVES get_derivatives;
    fmi2GetNominalsOfContinuousStates GET_NOMINALS get_nominals;
    fmi2GetEventIndicators GET_INDICATORS get_indicators;
}

#[doc(hidden)]
pub unsafe fn fmi2SerializeFMUstate<I: Exported>(
    instance: *mut c_void,
    state: *mut c_void,
    data: *mut c_char,
    size: usize,
) -> Status {
    // SAFETY: the arguments as the host passes them.
    unsafe { shared::serialise::<I>(instance, &phase::SERIALISE, state, data.cast(), size) }
}

#[doc(hidden)]
pub unsafe fn fmi2DeSerializeFMUstate<I: Exported>(
    instance: *mut c_void,
    data: *const c_char,
    size: usize,
    state: *mut *mut c_void,
) -> Status {
    // SAFETY: the arguments as the host passes them.
    unsafe { shared::deserialise::<I>(instance, &phase::DESERIALISE, data.cast(), size, state) }
}

#[doc(hidden)]
pub unsafe fn fmi2GetReal<I: Exported>(
    instance: *mut c_void,
    references: *const u32,
    n: usize,
    values: *mut f64,
) -> Status {
    // SAFETY: the arguments as the host passes them.
    unsafe { shared::get_reals::<I>(instance, &phase::GET_REAL, references, n, values, n) }
}

#[doc(hidden)]
pub unsafe fn fmi2SetReal<I: Exported>(
    instance: *mut c_void,
    references: *const u32,
    n: usize,
    values: *const f64,
) -> Status {
    // SAFETY: the arguments as the host passes them.
    unsafe { shared::set_reals::<I>(instance, &phase::SET_REAL, references, n, values, n) }
}

/// A whole number as `fmi2Integer`, if it is not too large.
#[allow(clippy::cast_possible_truncation, reason = "whole and in range")]
fn integer(value: f64) -> Option<i32> {
    (value.abs() <= f64::from(i32::MAX)).then_some(value as i32)
}

whole_numbers!(fmi2GetInteger GET_INTEGER fmi2SetInteger SET_INTEGER i32, (), "Integer", Kind::Int32 | Kind::Int64 | Kind::Enumeration(_), f64::from, integer);
whole_numbers!(fmi2GetBoolean GET_BOOLEAN fmi2SetBoolean SET_BOOLEAN Bool, (), "Boolean", Kind::Boolean, |v| f64::from(u8::from(v != 0)), |v| Some(i32::from(v > 0.5)));

#[doc(hidden)]
pub unsafe fn fmi2GetString<I: Exported>(
    instance: *mut c_void,
    references: *const u32,
    n: usize,
    _values: *mut *const c_char,
) -> Status {
    // SAFETY: the arguments as the host passes them.
    unsafe { shared::no_variables::<I>(instance, &phase::GET_STRING, "String", (references, n), n) }
}

#[doc(hidden)]
pub unsafe fn fmi2SetString<I: Exported>(
    instance: *mut c_void,
    references: *const u32,
    n: usize,
    _values: *const *const c_char,
) -> Status {
    // SAFETY: the arguments as the host passes them.
    unsafe { shared::no_variables::<I>(instance, &phase::SET_STRING, "String", (references, n), n) }
}

#[doc(hidden)]
pub unsafe fn fmi2GetDirectionalDerivative<I: Exported>(
    instance: *mut c_void,
    unknowns: *const u32,
    n_unknowns: usize,
    knowns: *const u32,
    n_knowns: usize,
    seed: *const f64,
    sensitivity: *mut f64,
) -> Status {
    // SAFETY: the arguments as the host passes them.
    unsafe {
        shared::directional_derivative::<I>(
            instance,
            &phase::DIRECTIONAL_DERIVATIVE,
            (unknowns, n_unknowns),
            (knowns, n_knowns),
            (seed, n_knowns),
            (sensitivity, n_unknowns),
        )
    }
}

#[doc(hidden)]
pub unsafe fn fmi2NewDiscreteStates<I: Exported>(instance: *mut c_void, info: *mut EventInfo) -> Status {
    // SAFETY: FMI pointers, checked for null by `call` and `array_mut`.
    unsafe {
        call::<I>(instance, &phase::NEW_DISCRETE_STATES, |c| {
            let info = &mut array_mut("eventInfo", info, 1)?[0];
            let event = c.instance.update_discrete_states()?;
            info.again = Bool::from(event.again);
            (info.terminate, info.nominals_changed) = (0, 0);
            info.states_changed = Bool::from(event.states_changed);
            info.next_defined = Bool::from(event.next.is_some());
            if let Some(t) = event.next {
                info.next = t;
            }
            Ok(())
        })
    }
}

#[doc(hidden)]
pub unsafe fn fmi2CompletedIntegratorStep<I: Exported>(
    instance: *mut c_void,
    _no_set_state_prior: Bool,
    enter_event_mode: *mut Bool,
    terminate: *mut Bool,
) -> Status {
    // SAFETY: FMI pointers, checked for null by `call` and `array_mut`.
    unsafe {
        call::<I>(instance, &phase::COMPLETED_INTEGRATOR_STEP, |c| {
            put("terminateSimulation", terminate, 0)?;
            let event = &mut array_mut("enterEventMode", enter_event_mode, 1)?[0];
            *event = Bool::from(c.instance.completed_integrator_step()?);
            Ok(())
        })
    }
}

#[doc(hidden)]
pub unsafe fn fmi2DoStep<I: Exported>(instance: *mut c_void, t: f64, step: f64) -> Status {
    // SAFETY: FMI instance, checked for null by `call`.
    unsafe { call::<I>(instance, &phase::DO_STEP, |c| c.instance.do_step(t, step).map(|_| ())) }
}

/// `fmi2LastSuccessfulTime` of `fmi2StatusKind`
const LAST_SUCCESSFUL_TIME: u32 = 2;
/// `fmi2Terminated` of `fmi2StatusKind`
const TERMINATED: u32 = 3;

/// Functions that say something about the last step: one kind has an answer, the others none.
macro_rules! status {
    ($($name:ident $rule:ident $type:ty, $kind:pat => $answer:expr;)*) => {
        $(
            #[doc(hidden)]
            pub unsafe fn $name<I: Exported>(instance: *mut c_void, kind: u32, value: *mut $type) -> Status {
                // SAFETY: FMI pointers, checked for null.
                unsafe {
                    call::<I>(instance, &phase::$rule, |c| match kind {
                        $kind => put("value", value, $answer(&c.instance)),
                        _ => Err(Fault::NoStatus { kind }),
                    })
                }
            }
        )*
    };
}
status! {
    fmi2GetRealStatus GET_REAL_STATUS f64, LAST_SUCCESSFUL_TIME => I::time;
    fmi2GetBooleanStatus GET_BOOLEAN_STATUS Bool, TERMINATED => |_: &I| 0;
}

/// Functions that would say something about a step in the background.
macro_rules! no_status {
    ($($name:ident $rule:ident $type:ty;)*) => {
        $(
            #[doc(hidden)]
            pub unsafe fn $name<I: Exported>(instance: *mut c_void, kind: u32, _value: *mut $type) -> Status {
                // SAFETY: FMI instance, checked for null by `call`.
                unsafe { call::<I>(instance, &phase::$rule, |_| Err(Fault::NoStatus { kind })) }
            }
        )*
    };
}
no_status! {
    fmi2GetStatus GET_STATUS Status;
    fmi2GetIntegerStatus GET_INTEGER_STATUS i32;
    fmi2GetStringStatus GET_STRING_STATUS *const c_char;
}

#[doc(hidden)]
pub unsafe fn unsupported<I: Exported>(
    instance: *mut c_void,
    function: &'static str,
    reason: &'static str,
) -> Status {
    // SAFETY: the instance as the host passes it.
    unsafe { shared::unsupported::<I>(instance, &phase::UNSUPPORTED, function, reason) }
}

#[cfg(test)]
mod tests {
    use super::integer;

    #[test]
    fn whole_numbers_fit_up_to_the_largest_of_their_type() {
        assert_eq!([2_147_483_647.0, -3.0].map(integer), [Some(i32::MAX), Some(-3)]);
        assert_eq!([2_147_483_648.0, f64::NAN].map(integer), [None, None]);
    }
}
