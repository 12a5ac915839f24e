//! Small parts of scenes: loads, guided motion, compliant joints.
//!
//! Source: coupling specification, section 8. A source (load, guide) stores nothing: what its law supplies
//! leaves through its ports, so `energy.port = -energy.supplied`.

pub mod bushing;
pub mod guide;
pub mod load;

pub use bushing::Bushing;
pub use guide::Guide;
pub use load::Load;
