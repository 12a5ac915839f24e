//! Methods for systems whose number of states is known only at run time, one step per call.
//!
//! Numbers of the methods, error norm and control of the step size are those of the solvers of fixed size. A host takes a
//! step, looks at it (dense output, repetition with a shorter length), and takes the next one.

mod control;
mod explicit;
mod implicit;
mod newton;
mod rosenbrock;
mod table;

use serde::{Deserialize, Serialize};

use crate::error::SettingsError;
use crate::{Method, Settings, Statistics, StepError};
use explicit::{ExplicitSolver, ExplicitState};
use implicit::{ImplicitSolver, ImplicitState};

/// An initial value problem `x' = f(t, x)` of any size.
pub trait DynamicOde {
    /// Why the right-hand side may fail.
    type Error;

    /// `f(t, x)` into `dx`.
    ///
    /// # Errors
    /// Where the model has no value; see [`Ode::rhs`](crate::Ode::rhs).
    fn rhs(&mut self, t: f64, x: &[f64], dx: &mut [f64]) -> Result<(), Self::Error>;
}

/// Why there is no solver.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum NoSolver {
    /// The method is made for systems of fixed size only.
    #[error("{0:?} needs a system of fixed size: heun, rk4, dopri5, dop853, rodas4 and radau5 do not")]
    Method(Method),
    /// A setting that no method can work with.
    #[error(transparent)]
    Settings(#[from] SettingsError),
}

/// Takes single steps of a method.
pub struct DynamicSolver(Kind);

enum Kind {
    Explicit(ExplicitSolver),
    Implicit(ImplicitSolver),
}

/// What a [`DynamicSolver`] remembers: with it a run goes on bit by bit as if it had not been interrupted.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct DynamicState(KindState);

#[derive(Clone, Debug, Serialize, Deserialize)]
enum KindState {
    Explicit(ExplicitState),
    Implicit(ImplicitState),
}

/// The same call of both kinds.
macro_rules! both {
    ($self:ident, $solver:ident => $call:expr) => {
        match &$self.0 {
            Kind::Explicit($solver) => $call,
            Kind::Implicit($solver) => $call,
        }
    };
    (mut $self:ident, $solver:ident => $call:expr) => {
        match &mut $self.0 {
            Kind::Explicit($solver) => $call,
            Kind::Implicit($solver) => $call,
        }
    };
}

impl DynamicSolver {
    /// A solver without a past for as many states as there are nominal values.
    ///
    /// # Errors
    /// A method for systems of fixed size only, a step size or tolerance that is not finite and positive.
    pub fn new(settings: Settings, nominal: Vec<f64>) -> Result<Self, NoSolver> {
        let settings = settings.check()?;
        if let Some(explicit) = ExplicitSolver::new(&settings, &nominal) {
            return Ok(Self(Kind::Explicit(explicit)));
        }
        let implicit = ImplicitSolver::new(&settings, nominal);
        implicit.map(|solver| Self(Kind::Implicit(solver))).ok_or(NoSolver::Method(settings.method))
    }

    /// Whether the method chooses its own step size.
    #[must_use]
    pub fn is_adaptive(&self) -> bool {
        match &self.0 {
            Kind::Explicit(solver) => solver.is_adaptive(),
            Kind::Implicit(_) => true,
        }
    }

    /// Counters since the start.
    #[must_use]
    pub fn statistics(&self) -> Statistics {
        both!(self, solver => solver.statistics)
    }

    /// What the solver remembers.
    #[must_use]
    pub fn save(&self) -> DynamicState {
        DynamicState(match &self.0 {
            Kind::Explicit(solver) => KindState::Explicit(solver.save()),
            Kind::Implicit(solver) => KindState::Implicit(solver.save()),
        })
    }

    /// Goes on from what a solver with the same settings has remembered; a state that does not [fit](Self::fits) changes
    /// nothing.
    pub fn restore(&mut self, state: &DynamicState) {
        match (&mut self.0, &state.0) {
            (Kind::Explicit(solver), KindState::Explicit(state)) => solver.restore(state),
            (Kind::Implicit(solver), KindState::Implicit(state)) => solver.restore(state),
            _ => {}
        }
    }

    /// Whether a state has kind and sizes of this solver.
    #[must_use]
    pub fn fits(&self, state: &DynamicState) -> bool {
        match (&self.0, &state.0) {
            (Kind::Explicit(solver), KindState::Explicit(state)) => solver.fits(state),
            (Kind::Implicit(solver), KindState::Implicit(state)) => solver.fits(state),
            _ => false,
        }
    }

    /// Forgets step size, slope and Jacobian: after a jump of the state or of an input.
    pub fn restart(&mut self) {
        both!(mut self, solver => solver.restart());
    }

    /// Forgets the slope at the end: after the state was changed a little.
    pub fn changed(&mut self) {
        both!(mut self, solver => solver.changed());
    }

    /// One step from `(t, x)`: a fixed-step method goes to `t_end`, an adaptive one not beyond it. The result is the time
    /// reached, the state there is [`state`](Self::state).
    ///
    /// # Errors
    /// See [`StepError`].
    pub fn step<O: DynamicOde>(
        &mut self,
        ode: &mut O,
        t: f64,
        x: &[f64],
        t_end: f64,
    ) -> Result<f64, StepError<O::Error>> {
        if !(t.is_finite() && t_end.is_finite() && t < t_end) {
            return Err(StepError::Interval { t, t_end });
        }
        both!(mut self, solver => solver.step(ode, t, x, t_end))
    }

    /// State at the end of the last step.
    #[must_use]
    pub fn state(&self) -> &[f64] {
        both!(self, solver => solver.state())
    }

    /// Slope at the end of the last step, evaluated if it is not known; the next step begins with it.
    ///
    /// Afterwards the last evaluation was one at the end, unless others came in between.
    ///
    /// # Errors
    /// Those of the right-hand side.
    pub fn slope<O: DynamicOde>(&mut self, ode: &mut O) -> Result<&[f64], StepError<O::Error>> {
        both!(mut self, solver => solver.slope(ode))
    }

    /// Start and length of the last step [s].
    #[must_use]
    pub fn interval(&self) -> (f64, f64) {
        both!(self, solver => solver.interval())
    }

    /// State inside the last step at the fraction `theta`, see [`Dense`](crate::Dense).
    ///
    /// # Errors
    /// Those of the right-hand side: Dop853 needs further stages.
    pub fn inside<O: DynamicOde>(
        &mut self,
        ode: &mut O,
        theta: f64,
        out: &mut [f64],
    ) -> Result<(), StepError<O::Error>> {
        match &mut self.0 {
            Kind::Explicit(solver) => solver.inside(ode, theta, out),
            Kind::Implicit(solver) => {
                solver.inside(theta, out);
                Ok(())
            }
        }
    }

    /// State at the end of the last step repeated with the length `theta h`.
    ///
    /// # Errors
    /// As [`step`](Self::step).
    pub fn repeat<O: DynamicOde>(
        &mut self,
        ode: &mut O,
        theta: f64,
        out: &mut [f64],
    ) -> Result<(), StepError<O::Error>> {
        both!(mut self, solver => solver.repeat(ode, theta, out))
    }
}

fn all_finite<E>(t: f64, values: &[f64]) -> Result<(), StepError<E>> {
    match values.iter().position(|v| !v.is_finite()) {
        None => Ok(()),
        Some(index) => Err(StepError::NotFinite { t, index, value: values[index] }),
    }
}

/// `f(t, x)`, counted even when it fails.
fn rhs<O: DynamicOde>(
    ode: &mut O,
    t: f64,
    x: &[f64],
    dx: &mut [f64],
    statistics: &mut Statistics,
) -> Result<(), StepError<O::Error>> {
    statistics.rhs_evaluations += 1;
    ode.rhs(t, x, dx).map_err(|source| StepError::Rhs { t, source })
}
