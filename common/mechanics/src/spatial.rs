//! Joints in space. One type for all kinds, with three columns in H; those that a kind lacks are
//! zero, with a unit inertia, so that their coordinates never move.

use nalgebra::{Matrix3, Vector3};

use crate::{Body, Joint, Point, Pose, Rigid, Scalar, Vector, scalar::lift};

/// A joint kind in space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Spatial {
    /// Rotation about -y_i, the horizontal axis across the fixed azimuth
    Revolute {
        /// Azimuth of the link [rad]
        phi: f64,
    },
    /// The paper's rod: azimuth phi about z_E, then elevation theta about -y_i
    Universal,
    /// Free rotation
    Spherical,
    /// A rod that may point anywhere and does not spin
    SphericalRod,
}

/// Pose of an element in space.
#[derive(Debug, Clone, Copy)]
pub struct SpatialPose<S> {
    /// Body to world (1)
    pub R: Matrix3<S>,
    /// Joint axes in the world frame (2); columns beyond `axes` are zero
    pub H: Matrix3<S>,
    /// Number of joint axes
    pub axes: usize,
    /// Angular acceleration at q'' = 0, world frame (3) [rad/s2]
    pub gamma: Vector3<S>,
    /// Angular velocity, world frame [rad/s]
    pub omega: Vector3<S>,
}

impl<S: Scalar> SpatialPose<S> {
    /// Inertia about the joint, world frame (4).
    #[inline]
    pub fn inertia(&self, rigid: &Rigid<3>) -> Matrix3<S> {
        let Rigid { m, c, I_c } = rigid;
        let about_joint = I_c + (Matrix3::identity() * c.norm_squared() - c * c.transpose()) * *m;
        self.R * lift(&about_joint) * self.R.transpose()
    }
}

impl<S: Scalar> Pose<S, 3, 3> for SpatialPose<S> {
    #[inline]
    fn point(&self, p: &Vector<f64, 3>) -> Point<S, 3, 3> {
        let Self { R, H, gamma, omega, .. } = self;
        let r = R * lift(p);
        let J = Matrix3::from_columns(&[H.column(0).cross(&r), H.column(1).cross(&r), H.column(2).cross(&r)]);
        let v = omega.cross(&r);
        Point { r, v, J, c: gamma.cross(&r) + omega.cross(&v) }
    }
    #[inline]
    fn body(&self, rigid: &Rigid<3>) -> Body<S, 3, 3> {
        let Self { H, gamma, omega, axes, .. } = self;
        let J_A = self.inertia(rigid);
        let torque = omega.cross(&(J_A * omega)) + J_A * gamma; // (5)
        let mut Mq = H.transpose() * J_A * H;
        for i in *axes..3 {
            Mq[(i, i)] = S::lift(1.0);
        }
        Body { m: S::lift(rigid.m), com: self.point(&rigid.c), Mq, Q: -(H.transpose() * torque) }
    }
    #[inline]
    fn spin_energy(&self, rigid: &Rigid<3>) -> S {
        let omega = self.R.transpose() * self.omega;
        omega.dot(&(lift(&rigid.I_c) * omega)) * 0.5
    }
    #[inline]
    fn drive(&self, torque: &Vector3<S>) -> Vector3<S> {
        self.H.transpose() * torque
    }
    #[inline]
    fn omega(&self) -> Vector3<S> {
        self.omega
    }
    #[inline]
    fn momentum_rate(&self, rigid: &Rigid<3>, q_ddot: &Vector3<S>) -> Vector3<S> {
        let J_A = self.inertia(rigid);
        let alpha = self.H * q_ddot + self.gamma; // (3)
        J_A * alpha + self.omega.cross(&(J_A * self.omega))
    }
}

/// Link orientation (1), the second joint axis -y_i and the azimuth direction.
#[inline]
fn link_frame<S: Scalar>(phi: S, theta: S) -> (Matrix3<S>, Vector3<S>, Vector3<S>) {
    let (sp, cp) = phi.sin_cos();
    let (st, ct) = theta.sin_cos();
    let o = S::lift(0.0);
    let R = Matrix3::new(ct * cp, -sp, -st * cp, ct * sp, cp, -st * sp, st, o, ct);
    (R, Vector3::new(sp, -cp, o), Vector3::new(cp, sp, o))
}

/// Derivative of a quaternion under the world angular velocity: p' = 1/2 (0, omega) o p.
#[inline]
fn quaternion_rate<S: Scalar>(p: &[S], omega: &[S]) -> [S; 4] {
    let (w, x, y, z) = (p[0], p[1], p[2], p[3]);
    let (a, b, c) = (omega[0] * 0.5, omega[1] * 0.5, omega[2] * 0.5);
    [-a * x - b * y - c * z, a * w + b * z - c * y, b * w + c * x - a * z, c * w + a * y - b * x]
}

/// Rotation of a quaternion of any length.
#[inline]
fn rotation<S: Scalar>(p: &[S]) -> Matrix3<S> {
    let (w, i, j, k) = (p[0], p[1], p[2], p[3]);
    let s = S::lift(2.0) / (w * w + i * i + j * j + k * k);
    let one = S::lift(1.0);
    Matrix3::new(
        one - s * (j * j + k * k),
        s * (i * j - w * k),
        s * (i * k + w * j),
        s * (i * j + w * k),
        one - s * (i * i + k * k),
        s * (j * k - w * i),
        s * (i * k - w * j),
        s * (j * k + w * i),
        one - s * (i * i + j * j),
    )
}

/// Two unit vectors that make a right-handed frame with the unit vector `d`.
#[inline]
fn across<S: Scalar>(d: &Vector3<S>) -> (Vector3<S>, Vector3<S>) {
    // the world axis that is farthest from d
    let size = d.map(|c| c.re().abs());
    let axis = Vector3::from_fn(|i, _| S::lift(if i == size.imin() { 1.0 } else { 0.0 }));
    let e_1 = (axis - d * d.dot(&axis)).normalize();
    (e_1, d.cross(&e_1))
}

fn vector<S: Scalar>(x: &[S]) -> Vector3<S> {
    Vector3::new(x[0], x[1], x[2])
}

impl Joint<3, 3> for Spatial {
    type Pose<S: Scalar> = SpatialPose<S>;

    #[inline]
    fn states(&self) -> usize {
        match self {
            Self::Revolute { .. } => 2,
            Self::Universal => 4,
            Self::Spherical => 7,
            Self::SphericalRod => 6,
        }
    }

    #[inline]
    fn coordinates(&self) -> usize {
        match self {
            Self::Revolute { .. } => 1,
            Self::Universal => 2,
            Self::Spherical => 4,
            Self::SphericalRod => 3,
        }
    }

    #[inline]
    fn pose<S: Scalar>(&self, x: &[S]) -> SpatialPose<S> {
        let o = Vector3::zeros();
        match self {
            Self::Revolute { phi } => {
                let (R, axis, _) = link_frame(S::lift(*phi), x[0]);
                let H = Matrix3::from_columns(&[axis, o, o]);
                SpatialPose { R, H, axes: 1, gamma: o, omega: axis * x[1] }
            }
            Self::Universal => {
                let (phi_dot, theta_dot) = (x[2], x[3]);
                let (R, axis, azimuth) = link_frame(x[0], x[1]);
                let z = Vector3::new(S::lift(0.0), S::lift(0.0), S::lift(1.0));
                SpatialPose {
                    R,
                    H: Matrix3::from_columns(&[z, axis, o]),
                    axes: 2,
                    gamma: azimuth * (phi_dot * theta_dot),
                    omega: z * phi_dot + axis * theta_dot,
                }
            }
            Self::Spherical => SpatialPose {
                R: rotation(&x[..4]),
                H: Matrix3::identity(),
                axes: 3,
                gamma: o,
                omega: vector(&x[4..]),
            },
            Self::SphericalRod => {
                let d = vector(x).normalize();
                let omega = vector(&x[3..]);
                let (e_1, e_2) = across(&d);
                SpatialPose {
                    R: Matrix3::from_columns(&[d, e_1, e_2]),
                    H: Matrix3::from_columns(&[e_1, e_2, o]),
                    axes: 2,
                    gamma: o,
                    omega: omega - d * d.dot(&omega),
                }
            }
        }
    }

    #[inline]
    fn derivative<S: Scalar>(&self, x: &[S], q_ddot: &Vector3<S>, x_dot: &mut [S]) {
        match self {
            Self::Revolute { .. } => x_dot.copy_from_slice(&[x[1], q_ddot[0]]),
            Self::Universal => x_dot.copy_from_slice(&[x[2], x[3], q_ddot[0], q_ddot[1]]),
            Self::Spherical => {
                x_dot[..4].copy_from_slice(&quaternion_rate(&x[..4], &x[4..]));
                x_dot[4..].copy_from_slice(q_ddot.as_slice());
            }
            Self::SphericalRod => {
                let pose = self.pose(x);
                x_dot[..3].copy_from_slice(pose.omega.cross(&vector(x)).as_slice());
                x_dot[3..].copy_from_slice((pose.H * q_ddot).as_slice());
            }
        }
    }

    #[inline]
    fn shift(&self, x: &mut [f64], dq: &Vector3<f64>) {
        match self {
            Self::Revolute { .. } => x[0] += dq[0],
            Self::Universal => {
                x[0] += dq[0];
                x[1] += dq[1];
            }
            Self::Spherical => {
                let d = quaternion_rate(&x[..4], dq.as_slice());
                for (p, d) in x.iter_mut().zip(d) {
                    *p += d;
                }
                self.normalise(x);
            }
            Self::SphericalRod => {
                let turn = self.pose(x).H * dq;
                let d = vector(x) + turn.cross(&vector(x));
                x[..3].copy_from_slice(d.as_slice());
                self.normalise(x);
            }
        }
    }

    #[inline]
    fn push(&self, x: &mut [f64], dq_dot: &Vector3<f64>) {
        let change = match self {
            Self::SphericalRod => self.pose(x).H * dq_dot,
            _ => *dq_dot,
        };
        for (rate, d) in x[self.coordinates()..].iter_mut().zip(change.iter()) {
            *rate += d;
        }
    }

    #[inline]
    fn normalise(&self, x: &mut [f64]) -> bool {
        let unit = |x: &mut [f64]| {
            let norm = x.iter().map(|p| p * p).sum::<f64>().sqrt();
            for p in &mut *x {
                *p /= norm;
            }
            (norm - 1.0).abs() > 4.0 * f64::EPSILON
        };
        match self {
            Self::Spherical => unit(&mut x[..4]),
            Self::SphericalRod => {
                let changed = unit(&mut x[..3]);
                let (d, omega) = (vector(x), vector(&x[3..]));
                let along = d.dot(&omega);
                x[3..].copy_from_slice((omega - d * along).as_slice());
                changed || along.abs() > 4.0 * f64::EPSILON * omega.norm()
            }
            _ => false,
        }
    }

    #[inline]
    fn off_manifold(&self, x: &[f64]) -> f64 {
        let off = |x: &[f64]| (x.iter().map(|p| p * p).sum::<f64>().sqrt() - 1.0).abs();
        match self {
            Self::Spherical => off(&x[..4]),
            Self::SphericalRod => off(&x[..3]).max(vector(x).dot(&vector(&x[3..])).abs()),
            _ => 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Planar;
    use nalgebra::Vector2;
    use num_dual::Dual64;
    use proptest::prelude::*;

    fn rigid() -> Rigid<3> {
        Rigid {
            m: 2.0,
            c: Vector3::new(0.1, -0.2, 0.3),
            I_c: Matrix3::new(1.2, 0.1, 0.0, 0.1, 0.8, -0.2, 0.0, -0.2, 0.9),
        }
    }

    /// Points move as dual numbers say: v and the acceleration J q'' + c are the first and second
    /// derivative of r along x(t), whatever the joint kind.
    fn kinematics_agree(joint: Spatial, x: &[f64], a: [f64; 3]) -> Result<(), TestCaseError> {
        // a rod without spin has its points on its axis
        let p = if joint == Spatial::SphericalRod {
            Vector3::new(0.6, 0.0, 0.0)
        } else {
            Vector3::new(0.3, -0.1, 0.7)
        };
        let q_ddot = Vector3::from(a);
        let mut x = x[..joint.states()].to_vec();
        joint.normalise(&mut x);
        let mut x_dot = vec![0.0; joint.states()];
        joint.derivative(&x, &q_ddot, &mut x_dot);
        let along: Vec<Dual64> = x.iter().zip(&x_dot).map(|(x, d)| Dual64::new(*x, *d)).collect();
        let moving = joint.pose(&along).point(&p);
        let now: Point<f64, 3, 3> = joint.pose(&x).point(&p);
        let a = now.J * q_ddot + now.c;
        for i in 0..3 {
            prop_assert!((moving.r[i].eps - now.v[i]).abs() < 1e-13);
            prop_assert!((moving.v[i].eps - a[i]).abs() < 1e-12);
        }
        // rounding of the products in a norm and a scalar product
        let size = x.iter().map(|p| p * p).sum::<f64>().sqrt();
        prop_assert!(joint.off_manifold(&x) < 4.0 * f64::EPSILON * (1.0 + size));
        Ok(())
    }

    proptest! {
        #[test]
        fn points_move_as_their_derivatives_say(x in prop::array::uniform7(-1.5..1.5), a in prop::array::uniform3(-2.0..2.0)) {
            prop_assume!(x[..3].iter().map(|p| p * p).sum::<f64>() > 1e-2);
            for joint in [Spatial::Revolute { phi: x[2] }, Spatial::Universal, Spatial::Spherical, Spatial::SphericalRod] {
                kinematics_agree(joint, &x, a)?;
            }
        }

        /// The moment about the joint is the rate of angular momentum: H^T d(J_A omega)/dt = Mq q'' - Q.
        #[test]
        fn gyroscopic_force_is_the_rate_of_angular_momentum(x in prop::array::uniform4(-1.4..1.4), a in prop::array::uniform2(-2.0..2.0)) {
            let q_ddot = Vector3::new(a[0], a[1], 0.0);
            let mut x_dot = [0.0; 4];
            Spatial::Universal.derivative(&x, &q_ddot, &mut x_dot);
            let along: Vec<Dual64> = x.iter().zip(&x_dot).map(|(x, d)| Dual64::new(*x, *d)).collect();
            let pose = Spatial::Universal.pose(&along);
            let momentum = pose.inertia(&rigid()) * pose.omega;
            let pose = Spatial::Universal.pose(&x);
            let body = pose.body(&rigid());
            let moment = pose.H.transpose() * momentum.map(|l| l.eps);
            let law = body.Mq * q_ddot - body.Q;
            prop_assert!((moment - law).norm() < 1e-12 * (1.0 + law.norm()));
        }

        /// A planar element is a revolute one in the plane x-z.
        #[test]
        fn planar_is_revolute_in_the_plane(theta in -3.0..3.0, rate in -5.0..5.0, px in -1.0..1.0, pz in -1.0..1.0) {
            let plane: Point<f64, 2, 1> = Planar.pose(&[theta, rate]).point(&Vector2::new(px, pz));
            let space: Point<f64, 3, 3> = Spatial::Revolute { phi: 0.0 }.pose(&[theta, rate]).point(&Vector3::new(px, 0.0, pz));
            for (i, k) in [(0, 0), (1, 2)] {
                prop_assert!((plane.r[i] - space.r[k]).abs() < 1e-15);
                prop_assert!((plane.v[i] - space.v[k]).abs() < 1e-14);
                prop_assert!((plane.J[i] - space.J[k]).abs() < 1e-15);
                prop_assert!((plane.c[i] - space.c[k]).abs() < 1e-13);
            }
            prop_assert!(space.r.y.abs() < 1e-15);
        }
    }

    /// theta > 0 lifts the tip: the sign convention of (1) in one place.
    #[test]
    fn positive_theta_lifts_the_tip() {
        let tip = Spatial::Universal.pose(&[0.0, 0.1, 0.0, 0.0]).point(&Vector3::new(1.0, 0.0, 0.0));
        assert!(tip.r.z > 0.0 && tip.r.x > 0.0);
        let tip: Point<f64, 2, 1> = Planar.pose(&[0.1, 0.0]).point(&Vector2::new(1.0, 0.0));
        assert!(tip.r.y > 0.0);
    }
}
