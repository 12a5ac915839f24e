//! Cost of an assembly over its size: one right-hand side and one projection of N loops (IFToMM A02).
//!
//! ```text
//! cargo run --release -p models --example assembly_cost
//! ```
//!
//! Prints time per call (smallest of the repeats), the error of the accelerations against the exact
//! pendulum (23) beside it, and the exponent of N between the rows: 1 is linear.

#![allow(non_snake_case, clippy::print_stdout, reason = "symbols of the papers; a table is its output")]

use std::hint::black_box;

use integrators::Ode;

#[path = "../tests/linkage/mod.rs"]
#[allow(dead_code, reason = "what the tests need besides")]
mod linkage;
use linkage::{n_four_bar, n_four_bar_state};

mod timing;

/// One row of the table.
struct Row {
    n: f64,
    rhs: f64,
    projection: f64,
    error: f64,
}

#[allow(clippy::large_stack_arrays, reason = "sizes are static")]
fn measure<const B: usize, const N: usize, const X: usize>() -> Row {
    let linkage = n_four_bar::<B, N, 2>();
    let n = f64::from(u32::try_from(N).expect("small"));
    let phi = 1.0_f64;
    let x: [f64; X] = n_four_bar_state(N, phi);
    let x_dot = linkage.rhs(0.0, &x).expect("regular");
    let exact = -(1.5 * n + 0.5) / (4.0 / 3.0 * n + 1.0 / 3.0) * 9.81 * phi.cos();
    let error = (0..=N).map(|i| (x_dot[2 * i + 1] / exact - 1.0).abs()).fold(0.0, f64::max);
    let rhs = timing::seconds(1, || {
        black_box(linkage.rhs(0.0, black_box(&x)).expect("regular"));
    });
    // off the loops by 1e-6 rad, as after an explicit step
    let mut off = x;
    off[0] += 1e-6;
    let projection = timing::seconds(1, || {
        let mut x = black_box(off);
        black_box(linkage.project(0.0, &mut x).expect("regular"));
    });
    Row { n, rhs, projection, error }
}

fn table() {
    let rows = [
        measure::<21, 10, 42>(),
        measure::<41, 20, 82>(),
        measure::<101, 50, 202>(),
        measure::<201, 100, 402>(),
        measure::<401, 200, 802>(),
    ];
    println!(
        "{:>5} {:>14} {:>9} {:>16} {:>9} {:>10}",
        "N", "rhs / us", "exponent", "projection / us", "exponent", "error"
    );
    for (i, row) in rows.iter().enumerate() {
        let exponent = |of: fn(&Row) -> f64| {
            i.checked_sub(1).map_or(String::new(), |before| {
                let before = &rows[before];
                format!("{:.2}", (of(row) / of(before)).ln() / (row.n / before.n).ln())
            })
        };
        println!(
            "{:>5} {:>14.3} {:>9} {:>16.3} {:>9} {:>10.1e}",
            row.n,
            row.rhs * 1e6,
            exponent(|r| r.rhs),
            row.projection * 1e6,
            exponent(|r| r.projection),
            row.error
        );
    }
    let (first, last) = (&rows[0], &rows[rows.len() - 1]);
    let overall = |of: fn(&Row) -> f64| (of(last) / of(first)).ln() / (last.n / first.n).ln();
    println!(
        "exponent from N = 10 to 200: rhs {:.2}, projection {:.2}",
        overall(|r| r.rhs),
        overall(|r| r.projection)
    );
}

fn main() {
    // the sizes are static, so are the temporaries: a few megabytes
    let thread = std::thread::Builder::new().stack_size(64 << 20).spawn(table).expect("a thread");
    thread.join().expect("the table is printed");
}
