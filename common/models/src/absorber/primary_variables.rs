//! Parameters, inputs and outputs of the primary oscillator.

use model::{Enumeration, SymmetricTensor, Variables, Vector3};

use crate::port::{Root, ScalarRoot, ScalarSlot, Slot};

/// Which ports the oscillator has
#[derive(Debug, Clone, Copy, PartialEq, Eq, Enumeration)]
pub enum PortKind {
    /// One coordinate: P.s, A.s
    Scalar = 1,
    /// Points in space that move along the direction: P.r, A.r
    Spatial = 2,
}

/// Start of one mass.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(parameter)]
pub struct Start {
    /// Displacement of the mass at the start [m]
    #[var(name = "s[1].start")]
    pub s_1: f64,
    /// Displacement of the second mass at the start; only with dof = 2 [m]
    #[var(name = "s[2].start")]
    pub s_2: f64,
    /// Velocity of the mass at the start [m/s]
    #[var(name = "v[1].start")]
    pub v_1: f64,
    /// Velocity of the second mass at the start; only with dof = 2 [m/s]
    #[var(name = "v[2].start")]
    pub v_2: f64,
}

/// Parameters. Defaults: 100 kg at 2 Hz with 1 % damping, driven at resonance.
#[derive(Debug, Clone, PartialEq, Variables)]
#[variables(parameter)]
pub struct Parameters {
    /// Number of masses
    #[var(name = "dof", start = 1.0, min = 1.0, max = 2.0)]
    pub dof: i32,
    /// Kind of the ports; the other kind ignores its inputs and gives zeros
    #[var(name = "port.kind", item = PortKind::Scalar)]
    pub kind: PortKind,
    /// Direction of the motion, spatial ports; any length but zero
    #[var(name = "direction", start = [0.0, 0.0, 1.0])]
    pub direction: Vector3<f64>,
    /// Position of P at s = 0, spatial port without base [m]
    #[var(name = "origin")]
    pub origin: Vector3<f64>,
    /// Mass that carries the port P; 0: the last one
    #[var(name = "port.mass", start = 0.0, min = 0.0, max = 2.0)]
    pub port_mass: i32,
    /// Mass that is driven
    #[var(name = "drive.mass", start = 1.0, min = 1.0, max = 2.0)]
    pub drive_mass: i32,
    /// Masses; the second only with dof = 2 [kg]
    #[var(name = "mass", start = [100.0, 60.0], above = 0.0)]
    pub M: [f64; 2],
    /// Stiffness of the spring below each mass [N/m]
    #[var(name = "stiffness", start = [15_791.367_041_742_973, 30_000.0], min = 0.0)]
    pub K: [f64; 2],
    /// Damping below each mass [N.s/m]
    #[var(name = "damping", start = [25.132_741_228_718_345, 20.0], min = 0.0)]
    pub C: [f64; 2],
    #[var(prefix = "")]
    #[allow(missing_docs, reason = "a group")]
    pub start: Start,
    /// Stiffness between the first mass and the ground at s = 0 [N/m]
    #[var(name = "ground.stiffness", start = 0.0, min = 0.0)]
    pub K_g: f64,
    /// Damping between the first mass and the ground [N.s/m]
    #[var(name = "ground.damping", start = 0.0, min = 0.0)]
    pub C_g: f64,
    /// Follower port A: the base moves
    #[var(name = "use.base", start = false)]
    pub use_base: bool,
    /// Mass that moves with the base; only with use.base [kg]
    #[var(name = "root.mass", start = 0.0, min = 0.0)]
    pub M_r: f64,
    /// Gravity; spatial ports only [m/s2]
    #[var(name = "gravity")]
    pub gravity: Vector3<f64>,
    /// Amplitude of the drive [N]
    #[var(name = "drive.amplitude", start = 50.0, tunable)]
    pub amplitude: f64,
    /// Angular frequency of the drive at t = 0 [rad/s]
    #[var(name = "drive.omega_start", start = 4.0 * std::f64::consts::PI, tunable)]
    pub omega_start: f64,
    /// Rate of the angular frequency [rad/s2]
    #[var(name = "drive.sweep", start = 0.0, tunable)]
    pub sweep: f64,
    /// Phase of the drive [rad]
    #[var(name = "drive.phase", start = 0.0, tunable)]
    pub phase: f64,
    /// Energy integrals
    #[var(name = "use.energy", start = true)]
    pub use_energy: bool,
}

/// Inputs.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(input)]
pub struct Inputs<S> {
    #[var(prefix = "P.")]
    #[allow(missing_docs, reason = "scalar port P, first slot")]
    pub P: ScalarSlot<S>,
    #[var(prefix = "P.slot[2].")]
    #[allow(missing_docs, reason = "scalar port P, second slot")]
    pub P_2: ScalarSlot<S>,
    #[var(prefix = "P.")]
    #[allow(missing_docs, reason = "spatial port P, first slot")]
    pub P_spatial: Slot<S>,
    #[var(prefix = "P.slot[2].")]
    #[allow(missing_docs, reason = "spatial port P, second slot")]
    pub P_2_spatial: Slot<S>,
    #[var(prefix = "A.")]
    #[allow(missing_docs, reason = "scalar port A")]
    pub A: ScalarRoot<S>,
    #[var(prefix = "A.")]
    #[allow(missing_docs, reason = "spatial port A")]
    pub A_spatial: Root<S>,
    /// Force on the driven mass besides the drive's own [N]
    #[var(name = "drive.force")]
    pub drive_force: S,
}

// What depends on what, united over all settings; `=P.F` is the scalar variable alone, `P.F.*` the vector alone.

const POSITION: &[&str] = &["A.r", "s"];
const VELOCITY: &[&str] = &["A.v.*", "v"];
/// Force of the lowest spring and damper.
const T_1: &[&str] = &["=A.s", "=A.v", "s[1]", "v[1]"];
/// Accelerations in one coordinate.
const SCALAR: &[&str] =
    &["=P.F", "=P.M", "=P.slot[2].F", "=P.slot[2].M", "=A.s", "=A.v", "drive.force", "s", "v"];
/// Loads, springs and drive in space.
const SPATIAL_BIAS: &[&str] =
    &["P.F.*", "P.M.*", "P.slot[2].F.*", "P.slot[2].M.*", "A.r", "A.v.*", "drive.force", "s", "v"];
const SPATIAL_INERTIA: &[&str] = &["P.M.*", "P.slot[2].M.*"];
/// The same with the acceleration of the base.
const SPATIAL: &[&str] =
    &["P.F.*", "P.M.*", "P.slot[2].F.*", "P.slot[2].M.*", "A.r", "A.v.*", "A.a.*", "drive.force", "s", "v"];
/// The first mass hangs on the base, the second on the first.
const MASS_1: &[&str] = &["P.F", "P.M", "P.slot[2]", "=A.s", "A.r", "A.v", "A.a.*", "drive.force", "s", "v"];
const MASS_2: &[&str] = &["P.F", "P.M", "P.slot[2]", "A.a.*", "drive.force", "s", "v"];
const WORK: &[&str] = &["P.F", "P.M", "P.slot[2]", "A", "drive.force", "s", "v"];

/// Displacements and ports.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Motion<S> {
    /// Displacement of each mass from its rest position [m]
    #[var(name = "s", state, rate_depends = [["v[1]"], ["v[2]"]])]
    pub s: [S; 2],
    /// Velocity of each mass [m/s]
    #[var(name = "v", state, rate_depends = [MASS_1, MASS_2])]
    pub v: [S; 2],
    /// Position of the port, scalar [m]
    #[var(name = "P.s", depends = ["s"])]
    pub P_s: S,
    /// Velocity of the port, scalar [m/s]
    #[var(name = "P.v", depends = ["v"])]
    pub P_v: S,
    /// Position of the port, spatial [m]
    #[var(name = "P.r", depends = POSITION)]
    pub P_r_spatial: Vector3<S>,
    /// Velocity of the port, spatial [m/s]
    #[var(name = "P.v", depends = VELOCITY)]
    pub P_v_spatial: Vector3<S>,
    /// Angular frequency of the drive [rad/s]
    #[var(name = "drive.omega")]
    pub drive_omega: S,
}

/// What the leader at A has to carry.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Inertia<S> {
    /// Force on the base at rest, scalar [N]
    #[var(name = "A.F0", nominal = 1e2, depends = T_1)]
    pub F0: S,
    /// Inertia behind port A, scalar [kg]
    #[var(name = "A.M")]
    pub M: S,
    /// Force on the base at A.a = 0, spatial (28) [N]
    #[var(name = "A.F0", nominal = 1e2, depends = SPATIAL_BIAS)]
    pub F0_spatial: Vector3<S>,
    /// Inertia behind port A, spatial (28) [kg]
    #[var(name = "A.M", depends = SPATIAL_INERTIA)]
    pub M_spatial: SymmetricTensor<S>,
}

/// Accelerations and forces.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Dynamics<S> {
    /// Acceleration of the port, scalar [m/s2]
    #[var(name = "P.a", depends = SCALAR)]
    pub P_a: S,
    /// Acceleration of the port, spatial [m/s2]
    #[var(name = "P.a", depends = SPATIAL)]
    pub P_a_spatial: Vector3<S>,
    /// Force on the base, scalar [N]
    #[var(name = "A.F", nominal = 1e2, depends = ["=A.s", "=A.v", "=A.a", "s[1]", "v[1]"])]
    pub A_F: S,
    /// Force on the base, spatial [N]
    #[var(name = "A.F", nominal = 1e2, depends = SPATIAL)]
    pub A_F_spatial: Vector3<S>,
}

/// Energies.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Energy<S> {
    /// Kinetic energy [J]
    #[var(name = "energy.kinetic", depends = ["A.v", "v"])]
    pub kinetic: S,
    /// Energy of the springs and, with a base, of gravity [J]
    #[var(name = "energy.potential", depends = ["=A.s", "A.r", "s"])]
    pub potential: S,
    /// Energy turned into heat since the start [J]
    #[var(name = "energy.dissipated", state, rate_depends = ["A.v", "v"])]
    pub dissipated: S,
    /// Work of the drive and through the ports since the start [J]
    #[var(name = "energy.supplied", state, rate_depends = WORK)]
    pub supplied: S,
    /// Work through the ports since the start [J]
    #[var(name = "energy.port", state, rate_depends = WORK)]
    pub port: S,
}
