//! FMI 2.0 and 3.0 as a judge: which function may be called in which state, and which variables may be set there.
//!
//! Written from the standards (FMI 3.0.2, sections 2.3, 3.2 and 4.2: "Allowed Function Calls" of each state; 2.4.7 for
//! variabilities. FMI 2.0.5, the tables at the end of 3.2.3 and 4.2.4), not from the product. Where the standard leaves a
//! call open, both answers are right.

use crate::description::{Causality, Initial, Variable};

/// Version of the interface.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Version {
    Fmi2,
    #[default]
    Fmi3,
}

/// How an instance is used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Interface {
    ModelExchange,
    /// eventModeUsed = true
    CoSimulationWithEvents,
    /// eventModeUsed = false
    CoSimulation,
    /// FMI 2.0
    ModelExchange2,
    /// FMI 2.0
    CoSimulation2,
}

impl Interface {
    pub(crate) fn version(self) -> Version {
        match self {
            Self::ModelExchange2 | Self::CoSimulation2 => Version::Fmi2,
            _ => Version::Fmi3,
        }
    }

    pub(crate) fn is_model_exchange(self) -> bool {
        matches!(self, Self::ModelExchange | Self::ModelExchange2)
    }

    /// All of a version.
    pub(crate) fn of(version: Version) -> &'static [Self] {
        match version {
            Version::Fmi2 => &[Self::ModelExchange2, Self::CoSimulation2],
            Version::Fmi3 => &[Self::ModelExchange, Self::CoSimulationWithEvents, Self::CoSimulation],
        }
    }
}

/// State of the state machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Phase {
    Instantiated,
    Initialization,
    Event,
    Step,
    ContinuousTime,
    Terminated,
}

/// What the standard says about a call.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Verdict {
    Allowed,
    Forbidden,
    /// Not said, or said differently in different places
    Open,
}

/// Functions with a state rule.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Function {
    SetDebugLogging,
    EnterInitialization,
    ExitInitialization,
    EnterEventMode,
    UpdateDiscreteStates,
    EnterStepMode,
    EnterContinuousTimeMode,
    DoStep,
    Terminate,
    Reset,
    Get,
    Set,
    FmuState,
    DirectionalDerivative,
    Dependencies,
    SetTime,
    SetContinuousStates,
    CompletedIntegratorStep,
    /// States, derivatives, indicators
    ContinuousLists,
    Nominals,
    /// What FMI 2.0 answers about the last step
    Inquiry,
    /// Numbers of states and indicators
    ContinuousCounts,
    /// Structural parameters, adjoint derivatives, clocks: nothing of it is declared
    Undeclared,
}

/// States by their letters: Instantiated, iNitialization, Event, Step, Continuous-time, Terminated. Model Exchange,
/// Co-Simulation with Event Mode, Co-Simulation without; then the states left open (in Model Exchange).
#[allow(clippy::match_same_arms, reason = "one row per function")]
fn row(function: Function) -> [&'static str; 4] {
    match function {
        Function::SetDebugLogging | Function::Reset | Function::FmuState | Function::Dependencies => {
            ["INECT", "INEST", "INST", ""]
        }
        Function::EnterInitialization => ["I", "I", "I", ""],
        Function::ExitInitialization => ["N", "N", "N", ""],
        Function::EnterEventMode => ["C", "S", "", ""],
        Function::UpdateDiscreteStates => ["E", "E", "", ""],
        Function::EnterStepMode => ["", "E", "", ""],
        Function::EnterContinuousTimeMode => ["E", "", "", ""],
        Function::DoStep => ["", "S", "S", ""],
        Function::Terminate => ["EC", "ES", "S", ""],
        Function::Get => ["INECT", "INEST", "INST", ""],
        Function::Set => ["INEC", "INES", "INS", ""],
        Function::DirectionalDerivative => ["NECT", "NEST", "NST", ""],
        Function::SetTime | Function::SetContinuousStates | Function::CompletedIntegratorStep => {
            ["C", "", "", ""]
        }
        Function::ContinuousLists | Function::Nominals => ["NECT", "", "", ""],
        Function::ContinuousCounts => ["IE", "", "", "NCT"],
        Function::Undeclared | Function::Inquiry => ["", "", "", ""],
    }
}

/// The same in FMI 2.0: Model Exchange, Co-Simulation (stepComplete is Step), states left open in both.
#[allow(clippy::match_same_arms, reason = "one row per function")]
fn row2(function: Function) -> [&'static str; 3] {
    match function {
        Function::SetDebugLogging | Function::Reset | Function::FmuState => ["INECT", "INST", ""],
        Function::EnterInitialization => ["I", "I", ""],
        Function::ExitInitialization => ["N", "N", ""],
        Function::EnterEventMode => ["EC", "", ""],
        Function::UpdateDiscreteStates => ["E", "", ""],
        Function::EnterContinuousTimeMode => ["E", "", ""],
        Function::DoStep => ["", "S", ""],
        Function::Terminate => ["EC", "S", ""],
        Function::Get => ["NECT", "NST", ""],
        Function::Set => ["INEC", "INS", ""],
        Function::DirectionalDerivative => ["NECT", "NS", "T"], // terminated: in Model Exchange only
        // note 8, SetTime in Event Mode: FMUs without continuous time only
        Function::SetTime | Function::SetContinuousStates | Function::CompletedIntegratorStep => {
            ["C", "", ""]
        }
        Function::ContinuousLists => ["NECT", "", ""],
        Function::Nominals => ["INECT", "", ""],
        Function::Inquiry => ["", "ST", ""],
        Function::EnterStepMode
        | Function::Dependencies
        | Function::ContinuousCounts
        | Function::Undeclared => ["", "", ""],
    }
}

/// May `function` be called?
pub(crate) fn may(function: Function, interface: Interface, phase: Phase) -> Verdict {
    let letter = match phase {
        Phase::Instantiated => 'I',
        Phase::Initialization => 'N',
        Phase::Event => 'E',
        Phase::Step => 'S',
        Phase::ContinuousTime => 'C',
        Phase::Terminated => 'T',
    };
    let ([exchange, events, plain, open], [exchange2, plain2, open2]) = (row(function), row2(function));
    let (allowed, open) = match interface {
        Interface::ModelExchange => (exchange, open),
        Interface::CoSimulationWithEvents => (events, ""),
        Interface::CoSimulation => (plain, ""),
        Interface::ModelExchange2 => (exchange2, open2),
        Interface::CoSimulation2 => (plain2, open2),
    };
    if open.contains(letter) {
        return Verdict::Open;
    }
    if allowed.contains(letter) { Verdict::Allowed } else { Verdict::Forbidden }
}

/// May `variable` be set, in a state in which Set may be called?
#[allow(clippy::match_same_arms, reason = "one row per state")]
pub(crate) fn may_set(variable: &Variable, interface: Interface, phase: Phase) -> Verdict {
    let input = variable.causality == Causality::Input;
    let continuous_input = input && variable.continuous;
    let tunable = variable.causality == Causality::Parameter && variable.tunable;
    let allowed = match phase {
        // "this does not include inputs as they do not have an initial attribute", but hosts set their start values
        Phase::Instantiated if input && interface.version() == Version::Fmi2 => return Verdict::Open,
        Phase::Instantiated => variable.initial != Initial::Calculated,
        Phase::Initialization => variable.initial == Initial::Exact,
        Phase::Event => input || tunable,
        Phase::Step if interface == Interface::CoSimulationWithEvents => continuous_input,
        Phase::Step => input || tunable,
        Phase::ContinuousTime => continuous_input || variable.state,
        Phase::Terminated => false,
    };
    if allowed { Verdict::Allowed } else { Verdict::Forbidden }
}

/// The state after a successful transition.
pub(crate) fn after(function: Function, interface: Interface) -> Option<Phase> {
    Some(match function {
        Function::EnterInitialization => Phase::Initialization,
        Function::ExitInitialization
            if matches!(interface, Interface::CoSimulation | Interface::CoSimulation2) =>
        {
            Phase::Step
        }
        Function::ExitInitialization | Function::EnterEventMode => Phase::Event,
        Function::EnterStepMode => Phase::Step,
        Function::EnterContinuousTimeMode => Phase::ContinuousTime,
        Function::Terminate => Phase::Terminated,
        Function::Reset => Phase::Instantiated,
        _ => return None,
    })
}
