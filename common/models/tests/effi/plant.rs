//! The plant alone and the driven four-bar over time.

use std::fmt::Debug;

use integrators::{Method, Ode, Settings, Solver, Statistics};
use model::{EvaluationError, Model, System, Variables, Vector2};
use models::effi::friction::{Friction, FrictionModel};
use models::effi::plant_variables::{Inputs, Motion, Parameters};
use models::effi::{Mechanism, Plant, mechanism_variables};

use crate::csv::{Reference, close};

/// Start values of the plant's outputs.
pub(crate) fn start() -> Motion<f64> {
    let start: Vec<f64> = <Motion<f64> as Variables<f64>>::TABLE.iter().map(|v| v.start).collect();
    Motion::load(&start)
}

/// No commands, no forces.
pub(crate) fn still() -> Inputs<f64> {
    Inputs::load(&vec![0.0; <Inputs<f64> as Variables<f64>>::TABLE.len()])
}

pub(crate) fn rubbing(model: FrictionModel) -> Friction {
    Friction { model, ..Friction::default() }
}

/// The plain two-mass plant.
pub(crate) fn plain() -> Parameters {
    Parameters { friction: rubbing(FrictionModel::None), use_stop: false, ..Parameters::default() }
}

/// A system under inputs that are functions of time.
pub(crate) struct Driven<'a, Y, D, U> {
    pub(crate) system: &'a Y,
    pub(crate) d: D,
    pub(crate) u: U,
}

impl<const N: usize, const Z: usize, Y, U> Ode<N>
    for Driven<'_, Sized<Y, N, Z>, <Y::Model as Model>::Discrete, U>
where
    Y: System<N, Z>,
    U: Fn(f64) -> <Y::Model as Model>::Inputs<f64>,
{
    type Error = EvaluationError;
    fn rhs(&self, t: f64, x: &[f64; N]) -> Result<[f64; N], EvaluationError> {
        self.system.0.rates(t, x, &(self.u)(t), &self.d)
    }
    fn nominal(&self) -> [f64; N] {
        self.system.0.nominals()
    }
}

/// A system with its sizes.
pub(crate) struct Sized<Y, const N: usize, const Z: usize>(pub(crate) Y);

pub(crate) fn solver(rtol: f64) -> Solver {
    let settings = Settings { method: Method::Dopri5, step: 1.0, rtol, atol: rtol * 1e-2 };
    Solver::new(settings).expect("settings")
}

/// Go through the times of the first column; `look` sees every row with the states there.
pub(crate) fn run<const N: usize, O: Ode<N, Error: Debug>>(
    ode: &O,
    mut x: [f64; N],
    reference: &Reference,
    solver: &mut Solver,
    mut look: impl FnMut(&[f64], &[f64; N]),
) {
    let mut t = 0.0;
    for row in &reference.rows {
        solver.advance(ode, t, row[0], &mut x, &mut Statistics::default()).expect("moves");
        t = row[0];
        look(row, &x);
    }
}

struct Case {
    name: &'static str,
    start: [f64; 2],
    friction: FrictionModel,
    gravity: bool,
    command: [f64; 2],
    user: bool,
    tolerance: f64,
}

/// Largest error of the first nine columns as parts of the columns' peaks.
fn follow(case: &Case) {
    let reference = Reference::read(case.name);
    let p = Parameters {
        start: Vector2::from(case.start),
        friction: rubbing(case.friction),
        use_gravity: case.gravity,
        ..Parameters::default()
    };
    let plant = Sized::<_, 11, 1>(Plant::new(&p, &start()).expect("a case of the file"));
    let (x, d) = plant.0.start(0.0, &start()).expect("a case of the file");
    let u = |t: f64| {
        let mut u = still();
        [u.u_1, u.u_2] = case.command;
        if case.user {
            u.H.F = Vector2::new(25.0 * (9.0 * t).sin(), 40.0 * (7.0 * t).sin());
        }
        u
    };
    let names = [
        "H.r.x",
        "H.r.z",
        "H.v.x",
        "H.v.z",
        "axis[1].force",
        "axis[2].force",
        "axis[1].bristle",
        "axis[2].bristle",
    ];
    let mut worst = [0.0_f64; 8];
    run(&Driven { system: &plant, d, u }, x, &reference, &mut solver(1e-10), |row, x| {
        for (i, name) in names.into_iter().enumerate() {
            let peak = reference.peak(name).max(f64::MIN_POSITIVE);
            worst[i] = worst[i].max((x[i] - reference.at(row, name)).abs() / peak);
        }
    });
    assert!(worst.iter().all(|e| *e <= case.tolerance), "{}: {worst:?}", case.name);
}

/// Tolerances of the specification, section 8.
#[test]
fn conservative_plant_follows_the_reference() {
    follow(&Case {
        name: "plant_conservative",
        start: [0.02, 0.65],
        friction: FrictionModel::None,
        gravity: true,
        command: [40.0, 40.0],
        user: true,
        tolerance: 1e-7,
    });
}

#[test]
fn bristles_follow_the_reference() {
    follow(&Case {
        name: "plant_lugre",
        start: [0.02, 0.65],
        friction: FrictionModel::Lugre,
        gravity: true,
        command: [180.0, 80.0],
        user: true,
        tolerance: 1e-5,
    });
}

#[test]
fn sticking_follows_the_reference() {
    follow(&Case {
        name: "plant_stick",
        start: [0.0, 0.6],
        friction: FrictionModel::Lugre,
        gravity: false,
        command: [50.0, -30.0],
        user: false,
        tolerance: 1e-6,
    });
}

#[test]
fn end_stop_follows_the_reference() {
    follow(&Case {
        name: "plant_endstop",
        start: [0.03, 0.77],
        friction: FrictionModel::Lugre,
        gravity: true,
        command: [900.0, 900.0],
        user: false,
        tolerance: 1e-5,
    });
}

#[test]
fn saturated_plant_follows_the_reference() {
    follow(&Case {
        name: "plant_saturated",
        start: [0.04, 0.55],
        friction: FrictionModel::Lugre,
        gravity: true,
        command: [1e9, 1e9],
        user: false,
        tolerance: 1e-5,
    });
}

/// The four-bar under W.F = F0 sin(5 t); 1e-6 at rtol 1e-9.
#[test]
fn driven_fourbar_follows_the_reference() {
    let reference = Reference::read("fourbar_run");
    let mut p = mechanism_variables::Parameters::default();
    p.fourbar.phi = -0.5;
    let values: Vec<f64> =
        <mechanism_variables::Motion<f64> as Variables<f64>>::TABLE.iter().map(|v| v.start).collect();
    let start = mechanism_variables::Motion::load(&values);
    let mechanism = Sized::<_, 4, 1>(Mechanism::new(&p, &start).expect("a case of the file"));
    let (x, d) = mechanism.0.start(0.0, &start).expect("a case of the file");
    let u = |t: f64| {
        let mut u = mechanism_variables::Inputs::load(&[0.0; 10]);
        u.H.F = Vector2::new(4.0, -6.0) * (5.0 * t).sin();
        u
    };
    run(&Driven { system: &mechanism, d, u }, x, &reference, &mut solver(1e-9), |row, x| {
        close("phi", x[0], reference.at(row, "phi"), reference.peak("phi"), 1e-6);
        close("phi'", x[1], reference.at(row, "phidot"), reference.peak("phidot"), 1e-6);
    });
}

/// kinetic + potential - start = supplied - dissipated, through stop, friction and saturation; integrals at the accuracy of the run.
#[test]
fn energy_law_holds_through_every_part() {
    for model in
        [FrictionModel::None, FrictionModel::Viscous, FrictionModel::Regularised, FrictionModel::Lugre]
    {
        let p =
            Parameters { start: Vector2::new(0.03, 0.77), friction: rubbing(model), ..Parameters::default() };
        let plant = Sized::<_, 11, 1>(Plant::new(&p, &start()).expect("a pose"));
        let (mut x, d) = plant.0.start(0.0, &start()).expect("a pose");
        let u = |_| {
            let mut u = still();
            [u.u_1, u.u_2] = [900.0, 700.0];
            u.H.F = Vector2::new(30.0, -20.0);
            (u.H_2.M.xx, u.H_2.M.zz, u.H_2.M.xz) = (2.0, 3.0, 0.5);
            u
        };
        let total = |x: &[f64; 11]| {
            let e = plant.0.energy(0.0, x, &u(0.0), &d).expect("regular");
            (e.kinetic + e.potential - e.supplied + e.dissipated, e.supplied, e.port)
        };
        let before = total(&x).0;
        let ode = Driven { system: &plant, d, u };
        solver(1e-10).advance(&ode, 0.0, 0.4, &mut x, &mut Statistics::default()).expect("moves");
        let (after, supplied, port) = total(&x);
        // the law has the slots' inertia outside: its kinetic energy left through the port
        close("energy law", after, before, supplied.abs(), 1e-6);
        assert!(supplied > 10.0 && port.abs() > 0.01, "{model:?}: nothing happened");
    }
}
