//! Inputs and outputs of the double wishbone.

use model::{SymmetricTensor, Variables, Vector3};

/// Start value of `lower.angle.theta`: the design position of the defaults [rad]
pub(super) const THETA_1: f64 = -0.049_958_395_721_942_76;

/// A slot of a leader port: the load `F - M a` acts on the leader.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
pub struct Slot<S> {
    /// Force on the leader at rest [N]
    #[var(name = "F")]
    pub F: Vector3<S>,
    /// Inertia behind the port [kg]
    #[var(name = "M")]
    pub M: SymmetricTensor<S>,
}

/// A follower port's motion: given by the leader.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(input)]
pub struct Root<S> {
    /// Position of the root port [m]
    #[var(name = "r")]
    pub r: Vector3<S>,
    /// Velocity of the root port [m/s]
    #[var(name = "v")]
    pub v: Vector3<S>,
    /// Acceleration of the root port [m/s2]
    #[var(name = "a")]
    pub a: Vector3<S>,
}

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
    #[var(name = "angle.theta")]
    pub theta: S,
    /// Azimuth of the link [rad]
    #[var(name = "angle.phi")]
    pub phi: S,
    /// Rate of the elevation [rad/s]
    #[var(name = "angle_rate.theta")]
    pub theta_dot: S,
    /// Rate of the azimuth [rad/s]
    #[var(name = "angle_rate.phi")]
    pub phi_dot: S,
}

/// Orientation of the carrier; coordinates of joint kinds not in use keep their start values.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
pub struct CarrierOrientation<S> {
    /// Rotation of the carrier from the design position about -y, plane motion [rad]
    #[var(name = "angle.psi")]
    pub psi: S,
    /// Azimuth of the carrier, universal joint [rad]
    #[var(name = "angle.phi")]
    pub phi: S,
    /// Elevation of the carrier, universal joint [rad]
    #[var(name = "angle.theta")]
    pub theta: S,
    /// Rate of psi [rad/s]
    #[var(name = "angle_rate.psi")]
    pub psi_dot: S,
    /// Rate of phi [rad/s]
    #[var(name = "angle_rate.phi")]
    pub phi_dot: S,
    /// Rate of theta [rad/s]
    #[var(name = "angle_rate.theta")]
    pub theta_dot: S,
    /// Orientation of the carrier, unit quaternion body to world (w, x, y, z), spherical joint
    #[var(name = "q", start = [1.0, 0.0, 0.0, 0.0])]
    pub q: [S; 4],
    /// Angular velocity of the carrier in the world frame, spherical joint [rad/s]
    #[var(name = "omega")]
    pub omega: Vector3<S>,
}

/// Positions, velocities, states.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Motion<S> {
    /// Elevation of the lower link, A to B; a start value counts with start.override only [rad]
    #[var(name = "lower.angle.theta", approx, start = THETA_1)]
    pub lower_theta: S,
    /// Azimuth of the lower link [rad]
    #[var(name = "lower.angle.phi")]
    pub lower_phi: S,
    /// Rate of the elevation of the lower link; a start value counts with start.override only [rad/s]
    #[var(name = "lower.angle_rate.theta", approx)]
    pub lower_theta_dot: S,
    /// Rate of the azimuth of the lower link [rad/s]
    #[var(name = "lower.angle_rate.phi")]
    pub lower_phi_dot: S,
    #[var(prefix = "upper.")]
    #[allow(missing_docs, reason = "a group: D to C")]
    pub upper: LinkAngles<S>,
    #[var(prefix = "carrier.")]
    #[allow(missing_docs, reason = "a group")]
    pub carrier: CarrierOrientation<S>,
    /// Position of the force point P [m]
    #[var(name = "P.r")]
    pub P_r: Vector3<S>,
    /// Velocity of the force point P [m/s]
    #[var(name = "P.v")]
    pub P_v: Vector3<S>,
    /// Position of the joint lower link - carrier [m]
    #[var(name = "B.r")]
    pub B_r: Vector3<S>,
    /// Velocity of the joint lower link - carrier [m/s]
    #[var(name = "B.v")]
    pub B_v: Vector3<S>,
    /// Position of the joint carrier - upper link, on the carrier [m]
    #[var(name = "C.r")]
    pub C_r: Vector3<S>,
    /// Velocity of the joint carrier - upper link, on the carrier [m/s]
    #[var(name = "C.v")]
    pub C_v: Vector3<S>,
    /// Length of the strut [m]
    #[var(name = "strut.length")]
    pub strut_length: S,
    /// Rate of the strut's length [m/s]
    #[var(name = "strut.rate")]
    pub strut_rate: S,
    /// Tension of the strut (16) [N]
    #[var(name = "strut.force", nominal = 1e3)]
    pub strut_force: S,
    /// Distance of the two sides of the closed joint [m]
    #[var(name = "loop.gap", nominal = 1e-6)]
    pub gap: S,
    /// Relative speed of the two sides of the closed joint [m/s]
    #[var(name = "loop.gap_rate", nominal = 1e-6)]
    pub gap_rate: S,
}

/// Accelerations and forces.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Dynamics<S> {
    /// Acceleration of the force point P [m/s2]
    #[var(name = "P.a", depends = ["P.F", "P.M", "P.slot[2].F", "P.slot[2].M", "chassis.a"])]
    pub P_a: Vector3<S>,
    /// Acceleration of the joint lower link - carrier [m/s2]
    #[var(name = "B.a", depends = ["P.F", "P.M", "P.slot[2].F", "P.slot[2].M", "chassis.a"])]
    pub B_a: Vector3<S>,
    /// Acceleration of the joint carrier - upper link [m/s2]
    #[var(name = "C.a", depends = ["P.F", "P.M", "P.slot[2].F", "P.slot[2].M", "chassis.a"])]
    pub C_a: Vector3<S>,
    /// Force on the chassis by the lower link [N]
    #[var(name = "A.F", nominal = 1e2, depends = ["P.F", "P.M", "P.slot[2].F", "P.slot[2].M", "chassis.a"])]
    pub A_F: Vector3<S>,
    /// Force on the chassis by the upper link [N]
    #[var(name = "D.F", nominal = 1e2, depends = ["P.F", "P.M", "P.slot[2].F", "P.slot[2].M", "chassis.a"])]
    pub D_F: Vector3<S>,
    /// Force on the chassis by the strut [N]
    #[var(name = "T.F", nominal = 1e2)]
    pub T_F: Vector3<S>,
    /// Force on the lower link by the carrier [N]
    #[var(name = "B.F", nominal = 1e2, depends = ["P.F", "P.M", "P.slot[2].F", "P.slot[2].M", "chassis.a"])]
    pub B_F: Vector3<S>,
    /// Force on the carrier by the upper link [N]
    #[var(name = "C.F", nominal = 1e2, depends = ["P.F", "P.M", "P.slot[2].F", "P.slot[2].M", "chassis.a"])]
    pub C_F: Vector3<S>,
    /// Condition of the loop closure (18), largest over smallest kept eigenvalue; 1 with a bushing
    #[var(name = "loop.condition", depends = ["P.M", "P.slot[2].M"])]
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
    #[var(name = "energy.kinetic")]
    pub kinetic: S,
    /// Potential energy of gravity and springs [J]
    #[var(name = "energy.potential")]
    pub potential: S,
    /// Energy turned into heat by dampers since the start [J]
    #[var(name = "energy.dissipated")]
    pub dissipated: S,
    /// Work of all loads on the system since the start, port included [J]
    #[var(name = "energy.supplied")]
    pub supplied: S,
    /// Work through port P since the start [J]
    #[var(name = "energy.port")]
    pub port: S,
}

/// Energies of an element on a moving root; the root port is A, B or D.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct ElementEnergy<S> {
    /// Kinetic energy [J]
    #[var(name = "energy.kinetic", depends = ["A.v", "B.v", "D.v"])]
    pub kinetic: S,
    /// Potential energy of gravity and spring [J]
    #[var(name = "energy.potential", depends = ["A.r", "B.r", "D.r", "T.r"])]
    pub potential: S,
    /// Energy turned into heat by the damper since the start [J]
    #[var(name = "energy.dissipated")]
    pub dissipated: S,
    /// Work of all loads, of the root and of the drive on the element since the start [J]
    #[var(name = "energy.supplied")]
    pub supplied: S,
    /// Work through the ports since the start [J]
    #[var(name = "energy.port")]
    pub port: S,
}
