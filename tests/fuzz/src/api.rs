//! All functions in use, callable with any argument that is no undefined behaviour by itself.
#![allow(unsafe_code, reason = "calls into a C library; every block states why it is sound")]

mod fmi2;
mod fmi3;

use std::ffi::{CStr, CString, c_char};
use std::path::PathBuf;
use std::ptr;

use fmi_capi::fmi2::Callbacks;
use fmi_capi::fmi3::{self as functions, Flag, Instance};
use fmi_capi::{Library, LoadError, Log, Status};

use crate::archive::Opened;
use crate::standard::{Interface, Version};

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
    /// Of FMI 2.0, where they have to live as long as the instance
    _callbacks: Option<Box<Callbacks>>,
}

impl Handle {
    pub(crate) fn log(&self) -> &Log {
        &self.log
    }
}

/// The pointer of a saved state; null until something is saved.
#[derive(Debug)]
pub(crate) struct SavedState(functions::State);

impl SavedState {
    pub(crate) const NONE: Self = Self(ptr::null_mut());

    pub(crate) fn is_null(&self) -> bool {
        self.0.is_null()
    }
}

/// Fields and look-ups of functions; with two names: in FMI 2.0 and FMI 3.0.
macro_rules! library_functions {
    ($($field:ident: $type:ty = $symbol:literal;)*) => {
        /// The functions.
        pub(super) struct Functions {
            $(pub(super) $field: $type,)*
        }

        impl Functions {
            pub(super) fn find(library: &fmi_capi::Library) -> Result<Self, fmi_capi::LoadError> {
                Ok(Self { $($field: library.symbol($symbol)?,)* })
            }
        }
    };
    ($($field:ident: $type:ty = $fmi2:literal $fmi3:literal;)*) => {
        /// Functions with the same signature in both versions.
        struct Functions {
            $($field: $type,)*
        }

        impl Functions {
            fn find(library: &Library, version: Version) -> Result<Self, LoadError> {
                let name = |fmi2, fmi3| if version == Version::Fmi2 { fmi2 } else { fmi3 };
                Ok(Self { $($field: library.symbol(name($fmi2, $fmi3))?,)* })
            }
        }
    };
}
use library_functions;

library_functions! {
    free_instance: functions::FreeInstance = "fmi2FreeInstance" "fmi3FreeInstance";
    exit_initialization: functions::Simple = "fmi2ExitInitializationMode" "fmi3ExitInitializationMode";
    enter_event_mode: functions::Simple = "fmi2EnterEventMode" "fmi3EnterEventMode";
    enter_continuous_time_mode: functions::Simple = "fmi2EnterContinuousTimeMode" "fmi3EnterContinuousTimeMode";
    terminate: functions::Simple = "fmi2Terminate" "fmi3Terminate";
    reset: functions::Simple = "fmi2Reset" "fmi3Reset";
    set_time: functions::SetTime = "fmi2SetTime" "fmi3SetTime";
    get_continuous_states: functions::GetList = "fmi2GetContinuousStates" "fmi3GetContinuousStates";
    get_derivatives: functions::GetList = "fmi2GetDerivatives" "fmi3GetContinuousStateDerivatives";
    get_nominals: functions::GetList = "fmi2GetNominalsOfContinuousStates" "fmi3GetNominalsOfContinuousStates";
    get_indicators: functions::GetList = "fmi2GetEventIndicators" "fmi3GetEventIndicators";
    set_continuous_states: functions::SetList = "fmi2SetContinuousStates" "fmi3SetContinuousStates";
    get_state: functions::StateSlot = "fmi2GetFMUstate" "fmi3GetFMUState";
    set_state: functions::SetState = "fmi2SetFMUstate" "fmi3SetFMUState";
    free_state: functions::StateSlot = "fmi2FreeFMUstate" "fmi3FreeFMUState";
    state_size: functions::StateSize = "fmi2SerializedFMUstateSize" "fmi3SerializedFMUStateSize";
    serialize: functions::Serialize = "fmi2SerializeFMUstate" "fmi3SerializeFMUState";
    deserialize: functions::Deserialize = "fmi2DeSerializeFMUstate" "fmi3DeserializeFMUState";
}

/// Functions that are different in the versions.
enum Special {
    Fmi2(fmi2::Functions),
    Fmi3(fmi3::Functions),
}

/// Questions about the last step in FMI 2.0, and about derivatives that are not offered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Inquiry {
    Status,
    Real,
    Integer,
    Boolean,
    String,
    InputDerivatives,
    OutputDerivatives,
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
    special: Special,
    /// Path or URI of the folder of this name
    resources: Option<CString>,
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
    pub(crate) fn load(fmu: &Opened) -> Result<Self, LoadError> {
        let version = fmu.description.version;
        let library = Library::open(&fmu.library)?;
        let scheme = if version == Version::Fmi2 { "file://" } else { "" };
        let text = |folder: &PathBuf| format!("{scheme}{}/", folder.display());
        let resources = CString::new(fmu.resources.as_ref().map(text).unwrap_or_default());
        let special = match version {
            Version::Fmi2 => Special::Fmi2(fmi2::Functions::find(&library)?),
            Version::Fmi3 => Special::Fmi3(fmi3::Functions::find(&library)?),
        };
        let resources = resources.ok().filter(|text| !text.is_empty());
        Ok(Self { f: Functions::find(&library, version)?, special, resources, _library: library })
    }

    /// A new instance, or what was said instead.
    pub(crate) fn instantiate(&self, interface: Interface, token: &CStr) -> Result<Handle, Box<Log>> {
        let log = Box::<Log>::default();
        let resources = self.resources.as_ref().map_or(ptr::null(), |text| text.as_ptr());
        let (instance, callbacks) = match &self.special {
            Special::Fmi2(f) => {
                let (instance, callbacks) = f.instantiate(interface, token, resources, &log);
                (instance, Some(callbacks))
            }
            Special::Fmi3(f) => (f.instantiate(interface, token, resources, &log), None),
        };
        if instance.is_null() { Err(log) } else { Ok(Handle { instance, log, _callbacks: callbacks }) }
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
        let (n, pointers) = (pointers.len(), pointers.as_ptr());
        // SAFETY: see `of`.
        unsafe {
            match &self.special {
                Special::Fmi2(f) => (f.set_debug_logging)(of(handle), i32::from(on), n, pointers),
                Special::Fmi3(f) => (f.set_debug_logging)(of(handle), Flag::from(on), n, pointers),
            }
        }
    }

    /// In FMI 2.0 the experiment is set up before.
    pub(crate) fn enter_initialization(
        &self,
        handle: Option<&Handle>,
        start: f64,
        stop: Option<f64>,
    ) -> Status {
        match &self.special {
            Special::Fmi2(f) => f.enter_initialization(of(handle), start, stop),
            Special::Fmi3(f) => f.enter_initialization(of(handle), start, stop),
        }
    }

    pub(crate) fn transition(&self, handle: Option<&Handle>, transition: Transition) -> Status {
        let f = match transition {
            Transition::ExitInitialization => self.f.exit_initialization,
            Transition::EnterEventMode => self.f.enter_event_mode,
            Transition::EnterContinuousTimeMode => self.f.enter_continuous_time_mode,
            Transition::Terminate => self.f.terminate,
            Transition::Reset => self.f.reset,
            other => {
                return match &self.special {
                    Special::Fmi2(f) => f.transition(of(handle), other),
                    Special::Fmi3(f) => f.transition(of(handle), other),
                };
            }
        };
        // SAFETY: see `of`.
        unsafe { f(of(handle)) }
    }

    /// Which of its pointers is null is of FMI 3.0 only.
    pub(crate) fn do_step(
        &self,
        handle: Option<&Handle>,
        times: (f64, f64),
        null: Option<usize>,
    ) -> (Status, Stepped) {
        match &self.special {
            Special::Fmi2(f) => f.do_step(of(handle), times),
            Special::Fmi3(f) => f.do_step(of(handle), times, null),
        }
    }

    pub(crate) fn update(&self, handle: Option<&Handle>, null: Option<usize>) -> (Status, Updated) {
        match &self.special {
            Special::Fmi2(f) => f.update(of(handle), null),
            Special::Fmi3(f) => f.update(of(handle), null),
        }
    }

    pub(crate) fn completed_step(&self, handle: Option<&Handle>, null: Option<usize>) -> (Status, [Flag; 2]) {
        match &self.special {
            Special::Fmi2(f) => f.completed_step(of(handle), null),
            Special::Fmi3(f) => f.completed_step(of(handle), null),
        }
    }

    /// Numbers of states and indicators; FMI 2.0 does not tell them.
    pub(crate) fn count(&self, handle: Option<&Handle>, states: bool, null: bool) -> (Status, usize) {
        match &self.special {
            Special::Fmi2(_) => (fmi_capi::ERROR, 0),
            Special::Fmi3(f) => f.count(of(handle), states, null),
        }
    }

    /// Dependencies of a variable; FMI 2.0 does not tell them.
    pub(crate) fn dependencies(
        &self,
        handle: Option<&Handle>,
        reference: u32,
        n: Option<usize>,
    ) -> (Status, Vec<u32>) {
        match &self.special {
            Special::Fmi2(_) => (fmi_capi::ERROR, Vec::new()),
            Special::Fmi3(f) => f.dependencies(of(handle), reference, n),
        }
    }

    /// Questions that only FMI 2.0 has.
    pub(crate) fn inquire(
        &self,
        handle: Option<&Handle>,
        inquiry: Inquiry,
        kind: i32,
        null: bool,
    ) -> (Status, u64) {
        match &self.special {
            Special::Fmi2(f) => f.inquire(of(handle), inquiry, kind, null),
            Special::Fmi3(_) => (fmi_capi::ERROR, 0),
        }
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

    pub(crate) fn directional(
        &self,
        handle: Option<&Handle>,
        adjoint: bool,
        (mut unknowns, mut knowns): (Array<u32>, Array<u32>),
        (mut seed, mut sensitivity): (Array<f64>, Array<f64>),
    ) -> Status {
        let (n_unknowns, n_knowns) = (unknowns.len(), knowns.len());
        let (n_seed, n_sensitivity) = (seed.len(), sensitivity.len());
        let (unknowns, knowns) = (unknowns.pointer(), knowns.pointer());
        let (seed, sensitivity) = (seed.pointer(), sensitivity.pointer());
        // SAFETY: see `of`.
        unsafe {
            match &self.special {
                Special::Fmi2(f) => {
                    (f.directional)(of(handle), unknowns, n_unknowns, knowns, n_knowns, seed, sensitivity)
                }
                Special::Fmi3(f) => (if adjoint { f.adjoint } else { f.directional })(
                    of(handle),
                    unknowns,
                    n_unknowns,
                    knowns,
                    n_knowns,
                    seed,
                    n_seed,
                    sensitivity,
                    n_sensitivity,
                ),
            }
        }
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

    /// The state as bytes, asked for with `surplus` more of them than it has.
    pub(crate) fn serialize(
        &self,
        handle: Option<&Handle>,
        state: &SavedState,
        surplus: isize,
    ) -> (Status, Vec<u8>) {
        let mut size = 0;
        // SAFETY: see `of`; null or a state of this library.
        let status = unsafe { (self.f.state_size)(of(handle), state.0, &raw mut size) };
        if status != fmi_capi::OK {
            return (status, Vec::new());
        }
        let size = size.saturating_add_signed(surplus);
        let mut bytes = vec![0_u8; size];
        // SAFETY: as above; `bytes` has the size that the call says.
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

/// Get and Set of one type: its functions, and what is called in FMI 2.0.
macro_rules! access {
    ($($get:ident $set:ident $type:ty, $get2:expr, $set2:expr;)*) => {
        impl Api {
            $(
                pub(crate) fn $get(&self, handle: Option<&Handle>, mut references: Array<u32>, mut values: Array<$type>) -> Status {
                    let (n, n_values) = (references.len(), values.len());
                    match &self.special {
                        Special::Fmi2(f) => $get2(f, of(handle), references, values),
                        // SAFETY: see `of`.
                        Special::Fmi3(f) => unsafe { (f.$get)(of(handle), references.pointer(), n, values.pointer(), n_values) },
                    }
                }

                pub(crate) fn $set(&self, handle: Option<&Handle>, mut references: Array<u32>, mut values: Array<$type>) -> Status {
                    let (n, n_values) = (references.len(), values.len());
                    match &self.special {
                        Special::Fmi2(f) => $set2(f, of(handle), references, values),
                        // SAFETY: see `of`.
                        Special::Fmi3(f) => unsafe { (f.$set)(of(handle), references.pointer(), n, values.pointer(), n_values) },
                    }
                }
            )*
        }
    };
}

/// A function of FMI 2.0 with as many values as references.
macro_rules! plain {
    ($function:ident $type:ty) => {
        |f: &fmi2::Functions, instance, mut references: Array<u32>, mut values: Array<$type>| {
            // SAFETY: see `of`; there are as many values as references, see `generate`.
            unsafe { (f.$function)(instance, references.pointer(), references.len(), values.pointer()) }
        }
    };
}

access! {
    get_float64 set_float64 f64, plain!(get_real f64), plain!(set_real f64);
    get_int32 set_int32 i32, plain!(get_integer i32), plain!(set_integer i32);
    get_int64 set_int64 i64, |_, _, _, _| fmi_capi::ERROR, |_, _, _, _| fmi_capi::ERROR;
    get_boolean set_boolean u8, fmi2::Functions::get_flags, fmi2::Functions::set_flags;
    get_float32 set_float32 f32,
        |f: &fmi2::Functions, instance, references, _| f.strings(instance, false, references),
        |f: &fmi2::Functions, instance, references, _| f.strings(instance, true, references);
}
