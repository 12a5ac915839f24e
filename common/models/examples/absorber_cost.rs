//! Cost of a right-hand side of the absorber, beside the equations written out for its default case.
//!
//! ```text
//! cargo run --release -p models --example absorber_cost
//! ```

#![allow(clippy::print_stdout, reason = "a table is its output")]

use std::hint::black_box;

use model::{EvaluationError, Model, System, Variables, Visitor};
use models::absorber::RvdpAbsorber;

mod timing;

type Parameters = <RvdpAbsorber as Model>::Parameters;
type Inputs = <RvdpAbsorber as Model>::Inputs<f64>;
type Motion = <RvdpAbsorber as Model>::Motion<f64>;

/// Nanoseconds per call of `body`.
fn nanoseconds(body: impl FnMut()) -> f64 {
    1e9 * timing::seconds(100, body)
}

/// Time of the rates of the system that the parameters choose.
struct Cost(Inputs);

impl Visitor<RvdpAbsorber> for Cost {
    type Output = (usize, f64);
    fn visit<const N: usize, const Z: usize, Y: System<N, Z, Model = RvdpAbsorber>>(
        self,
        system: &Y,
    ) -> Self::Output {
        let mut x = [0.01; N];
        let d = <RvdpAbsorber as Model>::Discrete::default();
        let time = nanoseconds(|| {
            let rates: Result<[f64; N], EvaluationError> =
                system.rates(0.1, black_box(&x), black_box(&self.0), &d);
            x[1] = 0.1 + 1e-9 * black_box(rates.map_or(0.0, |rates| rates[1]));
        });
        (N, time)
    }
}

fn main() {
    let starts = |table: &[model::Entry]| -> Vec<f64> { table.iter().map(|entry| entry.start).collect() };
    let inputs = Inputs::load(&starts(<Inputs as Variables<f64>>::TABLE));
    let motion = Motion::load(&starts(<Motion as Variables<f64>>::TABLE));
    let (m, c, gamma, omega, amplitude) =
        (5.0, 800.0, 10.0, 12.566_370_614_359_172, 0.063_325_739_776_461_11);
    let mut x = [0.01, 0.01];
    let bare = nanoseconds(|| {
        let [y, w] = *black_box(&x);
        let (gamma, omega, a) = black_box((gamma, omega, 0.0));
        let square = omega * omega;
        let force =
            -0.5 * gamma * m * (w * w + square * (y * y - amplitude * amplitude)) * w - (m * square - c) * y;
        let rate = (force - c * y) / m - a;
        x[1] = 0.1 + 1e-9 * black_box([w, rate])[1];
    });
    println!("{:40} {bare:8.2} ns", "equations written out");
    let plain = Parameters { use_energy: false, ..Parameters::default() };
    let mut stop = Parameters::default();
    stop.stop.used = true;
    stop.control.use_limit = true;
    for (name, parameters) in [
        ("two states", plain),
        ("with energies", Parameters::default()),
        ("with energies, stop, limit", stop),
    ] {
        let Ok(absorber) = RvdpAbsorber::new(&parameters, &motion) else {
            continue;
        };
        let (n, time) = absorber.with_system(Cost(inputs));
        println!("{name:28} {n} states    {time:8.2} ns, {:5.2} of it", time / bare);
    }
}
