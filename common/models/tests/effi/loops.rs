//! Arm, plant, controller and wall or four-bar as one system between exact ticks.

use integrators::{Ode, Statistics};
use model::{EvaluationError, Model, System, Variables, Vector2, Vector3};
use models::effi::arm_variables as arm;
use models::effi::controller_variables::{self as control, Mode};
use models::effi::friction::FrictionModel;
use models::effi::{
    Arm, Controller, Mechanism, Plant, Wall, mechanism_variables, plant_variables, virtual_wall as wall,
};

use crate::csv::Reference;
use crate::plant::{rubbing, solver, still};

fn load<V: Variables<f64>>() -> V {
    V::load(&V::TABLE.iter().map(|v| v.start).collect::<Vec<_>>())
}

/// States: 11 of the plant, 7 of the arm, 4 of the mechanism.
const N: usize = 22;

fn parts(x: &[f64; N]) -> ([f64; 11], [f64; 7], [f64; 4]) {
    let part = |from: usize| move |i: usize| x[from + i];
    (std::array::from_fn(part(0)), std::array::from_fn(part(11)), std::array::from_fn(part(18)))
}

/// The continuous parts, with commands and rendered force held.
struct Between<'a> {
    plant: &'a Plant,
    arm: &'a Arm,
    mechanism: Option<&'a Mechanism>,
    commands: [f64; 2],
    W_F: Vector2<f64>,
    hold: <Arm as Model>::Discrete,
}

impl Between<'_> {
    fn hand(&self, t: f64, x: &[f64; N]) -> Vector2<f64> {
        let (_, hand, _) = parts(x);
        self.arm.dynamics(t, &hand, &at_handle(x), &self.hold).expect("regular").F
    }
}

fn at_handle(x: &[f64; N]) -> arm::Inputs<f64> {
    arm::Inputs { r: Vector2::new(x[0], x[1]), v: Vector2::new(x[2], x[3]), ..load() }
}

impl Ode<N> for Between<'_> {
    type Error = EvaluationError;
    fn rhs(&self, t: f64, x: &[f64; N]) -> Result<[f64; N], EvaluationError> {
        let (plant, hand, bar) = parts(x);
        let mut u = still();
        [u.u_1, u.u_2] = self.commands;
        u.H.F = self.hand(t, x);
        let plant = self.plant.rates(t, &plant, &u, &Default::default())?;
        let hand = self.arm.rates(t, &hand, &at_handle(x), &self.hold)?;
        let bar = match self.mechanism {
            None => [0.0; 4],
            Some(mechanism) => {
                let mut u: mechanism_variables::Inputs<f64> = load();
                u.H.F = self.W_F;
                mechanism.rates(t, &bar, &u, &Default::default())?
            }
        };
        let mut rates = [0.0; N];
        rates[..11].copy_from_slice(&plant);
        rates[11..18].copy_from_slice(&hand);
        rates[18..].copy_from_slice(&bar);
        Ok(rates)
    }
    fn nominal(&self) -> [f64; N] {
        let mut nominal = [1.0; N];
        nominal[..11].copy_from_slice(&self.plant.nominals());
        nominal[11..18].copy_from_slice(&self.arm.nominals());
        nominal[20..].fill(f64::INFINITY);
        nominal
    }
}

/// A loop of the reference files.
struct Scene {
    plant: plant_variables::Parameters,
    arm: arm::Parameters,
    control: control::Parameters,
    wall: Option<wall::Parameters>,
    mechanism: Option<mechanism_variables::Parameters>,
}

/// A wall at z = 0.57 that the arm pushes through.
fn at_wall(K: f64) -> Scene {
    let (start, v) = (Vector2::new(0.0, 0.575), Vector2::new(0.05, -0.15));
    Scene {
        plant: plant_variables::Parameters {
            start,
            start_v: v,
            friction: rubbing(FrictionModel::Viscous),
            use_encoder: false,
            use_energy: false,
            ..Default::default()
        },
        arm: arm::Parameters {
            start,
            start_v: v,
            from: start,
            to: Vector2::new(0.08, 0.5),
            use_energy: false,
            ..Default::default()
        },
        control: control::Parameters { mode: Mode::Impedance, ..Default::default() },
        wall: Some(wall::Parameters { K, ..Default::default() }),
        mechanism: None,
    }
}

fn flap() -> Scene {
    let start = Vector2::new(-4.510369327853647e-05, 0.7867319362459384);
    Scene {
        plant: plant_variables::Parameters {
            start,
            use_encoder: false,
            use_energy: false,
            ..Default::default()
        },
        arm: arm::Parameters {
            start,
            from: start,
            to: Vector2::new(-0.16231607676310073, 0.7055287288354515),
            duration: 0.5,
            use_energy: false,
            ..Default::default()
        },
        control: control::Parameters::default(),
        wall: None,
        mechanism: Some(mechanism_variables::Parameters {
            parts: mechanism_variables::Use {
                energy: false,
                ..mechanism_variables::Parameters::default().parts
            },
            ..Default::default()
        }),
    }
}

/// One row of a run: states, commands, forces of hand and wall.
struct Row {
    x: [f64; N],
    commands: [f64; 2],
    hand: Vector2<f64>,
    wall: Vector2<f64>,
}

/// Run with exact ticks; `each` sees the loop right after every tick.
fn run(scene: &Scene, stop: usize, mut each: impl FnMut(usize, &Row)) {
    let plant = Plant::new(&scene.plant, &load()).expect("a case of the files");
    let arm = Arm::new(&scene.arm, &load()).expect("a case of the files");
    let controller = Controller::new(&scene.control, &load()).expect("a case of the files");
    let mechanism = scene.mechanism.map(|p| Mechanism::new(&p, &load()).expect("a case of the files"));
    let wall = scene.wall.map(|p| Wall::new(&p, &model::NoVariables).expect("a case of the files"));
    let mut x = [0.0; N];
    x[..11].copy_from_slice(&plant.start(0.0, &load()).expect("a start").0);
    let (hand, hold) = arm.start(0.0, &load()).expect("a start");
    x[11..18].copy_from_slice(&hand);
    if let Some(mechanism) = &mechanism {
        x[18..].copy_from_slice(&mechanism.start(0.0, &load()).expect("a start").0);
    }
    let mut sampled = controller.start(0.0, &load()).expect("a start").1;
    let mut between = Between {
        plant: &plant,
        arm: &arm,
        mechanism: mechanism.as_ref(),
        commands: [0.0; 2],
        W_F: Vector2::zeros(),
        hold,
    };
    let mut solver = solver(1e-10);
    for k in 0..=stop {
        #[allow(clippy::cast_precision_loss, reason = "some hundreds")]
        let t = k as f64 * scene.control.T;
        let mut u: control::Inputs<f64> = load();
        let (state, _, bar) = parts(&x);
        let motion = plant.motion(t, &state, &still(), &Default::default()).expect("regular");
        (u.l_1, u.l_2) = (motion.l_1, motion.l_2);
        u.sensor_F = between.hand(t, &x);
        if let Some(mechanism) = &mechanism {
            let leader = mechanism.motion(t, &bar, &load(), &Default::default()).expect("regular");
            (u.W_r, u.W_v) = (leader.r, leader.v);
        }
        sampled = controller.update(t, &mut [], &u, &sampled);
        let mut felt = Vector2::zeros();
        if let Some(wall) = &wall {
            let at = controller.motion(t, &[], &u, &sampled).expect("regular");
            let [r, v] = [at.V_r, at.V_v].map(|v| Vector3::new(v.x, 0.0, v.y));
            let F = wall.contact(&r, &v).F;
            felt = Vector2::new(F.x, F.z);
            u.V_F = felt;
            sampled = controller.revise(t, &mut [], &u, &sampled);
        }
        let out = controller.dynamics(t, &[], &u, &sampled).expect("regular");
        (between.commands, between.W_F) = ([out.f_1, out.f_2], out.W_F);
        each(k, &Row { x, commands: between.commands, hand: between.hand(t, &x), wall: felt });
        #[allow(clippy::cast_precision_loss, reason = "some hundreds")]
        let end = (k + 1) as f64 * scene.control.T;
        solver.advance(&between, t, end, &mut x, &mut Statistics::default()).expect("moves");
    }
}

const COLUMNS: [&str; 8] = [
    "plant.H.r.x",
    "plant.H.r.z",
    "plant.H.v.x",
    "plant.H.v.z",
    "plant.axis[1].force",
    "plant.axis[2].force",
    "arm.hand.r.x",
    "arm.hand.r.z",
];
const STATES: [usize; 8] = [0, 1, 2, 3, 4, 5, 11, 12];

/// Largest errors of the columns as parts of their peaks, over the rows up to `stop` ticks.
fn errors(scene: &Scene, file: &str, stop: usize) -> Vec<(&'static str, f64)> {
    let reference = Reference::read(file);
    let mut columns: Vec<(&str, usize)> = COLUMNS.into_iter().zip(STATES).collect();
    if scene.mechanism.is_some() {
        columns.extend([("mechanism.phi", 18), ("mechanism.phi_rate", 19)]);
    }
    let names = [
        "controller.axis[1].force_command",
        "controller.axis[2].force_command",
        "arm.H.F.x",
        "arm.H.F.z",
        "wall.A.F.z",
    ];
    let mut worst: Vec<_> = columns.iter().map(|(name, _)| (*name, 0.0_f64)).collect();
    worst.extend(names.map(|name| (name, 0.0)));
    let mut rows = reference.rows.iter().peekable();
    run(scene, stop, |k, row| {
        #[allow(clippy::cast_precision_loss, reason = "some hundreds")]
        let t = k as f64 * scene.control.T;
        let Some(expected) = rows.next_if(|r| (r[0] - t).abs() < 1e-9) else { return };
        let states = columns.iter().map(|(_, i)| row.x[*i]);
        let others = [row.commands[0], row.commands[1], row.hand.x, row.hand.y, row.wall.y];
        for ((name, worst), value) in worst.iter_mut().zip(states.chain(others)) {
            let error = (value - reference.at(expected, name)).abs() / reference.peak(name).max(1e-12);
            *worst = worst.max(error);
        }
    });
    assert!(rows.next().is_none(), "all rows of {file} were compared");
    worst
}

/// 1e-6 of the peaks: the controller's ticks are at their times, its samples in their order.
#[test]
fn wall_loop_follows_the_reference() {
    let worst = errors(&at_wall(2e4), "loop_wall", 600);
    assert!(worst.iter().all(|(_, e)| *e < 1e-6), "{worst:?}");
}

/// K = 1e7 N/m is beyond the limit: bounded by saturation, the same first contact and the same onset of saturation.
#[test]
fn stiff_wall_loop_goes_to_saturation_as_the_reference() {
    let reference = Reference::read("loop_wall_stiff");
    let of = |name: &str, level: f64| {
        let first = reference.rows.iter().find(|row| reference.at(row, name).abs() >= level);
        first.expect("reached")[0]
    };
    let (contact, saturation) = (of("wall.A.F.z", 1e-9), of("controller.axis[1].force_command", 2499.0));
    let (mut own_contact, mut own_saturation, mut largest) = (None, None, 0.0_f64);
    run(&at_wall(1e7), 200, |k, row| {
        #[allow(clippy::cast_precision_loss, reason = "some hundreds")]
        let t = k as f64 * 1e-3;
        if row.wall.y > 0.0 {
            own_contact.get_or_insert(t);
        }
        if row.commands[0].abs() >= 2499.0 {
            own_saturation.get_or_insert(t);
        }
        largest = largest.max(row.commands[0].abs()).max(row.commands[1].abs());
        assert!(row.x.iter().all(|x| x.is_finite()) && row.x[2].abs() < 1.0 && row.x[3].abs() < 1.0);
    });
    // rows are 2 ms apart
    assert!((own_contact.expect("contact") - contact).abs() <= 2e-3 + 1e-3, "{own_contact:?} {contact}");
    assert!(
        (own_saturation.expect("saturation") - saturation).abs() <= 5e-3,
        "{own_saturation:?} {saturation}"
    );
    assert!(largest <= 2500.0);
}

/// Through saturation, bristles and the end stop: 1e-4 of the peaks.
#[test]
fn flap_loop_follows_the_reference() {
    let worst = errors(&flap(), "loop_flap", 700);
    assert!(worst.iter().filter(|(name, _)| *name != "V.F.z").all(|(_, e)| *e < 1e-4), "{worst:?}");
}
