//! Motions and indicators for event tests.
#![allow(dead_code, reason = "each test file uses its part")]

use integrators::{Crossing, Indicators, Jacobian, Ode, Reached, Solver, Statistics};
use std::convert::Infallible;

/// Free fall, height and speed: exact for methods of order 2 and more.
pub(crate) struct Fall;

impl Ode<2> for Fall {
    type Error = Infallible;
    fn rhs(&self, _t: f64, x: &[f64; 2]) -> Result<[f64; 2], Infallible> {
        Ok([x[1], -9.81])
    }
    fn jacobian(&self, _t: f64, _x: &[f64; 2], _f: &[f64; 2]) -> Result<Jacobian<2>, Infallible> {
        Ok(([[0.0, 1.0], [0.0, 0.0]], [0.0; 2]))
    }
    fn linear(&self) -> bool {
        true
    }
}

/// A constant slope.
pub(crate) struct Drift(pub(crate) f64);

impl Ode<1> for Drift {
    type Error = Infallible;
    fn rhs(&self, _t: f64, _x: &[f64; 1]) -> Result<[f64; 1], Infallible> {
        Ok([self.0])
    }
    fn linear(&self) -> bool {
        true
    }
}

/// Indicators from a closure.
pub(crate) struct When<F>(pub(crate) F);

impl<const N: usize, const M: usize, F: Fn(f64, &[f64; N]) -> [f64; M]> Indicators<N, M> for When<F> {
    fn indicators(&self, t: f64, x: &[f64; N]) -> [f64; M] {
        (self.0)(t, x)
    }
}

/// One call without errors.
pub(crate) fn until<const N: usize, const M: usize, O, E>(
    solver: &mut Solver,
    ode: &O,
    events: &E,
    [t, t_end]: [f64; 2],
    x: &mut [f64; N],
) -> Reached<M>
where
    O: Ode<N, Error = Infallible>,
    E: Indicators<N, M>,
{
    solver.advance_until(ode, events, t, t_end, x, &mut Statistics::default()).expect("smooth problem")
}

#[track_caller]
pub(crate) fn event<const M: usize>(reached: Reached<M>) -> (f64, [Crossing; M]) {
    let Reached::Event { t, which } = reached else { panic!("no event") };
    (t, which)
}
