//! Jobs on a system whose number of states is known inside only: start, values, events, step.

use std::cell::RefCell;

use integrators::{
    Complex, Indicators, Jacobian, MAX_EVALUATIONS, Method, Ode, Reached, Solver, Statistics, StepError,
    largest_stable_step, violates,
};
use model::Matrix;
use model::{
    EvaluationError, Group, Model, Outputs, Pace, ParameterError, Spectrum, System, Variables, Visitor,
    state_jacobian,
};
use num_dual::Dual64;

use crate::Fault;
use crate::inputs::Polynomials;

/// States that are off their manifold by more are brought back at an event.
const OFF_MANIFOLD: f64 = 1e-8;

/// Largest number of updates for events at one time.
const MAX_UPDATES: usize = 100;

/// States and discrete states at the start, with the names of the states.
pub(crate) struct Start<'a> {
    pub(crate) t: f64,
    /// Start values of the motion group
    pub(crate) given: &'a [f64],
}

impl<M: Model> Visitor<M> for Start<'_> {
    type Output = Result<(Vec<f64>, M::Discrete, Vec<String>), ParameterError>;
    fn visit<const N: usize, const Z: usize, Y: System<N, Z, Model = M>>(self, system: &Y) -> Self::Output {
        let (x, d) = system.start(self.t, &M::Motion::<f64>::load(self.given))?;
        Ok((x.to_vec(), d, system.state_names().to_vec()))
    }
}

/// Discrete states at the end of initialisation.
pub(crate) struct Begin<'a, M: Model> {
    pub(crate) x: &'a [f64],
    pub(crate) u: &'a [f64],
    pub(crate) d: &'a M::Discrete,
}

impl<M: Model> Visitor<M> for Begin<'_, M> {
    type Output = M::Discrete;
    fn visit<const N: usize, const Z: usize, Y: System<N, Z, Model = M>>(self, system: &Y) -> M::Discrete {
        let x: [f64; N] = std::array::from_fn(|i| self.x[i]);
        system.begin(&x, &M::Inputs::<f64>::load(self.u), self.d)
    }
}

/// Values of one group of outputs; in dual numbers their directional derivatives.
pub(crate) struct Evaluate<'a, M: Model, S> {
    pub(crate) group: Group,
    pub(crate) t: f64,
    pub(crate) x: &'a [S],
    pub(crate) u: &'a [S],
    pub(crate) d: &'a M::Discrete,
    pub(crate) values: &'a mut [S],
}

impl<M: Model, S: model::Scalar> Visitor<M> for Evaluate<'_, M, S> {
    type Output = Result<(), EvaluationError>;
    fn visit<const N: usize, const Z: usize, Y: System<N, Z, Model = M>>(self, system: &Y) -> Self::Output {
        let x: [S; N] = std::array::from_fn(|i| self.x[i]);
        system.evaluate(self.group, S::lift(self.t), &x, &M::Inputs::<S>::load(self.u), self.d, self.values)
    }
}

/// Time derivatives of all declared states; zero for those that the system does not use.
pub(crate) struct Rates<'a, M: Model, S> {
    pub(crate) t: f64,
    pub(crate) x: &'a [S],
    pub(crate) u: &'a [S],
    pub(crate) d: &'a M::Discrete,
    /// Place of each state among the declared ones
    pub(crate) places: &'a [usize],
    pub(crate) values: &'a mut [S],
}

impl<M: Model, S: model::Scalar> Visitor<M> for Rates<'_, M, S> {
    type Output = Result<(), EvaluationError>;
    fn visit<const N: usize, const Z: usize, Y: System<N, Z, Model = M>>(self, system: &Y) -> Self::Output {
        let x: [S; N] = std::array::from_fn(|i| self.x[i]);
        let rates = system.rates(S::lift(self.t), &x, &M::Inputs::<S>::load(self.u), self.d)?;
        self.values.fill(S::lift(0.0));
        for (place, rate) in self.places.iter().zip(rates) {
            self.values[*place] = rate;
        }
        Ok(())
    }
}

/// Event indicators; 1 for those that the system does not use.
pub(crate) struct EventIndicators<'a, M: Model> {
    pub(crate) t: f64,
    pub(crate) x: &'a [f64],
    pub(crate) u: &'a [f64],
    pub(crate) d: &'a M::Discrete,
    pub(crate) values: &'a mut [f64],
}

impl<M: Model> Visitor<M> for EventIndicators<'_, M> {
    type Output = ();
    fn visit<const N: usize, const Z: usize, Y: System<N, Z, Model = M>>(self, system: &Y) {
        let x: [f64; N] = std::array::from_fn(|i| self.x[i]);
        let indicators = system.indicators(self.t, &x, &M::Inputs::<f64>::load(self.u), self.d);
        self.values.fill(1.0);
        self.values[..Z].copy_from_slice(&indicators);
    }
}

/// Typical magnitudes of the declared states, where the system knows them.
pub(crate) struct Nominals<'a> {
    pub(crate) places: &'a [usize],
    pub(crate) values: &'a mut [f64],
}

impl<M: Model> Visitor<M> for Nominals<'_> {
    type Output = ();
    fn visit<const N: usize, const Z: usize, Y: System<N, Z, Model = M>>(self, system: &Y) {
        for (place, nominal) in self.places.iter().zip(system.nominals()) {
            if nominal.is_finite() {
                self.values[*place] = nominal;
            }
        }
    }
}

/// Number of states.
pub(crate) struct Size;

impl<M: Model> Visitor<M> for Size {
    type Output = usize;
    fn visit<const N: usize, const Z: usize, Y: System<N, Z, Model = M>>(self, _system: &Y) -> usize {
        N
    }
}

/// True if the states have left their manifold.
pub(crate) struct Astray<'a> {
    pub(crate) x: &'a [f64],
}

impl<M: Model> Visitor<M> for Astray<'_> {
    type Output = bool;
    fn visit<const N: usize, const Z: usize, Y: System<N, Z, Model = M>>(self, system: &Y) -> bool {
        let x: [f64; N] = std::array::from_fn(|i| self.x[i]);
        system.off_manifold(&x) > OFF_MANIFOLD
    }
}

/// One pass of the event iteration.
pub(crate) struct Update<'a, M: Model> {
    pub(crate) t: f64,
    /// An indicator has crossed zero
    pub(crate) crossed: bool,
    pub(crate) u: &'a [f64],
    pub(crate) x: &'a mut [f64],
    pub(crate) d: &'a mut M::Discrete,
}

/// What an event did.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Updated {
    /// States or discrete states changed
    pub(crate) changed: bool,
    /// States changed
    pub(crate) states: bool,
    /// Another event is due now
    pub(crate) again: bool,
    /// Time of the next event
    pub(crate) next: Option<f64>,
}

impl<M: Model> Visitor<M> for Update<'_, M> {
    /// Nothing changes where a state would not be finite or stay off its manifold
    type Output = Result<Updated, Fault>;
    fn visit<const N: usize, const Z: usize, Y: System<N, Z, Model = M>>(self, system: &Y) -> Self::Output {
        let before: [f64; N] = std::array::from_fn(|i| self.x[i]);
        let mut x = before;
        if system.off_manifold(&x) > OFF_MANIFOLD {
            system.normalise(&mut x);
            let off = system.off_manifold(&x);
            if off > OFF_MANIFOLD {
                return Err(Fault::OffManifold { t: self.t, off });
            }
        }
        let mut d = *self.d;
        let event = system.next_event(&d).filter(|event| due(*event, self.t));
        if self.crossed || event.is_some() {
            let t = event.map_or(self.t, |event| event.max(self.t));
            d = system.update(t, &mut x, &M::Inputs::<f64>::load(self.u), &d);
        }
        if let Some(i) = not_finite(&x) {
            let variable = system.state_names()[i].clone();
            return Err(Fault::NotFinite { variable, value: x[i], t: self.t });
        }
        let states = x.map(f64::to_bits) != before.map(f64::to_bits);
        let changed = states || d != *self.d;
        self.x.copy_from_slice(&x);
        *self.d = d;
        let next = system.next_event(&d);
        Ok(Updated { changed, states, again: next.is_some_and(|event| due(event, self.t)), next })
    }
}

/// The first state that is not finite.
fn not_finite<const N: usize>(x: &[f64; N]) -> Option<usize> {
    x.iter().position(|x| !x.is_finite())
}

/// True if the time of an event has come.
fn due(event: f64, t: f64) -> bool {
    event <= t + 4.0 * f64::EPSILON * t.abs()
}

/// The system under its inputs as an initial value problem.
struct Driven<'a, const N: usize, const Z: usize, Y: System<N, Z>> {
    system: &'a Y,
    /// Inputs that keep their values
    u: <Y::Model as Model>::Inputs<f64>,
    /// The same as a list, and room for them as dual numbers
    values: &'a [f64],
    duals: RefCell<&'a mut [Dual64]>,
    /// Inputs that move
    course: Option<RefCell<Course<'a>>>,
    d: <Y::Model as Model>::Discrete,
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
    fn choose_method(&self, t: f64, x: &[f64; N], solver: &mut Solver) -> f64 {
        inputs_at!(self, t, u);
        let Pace { stiff, span } = self.system.pace(t, x, u, &self.d);
        let method = if stiff { Method::Radau5 } else { Method::Dop853 };
        if method != solver.settings().method {
            *solver = solver.with_method(method);
            solver.reset();
        }
        span
    }

    /// Carry out the time events that are due at `t`.
    fn pass_events(&mut self, t: f64, x: &mut [f64; N], solver: &mut Solver) {
        for _ in 0..MAX_UPDATES {
            match self.system.next_event(&self.d) {
                Some(event) if due(event, t) => {
                    inputs_at!(self, t, u);
                    self.d = self.system.update(event.max(t), x, u, &self.d);
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
        let mut driven = Driven {
            system,
            u: M::Inputs::<f64>::load(u),
            values: u,
            duals: RefCell::new(self.duals),
            course: self.course.map(RefCell::new),
            d: *self.d,
        };
        let mut t = from;
        let most_work = statistics.work(N) + MAX_EVALUATIONS;
        loop {
            if statistics.work(N) > most_work {
                // many events, each cheap
                return Err(fault(StepError::TooMuchWork { t, t_end: to, h: solver.memory().step }));
            }
            if t < to || !self.leave_events {
                driven.pass_events(t, &mut x, &mut solver);
            }
            if t >= to {
                break;
            }
            let mut target = system.next_event(&driven.d).filter(|event| *event < to).unwrap_or(to);
            if self.auto {
                let span = driven.choose_method(t, &x, &mut solver);
                if span < 0.75 * (target - t) {
                    target = t + span;
                }
            }
            if Z == 0 {
                solver.advance(&driven, t, target, &mut x, &mut statistics).map_err(fault)?;
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
        Ok(system.next_event(&driven.d).is_some_and(|event| due(event, to)))
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
