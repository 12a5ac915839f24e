//! FMI 3.0 as a judge: which function may be called in which state, and which variables may be set there.
//!
//! Written from the standard (FMI 3.0, sections 2.3, 3.2 and 4.2: "Allowed Function Calls" of each state; 2.4.7 for
//! variabilities), not from the product. Where the standard leaves a call open, both answers are right.

use crate::description::{Causality, Initial, Variable};

/// How an instance is used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Interface {
    ModelExchange,
    /// eventModeUsed = true
    CoSimulationWithEvents,
    /// eventModeUsed = false
    CoSimulation,
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
    /// States, derivatives, nominals, indicators
    ContinuousLists,
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
        Function::ContinuousLists => ["NECT", "", "", ""],
        Function::ContinuousCounts => ["IE", "", "", "NCT"],
        Function::Undeclared => ["", "", "", ""],
    }
}

/// May `function` be called?
pub(crate) fn may(function: Function, interface: Interface, phase: Phase) -> Verdict {
    let [exchange, events, plain, open] = row(function);
    let letter = match phase {
        Phase::Instantiated => 'I',
        Phase::Initialization => 'N',
        Phase::Event => 'E',
        Phase::Step => 'S',
        Phase::ContinuousTime => 'C',
        Phase::Terminated => 'T',
    };
    let allowed = match interface {
        Interface::ModelExchange if open.contains(letter) => return Verdict::Open,
        Interface::ModelExchange => exchange,
        Interface::CoSimulationWithEvents => events,
        Interface::CoSimulation => plain,
    };
    if allowed.contains(letter) { Verdict::Allowed } else { Verdict::Forbidden }
}

/// May `variable` be set, in a state in which Set may be called?
#[allow(clippy::match_same_arms, reason = "one row per state")]
pub(crate) fn may_set(variable: &Variable, interface: Interface, phase: Phase) -> Verdict {
    let input = variable.causality == Causality::Input;
    let continuous_input = input && variable.continuous;
    let tunable = variable.causality == Causality::Parameter && variable.tunable;
    let allowed = match phase {
        Phase::Instantiated => variable.initial != Initial::Calculated,
        // only initial = exact is named, but guesses are made here
        Phase::Initialization if variable.initial == Initial::Approx => return Verdict::Open,
        Phase::Initialization => variable.initial == Initial::Exact,
        Phase::Event => input || tunable,
        Phase::Step if interface == Interface::CoSimulation => input || tunable,
        Phase::Step => continuous_input,
        // states may be set one by one, but they are no inputs and have no initial = exact in general
        Phase::ContinuousTime if variable.state => return Verdict::Open,
        Phase::ContinuousTime => continuous_input,
        Phase::Terminated => false,
    };
    if allowed { Verdict::Allowed } else { Verdict::Forbidden }
}

/// The state after a successful transition.
pub(crate) fn after(function: Function, interface: Interface) -> Option<Phase> {
    Some(match function {
        Function::EnterInitialization => Phase::Initialization,
        Function::ExitInitialization if interface == Interface::CoSimulation => Phase::Step,
        Function::ExitInitialization | Function::EnterEventMode => Phase::Event,
        Function::EnterStepMode => Phase::Step,
        Function::EnterContinuousTimeMode => Phase::ContinuousTime,
        Function::Terminate => Phase::Terminated,
        Function::Reset => Phase::Instantiated,
        _ => return None,
    })
}
