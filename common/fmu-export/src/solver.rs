//! The variables of the built-in solver, the same in every FMU.

use integrators::{Method, Settings, Statistics};
use model::{EnumType, Enumeration, Kind, Model, Variables};

use crate::Fault;
use crate::table::Variable;

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
    /// dop853, and radau5 where the equations are stiff
    Auto = 8,
}

impl From<Method> for SolverMethod {
    fn from(method: Method) -> Self {
        match method {
            Method::Heun => Self::Heun,
            Method::Rk4 => Self::Rk4,
            Method::Dopri5 => Self::Dopri5,
            Method::Dop853 => Self::Dop853,
            Method::Rodas4 => Self::Rodas4,
            Method::Radau5 => Self::Radau5,
            Method::Exact => Self::Exact,
        }
    }
}

/// Name of a method by its number.
pub(crate) fn method_name(number: i64) -> &'static str {
    let Kind::Enumeration(methods) = <SolverMethod as Variables<f64>>::TABLE[0].kind else {
        return "";
    };
    methods.items.iter().find(|i| i.value == number).map_or("unknown", |i| i.name)
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

/// Counter of FMUs that choose between explicit and implicit methods themselves.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(local)]
pub(crate) struct AutoCounters {
    /// Jacobians of implicit methods since the start
    #[var(name = "solver.jacobians")]
    pub(crate) jacobians: u64,
}

/// The type of `solver.method` where `auto` is not on offer.
static WITHOUT_AUTO: EnumType = {
    let Kind::Enumeration(all) = <SolverMethod as Variables<f64>>::TABLE[0].kind else {
        panic!("an enumeration")
    };
    EnumType { name: all.name, description: all.description, items: all.items.split_at(7).0 }
};

/// Type, method, step and tolerances by which the model `M` is solved unless others are set.
pub(crate) fn defaults<M: Model>(solver: &mut [Variable]) {
    let [rtol, atol] = M::TOLERANCES;
    #[allow(clippy::cast_precision_loss, reason = "a small number")]
    let starts = [
        ("solver.method", M::METHOD as f64),
        ("solver.step", M::STEP),
        ("solver.rtol", rtol),
        ("solver.atol", atol),
    ];
    for Variable { name, entry, .. } in solver {
        if let Some((_, start)) = starts.iter().find(|(n, _)| n == name) {
            entry.start = *start;
        }
        if matches!(entry.kind, Kind::Enumeration(_)) && !offers_auto::<M>() {
            entry.kind = Kind::Enumeration(&WITHOUT_AUTO);
        }
    }
}

/// True if the model `M` lets the export layer choose between explicit and implicit methods.
pub(crate) const fn offers_auto<M: Model>() -> bool {
    let mut i = 0;
    while i < M::METHODS.len() {
        if M::METHODS[i] == SolverMethod::Auto as i64 {
            return true;
        }
        i += 1;
    }
    false
}

impl SolverParameters {
    /// True if the method changes with the stiffness of the equations.
    pub(crate) fn auto(&self) -> bool {
        self.method == SolverMethod::Auto
    }

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
            SolverMethod::Dop853 | SolverMethod::Auto => Method::Dop853,
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
