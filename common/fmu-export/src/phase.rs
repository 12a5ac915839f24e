//! The state machine of FMI 3.0 Co-Simulation as a table: which function may be called when.

/// Where an instance stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Phase {
    /// Created or reset
    Instantiated = 1,
    /// Between Enter- and `ExitInitializationMode`
    InitializationMode = 2,
    /// Ready for `DoStep`
    StepMode = 4,
    /// After Terminate
    Terminated = 8,
    /// After a caught panic: only freeing is left
    Broken = 16,
}

use Phase::{InitializationMode, Instantiated, StepMode, Terminated};

const ANY: u8 = Instantiated as u8 | InitializationMode as u8 | StepMode as u8 | Terminated as u8;
const RUNNING: u8 = InitializationMode as u8 | StepMode as u8 | Terminated as u8;
const SETTABLE: u8 = Instantiated as u8 | InitializationMode as u8 | StepMode as u8;

/// When a function may be called.
#[derive(Debug, Clone, Copy)]
pub struct Rule {
    /// The function
    pub function: &'static str,
    phases: u8,
}

/// A row of the table.
macro_rules! rules {
    ($($name:ident $function:literal $phases:expr;)*) => {
        $(
            #[doc = concat!("Rule of `", $function, "`.")]
            pub(crate) const $name: Rule = Rule { function: $function, phases: $phases };
        )*
        /// The table.
        #[cfg(test)]
        const ALL: &[Rule] = &[$($name),*];
    };
}

rules! {
    SET_DEBUG_LOGGING "fmi3SetDebugLogging" ANY;
    ENTER_INITIALIZATION "fmi3EnterInitializationMode" Instantiated as u8;
    EXIT_INITIALIZATION "fmi3ExitInitializationMode" InitializationMode as u8;
    DO_STEP "fmi3DoStep" StepMode as u8;
    TERMINATE "fmi3Terminate" StepMode as u8;
    RESET "fmi3Reset" ANY;
    GET_FLOAT64 "fmi3GetFloat64" RUNNING;
    GET_INT32 "fmi3GetInt32" RUNNING;
    GET_INT64 "fmi3GetInt64" RUNNING;
    GET_BOOLEAN "fmi3GetBoolean" RUNNING;
    GET_OTHER "fmi3Get{VariableType}" RUNNING;
    SET_FLOAT64 "fmi3SetFloat64" SETTABLE;
    SET_INT32 "fmi3SetInt32" SETTABLE;
    SET_INT64 "fmi3SetInt64" SETTABLE;
    SET_BOOLEAN "fmi3SetBoolean" SETTABLE;
    SET_OTHER "fmi3Set{VariableType}" SETTABLE;
    GET_FMU_STATE "fmi3GetFMUState" ANY;
    SET_FMU_STATE "fmi3SetFMUState" ANY;
    FREE_FMU_STATE "fmi3FreeFMUState" ANY;
    DIRECTIONAL_DERIVATIVE "fmi3GetDirectionalDerivative" RUNNING;
    DEPENDENCIES "fmi3GetVariableDependencies" ANY;
    UNSUPPORTED "" ANY;
}

impl Rule {
    /// True if the function may be called in `phase`.
    #[inline]
    #[must_use]
    pub const fn allows(&self, phase: Phase) -> bool {
        self.phases & phase as u8 != 0
    }

    /// The phases in which the function may be called, for a message.
    #[must_use]
    pub fn allowed(&self) -> String {
        [Instantiated, InitializationMode, StepMode, Terminated]
            .into_iter()
            .filter(|p| self.allows(*p))
            .map(|p| format!("{p:?}"))
            .collect::<Vec<_>>()
            .join(", ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The state machine of the standard (FMI 3.0, 4.2.1), one line per transition function.
    #[test]
    fn transitions_start_where_the_standard_says() {
        for (rule, from) in [
            (ENTER_INITIALIZATION, Instantiated),
            (EXIT_INITIALIZATION, InitializationMode),
            (DO_STEP, StepMode),
            (TERMINATE, StepMode),
        ] {
            assert_eq!(rule.allowed(), format!("{from:?}"), "{}", rule.function);
        }
    }

    #[test]
    fn nothing_but_freeing_is_left_after_a_panic() {
        assert!(ALL.iter().all(|r| !r.allows(Phase::Broken)));
    }
}
