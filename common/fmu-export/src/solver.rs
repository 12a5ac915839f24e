//! The variables of the built-in solver, the same in every FMU.

use integrators::{Method, Settings, Statistics};
use model::{Enumeration, Variables};

use crate::Fault;

/// Integration method
#[derive(Debug, Clone, Copy, PartialEq, Eq, Enumeration)]
pub enum SolverMethod {
    /// Heun, order 2, fixed step (the paper's ode2)
    Heun = 1,
    /// Classical Runge-Kutta, order 4, fixed step
    Rk4 = 2,
    /// Dormand-Prince, order 5, adaptive
    Dopri5 = 3,
    /// Dormand-Prince, order 8, adaptive
    Dop853 = 4,
    /// Rosenbrock, order 4, adaptive, for stiff cases
    Rodas4 = 5,
    /// Radau IIA, order 5, adaptive, for stiff cases
    Radau5 = 6,
    /// Transition matrix, for linear parts
    Exact = 7,
}

/// Solver parameters.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(parameter)]
pub struct SolverParameters {
    /// Integration method
    #[var(name = "solver.method", item = SolverMethod::Rk4)]
    pub method: SolverMethod,
    /// Inner step of fixed-step methods; a communication step is divided into equal steps of at most this [s]
    #[var(name = "solver.step", start = 1e-3, above = 0.0)]
    pub step: f64,
    /// Relative tolerance of adaptive methods
    #[var(name = "solver.rtol", start = 1e-6, above = 0.0)]
    pub rtol: f64,
    /// Absolute tolerance of adaptive methods, times each state's typical magnitude
    #[var(name = "solver.atol", start = 1e-9, above = 0.0)]
    pub atol: f64,
}

/// What the solver has done since the start.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(local)]
pub struct SolverCounters {
    /// Accepted steps since the start
    #[var(name = "solver.steps")]
    pub steps: u64,
    /// Evaluations of the right-hand side by the method since the start
    #[var(name = "solver.rhs_evaluations")]
    pub rhs_evaluations: u64,
    /// Rejected steps since the start
    #[var(name = "solver.rejected")]
    pub rejected: u64,
}

impl SolverParameters {
    /// Settings of the integrator.
    ///
    /// # Errors
    /// [`Fault::MethodNotOffered`] for a method that the model does not offer.
    pub fn settings(&self, offered: &'static [i64]) -> Result<Settings, Fault> {
        let number = self.method as i64;
        if !offered.contains(&number) {
            return Err(Fault::MethodNotOffered { method: number, offered });
        }
        let method = match self.method {
            SolverMethod::Heun => Method::Heun,
            SolverMethod::Rk4 => Method::Rk4,
            SolverMethod::Dopri5 => Method::Dopri5,
            SolverMethod::Dop853 => Method::Dop853,
            SolverMethod::Rodas4 => Method::Rodas4,
            SolverMethod::Radau5 => Method::Radau5,
            SolverMethod::Exact => Method::Exact,
        };
        let Self { step, rtol, atol, .. } = *self;
        Ok(Settings { method, step, rtol, atol })
    }
}

impl From<Statistics> for SolverCounters {
    fn from(s: Statistics) -> Self {
        Self { steps: s.steps, rhs_evaluations: s.rhs_evaluations, rejected: s.rejected }
    }
}
