//! A planar haptic interface, what it renders and who holds it.
//!
//! Source: the EFFI specification. The published abstract gives no equations; these are a design from standard models.

mod arm;
pub mod arm_variables;
mod controller;
pub mod controller_variables;
pub mod device;
mod drawer;
pub mod fourbar;
pub mod friction;
mod mechanism;
pub mod mechanism_variables;
mod plant;
pub mod plant_variables;
mod reduced;
pub mod sampler;
mod stop;
pub mod wall;

pub use arm::Arm;
pub use controller::Controller;
pub use mechanism::Mechanism;
pub use plant::Plant;
pub use wall::Wall;
