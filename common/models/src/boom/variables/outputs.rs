//! Outputs of the boom, in groups that are computed together.

use model::{Variables, Vector3};

use super::indexed::{
    Accelerations, Angles, Count, Flows, Forces, GravityTorques, HoldingTorques, LoadTorques, OfArms,
    OfJoints, PointAccelerations, PointVelocities, Positions, Pressures, Slopes, Speeds, Strokes,
    Tangential1, Tangential2, Tangential3, Tangential4, Tangential5, Tangential6, Velocities,
};

/// The total flow couples every rate with every command.
const COMMANDS: &[&str] = &["joint"];
/// The load at the tip is F - M a.
const LOADED: &[&str] = &["TIP.F", "TIP.M", "joint"];
/// Slewing feels no vertical load.
const LOADED_ACROSS: &[&str] =
    &["TIP.F.x", "TIP.F.y", "TIP.M.xx", "TIP.M.xy", "TIP.M.xz", "TIP.M.yy", "TIP.M.yz", "joint"];
const LOADED_X: &[&str] = &["TIP.F.x", "TIP.M.xx", "TIP.M.xy", "TIP.M.xz", "joint"];
const LOADED_Y: &[&str] = &["TIP.F.y", "TIP.M.xy", "TIP.M.yy", "TIP.M.yz", "joint"];
/// A vertical load counts as a mass.
const LOADED_Z: &[&str] = &["TIP.F.z", "TIP.M.xz", "TIP.M.yz", "TIP.M.zz", "joint"];
/// The height of joint 2 does not change.
const NOTHING: &[&str] = &[];

/// Angles, rates, positions, flows: what follows from the pose and the limited rates.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Motion<S> {
    /// Gravity, from the machine file [m/s2]
    #[var(name = "gravity", calculated)]
    pub gravity: Vector3<S>,
    /// Angle of the joint [rad]
    #[var(name = "joint")]
    pub angle: Angles<S>,
    /// Rate of the joint after limitation [rad/s]
    #[var(name = "joint", nominal = 0.01, depends = COMMANDS)]
    pub velocity: Velocities<S>,
    /// Position of the tip [m]
    #[var(name = "TIP.r", nominal = 10.0)]
    pub TIP_r: Vector3<S>,
    /// Velocity of the tip [m/s]
    #[var(name = "TIP.v", depends = COMMANDS)]
    pub TIP_v: Vector3<S>,
    /// Position of a joint from the second on; 0 without use.frames [m]
    #[var(name = "K", nominal = 10.0)]
    pub K_r: Positions<S>,
    /// Velocity of a joint from the second on; 0 without use.frames [m/s]
    #[var(
        name = "K",
        depends = [
            COMMANDS, COMMANDS, NOTHING, COMMANDS, COMMANDS, COMMANDS, COMMANDS, COMMANDS, COMMANDS, COMMANDS,
            COMMANDS, COMMANDS, COMMANDS, COMMANDS, COMMANDS,
        ]
    )]
    pub K_v: PointVelocities<S>,
    /// Speed of the end of a link by joint 1 alone [m/s]
    #[var(name = "joint[1].tangential", depends = COMMANDS)]
    pub tangential_1: Tangential1<S>,
    /// Speed of the end of a link by joint 2 alone [m/s]
    #[var(name = "joint[2].tangential", depends = COMMANDS)]
    pub tangential_2: Tangential2<S>,
    /// Speed of the end of a link by joint 3 alone [m/s]
    #[var(name = "joint[3].tangential", depends = COMMANDS)]
    pub tangential_3: Tangential3<S>,
    /// Speed of the end of a link by joint 4 alone [m/s]
    #[var(name = "joint[4].tangential", depends = COMMANDS)]
    pub tangential_4: Tangential4<S>,
    /// Speed of the end of a link by joint 5 alone [m/s]
    #[var(name = "joint[5].tangential", depends = COMMANDS)]
    pub tangential_5: Tangential5<S>,
    /// Speed of the end of a link by joint 6 alone [m/s]
    #[var(name = "joint[6].tangential", depends = COMMANDS)]
    pub tangential_6: Tangential6<S>,
    /// Stroke; 0 without use.hydraulics [m]
    #[var(name = "cylinder")]
    pub stroke: Strokes<S>,
    /// Speed of the piston, positive extending; 0 without use.hydraulics [m/s]
    #[var(name = "cylinder", nominal = 0.01, depends = COMMANDS)]
    pub speed: Speeds<S>,
    /// Flow into the cylinder, on the side that grows; 0 without use.hydraulics [m3/s]
    #[var(name = "cylinder", nominal = 1e-3, depends = COMMANDS)]
    pub flow: Flows<S>,
    /// Stroke per angle; 0 without use.hydraulics [m/rad]
    #[var(name = "cylinder")]
    pub slope: Slopes<S>,
    /// Flow into the slew motor; 0 without use.hydraulics [m3/s]
    #[var(name = "slew.flow", nominal = 1e-3, depends = COMMANDS)]
    pub slew_flow: S,
    /// Flow of all actuators together; 0 without use.hydraulics [m3/s]
    #[var(name = "hydraulics.flow_total", nominal = 1e-3, depends = COMMANDS)]
    pub flow_total: S,
    /// Smallest distance from the limit of the tangential speed [m/s]
    #[var(name = "margin.w4", depends = COMMANDS)]
    pub w4: OfJoints<S>,
    /// Distance from the limit of the own flow [m3/s]
    #[var(name = "margin.w5", nominal = 1e-3, depends = COMMANDS)]
    pub w5: OfJoints<S>,
    /// Distance from the limit of the total flow [m3/s]
    #[var(name = "margin.w6", nominal = 1e-3, depends = COMMANDS)]
    pub w6: S,
    /// Stages of the limitation that act, added: 1 command not finite, 2 range of the joint, 4 rate, 8 tangential speed, 16 own flow, 32 total flow
    #[var(name = "limiter.stage", discrete, min = 0.0, max = 63.0)]
    pub stage: OfJoints<S>,
    /// Rate over command; 1 for the command 0
    #[var(name = "limiter.scale", depends = COMMANDS)]
    pub scale: OfJoints<S>,
    /// 1: a command is not finite
    #[var(name = "flag.bad_command", discrete, min = 0.0, max = 1.0)]
    pub bad_command: S,
    /// 1: the joint is at the end of its range
    #[var(name = "flag.at_limit", discrete, min = 0.0, max = 1.0)]
    pub at_limit: OfJoints<S>,
    /// Arrivals at the end of a joint's range since the start
    #[var(name = "solver.events", local)]
    pub events: Count<S>,
}

/// Centre of mass, distances, heights and tip-over angles.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Safety<S> {
    /// Centre of mass of the whole machine [m]
    #[var(name = "com.r", depends = LOADED_Z)]
    pub com: Vector3<S>,
    /// Mass of the whole machine [kg]
    #[var(name = "com.mass", nominal = 1e4, depends = LOADED_Z)]
    pub mass: S,
    /// Tip-over angle about an edge of the support; 1e9 without use.stability [rad]
    #[var(name = "stability.beta", depends = LOADED_Z)]
    pub beta: [S; 4],
    /// Smallest of these angles; 1e9 without use.stability [rad]
    #[var(name = "stability.beta_min", depends = LOADED_Z)]
    pub beta_min: S,
    /// Its edge: 1 left, 2 rear, 3 right, 4 front; 0 without use.stability
    #[var(name = "stability.edge", discrete, min = 0.0, max = 4.0)]
    pub edge: S,
    /// Distance of the arm from vehicle and outriggers, -1 in contact; 1e9 without use.collision [m]
    #[var(name = "distance.arm")]
    pub distance: OfArms<S>,
    /// Nearest box: 1 to 4 outriggers, 5 cab, 6 rear, 7 and above those of the machine file; 0 without use.collision
    #[var(name = "distance.nearest", discrete, min = 0.0, max = 32.0)]
    pub nearest: OfArms<S>,
    /// Distance of the arm above its threshold; 1e9 without use.collision [m]
    #[var(name = "margin.w1")]
    pub w1: OfArms<S>,
    /// Height of the end of a link above its threshold [m]
    #[var(name = "margin.w2")]
    pub w2: OfJoints<S>,
    /// Smallest tip-over angle above its threshold; 1e9 without use.stability [rad]
    #[var(name = "margin.w3", depends = LOADED_Z)]
    pub w3: S,
    /// 1: an arm touches vehicle or outriggers
    #[var(name = "flag.collision", discrete, min = 0.0, max = 1.0)]
    pub collision: S,
    /// 1: the machine tips over
    #[var(name = "flag.tip_over", discrete, min = 0.0, max = 1.0)]
    pub tip_over: S,
    /// 1: one of the margins w1, w2, w3 is negative
    #[var(name = "flag.below_threshold", discrete, min = 0.0, max = 1.0)]
    pub below_threshold: S,
    /// Pairs of boxes whose distance was computed for the present values
    #[var(name = "solver.distance_evaluations", local)]
    pub evaluations: Count<S>,
}

/// Accelerations, torques and forces.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Dynamics<S> {
    /// Second derivative of the angle; 0 without lag [rad/s2]
    #[var(name = "joint", nominal = 0.01, depends = COMMANDS)]
    pub acceleration: Accelerations<S>,
    /// Acceleration of the tip [m/s2]
    #[var(name = "TIP.a", depends = COMMANDS)]
    pub TIP_a: Vector3<S>,
    /// Acceleration of a joint from the second on; 0 without use.frames [m/s2]
    #[var(
        name = "K",
        depends = [
            COMMANDS, COMMANDS, NOTHING, COMMANDS, COMMANDS, COMMANDS, COMMANDS, COMMANDS, COMMANDS, COMMANDS,
            COMMANDS, COMMANDS, COMMANDS, COMMANDS, COMMANDS,
        ]
    )]
    pub K_a: PointAccelerations<S>,
    /// Force of the follower on the tip [N]
    #[var(name = "TIP.load", nominal = 1e3, depends = [LOADED_X, LOADED_Y, LOADED_Z])]
    pub TIP_load: Vector3<S>,
    /// Torque that the weight asks for; 0 without use.forces [N.m]
    #[var(name = "joint", nominal = 1e5)]
    pub gravity: GravityTorques<S>,
    /// Torque that the load at the tip asks for; 0 without use.forces [N.m]
    #[var(name = "joint", nominal = 1e5, depends = [LOADED_ACROSS, LOADED, LOADED, LOADED, LOADED, LOADED])]
    pub load: LoadTorques<S>,
    /// Torque of the drive; 0 without use.forces [N.m]
    #[var(name = "joint", nominal = 1e5, depends = [LOADED_ACROSS, LOADED, LOADED, LOADED, LOADED, LOADED])]
    pub holding: HoldingTorques<S>,
    /// Thrust of the cylinder; 0 without use.forces and use.hydraulics [N]
    #[var(name = "cylinder", nominal = 1e5, depends = LOADED)]
    pub force: Forces<S>,
    /// Pressure on the loaded side; 0 without use.forces and use.hydraulics [Pa]
    #[var(name = "cylinder", nominal = 1e7, depends = LOADED)]
    pub pressure: Pressures<S>,
}

/// Energies.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Energy<S> {
    /// Potential of all weights over the ground [J]
    #[var(name = "energy.potential", nominal = 1e6)]
    pub potential: S,
    /// Always 0: the machine moves as it is told, whatever its inertia [J]
    #[var(name = "energy.kinetic")]
    pub kinetic: S,
    /// Work of drives and port since the start; 0 without use.energy [J]
    #[var(name = "energy.supplied", nominal = 1e5)]
    pub supplied: S,
    /// Always 0 [J]
    #[var(name = "energy.dissipated")]
    pub dissipated: S,
    /// Work through the port TIP since the start; 0 without use.energy [J]
    #[var(name = "energy.port", nominal = 1e5)]
    pub port: S,
}
