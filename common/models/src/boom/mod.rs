//! Boom of a truck-mounted concrete pump: kinematics, hydraulics, stability, collisions, limits of the rates.
//!
//! Numbers (B1) to (B22) in the text are those of the write-up `boom.md`.

pub mod distance;
pub mod kinematics;
mod limiter;
pub mod linkage;
pub mod machine;
pub mod masses;
mod plant;
mod pose;
mod report;
pub mod stability;
mod system;
pub mod variables;

pub use plant::Boom;
