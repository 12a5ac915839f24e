//! Every exported function against its type in the header, grouped by the number of arguments.

use crate::same::Same;

/// A function of the type `F` stands where the header wants an `S`; `_field` is where `fmi-sys` has it.
const fn same<F: Copy + Same<S>, S, B, E>(_here: F, _field: fn(&B) -> &Result<S, E>) {}

/// Checks at compile time; `$names` are the functions checked.
macro_rules! check {
    ($names:ident $standard:ident $binding:ident $($module:ident)*: $($arguments:tt: $($name:ident)*;)*) => {
        mod $standard {
            use fmi_sys::$standard::$binding;
            use super::same;
            $(use crate::$module::*;)*
            $($(
                const _: () = {
                    let here: unsafe extern "C" fn $arguments -> _ = $name;
                    same(here, |binding: &$binding| &binding.$name);
                };
            )*)*
        }
        #[cfg(test)]
        const $names: &[&str] = &[$($(stringify!($name)),*),*];
    };
}

check! { FMI2 fmi2 Fmi2Binding fmi2_functions fmi2_lifecycle fmi2_unsupported:
    (): fmi2GetTypesPlatform fmi2GetVersion;
    (_): fmi2FreeInstance fmi2EnterInitializationMode fmi2ExitInitializationMode fmi2Terminate fmi2Reset
        fmi2EnterEventMode fmi2EnterContinuousTimeMode fmi2CancelStep;
    (_, _): fmi2GetFMUstate fmi2SetFMUstate fmi2FreeFMUstate fmi2NewDiscreteStates fmi2SetTime;
    (_, _, _): fmi2SerializedFMUstateSize fmi2SetContinuousStates fmi2GetDerivatives
        fmi2GetEventIndicators fmi2GetContinuousStates fmi2GetNominalsOfContinuousStates fmi2GetStatus
        fmi2GetRealStatus fmi2GetIntegerStatus fmi2GetBooleanStatus fmi2GetStringStatus;
    (_, _, _, _): fmi2SetDebugLogging fmi2GetReal fmi2GetInteger fmi2GetBoolean fmi2GetString fmi2SetReal
        fmi2SetInteger fmi2SetBoolean fmi2SetString fmi2SerializeFMUstate fmi2DeSerializeFMUstate
        fmi2CompletedIntegratorStep fmi2DoStep;
    (_, _, _, _, _): fmi2SetRealInputDerivatives fmi2GetRealOutputDerivatives;
    (_, _, _, _, _, _): fmi2SetupExperiment;
    (_, _, _, _, _, _, _): fmi2Instantiate fmi2GetDirectionalDerivative;
}
check! { FMI3 fmi3 Fmi3Binding fmi3_functions fmi3_lifecycle fmi3_other_types fmi3_unsupported:
    (): fmi3GetVersion;
    (_): fmi3FreeInstance fmi3ExitInitializationMode fmi3Terminate fmi3Reset fmi3EnterEventMode
        fmi3EnterStepMode fmi3EnterContinuousTimeMode fmi3EvaluateDiscreteStates
        fmi3EnterConfigurationMode fmi3ExitConfigurationMode;
    (_, _): fmi3SetTime fmi3GetNumberOfContinuousStates fmi3GetNumberOfEventIndicators fmi3GetFMUState
        fmi3SetFMUState fmi3FreeFMUState;
    (_, _, _): fmi3SetContinuousStates fmi3GetContinuousStates fmi3GetContinuousStateDerivatives
        fmi3GetNominalsOfContinuousStates fmi3GetEventIndicators fmi3GetNumberOfVariableDependencies
        fmi3SerializedFMUStateSize fmi3ActivateModelPartition;
    (_, _, _, _): fmi3SetDebugLogging fmi3CompletedIntegratorStep fmi3SerializeFMUState
        fmi3DeserializeFMUState fmi3GetClock fmi3SetClock fmi3GetShiftDecimal fmi3SetIntervalDecimal
        fmi3SetShiftDecimal;
    (_, _, _, _, _): fmi3GetFloat32 fmi3GetFloat64 fmi3GetInt8 fmi3GetUInt8 fmi3GetInt16 fmi3GetUInt16
        fmi3GetInt32 fmi3GetUInt32 fmi3GetInt64 fmi3GetUInt64 fmi3GetBoolean fmi3GetString fmi3SetFloat32
        fmi3SetFloat64 fmi3SetInt8 fmi3SetUInt8 fmi3SetInt16 fmi3SetUInt16 fmi3SetInt32 fmi3SetUInt32
        fmi3SetInt64 fmi3SetUInt64 fmi3SetBoolean fmi3SetString fmi3GetIntervalDecimal
        fmi3GetShiftFraction fmi3SetIntervalFraction fmi3SetShiftFraction;
    (_, _, _, _, _, _): fmi3EnterInitializationMode fmi3GetBinary fmi3SetBinary fmi3GetIntervalFraction
        fmi3GetOutputDerivatives;
    (_, _, _, _, _, _, _): fmi3UpdateDiscreteStates fmi3InstantiateModelExchange
        fmi3GetVariableDependencies;
    (_, _, _, _, _, _, _, _): fmi3DoStep;
    (_, _, _, _, _, _, _, _, _): fmi3GetDirectionalDerivative fmi3GetAdjointDerivative;
    (_, _, _, _, _, _, _, _, _, _): fmi3InstantiateScheduledExecution;
    (_, _, _, _, _, _, _, _, _, _, _, _): fmi3InstantiateCoSimulation;
}

/// The text of the macros that export is the list of what is exported.
#[test]
fn no_exported_function_is_left_out() {
    let text = include_str!("../../../common/fmu-export/src/c_abi/export.rs");
    let words = text.split(|c: char| !c.is_alphanumeric() && c != '_');
    let function = |w: &&str| {
        ["fmi2", "fmi3"].iter().any(|p| w.strip_prefix(p).is_some_and(|w| w.starts_with(char::is_uppercase)))
    };
    let exported: std::collections::BTreeSet<_> = words.filter(function).collect();
    assert_eq!(exported, [FMI2, FMI3].concat().into_iter().collect());
    assert_eq!((FMI2.len(), FMI3.len()), (44, 75), "as many as the headers declare");
}
