//! The method `exact`: linear systems under moving inputs.

use std::any::Any;

use integrators::{Harmonic, Jacobian, LinearOde, LinearSteps, Method, Ode, Solver, Statistics, StepError};
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

/// A system while it is linear.
struct Linearly<'a, 'b, const N: usize, const Z: usize, Y: System<N, Z>> {
    driven: &'a Driven<'b, N, Z, Y>,
    form: Linear<N>,
}

impl<const N: usize, const Z: usize, Y: System<N, Z>> Ode<N> for Linearly<'_, '_, N, Z, Y> {
    type Error = EvaluationError;
    fn rhs(&self, t: f64, x: &[f64; N]) -> Result<[f64; N], EvaluationError> {
        self.driven.rhs(t, x)
    }
    fn jacobian(&self, t: f64, x: &[f64; N], f: &[f64; N]) -> Result<Jacobian<N>, EvaluationError> {
        self.driven.jacobian(t, x, f)
    }
}

impl<const N: usize, const Z: usize, Y: System<N, Z>> LinearOde<N> for Linearly<'_, '_, N, Z, Y> {
    fn states(&self) -> usize {
        self.form.states
    }
    fn harmonic(&self) -> Harmonic<N> {
        let Linear { amplitude, omega, phase, .. } = self.form;
        Harmonic { amplitude, omega, phase }
    }
    fn steady(&self) -> bool {
        self.driven.course.is_none()
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
    if let Some(form) = driven.system.linear(u, &driven.d) {
        let steps = cache.get_or_insert_with(|| Box::new(LinearSteps::<N>::default()));
        if !steps.is::<LinearSteps<N>>() {
            *steps = Box::new(LinearSteps::<N>::default()); // a restored state of another structure
        }
        if let Some(steps) = steps.downcast_mut::<LinearSteps<N>>() {
            let linearly = Linearly { driven, form };
            match steps.advance(&linearly, (t, interval), solver.settings().step, x, statistics) {
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
