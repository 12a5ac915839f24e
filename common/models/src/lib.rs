//! The physical systems of the suite, one folder each. Equations only; no interface standard.

#![forbid(unsafe_code)]
#![allow(non_snake_case, reason = "names are the papers' symbols: F_A, M, q_ddot")]

pub mod absorber;
pub mod boom;
pub mod effi;
pub mod force_law;
mod min_jerk;
pub mod parts;
pub mod port;
pub mod suspension;
