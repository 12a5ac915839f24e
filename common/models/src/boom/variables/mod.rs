//! Parameters and inputs of the boom; its outputs are in [`outputs`].

pub mod indexed;
pub mod outputs;

use indexed::{AngleStarts, Commands, FlowsMaxExtend, FlowsMaxRetract, RatesMax, TangentialsMax};
use model::{Enumeration, Variables};

use crate::port::Slot;

/// Variant of the control
#[derive(Debug, Clone, Copy, PartialEq, Eq, Enumeration)]
pub enum VariantKind {
    /// Blanket limits of the rates
    A = 1,
    /// Limits of the tangential speeds that depend on the pose
    B = 2,
    /// As B with larger flows
    C = 3,
}

/// How the outriggers stand
#[derive(Debug, Clone, Copy, PartialEq, Eq, Enumeration)]
pub enum SupportKind {
    /// All outriggers extended
    Full = 1,
    /// One side narrow
    Partial = 2,
}

/// Parts that may be left out.
#[allow(clippy::struct_excessive_bools, reason = "one switch per part")]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Variables)]
#[variables(parameter)]
pub struct Use {
    /// Distances of the arms from vehicle and outriggers
    #[var(name = "collision", start = true)]
    pub collision: bool,
    /// Tip-over angles
    #[var(name = "stability", start = true)]
    pub stability: bool,
    /// Cylinders and flows, with their limits
    #[var(name = "hydraulics", start = true)]
    pub hydraulics: bool,
    /// Torques, forces and pressures
    #[var(name = "forces", start = true)]
    pub forces: bool,
    /// Measuring points K[1] to K[5]
    #[var(name = "frames", start = true)]
    pub frames: bool,
    /// Limits of rates, tangential speeds and flows; without them only the ranges of the joints limit the motion
    #[var(name = "limiter", start = true)]
    pub limiter: bool,
    /// Energy integrals
    #[var(name = "energy", start = true)]
    pub energy: bool,
}

/// Parameters. Defaults: the compiled-in machine in transport pose, variant A, full support.
#[derive(Debug, Clone, PartialEq, Variables)]
#[variables(parameter)]
pub struct Parameters {
    /// Variant of the control
    #[var(name = "machine.variant", item = VariantKind::A)]
    pub variant: VariantKind,
    /// How the outriggers stand
    #[var(name = "machine.support", item = SupportKind::Full)]
    pub support: SupportKind,
    /// Angle of the joint at the start, inside the range of the machine file [rad]
    #[var(
        name = "joint",
        start = [0.0, 0.0, -3.089_232_776, 3.071_779_483_5, -3.106_686_068_5, 3.115_412_714_8]
    )]
    pub angle_start: AngleStarts<f64>,
    /// Largest rate of the joint, > 0; -1: that of the variant [rad/s]
    #[var(name = "joint", start = -1.0, above = 0.0, or = -1.0, tunable)]
    pub rate_max: RatesMax<f64>,
    /// Largest tangential speed of the later link ends by the joint, > 0; -1: that of the variant [m/s]
    #[var(name = "joint", start = -1.0, above = 0.0, or = -1.0, tunable)]
    pub tangential_max: TangentialsMax<f64>,
    /// Largest flow of the extending cylinder, >= 0; -1: that of the variant [m3/s]
    #[var(name = "cylinder", start = -1.0, min = 0.0, or = -1.0, nominal = 1e-3, tunable)]
    pub flow_max_extend: FlowsMaxExtend<f64>,
    /// Largest flow of the retracting cylinder, >= 0; -1: that of the variant [m3/s]
    #[var(name = "cylinder", start = -1.0, min = 0.0, or = -1.0, nominal = 1e-3, tunable)]
    pub flow_max_retract: FlowsMaxRetract<f64>,
    /// Largest flow of the slew motor, both ways, >= 0; -1: that of the variant [m3/s]
    #[var(name = "slew.flow_max", start = -1.0, min = 0.0, or = -1.0, nominal = 1e-3, tunable)]
    pub slew_flow_max: f64,
    /// Largest flow of all actuators together, >= 0; -1: that of the variant [m3/s]
    #[var(name = "hydraulics.flow_total_max", start = -1.0, min = 0.0, or = -1.0, nominal = 1e-3, tunable)]
    pub flow_total_max: f64,
    /// Lag of the rates behind their commands; 0: none [s]
    #[var(name = "actuator.time_constant", start = 0.0, min = 0.0, max = 60.0)]
    pub time_constant: f64,
    /// Part of the pipe that is full of concrete
    #[var(name = "boom.concrete_fill", start = 0.0, min = 0.0, max = 1.0, tunable)]
    pub concrete_fill: f64,
    /// Mass of the hose at the tip [kg]
    #[var(name = "tip.mass", start = 0.0, min = 0.0, max = 2000.0, tunable)]
    pub tip_mass: f64,
    #[var(prefix = "use.")]
    #[allow(missing_docs, reason = "a group")]
    pub uses: Use,
    /// The vertical load at the tip counts as a mass there for centre of mass and tip-over angles
    #[var(name = "stability.include_tip_force", start = false)]
    pub include_tip_force: bool,
}

/// Inputs.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(input)]
pub struct Inputs<S> {
    /// Wanted rate of the joint; one that is not finite acts as 0 [rad/s]
    #[var(name = "joint", any, nominal = 0.01)]
    pub command: Commands<S>,
    #[var(prefix = "TIP.")]
    #[allow(missing_docs, reason = "leader port TIP")]
    pub TIP: Slot<S>,
}
