//! A planar haptic interface, what it renders and who holds it.
//!
//! Source: the EFFI specification. The published abstract gives no equations; these are a design from standard models.

pub mod arm_variables;
pub mod controller_variables;
pub mod device;
mod drawer;
mod effi_controller;
mod effi_plant;
pub mod fourbar;
pub mod friction;
pub mod mechanism_variables;
mod operator_arm;
pub mod plant_variables;
mod reduced;
pub mod sampler;
mod stop;
mod virtual_mechanism;
pub mod virtual_wall;

pub use effi_controller::Controller;
pub use effi_plant::Plant;
pub use operator_arm::Arm;
pub use virtual_mechanism::Mechanism;
pub use virtual_wall::Wall;
