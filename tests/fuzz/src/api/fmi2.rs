//! Functions of FMI 2.0 that have other signatures in FMI 3.0, or none.

use std::ffi::{CStr, c_char, c_int};
use std::ptr;

use fmi_capi::fmi2::{self, Callbacks, EventInfo, Flag};
use fmi_capi::fmi3::{self, Instance};
use fmi_capi::{Log, OK, Status, log_format};

use super::{Array, Inquiry, Stepped, Transition, Updated, library_functions, unless};
use crate::standard::Interface;

library_functions! {
    instantiate: fmi2::Instantiate = "fmi2Instantiate";
    set_debug_logging: fmi2::SetDebugLogging = "fmi2SetDebugLogging";
    setup_experiment: fmi2::SetupExperiment = "fmi2SetupExperiment";
    enter_initialization: fmi3::Simple = "fmi2EnterInitializationMode";
    cancel_step: fmi3::Simple = "fmi2CancelStep";
    new_discrete_states: fmi2::NewDiscreteStates = "fmi2NewDiscreteStates";
    completed_integrator_step: fmi2::CompletedIntegratorStep = "fmi2CompletedIntegratorStep";
    do_step: fmi2::DoStep = "fmi2DoStep";
    get_real: fmi2::Get<f64> = "fmi2GetReal";
    get_integer: fmi2::Get<i32> = "fmi2GetInteger";
    get_boolean: fmi2::Get<Flag> = "fmi2GetBoolean";
    get_string: fmi2::Get<*const c_char> = "fmi2GetString";
    set_real: fmi2::Set<f64> = "fmi2SetReal";
    set_integer: fmi2::Set<i32> = "fmi2SetInteger";
    set_boolean: fmi2::Set<Flag> = "fmi2SetBoolean";
    set_string: fmi2::Set<*const c_char> = "fmi2SetString";
    directional: fmi2::DirectionalDerivative = "fmi2GetDirectionalDerivative";
    status: fmi2::GetStatus<Status> = "fmi2GetStatus";
    real_status: fmi2::GetStatus<f64> = "fmi2GetRealStatus";
    integer_status: fmi2::GetStatus<c_int> = "fmi2GetIntegerStatus";
    boolean_status: fmi2::GetStatus<Flag> = "fmi2GetBooleanStatus";
    string_status: fmi2::GetStatus<*const c_char> = "fmi2GetStringStatus";
    input_derivatives: fmi2::InputDerivatives = "fmi2SetRealInputDerivatives";
    output_derivatives: fmi2::OutputDerivatives = "fmi2GetRealOutputDerivatives";
}

/// `fmi2LastSuccessfulTime`
const LAST_SUCCESSFUL_TIME: c_int = 2;

/// A flag as FMI 3.0 has it; 7 for what is neither.
fn flag(value: Flag) -> u8 {
    u8::try_from(value).unwrap_or(7)
}

impl Functions {
    pub(super) fn instantiate(
        &self,
        interface: Interface,
        token: &CStr,
        resources: *const c_char,
        log: &Log,
    ) -> (Instance, Box<Callbacks>) {
        let callbacks = Box::new(Callbacks {
            logger: Some(log_format),
            allocate: None,
            free: None,
            step_finished: None,
            environment: ptr::from_ref::<Log>(log).cast_mut().cast(),
        });
        let kind = c_int::from(interface == Interface::CoSimulation2);
        // SAFETY: the strings live; log and callbacks are dropped after the instance is freed, and stay where they are.
        let instance = unsafe {
            (self.instantiate)(c"fuzz".as_ptr(), kind, token.as_ptr(), resources, &raw const *callbacks, 0, 1)
        };
        (instance, callbacks)
    }

    pub(super) fn enter_initialization(&self, instance: Instance, start: f64, stop: Option<f64>) -> Status {
        let defined = Flag::from(stop.is_some());
        // SAFETY: see `of`; the same below.
        let status =
            unsafe { (self.setup_experiment)(instance, 0, 0.0, start, defined, stop.unwrap_or(f64::NAN)) };
        if status == OK { unsafe { (self.enter_initialization)(instance) } } else { status }
    }

    /// FMI 3.0's transitions are not there; this one is not in FMI 3.0.
    pub(super) fn transition(&self, instance: Instance, _transition: Transition) -> Status {
        // SAFETY: see `of`.
        unsafe { (self.cancel_step)(instance) }
    }

    /// A step; where the instance stands then is asked for.
    pub(super) fn do_step(&self, instance: Instance, (t, step): (f64, f64)) -> (Status, Stepped) {
        let mut stepped = Stepped { event: 0, terminate: 0, early: 0, last: f64::NAN };
        // SAFETY: see `of`; the same below.
        let status = unsafe { (self.do_step)(instance, t, step, 1) };
        if status != fmi_capi::ERROR {
            unsafe { (self.real_status)(instance, LAST_SUCCESSFUL_TIME, &raw mut stepped.last) };
        }
        (status, stepped)
    }

    pub(super) fn update(&self, instance: Instance, null: Option<usize>) -> (Status, Updated) {
        let mut info = EventInfo { flags: [7; 5], next: 0.0 };
        let pointer = if null.is_some() { ptr::null_mut() } else { &raw mut info };
        // SAFETY: see `of`.
        let status = unsafe { (self.new_discrete_states)(instance, pointer) };
        (status, Updated { flags: info.flags.map(flag), next: info.next })
    }

    pub(super) fn completed_step(&self, instance: Instance, null: Option<usize>) -> (Status, [u8; 2]) {
        let (mut event, mut terminate) = (7, 7);
        // SAFETY: see `of`.
        let status = unsafe {
            let (event, terminate) = (unless(&raw mut event, null, 0), unless(&raw mut terminate, null, 1));
            (self.completed_integrator_step)(instance, 1, event, terminate)
        };
        (status, [flag(event), flag(terminate)])
    }

    pub(super) fn get_flags(
        &self,
        instance: Instance,
        mut references: Array<u32>,
        Array { items, null }: Array<u8>,
    ) -> Status {
        let mut flags = vec![77; items.len()];
        let pointer = if null { ptr::null_mut() } else { flags.as_mut_ptr() };
        // SAFETY: see `of`.
        let status = unsafe { (self.get_boolean)(instance, references.pointer(), references.len(), pointer) };
        for (value, given) in items.iter_mut().zip(flags) {
            *value = flag(given);
        }
        status
    }

    pub(super) fn set_flags(
        &self,
        instance: Instance,
        mut references: Array<u32>,
        Array { items, null }: Array<u8>,
    ) -> Status {
        let flags: Vec<_> = items.iter().map(|value| Flag::from(*value)).collect();
        let pointer = if null { ptr::null() } else { flags.as_ptr() };
        // SAFETY: see `of`.
        unsafe { (self.set_boolean)(instance, references.pointer(), references.len(), pointer) }
    }

    /// Strings, of which there are none.
    pub(super) fn strings(&self, instance: Instance, set: bool, mut references: Array<u32>) -> Status {
        let mut texts = vec![c"".as_ptr(); references.len()];
        let (pointer, n) = (references.pointer(), references.len());
        // SAFETY: see `of`.
        unsafe {
            if set {
                (self.set_string)(instance, pointer, n, texts.as_ptr())
            } else {
                (self.get_string)(instance, pointer, n, texts.as_mut_ptr())
            }
        }
    }

    /// Questions about the last step; what is answered, as bits.
    pub(super) fn inquire(
        &self,
        instance: Instance,
        inquiry: Inquiry,
        kind: i32,
        null: bool,
    ) -> (Status, u64) {
        /// One type.
        macro_rules! ask {
            ($f:expr, $empty:expr, $bits:expr) => {{
                let mut value = $empty;
                // SAFETY: see `of`.
                let status =
                    unsafe { $f(instance, kind, if null { ptr::null_mut() } else { &raw mut value }) };
                (status, $bits(value))
            }};
        }
        match inquiry {
            Inquiry::Status => ask!((self.status), 0, |_| 0),
            Inquiry::Real => ask!((self.real_status), 0.0, f64::to_bits),
            Inquiry::Integer => ask!((self.integer_status), 0, |_| 0),
            Inquiry::Boolean => ask!((self.boolean_status), 7, |v| u64::from(flag(v))),
            Inquiry::String => ask!((self.string_status), ptr::null(), |_| 0),
            Inquiry::InputDerivatives => {
                // SAFETY: see `of`; the same below.
                (unsafe { (self.input_derivatives)(instance, &0, 1, &1, &0.0) }, 0)
            }
            Inquiry::OutputDerivatives => {
                let mut value = 0.0;
                (unsafe { (self.output_derivatives)(instance, &0, 1, &1, &raw mut value) }, 0)
            }
        }
    }
}
