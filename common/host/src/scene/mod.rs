//! From a system structure to a plan of calls.

mod error;
mod network;
mod order;
mod parameters;
mod plan;

pub use error::SceneError;
pub use network::{Axis, Joint, Network, Node, Recorded, Signal, Sink, Source};
pub use parameters::Override;
pub use plan::{Plan, Probe, Step};
