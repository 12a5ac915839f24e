//! The solver of run-time size takes the steps of the solver of fixed size, bit by bit.
#![allow(clippy::unwrap_used, reason = "tests")]

use std::convert::Infallible;

use integrators::{DynamicOde, DynamicSolver, Method, NoSolver, Ode, Settings, Solver, Statistics};

/// Kepler's problem with eccentricity 0.6.
struct Kepler;

const START: [f64; 4] = [0.4, 0.0, 0.0, 2.0];

impl Ode<4> for Kepler {
    type Error = Infallible;

    fn rhs(&self, _t: f64, x: &[f64; 4]) -> Result<[f64; 4], Infallible> {
        let r_3 = x[0].hypot(x[1]).powi(3);
        Ok([x[2], x[3], -x[0] / r_3, -x[1] / r_3])
    }
}

impl DynamicOde for Kepler {
    type Error = Infallible;

    fn rhs(&mut self, t: f64, x: &[f64], dx: &mut [f64]) -> Result<(), Infallible> {
        let state: [f64; 4] = x.try_into().unwrap();
        dx.copy_from_slice(&Ode::rhs(self, t, &state)?);
        Ok(())
    }
}

const T_END: f64 = 3.0;

fn settings(method: Method) -> Settings {
    Settings { method, step: T_END, rtol: 1e-6, atol: 1e-9 }
}

fn dynamic(method: Method) -> (DynamicSolver, Vec<f64>) {
    let mut solver = DynamicSolver::new(settings(method), vec![1.0; 4]).unwrap();
    let (mut t, mut x) = (0.0, START.to_vec());
    while t < T_END {
        t = solver.step(&mut Kepler, t, &x, T_END).unwrap();
        x.copy_from_slice(solver.state());
    }
    (solver, x)
}

/// Jacobians are the same differences; of the solver of run-time size they count as evaluations.
#[test]
fn steps_are_those_of_the_solver_of_fixed_size() {
    let methods = [Method::Heun, Method::Rk4, Method::Dopri5, Method::Dop853, Method::Rodas4, Method::Radau5];
    for method in methods {
        let (mut x, mut statistics) = (START, Statistics::default());
        let mut solver = Solver::new(settings(method)).unwrap();
        solver.advance(&Kepler, 0.0, T_END, &mut x, &mut statistics).unwrap();
        let (dynamic, end) = dynamic(method);
        let differences = if method == Method::Rodas4 { 5 } else { 4 };
        // order of summation; in a Jacobian of differences rounding counts 1e8 times, in the result only by its error
        let bound = if method.is_a_stable() { 1e-9 } else { 1e-13 };
        statistics.rhs_evaluations += differences * statistics.jacobians;
        assert_eq!(dynamic.statistics(), statistics, "{method:?}");
        for (a, b) in x.iter().zip(&end) {
            assert!((a - b).abs() <= bound, "{method:?}: {x:?} {end:?}");
        }
    }
}

/// Prothero and Robinson's problem, `x = cos t` at any stiffness: a handful of steps where an explicit method needs millions.
struct Prothero;

impl DynamicOde for Prothero {
    type Error = Infallible;

    fn rhs(&mut self, t: f64, x: &[f64], dx: &mut [f64]) -> Result<(), Infallible> {
        dx[0] = -1e6 * (x[0] - t.cos()) - t.sin();
        Ok(())
    }
}

#[test]
fn stiff_equations_take_few_evaluations() {
    for method in [Method::Rodas4, Method::Radau5] {
        let mut solver = DynamicSolver::new(settings(method), vec![1.0]).unwrap();
        let (mut t, mut x) = (0.0, vec![1.0]);
        while t < T_END {
            t = solver.step(&mut Prothero, t, &x, T_END).unwrap();
            x.copy_from_slice(solver.state());
        }
        assert!((x[0] - T_END.cos()).abs() < 1e-5, "{method:?}: {x:?}"); // ten times the tolerance
        assert!(solver.statistics().rhs_evaluations < 1000, "{method:?}: {:?}", solver.statistics());
    }
}

/// A run that is saved and gone on with by another solver, step by step, is the same to the bit.
#[test]
fn a_restored_solver_goes_on_bit_by_bit() {
    for method in [Method::Dopri5, Method::Rodas4, Method::Radau5] {
        let (plain, end) = dynamic(method);
        let mut solver = DynamicSolver::new(settings(method), vec![1.0; 4]).unwrap();
        let (mut t, mut x) = (0.0, START.to_vec());
        while t < T_END {
            t = solver.step(&mut Kepler, t, &x, T_END).unwrap();
            x.copy_from_slice(solver.state());
            let state = solver.save();
            solver = DynamicSolver::new(settings(method), vec![1.0; 4]).unwrap();
            assert!(solver.fits(&state));
            solver.restore(&state);
        }
        assert_eq!((x, solver.statistics()), (end, plain.statistics()), "{method:?}");
        let smaller = DynamicSolver::new(settings(method), vec![1.0; 3]).unwrap();
        let other = DynamicSolver::new(settings(Method::Rk4), vec![1.0; 4]).unwrap();
        assert!(!smaller.fits(&solver.save()) && !other.fits(&solver.save()), "{method:?}");
    }
}

/// Angular momentum is constant: inside a step, too, up to the error of the extension.
#[test]
fn dense_output_keeps_the_angular_momentum() {
    let methods =
        [(Method::Dopri5, 1e-5), (Method::Dop853, 1e-5), (Method::Rodas4, 1e-4), (Method::Radau5, 1e-4)];
    for (method, bound) in methods {
        let mut solver = DynamicSolver::new(settings(method), vec![1.0; 4]).unwrap();
        let (mut t, mut x) = (0.0, START.to_vec());
        let mut inside = vec![0.0; 4];
        while t < T_END {
            t = solver.step(&mut Kepler, t, &x, T_END).unwrap();
            for theta in [0.25, 0.5, 0.75, 1.0] {
                solver.inside(&mut Kepler, theta, &mut inside).unwrap();
                let momentum = inside[0] * inside[3] - inside[1] * inside[2];
                assert!((momentum - 0.8).abs() < bound, "{method:?} theta {theta}: {momentum}");
            }
            x.copy_from_slice(solver.state());
        }
    }
}

#[test]
fn a_step_repeated_in_full_length_ends_where_it_ended() {
    for method in [Method::Rk4, Method::Rodas4, Method::Radau5] {
        let mut solver = DynamicSolver::new(settings(method), vec![1.0; 4]).unwrap();
        solver.step(&mut Kepler, 0.0, &START, 0.1).unwrap();
        let mut again = vec![0.0; 4];
        solver.repeat(&mut Kepler, 1.0, &mut again).unwrap();
        for (a, b) in again.iter().zip(solver.state()) {
            assert!((a - b).abs() <= 1e-9, "{method:?}"); // Radau5: what the Newton iteration leaves
        }
    }
}

/// A shorter step of the method is one to its own end, and dense output is as good as the tolerance.
#[test]
fn repeated_and_dense_states_inside_a_step_agree() {
    for method in [Method::Rodas4, Method::Radau5] {
        let mut solver = DynamicSolver::new(settings(method), vec![1.0; 4]).unwrap();
        let (mut again, mut inside) = (vec![0.0; 4], vec![0.0; 4]);
        solver.step(&mut Kepler, 0.0, &START, 0.1).unwrap();
        for theta in [0.2, 0.5, 0.9] {
            solver.repeat(&mut Kepler, theta, &mut again).unwrap();
            solver.inside(&mut Kepler, theta, &mut inside).unwrap();
            for (a, b) in again.iter().zip(&inside) {
                assert!((a - b).abs() <= 1e-5, "{method:?} {theta}: {a} {b}");
            }
        }
    }
}

#[test]
fn methods_of_fixed_size_are_refused() {
    let refused = DynamicSolver::new(settings(Method::Exact), vec![1.0; 4]).err();
    assert_eq!(refused, Some(NoSolver::Method(Method::Exact)));
}

/// The slope asked for at the end of a step is the first stage of the next one: no evaluation more.
#[test]
fn a_slope_at_the_end_starts_the_next_step() {
    for method in [Method::Rk4, Method::Dop853, Method::Rodas4, Method::Radau5] {
        let mut solver = DynamicSolver::new(settings(method), vec![1.0; 4]).unwrap();
        let (mut t, mut x) = (0.0, START.to_vec());
        while t < T_END {
            t = solver.step(&mut Kepler, t, &x, T_END).unwrap();
            x.copy_from_slice(solver.state());
            let mut direct = vec![0.0; 4];
            DynamicOde::rhs(&mut Kepler, t, &x, &mut direct).unwrap();
            assert_eq!(solver.slope(&mut Kepler).unwrap(), direct);
        }
        let (plain, end) = dynamic(method);
        assert_eq!(end, x, "{method:?}");
        assert_eq!(solver.statistics().rhs_evaluations, plain.statistics().rhs_evaluations + 1, "{method:?}");
    }
}
