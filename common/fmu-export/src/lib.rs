//! Exports a [`model::Model`] as an FMU.
//!
//! ```text
//! model (safe trait)  ->  instance (values, phases, lazy outputs, steps)  ->  c_abi (FMI 3.0)
//!                     ->  describe (modelDescription.xml)                 ->  package (.fmu)
//! ```
//!
//! An FMU crate is `fmu_export::export!(Model);` in its library and `fmu_export::run::<Model>()` in
//! its program, which describes and packs it.

pub mod c_abi;
mod describe;
mod fault;
mod instance;
mod jobs;
mod package;
mod phase;
mod solver;
mod table;
mod unit;

pub use describe::model_description;
pub use fault::{Fault, Status};
pub use instance::{Instance, State};
pub use package::{PackError, archive, run};
pub use phase::{Phase, Rule};
pub use solver::{SolverCounters, SolverMethod, SolverParameters};
pub use table::{Table, Variable};
