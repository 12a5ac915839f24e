//! Variables of the virtual mechanism.

use model::{Enumeration, Variables, Vector2, Vector3};

use crate::port::PlanarSlot;

/// What the hand moves
#[derive(Debug, Clone, Copy, PartialEq, Eq, Enumeration)]
pub enum Kind {
    /// The coupler of a four-bar: flap, folding bed
    Fourbar = 1,
    /// A drawer or guided tool
    Drawer = 2,
}

/// Stops of a coordinate.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(parameter)]
pub struct AngleStops {
    /// Lower stop [rad]
    #[var(name = "lo", start = -0.9)]
    pub lo: f64,
    /// Upper stop [rad]
    #[var(name = "hi", start = 0.8)]
    pub hi: f64,
    /// Stiffness of the stops [N.m/rad]
    #[var(name = "stiffness", start = 2000.0, min = 0.0)]
    pub k: f64,
    /// Damping of the stops, relative to the elastic moment [s/rad]
    #[var(name = "damping", start = 1.0, min = 0.0)]
    pub chi: f64,
}

/// The four-bar. Defaults: a cabinet flap on crossed hinges.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(parameter)]
pub struct FourbarParameters {
    /// Ground joint of the crank [m]
    #[var(name = "O1")]
    pub O_1: Vector2<f64>,
    /// Ground joint of the rocker [m]
    #[var(name = "O2", start = [0.0, 0.1])]
    pub O_2: Vector2<f64>,
    /// Length of the crank [m]
    #[var(name = "crank.length", start = 0.25, above = 0.0)]
    pub a: f64,
    /// Length of the coupler between its joints [m]
    #[var(name = "coupler.length", start = 0.12, above = 0.0)]
    pub b: f64,
    /// Length of the rocker [m]
    #[var(name = "rocker.length", start = 0.25, above = 0.0)]
    pub c: f64,
    /// Way in which the loop is closed: -1 or 1
    #[var(name = "branch", start = 1.0, min = -1.0, max = 1.0)]
    pub branch: i32,
    /// Where the hand holds the coupler, in its frame [m]
    #[var(name = "hand", start = [0.05, -0.35])]
    pub hand: Vector2<f64>,
    /// Centre of mass of the coupler, in its frame [m]
    #[var(name = "com", start = [0.05, -0.15])]
    pub com: Vector2<f64>,
    /// Mass of the coupler [kg]
    #[var(name = "mass", start = 4.0, min = 0.0)]
    pub m: f64,
    /// Moment of inertia of the coupler about its centre of mass [kg.m2]
    #[var(name = "inertia", start = 0.12, min = 0.0)]
    pub I: f64,
    /// Moment of inertia of the crank about O1 [kg.m2]
    #[var(name = "crank.inertia", start = 0.02, above = 0.0)]
    pub I_1: f64,
    /// Moment of inertia of the rocker about O2 [kg.m2]
    #[var(name = "rocker.inertia", start = 0.02, min = 0.0)]
    pub I_2: f64,
    /// Mass at the hand [kg]
    #[var(name = "hand.mass", start = 0.0, min = 0.0)]
    pub m_hand: f64,
    /// Push of the gas strut [N]
    #[var(name = "gas.force", start = 125.0)]
    pub F_gas: f64,
    /// Ground joint of the gas strut [m]
    #[var(name = "gas.base", start = [0.05, -0.15])]
    pub gas_base: Vector2<f64>,
    /// Joint of the gas strut on the coupler, in its frame [m]
    #[var(name = "gas.point")]
    pub gas_point: Vector2<f64>,
    /// Stiffness of the gas strut [N/m]
    #[var(name = "gas.stiffness", start = 0.0, min = 0.0)]
    pub k_gas: f64,
    /// Length of the gas strut at which its stiffness gives no force [m]
    #[var(name = "gas.length0", start = 0.3, min = 0.0)]
    pub l_gas: f64,
    /// Depth of the detent [J]
    #[var(name = "detent.energy", start = 0.6, min = 0.0)]
    pub E_det: f64,
    /// Crank angle of the detent [rad]
    #[var(name = "detent.angle", start = 0.3)]
    pub phi_det: f64,
    /// Width of the detent [rad]
    #[var(name = "detent.width", start = 0.05, above = 0.0)]
    pub w_det: f64,
    /// Viscous friction [N.m.s/rad]
    #[var(name = "viscous", start = 0.4, min = 0.0)]
    pub visc: f64,
    /// Coulomb friction [N.m]
    #[var(name = "coulomb", start = 0.2, min = 0.0)]
    pub coul: f64,
    /// Rate at which Coulomb friction has reached tanh(1) of its value [rad/s]
    #[var(name = "coulomb.rate", start = 0.02, above = 0.0)]
    pub w_c: f64,
    #[var(prefix = "stop.")]
    #[allow(missing_docs, reason = "a group")]
    pub stop: AngleStops,
    /// Crank angle at the start [rad]
    #[var(name = "phi.start", start = -0.3)]
    pub phi: f64,
    /// Rate of the crank angle at the start [rad/s]
    #[var(name = "phi_rate.start")]
    pub phi_rate: f64,
    /// Sine of the angle between coupler and rocker below which the loop is near its toggle
    #[var(name = "toggle.tolerance", start = 1e-3, above = 0.0, max = 1.0)]
    pub toggle: f64,
}

/// The drawer.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(parameter)]
pub struct DrawerParameters {
    /// Position of the handle when the drawer is closed [m]
    #[var(name = "start")]
    pub H_0: Vector2<f64>,
    /// Direction in which it opens; any length but zero
    #[var(name = "direction", start = [1.0, 0.0])]
    pub e: Vector2<f64>,
    /// Mass [kg]
    #[var(name = "mass", start = 8.0, above = 0.0)]
    pub m: f64,
    /// Travel between its stops [m]
    #[var(name = "stroke", start = 0.35, above = 0.0)]
    pub stroke: f64,
    /// Opening at the start [m]
    #[var(name = "s.start")]
    pub s: f64,
    /// Velocity at the start [m/s]
    #[var(name = "v.start")]
    pub v: f64,
    /// Opening below which soft close acts [m]
    #[var(name = "soft.length", start = 0.08, above = 0.0)]
    pub l_s: f64,
    /// Stiffness of the pull-in of soft close [N/m]
    #[var(name = "soft.stiffness", start = 60.0, min = 0.0)]
    pub k_s: f64,
    /// Damping of soft close when closed [N.s/m]
    #[var(name = "soft.damping", start = 80.0, min = 0.0)]
    pub c_s: f64,
    /// Depth of the detent [J]
    #[var(name = "detent.energy", start = 0.0, min = 0.0)]
    pub E_det: f64,
    /// Opening at the detent [m]
    #[var(name = "detent.position", start = 0.2)]
    pub s_det: f64,
    /// Width of the detent [m]
    #[var(name = "detent.width", start = 0.01, above = 0.0)]
    pub w_det: f64,
    /// Viscous friction [N.s/m]
    #[var(name = "viscous", start = 5.0, min = 0.0)]
    pub visc: f64,
    /// Coulomb friction [N]
    #[var(name = "coulomb", start = 4.0, min = 0.0)]
    pub coul: f64,
    /// Speed at which Coulomb friction has reached tanh(1) of its value [m/s]
    #[var(name = "coulomb_rate", start = 0.005, above = 0.0)]
    pub v_c: f64,
    /// Stiffness of the stops [N/m]
    #[var(name = "stop.stiffness", start = 2e4, min = 0.0)]
    pub k: f64,
    /// Damping of the stops, relative to the elastic force [s/m]
    #[var(name = "stop.damping", start = 1.0, min = 0.0)]
    pub chi: f64,
}

/// Parts that can be left out.
#[allow(clippy::struct_excessive_bools, reason = "one for each part that can be left out")]
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(parameter)]
pub struct Use {
    /// Detent
    #[var(name = "detent", start = true)]
    pub detent: bool,
    /// Soft close of the drawer
    #[var(name = "soft_close", start = true)]
    pub soft_close: bool,
    /// Gas strut of the four-bar
    #[var(name = "gas", start = true)]
    pub gas: bool,
    /// Energy integrals
    #[var(name = "energy", start = true)]
    pub energy: bool,
}

/// Parameters of the virtual mechanism.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(parameter)]
pub struct Parameters {
    /// What the hand moves; only the chosen kind is evaluated
    #[var(name = "kind", item = Kind::Fourbar)]
    pub kind: Kind,
    #[var(prefix = "")]
    #[allow(missing_docs, reason = "a group")]
    pub fourbar: FourbarParameters,
    #[var(prefix = "drawer.")]
    #[allow(missing_docs, reason = "a group")]
    pub drawer: DrawerParameters,
    /// Gravity; y without effect [m/s2]
    #[var(name = "gravity", start = [0.0, 0.0, -9.81])]
    pub gravity: Vector3<f64>,
    #[var(prefix = "use.")]
    #[allow(missing_docs, reason = "a group")]
    pub parts: Use,
}

/// Inputs of the virtual mechanism.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(input)]
pub struct Inputs<S> {
    #[var(prefix = "H.")]
    #[allow(missing_docs, reason = "leader port H, first slot")]
    pub H: PlanarSlot<S>,
    #[var(prefix = "H.slot[2].")]
    #[allow(missing_docs, reason = "leader port H, second slot")]
    pub H_2: PlanarSlot<S>,
}

/// All that accelerates the crank or the drawer.
const FOURBAR: &[&str] = &["H", "phi", "phi_rate"];
const DRAWER: &[&str] = &["H", "drawer.s", "drawer.v"];
const EITHER: &[&str] = &["H", "phi", "phi_rate", "drawer.s", "drawer.v"];

/// Motion of the mechanism.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Motion<S> {
    /// Position of the hand [m]
    #[var(name = "H.r", depends = ["phi", "drawer.s"])]
    pub r: Vector2<S>,
    /// Velocity of the hand [m/s]
    #[var(name = "H.v", depends = ["phi", "phi_rate", "drawer.v"])]
    pub v: Vector2<S>,
    /// Crank angle [rad]
    #[var(name = "phi", state, rate_depends = ["phi_rate"])]
    pub phi: S,
    /// Rate of the crank angle [rad/s]
    #[var(name = "phi_rate", state, rate_depends = FOURBAR)]
    pub phi_rate: S,
    /// Opening of the drawer [m]
    #[var(name = "drawer.s", state, nominal = 0.1, rate_depends = ["drawer.v"])]
    pub s: S,
    /// Velocity of the drawer [m/s]
    #[var(name = "drawer.v", state, nominal = 0.1, rate_depends = DRAWER)]
    pub s_rate: S,
    /// 1 while the four-bar is nearer to its toggle than toggle.tolerance, otherwise 0
    #[var(name = "singular", discrete)]
    pub singular: S,
}

/// Accelerations.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Dynamics<S> {
    /// Acceleration of the hand [m/s2]
    #[var(name = "H.a", depends = EITHER)]
    pub a: Vector2<S>,
}

/// Energies.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Energy<S> {
    /// Kinetic energy [J]
    #[var(name = "energy.kinetic", depends = ["phi", "phi_rate", "drawer.v"])]
    pub kinetic: S,
    /// Energy of gravity, gas strut, detent, stops and soft close [J]
    #[var(name = "energy.potential", depends = ["phi", "drawer.s"])]
    pub potential: S,
    /// Energy turned into heat since the start [J]
    #[var(name = "energy.dissipated", state, rate_depends = ["phi", "phi_rate", "drawer.s", "drawer.v"])]
    pub dissipated: S,
    /// Work of the followers since the start [J]
    #[var(name = "energy.supplied", state, rate_depends = EITHER)]
    pub supplied: S,
    /// The same: all of it comes through the port [J]
    #[var(name = "energy.port", depends = ["energy.supplied"])]
    pub port: S,
}
