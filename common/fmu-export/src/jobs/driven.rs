//! A system under its inputs as an initial value problem.

use std::cell::RefCell;

use integrators::{Indicators, Jacobian, Method, Ode, Solver};
use model::{EvaluationError, Matrix, Model, Pace, System, Variables, state_jacobian};
use num_dual::Dual64;

use super::{due, slack};
use crate::inputs::Polynomials;

/// Largest number of updates for events at one time.
const MAX_UPDATES: usize = 100;

/// The system under its inputs as an initial value problem.
pub(super) struct Driven<'a, const N: usize, const Z: usize, Y: System<N, Z>> {
    pub(super) system: &'a Y,
    /// Inputs that keep their values
    pub(super) u: <Y::Model as Model>::Inputs<f64>,
    /// The same as a list, and room for them as dual numbers
    pub(super) values: &'a [f64],
    pub(super) duals: RefCell<&'a mut [Dual64]>,
    /// Inputs that move
    pub(super) course: Option<RefCell<Course<'a>>>,
    pub(super) d: <Y::Model as Model>::Discrete,
}

/// Moving inputs: their polynomials, and the list of all inputs into which these are written.
pub(crate) struct Course<'a> {
    pub(crate) polynomials: &'a Polynomials,
    pub(crate) u: &'a mut [f64],
}

/// The inputs at `t`, in `$u`; they are loaded only if one of them moves.
macro_rules! inputs_at {
    ($driven:expr, $t:expr, $u:ident) => {
        let moving;
        let $u = match &$driven.course {
            None => &$driven.u,
            Some(course) => {
                let mut course = course.borrow_mut();
                let Course { polynomials, u } = &mut *course;
                polynomials.evaluate($t, u);
                moving = <Y::Model as Model>::Inputs::<f64>::load(u);
                &moving
            }
        };
    };
}
pub(super) use inputs_at;

impl<const N: usize, const Z: usize, Y: System<N, Z>> Ode<N> for Driven<'_, N, Z, Y> {
    type Error = EvaluationError;
    #[inline]
    fn rhs(&self, t: f64, x: &[f64; N]) -> Result<[f64; N], EvaluationError> {
        inputs_at!(self, t, u);
        self.system.rates(t, x, u, &self.d)
    }
    fn jacobian(&self, t: f64, x: &[f64; N], _f: &[f64; N]) -> Result<Jacobian<N>, EvaluationError> {
        let duals = &mut **self.duals.borrow_mut();
        let Some(course) = &self.course else {
            let by_state = state_jacobian(self.system, t, x, self.values, duals, &self.d)?;
            return self.with_time_derivative(t, x, &by_state, duals);
        };
        let mut course = course.borrow_mut();
        let Course { polynomials, u } = &mut *course;
        polynomials.evaluate(t, u);
        let by_state = state_jacobian(self.system, t, x, u, duals, &self.d)?;
        polynomials.evaluate(Dual64::new(t, 1.0), duals);
        self.with_time_derivative(t, x, &by_state, duals)
    }
    #[inline]
    fn project(&self, t: f64, x: &mut [f64; N]) -> Result<bool, EvaluationError> {
        self.system.project(t, x)
    }
    fn nominal(&self) -> [f64; N] {
        self.system.nominals()
    }
}

impl<const N: usize, const Z: usize, Y: System<N, Z>> Driven<'_, N, Z, Y> {
    /// The state Jacobian by rows, with df/dt from time and the inputs `u` and their rates.
    fn with_time_derivative(
        &self,
        t: f64,
        x: &[f64; N],
        by_state: &Matrix<f64, N, N>,
        u: &[Dual64],
    ) -> Result<Jacobian<N>, EvaluationError> {
        let u = <Y::Model as Model>::Inputs::<Dual64>::load(u);
        let rates = self.system.rates(Dual64::new(t, 1.0), &x.map(Dual64::from_re), &u, &self.d)?;
        let rows = std::array::from_fn(|i| std::array::from_fn(|k| by_state[(i, k)]));
        Ok((rows, rates.map(|rate| rate.eps)))
    }
}

impl<const N: usize, const Z: usize, Y: System<N, Z>> Indicators<N, Z> for Driven<'_, N, Z, Y> {
    fn indicators(&self, t: f64, x: &[f64; N]) -> [f64; Z] {
        inputs_at!(self, t, u);
        self.system.indicators(t, x, u, &self.d)
    }
}

impl<const N: usize, const Z: usize, Y: System<N, Z>> Driven<'_, N, Z, Y> {
    /// Take the method that suits the equations at `t`; the time after which to ask again.
    pub(super) fn choose_method(&self, t: f64, x: &[f64; N], solver: &mut Solver) -> f64 {
        inputs_at!(self, t, u);
        let Pace { stiff, span } = self.system.pace(t, x, u, &self.d);
        let method = if stiff { Method::Radau5 } else { Method::Dop853 };
        if method != solver.settings().method {
            *solver = solver.with_method(method);
            solver.reset();
        }
        span
    }

    /// How long the next step may be.
    pub(super) fn longest_step(&self, t: f64, x: &[f64; N]) -> f64 {
        inputs_at!(self, t, u);
        self.system.longest_step(x, u, &self.d)
    }

    /// Look at inputs that may have changed, unless an event that is due does so.
    pub(super) fn revise(&mut self, t: f64, x: &mut [f64; N], solver: &mut Solver) {
        if self.system.next_event(&self.d).is_some_and(|event| due(event, t, slack(self.system))) {
            return;
        }
        inputs_at!(self, t, u);
        let d = self.system.revise(t, x, u, &self.d);
        if d != self.d {
            self.d = d;
            solver.reset();
        }
    }

    /// Carry out the time events that are due at `t`.
    pub(super) fn pass_events(&mut self, t: f64, x: &mut [f64; N], solver: &mut Solver) {
        let slack = slack(self.system);
        for _ in 0..MAX_UPDATES {
            match self.system.next_event(&self.d) {
                Some(event) if due(event, t, slack) => {
                    inputs_at!(self, t, u);
                    self.d = self.system.update(event.max(t), x, u, &self.d);
                    solver.reset();
                }
                _ => return,
            }
        }
    }
}
