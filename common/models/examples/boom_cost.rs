//! Cost of a right-hand side of the boom and of its outputs, each optional part on and off.
//!
//! ```text
//! cargo run --release -p models --example boom_cost
//! ```

#![allow(clippy::print_stdout, reason = "a table is its output")]

use std::hint::black_box;

use model::{Group, Model, Outputs, System, Variables, Visitor};
use models::boom::Boom;
use models::boom::variables::VariantKind::{self, A, B, C};
use models::boom::variables::{Inputs, Parameters, Use};

mod timing;

type Motion = <Boom as Model>::Motion<f64>;

/// Microseconds per call of `body`.
fn microseconds(body: impl FnMut()) -> f64 {
    1e6 * timing::seconds(20, body)
}

/// Times of the right-hand side and of the four groups of outputs [us].
struct Cost(Inputs<f64>);

impl Visitor<Boom> for Cost {
    type Output = [f64; 5];
    fn visit<const N: usize, const Z: usize, Y: System<N, Z, Model = Boom>>(self, system: &Y) -> [f64; 5] {
        let mut x = [0.0; N];
        x[..6].copy_from_slice(&[0.4, 1.2, -1.6, 1.0, -1.2, 0.8]);
        let d = <Boom as Model>::Discrete::default();
        let rates = microseconds(|| {
            black_box(system.rates(0.1, black_box(&x), black_box(&self.0), &d).is_ok());
        });
        let mut values = [0.0; 256];
        let groups = Group::ALL.map(|group| {
            microseconds(|| {
                let done = system.evaluate(group, 0.1, black_box(&x), black_box(&self.0), &d, &mut values);
                black_box(done.is_ok());
            })
        });
        [rates, groups[0], groups[1], groups[2], groups[3]]
    }
}

/// Nothing but angles, rates and the tip.
const BARE: Use = Use {
    collision: false,
    stability: false,
    hydraulics: false,
    forces: false,
    frames: false,
    limiter: true,
    energy: false,
};
const ALL: Use = Use {
    collision: true,
    stability: true,
    hydraulics: true,
    forces: true,
    frames: true,
    limiter: true,
    energy: true,
};

fn main() {
    let starts = |table: &[model::Entry]| -> Vec<f64> { table.iter().map(|entry| entry.start).collect() };
    let mut inputs = Inputs::load(&starts(<Inputs<f64> as Variables<f64>>::TABLE));
    inputs.command.0 = [0.04, -0.03, 0.05, 0.08, 0.1, 0.1];
    let motion = Motion::load(&starts(<Motion as Variables<f64>>::TABLE));
    println!("{:36}{:>8}{:>8}{:>8}{:>8}{:>8}  us", "", "rates", "motion", "safety", "forces", "energy");
    let row = |name: &str, variant: VariantKind, uses: Use, time_constant: f64| {
        let parameters = Parameters { variant, uses, time_constant, ..Parameters::default() };
        if let Ok(boom) = Boom::new(&parameters, &motion) {
            let times = boom.with_system(Cost(inputs)).map(|t| format!("{t:8.3}")).concat();
            println!("{name:36}{times}");
        }
    };
    for (name, variant) in [("A", A), ("B", B), ("C", C)] {
        row(&format!("{name}, every part"), variant, ALL, 0.0);
        row(&format!("{name}, every part, lag"), variant, ALL, 0.5);
        row(&format!("{name}, without energy"), variant, Use { energy: false, ..ALL }, 0.0);
        row(&format!("{name}, kinematics only"), variant, BARE, 0.0);
    }
    row("A, kinematics without limiter", A, Use { limiter: false, ..BARE }, 0.0);
    row("A, kinematics + frames", A, Use { frames: true, ..BARE }, 0.0);
    row("A, kinematics + hydraulics", A, Use { hydraulics: true, ..BARE }, 0.0);
    row("A, kinematics + stability", A, Use { stability: true, ..BARE }, 0.0);
    row("A, kinematics + collision", A, Use { collision: true, ..BARE }, 0.0);
    row("A, kinematics + forces", A, Use { forces: true, ..BARE }, 0.0);
    row("A, kinematics + energy", A, Use { energy: true, ..BARE }, 0.0);
}
