//! What the coordinates of a joint are called, for arms and for the carrier.

use mechanics::{Joint, Planar, Revolute, Scalar, Spherical, Universal};
use model::Vector3;

use super::variables::{CarrierOrientation, LinkAngles};

/// A joint kind that an arm can have.
pub(super) trait ArmCoordinates<const D: usize, const N: usize>: Joint<D, N> {
    /// Names of the states after `lower.` or `upper.`.
    const NAMES: &'static [&'static str];
    /// The joint of a link with this azimuth in the design position.
    fn at_azimuth(phi: f64) -> Self;
    /// States of a resting link at these angles.
    fn states(phi: f64, theta: f64, x: &mut [f64]);
    /// Index of theta among the coordinates.
    const THETA: usize;
    fn angles<S: Scalar>(&self, x: &[S]) -> LinkAngles<S>;
}

/// A joint kind that the carrier can have.
pub(super) trait CarrierCoordinates<const D: usize, const N: usize>: Joint<D, N> {
    /// Names of the states after `carrier.`.
    const NAMES: &'static [&'static str];
    /// The joint.
    const NEW: Self;
    /// States of the resting carrier in the design position.
    fn design(x: &mut [f64]);
    fn orientation<S: Scalar>(x: &[S]) -> CarrierOrientation<S>;
}

impl ArmCoordinates<2, 1> for Planar {
    const NAMES: &'static [&'static str] = &["angle.theta", "angle_rate.theta"];
    const THETA: usize = 0;
    fn at_azimuth(_: f64) -> Self {
        Self
    }
    fn states(_: f64, theta: f64, x: &mut [f64]) {
        x.copy_from_slice(&[theta, 0.0]);
    }
    fn angles<S: Scalar>(&self, x: &[S]) -> LinkAngles<S> {
        let o = S::lift(0.0);
        LinkAngles {
            theta: x[0],
            phi: o,
            theta_dot: x[1],
            phi_dot: o,
        }
    }
}

impl ArmCoordinates<3, 1> for Revolute {
    const NAMES: &'static [&'static str] = &["angle.theta", "angle_rate.theta"];
    const THETA: usize = 0;
    fn at_azimuth(phi: f64) -> Self {
        Self { phi }
    }
    fn states(_: f64, theta: f64, x: &mut [f64]) {
        x.copy_from_slice(&[theta, 0.0]);
    }
    fn angles<S: Scalar>(&self, x: &[S]) -> LinkAngles<S> {
        LinkAngles {
            theta: x[0],
            phi: S::lift(self.phi),
            theta_dot: x[1],
            phi_dot: S::lift(0.0),
        }
    }
}

impl ArmCoordinates<3, 2> for Universal {
    const NAMES: &'static [&'static str] =
        &["angle.phi", "angle.theta", "angle_rate.phi", "angle_rate.theta"];
    const THETA: usize = 1;
    fn at_azimuth(_: f64) -> Self {
        Self
    }
    fn states(phi: f64, theta: f64, x: &mut [f64]) {
        x.copy_from_slice(&[phi, theta, 0.0, 0.0]);
    }
    fn angles<S: Scalar>(&self, x: &[S]) -> LinkAngles<S> {
        LinkAngles {
            theta: x[1],
            phi: x[0],
            theta_dot: x[3],
            phi_dot: x[2],
        }
    }
}

/// The orientation whose coordinates all keep their start values.
fn unused<S: Scalar>() -> CarrierOrientation<S> {
    let o = S::lift(0.0);
    CarrierOrientation {
        psi: o,
        phi: o,
        theta: o,
        psi_dot: o,
        phi_dot: o,
        theta_dot: o,
        q: [S::lift(1.0), o, o, o],
        omega: Vector3::new(o, o, o),
    }
}

impl CarrierCoordinates<2, 1> for Planar {
    const NEW: Self = Self;
    const NAMES: &'static [&'static str] = &["angle.psi", "angle_rate.psi"];
    fn design(x: &mut [f64]) {
        x.fill(0.0);
    }
    fn orientation<S: Scalar>(x: &[S]) -> CarrierOrientation<S> {
        CarrierOrientation {
            psi: x[0],
            psi_dot: x[1],
            ..unused()
        }
    }
}

impl CarrierCoordinates<3, 2> for Universal {
    const NEW: Self = Self;
    const NAMES: &'static [&'static str] =
        &["angle.phi", "angle.theta", "angle_rate.phi", "angle_rate.theta"];
    fn design(x: &mut [f64]) {
        x.fill(0.0);
    }
    fn orientation<S: Scalar>(x: &[S]) -> CarrierOrientation<S> {
        CarrierOrientation {
            phi: x[0],
            theta: x[1],
            phi_dot: x[2],
            theta_dot: x[3],
            ..unused()
        }
    }
}

impl CarrierCoordinates<3, 3> for Spherical {
    const NEW: Self = Self;
    const NAMES: &'static [&'static str] = &["q[1]", "q[2]", "q[3]", "q[4]", "omega.x", "omega.y", "omega.z"];
    fn design(x: &mut [f64]) {
        x.fill(0.0);
        x[0] = 1.0;
    }
    fn orientation<S: Scalar>(x: &[S]) -> CarrierOrientation<S> {
        CarrierOrientation {
            q: [x[0], x[1], x[2], x[3]],
            omega: Vector3::new(x[4], x[5], x[6]),
            ..unused()
        }
    }
}
