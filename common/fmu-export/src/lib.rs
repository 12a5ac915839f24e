//! Exports a [`model::Model`] as an FMU.
//!
//! ```text
//! model (safe trait)  ->  instance (values, phases, lazy outputs, steps)  ->  c_abi (FMI 2.0, 3.0)
//!                     ->  describe (modelDescription.xml)                 ->  package (.fmu)
//! ```
//!
//! The C boundary calls an [`Exported`] instance: that of a model, or one that computes otherwise.
//!
//! An FMU crate is `fmu_export::export!(Model);` in its library and `fmu_export::run::<Model>()` in
//! its program, which describes and packs it.

mod built;
pub mod c_abi;
mod derivatives;
mod describe;
mod documentation;
mod events;
mod exchange;
mod exported;
mod fault;
pub mod inputs;
mod instance;
pub mod interned;
mod jobs;
mod package;
mod phase;
mod profile;
mod reference;
mod resources;
mod serialise;
mod solver;
mod standard;
mod state;
mod step;
mod table;
mod terminals;
pub mod times;
mod unit;
pub mod values;

pub use describe::{describe, model_description};
pub use documentation::DocumentationError;
pub use events::Event;
pub use exported::{CreationError, Exported};
pub use fault::{Fault, Status};
pub use inputs::{InputTreatment, PortParameters, PortReset};
pub use instance::Instance;
pub use package::{PackError, archive, pack, run};
pub use phase::{Interface, Phase, Rule};
pub use profile::Profile;
pub use serialise::SerialisedStateError;
pub use solver::{SolverCounters, SolverMethod, SolverParameters};
pub use standard::Standard;
pub use state::State;
pub use table::{TIME, Table, Variable, allowed};
pub use terminals::parts as port_parts;
