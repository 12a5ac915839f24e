//! Variables of the controller.

use model::{Enumeration, PlanarTensor, Variables, Vector2};

use super::device::Device;

/// What the controller renders
#[derive(Debug, Clone, Copy, PartialEq, Eq, Enumeration)]
pub enum Mode {
    /// Nothing
    Idle = 1,
    /// The force of a massless follower at V
    Impedance = 2,
    /// The motion of a leader at W
    Admittance = 3,
}

/// Parameters of the controller.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(parameter)]
pub struct Parameters {
    /// Sample period [s]
    #[var(name = "T", start = 1e-3, above = 0.0)]
    pub T: f64,
    /// What is rendered
    #[var(name = "mode", item = Mode::Admittance)]
    pub mode: Mode,
    /// Samples between a measurement and its command
    #[var(name = "delay", start = 1.0, min = 0.0, max = 10.0)]
    pub delay: i32,
    /// Cutoff frequency of the rate filter; 0: no filter [Hz]
    #[var(name = "filter.cutoff", start = 200.0, min = 0.0)]
    pub cutoff: f64,
    /// Stiffness with which an axis follows the rendered leader [N/m]
    #[var(name = "kp", start = 3e5, min = 0.0)]
    pub kp: f64,
    /// Damping with which an axis follows the rendered leader [N.s/m]
    #[var(name = "kd", start = 6000.0, min = 0.0)]
    pub kd: f64,
    /// Integral part of the same [N/m.s]
    #[var(name = "ki", start = 0.0, min = 0.0)]
    pub ki: f64,
    /// Mass whose acceleration is fed forward [kg]
    #[var(name = "m_ff", start = 0.0, min = 0.0)]
    pub m_ff: f64,
    /// Part of the weight that is compensated
    #[var(name = "comp.gravity", start = 1.0)]
    pub comp_gravity: f64,
    /// The queue of commands starts full of those that hold the weight at the first tick, otherwise empty
    #[var(name = "start.balanced", start = false)]
    pub balanced: bool,
    /// Position of the device at which the rendered leader is at its origin [m]
    #[var(name = "offset", start = [-0.07, 0.55])]
    pub offset: Vector2<f64>,
    /// Force at the handle for one newton on the rendered leader
    #[var(name = "scale", start = 1.0, above = 0.0)]
    pub scale: f64,
    /// Size of the Jacobian's determinant below which its inverse is damped
    #[var(name = "damped.eps", start = 0.05, min = 0.0, max = 1.0)]
    pub eps: f64,
    /// Damping of the inverse at a singular pose
    #[var(name = "damped.lambda", start = 0.05, above = 0.0)]
    pub lambda: f64,
    #[var(prefix = "")]
    #[allow(missing_docs, reason = "a group")]
    pub device: Device,
}

/// Length of both axes where the device starts by default [m]
const START: f64 = 0.694_622_199_472_490_2;

/// Inputs of the controller, held between their changes.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(input)]
pub struct Inputs<S> {
    /// Measured length of the first axis [m]
    #[var(name = "axis[1].position", start = START)]
    pub l_1: S,
    /// Measured length of the second axis [m]
    #[var(name = "axis[2].position", start = START)]
    pub l_2: S,
    /// Force of the hand on the handle [N]
    #[var(name = "sensor.F", nominal = 1e1)]
    pub sensor_F: Vector2<S>,
    /// Force of a massless follower on the device, impedance mode [N]
    #[var(name = "V.F", nominal = 1e1)]
    pub V_F: Vector2<S>,
    /// Position of the rendered leader, admittance mode [m]
    #[var(name = "W.r")]
    pub W_r: Vector2<S>,
    /// Velocity of the rendered leader [m/s]
    #[var(name = "W.v")]
    pub W_v: Vector2<S>,
    /// Acceleration of the rendered leader; only with m_ff [m/s2]
    #[var(name = "W.a")]
    pub W_a: Vector2<S>,
}

/// Measured motion.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Motion<S> {
    /// Position of the handle at the last tick [m]
    #[var(name = "V.r", discrete, sampled)]
    pub V_r: Vector2<S>,
    /// Velocity of the handle at the last tick [m/s]
    #[var(name = "V.v", discrete, nominal = 0.1)]
    pub V_v: Vector2<S>,
    /// Number of ticks so far
    #[var(name = "tick", local, discrete)]
    pub tick: S,
    /// 1 from the first measurement without a pose or command that is not finite, until reset; otherwise 0
    #[var(name = "fault", discrete)]
    pub fault: S,
}

/// What the rendered leader has to carry.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Inertia<S> {
    /// Force on the rendered leader; the same as W.F [N]
    #[var(name = "W.F0", discrete, nominal = 1e1)]
    pub W_F0: Vector2<S>,
    /// Inertia behind port W: always zero [kg]
    #[var(name = "W.M", discrete)]
    pub W_M: PlanarTensor<S>,
}

/// Commands and forces.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Dynamics<S> {
    /// Wanted force of the first axis [N]
    #[var(name = "axis[1].force_command", discrete, nominal = 1e2)]
    pub f_1: S,
    /// Wanted force of the second axis [N]
    #[var(name = "axis[2].force_command", discrete, nominal = 1e2)]
    pub f_2: S,
    /// Force of the hand on the rendered leader, admittance mode [N]
    #[var(name = "W.F", discrete, nominal = 1e1)]
    pub W_F: Vector2<S>,
}

/// Energies: the controller exchanges signals, not power.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Energy<S> {
    /// Kinetic energy: always zero [J]
    #[var(name = "energy.kinetic", discrete)]
    pub kinetic: S,
    /// Potential energy: always zero [J]
    #[var(name = "energy.potential", discrete)]
    pub potential: S,
    /// Energy turned into heat: always zero [J]
    #[var(name = "energy.dissipated", discrete)]
    pub dissipated: S,
    /// Work on the controller: always zero [J]
    #[var(name = "energy.supplied", discrete)]
    pub supplied: S,
    /// Work of the rendered force on the handle up to the last tick; above zero: energy put into the hand side [J]
    #[var(name = "energy.rendered", discrete)]
    pub rendered: S,
}
