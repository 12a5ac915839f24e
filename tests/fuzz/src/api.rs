//! All functions in use, callable with any argument that is no undefined behaviour by itself.
#![allow(unsafe_code, reason = "calls into a C library; every block states why it is sound")]

use std::ffi::{CStr, CString, c_char};
use std::path::Path;
use std::ptr;

use fmi_capi::fmi3::{self, Flag, Instance};
use fmi_capi::{Library, LoadError, Log, Status, log_message};

use crate::standard::Interface;

/// Values handed over as a C array: their number, and a pointer to them or null.
#[derive(Debug)]
pub(crate) struct Array<'a, T> {
    items: &'a mut [T],
    null: bool,
}

impl<'a, T> Array<'a, T> {
    /// `items`, or as many behind a null pointer.
    pub(crate) fn new(items: &'a mut [T], null: bool) -> Self {
        Self { items, null }
    }

    fn len(&self) -> usize {
        self.items.len()
    }

    fn pointer(&mut self) -> *mut T {
        if self.null { ptr::null_mut() } else { self.items.as_mut_ptr() }
    }
}

/// A live instance with its messages.
#[derive(Debug)]
pub(crate) struct Handle {
    instance: Instance,
    log: Box<Log>,
}

impl Handle {
    pub(crate) fn log(&self) -> &Log {
        &self.log
    }
}

/// The pointer of a saved state; null until something is saved.
#[derive(Debug)]
pub(crate) struct SavedState(fmi3::State);

impl SavedState {
    pub(crate) const NONE: Self = Self(ptr::null_mut());

    pub(crate) fn is_null(&self) -> bool {
        self.0.is_null()
    }
}

/// Fields and look-ups of functions that have the same name in the library.
macro_rules! library_functions {
    ($($field:ident: $type:ty = $symbol:literal;)*) => {
        /// The functions.
        struct Functions {
            $($field: $type,)*
        }

        impl Functions {
            fn find(library: &Library) -> Result<Self, LoadError> {
                Ok(Self { $($field: library.symbol($symbol)?,)* })
            }
        }
    };
}

library_functions! {
    instantiate_co_simulation: fmi3::InstantiateCoSimulation = "fmi3InstantiateCoSimulation";
    instantiate_model_exchange: fmi3::InstantiateModelExchange = "fmi3InstantiateModelExchange";
    free_instance: fmi3::FreeInstance = "fmi3FreeInstance";
    set_debug_logging: fmi3::SetDebugLogging = "fmi3SetDebugLogging";
    enter_initialization: fmi3::EnterInitialization = "fmi3EnterInitializationMode";
    exit_initialization: fmi3::Simple = "fmi3ExitInitializationMode";
    enter_event_mode: fmi3::Simple = "fmi3EnterEventMode";
    enter_step_mode: fmi3::Simple = "fmi3EnterStepMode";
    enter_continuous_time_mode: fmi3::Simple = "fmi3EnterContinuousTimeMode";
    terminate: fmi3::Simple = "fmi3Terminate";
    reset: fmi3::Simple = "fmi3Reset";
    enter_configuration_mode: fmi3::Simple = "fmi3EnterConfigurationMode";
    exit_configuration_mode: fmi3::Simple = "fmi3ExitConfigurationMode";
    evaluate_discrete_states: fmi3::Simple = "fmi3EvaluateDiscreteStates";
    update_discrete_states: fmi3::UpdateDiscreteStates = "fmi3UpdateDiscreteStates";
    completed_integrator_step: fmi3::CompletedIntegratorStep = "fmi3CompletedIntegratorStep";
    do_step: fmi3::DoStep = "fmi3DoStep";
    set_time: fmi3::SetTime = "fmi3SetTime";
    get_float64: fmi3::Get<f64> = "fmi3GetFloat64";
    get_int32: fmi3::Get<i32> = "fmi3GetInt32";
    get_int64: fmi3::Get<i64> = "fmi3GetInt64";
    get_boolean: fmi3::Get<u8> = "fmi3GetBoolean";
    get_float32: fmi3::Get<f32> = "fmi3GetFloat32";
    set_float64: fmi3::Set<f64> = "fmi3SetFloat64";
    set_int32: fmi3::Set<i32> = "fmi3SetInt32";
    set_int64: fmi3::Set<i64> = "fmi3SetInt64";
    set_boolean: fmi3::Set<u8> = "fmi3SetBoolean";
    set_float32: fmi3::Set<f32> = "fmi3SetFloat32";
    get_continuous_states: fmi3::GetList = "fmi3GetContinuousStates";
    get_derivatives: fmi3::GetList = "fmi3GetContinuousStateDerivatives";
    get_nominals: fmi3::GetList = "fmi3GetNominalsOfContinuousStates";
    get_indicators: fmi3::GetList = "fmi3GetEventIndicators";
    set_continuous_states: fmi3::SetList = "fmi3SetContinuousStates";
    count_states: fmi3::Count = "fmi3GetNumberOfContinuousStates";
    count_indicators: fmi3::Count = "fmi3GetNumberOfEventIndicators";
    directional: fmi3::DirectionalDerivative = "fmi3GetDirectionalDerivative";
    adjoint: fmi3::DirectionalDerivative = "fmi3GetAdjointDerivative";
    count_dependencies: fmi3::CountDependencies = "fmi3GetNumberOfVariableDependencies";
    dependencies: fmi3::Dependencies = "fmi3GetVariableDependencies";
    get_state: fmi3::StateSlot = "fmi3GetFMUState";
    set_state: fmi3::SetState = "fmi3SetFMUState";
    free_state: fmi3::StateSlot = "fmi3FreeFMUState";
    state_size: fmi3::StateSize = "fmi3SerializedFMUStateSize";
    serialize: fmi3::Serialize = "fmi3SerializeFMUState";
    deserialize: fmi3::Deserialize = "fmi3DeserializeFMUState";
}

/// Functions without arguments.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Transition {
    ExitInitialization,
    EnterEventMode,
    EnterStepMode,
    EnterContinuousTimeMode,
    Terminate,
    Reset,
    EnterConfigurationMode,
    ExitConfigurationMode,
    EvaluateDiscreteStates,
}

/// Functions that give a list of numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Lists {
    States,
    Derivatives,
    Nominals,
    Indicators,
}

/// What `fmi3DoStep` says; which of its pointers is null.
#[derive(Debug, Default, Clone, Copy, PartialEq)]
pub(crate) struct Stepped {
    pub(crate) event: Flag,
    pub(crate) terminate: Flag,
    pub(crate) early: Flag,
    pub(crate) last: f64,
}

/// What `fmi3UpdateDiscreteStates` says.
#[derive(Debug, Default, Clone, Copy, PartialEq)]
pub(crate) struct Updated {
    pub(crate) flags: [Flag; 5],
    pub(crate) next: f64,
}

/// An FMU's library.
pub(crate) struct Api {
    f: Functions,
    // last: closed after everything else
    _library: Library,
}

/// The instance, null for none.
///
/// Every call below passes it, and pointers that are null or lead to as many live values as the call says: this is all
/// that the functions of the standard ask for, hence the short SAFETY comments.
fn of(handle: Option<&Handle>) -> Instance {
    handle.map_or(ptr::null_mut(), |handle| handle.instance)
}

/// `pointer`, or null if `null` is `index`.
fn unless<T>(pointer: *mut T, null: Option<usize>, index: usize) -> *mut T {
    if null == Some(index) { ptr::null_mut() } else { pointer }
}

impl Api {
    pub(crate) fn load(path: &Path) -> Result<Self, LoadError> {
        let library = Library::open(path)?;
        Ok(Self { f: Functions::find(&library)?, _library: library })
    }

    /// A new instance, or what was said instead.
    pub(crate) fn instantiate(&self, interface: Interface, token: &CStr) -> Result<Handle, Box<Log>> {
        let log = Box::<Log>::default();
        let environment = ptr::from_ref::<Log>(&log).cast_mut().cast();
        let (name, none) = (c"fuzz".as_ptr(), ptr::null());
        // SAFETY: the strings live; the log is dropped after the instance is freed, and stays where it is.
        let instance = unsafe {
            if interface == Interface::ModelExchange {
                (self.f.instantiate_model_exchange)(
                    name,
                    token.as_ptr(),
                    none,
                    0,
                    1,
                    environment,
                    Some(log_message),
                )
            } else {
                let events = Flag::from(interface == Interface::CoSimulationWithEvents);
                (self.f.instantiate_co_simulation)(
                    name,
                    token.as_ptr(),
                    none,
                    0,
                    1,
                    events,
                    0,
                    ptr::null(),
                    0,
                    environment,
                    Some(log_message),
                    None,
                )
            }
        };
        if instance.is_null() { Err(log) } else { Ok(Handle { instance, log }) }
    }

    /// Free an instance, or call the function with null.
    #[allow(clippy::needless_pass_by_value, reason = "nobody may use it afterwards")]
    pub(crate) fn free(&self, handle: Option<Handle>) {
        // SAFETY: the instance is live and not used after this; the log is dropped later.
        unsafe { (self.f.free_instance)(of(handle.as_ref())) }
    }

    pub(crate) fn set_debug_logging(&self, handle: Option<&Handle>, on: bool, names: &[String]) -> Status {
        let names: Vec<_> = names.iter().map(|n| CString::new(n.as_str()).unwrap_or_default()).collect();
        let pointers: Vec<*const c_char> = names.iter().map(|name| name.as_ptr()).collect();
        // SAFETY: see `of`.
        unsafe { (self.f.set_debug_logging)(of(handle), Flag::from(on), pointers.len(), pointers.as_ptr()) }
    }

    pub(crate) fn enter_initialization(
        &self,
        handle: Option<&Handle>,
        start: f64,
        stop: Option<f64>,
    ) -> Status {
        let defined = Flag::from(stop.is_some());
        // SAFETY: see `of`.
        unsafe { (self.f.enter_initialization)(of(handle), 0, 0.0, start, defined, stop.unwrap_or(f64::NAN)) }
    }

    pub(crate) fn transition(&self, handle: Option<&Handle>, transition: Transition) -> Status {
        let f = match transition {
            Transition::ExitInitialization => self.f.exit_initialization,
            Transition::EnterEventMode => self.f.enter_event_mode,
            Transition::EnterStepMode => self.f.enter_step_mode,
            Transition::EnterContinuousTimeMode => self.f.enter_continuous_time_mode,
            Transition::Terminate => self.f.terminate,
            Transition::Reset => self.f.reset,
            Transition::EnterConfigurationMode => self.f.enter_configuration_mode,
            Transition::ExitConfigurationMode => self.f.exit_configuration_mode,
            Transition::EvaluateDiscreteStates => self.f.evaluate_discrete_states,
        };
        // SAFETY: see `of`.
        unsafe { f(of(handle)) }
    }

    pub(crate) fn do_step(
        &self,
        handle: Option<&Handle>,
        (t, step): (f64, f64),
        null: Option<usize>,
    ) -> (Status, Stepped) {
        let mut s = Stepped { event: 7, terminate: 7, early: 7, last: f64::NAN };
        let (event, terminate, early) = (&raw mut s.event, &raw mut s.terminate, &raw mut s.early);
        let last = unless(&raw mut s.last, null, 3);
        let (event, terminate, early) =
            (unless(event, null, 0), unless(terminate, null, 1), unless(early, null, 2));
        // SAFETY: see `of`.
        let status = unsafe { (self.f.do_step)(of(handle), t, step, 0, event, terminate, early, last) };
        (status, s)
    }

    pub(crate) fn update(&self, handle: Option<&Handle>, null: Option<usize>) -> (Status, Updated) {
        let mut updated = Updated { flags: [7; 5], next: 0.0 };
        let mut pointers = [ptr::null_mut(); 5];
        for (i, (pointer, flag)) in pointers.iter_mut().zip(&mut updated.flags).enumerate() {
            *pointer = unless(flag, null, i);
        }
        let [a, b, c, d, e] = pointers;
        // SAFETY: see `of`.
        let status = unsafe {
            (self.f.update_discrete_states)(of(handle), a, b, c, d, e, unless(&raw mut updated.next, null, 5))
        };
        (status, updated)
    }

    pub(crate) fn completed_step(&self, handle: Option<&Handle>, null: Option<usize>) -> (Status, [Flag; 2]) {
        let (mut event, mut terminate) = (7, 7);
        // SAFETY: see `of`.
        let status = unsafe {
            let (event, terminate) = (unless(&raw mut event, null, 0), unless(&raw mut terminate, null, 1));
            (self.f.completed_integrator_step)(of(handle), 0, event, terminate)
        };
        (status, [event, terminate])
    }

    pub(crate) fn set_time(&self, handle: Option<&Handle>, t: f64) -> Status {
        // SAFETY: see `of`.
        unsafe { (self.f.set_time)(of(handle), t) }
    }

    pub(crate) fn list(&self, handle: Option<&Handle>, list: Lists, mut values: Array<f64>) -> Status {
        let f = match list {
            Lists::States => self.f.get_continuous_states,
            Lists::Derivatives => self.f.get_derivatives,
            Lists::Nominals => self.f.get_nominals,
            Lists::Indicators => self.f.get_indicators,
        };
        // SAFETY: see `of`.
        unsafe { f(of(handle), values.pointer(), values.len()) }
    }

    pub(crate) fn set_states(&self, handle: Option<&Handle>, mut values: Array<f64>) -> Status {
        // SAFETY: see `of`.
        unsafe { (self.f.set_continuous_states)(of(handle), values.pointer(), values.len()) }
    }

    pub(crate) fn count(&self, handle: Option<&Handle>, states: bool, null: bool) -> (Status, usize) {
        let f = if states { self.f.count_states } else { self.f.count_indicators };
        let mut n = usize::MAX;
        // SAFETY: see `of`.
        let status = unsafe { f(of(handle), if null { ptr::null_mut() } else { &raw mut n }) };
        (status, n)
    }

    pub(crate) fn directional(
        &self,
        handle: Option<&Handle>,
        adjoint: bool,
        (mut unknowns, mut knowns): (Array<u32>, Array<u32>),
        (mut seed, mut sensitivity): (Array<f64>, Array<f64>),
    ) -> Status {
        let f = if adjoint { self.f.adjoint } else { self.f.directional };
        let (n_unknowns, n_knowns) = (unknowns.len(), knowns.len());
        let (n_seed, n_sensitivity) = (seed.len(), sensitivity.len());
        // SAFETY: see `of`.
        unsafe {
            f(
                of(handle),
                unknowns.pointer(),
                n_unknowns,
                knowns.pointer(),
                n_knowns,
                seed.pointer(),
                n_seed,
                sensitivity.pointer(),
                n_sensitivity,
            )
        }
    }

    /// Number of dependencies, then the list for `n` of them.
    pub(crate) fn dependencies(
        &self,
        handle: Option<&Handle>,
        reference: u32,
        n: Option<usize>,
    ) -> (Status, Vec<u32>) {
        let mut count = 0;
        // SAFETY: see `of`.
        let status = unsafe { (self.f.count_dependencies)(of(handle), reference, &raw mut count) };
        let n = n.unwrap_or(count);
        if status != fmi_capi::OK && n == 0 {
            return (status, Vec::new());
        }
        let (mut elements, mut independents, mut others) = (vec![0; n], vec![0_u32; n], vec![0; n]);
        let mut kinds = vec![0; n];
        // SAFETY: see `of`; all lists have n places.
        let status = unsafe {
            (self.f.dependencies)(
                of(handle),
                reference,
                elements.as_mut_ptr(),
                independents.as_mut_ptr(),
                others.as_mut_ptr(),
                kinds.as_mut_ptr(),
                n,
            )
        };
        (status, independents)
    }

    pub(crate) fn save(&self, handle: Option<&Handle>, state: &mut SavedState) -> Status {
        // SAFETY: see `of`; the pointer in the slot is null or a state of this library.
        unsafe { (self.f.get_state)(of(handle), &raw mut state.0) }
    }

    pub(crate) fn restore(&self, handle: Option<&Handle>, state: &SavedState) -> Status {
        // SAFETY: see `of`; null or a state of this library that was not freed.
        unsafe { (self.f.set_state)(of(handle), state.0) }
    }

    pub(crate) fn free_state(&self, handle: Option<&Handle>, state: &mut SavedState) -> Status {
        // SAFETY: see `of`; null or a state of this library, and the slot is null afterwards.
        unsafe { (self.f.free_state)(of(handle), &raw mut state.0) }
    }

    /// The state as bytes.
    pub(crate) fn serialize(&self, handle: Option<&Handle>, state: &SavedState) -> (Status, Vec<u8>) {
        let mut size = 0;
        // SAFETY: see `of`; null or a state of this library.
        let status = unsafe { (self.f.state_size)(of(handle), state.0, &raw mut size) };
        if status != fmi_capi::OK {
            return (status, Vec::new());
        }
        let mut bytes = vec![0_u8; size];
        // SAFETY: as above; `bytes` has the size asked for.
        let status = unsafe { (self.f.serialize)(of(handle), state.0, bytes.as_mut_ptr(), size) };
        (status, bytes)
    }

    /// A state from bytes, whatever they are.
    pub(crate) fn deserialize(&self, handle: Option<&Handle>, bytes: &[u8]) -> (Status, SavedState) {
        let mut state = SavedState::NONE;
        // SAFETY: see `of`; the slot is null before.
        let status =
            unsafe { (self.f.deserialize)(of(handle), bytes.as_ptr(), bytes.len(), &raw mut state.0) };
        (status, state)
    }
}

/// Get and Set of one type.
macro_rules! access {
    ($($get:ident $set:ident $type:ty;)*) => {
        impl Api {
            $(
                pub(crate) fn $get(&self, handle: Option<&Handle>, mut references: Array<u32>, mut values: Array<$type>) -> Status {
                    let (n, n_values) = (references.len(), values.len());
                    // SAFETY: see `of`.
                    unsafe { (self.f.$get)(of(handle), references.pointer(), n, values.pointer(), n_values) }
                }

                pub(crate) fn $set(&self, handle: Option<&Handle>, mut references: Array<u32>, mut values: Array<$type>) -> Status {
                    let (n, n_values) = (references.len(), values.len());
                    // SAFETY: see `of`.
                    unsafe { (self.f.$set)(of(handle), references.pointer(), n, values.pointer(), n_values) }
                }
            )*
        }
    };
}
access! {
    get_float64 set_float64 f64;
    get_int32 set_int32 i32;
    get_int64 set_int64 i64;
    get_boolean set_boolean u8;
    get_float32 set_float32 f32;
}
