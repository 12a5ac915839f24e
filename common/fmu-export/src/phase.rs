//! The state machines of FMI 3.0 as one table: which function may be called when, and where.

use std::fmt;

/// How an instance is used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Interface {
    /// Co-Simulation with eventModeUsed = false
    CoSimulation = 1,
    /// Co-Simulation with eventModeUsed = true
    CoSimulationWithEvents = 2,
    /// Model Exchange
    ModelExchange = 4,
}

impl Interface {
    const ALL: [Self; 3] = [Self::CoSimulation, Self::CoSimulationWithEvents, Self::ModelExchange];

    /// Where an instance stands after initialisation.
    pub(crate) const fn after_initialization(self) -> Phase {
        match self {
            Self::CoSimulation => StepMode,
            Self::CoSimulationWithEvents | Self::ModelExchange => EventMode,
        }
    }

    /// The phases that exist.
    const fn phases(self) -> u8 {
        match self {
            Self::CoSimulation => ANY & !(EventMode as u8 | ContinuousTimeMode as u8),
            Self::CoSimulationWithEvents => ANY & !(ContinuousTimeMode as u8),
            Self::ModelExchange => ANY & !(StepMode as u8),
        }
    }
}

impl fmt::Display for Interface {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::CoSimulation => "Co-Simulation with eventModeUsed = false",
            Self::CoSimulationWithEvents => "Co-Simulation with eventModeUsed = true",
            Self::ModelExchange => "Model Exchange",
        })
    }
}

/// Where an instance stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Phase {
    /// Created or reset
    Instantiated = 1,
    /// Between Enter- and `ExitInitializationMode`
    InitializationMode = 2,
    /// Ready for `DoStep` (Co-Simulation)
    StepMode = 4,
    /// Ready for `UpdateDiscreteStates`
    EventMode = 8,
    /// Under a foreign integrator (Model Exchange)
    ContinuousTimeMode = 16,
    /// After Terminate
    Terminated = 32,
    /// After a caught panic: only freeing is left
    Broken = 64,
}

use Phase::{ContinuousTimeMode, EventMode, InitializationMode, Instantiated, StepMode, Terminated};

const SETTABLE: u8 = Instantiated as u8
    | InitializationMode as u8
    | StepMode as u8
    | EventMode as u8
    | ContinuousTimeMode as u8;
const ANY: u8 = SETTABLE | Terminated as u8;
const RUNNING: u8 = ANY & !(Instantiated as u8);
const TERMINABLE: u8 = StepMode as u8 | EventMode as u8 | ContinuousTimeMode as u8;

const CS: u8 = Interface::CoSimulation as u8 | CS_EVENTS;
const CS_EVENTS: u8 = Interface::CoSimulationWithEvents as u8;
const ME: u8 = Interface::ModelExchange as u8;
const ALL_INTERFACES: u8 = CS | ME;

/// When a function may be called.
#[derive(Debug, Clone, Copy)]
pub struct Rule {
    /// The function
    pub function: &'static str,
    interfaces: u8,
    phases: u8,
}

/// A row of the table.
macro_rules! rules {
    ($($name:ident $function:literal $interfaces:ident $phases:expr;)*) => {
        $(
            #[doc = concat!("Rule of `", $function, "`.")]
            pub(crate) const $name: Rule = Rule { function: $function, interfaces: $interfaces, phases: $phases };
        )*
        /// The table.
        #[cfg(test)]
        const ALL: &[Rule] = &[$($name),*];
    };
}

rules! {
    SET_DEBUG_LOGGING "fmi3SetDebugLogging" ALL_INTERFACES ANY;
    ENTER_INITIALIZATION "fmi3EnterInitializationMode" ALL_INTERFACES Instantiated as u8;
    EXIT_INITIALIZATION "fmi3ExitInitializationMode" ALL_INTERFACES InitializationMode as u8;
    ENTER_EVENT_MODE "fmi3EnterEventMode" EVENTFUL StepMode as u8 | ContinuousTimeMode as u8;
    UPDATE_DISCRETE_STATES "fmi3UpdateDiscreteStates" EVENTFUL EventMode as u8;
    ENTER_STEP_MODE "fmi3EnterStepMode" CS_EVENTS EventMode as u8;
    DO_STEP "fmi3DoStep" CS StepMode as u8;
    TERMINATE "fmi3Terminate" ALL_INTERFACES TERMINABLE;
    RESET "fmi3Reset" ALL_INTERFACES ANY;
    GET_FLOAT64 "fmi3GetFloat64" ALL_INTERFACES ANY;
    GET_INT32 "fmi3GetInt32" ALL_INTERFACES ANY;
    GET_INT64 "fmi3GetInt64" ALL_INTERFACES ANY;
    GET_BOOLEAN "fmi3GetBoolean" ALL_INTERFACES ANY;
    GET_OTHER "fmi3Get{VariableType}" ALL_INTERFACES ANY;
    SET_FLOAT64 "fmi3SetFloat64" ALL_INTERFACES SETTABLE;
    SET_INT32 "fmi3SetInt32" ALL_INTERFACES SETTABLE;
    SET_INT64 "fmi3SetInt64" ALL_INTERFACES SETTABLE;
    SET_BOOLEAN "fmi3SetBoolean" ALL_INTERFACES SETTABLE;
    SET_OTHER "fmi3Set{VariableType}" ALL_INTERFACES SETTABLE;
    GET_FMU_STATE "fmi3GetFMUState" ALL_INTERFACES ANY;
    SET_FMU_STATE "fmi3SetFMUState" ALL_INTERFACES ANY;
    FREE_FMU_STATE "fmi3FreeFMUState" ALL_INTERFACES ANY;
    DIRECTIONAL_DERIVATIVE "fmi3GetDirectionalDerivative" ALL_INTERFACES RUNNING;
    DEPENDENCIES "fmi3GetVariableDependencies" ALL_INTERFACES ANY;
    ENTER_CONTINUOUS_TIME_MODE "fmi3EnterContinuousTimeMode" ME EventMode as u8;
    SET_TIME "fmi3SetTime" ME ContinuousTimeMode as u8;
    SET_CONTINUOUS_STATES "fmi3SetContinuousStates" ME ContinuousTimeMode as u8;
    COMPLETED_INTEGRATOR_STEP "fmi3CompletedIntegratorStep" ME ContinuousTimeMode as u8;
    GET_CONTINUOUS_STATES "fmi3GetContinuousStates" ME RUNNING;
    GET_DERIVATIVES "fmi3GetContinuousStateDerivatives" ME RUNNING;
    GET_NOMINALS "fmi3GetNominalsOfContinuousStates" ME RUNNING;
    GET_INDICATORS "fmi3GetEventIndicators" ME RUNNING;
    COUNT_STATES "fmi3GetNumberOfContinuousStates" ME ANY;
    COUNT_INDICATORS "fmi3GetNumberOfEventIndicators" ME ANY;
    UNSUPPORTED "" ALL_INTERFACES ANY;
}

/// Interfaces with Event Mode.
const EVENTFUL: u8 = CS_EVENTS | ME;

impl Rule {
    /// True if the function may be called in `phase`.
    #[inline]
    #[must_use]
    pub const fn allows(&self, interface: Interface, phase: Phase) -> bool {
        self.phases & phase as u8 != 0 && self.interfaces & interface as u8 != 0
    }

    /// Where the function may be called, for a message.
    #[must_use]
    pub fn allowed(&self, interface: Interface) -> String {
        if self.interfaces & interface as u8 == 0 {
            let others =
                Interface::ALL.into_iter().filter(|i| self.interfaces & *i as u8 != 0).map(|i| i.to_string());
            return others.collect::<Vec<_>>().join(", ");
        }
        [Instantiated, InitializationMode, StepMode, EventMode, ContinuousTimeMode, Terminated]
            .into_iter()
            .filter(|p| self.phases & interface.phases() & *p as u8 != 0)
            .map(|p| format!("{p:?}"))
            .collect::<Vec<_>>()
            .join(", ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use Interface::{CoSimulation, CoSimulationWithEvents, ModelExchange};

    /// The state machines of the standard (FMI 3.0, 3.2.1 and 4.2.1), one line per transition function.
    #[test]
    fn transitions_start_where_the_standard_says() {
        let elsewhere = "Co-Simulation with eventModeUsed = true, Model Exchange";
        for (rule, plain, events, exchange) in [
            (ENTER_INITIALIZATION, "Instantiated", "Instantiated", "Instantiated"),
            (EXIT_INITIALIZATION, "InitializationMode", "InitializationMode", "InitializationMode"),
            (ENTER_EVENT_MODE, elsewhere, "StepMode", "ContinuousTimeMode"),
            (UPDATE_DISCRETE_STATES, elsewhere, "EventMode", "EventMode"),
            (TERMINATE, "StepMode", "StepMode, EventMode", "EventMode, ContinuousTimeMode"),
            (ENTER_CONTINUOUS_TIME_MODE, "Model Exchange", "Model Exchange", "EventMode"),
        ] {
            let said = [CoSimulation, CoSimulationWithEvents, ModelExchange].map(|i| rule.allowed(i));
            assert_eq!(said, [plain, events, exchange], "{}", rule.function);
        }
        assert_eq!(ENTER_STEP_MODE.allowed(CoSimulationWithEvents), "EventMode");
        assert!(!ENTER_STEP_MODE.allows(ModelExchange, EventMode));
        assert!(DO_STEP.allows(CoSimulation, StepMode) && DO_STEP.allows(CoSimulationWithEvents, StepMode));
        assert!(!DO_STEP.allows(CoSimulationWithEvents, EventMode));
    }

    #[test]
    fn nothing_but_freeing_is_left_after_a_panic() {
        let broken = |r: &Rule| Interface::ALL.iter().any(|i| r.allows(*i, Phase::Broken));
        assert!(!ALL.iter().any(broken));
    }
}
