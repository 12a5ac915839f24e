//! The method `exact`: linear systems under moving inputs.

use std::any::Any;

use integrators::{LinearForm, LinearSteps, Method, Solver, Statistics, StepError};
use model::{EvaluationError, Linear, Model, System, Variables, Visitor};

use super::driven::{Course, Driven, inputs_at};

/// [`LinearSteps`] for the number of states that the model has chosen; what it holds changes no result.
pub(crate) type LinearCache = Option<Box<dyn Any + Send>>;

/// Room for the matrices, so that steps allocate nothing.
pub(crate) struct PrepareLinear;

impl<M: Model> Visitor<M> for PrepareLinear {
    type Output = LinearCache;
    fn visit<const N: usize, const Z: usize, Y: System<N, Z, Model = M>>(self, _system: &Y) -> LinearCache {
        Some(Box::new(LinearSteps::<N>::default()))
    }
}

/// Advance from `t` to `end`, `interval` away: by its transition matrix if the method is `exact` and the system linear
/// meanwhile, by `dop853` if it is not, and by any other method as it is.
pub(super) fn advance<const N: usize, const Z: usize, Y: System<N, Z>>(
    driven: &Driven<'_, N, Z, Y>,
    (t, end, interval): (f64, f64, f64),
    x: &mut [f64; N],
    solver: &mut Solver,
    statistics: &mut Statistics,
    cache: &mut LinearCache,
) -> Result<(), StepError<EvaluationError>> {
    if solver.settings().method != Method::Exact {
        return solver.advance(driven, t, end, x, statistics);
    }
    inputs_at!(driven, t, u);
    if let Some(Linear { states, amplitude, omega, phase }) = driven.system.linear(u, &driven.d) {
        let form = LinearForm { states, amplitude, omega, phase, steady: driven.course.is_none() };
        if !cache.as_ref().is_some_and(|kept| kept.is::<LinearSteps<N>>()) {
            *cache = Some(Box::new(LinearSteps::<N>::default())); // a restored state of another structure
        }
        if let Some(steps) = cache.as_mut().and_then(|kept| kept.downcast_mut::<LinearSteps<N>>()) {
            match steps.advance(driven, &form, (t, interval), solver.settings(), x, statistics) {
                Err(StepError::NotLinear { .. }) => {}
                other => return other,
            }
        }
    }
    let mut other = solver.with_method(Method::Dop853);
    other.advance(driven, t, end, x, statistics)?;
    solver.restore(other.memory());
    Ok(())
}
