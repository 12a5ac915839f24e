//! Functions of FMI 3.0 that have other signatures in FMI 2.0, or none.

use std::ffi::{CStr, c_char};
use std::ptr;

use fmi_capi::fmi3::{self, Flag, Instance};
use fmi_capi::{Log, Status, log_message};

use super::{Stepped, Transition, Updated, library_functions, unless};
use crate::standard::Interface;

library_functions! {
    instantiate_co_simulation: fmi3::InstantiateCoSimulation = "fmi3InstantiateCoSimulation";
    instantiate_model_exchange: fmi3::InstantiateModelExchange = "fmi3InstantiateModelExchange";
    set_debug_logging: fmi3::SetDebugLogging = "fmi3SetDebugLogging";
    enter_initialization: fmi3::EnterInitialization = "fmi3EnterInitializationMode";
    enter_step_mode: fmi3::Simple = "fmi3EnterStepMode";
    enter_configuration_mode: fmi3::Simple = "fmi3EnterConfigurationMode";
    exit_configuration_mode: fmi3::Simple = "fmi3ExitConfigurationMode";
    evaluate_discrete_states: fmi3::Simple = "fmi3EvaluateDiscreteStates";
    update_discrete_states: fmi3::UpdateDiscreteStates = "fmi3UpdateDiscreteStates";
    completed_integrator_step: fmi3::CompletedIntegratorStep = "fmi3CompletedIntegratorStep";
    do_step: fmi3::DoStep = "fmi3DoStep";
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
    count_states: fmi3::Count = "fmi3GetNumberOfContinuousStates";
    count_indicators: fmi3::Count = "fmi3GetNumberOfEventIndicators";
    directional: fmi3::DirectionalDerivative = "fmi3GetDirectionalDerivative";
    adjoint: fmi3::DirectionalDerivative = "fmi3GetAdjointDerivative";
    count_dependencies: fmi3::CountDependencies = "fmi3GetNumberOfVariableDependencies";
    dependencies: fmi3::Dependencies = "fmi3GetVariableDependencies";
}

impl Functions {
    pub(super) fn instantiate(
        &self,
        interface: Interface,
        token: &CStr,
        resources: *const c_char,
        log: &Log,
    ) -> Instance {
        let environment = ptr::from_ref::<Log>(log).cast_mut().cast();
        let name = c"fuzz".as_ptr();
        // SAFETY: the strings live; the log is dropped after the instance is freed, and stays where it is.
        unsafe {
            if interface == Interface::ModelExchange {
                (self.instantiate_model_exchange)(
                    name,
                    token.as_ptr(),
                    resources,
                    0,
                    1,
                    environment,
                    Some(log_message),
                )
            } else {
                let events = Flag::from(interface == Interface::CoSimulationWithEvents);
                (self.instantiate_co_simulation)(
                    name,
                    token.as_ptr(),
                    resources,
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
        }
    }

    pub(super) fn enter_initialization(&self, instance: Instance, start: f64, stop: Option<f64>) -> Status {
        let defined = Flag::from(stop.is_some());
        // SAFETY: see `of`.
        unsafe { (self.enter_initialization)(instance, 0, 0.0, start, defined, stop.unwrap_or(f64::NAN)) }
    }

    /// The transitions that FMI 2.0 does not have.
    pub(super) fn transition(&self, instance: Instance, transition: Transition) -> Status {
        let f = match transition {
            Transition::EnterStepMode => self.enter_step_mode,
            Transition::EnterConfigurationMode => self.enter_configuration_mode,
            Transition::ExitConfigurationMode => self.exit_configuration_mode,
            _ => self.evaluate_discrete_states,
        };
        // SAFETY: see `of`.
        unsafe { f(instance) }
    }

    pub(super) fn do_step(
        &self,
        instance: Instance,
        (t, step): (f64, f64),
        null: Option<usize>,
    ) -> (Status, Stepped) {
        let mut s = Stepped { event: 7, terminate: 7, early: 7, last: f64::NAN };
        let (event, terminate, early) = (&raw mut s.event, &raw mut s.terminate, &raw mut s.early);
        let last = unless(&raw mut s.last, null, 3);
        let (event, terminate, early) =
            (unless(event, null, 0), unless(terminate, null, 1), unless(early, null, 2));
        // SAFETY: see `of`.
        let status = unsafe { (self.do_step)(instance, t, step, 0, event, terminate, early, last) };
        (status, s)
    }

    pub(super) fn update(&self, instance: Instance, null: Option<usize>) -> (Status, Updated) {
        let mut updated = Updated { flags: [7; 5], next: 0.0 };
        let mut pointers = [ptr::null_mut(); 5];
        for (i, (pointer, flag)) in pointers.iter_mut().zip(&mut updated.flags).enumerate() {
            *pointer = unless(flag, null, i);
        }
        let [a, b, c, d, e] = pointers;
        // SAFETY: see `of`.
        let status = unsafe {
            (self.update_discrete_states)(instance, a, b, c, d, e, unless(&raw mut updated.next, null, 5))
        };
        (status, updated)
    }

    pub(super) fn completed_step(&self, instance: Instance, null: Option<usize>) -> (Status, [Flag; 2]) {
        let (mut event, mut terminate) = (7, 7);
        // SAFETY: see `of`.
        let status = unsafe {
            let (event, terminate) = (unless(&raw mut event, null, 0), unless(&raw mut terminate, null, 1));
            (self.completed_integrator_step)(instance, 0, event, terminate)
        };
        (status, [event, terminate])
    }

    pub(super) fn count(&self, instance: Instance, states: bool, null: bool) -> (Status, usize) {
        let f = if states { self.count_states } else { self.count_indicators };
        let mut n = usize::MAX;
        // SAFETY: see `of`.
        let status = unsafe { f(instance, if null { ptr::null_mut() } else { &raw mut n }) };
        (status, n)
    }

    /// Number of dependencies, then the list for `n` of them.
    pub(super) fn dependencies(
        &self,
        instance: Instance,
        reference: u32,
        n: Option<usize>,
    ) -> (Status, Vec<u32>) {
        let mut count = 0;
        // SAFETY: see `of`.
        let status = unsafe { (self.count_dependencies)(instance, reference, &raw mut count) };
        let n = n.unwrap_or(count);
        if status != fmi_capi::OK && n == 0 {
            return (status, Vec::new());
        }
        let (mut elements, mut independents, mut others) = (vec![0; n], vec![0_u32; n], vec![0; n]);
        let mut kinds = vec![0; n];
        // SAFETY: see `of`; all lists have n places.
        let status = unsafe {
            (self.dependencies)(
                instance,
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
}
