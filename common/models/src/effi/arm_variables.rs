//! Variables of the operator.

use model::{Enumeration, PlanarTensor, Variables, Vector2};

/// Where the intended motion comes from
#[derive(Debug, Clone, Copy, PartialEq, Eq, Enumeration)]
pub enum Intent {
    /// From one point to another with minimum jerk
    MinJerk = 1,
    /// From the inputs intent.r and intent.v
    Input = 2,
}

/// Parameters of the operator. Defaults: order of magnitude of published arms.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(parameter)]
pub struct Parameters {
    /// Mass of the hand [kg]
    #[var(name = "hand.mass", start = 1.5, above = 0.0)]
    pub m_a: f64,
    /// Stiffness between the hand and its intended position [N/m]
    #[var(name = "arm.stiffness", start = 300.0, min = 0.0)]
    pub k_a: f64,
    /// Damping between the hand and its intended velocity [N.s/m]
    #[var(name = "arm.damping", start = 15.0, min = 0.0)]
    pub b_a: f64,
    /// Stiffness between hand and handle [N/m]
    #[var(name = "grip.stiffness", start = 3000.0, min = 0.0, tunable)]
    pub k_g: f64,
    /// Damping between hand and handle [N.s/m]
    #[var(name = "grip.damping", start = 30.0, min = 0.0, tunable)]
    pub b_g: f64,
    /// Position of the hand at the start; that of the handle, if the grip is not stretched [m]
    #[var(name = "start.r", start = [0.0, 0.6])]
    pub start: Vector2<f64>,
    /// Velocity of the hand at the start [m/s]
    #[var(name = "start.v")]
    pub start_v: Vector2<f64>,
    /// Where the intention comes from
    #[var(name = "intent.kind", item = Intent::MinJerk)]
    pub kind: Intent,
    /// Intended position before the motion [m]
    #[var(name = "intent.start.r", start = [0.0, 0.6])]
    pub from: Vector2<f64>,
    /// Intended position after the motion [m]
    #[var(name = "intent.end.r", start = [0.0, 0.6])]
    pub to: Vector2<f64>,
    /// Time at which the intended motion begins [s]
    #[var(name = "intent.t0", start = 0.02)]
    pub t0: f64,
    /// Duration of the intended motion [s]
    #[var(name = "intent.duration", start = 0.35, above = 0.0)]
    pub duration: f64,
    /// Energy integrals
    #[var(name = "use.energy", start = true)]
    pub use_energy: bool,
}

/// Inputs of the operator.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(input)]
pub struct Inputs<S> {
    /// Position of the handle [m]
    #[var(name = "H.r", start = [0.0, 0.6])]
    pub r: Vector2<S>,
    /// Velocity of the handle [m/s]
    #[var(name = "H.v")]
    pub v: Vector2<S>,
    /// 1: the hand holds the handle; 0: it has let go
    #[var(name = "grip.enabled", discrete, switch, start = 1.0)]
    pub enabled: S,
    /// Intended position, with intent.kind = input [m]
    #[var(name = "intent.r", start = [0.0, 0.6])]
    pub r_int: Vector2<S>,
    /// Intended velocity, with intent.kind = input [m/s]
    #[var(name = "intent.v")]
    pub v_int: Vector2<S>,
    /// Force on the hand besides the arm's [N]
    #[var(name = "voluntary.F", nominal = 1e1)]
    pub F_vol: Vector2<S>,
}

/// The grip, by component.
const GRIP: &[&str] = &["H.r.@", "H.v.@", "hand.r.@", "hand.v.@", "grip.enabled"];
const HAND: &[&str] =
    &["H.r.@", "H.v.@", "hand.r.@", "hand.v.@", "grip.enabled", "intent.r.@", "intent.v.@", "voluntary.F.@"];

/// Motion of the hand.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Motion<S> {
    /// Position of the hand [m]
    #[var(name = "hand.r", state, rate_depends = [["hand.v.x"], ["hand.v.z"]])]
    pub r: Vector2<S>,
    /// Velocity of the hand [m/s]
    #[var(name = "hand.v", state, rate_depends = HAND)]
    pub v: Vector2<S>,
}

/// What the handle has to carry.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Inertia<S> {
    /// Force on the handle; the same as H.F [N]
    #[var(name = "H.F0", nominal = 1e1, depends = GRIP)]
    pub F0: Vector2<S>,
    /// Inertia behind port H: always zero [kg]
    #[var(name = "H.M")]
    pub M: PlanarTensor<S>,
}

/// The force.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Dynamics<S> {
    /// Force on the handle [N]
    #[var(name = "H.F", nominal = 1e1, depends = GRIP)]
    pub F: Vector2<S>,
}

/// Energies.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Energy<S> {
    /// Kinetic energy of the hand [J]
    #[var(name = "energy.kinetic", depends = ["hand.v"])]
    pub kinetic: S,
    /// Energy of grip and arm [J]
    #[var(name = "energy.potential", depends = ["hand.r", "H.r", "grip.enabled", "intent.r"])]
    pub potential: S,
    /// Energy turned into heat since the start [J]
    #[var(name = "energy.dissipated", state, rate_depends = ["hand.v", "H.v", "grip.enabled", "intent.v"])]
    pub dissipated: S,
    /// Work of intention, voluntary force and handle since the start [J]
    #[var(
        name = "energy.supplied",
        state,
        rate_depends = ["hand", "H.r", "H.v", "grip.enabled", "intent", "voluntary.F"]
    )]
    pub supplied: S,
    /// Work of the handle on the hand since the start [J]
    #[var(name = "energy.port", state, rate_depends = ["hand", "H.r", "H.v", "grip.enabled"])]
    pub port: S,
}
