//! Parameters of the double wishbone. Defaults: the reference case `wishbone_paper`.

use mechanics::Baumgarte;
use model::{Enumeration, SymmetricTensor, Variables, Vector3};

use crate::force_law::LoadParameters;

/// Motion of the scene
#[derive(Debug, Clone, Copy, PartialEq, Eq, Enumeration)]
pub enum SceneMotion {
    /// In the plane x-z, one degree of freedom
    Planar = 1,
    /// In space
    Spatial = 2,
}

/// Joint of both arms at the chassis in spatial motion
#[derive(Debug, Clone, Copy, PartialEq, Eq, Enumeration)]
pub enum ArmJoint {
    /// Hinge about the horizontal axis across the arm
    Revolute = 1,
    /// The paper's universal joint, referred to the world
    Universal = 2,
}

/// Joint of the carrier at B in spatial motion
#[derive(Debug, Clone, Copy, PartialEq, Eq, Enumeration)]
pub enum CarrierJoint {
    /// Ball joint, quaternion coordinates
    Spherical = 1,
    /// The paper's universal joint, referred to the world
    Universal = 2,
}

/// Where the load at P comes from
#[derive(Debug, Clone, Copy, PartialEq, Eq, Enumeration)]
pub enum ForceKind {
    /// Only the port's slots
    Input = 1,
    /// Adds the load law force.* at P
    Internal = 2,
}

/// Meaning of the strut's preload
#[derive(Debug, Clone, Copy, PartialEq, Eq, Enumeration)]
pub enum PreloadMode {
    /// The value of strut.preload
    Given = 1,
    /// Calculated so that the design position is an equilibrium under gravity and `static_load`
    Static = 2,
}

/// How the loop is closed at the upper chassis joint
#[derive(Debug, Clone, Copy, PartialEq, Eq, Enumeration)]
pub enum ClosureKind {
    /// Exactly, by one small solve per solver stage
    Rigid = 1,
    /// By a stiff elastic bushing at D
    Bushing = 2,
}

/// How drift of the closed loop is held
#[derive(Debug, Clone, Copy, PartialEq, Eq, Enumeration)]
pub enum StabilisationKind {
    /// Not at all: the gap grows with t
    None = 1,
    /// Terms of gap and gap rate in the closure (19)
    Baumgarte = 2,
    /// Projection of positions and velocities after every step (20)
    Projection = 3,
}

/// Stabilisation of the closed loop.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(parameter)]
pub struct StabilisationParameters {
    /// How drift of the closed loop is held
    #[var(name = "kind", item = StabilisationKind::Projection)]
    pub kind: StabilisationKind,
    /// Baumgarte constant a; choose a times the inner step below 1 [1/s]
    #[var(name = "a", start = 20.0, min = 0.0)]
    pub a: f64,
    /// Baumgarte constant b [1/s]
    #[var(name = "b", start = 20.0, min = 0.0)]
    pub b: f64,
}

impl StabilisationParameters {
    /// The terms of (19).
    pub(super) fn terms(&self) -> Baumgarte {
        Baumgarte { a: self.a, b: self.b }
    }
}

/// Parameters of the double wishbone.
#[allow(clippy::struct_excessive_bools, reason = "each leaves out a part of its own")]
#[derive(Debug, Clone, PartialEq, Variables)]
#[variables(parameter)]
pub struct Parameters {
    /// Lower chassis joint in the design position [m]
    #[var(name = "design.A", start = [0.0, 0.0, 0.0])]
    pub A: Vector3<f64>,
    /// Joint lower link - carrier in the design position [m]
    #[var(name = "design.B", start = [0.40, 0.0, -0.02])]
    pub B: Vector3<f64>,
    /// Joint carrier - upper link in the design position [m]
    #[var(name = "design.C", start = [0.36, 0.0, 0.27])]
    pub C: Vector3<f64>,
    /// Upper chassis joint in the design position [m]
    #[var(name = "design.D", start = [0.08, 0.0, 0.25])]
    pub D: Vector3<f64>,
    /// Centre of mass of carrier and wheel in the design position [m]
    #[var(name = "design.G", start = [0.48, 0.0, 0.12])]
    pub G: Vector3<f64>,
    /// Force point on the carrier in the design position [m]
    #[var(name = "design.P", start = [0.50, 0.0, 0.12])]
    pub P: Vector3<f64>,
    /// Strut top on the chassis [m]
    #[var(name = "design.T", start = [0.22, 0.0, 0.62])]
    pub T: Vector3<f64>,
    /// Tie rod end on the carrier in the design position; only with use.tie [m]
    #[var(name = "design.tie.R", start = [0.38, -0.12, 0.05])]
    pub tie_R: Vector3<f64>,
    /// Tie rod end on the chassis; only with use.tie [m]
    #[var(name = "design.tie.T", start = [0.05, -0.12, 0.05])]
    pub tie_T: Vector3<f64>,

    /// Mass of the lower link, a uniform rod [kg]
    #[var(name = "lower.mass", start = 4.0, above = 0.0)]
    pub lower_mass: f64,
    /// Inertia of the lower link about its own axis [kg.m2]
    #[var(name = "lower.inertia.xx", start = 2e-3, above = 0.0)]
    pub lower_Ixx: f64,
    /// Mass of the upper link, a uniform rod [kg]
    #[var(name = "upper.mass", start = 2.5, above = 0.0)]
    pub upper_mass: f64,
    /// Inertia of the upper link about its own axis [kg.m2]
    #[var(name = "upper.inertia.xx", start = 1e-3, above = 0.0)]
    pub upper_Ixx: f64,
    /// Mass of carrier and wheel [kg]
    #[var(name = "carrier.mass", start = 25.0, above = 0.0)]
    pub carrier_mass: f64,
    /// Inertia of carrier and wheel about G; plane motion uses yy only [kg.m2]
    #[var(name = "carrier.inertia", start = [1.2, 0.0, 0.0, 0.8, 0.0, 0.8])]
    pub carrier_inertia: SymmetricTensor<f64>,

    /// Keep the start values of lower.angle.theta and its rate and calculate the other states
    #[var(name = "start.override", start = false)]
    pub start_override: bool,

    /// Distance from D to the strut's foot S on the upper link [m]
    #[var(name = "strut.s1", start = 0.14, above = 0.0)]
    pub s1: f64,
    /// Spring rate of the strut [N/m]
    #[var(name = "strut.k", start = 22000.0, min = 0.0, tunable)]
    pub strut_k: f64,
    /// Damping of the strut [N.s/m]
    #[var(name = "strut.c", start = 1000.0, min = 0.0, tunable)]
    pub strut_c: f64,
    /// Free length of the strut; 0: its length in the design position [m]
    #[var(name = "strut.l0", start = 0.0, min = 0.0)]
    pub strut_l0: f64,
    /// Preload of the strut, positive pushes its ends apart; only with strut.preload_mode given [N]
    #[var(name = "strut.preload", start = 0.0, tunable)]
    pub preload: f64,
    /// Meaning of the preload
    #[var(name = "strut.preload_mode", item = PreloadMode::Given)]
    pub preload_mode: PreloadMode,
    /// Load at P for which the static preload holds the design position [N]
    #[var(name = "static_load", start = 0.0)]
    pub static_load: Vector3<f64>,

    /// Source of the load at P
    #[var(name = "force.kind", item = ForceKind::Internal)]
    pub force_kind: ForceKind,
    #[var(prefix = "force.")]
    #[allow(missing_docs, reason = "a group")]
    pub force: LoadParameters,

    /// Gravity [m/s2]
    #[var(name = "gravity", start = 0.0, tunable)]
    pub gravity: Vector3<f64>,

    /// Motion of the scene
    #[var(name = "scene.motion", item = SceneMotion::Planar)]
    pub motion: SceneMotion,
    /// Joint of both arms at the chassis; only in spatial motion
    #[var(name = "arm.joint", item = ArmJoint::Revolute)]
    pub arm_joint: ArmJoint,
    /// Joint of the carrier at B; only in spatial motion
    #[var(name = "carrier.joint", item = CarrierJoint::Spherical)]
    pub carrier_joint: CarrierJoint,

    /// Stiffness of the tie rod; only with use.tie [N/m]
    #[var(name = "tie.k", start = 3e5, min = 0.0, tunable)]
    pub tie_k: f64,
    /// Damping of the tie rod; only with use.tie [N.s/m]
    #[var(name = "tie.c", start = 300.0, min = 0.0, tunable)]
    pub tie_c: f64,

    /// How the loop is closed at D
    #[var(name = "closure.kind", item = ClosureKind::Rigid)]
    pub closure: ClosureKind,
    /// Stiffness of the bushing; only with closure.kind bushing [N/m]
    #[var(name = "closure.k", start = 1e8, min = 0.0)]
    pub closure_k: f64,
    /// Damping of the bushing; only with closure.kind bushing [N.s/m]
    #[var(name = "closure.c", start = 1e4, min = 0.0)]
    pub closure_c: f64,

    #[var(prefix = "stabilisation.")]
    #[allow(missing_docs, reason = "a group")]
    pub stabilisation: StabilisationParameters,

    /// Tie rod between carrier and chassis
    #[var(name = "use.tie", start = false)]
    pub use_tie: bool,
    /// Damper of the strut
    #[var(name = "use.damper", start = true)]
    pub use_damper: bool,
    /// Weight of all bodies
    #[var(name = "use.gravity", start = true)]
    pub use_gravity: bool,
    /// Energy integrals
    #[var(name = "use.energy", start = true)]
    pub use_energy: bool,
}
