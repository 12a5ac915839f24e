//! What the C boundary calls: an instance of an FMU, whatever computes behind it.

use std::path::Path;

use model::{Kind, Model};

use crate::{Event, Fault, Instance, Interface, Rule};

/// Why there is no instance.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CreationError {
    /// The host has the description of another FMU.
    #[error("this binary belongs to \"{expected}\"")]
    Token {
        /// Token of this FMU
        expected: String,
    },
    /// A host cannot integrate the states.
    #[error("Model Exchange is not supported: this is a Co-Simulation FMU")]
    NoModelExchange,
    /// The folder `resources` does not hold what the FMU needs.
    #[error("resources: {reason}")]
    Resources {
        /// What is wrong
        reason: String,
    },
}

/// There are no continuous states that a host could integrate.
const NO_STATES: Fault = Fault::Unsupported { reason: "this is a Co-Simulation FMU" };

/// An instance of an FMU behind the functions of FMI 2.0 and 3.0.
///
/// The C boundary asks [`enter`](Self::enter) before every call, so that a method is called in its phases only. The
/// methods for Model Exchange need not be written where [`create`](Self::create) refuses that interface.
#[allow(clippy::missing_errors_doc, reason = "a fault of any method becomes its status by `Fault::status`")]
pub trait Exported: Sized {
    /// What `GetFMUState` hands out
    type State;

    /// An instance with all start values; `resources` is the folder of that name in the unpacked archive.
    fn create(interface: Interface, token: &str, resources: Option<&Path>) -> Result<Self, CreationError>;
    /// Check that a function may be called now.
    fn enter(&self, rule: &Rule) -> Result<(), Fault>;
    /// The instance is lost.
    fn break_down(&mut self);
    /// Name of a type in the standard that the instance speaks.
    fn type_name(&self, kind: Kind) -> &'static str;
    /// True if the last call has left messages.
    fn has_warnings(&self) -> bool;
    /// Messages of the last call about things that are allowed but probably not meant.
    fn take_warnings(&mut self) -> Vec<String>;
    /// Where the instance stands [s].
    fn time(&self) -> f64;

    /// Times of the run.
    fn setup_experiment(&mut self, start: f64, stop: Option<f64>) -> Result<(), Fault>;
    /// Begin initialisation at the time that was set up, otherwise at 0.
    fn begin_initialization(&mut self) -> Result<(), Fault>;
    /// Begin initialisation of a run with these times.
    fn enter_initialization(&mut self, start: f64, stop: Option<f64>) -> Result<(), Fault> {
        self.setup_experiment(start, stop)?;
        self.begin_initialization()
    }
    /// End initialisation.
    fn exit_initialization(&mut self) -> Result<(), Fault>;
    /// End the run.
    fn terminate(&mut self);
    /// As a fresh instance.
    fn reset(&mut self) -> Result<(), Fault>;

    /// Read Float64 variables.
    fn get_float64(&mut self, references: &[u32], values: &mut [f64]) -> Result<(), Fault>;
    /// Read variables of another type as whole numbers; `put` says whether the number fits into the type of the call.
    fn get_whole(
        &mut self,
        references: &[u32],
        called: &'static str,
        is: impl Fn(Kind) -> bool,
        put: impl FnMut(usize, f64) -> bool,
    ) -> Result<(), Fault>;
    /// Set variables; all of them or, on a fault, none.
    fn set(
        &mut self,
        references: &[u32],
        called: &'static str,
        is: impl Fn(Kind) -> bool,
        value: impl Fn(usize) -> f64,
    ) -> Result<(), Fault>;
    /// Value references of the inputs and states that a variable depends on directly.
    fn dependencies(&self, reference: u32) -> Result<Vec<usize>, Fault>;
    /// d(unknowns) / d(knowns) in the direction `seed`.
    fn directional_derivative(
        &mut self,
        unknowns: &[u32],
        knowns: &[u32],
        seed: &[f64],
        sensitivity: &mut [f64],
    ) -> Result<(), Fault>;

    /// Copy of the state.
    fn save(&mut self) -> Result<Box<Self::State>, Fault>;
    /// Overwrite a copy with the present state.
    fn save_into(&mut self, copy: &mut Self::State) -> Result<(), Fault>;
    /// Go back to a saved state.
    fn restore(&mut self, saved: &Self::State) -> Result<(), Fault>;
    /// A saved state as bytes.
    fn serialise(&self, saved: &Self::State) -> Result<Vec<u8>, Fault>;
    /// A saved state from bytes.
    fn deserialise(&self, bytes: &[u8]) -> Result<Box<Self::State>, Fault>;

    /// Go to Event Mode.
    fn enter_event_mode(&mut self) -> Result<(), Fault>;
    /// Carry out what is due.
    fn update_discrete_states(&mut self) -> Result<Event, Fault>;
    /// Go to Step Mode.
    fn enter_step_mode(&mut self) -> Result<(), Fault>;
    /// Advance by one communication step; true if an event at its end is left to Event Mode.
    fn do_step(&mut self, t: f64, step: f64) -> Result<bool, Fault>;

    /// Number of continuous states.
    fn state_count(&self) -> usize {
        0
    }
    /// Number of event indicators.
    fn indicator_count(&self) -> usize {
        0
    }
    /// Go to Continuous-Time Mode.
    fn enter_continuous_time_mode(&mut self) -> Result<(), Fault> {
        Err(NO_STATES)
    }
    /// Move to another time.
    fn set_time(&mut self, _t: f64) -> Result<(), Fault> {
        Err(NO_STATES)
    }
    /// Set all continuous states.
    fn set_continuous_states(&mut self, _states: &[f64]) -> Result<(), Fault> {
        Err(NO_STATES)
    }
    /// All continuous states.
    fn get_continuous_states(&mut self, _states: &mut [f64]) -> Result<(), Fault> {
        Err(NO_STATES)
    }
    /// Time derivatives of all continuous states.
    fn get_derivatives(&mut self, _derivatives: &mut [f64]) -> Result<(), Fault> {
        Err(NO_STATES)
    }
    /// Typical magnitudes of all continuous states.
    fn get_nominals(&mut self, _nominals: &mut [f64]) -> Result<(), Fault> {
        Err(NO_STATES)
    }
    /// Event indicators.
    fn get_indicators(&mut self, _indicators: &mut [f64]) -> Result<(), Fault> {
        Err(NO_STATES)
    }
    /// A step of the integrator is done; true if an event is wanted.
    fn completed_integrator_step(&mut self) -> Result<bool, Fault> {
        Err(NO_STATES)
    }
}

/// Methods that the instance of a model has itself.
macro_rules! own {
    ($(fn $name:ident(&self $(, $arg:ident: $type:ty)*) $(-> $result:ty)?;)*) => {
        $(#[inline] fn $name(&self $(, $arg: $type)*) $(-> $result)? { Self::$name(self $(, $arg)*) })*
    };
    (mut $(fn $name:ident(&mut self $(, $arg:ident: $type:ty)*) $(-> $result:ty)?;)*) => {
        $(#[inline] fn $name(&mut self $(, $arg: $type)*) $(-> $result)? { Self::$name(self $(, $arg)*) })*
    };
}

impl<M: Model> Exported for Instance<M> {
    type State = crate::State<M>;

    fn create(interface: Interface, token: &str, _resources: Option<&Path>) -> Result<Self, CreationError> {
        let expected = Self::token();
        if token != expected {
            return Err(CreationError::Token { expected });
        }
        if interface.is_model_exchange() && !M::MODEL_EXCHANGE {
            return Err(CreationError::NoModelExchange);
        }
        Ok(Self::with_interface(interface))
    }

    own! {
        fn enter(&self, rule: &Rule) -> Result<(), Fault>;
        fn type_name(&self, kind: Kind) -> &'static str;
        fn has_warnings(&self) -> bool;
        fn time(&self) -> f64;
        fn dependencies(&self, reference: u32) -> Result<Vec<usize>, Fault>;
        fn serialise(&self, saved: &Self::State) -> Result<Vec<u8>, Fault>;
        fn deserialise(&self, bytes: &[u8]) -> Result<Box<Self::State>, Fault>;
        fn state_count(&self) -> usize;
        fn indicator_count(&self) -> usize;
    }
    own! { mut
        fn break_down(&mut self);
        fn take_warnings(&mut self) -> Vec<String>;
        fn setup_experiment(&mut self, start: f64, stop: Option<f64>) -> Result<(), Fault>;
        fn begin_initialization(&mut self) -> Result<(), Fault>;
        fn exit_initialization(&mut self) -> Result<(), Fault>;
        fn terminate(&mut self);
        fn get_float64(&mut self, references: &[u32], values: &mut [f64]) -> Result<(), Fault>;
        fn directional_derivative(
            &mut self, unknowns: &[u32], knowns: &[u32], seed: &[f64], sensitivity: &mut [f64]
        ) -> Result<(), Fault>;
        fn restore(&mut self, saved: &Self::State) -> Result<(), Fault>;
        fn enter_event_mode(&mut self) -> Result<(), Fault>;
        fn update_discrete_states(&mut self) -> Result<Event, Fault>;
        fn enter_step_mode(&mut self) -> Result<(), Fault>;
        fn do_step(&mut self, t: f64, step: f64) -> Result<bool, Fault>;
        fn enter_continuous_time_mode(&mut self) -> Result<(), Fault>;
        fn set_time(&mut self, t: f64) -> Result<(), Fault>;
        fn set_continuous_states(&mut self, states: &[f64]) -> Result<(), Fault>;
        fn get_continuous_states(&mut self, states: &mut [f64]) -> Result<(), Fault>;
        fn get_derivatives(&mut self, derivatives: &mut [f64]) -> Result<(), Fault>;
        fn get_nominals(&mut self, nominals: &mut [f64]) -> Result<(), Fault>;
        fn get_indicators(&mut self, indicators: &mut [f64]) -> Result<(), Fault>;
        fn completed_integrator_step(&mut self) -> Result<bool, Fault>;
    }

    #[inline]
    fn get_whole(
        &mut self,
        references: &[u32],
        called: &'static str,
        is: impl Fn(Kind) -> bool,
        put: impl FnMut(usize, f64) -> bool,
    ) -> Result<(), Fault> {
        Self::get_whole(self, references, called, is, put)
    }
    #[inline]
    fn set(
        &mut self,
        references: &[u32],
        called: &'static str,
        is: impl Fn(Kind) -> bool,
        value: impl Fn(usize) -> f64,
    ) -> Result<(), Fault> {
        Self::set(self, references, called, is, value)
    }
    fn reset(&mut self) -> Result<(), Fault> {
        Self::reset(self);
        Ok(())
    }
    fn save(&mut self) -> Result<Box<Self::State>, Fault> {
        Ok(Self::save(self))
    }
    fn save_into(&mut self, copy: &mut Self::State) -> Result<(), Fault> {
        Self::save_into(self, copy);
        Ok(())
    }
}
