//! The state machines of FMI 3.0 and 2.0 as one table: which function may be called when, and where.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::{Fault, Standard};

/// How an instance is used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[repr(u8)]
pub enum Interface {
    /// FMI 3.0 Co-Simulation with eventModeUsed = false
    CoSimulation = 1,
    /// FMI 3.0 Co-Simulation with eventModeUsed = true
    CoSimulationWithEvents = 2,
    /// FMI 3.0 Model Exchange
    ModelExchange = 4,
    /// FMI 2.0 Co-Simulation
    CoSimulation2 = 8,
    /// FMI 2.0 Model Exchange
    ModelExchange2 = 16,
}

use Interface::{CoSimulation, CoSimulation2, CoSimulationWithEvents, ModelExchange, ModelExchange2};

impl Interface {
    const ALL: [Self; 5] =
        [CoSimulation, CoSimulationWithEvents, ModelExchange, CoSimulation2, ModelExchange2];

    /// The version of FMI that the instance speaks.
    #[must_use]
    pub const fn standard(self) -> Standard {
        match self {
            CoSimulation | CoSimulationWithEvents | ModelExchange => Standard::Fmi3,
            CoSimulation2 | ModelExchange2 => Standard::Fmi2,
        }
    }

    /// A host integrates the states.
    #[must_use]
    pub const fn is_model_exchange(self) -> bool {
        matches!(self, ModelExchange | ModelExchange2)
    }

    /// Where an instance stands after initialisation.
    #[must_use]
    pub const fn after_initialization(self) -> Phase {
        match self {
            CoSimulation | CoSimulation2 => StepMode,
            CoSimulationWithEvents | ModelExchange | ModelExchange2 => EventMode,
        }
    }

    /// The phases that exist.
    const fn phases(self) -> u8 {
        match self {
            CoSimulation | CoSimulation2 => ANY & !(EventMode as u8 | ContinuousTimeMode as u8),
            CoSimulationWithEvents => ANY & !(ContinuousTimeMode as u8),
            ModelExchange | ModelExchange2 => ANY & !(StepMode as u8),
        }
    }
}

impl fmt::Display for Interface {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            CoSimulation => "Co-Simulation with eventModeUsed = false",
            CoSimulationWithEvents => "Co-Simulation with eventModeUsed = true",
            ModelExchange => "Model Exchange",
            CoSimulation2 => "FMI 2.0 Co-Simulation",
            ModelExchange2 => "FMI 2.0 Model Exchange",
        })
    }
}

/// Where an instance stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[repr(u8)]
pub enum Phase {
    /// Created or reset
    Instantiated = 1,
    /// Between Enter- and `ExitInitializationMode`
    InitializationMode = 2,
    /// Ready for `DoStep` (Co-Simulation; FMI 2.0: stepComplete)
    StepMode = 4,
    /// Ready for `UpdateDiscreteStates` (FMI 2.0: `NewDiscreteStates`)
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

/// When a function may be called.
#[derive(Debug, Clone, Copy)]
pub struct Rule {
    /// The function
    pub function: &'static str,
    interfaces: u8,
    phases: u8,
}

/// The rows of one standard.
macro_rules! rules {
    ($($name:ident $function:literal $interfaces:ident $phases:expr;)*) => {
        $(
            #[doc = concat!("Rule of `", $function, "`.")]
            pub(crate) const $name: Rule = Rule { function: $function, interfaces: $interfaces, phases: $phases };
        )*
        /// All of them.
        #[cfg(test)]
        pub(super) const ALL: &[Rule] = &[$($name),*];
    };
}

/// The functions of FMI 3.0.
pub(crate) mod fmi3 {
    use super::Phase::{ContinuousTimeMode, EventMode, InitializationMode, Instantiated, StepMode};
    use super::{
        ANY, CoSimulation, CoSimulationWithEvents, ModelExchange, RUNNING, Rule, SETTABLE, TERMINABLE,
    };

    const CS_EVENTS: u8 = CoSimulationWithEvents as u8;
    const CS: u8 = CoSimulation as u8 | CS_EVENTS;
    const ME: u8 = ModelExchange as u8;
    const EVENTFUL: u8 = CS_EVENTS | ME;
    const FMI3: u8 = CS | ME;

    rules! {
        SET_DEBUG_LOGGING "fmi3SetDebugLogging" FMI3 ANY;
        ENTER_INITIALIZATION "fmi3EnterInitializationMode" FMI3 Instantiated as u8;
        EXIT_INITIALIZATION "fmi3ExitInitializationMode" FMI3 InitializationMode as u8;
        ENTER_EVENT_MODE "fmi3EnterEventMode" EVENTFUL StepMode as u8 | ContinuousTimeMode as u8;
        UPDATE_DISCRETE_STATES "fmi3UpdateDiscreteStates" EVENTFUL EventMode as u8;
        ENTER_STEP_MODE "fmi3EnterStepMode" CS_EVENTS EventMode as u8;
        DO_STEP "fmi3DoStep" CS StepMode as u8;
        TERMINATE "fmi3Terminate" FMI3 TERMINABLE;
        RESET "fmi3Reset" FMI3 ANY;
        GET_FLOAT64 "fmi3GetFloat64" FMI3 ANY;
        GET_INT32 "fmi3GetInt32" FMI3 ANY;
        GET_INT64 "fmi3GetInt64" FMI3 ANY;
        GET_BOOLEAN "fmi3GetBoolean" FMI3 ANY;
        GET_OTHER "fmi3Get{VariableType}" FMI3 ANY;
        SET_FLOAT64 "fmi3SetFloat64" FMI3 SETTABLE;
        SET_INT32 "fmi3SetInt32" FMI3 SETTABLE;
        SET_INT64 "fmi3SetInt64" FMI3 SETTABLE;
        SET_BOOLEAN "fmi3SetBoolean" FMI3 SETTABLE;
        SET_OTHER "fmi3Set{VariableType}" FMI3 SETTABLE;
        GET_FMU_STATE "fmi3GetFMUState" FMI3 ANY;
        SET_FMU_STATE "fmi3SetFMUState" FMI3 ANY;
        FREE_FMU_STATE "fmi3FreeFMUState" FMI3 ANY;
        SERIALISED_SIZE "fmi3SerializedFMUStateSize" FMI3 ANY;
        SERIALISE "fmi3SerializeFMUState" FMI3 ANY;
        DESERIALISE "fmi3DeserializeFMUState" FMI3 ANY;
        DIRECTIONAL_DERIVATIVE "fmi3GetDirectionalDerivative" FMI3 RUNNING;
        DEPENDENCIES "fmi3GetVariableDependencies" FMI3 ANY;
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
        UNSUPPORTED "" FMI3 ANY;
    }
}

/// The functions of FMI 2.0.
pub(crate) mod fmi2 {
    use super::Phase::{
        ContinuousTimeMode, EventMode, InitializationMode, Instantiated, StepMode, Terminated,
    };
    use super::{ANY, CoSimulation2, ModelExchange2, RUNNING, Rule, SETTABLE, TERMINABLE};

    const CS: u8 = CoSimulation2 as u8;
    const ME: u8 = ModelExchange2 as u8;
    const FMI2: u8 = CS | ME;
    const STEPPED: u8 = StepMode as u8 | Terminated as u8;

    rules! {
        SET_DEBUG_LOGGING "fmi2SetDebugLogging" FMI2 ANY;
        SETUP_EXPERIMENT "fmi2SetupExperiment" FMI2 Instantiated as u8;
        ENTER_INITIALIZATION "fmi2EnterInitializationMode" FMI2 Instantiated as u8;
        EXIT_INITIALIZATION "fmi2ExitInitializationMode" FMI2 InitializationMode as u8;
        DO_STEP "fmi2DoStep" CS StepMode as u8;
        TERMINATE "fmi2Terminate" FMI2 TERMINABLE;
        RESET "fmi2Reset" FMI2 ANY;
        GET_REAL "fmi2GetReal" FMI2 RUNNING;
        GET_INTEGER "fmi2GetInteger" FMI2 RUNNING;
        GET_BOOLEAN "fmi2GetBoolean" FMI2 RUNNING;
        GET_STRING "fmi2GetString" FMI2 RUNNING;
        SET_REAL "fmi2SetReal" FMI2 SETTABLE;
        SET_INTEGER "fmi2SetInteger" FMI2 SETTABLE;
        SET_BOOLEAN "fmi2SetBoolean" FMI2 SETTABLE;
        SET_STRING "fmi2SetString" FMI2 SETTABLE;
        GET_FMU_STATE "fmi2GetFMUstate" FMI2 ANY;
        SET_FMU_STATE "fmi2SetFMUstate" FMI2 ANY;
        FREE_FMU_STATE "fmi2FreeFMUstate" FMI2 ANY;
        SERIALISED_SIZE "fmi2SerializedFMUstateSize" FMI2 ANY;
        SERIALISE "fmi2SerializeFMUstate" FMI2 ANY;
        DESERIALISE "fmi2DeSerializeFMUstate" FMI2 ANY;
        DIRECTIONAL_DERIVATIVE "fmi2GetDirectionalDerivative" FMI2 RUNNING;
        ENTER_EVENT_MODE "fmi2EnterEventMode" ME EventMode as u8 | ContinuousTimeMode as u8;
        NEW_DISCRETE_STATES "fmi2NewDiscreteStates" ME EventMode as u8;
        ENTER_CONTINUOUS_TIME_MODE "fmi2EnterContinuousTimeMode" ME EventMode as u8;
        COMPLETED_INTEGRATOR_STEP "fmi2CompletedIntegratorStep" ME ContinuousTimeMode as u8;
        SET_TIME "fmi2SetTime" ME ContinuousTimeMode as u8;
        SET_CONTINUOUS_STATES "fmi2SetContinuousStates" ME ContinuousTimeMode as u8;
        GET_DERIVATIVES "fmi2GetDerivatives" ME RUNNING;
        GET_INDICATORS "fmi2GetEventIndicators" ME RUNNING;
        GET_CONTINUOUS_STATES "fmi2GetContinuousStates" ME RUNNING;
        GET_NOMINALS "fmi2GetNominalsOfContinuousStates" ME ANY;
        GET_STATUS "fmi2GetStatus" CS STEPPED;
        GET_REAL_STATUS "fmi2GetRealStatus" CS STEPPED;
        GET_INTEGER_STATUS "fmi2GetIntegerStatus" CS STEPPED;
        GET_BOOLEAN_STATUS "fmi2GetBooleanStatus" CS STEPPED;
        GET_STRING_STATUS "fmi2GetStringStatus" CS STEPPED;
        UNSUPPORTED "" FMI2 ANY;
    }
}

impl Rule {
    /// The same rule for the function of this name.
    #[must_use]
    pub const fn named(&self, function: &'static str) -> Self {
        Self { function, ..*self }
    }

    /// True if the function may be called in `phase`.
    #[inline]
    #[must_use]
    pub const fn allows(&self, interface: Interface, phase: Phase) -> bool {
        self.phases & phase as u8 != 0 && self.interfaces & interface as u8 != 0
    }

    /// Check that the function may be called in `phase`.
    ///
    /// # Errors
    /// [`Fault::WrongPhase`].
    #[inline]
    pub fn check(&self, interface: Interface, phase: Phase) -> Result<(), Fault> {
        if self.allows(interface, phase) {
            return Ok(());
        }
        Err(Fault::WrongPhase {
            phase: format!("{phase:?} of {interface}"),
            allowed: self.allowed(interface),
        })
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

    /// The state machine of FMI 3.0 (3.2.1 and 4.2.1), one line per transition function.
    #[test]
    fn transitions_of_fmi3_start_where_the_standard_says() {
        let elsewhere = "Co-Simulation with eventModeUsed = true, Model Exchange";
        for (rule, plain, events, exchange) in [
            (fmi3::ENTER_INITIALIZATION, "Instantiated", "Instantiated", "Instantiated"),
            (fmi3::EXIT_INITIALIZATION, "InitializationMode", "InitializationMode", "InitializationMode"),
            (fmi3::ENTER_EVENT_MODE, elsewhere, "StepMode", "ContinuousTimeMode"),
            (fmi3::UPDATE_DISCRETE_STATES, elsewhere, "EventMode", "EventMode"),
            (fmi3::TERMINATE, "StepMode", "StepMode, EventMode", "EventMode, ContinuousTimeMode"),
            (fmi3::ENTER_CONTINUOUS_TIME_MODE, "Model Exchange", "Model Exchange", "EventMode"),
        ] {
            let said = [CoSimulation, CoSimulationWithEvents, ModelExchange].map(|i| rule.allowed(i));
            assert_eq!(said, [plain, events, exchange], "{}", rule.function);
        }
        let (step, enter) = (fmi3::DO_STEP, fmi3::ENTER_STEP_MODE);
        assert_eq!(enter.allowed(CoSimulationWithEvents), "EventMode");
        assert!(!enter.allows(ModelExchange, EventMode));
        assert!(step.allows(CoSimulation, StepMode) && step.allows(CoSimulationWithEvents, StepMode));
        assert!(!step.allows(CoSimulationWithEvents, EventMode));
    }

    /// The state machines of FMI 2.0.4 (3.2.3 and 4.2.4), by the names that the phases have here.
    #[test]
    fn functions_of_fmi2_are_allowed_where_the_standard_says() {
        let (cs, me) = ("FMI 2.0 Co-Simulation", "FMI 2.0 Model Exchange");
        let in_a_run = "InitializationMode, EventMode, ContinuousTimeMode, Terminated";
        for (rule, simulation, exchange) in [
            (fmi2::SETUP_EXPERIMENT, "Instantiated", "Instantiated"),
            (fmi2::ENTER_INITIALIZATION, "Instantiated", "Instantiated"),
            (fmi2::EXIT_INITIALIZATION, "InitializationMode", "InitializationMode"),
            (fmi2::TERMINATE, "StepMode", "EventMode, ContinuousTimeMode"),
            (fmi2::DO_STEP, "StepMode", cs),
            (fmi2::GET_REAL_STATUS, "StepMode, Terminated", cs),
            (fmi2::GET_REAL, "InitializationMode, StepMode, Terminated", in_a_run),
            (fmi2::ENTER_EVENT_MODE, me, "EventMode, ContinuousTimeMode"),
            (fmi2::NEW_DISCRETE_STATES, me, "EventMode"),
            (fmi2::ENTER_CONTINUOUS_TIME_MODE, me, "EventMode"),
            (fmi2::COMPLETED_INTEGRATOR_STEP, me, "ContinuousTimeMode"),
            (fmi2::SET_TIME, me, "ContinuousTimeMode"),
            (fmi2::SET_CONTINUOUS_STATES, me, "ContinuousTimeMode"),
            (fmi2::GET_DERIVATIVES, me, in_a_run),
        ] {
            let said = [CoSimulation2, ModelExchange2].map(|i| rule.allowed(i));
            assert_eq!(said, [simulation, exchange], "{}", rule.function);
        }
    }

    #[test]
    fn an_instance_speaks_one_standard() {
        for (rules, standard) in [(fmi2::ALL, Standard::Fmi2), (fmi3::ALL, Standard::Fmi3)] {
            for interface in Interface::ALL {
                let mut allowed = rules.iter().filter(|r| r.allows(interface, Instantiated));
                assert_eq!(allowed.next().is_some(), interface.standard() == standard, "{interface}");
            }
        }
    }

    #[test]
    fn nothing_but_freeing_is_left_after_a_panic() {
        let broken = |r: &Rule| Interface::ALL.iter().any(|i| r.allows(*i, Phase::Broken));
        assert!(![fmi2::ALL, fmi3::ALL].concat().iter().any(broken));
    }
}
