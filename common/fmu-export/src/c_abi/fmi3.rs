//! FMI 3.0: its signatures, and what only it has.

use std::ffi::{c_char, c_void};
use std::path::Path;

use model::Kind;

use super::log::{Callback, Log, LogMessage};
use super::shared::{self, forward, lists, methods, whole_numbers};
use super::{array, array_mut, call, put, text};
use crate::phase::{Interface, fmi3 as phase};
use crate::{Exported, Status};

/// `fmi3Boolean` as it comes over the boundary: any non-zero byte is true.
pub type Bool = u8;

#[doc(hidden)]
#[must_use]
pub fn fmi3GetVersion() -> *const c_char {
    c"3.0".as_ptr()
}

#[doc(hidden)]
pub unsafe fn fmi3InstantiateCoSimulation<I: Exported>(
    token: *const c_char,
    resources: *const c_char,
    event_mode_used: Bool,
    environment: *mut c_void,
    log_message: Option<LogMessage>,
) -> *mut c_void {
    let interface =
        if event_mode_used == 0 { Interface::CoSimulation } else { Interface::CoSimulationWithEvents };
    let log = Log::new(environment, Callback::Fmi3(log_message));
    // SAFETY: the arguments as the host passes them; the same below.
    unsafe {
        let (function, resources) = ("fmi3InstantiateCoSimulation", text(resources));
        let resources = (!resources.is_empty()).then_some(Path::new(&resources));
        super::instantiate::<I>(function, interface, ("instantiationToken", token), resources, log)
    }
}

#[doc(hidden)]
pub unsafe fn fmi3InstantiateModelExchange<I: Exported>(
    token: *const c_char,
    resources: *const c_char,
    environment: *mut c_void,
    log_message: Option<LogMessage>,
) -> *mut c_void {
    let (function, interface) = ("fmi3InstantiateModelExchange", Interface::ModelExchange);
    let log = Log::new(environment, Callback::Fmi3(log_message));
    // SAFETY: see above.
    unsafe {
        let resources = text(resources);
        let resources = (!resources.is_empty()).then_some(Path::new(&resources));
        super::instantiate::<I>(function, interface, ("instantiationToken", token), resources, log)
    }
}

#[doc(hidden)]
pub unsafe fn fmi3InstantiateScheduledExecution(
    environment: *mut c_void,
    log_message: Option<LogMessage>,
) -> *mut c_void {
    let log = Log::new(environment, Callback::Fmi3(log_message));
    log.refusal("fmi3InstantiateScheduledExecution", "not supported: there are no clocks")
}

#[doc(hidden)]
pub unsafe fn fmi3FreeInstance<I: Exported>(instance: *mut c_void) {
    // SAFETY: the instance as the host passes it.
    unsafe { super::free_instance::<I>(instance) }
}

#[doc(hidden)]
pub unsafe fn fmi3SetDebugLogging<I: Exported>(
    instance: *mut c_void,
    on: Bool,
    n: usize,
    categories: *const *const c_char,
) -> Status {
    // SAFETY: the arguments as the host passes them.
    unsafe { shared::set_debug_logging::<I>(instance, &phase::SET_DEBUG_LOGGING, on != 0, n, categories) }
}

#[doc(hidden)]
pub unsafe fn fmi3EnterInitializationMode<I: Exported>(
    instance: *mut c_void,
    start: f64,
    stop_defined: Bool,
    stop: f64,
) -> Status {
    // SAFETY: FMI instance, checked for null by `call`.
    unsafe {
        call::<I>(instance, &phase::ENTER_INITIALIZATION, |c| {
            c.instance.enter_initialization(start, (stop_defined != 0).then_some(stop))
        })
    }
}

forward! {
    fmi3ExitInitializationMode() EXIT_INITIALIZATION exit_initialization;
    fmi3Terminate() TERMINATE terminate;
    fmi3Reset() RESET reset;
    fmi3SetContinuousStates(states: *const f64, n: usize) SET_CONTINUOUS_STATES set_continuous_states;
    fmi3GetFloat64(vr: *const u32, n: usize, values: *mut f64, n_values: usize) GET_FLOAT64 get_reals;
    fmi3SetFloat64(vr: *const u32, n: usize, values: *const f64, n_values: usize) SET_FLOAT64 set_reals;
    fmi3GetFMUState(state: *mut *mut c_void) GET_FMU_STATE get_state;
    fmi3SetFMUState(state: *mut c_void) SET_FMU_STATE set_state;
    fmi3FreeFMUState(state: *mut *mut c_void) FREE_FMU_STATE free_state;
    fmi3SerializedFMUStateSize(state: *mut c_void, size: *mut usize) SERIALISED_SIZE serialised_size;
    fmi3SerializeFMUState(state: *mut c_void, data: *mut u8, size: usize) SERIALISE serialise;
    fmi3DeserializeFMUState(data: *const u8, size: usize, state: *mut *mut c_void) DESERIALISE deserialise;
}
methods! {
    fmi3EnterEventMode() ENTER_EVENT_MODE enter_event_mode;
    fmi3EnterStepMode() ENTER_STEP_MODE enter_step_mode;
    fmi3EnterContinuousTimeMode() ENTER_CONTINUOUS_TIME_MODE enter_continuous_time_mode;
    fmi3SetTime(t: f64) SET_TIME set_time;
}
lists! {
    fmi3GetContinuousStates GET_CONTINUOUS_STATES get_continuous_states;
    fmi3GetContinuousStateDerivatives GET_DERIVATIVES get_derivatives;
    fmi3GetNominalsOfContinuousStates GET_NOMINALS get_nominals;
    fmi3GetEventIndicators GET_INDICATORS get_indicators;
}

#[doc(hidden)]
pub unsafe fn fmi3DoStep<I: Exported>(
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
        call::<I>(instance, &phase::DO_STEP, |c| {
            let flags = [
                ("eventHandlingNeeded", event_handling_needed),
                ("terminateSimulation", terminate_simulation),
                ("earlyReturn", early_return),
            ];
            for (argument, flag) in flags {
                put(argument, flag, 0)?;
            }
            let last = &mut array_mut("lastSuccessfulTime", last_successful_time, 1)?[0];
            *last = c.instance.time();
            let event = c.instance.do_step(t, step)?;
            *last = c.instance.time();
            if event {
                put("eventHandlingNeeded", event_handling_needed, 1)?;
            }
            Ok(())
        })
    }
}

#[doc(hidden)]
pub unsafe fn fmi3UpdateDiscreteStates<I: Exported>(
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
        call::<I>(instance, &phase::UPDATE_DISCRETE_STATES, |c| {
            let flags = [
                ("discreteStatesNeedUpdate", need_update),
                ("terminateSimulation", terminate),
                ("nominalsOfContinuousStatesChanged", nominals_changed),
                ("valuesOfContinuousStatesChanged", values_changed),
                ("nextEventTimeDefined", next_event_defined),
            ];
            for (argument, flag) in flags {
                put(argument, flag, 0)?;
            }
            let next = &mut array_mut("nextEventTime", next_event, 1)?[0];
            let event = c.instance.update_discrete_states()?;
            let set = |(argument, flag), value: bool| put(argument, flag, u8::from(value));
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
pub unsafe fn fmi3CompletedIntegratorStep<I: Exported>(
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
            *event = u8::from(c.instance.completed_integrator_step()?);
            Ok(())
        })
    }
}

/// Functions that give one count.
macro_rules! counts {
    ($($name:ident $rule:ident $method:ident;)*) => {
        $(
            #[doc(hidden)]
            pub unsafe fn $name<I: Exported>(instance: *mut c_void, n: *mut usize) -> Status {
                // SAFETY: FMI pointers, checked for null.
                unsafe {
                    call::<I>(instance, &phase::$rule, |c| {
                        put("count", n, c.instance.$method())
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

#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    reason = "stored values are whole and below 2^53"
)]
mod whole {
    use super::{Bool, Exported, Kind, Status, array, array_mut, c_void, call, phase, whole_numbers};
    whole_numbers!(fmi3GetInt64 GET_INT64 fmi3SetInt64 SET_INT64 i64, (n_values), "Int64", Kind::Int64 | Kind::Enumeration(_), |v| v as f64, |v| Some(v as i64));
    whole_numbers!(fmi3GetInt32 GET_INT32 fmi3SetInt32 SET_INT32 i32, (n_values), "Int32", Kind::Int32, f64::from, |v| Some(v as i32));
    whole_numbers!(fmi3GetBoolean GET_BOOLEAN fmi3SetBoolean SET_BOOLEAN Bool, (n_values), "Boolean", Kind::Boolean, |v| f64::from(u8::from(v != 0)), |v| Some(u8::from(v > 0.5)));
}
#[doc(hidden)]
pub use whole::*;

#[doc(hidden)]
pub unsafe fn no_variables<I: Exported>(
    instance: *mut c_void,
    get: bool,
    called: &'static str,
    references: *const u32,
    n: usize,
    n_values: usize,
) -> Status {
    let rule = if get { &phase::GET_OTHER } else { &phase::SET_OTHER };
    // SAFETY: the arguments as the host passes them.
    unsafe { shared::no_variables::<I>(instance, rule, called, (references, n), n_values) }
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

#[doc(hidden)]
pub unsafe fn fmi3GetDirectionalDerivative<I: Exported>(
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
    // SAFETY: the arguments as the host passes them.
    unsafe {
        shared::directional_derivative::<I>(
            instance,
            &phase::DIRECTIONAL_DERIVATIVE,
            (unknowns, n_unknowns),
            (knowns, n_knowns),
            (seed, n_seed),
            (sensitivity, n_sensitivity),
        )
    }
}

#[doc(hidden)]
pub unsafe fn fmi3GetNumberOfVariableDependencies<I: Exported>(
    instance: *mut c_void,
    reference: u32,
    n: *mut usize,
) -> Status {
    // SAFETY: FMI pointers, checked for null.
    unsafe {
        call::<I>(instance, &phase::DEPENDENCIES, |c| {
            put("nDependencies", n, c.instance.dependencies(reference)?.len())
        })
    }
}

#[doc(hidden)]
pub unsafe fn fmi3GetVariableDependencies<I: Exported>(
    instance: *mut c_void,
    dependent: u32,
    elements_of_dependent: *mut usize,
    independents: *mut u32,
    elements_of_independents: *mut usize,
    kinds: *mut u32,
    n: usize,
) -> Status {
    /// `fmi3Dependent`
    const DEPENDENT: u32 = 4;
    // SAFETY: FMI pointers, checked for null.
    unsafe {
        call::<I>(instance, &phase::DEPENDENCIES, |c| {
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
