//! Cost of a right-hand side of the haptic interface's plant, beside the equations written out for its default case.
//!
//! ```text
//! cargo run --release -p models --example effi_cost
//! ```

#![allow(non_snake_case, reason = "symbols of the write-up")]
#![allow(clippy::print_stdout, reason = "a table is its output")]

use std::f64::consts::TAU;
use std::hint::black_box;

use model::{EvaluationError, Model, System, Variables, Visitor};
use models::effi::Plant;
use models::effi::friction::{Friction, FrictionModel};
use models::effi::plant_variables::{Inputs, Motion, Parameters};

mod timing;

/// Nanoseconds per call of `body`.
fn nanoseconds(body: impl FnMut()) -> f64 {
    1e9 * timing::seconds(100, body)
}

/// Handle, axis forces and bristles of a slow motion.
const START: [f64; 8] = [0.05, 0.62, 0.1, -0.05, 60.0, 50.0, 1e-5, -2e-5];

/// Time of the rates of the plant.
struct Cost(Inputs<f64>);

impl Visitor<Plant> for Cost {
    type Output = f64;
    fn visit<const N: usize, const Z: usize, Y: System<N, Z, Model = Plant>>(self, system: &Y) -> f64 {
        let mut x = [0.0; N];
        x[..START.len()].copy_from_slice(&START);
        let d = <Plant as Model>::Discrete::default();
        nanoseconds(|| {
            let rates: Result<[f64; N], EvaluationError> =
                system.rates(0.0, black_box(&x), black_box(&self.0), &d);
            x[0] = 0.05 + 1e-9 * black_box(rates.map_or(0.0, |rates| rates[2]));
        })
    }
}

/// Numbers of the default plant.
struct Written {
    half: f64,
    m_l: f64,
    commands: [f64; 2],
}

impl Written {
    /// Equations (3) to (8) with LuGre friction and weight, without end stops, energies and slots.
    #[inline]
    fn rates(&self, x: &[f64; 8]) -> [f64; 8] {
        let [r_x, r_z, v_x, v_z, f_1, f_2, z_1, z_2] = *x;
        let (f, z) = ([f_1, f_2], [z_1, z_2]);
        let (mut m_xx, mut m_xz, mut m_zz) = (2.0, 0.0, 2.0);
        let (mut Q_x, mut Q_z) = (0.0, -2.0 * 9.81);
        let (mut f_dot, mut z_dot) = ([0.0; 2], [0.0; 2]);
        for i in 0..2 {
            let d = if i == 0 { r_x + self.half } else { r_x - self.half };
            let l = d.hypot(r_z);
            let (u_x, u_z) = (d / l, r_z / l);
            let (t_x, t_z) = (-u_z, u_x);
            let (l_dot, th) = (u_x * v_x + u_z * v_z, (t_x * v_x + t_z * v_z) / l);
            let arm = l - 0.25;
            let (I, I_prime) = (0.4125 + 3.0 * arm * arm, 6.0 * arm);
            let across = I / (l * l);
            m_xx += self.m_l * u_x * u_x + across * t_x * t_x;
            m_xz += self.m_l * u_x * u_z + across * t_x * t_z;
            m_zz += self.m_l * u_z * u_z + across * t_z * t_z;
            let bell = |v: f64| (-(l_dot / v) * (l_dot / v)).exp();
            z_dot[i] = l_dot - 2e6 * l_dot.abs() * z[i] / (60.0 + 30.0 * bell(0.005));
            let F_fr = 2e6 * z[i] + 5000.0 * bell(0.005) * z_dot[i] + 300.0 * l_dot;
            let along = f[i] - F_fr - (self.m_l * l - 0.5 * I_prime) * th * th - 9.81 * 3.0 * u_z;
            let turning =
                -(I_prime - 2.0 * I / l) * l_dot * th / l - 9.81 * (3.0 * arm + 8.0 * 0.15) * t_z / l;
            Q_x += u_x * along + t_x * turning;
            Q_z += u_z * along + t_z * turning;
            let share = if self.commands[i] * l_dot > 0.0 {
                ((0.5 - l_dot.abs()) / 0.1).clamp(0.0, 1.0)
            } else {
                1.0
            };
            f_dot[i] = (self.commands[i].clamp(-2500.0 * share, 2500.0 * share) - f[i]) * (TAU * 500.0);
        }
        let det = m_xx * m_zz - m_xz * m_xz;
        let (a_x, a_z) = ((m_zz * Q_x - m_xz * Q_z) / det, (m_xx * Q_z - m_xz * Q_x) / det);
        [v_x, v_z, a_x, a_z, f_dot[0], f_dot[1], z_dot[0], z_dot[1]]
    }
}

fn main() {
    let inputs = Inputs { u_1: 55.0, u_2: 45.0, ..Inputs::load(&vec![0.0; Inputs::<f64>::TABLE.len()]) };
    let motion = Motion::load(&Motion::<f64>::TABLE.iter().map(|entry| entry.start).collect::<Vec<_>>());
    let written = Written { half: 0.35, m_l: 3.0 + 1e-4 * (TAU / 0.01).powi(2), commands: [55.0, 45.0] };
    let mut x = START;
    let bare = nanoseconds(|| {
        let rates = black_box(&written).rates(black_box(&x));
        x[0] = 0.05 + 1e-9 * black_box(rates)[2];
    });
    println!("{:42} {bare:8.1} ns", "equations written out, LuGre");
    let plain = Parameters { use_energy: false, use_stop: false, ..Parameters::default() };
    let viscous = Friction { model: FrictionModel::Viscous, ..Friction::default() };
    for (name, parameters) in [
        ("LuGre", plain),
        ("LuGre, end stops, energies (default)", Parameters::default()),
        ("viscous, no weight", Parameters { friction: viscous, use_gravity: false, ..plain }),
    ] {
        match Plant::new(&parameters, &motion) {
            Ok(plant) => {
                let time = plant.with_system(Cost(inputs));
                println!("{name:42} {time:8.1} ns, {:5.2} of it", time / bare);
            }
            Err(refused) => println!("{name}: {refused}"),
        }
    }
    // the same equations
    if let Ok(plant) = Plant::new(&plain, &motion) {
        let mut all = [0.0; 11];
        all[..8].copy_from_slice(&START);
        if let Ok(rates) = plant.rates(0.0, &all, &inputs, &<Plant as Model>::Discrete::default()) {
            let apart =
                rates.iter().zip(written.rates(&START)).map(|(a, b)| (a - b).abs() / b.abs().max(1.0));
            println!("largest difference: {:.1e}", apart.fold(0.0, f64::max));
        }
    }
}
