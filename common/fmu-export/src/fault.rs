//! Everything that a call can end with besides OK, and which status that is.

use integrators::{SettingsError, StepError};
use model::{EvaluationError, ParameterError};

use crate::solver::method_name;
use crate::{Interface, SerialisedStateError};

/// Status of a call, numbered as `fmi2Status` and `fmi3Status`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(C)]
pub enum Status {
    /// Done
    Ok = 0,
    /// Done, with a message
    Warning = 1,
    /// Not done, nothing changed, the run may go on
    Discard = 2,
    /// Wrong call
    Error = 3,
    /// The instance is lost
    Fatal = 4,
}

/// Why a call was not carried out.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Fault {
    /// Function called in the wrong phase.
    #[error("may not be called in {phase}; allowed in: {allowed}")]
    WrongPhase {
        /// Phase of the instance
        phase: String,
        /// Phases in which it may be called
        allowed: String,
    },
    /// No such variable.
    #[error("value reference {reference} does not exist (0..{count})")]
    UnknownReference {
        /// Value reference
        reference: u32,
        /// Number of variables
        count: usize,
    },
    /// Variable of another type.
    #[error("{variable} (value reference {reference}) is of type {is}, not {called}")]
    WrongType {
        /// Variable
        variable: String,
        /// Value reference
        reference: u32,
        /// Its type
        is: &'static str,
        /// Type of the call
        called: &'static str,
    },
    /// Variable that cannot be set now.
    #[error("{variable} cannot be set in {phase}: {reason}")]
    NotSettable {
        /// Variable
        variable: String,
        /// Phase
        phase: String,
        /// Why
        reason: &'static str,
    },
    /// Number that does not fit into the type of the call.
    #[error("{variable} = {value} does not fit into {called}")]
    TooLarge {
        /// Variable
        variable: String,
        /// Its value
        value: f64,
        /// Type of the call
        called: &'static str,
    },
    /// Nothing is known about the last step under this kind of `fmi2StatusKind`.
    #[error(
        "status kind {kind} has no answer here: steps are done when fmi2DoStep returns; answered: fmi2GetRealStatus of fmi2LastSuccessfulTime (2), fmi2GetBooleanStatus of fmi2Terminated (3)"
    )]
    NoStatus {
        /// The kind
        kind: u32,
    },
    /// Variable that is computed, before there is anything to compute it from.
    #[error("{variable} has no value before initialisation: it is computed and has no start value")]
    NoValue {
        /// Variable
        variable: String,
    },
    /// Null where data is needed.
    #[error("{argument} is null")]
    Null {
        /// Argument
        argument: &'static str,
    },
    /// Numbers of references and values differ.
    #[error("{references} value references but {values} values")]
    Length {
        /// Number of references
        references: usize,
        /// Number of values
        values: usize,
    },
    /// Function without effect in this FMU.
    #[error("not supported: {reason}")]
    Unsupported {
        /// Why
        reason: &'static str,
    },
    /// A log category that is not declared.
    #[error("\"{name}\" is no log category; declared: {declared}")]
    LogCategory {
        /// What was asked for
        name: String,
        /// Those of the model description
        declared: String,
    },
    /// An argument of a call that makes no sense.
    #[error("{argument} = {value}; allowed: {allowed}")]
    Argument {
        /// Argument
        argument: &'static str,
        /// Value
        value: f64,
        /// What would be accepted
        allowed: String,
    },
    /// Set with a value outside its range, or not finite.
    #[error("{variable} = {value} is refused, the value stays {kept}; allowed: {allowed}")]
    Value {
        /// Variable
        variable: String,
        /// The value
        value: f64,
        /// The value that is kept
        kept: f64,
        /// What would be accepted
        allowed: String,
    },
    /// A method for other systems than this one.
    #[error(
        "solver.method = {} is not offered by this FMU; allowed: {}",
        numbered(*method),
        offered.iter().map(|m| numbered(*m)).collect::<Vec<_>>().join(", ")
    )]
    MethodNotOffered {
        /// Number of the method
        method: i64,
        /// Those on offer
        offered: &'static [i64],
    },
    /// Solver settings.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// A state of the system that is no variable, a mistake in the model.
    #[error("the state {state} is not declared")]
    UndeclaredState {
        /// Its name
        state: String,
    },
    /// The saved state of an instance that is used in another way.
    #[error("FMUState belongs to an instance for {saved}; this one is for {instance}")]
    ForeignState {
        /// How the saved instance is used
        saved: Interface,
        /// How this one is used
        instance: Interface,
    },
    /// Bytes that are no state of this FMU.
    #[error("serialised state is refused: {0}")]
    Serialised(#[from] SerialisedStateError),
    /// Parameters that do not fit together.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// The equations have no value.
    #[error("at t = {t:.6} s: {source}")]
    Evaluation {
        /// Time
        t: f64,
        /// Cause
        source: EvaluationError,
    },
    /// A result that is not a number.
    #[error("{variable} is {value} at t = {t:.6} s")]
    NotFinite {
        /// Variable
        variable: String,
        /// Value
        value: f64,
        /// Time
        t: f64,
    },
    /// An orientation that cannot be normalised: its length overflows or is zero.
    #[error(
        "an orientation (quaternion or unit vector) is off its manifold by {off:.3e} at t = {t:.6} s and cannot be normalised; allowed: a finite length > 0"
    )]
    OffManifold {
        /// Time
        t: f64,
        /// What remains
        off: f64,
    },
    /// Parameters, inputs or start values from which a result at the start is not a number.
    #[error(
        "{variable} would be {value} at the start: parameters, inputs and start values do not fit together"
    )]
    NotFiniteAtStart {
        /// Variable
        variable: String,
        /// Value
        value: f64,
    },
    /// The solver gave up.
    #[error("step from {t:.6} s by {step:.3e} s is discarded: {cause}")]
    Step {
        /// Start of the step
        t: f64,
        /// Its size
        step: f64,
        /// Cause, with the name of the state
        cause: String,
    },
    /// An explicit method would amplify the fastest mode.
    #[error(
        "step from {t:.6} s is discarded: solver.method = {method} with inner step {h:.3e} s amplifies the mode with eigenvalue {re:.4e} {im:+.4e}i 1/s by {factor:.3e} per step; largest usable solver.step: {largest:.3e} s; implicit methods for stiff cases: rodas4 (5), radau5 (6)"
    )]
    Unstable {
        /// Start of the step
        t: f64,
        /// Method
        method: &'static str,
        /// Inner step
        h: f64,
        /// Eigenvalue, real part
        re: f64,
        /// Eigenvalue, imaginary part
        im: f64,
        /// |R(h lambda)|
        factor: f64,
        /// Largest usable inner step
        largest: f64,
    },
    /// What a part of an assembly says, with its name in the text.
    #[error("{message}")]
    Part {
        /// The text
        message: String,
        /// What it means for the call
        status: Status,
    },
    /// A panic, caught.
    #[error("internal error, the instance is lost: {message}")]
    Panic {
        /// What the panic said
        message: String,
    },
}

/// Name and number of a method.
fn numbered(method: i64) -> String {
    format!("{} ({method})", method_name(method))
}

impl Fault {
    /// The one place where causes become statuses.
    #[must_use]
    pub fn status(&self) -> Status {
        match self {
            Self::Value { .. }
            | Self::TooLarge { .. }
            | Self::NoStatus { .. }
            | Self::Step { .. }
            | Self::Unstable { .. }
            | Self::Evaluation { .. }
            | Self::OffManifold { .. }
            | Self::NotFinite { .. } => Status::Discard,
            Self::Part { status, .. } => *status,
            Self::Panic { .. } => Status::Fatal,
            _ => Status::Error,
        }
    }

    /// A step that the solver gave up, with names instead of state numbers.
    pub(crate) fn step<const N: usize>(
        t: f64,
        step: f64,
        error: &StepError<EvaluationError>,
        names: impl Fn() -> [String; N],
    ) -> Self {
        let name = |i: usize| names().get(i).cloned().unwrap_or_default();
        let cause = match error {
            StepError::NotFinite { t, index, value } => {
                format!("{} becomes {value} at t = {t:.6} s", name(*index))
            }
            StepError::StepTooSmall { t, h, min, index } => format!(
                "the step size fell to {h:.3e} s at t = {t:.6} s (below {min:.0e} s); stiffest state: {}",
                name(*index)
            ),
            StepError::Rhs { t, source } => format!("at t = {t:.6} s: {source}"),
            other => other.to_string(),
        };
        Self::Step { t, step, cause }
    }
}
