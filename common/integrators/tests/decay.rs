//! A motion that dies away ends at zero, not among the subnormal numbers where every operation may be slow.

mod common;

use common::{GENERAL, solver};
use integrators::{Method, Ode, Statistics};

/// `x' = -k x`: at `t = 100 s` the exact solutions, `e^(-1000)` and less, are below the smallest number there is.
struct Decay;

impl Ode<3> for Decay {
    type Error = std::convert::Infallible;
    fn rhs(&self, _t: f64, x: &[f64; 3]) -> Result<[f64; 3], Self::Error> {
        Ok([-10.0 * x[0], -20.0 * x[1], -40.0 * x[2]])
    }
}

/// Fixed steps of 0.02 s: the factors per step of both methods are positive, so nothing else brings the states to zero.
#[test]
fn fixed_steps_reach_zero() {
    for method in [Method::Heun, Method::Rk4] {
        let mut solver = solver(method, 0.02, 1e-6);
        let (mut x, mut statistics) = ([1.0, -1.0, 1e-5], Statistics::default());
        for i in 0..1000 {
            let t = 0.1 * f64::from(i);
            solver.advance(&Decay, t, t + 0.1, &mut x, &mut statistics).expect("a linear system");
            assert!(!x.iter().any(|x| x.is_subnormal()), "{method:?} at {t} s: {x:?}");
        }
        assert_eq!(x.map(f64::to_bits), [0; 3], "{method:?}");
    }
}

/// Every method, from states that are subnormal already.
#[test]
fn every_method_leaves_the_subnormal_numbers_with_its_first_step() {
    for method in GENERAL {
        let mut solver = solver(method, 1e-3, 1e-6);
        let (mut x, mut statistics) = ([1e-310, -5e-324, 2e-308], Statistics::default());
        solver.advance(&Decay, 0.0, 0.1, &mut x, &mut statistics).expect("a linear system");
        assert_eq!(x.map(f64::abs).map(f64::to_bits), [0; 3], "{method:?}");
    }
}
