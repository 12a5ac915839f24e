//! Jobs on a system whose number of states is known inside only: start, outputs, step.

use std::cell::RefCell;

use integrators::{
    Complex, Indicators, Jacobian, Method, Ode, Reached, Solver, Statistics, StepError, largest_stable_step,
    violates,
};
use model::{
    EvaluationError, Group, Model, Outputs, ParameterError, Spectrum, System, Variables, Visitor,
    state_jacobian,
};
use num_dual::Dual64;

use crate::Fault;

/// Largest number of updates for events at one time.
const MAX_UPDATES: usize = 100;

/// States and discrete states at the start.
pub(crate) struct Start<'a> {
    pub(crate) t: f64,
    /// Start values of the motion group
    pub(crate) given: &'a [f64],
}

impl<M: Model> Visitor<M> for Start<'_> {
    type Output = Result<(Vec<f64>, M::Discrete), ParameterError>;
    fn visit<const N: usize, const Z: usize, Y: System<N, Z, Model = M>>(self, system: &Y) -> Self::Output {
        let (x, d) = system.start(self.t, &M::Motion::<f64>::load(self.given))?;
        Ok((x.to_vec(), d))
    }
}

/// Values of one group of outputs; in dual numbers their directional derivatives.
pub(crate) struct Evaluate<'a, M: Model, S> {
    pub(crate) group: Group,
    pub(crate) t: f64,
    pub(crate) x: &'a [f64],
    pub(crate) u: &'a [S],
    pub(crate) d: &'a M::Discrete,
    pub(crate) values: &'a mut [S],
}

impl<M: Model, S: model::Scalar> Visitor<M> for Evaluate<'_, M, S> {
    type Output = Result<(), EvaluationError>;
    fn visit<const N: usize, const Z: usize, Y: System<N, Z, Model = M>>(self, system: &Y) -> Self::Output {
        let x: [S; N] = std::array::from_fn(|i| S::lift(self.x[i]));
        system.evaluate(
            self.group,
            S::lift(self.t),
            &x,
            &M::Inputs::<S>::load(self.u),
            self.d,
            self.values,
        )
    }
}

/// The system under its inputs as an initial value problem.
struct Driven<'a, const N: usize, const Z: usize, Y: System<N, Z>> {
    system: &'a Y,
    u: <Y::Model as Model>::Inputs<f64>,
    /// The inputs as a list, and room for them as dual numbers
    values: &'a [f64],
    duals: RefCell<&'a mut [Dual64]>,
    d: <Y::Model as Model>::Discrete,
}

impl<const N: usize, const Z: usize, Y: System<N, Z>> Ode<N> for Driven<'_, N, Z, Y> {
    type Error = EvaluationError;
    #[inline]
    fn rhs(&self, t: f64, x: &[f64; N]) -> Result<[f64; N], EvaluationError> {
        self.system.rates(t, x, &self.u, &self.d)
    }
    #[inline]
    fn project(&self, t: f64, x: &mut [f64; N]) -> Result<bool, EvaluationError> {
        self.system.project(t, x)
    }
    fn nominal(&self) -> [f64; N] {
        self.system.nominals()
    }
    fn jacobian(&self, t: f64, x: &[f64; N], _f: &[f64; N]) -> Result<Jacobian<N>, EvaluationError> {
        let duals = &mut **self.duals.borrow_mut();
        let j = state_jacobian(self.system, t, x, self.values, duals, &self.d)?;
        let u = <Y::Model as Model>::Inputs::<Dual64>::load(duals); // filled with the inputs by now
        let rates = self
            .system
            .rates(Dual64::new(t, 1.0), &x.map(Dual64::from_re), &u, &self.d)?;
        let rows = std::array::from_fn(|i| std::array::from_fn(|k| j[(i, k)]));
        Ok((rows, rates.map(|rate| rate.eps)))
    }
}

impl<const N: usize, const Z: usize, Y: System<N, Z>> Indicators<N, Z> for Driven<'_, N, Z, Y> {
    fn indicators(&self, t: f64, x: &[f64; N]) -> [f64; Z] {
        self.system.indicators(t, x, &self.u, &self.d)
    }
}

impl<const N: usize, const Z: usize, Y: System<N, Z>> Driven<'_, N, Z, Y> {
    /// Carry out the time events that are due at `t`.
    fn pass_events(&mut self, t: f64, x: &mut [f64; N], solver: &mut Solver) {
        let due = |event: f64| event <= t + 4.0 * f64::EPSILON * t.abs();
        for _ in 0..MAX_UPDATES {
            match self.system.next_event(&self.d) {
                Some(event) if due(event) => {
                    self.d = self.system.update(event.max(t), x, &self.u, &self.d);
                    solver.reset();
                }
                _ => return,
            }
        }
    }
}

/// One communication step with everything that happens inside it; nothing changes on failure.
pub(crate) struct Step<'a, M: Model> {
    pub(crate) from: f64,
    pub(crate) to: f64,
    pub(crate) u: &'a [f64],
    /// Look at the eigenvalues first (fixed-step explicit methods)
    pub(crate) guard: bool,
    pub(crate) duals: &'a mut [Dual64],
    pub(crate) x: &'a mut [f64],
    pub(crate) d: &'a mut M::Discrete,
    pub(crate) solver: &'a mut Solver,
    pub(crate) statistics: &'a mut Statistics,
}

impl<M: Model> Visitor<M> for Step<'_, M> {
    type Output = Result<(), Fault>;
    fn visit<const N: usize, const Z: usize, Y: System<N, Z, Model = M>>(
        self,
        system: &Y,
    ) -> Result<(), Fault> {
        let Self { from, to, u, .. } = self;
        let fault = |e| Fault::step(from, to - from, &e, || system.state_names());
        let mut x: [f64; N] = std::array::from_fn(|i| self.x[i]);
        let (mut solver, mut statistics) = (*self.solver, *self.statistics);
        if self.guard {
            let jacobian = state_jacobian(system, from, &x, u, self.duals, self.d)
                .map_err(|source| fault(StepError::Rhs { t: from, source }))?;
            if let Some(eigenvalues) = Y::Spectrum::eigenvalues(&jacobian) {
                stable(&solver, (from, to), &eigenvalues.map(Complex::from))?;
            } // not finite: the first stage meets it and names the state
        }
        let mut driven = Driven {
            system,
            u: M::Inputs::<f64>::load(u),
            values: u,
            duals: RefCell::new(self.duals),
            d: *self.d,
        };
        let mut t = from;
        loop {
            driven.pass_events(t, &mut x, &mut solver);
            if t >= to {
                break;
            }
            let target = system
                .next_event(&driven.d)
                .filter(|event| *event < to)
                .unwrap_or(to);
            if Z == 0 {
                solver
                    .advance(&driven, t, target, &mut x, &mut statistics)
                    .map_err(fault)?;
                t = target;
                continue;
            }
            match solver
                .advance_until(&driven, &driven, t, target, &mut x, &mut statistics)
                .map_err(fault)?
            {
                Reached::End => t = target,
                Reached::Event { t: at, .. } => {
                    t = at;
                    driven.d = system.update(t, &mut x, &driven.u, &driven.d);
                    solver.reset();
                }
            }
        }
        self.x.copy_from_slice(&x);
        *self.d = driven.d;
        *self.solver = solver;
        *self.statistics = statistics;
        Ok(())
    }
}

/// Refuse a fixed step with which an explicit method would amplify a mode.
fn stable(solver: &Solver, (from, to): (f64, f64), eigenvalues: &[Complex]) -> Result<(), Fault> {
    let method = solver.settings().method;
    let h = solver.settings().inner_step(to - from);
    let growth = |lambda: Complex| method.stability(h * lambda).abs();
    let Some(&worst) = eigenvalues
        .iter()
        .filter(|lambda| violates(method, h, **lambda))
        .max_by(|a, b| growth(**a).total_cmp(&growth(**b)))
    else {
        return Ok(());
    };
    let method_name = match method {
        Method::Heun => "heun",
        Method::Rk4 => "rk4",
        Method::Dopri5 => "dopri5",
        Method::Dop853 => "dop853",
        Method::Rodas4 => "rodas4",
        Method::Radau5 => "radau5",
        Method::Exact => "exact",
    };
    Err(Fault::Unstable {
        t: from,
        method: method_name,
        h,
        re: worst.re,
        im: worst.im,
        factor: growth(worst),
        largest: largest_stable_step(method, eigenvalues),
    })
}
