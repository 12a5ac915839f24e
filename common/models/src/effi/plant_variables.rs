//! Variables of the device.

use model::{Variables, Vector2};

use super::device::Device;
use super::friction::Friction;
use crate::port::PlanarSlot;

/// Masses that only the equations of motion need, and the drives.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(parameter)]
pub struct Drive {
    /// Moment of inertia of each rod about its centre of mass [kg.m2]
    #[var(name = "rod.inertia", start = 0.0625, min = 0.0)]
    pub I_rod: f64,
    /// Moment of inertia of each housing about its pivot [kg.m2]
    #[var(name = "housing.inertia", start = 0.35, min = 0.0)]
    pub I_housing: f64,
    /// Travel of the rod per turn of the screw [m]
    #[var(name = "axis.lead", start = 0.01, above = 0.0)]
    pub lead: f64,
    /// Moment of inertia of motor and screw [kg.m2]
    #[var(name = "axis.rotor_inertia", start = 1e-4, min = 0.0)]
    pub J_rotor: f64,
    /// Speed above which the driving force falls [m/s]
    #[var(name = "axis.v_knee", start = 0.4, above = 0.0)]
    pub v_knee: f64,
    /// Speed at which no driving force is left [m/s]
    #[var(name = "axis.v_max", start = 0.5, above = 0.0)]
    pub v_max: f64,
    /// Bandwidth of the current loop [Hz]
    #[var(name = "axis.bandwidth", start = 500.0, above = 0.0)]
    pub bandwidth: f64,
}

/// End stops of both axes.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(parameter)]
pub struct Stroke {
    /// Shortest length of an axis [m]
    #[var(name = "min", start = 0.5, above = 0.0)]
    pub min: f64,
    /// Greatest length of an axis [m]
    #[var(name = "max", start = 0.9, above = 0.0)]
    pub max: f64,
    /// Stiffness of the end stops [N/m]
    #[var(name = "stiffness", start = 2e6, min = 0.0)]
    pub k: f64,
    /// Damping of the end stops, relative to the elastic force [s/m]
    #[var(name = "damping", start = 2.0, min = 0.0)]
    pub chi: f64,
}

/// Parameters of the device. Defaults are engineering choices.
#[allow(clippy::struct_excessive_bools, reason = "one for each part that can be left out")]
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(parameter)]
pub struct Parameters {
    #[var(prefix = "")]
    #[allow(missing_docs, reason = "a group")]
    pub device: Device,
    /// Position of the handle at the start [m]
    #[var(name = "H.start", start = [0.0, 0.6])]
    pub start: Vector2<f64>,
    /// Velocity of the handle at the start [m/s]
    #[var(name = "H.start.v")]
    pub start_v: Vector2<f64>,
    /// The axis forces start at those that hold the weight, otherwise at zero
    #[var(name = "start.balanced", start = false)]
    pub balanced: bool,
    #[var(prefix = "")]
    #[allow(missing_docs, reason = "a group")]
    pub drive: Drive,
    #[var(prefix = "friction.")]
    #[allow(missing_docs, reason = "a group")]
    pub friction: Friction,
    #[var(prefix = "stroke.")]
    #[allow(missing_docs, reason = "a group")]
    pub stroke: Stroke,
    /// Resolution of the encoders; 0: ideal [m]
    #[var(name = "encoder.resolution", start = 1e-6, min = 0.0)]
    pub resolution: f64,
    /// Size of the Jacobian's determinant below which the pose counts as singular
    #[var(name = "singularity.tolerance", start = 1e-3, min = 0.0, max = 1.0)]
    pub tolerance: f64,
    /// End stops
    #[var(name = "use.stroke_stop", start = true)]
    pub use_stop: bool,
    /// Rounding of the measured positions
    #[var(name = "use.encoder", start = true)]
    pub use_encoder: bool,
    /// Weight
    #[var(name = "use.gravity", start = true)]
    pub use_gravity: bool,
    /// Energy integrals
    #[var(name = "use.energy", start = true)]
    pub use_energy: bool,
}

/// Inputs of the device.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(input)]
pub struct Inputs<S> {
    /// Wanted force of the first axis, before saturation [N]
    #[var(name = "axis[1].force_command", discrete, nominal = 1e2)]
    pub u_1: S,
    /// Wanted force of the second axis, before saturation [N]
    #[var(name = "axis[2].force_command", discrete, nominal = 1e2)]
    pub u_2: S,
    #[var(prefix = "H.")]
    #[allow(missing_docs, reason = "leader port H, first slot")]
    pub H: PlanarSlot<S>,
    #[var(prefix = "H.slot[2].")]
    #[allow(missing_docs, reason = "leader port H, second slot")]
    pub H_2: PlanarSlot<S>,
}

const POSE: &[&str] = &["H.r"];
const MOVING: &[&str] = &["H.r", "H.v"];
const DRIVE_1: &[&str] = &["axis[1].force_command", "axis[1].force", "H.r", "H.v"];
const DRIVE_2: &[&str] = &["axis[2].force_command", "axis[2].force", "H.r", "H.v"];
const RUBBING_1: &[&str] = &["H.r", "H.v", "axis[1].bristle"];
const RUBBING_2: &[&str] = &["H.r", "H.v", "axis[2].bristle"];
/// What the acceleration depends on: forces and bristles, not the commands.
const DYNAMIC: &[&str] = &["H", "axis[1].force", "axis[2].force", "axis[1].bristle", "axis[2].bristle"];

/// Motion of the handle and the axes.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Motion<S> {
    /// Position of the handle [m]
    #[var(name = "H.r", state, rate_depends = [["H.v.x"], ["H.v.z"]])]
    pub r: Vector2<S>,
    /// Velocity of the handle [m/s]
    #[var(name = "H.v", nominal = 0.1, state, rate_depends = DYNAMIC)]
    pub v: Vector2<S>,
    /// Measured length of the first axis [m]
    #[var(name = "axis[1].position", depends = POSE)]
    pub l_1: S,
    /// Measured length of the second axis [m]
    #[var(name = "axis[2].position", depends = POSE)]
    pub l_2: S,
    /// Rate of the length of the first axis [m/s]
    #[var(name = "axis[1].velocity", nominal = 0.1, depends = MOVING)]
    pub v_1: S,
    /// Rate of the length of the second axis [m/s]
    #[var(name = "axis[2].velocity", nominal = 0.1, depends = MOVING)]
    pub v_2: S,
    /// Force of the first drive at its screw, pushing the handle away from A [N]
    #[var(name = "axis[1].force", nominal = 1e2, state, rate_depends = DRIVE_1)]
    pub f_1: S,
    /// Force of the second drive at its screw, pushing the handle away from B [N]
    #[var(name = "axis[2].force", nominal = 1e2, state, rate_depends = DRIVE_2)]
    pub f_2: S,
    /// Deflection of the bristles of the first axis [m]
    #[var(name = "axis[1].bristle", nominal = 1e-5, state, rate_depends = RUBBING_1)]
    pub z_1: S,
    /// Deflection of the bristles of the second axis [m]
    #[var(name = "axis[2].bristle", nominal = 1e-5, state, rate_depends = RUBBING_2)]
    pub z_2: S,
    /// Friction of the first axis, against its motion [N]
    #[var(name = "axis[1].friction", nominal = 1e2, depends = RUBBING_1)]
    pub F_fr_1: S,
    /// Friction of the second axis, against its motion [N]
    #[var(name = "axis[2].friction", nominal = 1e2, depends = RUBBING_2)]
    pub F_fr_2: S,
    /// Determinant of the Jacobian: sine of the angle between the rods
    #[var(name = "jacobian.determinant", depends = POSE)]
    pub determinant: S,
    /// 1 while the determinant is below singularity.tolerance in size, otherwise 0
    #[var(name = "singular", discrete)]
    pub singular: S,
}

/// Acceleration and measured force.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Dynamics<S> {
    /// Acceleration of the handle [m/s2]
    #[var(name = "H.a", depends = DYNAMIC)]
    pub a: Vector2<S>,
    /// Force of the followers on the handle [N]
    #[var(name = "sensor.F", nominal = 1e1, depends = DYNAMIC)]
    pub sensor_F: Vector2<S>,
}

/// Energies.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Energy<S> {
    /// Kinetic energy, that of the rotors included [J]
    #[var(name = "energy.kinetic", depends = MOVING)]
    pub kinetic: S,
    /// Energy of gravity, end stops and bristles [J]
    #[var(name = "energy.potential", depends = ["H.r", "axis[1].bristle", "axis[2].bristle"])]
    pub potential: S,
    /// Energy turned into heat since the start; may shrink for moments with bristles [J]
    #[var(name = "energy.dissipated", state, rate_depends = ["H.r", "H.v", "axis[1].bristle", "axis[2].bristle"])]
    pub dissipated: S,
    /// Work of the drives and of the followers since the start [J]
    #[var(name = "energy.supplied", state, rate_depends = DYNAMIC)]
    pub supplied: S,
    /// Work of the followers on the handle since the start [J]
    #[var(name = "energy.port", state, rate_depends = DYNAMIC)]
    pub port: S,
}
