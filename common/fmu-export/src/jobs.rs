//! Jobs on a system whose number of states is known inside only: start, values, events, step.

mod driven;
mod linear;
mod step;

use model::{EvaluationError, Group, Model, Outputs, ParameterError, System, Variables, Visitor};

pub(crate) use driven::Course;
pub(crate) use linear::{LinearCache, PrepareLinear};
pub(crate) use step::Step;

use crate::Fault;

/// States that are off their manifold by more are brought back at an event.
const OFF_MANIFOLD: f64 = 1e-8;

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
        if self.values.is_empty() {
            return; // a Co-Simulation FMU need not show them
        }
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
        let slack = slack(system);
        let event = system.next_event(&d).filter(|event| due(*event, self.t, slack));
        let u = M::Inputs::<f64>::load(self.u);
        if self.crossed || event.is_some() {
            d = system.update(event.map_or(self.t, |event| event.max(self.t)), &mut x, &u, &d);
        } else {
            d = system.revise(self.t, &mut x, &u, &d);
        }
        if let Some(i) = not_finite(&x) {
            let variable = system.state_names()[i].clone();
            return Err(Fault::NotFinite { variable, value: x[i], t: self.t });
        }
        let states = x.map(f64::to_bits) != before.map(f64::to_bits);
        let changed = states || d != *self.d;
        let next = system.next_event(&d);
        let again = next.is_some_and(|event| due(event, self.t, slack)) || system.awaits_answer(self.d, &d);
        self.x.copy_from_slice(&x);
        *self.d = d;
        Ok(Updated { changed, states, again, next })
    }
}

/// The first state that is not finite.
fn not_finite<const N: usize>(x: &[f64; N]) -> Option<usize> {
    x.iter().position(|x| !x.is_finite())
}

/// True if the time of an event has come.
fn due(event: f64, t: f64, slack: f64) -> bool {
    event <= t + slack + 4.0 * f64::EPSILON * t.abs()
}

/// Part of a sample period by which the times of hosts may miss it.
const SAME_SAMPLE: f64 = 1e-6;

/// How far before its time an event is due, and after it not yet passed.
fn slack<const N: usize, const Z: usize>(system: &impl System<N, Z>) -> f64 {
    system.sample_period().map_or(0.0, |period| SAME_SAMPLE * period)
}
