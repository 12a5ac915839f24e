//! What the coordinates of a joint are called: as a link (angles of the axis joint - tip) and as a
//! carrier (rotation from the design position).

use mechanics::{Joint, Planar, Rigid, Scalar, Spatial};
use model::{ParameterError, Vector3};

use super::checks::refused;
use super::variables::{CarrierOrientation, LinkAngles};

/// Start values may be off their manifold by this much.
const START_TOLERANCE: f64 = 1e-6;

/// Every orientation variable; those of other joint kinds have their start values.
#[derive(Debug, Clone, Copy)]
pub(super) struct Orientation<S> {
    /// Rotation from the design position about -y (carriers)
    pub(super) psi: S,
    pub(super) phi: S,
    pub(super) theta: S,
    pub(super) psi_dot: S,
    pub(super) phi_dot: S,
    pub(super) theta_dot: S,
    pub(super) q: [S; 4],
    pub(super) direction: Vector3<S>,
    pub(super) omega: Vector3<S>,
}

impl<S: Scalar> Orientation<S> {
    /// All coordinates at their start values.
    pub(super) fn unused() -> Self {
        let o = S::lift(0.0);
        Self {
            psi: o,
            phi: o,
            theta: o,
            psi_dot: o,
            phi_dot: o,
            theta_dot: o,
            q: [S::lift(1.0), o, o, o],
            direction: Vector3::new(S::lift(1.0), o, o),
            omega: Vector3::new(o, o, o),
        }
    }

    /// Start values in the scalar of the equations.
    pub(super) fn constant(start: &Orientation<f64>) -> Self {
        let l = S::lift;
        Self {
            psi: l(start.psi),
            phi: l(start.phi),
            theta: l(start.theta),
            psi_dot: l(start.psi_dot),
            phi_dot: l(start.phi_dot),
            theta_dot: l(start.theta_dot),
            q: start.q.map(l),
            direction: start.direction.map(l),
            omega: start.omega.map(l),
        }
    }

    /// As the angles of a link.
    pub(super) fn link(self) -> LinkAngles<S> {
        let Self { theta, phi, theta_dot, phi_dot, .. } = self;
        LinkAngles { theta, phi, theta_dot, phi_dot }
    }

    /// As the orientation of a carrier.
    pub(super) fn carrier(self) -> CarrierOrientation<S> {
        let Self { psi, phi, theta, psi_dot, phi_dot, theta_dot, q, omega, .. } = self;
        CarrierOrientation { psi, phi, theta, psi_dot, phi_dot, theta_dot, q, omega }
    }
}

/// A joint kind whose coordinates have names.
pub(super) trait Coordinates<const D: usize, const N: usize>: Joint<D, N> {
    /// Names of the states of a link.
    fn link_names(&self) -> &'static [&'static str];
    /// Names of the states of a carrier.
    fn carrier_names(&self) -> &'static [&'static str] {
        self.link_names()
    }
    /// Index of the elevation among q.
    fn elevation(&self) -> usize;
    /// States of a resting link at these angles.
    fn link_states(&self, phi: f64, theta: f64, x: &mut [f64]);
    /// States of the resting carrier in its design position.
    fn carrier_states(&self, x: &mut [f64]) {
        self.link_states(0.0, 0.0, x);
    }
    /// All orientation variables; those of other joint kinds as in `unused`. `carrier`: a
    /// single angle is psi, not theta.
    fn orientation<S: Scalar>(&self, x: &[S], carrier: bool, unused: Orientation<S>) -> Orientation<S>;
    /// The states from orientation variables; `carrier`: the angle is psi.
    fn states_of(&self, o: &Orientation<f64>, x: &mut [f64], carrier: bool);

    /// The same for start values: a quaternion or unit vector that is off by more than 1e-6 is
    /// refused, less is rounding and taken away.
    ///
    /// # Errors
    /// [`ParameterError::Refused`].
    fn checked_start(
        &self,
        o: &Orientation<f64>,
        x: &mut [f64],
        carrier: bool,
    ) -> Result<(), ParameterError> {
        self.states_of(o, x, carrier);
        let off = self.off_manifold(x);
        if off > START_TOLERANCE {
            let quaternion = self.link_names().iter().any(|n| n.starts_with("orientation"));
            let (name, allowed) = if quaternion {
                ("orientation.q", "a norm within 1e-6 of 1")
            } else {
                ("direction", "a norm within 1e-6 of 1, and omega across it")
            };
            return Err(refused(name, off, "off its manifold by this much", allowed));
        }
        self.normalise(x);
        Ok(())
    }

    /// Inertia about the first axis of a universal joint over the largest one; 1 for other joints.
    fn singularity<S: Scalar>(&self, _rigid: &Rigid<D>, _x: &[S]) -> S {
        S::lift(1.0)
    }
}

/// One angle, of a carrier or of a link at the azimuth `phi`.
fn single_angle<S: Scalar>(x: &[S], phi: S, carrier: bool, unused: Orientation<S>) -> Orientation<S> {
    if carrier {
        Orientation { psi: x[0], psi_dot: x[1], phi, ..unused }
    } else {
        Orientation { theta: x[0], theta_dot: x[1], phi, ..unused }
    }
}

impl Coordinates<2, 1> for Planar {
    fn link_names(&self) -> &'static [&'static str] {
        &["angle.theta", "angle_rate.theta"]
    }
    fn carrier_names(&self) -> &'static [&'static str] {
        &["angle.psi", "angle_rate.psi"]
    }
    fn elevation(&self) -> usize {
        0
    }
    fn link_states(&self, _: f64, theta: f64, x: &mut [f64]) {
        x.copy_from_slice(&[theta, 0.0]);
    }
    fn orientation<S: Scalar>(&self, x: &[S], carrier: bool, unused: Orientation<S>) -> Orientation<S> {
        single_angle(x, unused.phi, carrier, unused)
    }
    fn states_of(&self, o: &Orientation<f64>, x: &mut [f64], carrier: bool) {
        let states = if carrier { [o.psi, o.psi_dot] } else { [o.theta, o.theta_dot] };
        x.copy_from_slice(&states);
    }
}

impl Coordinates<3, 3> for Spatial {
    fn link_names(&self) -> &'static [&'static str] {
        match self {
            Self::Revolute { .. } => &["angle.theta", "angle_rate.theta"],
            Self::Universal => &["angle.phi", "angle.theta", "angle_rate.phi", "angle_rate.theta"],
            Self::Spherical => &[
                "orientation.q[1]",
                "orientation.q[2]",
                "orientation.q[3]",
                "orientation.q[4]",
                "omega.x",
                "omega.y",
                "omega.z",
            ],
            Self::SphericalRod => {
                &["direction.x", "direction.y", "direction.z", "omega.x", "omega.y", "omega.z"]
            }
        }
    }
    fn carrier_names(&self) -> &'static [&'static str] {
        match self {
            Self::Revolute { .. } => &["angle.psi", "angle_rate.psi"],
            _ => self.link_names(),
        }
    }
    fn elevation(&self) -> usize {
        usize::from(*self == Self::Universal)
    }
    fn link_states(&self, phi: f64, theta: f64, x: &mut [f64]) {
        x.fill(0.0);
        match self {
            Self::Revolute { .. } => x[0] = theta,
            Self::Universal => x[..2].copy_from_slice(&[phi, theta]),
            Self::Spherical => {
                // about z by phi, then about the negative y axis by theta
                let ((sp, cp), (st, ct)) = ((0.5 * phi).sin_cos(), (0.5 * theta).sin_cos());
                x[..4].copy_from_slice(&[cp * ct, sp * st, -cp * st, sp * ct]);
            }
            Self::SphericalRod => {
                let ((sp, cp), (st, ct)) = (phi.sin_cos(), theta.sin_cos());
                x[..3].copy_from_slice(&[ct * cp, ct * sp, st]);
            }
        }
    }
    fn orientation<S: Scalar>(&self, x: &[S], carrier: bool, unused: Orientation<S>) -> Orientation<S> {
        match self {
            Self::Revolute { phi } => single_angle(x, S::lift(*phi), carrier, unused),
            Self::Universal => {
                Orientation { phi: x[0], theta: x[1], phi_dot: x[2], theta_dot: x[3], ..unused }
            }
            Self::Spherical => {
                Orientation { q: [x[0], x[1], x[2], x[3]], omega: Vector3::new(x[4], x[5], x[6]), ..unused }
            }
            Self::SphericalRod => Orientation {
                direction: Vector3::new(x[0], x[1], x[2]),
                omega: Vector3::new(x[3], x[4], x[5]),
                ..unused
            },
        }
    }
    fn singularity<S: Scalar>(&self, rigid: &Rigid<3>, x: &[S]) -> S {
        if *self != Self::Universal {
            return S::lift(1.0);
        }
        let J_x = rigid.I_c[(0, 0)];
        let J_z = rigid.I_c[(2, 2)] + rigid.m * rigid.c.x * rigid.c.x;
        let (st, ct) = x[1].sin_cos();
        (st * st * J_x + ct * ct * J_z) / J_z
    }
    fn states_of(&self, o: &Orientation<f64>, x: &mut [f64], carrier: bool) {
        match self {
            Self::Revolute { .. } if carrier => x.copy_from_slice(&[o.psi, o.psi_dot]),
            Self::Revolute { .. } => x.copy_from_slice(&[o.theta, o.theta_dot]),
            Self::Universal => x.copy_from_slice(&[o.phi, o.theta, o.phi_dot, o.theta_dot]),
            Self::Spherical => {
                x[..4].copy_from_slice(&o.q);
                x[4..].copy_from_slice(o.omega.as_slice());
            }
            Self::SphericalRod => {
                x[..3].copy_from_slice(o.direction.as_slice());
                x[3..].copy_from_slice(o.omega.as_slice());
            }
        }
    }
}

/// Names of the states of an element: its coordinates and rates, then the energy integrals.
pub(super) fn state_names<const X: usize>(own: &[&str]) -> [String; X] {
    let energies = ["energy.dissipated", "energy.supplied", "energy.port"];
    std::array::from_fn(|i| (*own.get(i).unwrap_or_else(|| &energies[i - own.len()])).to_string())
}

/// Typical magnitudes: energy integrals are quadratures, they follow the states and do not choose
/// the step.
pub(super) fn nominals<const X: usize>(mechanical: usize) -> [f64; X] {
    std::array::from_fn(|i| if i < mechanical { 1.0 } else { f64::INFINITY })
}
