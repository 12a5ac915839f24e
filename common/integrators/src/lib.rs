//! One-step methods for `x' = f(t, x)` on arrays of fixed size.
//!
//! ```text
//! x_(n+1) = x_n + h sum_i b_i k_i,   k_i = f(t_n + c_i h, x_n + h sum_j a_ij k_j)
//! ```
//! A method is one file with one table of numbers; the two drivers (`fixed.rs`, `adaptive.rs`) know it only as the
//! `OneStep` of `one_step.rs`. Nothing here knows a model or FMI, and nothing allocates.
//!
//! | method | order | step | for |
//! | --- | --- | --- | --- |
//! | [`Heun`](Method::Heun), [`Rk4`](Method::Rk4) | 2, 4 | fixed | real time, smooth motion |
//! | [`Dopri5`](Method::Dopri5), [`Dop853`](Method::Dop853) | 5, 8 | adaptive | moderate and high accuracy |
//! | [`Rodas4`](Method::Rodas4) | 4 | adaptive | stiff, moderate accuracy, no iteration |
//! | [`Radau5`](Method::Radau5) | 5 | adaptive | stiff, any accuracy |
//! | [`Exact`](Method::Exact) | exact | fixed | linear systems ([`Ode::linear`]), see [`Transition`]; with moving inputs [`LinearSteps`] |
//!
//! Sources: E. Hairer, S. P. Nørsett, G. Wanner, *Solving Ordinary Differential Equations I*, 2nd ed. 1993 (methods,
//! step size control, dense output); E. Hairer, G. Wanner, *II*, 2nd ed. 1996 (stiff methods); I. F. D. Oliveira,
//! R. H. C. Takahashi, ACM TOMS 47 (2020) (root finder). Left out: integration backwards in time, multistep methods,
//! sparse matrices.
//!
//! Where the number of states is known only at run time, [`DynamicSolver`] takes the same steps one by one. It allocates when it
//! is made, and for Rodas4 and Radau5 in every step; their Jacobians are differences of the right-hand side.
//!
//! ```
//! use integrators::{Method, Ode, Settings, Solver, Statistics};
//!
//! /// x' = -x
//! struct Decay;
//! impl Ode<1> for Decay {
//!     type Error = std::convert::Infallible;
//!     fn rhs(&self, _t: f64, x: &[f64; 1]) -> Result<[f64; 1], Self::Error> {
//!         Ok([-x[0]])
//!     }
//! }
//!
//! let mut solver = Solver::new(Settings { method: Method::Rk4, step: 0.01, rtol: 1e-6, atol: 1e-9 })?;
//! let (mut x, mut statistics) = ([1.0], Statistics::default());
//! solver.advance(&Decay, 0.0, 1.0, &mut x, &mut statistics)?;
//! assert!((x[0] - (-1.0_f64).exp()).abs() < 1e-10); // h^4 / 120 / e
//! assert_eq!(statistics.rhs_evaluations, 400);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![forbid(unsafe_code)]
#![allow(rustdoc::broken_intra_doc_links, reason = "units stand in brackets")]
#![allow(clippy::needless_range_loop, reason = "indices as in the equations")]

#[cfg(test)]
extern crate self as integrators;
#[cfg(test)]
#[path = "../tests/common/mod.rs"]
mod common;

mod adaptive;
mod complex;
mod dense;
mod dop853;
mod dopri5;
mod dynamic;
mod error;
mod events;
mod exact;
mod explicit;
mod first_step;
mod fixed;
mod heun;
mod linear;
mod lu;
mod matrix;
mod method;
mod norm;
mod ode;
mod one_step;
mod pace;
mod radau5;
mod rk4;
mod rodas4;
mod root;
mod run;
mod settings;
mod solver;
mod stability;
mod statistics;

pub use complex::Complex;
pub use dense::Dense;
pub use dynamic::{DynamicOde, DynamicSolver, DynamicState, NoSolver};
pub use error::{SettingsError, StepError};
pub use events::{Crossing, Indicators, Reached};
pub use exact::Transition;
pub use linear::{LinearForm, LinearSteps};
pub use method::Method;
pub use ode::{Jacobian, Ode};
pub use run::MAX_EVALUATIONS;
pub use settings::Settings;
pub use solver::{Memory, Solver};
pub use stability::{MAX_AMPLIFICATION, largest_stable_step, violates};
pub use statistics::Statistics;
