//! One communication step.

use std::cell::RefCell;

use integrators::{
    Complex, MAX_EVALUATIONS, Reached, Solver, Statistics, StepError, largest_stable_step, violates,
};
use model::{Model, Spectrum, System, Variables, Visitor, state_jacobian};
use num_dual::Dual64;

use super::driven::{Course, Driven, inputs_at};
use super::linear::{LinearCache, advance};
use super::{due, not_finite, slack};
use crate::Fault;
use crate::solver::{SolverMethod, method_name};

/// One communication step with everything that happens inside it; nothing changes on failure.
pub(crate) struct Step<'a, M: Model> {
    pub(crate) from: f64,
    pub(crate) to: f64,
    /// Its length as the host gives it; `to - from` differs in its last bits from step to step
    pub(crate) interval: f64,
    pub(crate) u: &'a [f64],
    /// Inputs that move
    pub(crate) course: Option<Course<'a>>,
    /// Leave events at the end of the step to Event Mode
    pub(crate) leave_events: bool,
    /// The method follows the stiffness of the equations
    pub(crate) auto: bool,
    /// Look at the eigenvalues first (fixed-step explicit methods)
    pub(crate) guard: bool,
    pub(crate) duals: &'a mut [Dual64],
    pub(crate) x: &'a mut [f64],
    pub(crate) d: &'a mut M::Discrete,
    pub(crate) solver: &'a mut Solver,
    pub(crate) statistics: &'a mut Statistics,
    /// Matrices of the method `exact`
    pub(crate) linear: &'a mut LinearCache,
}

impl<M: Model> Visitor<M> for Step<'_, M> {
    /// An event is left for Event Mode
    type Output = Result<bool, Fault>;
    fn visit<const N: usize, const Z: usize, Y: System<N, Z, Model = M>>(
        self,
        system: &Y,
    ) -> Result<bool, Fault> {
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
        let given = M::Inputs::<f64>::load(u);
        let d = system.settle(&mut x, &given, self.d);
        let mut driven = Driven {
            system,
            u: given,
            values: u,
            duals: RefCell::new(self.duals),
            course: self.course.map(RefCell::new),
            d,
        };
        let adaptive = solver.settings().method.is_adaptive();
        let mut t = from;
        let slack = slack(system);
        // samples at the end of the step wait for the inputs of that time
        let leave_events = self.leave_events || system.sample_period().is_some();
        if !self.leave_events {
            driven.revise(from, &mut x, &mut solver);
        }
        let most_work = statistics.work(N) + MAX_EVALUATIONS;
        loop {
            if statistics.work(N) > most_work {
                // many events, each cheap
                return Err(fault(StepError::TooMuchWork { t, t_end: to, h: solver.memory().step }));
            }
            if t < to || !leave_events {
                driven.pass_events(t, &mut x, &mut solver);
            }
            if t >= to {
                break;
            }
            let mut target = system.next_event(&driven.d).filter(|event| *event < to - slack).unwrap_or(to);
            if self.auto {
                let span = driven.choose_method(t, &x, &mut solver);
                if span < 0.75 * (target - t) {
                    target = t + span;
                    if target <= t {
                        // below the resolution of time
                        return Err(fault(StepError::TooMuchWork { t, t_end: to, h: span }));
                    }
                }
            }
            if adaptive {
                let longest = driven.longest_step(t, &x);
                if longest < 0.75 * (target - t) && t + longest > t {
                    target = t + longest;
                }
            }
            if Z == 0 {
                let whole = t.to_bits() == from.to_bits() && target.to_bits() == to.to_bits();
                let span = (t, target, if whole { self.interval } else { target - t });
                advance(&driven, span, &mut x, &mut solver, &mut statistics, self.linear).map_err(fault)?;
                t = target;
                continue;
            }
            match solver.advance_until(&driven, &driven, t, target, &mut x, &mut statistics).map_err(fault)? {
                Reached::End => t = target,
                Reached::Event { t: at, .. } => {
                    t = at;
                    inputs_at!(driven, t, u);
                    driven.d = system.update(t, &mut x, u, &driven.d);
                    solver.reset();
                }
            }
        }
        if let Some(index) = not_finite(&x) {
            return Err(fault(StepError::NotFinite { t, index, value: x[index] })); // by an event at the end
        }
        self.x.copy_from_slice(&x);
        *self.d = driven.d;
        *self.solver = solver;
        *self.statistics = statistics;
        Ok(system.next_event(&driven.d).is_some_and(|event| due(event, to, slack)))
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
    Err(Fault::Unstable {
        t: from,
        method: method_name(SolverMethod::from(method) as i64),
        h,
        re: worst.re,
        im: worst.im,
        factor: growth(worst),
        largest: largest_stable_step(method, eigenvalues),
    })
}
