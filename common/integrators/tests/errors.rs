//! What cannot be done is said with its numbers, and leaves everything as it was.

mod common;

use std::cell::Cell;
use std::convert::Infallible;

use common::{GENERAL, Kepler, Linear, solver};
use integrators::{
    Indicators, Jacobian, MAX_EVALUATIONS, Memory, Method, Ode, Settings, SettingsError, Solver, Statistics,
    StepError,
};

/// Where the model has no value.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("strut of length {0} m")]
struct NoStrut(f64);

/// Falls towards `x = 0` at unit speed; has no value at or beyond it.
struct Strut;

impl Ode<1> for Strut {
    type Error = NoStrut;
    fn rhs(&self, _t: f64, x: &[f64; 1]) -> Result<[f64; 1], NoStrut> {
        if x[0] > 0.0 { Ok([-1.0]) } else { Err(NoStrut(x[0])) }
    }
}

/// `x' = x^2`, solution `1/(1/x_0 - t)`: infinite after a finite time.
struct BlowUp;

impl Ode<2> for BlowUp {
    type Error = NoStrut;
    fn rhs(&self, _t: f64, x: &[f64; 2]) -> Result<[f64; 2], NoStrut> {
        Ok([0.0, x[1] * x[1]])
    }
}

/// Slope without a value from `t = 1` on.
struct Hole;

impl Ode<1> for Hole {
    type Error = NoStrut;
    fn rhs(&self, t: f64, _x: &[f64; 1]) -> Result<[f64; 1], NoStrut> {
        Ok([if t < 1.0 { 1.0 } else { f64::NAN }])
    }
}

/// `x'' = -omega^2 x` at 1e9 rad/s, counting its evaluations.
struct Fast {
    evaluations: Cell<u64>,
}

impl Ode<2> for Fast {
    type Error = Infallible;
    fn rhs(&self, _t: f64, [s, v]: &[f64; 2]) -> Result<[f64; 2], Infallible> {
        self.evaluations.set(self.evaluations.get() + 1);
        Ok([1e9 * v, -1e9 * s])
    }
}

/// The error of one call; state, statistics and memory must be as before.
fn failure<const N: usize, O: Ode<N>>(
    solver: &mut Solver,
    ode: &O,
    [t, t_end]: [f64; 2],
    x: [f64; N],
) -> StepError<O::Error>
where
    O::Error: std::fmt::Debug,
{
    let before = (
        x,
        Statistics { steps: 3, rejected: 2, rhs_evaluations: 1, jacobians: 4, decompositions: 5 },
        *solver,
    );
    let (mut x, mut statistics, _) = before;
    let error = solver.advance(ode, t, t_end, &mut x, &mut statistics).expect_err("must fail");
    assert_eq!((x, statistics, *solver), before);
    error
}

#[test]
fn settings_must_be_finite_and_positive() {
    let good = Settings { method: Method::Dopri5, step: 0.1, rtol: 1e-6, atol: 1e-9 };
    assert!(Solver::new(good).is_ok());
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        for (settings, name) in [
            (Settings { step: bad, ..good }, "step"),
            (Settings { rtol: bad, ..good }, "rtol"),
            (Settings { atol: bad, ..good }, "atol"),
        ] {
            let SettingsError { name: found, value } = Solver::new(settings).expect_err("must be refused");
            assert_eq!((found, value.to_bits()), (name, bad.to_bits()));
        }
    }
    let message = Solver::new(Settings { rtol: -1.0, ..good }).map_err(|e| e.to_string());
    assert_eq!(message, Err("solver rtol is -1; it must be finite and greater than 0".into()));
}

#[test]
fn interval_must_go_forward() {
    for method in Method::ALL {
        for [t, t_end] in [[1.0, 0.5], [f64::NAN, 1.0], [0.0, f64::NAN], [0.0, f64::INFINITY]] {
            let error = failure(&mut solver(method, 0.1, 1e-6), &Linear::OSCILLATOR, [t, t_end], [1.0, 0.0]);
            assert!(matches!(error, StepError::Interval { .. }), "{error:?}");
        }
    }
}

/// Fixed steps return the error of the right-hand side with the time of the stage.
#[test]
fn fixed_steps_return_the_error_of_the_model() {
    let error = failure(&mut solver(Method::Heun, 0.25, 1.0), &Strut, [0.0, 2.0], [0.5]);
    assert_eq!(error, StepError::Rhs { t: 0.5, source: NoStrut(0.0) });
    assert_eq!(error.to_string(), "at t = 0.500000 s: strut of length 0 m");
}

/// An adaptive method shrinks its step at such an error: it comes as near as time allows, and then says what the
/// model says.
#[test]
fn adaptive_steps_shrink_at_an_error_of_the_model() {
    let mut solver = solver(Method::Dopri5, 1.0, 1e-6);
    let (mut x, mut statistics) = ([0.5], Statistics::default());
    // a proposal that leads across the edge, over an interval that ends before it: no error
    solver.restore(Memory { step: 10.0, error: 1e-4 });
    assert_eq!(solver.advance(&Strut, 0.0, 0.499, &mut x, &mut statistics), Ok(()));
    assert!((x[0] - 0.001).abs() < 1e-15);
    let error = failure(&mut solver, &Strut, [0.499, 2.0], x);
    let StepError::Rhs { t, source: NoStrut(length) } = error else { panic!("{error:?}") };
    assert!((t - 0.5).abs() < 1e-14 && length.abs() < 1e-14, "{error:?}");
}

/// At the very start of a step there is nothing to shrink.
#[test]
fn an_error_at_the_start_is_returned_at_once() {
    for method in GENERAL {
        let error = failure(&mut solver(method, 0.1, 1e-6), &Strut, [1.0, 2.0], [-0.5]);
        assert_eq!(error, StepError::Rhs { t: 1.0, source: NoStrut(-0.5) });
    }
}

/// Fixed steps run into infinity and name the state.
#[test]
fn fixed_steps_name_the_state_that_is_not_finite() {
    for method in [Method::Heun, Method::Rk4] {
        let error = failure(&mut solver(method, 0.01, 1.0), &BlowUp, [0.0, 2.0], [1.0, 1.0]);
        let StepError::NotFinite { t, index: 1, value } = error else { panic!("{error:?}") };
        assert!(t > 1.0 && t < 1.2 && !value.is_finite(), "{error:?}"); // the pole is at t = 1
    }
}

/// An adaptive method follows the solution up to its pole; the message names time and state.
#[test]
fn adaptive_steps_stop_before_a_pole() {
    let error = failure(&mut solver(Method::Dopri5, 1.0, 1e-6), &BlowUp, [0.0, 2.0], [1.0, 1.0]);
    let StepError::StepTooSmall { t, h, min, index: 1 } = error else { panic!("{error:?}") };
    assert!((t - 1.0).abs() < 1e-5 && h < min, "{error:?}"); // the pole moves with the tolerance
    assert!(error.to_string().ends_with("stiffest state: 1"), "{error}");
}

#[test]
fn a_slope_that_is_not_a_number_is_never_passed_on() {
    let error = failure(&mut solver(Method::Rk4, 0.25, 1.0), &Hole, [0.0, 2.0], [0.0]);
    assert!(
        matches!(error, StepError::NotFinite { t, index: 0, .. } if (t - 1.0).abs() < 1e-15),
        "{error:?}"
    );
    let error = failure(&mut solver(Method::Dopri5, 1.0, 1e-6), &Hole, [0.0, 2.0], [0.0]);
    assert!(
        matches!(error, StepError::NotFinite { t, index: 0, .. } if (t - 1.0).abs() < 1e-14),
        "{error:?}"
    );
    // at the start of a step
    let error = failure(&mut solver(Method::Dopri5, 1.0, 1e-6), &Hole, [1.0, 2.0], [0.0]);
    assert!(
        matches!(error, StepError::NotFinite { t, index: 0, .. } if (t - 1.0).abs() < 1e-15),
        "{error:?}"
    );
}

/// A tiny step size or a very stiff problem ends in an error and not in a hang.
#[test]
fn too_much_work_is_refused_before_the_first_step() {
    let error = failure(&mut solver(Method::Heun, 1e-300, 1.0), &Linear::OSCILLATOR, [0.0, 1.0], [1.0, 0.0]);
    assert_eq!(error, StepError::TooMuchWork { t: 0.0, t_end: 1.0, h: 1e-300 });
    assert_eq!(
        error.to_string(),
        format!(
            "more than {MAX_EVALUATIONS} evaluations of the equations are needed: at t = 0.000000 s of 1.000000 s steps are 1.000e-300 s long"
        )
    );
}

/// A thousand million turns are wanted: each adaptive method gives up within its work.
#[test]
fn hopeless_adaptive_calls_are_given_up_in_bounded_time() {
    for method in Method::ALL.into_iter().filter(|method| method.is_adaptive()) {
        let fast = Fast { evaluations: Cell::new(0) };
        let error = failure(&mut solver(method, 1.0, 1e-6), &fast, [0.0, 1.0], [1.0, 0.0]);
        assert!(matches!(error, StepError::TooMuchWork { .. }), "{method:?}: {error:?}");
        // at most one step beyond the bound; Jacobians by differences are 3 evaluations here and count as 6
        let evaluations = fast.evaluations.get();
        assert!(evaluations <= MAX_EVALUATIONS + 100, "{method:?}: {evaluations}");
        assert!(evaluations >= MAX_EVALUATIONS / 4, "{method:?}: {evaluations}");
    }
}

/// Ten seconds in steps of 1e-5 s are a long call, not a hopeless one.
#[test]
fn a_million_steps_of_runge_kutta_are_carried_out() {
    let mut x = [1.0, 0.0];
    let mut statistics = Statistics::default();
    let mut rk4 = solver(Method::Rk4, 1e-5, 1.0);
    rk4.advance(&Linear::OSCILLATOR, 0.0, 10.0, &mut x, &mut statistics).expect("within the bound");
    assert_eq!(statistics.rhs_evaluations, 4_000_000);
    // rounding of a million steps
    assert!((x[0] - 10.0_f64.cos()).abs() < 1e-10, "{}", x[0]);
}

/// The transition matrix is for those who declare themselves linear.
#[test]
fn exact_is_refused_for_a_system_that_is_not_linear() {
    let orbit = Kepler { e: 0.5 };
    let error = failure(&mut solver(Method::Exact, 0.1, 1e-6), &orbit, [0.5, 1.0], orbit.exact(0.5));
    assert_eq!(error, StepError::NotLinear { t: 0.5 });
    assert_eq!(
        error.to_string(),
        "the method exact is for linear systems x' = A x + b; this one does not declare itself linear (t = 0.500000 s)"
    );
}

/// `x' = A x` with a Jacobian that says otherwise.
struct Claims([[f64; 1]; 1]);

impl Ode<1> for Claims {
    type Error = NoStrut;
    fn rhs(&self, _t: f64, x: &[f64; 1]) -> Result<[f64; 1], NoStrut> {
        Ok([-x[0]])
    }
    fn jacobian(&self, _t: f64, _x: &[f64; 1], _f: &[f64; 1]) -> Result<Jacobian<1>, NoStrut> {
        if self.0[0][0] > 1e300 { Err(NoStrut(1.0)) } else { Ok((self.0, [0.0])) }
    }
    fn linear(&self) -> bool {
        true
    }
}

/// A Jacobian that fails or is not finite ends the call with the time of the step.
#[test]
fn a_jacobian_without_a_value_ends_the_call() {
    for method in [Method::Rodas4, Method::Radau5, Method::Exact] {
        let mut solver = solver(method, 0.1, 1e-6);
        let error = failure(&mut solver, &Claims([[1e301]]), [1.0, 2.0], [1.0]);
        assert_eq!(error, StepError::Rhs { t: 1.0, source: NoStrut(1.0) });
        let error = failure(&mut solver, &Claims([[f64::NAN]]), [1.0, 2.0], [1.0]);
        assert!(
            matches!(error, StepError::NotFinite { t, index: 0, .. } if (t - 1.0).abs() < 1e-15),
            "{error:?}"
        );
    }
}

/// A slope that jumps with the sign of the state at `x = 0`, towards it: no smooth solution beyond, the iteration finds
/// none, and the step falls to the resolution of time.
struct Trap;

impl Ode<1> for Trap {
    type Error = NoStrut;
    fn rhs(&self, _t: f64, x: &[f64; 1]) -> Result<[f64; 1], NoStrut> {
        Ok([if x[0] > 0.0 { -1.0 } else { f64::INFINITY }])
    }
}

#[test]
fn an_iteration_without_a_solution_ends_in_an_error() {
    let error = failure(&mut solver(Method::Radau5, 0.1, 1e-6), &Trap, [0.0, 1.0], [0.5]);
    let StepError::NoSolution { t, h } = error else { panic!("{error:?}") };
    assert!((t - 0.5).abs() < 1e-9 && h < 1e-14, "{error:?}");
    assert!(error.to_string().starts_with("the equations of an implicit step of"), "{error}");
}

struct Undefined;

impl Indicators<2, 2> for Undefined {
    fn indicators(&self, t: f64, x: &[f64; 2]) -> [f64; 2] {
        [x[0], (0.5 - t).sqrt()]
    }
}

#[test]
fn an_indicator_that_is_not_a_number_is_refused() {
    let (mut x, mut statistics) = ([1.0, 0.0], Statistics::default());
    for method in Method::ALL {
        let mut solver = solver(method, 0.1, 1e-6);
        let before = solver;
        let error = solver.advance_until(&Linear::OSCILLATOR, &Undefined, 0.0, 1.0, &mut x, &mut statistics);
        assert!(matches!(error, Err(StepError::IndicatorNotFinite { index: 1, .. })), "{error:?}");
        assert_eq!((x, statistics, solver), ([1.0, 0.0], Statistics::default(), before));
    }
}

/// Projection that fails, and one that spoils the state.
struct Projected(Result<f64, NoStrut>);

impl Ode<1> for Projected {
    type Error = NoStrut;
    fn rhs(&self, _t: f64, _x: &[f64; 1]) -> Result<[f64; 1], NoStrut> {
        Ok([1.0])
    }
    fn project(&self, _t: f64, x: &mut [f64; 1]) -> Result<bool, NoStrut> {
        x[0] = self.0?;
        Ok(true)
    }
}

#[test]
fn a_failing_projection_fails_the_call() {
    for method in GENERAL {
        let mut solver = solver(method, 1.0, 1e-6);
        let error = failure(&mut solver, &Projected(Err(NoStrut(0.0))), [0.0, 1.0], [0.0]);
        assert!(matches!(error, StepError::Rhs { source: NoStrut(_), .. }));
        let error = failure(&mut solver, &Projected(Ok(f64::INFINITY)), [0.0, 1.0], [0.0]);
        assert!(matches!(error, StepError::NotFinite { index: 0, .. }));
    }
}
