//! The exported symbols of an FMU, made by a macro because each needs its instance.

/// Export a model: all functions of FMI 2.0 and 3.0 with the model behind them.
///
/// The whole text of an FMU crate: `fmu_export::export!(models::suspension::DoubleWishbone);`
#[macro_export]
macro_rules! export {
    ($model:ty) => {
        $crate::export_instance! { $crate::Instance<$model> }
    };
}

/// Export any [`Exported`](crate::Exported) instance in the same way.
#[macro_export]
macro_rules! export_instance {
    ($instance:ty) => {
        $crate::export_fmi2! { $instance }
        $crate::export_fmi3! { $instance }
    };
}

/// The functions of FMI 2.0.
#[doc(hidden)]
#[macro_export]
macro_rules! export_fmi2 {
    ($instance:ty) => {
        $crate::functions! { $instance, fmi2_functions fmi2,
            // inquire and log
            fmi2SetDebugLogging(logging_on: i32, n: usize, categories: *const *const c_char);
            // initialise, reset, end
            fmi2EnterInitializationMode();
            fmi2ExitInitializationMode();
            fmi2Terminate();
            fmi2Reset();
            // values
            fmi2GetReal(vr: *const u32, n: usize, values: *mut f64);
            fmi2GetInteger(vr: *const u32, n: usize, values: *mut i32);
            fmi2GetBoolean(vr: *const u32, n: usize, values: *mut i32);
            fmi2GetString(vr: *const u32, n: usize, values: *mut *const c_char);
            fmi2SetReal(vr: *const u32, n: usize, values: *const f64);
            fmi2SetInteger(vr: *const u32, n: usize, values: *const i32);
            fmi2SetBoolean(vr: *const u32, n: usize, values: *const i32);
            fmi2SetString(vr: *const u32, n: usize, values: *const *const c_char);
            // derivatives
            fmi2GetDirectionalDerivative(unknowns: *const u32, n_unknowns: usize, knowns: *const u32, n_knowns: usize, seed: *const f64, sensitivity: *mut f64);
            // state
            fmi2GetFMUstate(state: *mut *mut c_void);
            fmi2SetFMUstate(state: *mut c_void);
            fmi2FreeFMUstate(state: *mut *mut c_void);
            fmi2SerializedFMUstateSize(state: *mut c_void, size: *mut usize);
            fmi2SerializeFMUstate(state: *mut c_void, data: *mut c_char, size: usize);
            fmi2DeSerializeFMUstate(data: *const c_char, size: usize, state: *mut *mut c_void);
            // Model Exchange
            fmi2EnterEventMode();
            fmi2NewDiscreteStates(info: *mut EventInfo);
            fmi2EnterContinuousTimeMode();
            fmi2CompletedIntegratorStep(no_set_state_prior: i32, enter_event_mode: *mut i32, terminate: *mut i32);
            fmi2SetTime(time: f64);
            fmi2SetContinuousStates(states: *const f64, n: usize);
            fmi2GetDerivatives(derivatives: *mut f64, n: usize);
            fmi2GetEventIndicators(indicators: *mut f64, n: usize);
            fmi2GetContinuousStates(states: *mut f64, n: usize);
            fmi2GetNominalsOfContinuousStates(nominals: *mut f64, n: usize);
            // Co-Simulation
            fmi2GetStatus(kind: u32, value: *mut Status);
            fmi2GetRealStatus(kind: u32, value: *mut f64);
            fmi2GetIntegerStatus(kind: u32, value: *mut i32);
            fmi2GetBooleanStatus(kind: u32, value: *mut i32);
            fmi2GetStringStatus(kind: u32, value: *mut *const c_char);
        }
        $crate::unsupported! { $instance, fmi2_unsupported fmi2,
            "inputs go on as port.inputs says":
            fmi2SetRealInputDerivatives(vr: *const u32, n: usize, orders: *const i32, values: *const f64);
            "maxOutputDerivativeOrder = 0":
            fmi2GetRealOutputDerivatives(vr: *const u32, n: usize, orders: *const i32, values: *mut f64);
            "no step goes on in the background":
            fmi2CancelStep();
        }

        #[allow(unsafe_code, non_snake_case, missing_docs, unused_variables, clippy::too_many_arguments, clippy::missing_safety_doc, reason = "C interface of FMI 2.0")]
        mod fmi2_lifecycle {
            use std::ffi::{c_char, c_void};
            use $crate::Status;
            use $crate::c_abi::fmi2;

            #[unsafe(no_mangle)]
            pub extern "C" fn fmi2GetTypesPlatform() -> *const c_char {
                fmi2::fmi2GetTypesPlatform()
            }
            #[unsafe(no_mangle)]
            pub extern "C" fn fmi2GetVersion() -> *const c_char {
                fmi2::fmi2GetVersion()
            }
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmi2Instantiate(
                name: *const c_char, interface: u32, guid: *const c_char, resources: *const c_char,
                functions: *const fmi2::CallbackFunctions, visible: i32, logging_on: i32,
            ) -> *mut c_void {
                // SAFETY: the arguments as the host passes them.
                unsafe { fmi2::fmi2Instantiate::<$instance>(name, interface, guid, resources, functions) }
            }
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmi2FreeInstance(instance: *mut c_void) {
                // SAFETY: the instance as the host passes it.
                unsafe { fmi2::fmi2FreeInstance::<$instance>(instance) }
            }
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmi2SetupExperiment(
                instance: *mut c_void, tolerance_defined: i32, tolerance: f64, start: f64, stop_defined: i32, stop: f64,
            ) -> Status {
                // SAFETY: the arguments as the host passes them.
                unsafe { fmi2::fmi2SetupExperiment::<$instance>(instance, start, stop_defined, stop) }
            }
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmi2DoStep(
                instance: *mut c_void, t: f64, step: f64, no_set_state_prior: i32,
            ) -> Status {
                // SAFETY: the arguments as the host passes them.
                unsafe { fmi2::fmi2DoStep::<$instance>(instance, t, step) }
            }
        }
    };
}

/// The functions of FMI 3.0.
#[doc(hidden)]
#[macro_export]
macro_rules! export_fmi3 {
    ($instance:ty) => {
        $crate::functions! { $instance, fmi3_functions fmi3,
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
            fmi3GetVariableDependencies(dependent: u32, i_dependent: *mut usize, independents: *mut u32, i_independents: *mut usize, kinds: *mut u32, n: usize);
            fmi3GetDirectionalDerivative(unknowns: *const u32, n_unknowns: usize, knowns: *const u32, n_knowns: usize, seed: *const f64, n_seed: usize, sensitivity: *mut f64, n_sensitivity: usize);
            // state
            fmi3GetFMUState(state: *mut *mut c_void);
            fmi3SetFMUState(state: *mut c_void);
            fmi3FreeFMUState(state: *mut *mut c_void);
            fmi3SerializedFMUStateSize(state: *mut c_void, size: *mut usize);
            fmi3SerializeFMUState(state: *mut c_void, data: *mut u8, size: usize);
            fmi3DeserializeFMUState(data: *const u8, size: usize, state: *mut *mut c_void);
        }
        $crate::no_variables! { $instance,
            fmi3GetFloat32 "Float32" true *mut f32; fmi3GetInt8 "Int8" true *mut i8; fmi3GetUInt8 "UInt8" true *mut u8;
            fmi3GetInt16 "Int16" true *mut i16; fmi3GetUInt16 "UInt16" true *mut u16; fmi3GetUInt32 "UInt32" true *mut u32;
            fmi3GetUInt64 "UInt64" true *mut u64; fmi3GetString "String" true *mut *const c_char;
            fmi3SetFloat32 "Float32" false *const f32; fmi3SetInt8 "Int8" false *const i8; fmi3SetUInt8 "UInt8" false *const u8;
            fmi3SetInt16 "Int16" false *const i16; fmi3SetUInt16 "UInt16" false *const u16; fmi3SetUInt32 "UInt32" false *const u32;
            fmi3SetUInt64 "UInt64" false *const u64; fmi3SetString "String" false *const *const c_char;
        }
        $crate::unsupported! { $instance, fmi3_unsupported fmi3,
            "there are no Binary variables":
            fmi3GetBinary(vr: *const u32, n: usize, sizes: *mut usize, values: *mut *const u8, n_values: usize);
            fmi3SetBinary(vr: *const u32, n: usize, sizes: *const usize, values: *const *const u8, n_values: usize);
            "there are no clocks":
            fmi3GetClock(vr: *const u32, n: usize, values: *mut u8);
            fmi3SetClock(vr: *const u32, n: usize, values: *const u8);
            fmi3GetIntervalDecimal(vr: *const u32, n: usize, intervals: *mut f64, qualifiers: *mut u32);
            fmi3GetIntervalFraction(vr: *const u32, n: usize, counters: *mut u64, resolutions: *mut u64, qualifiers: *mut u32);
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
            use $crate::Status;
            use $crate::c_abi::{LogMessage, fmi3};

            #[unsafe(no_mangle)]
            pub extern "C" fn fmi3GetVersion() -> *const c_char {
                fmi3::fmi3GetVersion()
            }
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmi3InstantiateCoSimulation(
                name: *const c_char, token: *const c_char, resources: *const c_char, visible: u8, logging_on: u8,
                event_mode_used: u8, early_return_allowed: u8, intermediate: *const u32, n_intermediate: usize,
                environment: *mut c_void, log_message: Option<LogMessage>, intermediate_update: *const c_void,
            ) -> *mut c_void {
                // SAFETY: the arguments as the host passes them.
                unsafe { fmi3::fmi3InstantiateCoSimulation::<$instance>(token, resources, event_mode_used, environment, log_message) }
            }
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmi3InstantiateModelExchange(
                name: *const c_char, token: *const c_char, resources: *const c_char, visible: u8, logging_on: u8,
                environment: *mut c_void, log_message: Option<LogMessage>,
            ) -> *mut c_void {
                // SAFETY: the arguments as the host passes them.
                unsafe { fmi3::fmi3InstantiateModelExchange::<$instance>(token, resources, environment, log_message) }
            }
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmi3InstantiateScheduledExecution(
                name: *const c_char, token: *const c_char, resources: *const c_char, visible: u8, logging_on: u8,
                environment: *mut c_void, log_message: Option<LogMessage>, clock_update: *const c_void,
                lock_preemption: *const c_void, unlock_preemption: *const c_void,
            ) -> *mut c_void {
                // SAFETY: the arguments as the host passes them.
                unsafe { fmi3::fmi3InstantiateScheduledExecution(environment, log_message) }
            }
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmi3FreeInstance(instance: *mut c_void) {
                // SAFETY: the instance as the host passes it.
                unsafe { fmi3::fmi3FreeInstance::<$instance>(instance) }
            }
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmi3EnterInitializationMode(
                instance: *mut c_void, tolerance_defined: u8, tolerance: f64, start: f64, stop_defined: u8, stop: f64,
            ) -> Status {
                // SAFETY: the arguments as the host passes them.
                unsafe { fmi3::fmi3EnterInitializationMode::<$instance>(instance, start, stop_defined, stop) }
            }
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmi3DoStep(
                instance: *mut c_void, t: f64, step: f64, no_set_state_prior: u8, event_handling_needed: *mut u8,
                terminate: *mut u8, early_return: *mut u8, last_successful_time: *mut f64,
            ) -> Status {
                // SAFETY: the arguments as the host passes them.
                unsafe { fmi3::fmi3DoStep::<$instance>(instance, t, step, event_handling_needed, terminate, early_return, last_successful_time) }
            }
        }
    };
}

/// Exported functions that hand all their arguments to the function of the same name here.
#[doc(hidden)]
#[macro_export]
macro_rules! functions {
    ($instance:ty, $module:ident $standard:ident, $($name:ident($($arg:ident: $type:ty),*);)*) => {
        #[allow(unsafe_code, non_snake_case, missing_docs, clippy::too_many_arguments, clippy::missing_safety_doc, reason = "C interface of FMI")]
        mod $module {
            use std::ffi::{c_char, c_void};
            use $crate::Status;
            use $crate::c_abi::$standard::{self, *};
            $(
                #[unsafe(no_mangle)]
                pub unsafe extern "C" fn $name(instance: *mut c_void, $($arg: $type),*) -> Status {
                    // SAFETY: the arguments as the host passes them.
                    unsafe { $standard::$name::<$instance>(instance, $($arg),*) }
                }
            )*
        }
    };
}

/// Exported Get and Set functions of types without variables.
#[doc(hidden)]
#[macro_export]
macro_rules! no_variables {
    ($instance:ty, $($name:ident $called:literal $get:literal $type:ty;)*) => {
        #[allow(unsafe_code, non_snake_case, missing_docs, unused_variables, clippy::missing_safety_doc, reason = "C interface of FMI")]
        mod fmi3_other_types {
            use std::ffi::{c_char, c_void};
            use $crate::Status;
            use $crate::c_abi::fmi3;
            $(
                #[unsafe(no_mangle)]
                pub unsafe extern "C" fn $name(instance: *mut c_void, vr: *const u32, n: usize, values: $type, n_values: usize) -> Status {
                    // SAFETY: the arguments as the host passes them.
                    unsafe { fmi3::no_variables::<$instance>(instance, $get, $called, vr, n, n_values) }
                }
            )*
        }
    };
}

/// Exported functions that are refused with a reason.
#[doc(hidden)]
#[macro_export]
macro_rules! unsupported {
    ($instance:ty, $module:ident $standard:ident, $($reason:literal: $($name:ident($($arg:ident: $type:ty),*);)*)*) => {
        #[allow(unsafe_code, non_snake_case, missing_docs, unused_variables, clippy::too_many_arguments, clippy::missing_safety_doc, reason = "C interface of FMI")]
        mod $module {
            use std::ffi::{c_char, c_void};
            use $crate::Status;
            use $crate::c_abi::$standard;
            $($(
                #[unsafe(no_mangle)]
                pub unsafe extern "C" fn $name(instance: *mut c_void, $($arg: $type),*) -> Status {
                    // SAFETY: the arguments as the host passes them.
                    unsafe { $standard::unsupported::<$instance>(instance, stringify!($name), $reason) }
                }
            )*)*
        }
    };
}
