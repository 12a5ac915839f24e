//! Inputs and outputs of the double wishbone.

use model::{Variables, Vector3};

use crate::port::Slot;

/// Start value of `lower.angle.theta`: the design position of the defaults [rad]
pub(super) const THETA_1: f64 = -0.049_958_395_721_942_76;

// What depends on what: inputs and states by name or prefix, united over all joint kinds. Planar motion
// knows no y and uses carrier.angle.psi; space uses the other carrier coordinates.

/// All coordinates.
const COORDINATES: &[&str] = &["lower.angle", "upper.angle", "carrier.angle", "carrier.q"];
/// Coordinates and inertias.
const MOBILITY: &[&str] = &["lower.angle", "upper.angle", "carrier.angle", "carrier.q", "P.M", "P.slot[2].M"];
/// All coordinates and rates.
const STATES: &[&str] = &["lower", "upper", "carrier"];
/// The same, in space only.
const STATES_IN_SPACE: &[&str] = &[
    "lower",
    "upper",
    "carrier.angle.phi",
    "carrier.angle.theta",
    "carrier.angle_rate.phi",
    "carrier.angle_rate.theta",
    "carrier.q",
    "carrier.omega",
];
/// All loads, coordinates and rates.
const ALL: &[&str] = &["P.F", "P.M", "P.slot[2]", "chassis.a", "lower", "upper", "carrier"];
/// The same, in space only.
const ALL_IN_SPACE: &[&str] = &[
    "P.F",
    "P.M",
    "P.slot[2]",
    "chassis.a",
    "lower",
    "upper",
    "carrier.angle.phi",
    "carrier.angle.theta",
    "carrier.angle_rate.phi",
    "carrier.angle_rate.theta",
    "carrier.q",
    "carrier.omega",
];
/// The same, in plane motion only.
const ALL_IN_PLANE: &[&str] = &[
    "P.F.x",
    "P.F.z",
    "P.M.xx",
    "P.M.xz",
    "P.M.zz",
    "P.slot[2].F.x",
    "P.slot[2].F.z",
    "P.slot[2].M.xx",
    "P.slot[2].M.xz",
    "P.slot[2].M.zz",
    "chassis.a.x",
    "chassis.a.z",
    "lower.angle.theta",
    "lower.angle_rate.theta",
    "upper.angle.theta",
    "upper.angle_rate.theta",
    "carrier.angle.psi",
    "carrier.angle_rate.psi",
];
/// The same with a universal joint of the carrier.
const ALL_UNIVERSAL: &[&str] = &[
    "P.F",
    "P.M",
    "P.slot[2]",
    "chassis.a",
    "lower",
    "upper",
    "carrier.angle.phi",
    "carrier.angle.theta",
    "carrier.angle_rate.phi",
    "carrier.angle_rate.theta",
];
/// The same with a spherical joint of the carrier.
const ALL_SPHERICAL: &[&str] =
    &["P.F", "P.M", "P.slot[2]", "chassis.a", "lower", "upper", "carrier.q", "carrier.omega"];
/// Position of a point on the carrier, by component.
const CARRIER_R_X: &[&str] = &["lower.angle", "carrier.angle", "carrier.q"];
const CARRIER_R_Y: &[&str] = &["lower.angle", "carrier.angle.phi", "carrier.angle.theta", "carrier.q"];
const CARRIER_R_Z: &[&str] = &["lower.angle.theta", "carrier.angle.psi", "carrier.angle.theta", "carrier.q"];
/// Velocity of a point on the carrier, by component.
const CARRIER_V_X: &[&str] =
    &["lower", "carrier.angle", "carrier.angle_rate", "carrier.q", "carrier.omega.y", "carrier.omega.z"];
const CARRIER_V_Y: &[&str] = &[
    "lower",
    "carrier.angle.phi",
    "carrier.angle.theta",
    "carrier.angle_rate.phi",
    "carrier.angle_rate.theta",
    "carrier.q",
    "carrier.omega.x",
    "carrier.omega.z",
];
const CARRIER_V_Z: &[&str] = &[
    "lower.angle.theta",
    "lower.angle_rate.theta",
    "carrier.angle.psi",
    "carrier.angle.theta",
    "carrier.angle_rate.psi",
    "carrier.angle_rate.theta",
    "carrier.q",
    "carrier.omega.x",
    "carrier.omega.y",
];
/// Height and vertical velocity of the tip of the lower link.
const LOWER_Z: &[&str] = &["lower.angle.theta", "lower.angle_rate.theta"];

/// Inputs.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(input)]
pub struct Inputs<S> {
    #[var(prefix = "P.")]
    #[allow(missing_docs, reason = "first slot of port P")]
    pub P: Slot<S>,
    #[var(prefix = "P.slot[2].")]
    #[allow(missing_docs, reason = "second slot of port P")]
    pub P_2: Slot<S>,
    /// Acceleration of the chassis; positions, velocities and accelerations are relative to it [m/s2]
    #[var(name = "chassis.a")]
    pub chassis_a: Vector3<S>,
}

/// Angles of a link; theta > 0 lifts the tip.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
pub struct LinkAngles<S> {
    /// Elevation of the link, joint to tip [rad]
    #[var(name = "angle.theta", state, rate_depends = ["upper.angle_rate.theta"])]
    pub theta: S,
    /// Azimuth of the link [rad]
    #[var(name = "angle.phi", state, rate_depends = ["upper.angle_rate.phi"])]
    pub phi: S,
    /// Rate of the elevation [rad/s]
    #[var(name = "angle_rate.theta", state, rate_depends = ALL)]
    pub theta_dot: S,
    /// Rate of the azimuth [rad/s]
    #[var(name = "angle_rate.phi", state, rate_depends = ALL_IN_SPACE)]
    pub phi_dot: S,
}

/// Orientation of the carrier; coordinates of joint kinds not in use keep their start values.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
pub struct CarrierOrientation<S> {
    /// Rotation of the carrier from the design position about -y, plane motion [rad]
    #[var(name = "angle.psi", state, rate_depends = ["carrier.angle_rate.psi"])]
    pub psi: S,
    /// Azimuth of the carrier, universal joint [rad]
    #[var(name = "angle.phi", state, rate_depends = ["carrier.angle_rate.phi"])]
    pub phi: S,
    /// Elevation of the carrier, universal joint [rad]
    #[var(name = "angle.theta", state, rate_depends = ["carrier.angle_rate.theta"])]
    pub theta: S,
    /// Rate of psi [rad/s]
    #[var(name = "angle_rate.psi", state, rate_depends = ALL_IN_PLANE)]
    pub psi_dot: S,
    /// Rate of phi [rad/s]
    #[var(name = "angle_rate.phi", state, rate_depends = ALL_UNIVERSAL)]
    pub phi_dot: S,
    /// Rate of theta [rad/s]
    #[var(name = "angle_rate.theta", state, rate_depends = ALL_UNIVERSAL)]
    pub theta_dot: S,
    /// Orientation of the carrier, unit quaternion body to world (w, x, y, z), spherical joint
    #[var(name = "q", state, rate_depends = [["carrier.q[2]", "carrier.q[3]", "carrier.q[4]", "carrier.omega"], ["carrier.q[1]", "carrier.q[3]", "carrier.q[4]", "carrier.omega"], ["carrier.q[1]", "carrier.q[2]", "carrier.q[4]", "carrier.omega"], ["carrier.q[1]", "carrier.q[2]", "carrier.q[3]", "carrier.omega"]], start = [1.0, 0.0, 0.0, 0.0])]
    pub q: [S; 4],
    /// Angular velocity of the carrier in the world frame, spherical joint [rad/s]
    #[var(name = "omega", state, rate_depends = ALL_SPHERICAL)]
    pub omega: Vector3<S>,
}

/// Positions, velocities, states.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Motion<S> {
    /// Elevation of the lower link, A to B; a start value counts with start.override only [rad]
    #[var(name = "lower.angle.theta", state, rate_depends = ["lower.angle_rate.theta"], approx, start = THETA_1)]
    pub lower_theta: S,
    /// Azimuth of the lower link [rad]
    #[var(name = "lower.angle.phi", state, rate_depends = ["lower.angle_rate.phi"])]
    pub lower_phi: S,
    /// Rate of the elevation of the lower link; a start value counts with start.override only [rad/s]
    #[var(name = "lower.angle_rate.theta", state, rate_depends = ALL, approx)]
    pub lower_theta_dot: S,
    /// Rate of the azimuth of the lower link [rad/s]
    #[var(name = "lower.angle_rate.phi", state, rate_depends = ALL_IN_SPACE)]
    pub lower_phi_dot: S,
    #[var(prefix = "upper.")]
    #[allow(missing_docs, reason = "a group: D to C")]
    pub upper: LinkAngles<S>,
    #[var(prefix = "carrier.")]
    #[allow(missing_docs, reason = "a group")]
    pub carrier: CarrierOrientation<S>,
    /// Position of the force point P [m]
    #[var(name = "P.r", depends = [CARRIER_R_X, CARRIER_R_Y, CARRIER_R_Z])]
    pub P_r: Vector3<S>,
    /// Velocity of the force point P [m/s]
    #[var(name = "P.v", depends = [CARRIER_V_X, CARRIER_V_Y, CARRIER_V_Z])]
    pub P_v: Vector3<S>,
    /// Position of the joint lower link - carrier [m]
    #[var(name = "B.r", depends = [["lower.angle"], ["lower.angle"], ["lower.angle.theta"]])]
    pub B_r: Vector3<S>,
    /// Velocity of the joint lower link - carrier [m/s]
    #[var(name = "B.v", depends = [["lower"], ["lower"], LOWER_Z])]
    pub B_v: Vector3<S>,
    /// Position of the joint carrier - upper link, on the carrier [m]
    #[var(name = "C.r", depends = [CARRIER_R_X, CARRIER_R_Y, CARRIER_R_Z])]
    pub C_r: Vector3<S>,
    /// Velocity of the joint carrier - upper link, on the carrier [m/s]
    #[var(name = "C.v", depends = [CARRIER_V_X, CARRIER_V_Y, CARRIER_V_Z])]
    pub C_v: Vector3<S>,
    /// Length of the strut [m]
    #[var(name = "strut.length", depends = COORDINATES)]
    pub strut_length: S,
    /// Rate of the strut's length [m/s]
    #[var(name = "strut.rate", depends = STATES)]
    pub strut_rate: S,
    /// Tension of the strut (16) [N]
    #[var(name = "strut.force", nominal = 1e3, depends = STATES)]
    pub strut_force: S,
    /// Distance of the two sides of the closed joint [m]
    #[var(name = "loop.gap", nominal = 1e-6, depends = COORDINATES)]
    pub gap: S,
    /// Relative speed of the two sides of the closed joint [m/s]
    #[var(name = "loop.gap_rate", nominal = 1e-6, depends = STATES)]
    pub gap_rate: S,
}

/// Accelerations and forces.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Dynamics<S> {
    /// Acceleration of the force point P [m/s2]
    #[var(name = "P.a", depends = [ALL, ALL_IN_SPACE, ALL])]
    pub P_a: Vector3<S>,
    /// Acceleration of the joint lower link - carrier [m/s2]
    #[var(name = "B.a", depends = [ALL, ALL_IN_SPACE, ALL])]
    pub B_a: Vector3<S>,
    /// Acceleration of the joint carrier - upper link [m/s2]
    #[var(name = "C.a", depends = [ALL, ALL_IN_SPACE, ALL])]
    pub C_a: Vector3<S>,
    /// Force on the chassis by the lower link [N]
    #[var(name = "A.F", nominal = 1e2, depends = [ALL, ALL_IN_SPACE, ALL])]
    pub A_F: Vector3<S>,
    /// Force on the chassis by the upper link [N]
    #[var(name = "D.F", nominal = 1e2, depends = [ALL, ALL_IN_SPACE, ALL])]
    pub D_F: Vector3<S>,
    /// Force on the chassis by the strut [N]
    #[var(name = "T.F", nominal = 1e2, depends = [STATES, STATES_IN_SPACE, STATES])]
    pub T_F: Vector3<S>,
    /// Force on the lower link by the carrier [N]
    #[var(name = "B.F", nominal = 1e2, depends = [ALL, ALL_IN_SPACE, ALL])]
    pub B_F: Vector3<S>,
    /// Force on the carrier by the upper link [N]
    #[var(name = "C.F", nominal = 1e2, depends = [ALL, ALL_IN_SPACE, ALL])]
    pub C_F: Vector3<S>,
    /// Condition of the loop closure (18), largest over smallest kept eigenvalue; 1 with a bushing
    #[var(name = "loop.condition", depends = MOBILITY)]
    pub condition: S,
    /// Directions in which the closed joint carries a force; 0 with a bushing
    #[var(name = "loop.rank", local, discrete)]
    pub rank: S,
}

/// Energies (21), (22): kinetic + potential - (the same at start) = supplied - dissipated.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Energy<S> {
    /// Kinetic energy, relative to the chassis [J]
    #[var(name = "energy.kinetic", depends = STATES)]
    pub kinetic: S,
    /// Potential energy of gravity and springs [J]
    #[var(name = "energy.potential", depends = COORDINATES)]
    pub potential: S,
    /// Energy turned into heat by dampers since the start [J]
    #[var(name = "energy.dissipated", state, rate_depends = STATES)]
    pub dissipated: S,
    /// Work of all loads on the system since the start, port included [J]
    #[var(name = "energy.supplied", state, rate_depends = ALL)]
    pub supplied: S,
    /// Work through port P since the start [J]
    #[var(name = "energy.port", state, rate_depends = ALL)]
    pub port: S,
}

/// What the work on an element depends on.
const WORK: &[&str] = &[
    "A.a",
    "A.v",
    "B.a",
    "B.v",
    "B.F",
    "B.M",
    "C.F",
    "C.M",
    "P.F",
    "P.M",
    "P.slot[2]",
    "drive.torque",
    "angle",
    "angle_rate",
    "direction",
    "orientation.q",
    "omega",
];

/// Energies of an element on a moving root; the root port is A (`link2`) or B (`link3`).
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct ElementEnergy<S> {
    /// Kinetic energy [J]
    #[var(name = "energy.kinetic", depends = ["A.v", "B.v", "angle", "angle_rate", "direction", "orientation.q", "omega"])]
    pub kinetic: S,
    /// Potential energy of gravity [J]
    #[var(name = "energy.potential", depends = ["A.r", "B.r", "angle", "direction", "orientation.q"])]
    pub potential: S,
    /// Energy turned into heat since the start: none [J]
    #[var(name = "energy.dissipated", state)]
    pub dissipated: S,
    /// Work of all loads, of the root and of the drive on the element since the start [J]
    #[var(name = "energy.supplied", state, rate_depends = WORK)]
    pub supplied: S,
    /// Work through the ports since the start [J]
    #[var(name = "energy.port", state, rate_depends = WORK)]
    pub port: S,
}
