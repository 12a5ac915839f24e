//! Parameters, inputs and outputs of the Rayleigh-van-der-Pol absorber.

use std::f64::consts::{FRAC_PI_2, PI};

use model::{Enumeration, SymmetricTensor, Variables, Vector3};

use super::primary_variables::PortKind;
use crate::port::{Root, ScalarRoot};

/// Law of the controlled force
#[derive(Debug, Clone, Copy, PartialEq, Eq, Enumeration)]
pub enum LawKind {
    /// None: a passive absorber
    Off = 1,
    /// Amplitude and phase of the synchronised motion are parameters, no poles (16)
    Direct = 2,
    /// The paper's form with the energy of the limit cycle (14)
    Paper = 3,
}

/// Parameters of the controller.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(parameter)]
pub struct Control {
    /// Law of the controlled force
    #[var(name = "control.law", item = LawKind::Direct)]
    pub law: LawKind,
    /// Gain [s/m2]
    #[var(name = "control.gamma", start = 10.0, min = 0.0, nominal = 10.0, tunable)]
    pub gamma: f64,
    /// Wanted amplitude of x, law direct [m]
    #[var(name = "control.amplitude", start = 0.063_325_739_776_461_11, above = 0.0, nominal = 0.1, tunable)]
    pub X: f64,
    /// Amplitude of the design force [N]
    #[var(name = "control.force", start = 0.0, min = 0.0, nominal = 10.0, tunable)]
    pub F_d: f64,
    /// Lead of the design force over the displacement [rad]
    #[var(name = "control.alpha", start = FRAC_PI_2, tunable)]
    pub alpha: f64,
    /// Energy of the limit cycle, law paper [J]
    #[var(name = "control.energy", start = 1.583_143_494_4, above = 0.0, tunable)]
    pub H0: f64,
    /// The controller takes the damping away
    #[var(name = "control.compensate_damping", start = true)]
    pub compensate: bool,
    /// The controlled force is limited
    #[var(name = "use.force_limit", start = false)]
    pub use_limit: bool,
    /// Largest controlled force; only with use.force_limit [N]
    #[var(name = "control.force_limit", start = 100.0, above = 0.0, nominal = 100.0, tunable)]
    pub limit: f64,
}

/// Parameters of the stop.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(parameter)]
pub struct StopParameters {
    /// Stops at both ends of the stroke
    #[var(name = "use.stroke_stop", start = false)]
    pub used: bool,
    /// Displacement at which a stop is met; only with use.stroke_stop [m]
    #[var(name = "stroke.limit", start = 0.1, above = 0.0, nominal = 0.1, tunable)]
    pub limit: f64,
    /// Stiffness of a stop [N/m]
    #[var(name = "stroke.stiffness", start = 1e6, above = 0.0, nominal = 1e6, tunable)]
    pub k: f64,
    /// Damping of a stop, relative to its elastic force [s/m]
    #[var(name = "stroke.damping", start = 1.0, min = 0.0, tunable)]
    pub chi: f64,
}

/// Parameters. Defaults: 5 kg that calm 100 kg at 2 Hz under 50 N.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(parameter)]
pub struct Parameters {
    /// Kind of the port; the other kind ignores its inputs and gives zeros
    #[var(name = "port.kind", item = PortKind::Scalar)]
    pub kind: PortKind,
    /// Direction of the relative motion, spatial port; any length from 1e-12
    #[var(name = "axis", start = [0.0, 0.0, 1.0])]
    pub axis: Vector3<f64>,
    /// Gravity [m/s2]
    #[var(name = "gravity")]
    pub gravity: Vector3<f64>,
    /// Mass [kg]
    #[var(name = "mass", start = 5.0, above = 0.0)]
    pub m: f64,
    /// Stiffness; a change keeps the elongation under the weight [N/m]
    #[var(name = "stiffness", start = 800.0, min = 0.0, nominal = 1e3, tunable)]
    pub c: f64,
    /// Damping [N.s/m]
    #[var(name = "damping", start = 2.5, min = 0.0, tunable)]
    pub d: f64,
    /// Displacement at the start, from rest [m]
    #[var(name = "x.start", start = 0.01)]
    pub x_start: f64,
    /// Velocity at the start, relative to the port [m/s]
    #[var(name = "w.start", start = 0.0)]
    pub w_start: f64,
    #[var(prefix = "")]
    #[allow(missing_docs, reason = "a group")]
    pub control: Control,
    #[var(prefix = "")]
    #[allow(missing_docs, reason = "a group")]
    pub stop: StopParameters,
    /// Amplitude of the drive's own force on the mass; drive.omega must be constant [N]
    #[var(name = "drive.amplitude", start = 0.0, tunable)]
    pub amplitude: f64,
    /// Phase of this force [rad]
    #[var(name = "drive.phase", start = 0.0, tunable)]
    pub phase: f64,
    /// Stability of the synchronised motion at the start
    #[var(name = "use.stability_check", start = false)]
    pub use_check: bool,
    /// Energy integrals
    #[var(name = "use.energy", start = true)]
    pub use_energy: bool,
}

/// Inputs.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(input)]
pub struct Inputs<S> {
    #[var(prefix = "P.")]
    #[allow(missing_docs, reason = "scalar port P")]
    pub P: ScalarRoot<S>,
    #[var(prefix = "A.")]
    #[allow(missing_docs, reason = "spatial port A")]
    pub A: Root<S>,
    /// 1: the controller acts; 0: its force is zero
    #[var(name = "control.enabled", start = 1.0, switch, discrete)]
    pub enabled: S,
    /// Angular frequency of the excitation [rad/s]
    #[var(name = "drive.omega", start = 4.0 * PI, above = 0.0, nominal = 10.0)]
    pub omega: S,
    /// External force on the mass along the axis [N]
    #[var(name = "drive.force", nominal = 10.0)]
    pub force: S,
}

// What depends on what, united over all settings; `=P.F` is the scalar variable alone, `P.F.*` the vector alone.

const INTERNAL: &[&str] = &["x", "w", "drive.omega", "control.enabled"];
const FORCE: &[&str] = &["x", "w", "drive.omega", "control.enabled", "A.a"];
const MASS: &[&str] = &["P.a", "A.a", "x", "w", "drive.omega", "drive.force", "control.enabled"];
const PORT_WORK: &[&str] = &["P.v", "A.v", "A.a", "x", "w", "drive.omega", "control.enabled"];
const WORK: &[&str] = &["P.v", "A.v", "A.a", "x", "w", "drive.omega", "drive.force", "control.enabled"];

/// Relative motion.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Motion<S> {
    /// Displacement of the mass relative to the port, from rest [m]
    #[var(name = "x", state, rate_depends = ["w"])]
    pub x: S,
    /// Velocity of the mass relative to the port [m/s]
    #[var(name = "w", state, rate_depends = MASS)]
    pub w: S,
}

/// What the leader has to carry.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Inertia<S> {
    /// Force on the leader at rest, scalar; the same as P.F [N]
    #[var(name = "P.F0", nominal = 1e2, depends = INTERNAL)]
    pub P_F0: S,
    /// Inertia behind the scalar port: always zero [kg]
    #[var(name = "P.M")]
    pub P_M: S,
    /// Force on the leader at A.a = 0, spatial [N]
    #[var(name = "A.F0", nominal = 1e2, depends = INTERNAL)]
    pub A_F0: Vector3<S>,
    /// Inertia behind the spatial port: the mass across the axis [kg]
    #[var(name = "A.M")]
    pub A_M: SymmetricTensor<S>,
}

/// Forces and the controller.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Dynamics<S> {
    /// Force on the leader, scalar [N]
    #[var(name = "P.F", nominal = 1e2, depends = INTERNAL)]
    pub P_F: S,
    /// Force on the leader, spatial [N]
    #[var(name = "A.F", nominal = 1e2, depends = FORCE)]
    pub A_F: Vector3<S>,
    /// Controlled force on the mass [N]
    #[var(name = "control.F1", nominal = 10.0, depends = INTERNAL)]
    pub F1: S,
    /// Power of the controller on the relative motion [W]
    #[var(name = "control.power", nominal = 10.0, depends = INTERNAL)]
    pub power: S,
    #[var(prefix = "", local)]
    #[allow(missing_docs, reason = "a group")]
    pub design: DesignOutputs<S>,
    #[var(prefix = "", local, discrete)]
    #[allow(missing_docs, reason = "a group")]
    pub stability: StabilityOutputs<S>,
}

/// The synchronised motion that the law is made for.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
pub struct DesignOutputs<S> {
    /// Amplitude relative to the limit cycle's; 0 where no limit cycle has the wanted amplitude
    #[var(name = "design.n")]
    pub n: S,
    /// Frequency relative to the limit cycle's; 0 in the same case
    #[var(name = "design.eta")]
    pub eta: S,
    /// Amplitude of the synchronised motion; below zero: turned by pi [m]
    #[var(name = "design.X")]
    pub X: S,
    /// Design force relative to m Omega^2 X
    #[var(name = "design.f")]
    pub f: S,
    /// Gain gamma Omega X^2
    #[var(name = "design.g")]
    pub g: S,
}

/// Stability of the synchronised motion at the end of initialisation; zeros without use.stability_check.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
pub struct StabilityOutputs<S> {
    /// Trace condition (19): stable only above 0
    #[var(name = "stability.trace")]
    pub trace: S,
    /// Determinant condition (20): stable only above 0
    #[var(name = "stability.determinant")]
    pub determinant: S,
    /// Stiffness condition (21)
    #[var(name = "stability.stiffness")]
    pub stiffness: S,
    /// Largest modulus of the multipliers over half a period
    #[var(name = "stability.multiplier")]
    pub multiplier: S,
    /// 1: stable
    #[var(name = "stability.predicted")]
    pub predicted: S,
}

/// Energies.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Energy<S> {
    /// Kinetic energy [J]
    #[var(name = "energy.kinetic", depends = ["P.v", "A.v", "w"])]
    pub kinetic: S,
    /// Energy of spring, stop and gravity [J]
    #[var(name = "energy.potential", depends = ["P.s", "A.r", "x"])]
    pub potential: S,
    /// Energy turned into heat since the start [J]
    #[var(name = "energy.dissipated", state, rate_depends = ["x", "w"])]
    pub dissipated: S,
    /// Work of controller, drive and leader since the start [J]
    #[var(name = "energy.supplied", state, rate_depends = WORK)]
    pub supplied: S,
    /// Work of the leader since the start [J]
    #[var(name = "energy.port", state, rate_depends = PORT_WORK)]
    pub port: S,
}
