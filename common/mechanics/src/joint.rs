//! Joint kinds: how the coordinates of an element turn and move its points.
//!
//! ```text
//! R = [ ct cp, -sp, -st cp ; ct sp, cp, -st sp ; st, 0, ct ]            (1)
//! omega = H q',  H = [ z_E, -y_i ],  y_i = (-sp, cp, 0)                 (2)
//! alpha = H q'' + gamma,  gamma = phi' theta' (cp, sp, 0)               (3)
//! ```
//!
//! | kind | N | H | gamma | state |
//! | --- | --- | --- | --- | --- |
//! | planar, revolute | 1 | -y_i | 0 | theta, rate |
//! | universal | 2 | (2) | (3) | phi, theta, rates |
//! | spherical | 3 | 1 | 0 | unit quaternion (body to world, w x y z), omega |
//!
//! The body x axis points from joint to tip for links; theta > 0 lifts the tip. All orientations
//! refer to the world frame E, not to the leader.

use nalgebra::{Matrix3, SVector, Vector2, Vector3};

use crate::{Body, Matrix, Point, Scalar, Vector, scalar::lift};

/// Mass properties of a rigid element in body axes, from its joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rigid<const D: usize> {
    /// Mass [kg], > 0
    pub m: f64,
    /// Joint to centre of mass [m]
    pub c: Vector<f64, D>,
    /// Inertia about the centre of mass [kg.m2]; plane motion uses yy only
    pub I_c: Matrix3<f64>,
}

/// The position and velocity of an element as its joint gives them.
pub trait Pose<S, const D: usize, const N: usize> {
    /// A point given by its body vector from the joint.
    fn point(&self, p: &Vector<f64, D>) -> Point<S, D, N>;
    /// The inertia of the element about its joint, (4) and the last two terms of (5).
    fn body(&self, rigid: &Rigid<D>) -> Body<S, D, N>;
    /// Rotational energy about the centre of mass [J].
    fn spin_energy(&self, rigid: &Rigid<D>) -> S;
}

/// A joint kind with `N` degrees of freedom in the space of dimension `D`.
pub trait Joint<const D: usize, const N: usize>: Copy {
    /// Number of states: coordinates first, then rates.
    const STATES: usize;
    /// Number of coordinates among the states.
    const COORDINATES: usize;
    /// Position and velocity.
    type Pose<S: Scalar>: Pose<S, D, N>;
    /// Pose at the joint's states `x`.
    fn pose<S: Scalar>(&self, x: &[S]) -> Self::Pose<S>;
    /// Time derivative of the states, given q''.
    fn derivative<S: Scalar>(&self, x: &[S], q_ddot: &Vector<S, N>, x_dot: &mut [S]);
    /// Move the coordinates by dq.
    fn shift(&self, x: &mut [f64], dq: &Vector<f64, N>);
    /// Bring the coordinates back on their manifold; true if they were off by more than rounding.
    fn normalise(&self, _x: &mut [f64]) -> bool {
        false
    }
    /// Change the rates by dq'.
    #[inline]
    fn push(&self, x: &mut [f64], dq_dot: &Vector<f64, N>) {
        for (rate, d) in x[Self::COORDINATES..].iter_mut().zip(dq_dot.iter()) {
            *rate += d;
        }
    }
}

/// Rotation in the plane x-z.
#[derive(Debug, Clone, Copy)]
pub struct Planar;

/// Pose of a planar element.
#[derive(Debug, Clone, Copy)]
pub struct PlanarPose<S> {
    sin: S,
    cos: S,
    theta_dot: S,
}

impl<S: Scalar> Pose<S, 2, 1> for PlanarPose<S> {
    #[inline]
    fn point(&self, p: &Vector<f64, 2>) -> Point<S, 2, 1> {
        let Self { sin, cos, theta_dot } = *self;
        let r = Vector2::new(cos * p.x - sin * p.y, sin * p.x + cos * p.y);
        let n = Vector2::new(-r.y, r.x);
        Point {
            r,
            v: n * theta_dot,
            J: n,
            c: -r * (theta_dot * theta_dot),
        }
    }
    #[inline]
    fn body(&self, rigid: &Rigid<2>) -> Body<S, 2, 1> {
        let J_y = rigid.I_c[(1, 1)] + rigid.m * rigid.c.norm_squared();
        Body {
            m: S::lift(rigid.m),
            com: self.point(&rigid.c),
            Mq: Matrix::<S, 1, 1>::new(S::lift(J_y)),
            Q: Vector::<S, 1>::zeros(),
        }
    }
    #[inline]
    fn spin_energy(&self, rigid: &Rigid<2>) -> S {
        self.theta_dot * self.theta_dot * (0.5 * rigid.I_c[(1, 1)])
    }
}

/// Coordinates and rates of a joint whose coordinates are angles.
macro_rules! angle_coordinates {
    ($n:literal) => {
        const STATES: usize = 2 * $n;
        const COORDINATES: usize = $n;
        #[inline]
        fn derivative<S: Scalar>(&self, x: &[S], q_ddot: &SVector<S, $n>, x_dot: &mut [S]) {
            x_dot[..$n].copy_from_slice(&x[$n..]);
            x_dot[$n..].copy_from_slice(q_ddot.as_slice());
        }
        #[inline]
        fn shift(&self, x: &mut [f64], dq: &SVector<f64, $n>) {
            for (q, d) in x.iter_mut().zip(dq.iter()) {
                *q += d;
            }
        }
    };
}

impl Joint<2, 1> for Planar {
    type Pose<S: Scalar> = PlanarPose<S>;
    #[inline]
    fn pose<S: Scalar>(&self, x: &[S]) -> PlanarPose<S> {
        let (sin, cos) = x[0].sin_cos();
        PlanarPose {
            sin,
            cos,
            theta_dot: x[1],
        }
    }
    angle_coordinates!(1);
}

/// Pose of an element in space.
#[derive(Debug, Clone, Copy)]
pub struct SpatialPose<S, const N: usize> {
    /// Body to world (1)
    pub R: Matrix3<S>,
    /// Joint axes, world frame (2)
    pub H: Matrix<S, 3, N>,
    /// Angular acceleration at q'' = 0, world frame (3) [rad/s2]
    pub gamma: Vector3<S>,
    /// Angular velocity, world frame [rad/s]
    pub omega: Vector3<S>,
}

impl<S: Scalar, const N: usize> Pose<S, 3, N> for SpatialPose<S, N> {
    #[inline]
    fn point(&self, p: &Vector<f64, 3>) -> Point<S, 3, N> {
        let Self { R, H, gamma, omega } = self;
        let r = R * lift(p);
        let mut J = Matrix::<S, 3, N>::zeros();
        for (mut column, axis) in J.column_iter_mut().zip(H.column_iter()) {
            column.copy_from(&axis.cross(&r));
        }
        let v = omega.cross(&r);
        Point {
            r,
            v,
            J,
            c: gamma.cross(&r) + omega.cross(&v),
        }
    }
    #[inline]
    fn body(&self, rigid: &Rigid<3>) -> Body<S, 3, N> {
        let Self { R, H, gamma, omega } = self;
        let Rigid { m, c, I_c } = rigid;
        let about_joint = I_c + (Matrix3::identity() * c.norm_squared() - c * c.transpose()) * *m;
        let J_A = R * lift(&about_joint) * R.transpose(); // (4)
        let torque = omega.cross(&(J_A * omega)) + J_A * gamma; // (5)
        Body {
            m: S::lift(*m),
            com: self.point(c),
            Mq: H.transpose() * J_A * H,
            Q: -(H.transpose() * torque),
        }
    }
    #[inline]
    fn spin_energy(&self, rigid: &Rigid<3>) -> S {
        let omega = self.R.transpose() * self.omega;
        omega.dot(&(lift(&rigid.I_c) * omega)) * 0.5
    }
}

/// Link orientation (1) and the second joint axis -y_i.
#[inline]
fn link_frame<S: Scalar>(phi: S, theta: S) -> (Matrix3<S>, Vector3<S>, Vector3<S>) {
    let (sp, cp) = phi.sin_cos();
    let (st, ct) = theta.sin_cos();
    let o = S::lift(0.0);
    let R = Matrix3::new(ct * cp, -sp, -st * cp, ct * sp, cp, -st * sp, st, o, ct);
    (R, Vector3::new(sp, -cp, o), Vector3::new(cp, sp, o))
}

/// Rotation about -y_i, the horizontal axis at the fixed azimuth `phi`.
#[derive(Debug, Clone, Copy)]
pub struct Revolute {
    /// Azimuth of the link [rad]
    pub phi: f64,
}

impl Joint<3, 1> for Revolute {
    type Pose<S: Scalar> = SpatialPose<S, 1>;
    #[inline]
    fn pose<S: Scalar>(&self, x: &[S]) -> SpatialPose<S, 1> {
        let (theta, theta_dot) = (x[0], x[1]);
        let (R, axis, _) = link_frame(S::lift(self.phi), theta);
        SpatialPose {
            R,
            H: axis,
            gamma: Vector3::zeros(),
            omega: axis * theta_dot,
        }
    }
    angle_coordinates!(1);
}

/// The paper's rod: azimuth phi about z_E, then elevation theta about -y_i.
#[derive(Debug, Clone, Copy)]
pub struct Universal;

impl Joint<3, 2> for Universal {
    type Pose<S: Scalar> = SpatialPose<S, 2>;
    #[inline]
    fn pose<S: Scalar>(&self, x: &[S]) -> SpatialPose<S, 2> {
        let (phi, theta, phi_dot, theta_dot) = (x[0], x[1], x[2], x[3]);
        let (R, axis, azimuth) = link_frame(phi, theta);
        let z = Vector3::new(S::lift(0.0), S::lift(0.0), S::lift(1.0));
        SpatialPose {
            R,
            H: Matrix::<S, 3, 2>::from_columns(&[z, axis]),
            gamma: azimuth * (phi_dot * theta_dot),
            omega: z * phi_dot + axis * theta_dot,
        }
    }
    angle_coordinates!(2);
}

/// Free rotation; the state is the unit quaternion body to world (w, x, y, z) and omega in the world.
#[derive(Debug, Clone, Copy)]
pub struct Spherical;

/// Derivative of a quaternion under the world angular velocity: p' = 1/2 (0, omega) o p.
#[inline]
fn quaternion_rate<S: Scalar>(p: &[S], omega: &[S]) -> [S; 4] {
    let (w, x, y, z) = (p[0], p[1], p[2], p[3]);
    let (a, b, c) = (omega[0] * 0.5, omega[1] * 0.5, omega[2] * 0.5);
    [
        -a * x - b * y - c * z,
        a * w + b * z - c * y,
        b * w + c * x - a * z,
        c * w + a * y - b * x,
    ]
}

impl Joint<3, 3> for Spherical {
    const STATES: usize = 7;
    const COORDINATES: usize = 4;
    type Pose<S: Scalar> = SpatialPose<S, 3>;
    #[inline]
    fn pose<S: Scalar>(&self, x: &[S]) -> SpatialPose<S, 3> {
        let (w, i, j, k) = (x[0], x[1], x[2], x[3]);
        let s = S::lift(2.0) / (w * w + i * i + j * j + k * k);
        let one = S::lift(1.0);
        let R = Matrix3::new(
            one - s * (j * j + k * k),
            s * (i * j - w * k),
            s * (i * k + w * j),
            s * (i * j + w * k),
            one - s * (i * i + k * k),
            s * (j * k - w * i),
            s * (i * k - w * j),
            s * (j * k + w * i),
            one - s * (i * i + j * j),
        );
        SpatialPose {
            R,
            H: Matrix3::identity(),
            gamma: Vector3::zeros(),
            omega: Vector3::new(x[4], x[5], x[6]),
        }
    }
    #[inline]
    fn derivative<S: Scalar>(&self, x: &[S], q_ddot: &Vector<S, 3>, x_dot: &mut [S]) {
        x_dot[..4].copy_from_slice(&quaternion_rate(&x[..4], &x[4..]));
        x_dot[4..].copy_from_slice(q_ddot.as_slice());
    }
    #[inline]
    fn shift(&self, x: &mut [f64], dq: &Vector<f64, 3>) {
        let d = quaternion_rate(&x[..4], dq.as_slice());
        for (p, d) in x.iter_mut().zip(d) {
            *p += d;
        }
        self.normalise(x);
    }
    #[inline]
    fn normalise(&self, x: &mut [f64]) -> bool {
        let norm = x[..4].iter().map(|p| p * p).sum::<f64>().sqrt();
        for p in &mut x[..4] {
            *p /= norm;
        }
        (norm - 1.0).abs() > 4.0 * f64::EPSILON
    }
}

#[cfg(test)]
mod tests {
    use super::*;
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
    fn kinematics_agree<const N: usize, J: Joint<3, N>>(
        joint: J,
        x: &[f64],
        q_ddot: [f64; 3],
    ) -> Result<(), TestCaseError> {
        let p = Vector3::new(0.3, -0.1, 0.7);
        let q_ddot = Vector::<f64, N>::from_column_slice(&q_ddot[..N]);
        let mut x_dot = vec![0.0; J::STATES];
        joint.derivative(x, &q_ddot, &mut x_dot);
        let along: Vec<Dual64> = x.iter().zip(&x_dot).map(|(x, d)| Dual64::new(*x, *d)).collect();
        let moving = joint.pose(&along).point(&p);
        let now = joint.pose(x).point(&p);
        let a = now.J * q_ddot + now.c;
        for i in 0..3 {
            prop_assert!((moving.r[i].eps - now.v[i]).abs() < 1e-13);
            prop_assert!((moving.v[i].eps - a[i]).abs() < 1e-12);
        }
        Ok(())
    }

    proptest! {
        #[test]
        fn points_move_as_their_derivatives_say(x in prop::array::uniform7(-1.5..1.5), a in prop::array::uniform3(-2.0..2.0)) {
            kinematics_agree(Revolute { phi: x[2] }, &x[..2], a)?;
            kinematics_agree(Universal, &x[..4], a)?;
            let mut q = x;
            prop_assume!(q[..4].iter().map(|p| p * p).sum::<f64>() > 1e-2);
            Spherical.normalise(&mut q);
            kinematics_agree(Spherical, &q, a)?;
        }

        /// The moment about the joint is the rate of angular momentum: H^T d(J_A omega)/dt = Mq q'' - Q.
        #[test]
        fn gyroscopic_force_is_the_rate_of_angular_momentum(x in prop::array::uniform4(-1.4..1.4), a in prop::array::uniform2(-2.0..2.0)) {
            let q_ddot = Vector2::new(a[0], a[1]);
            let mut x_dot = [0.0; 4];
            Universal.derivative(&x, &q_ddot, &mut x_dot);
            let along: Vec<Dual64> = x.iter().zip(&x_dot).map(|(x, d)| Dual64::new(*x, *d)).collect();
            let pose = Universal.pose(&along);
            let Rigid { m, c, I_c } = rigid();
            let about_joint = I_c + (Matrix3::identity() * c.norm_squared() - c * c.transpose()) * m;
            let momentum = pose.R * lift::<Dual64, 3, 3>(&about_joint) * pose.R.transpose() * pose.omega;
            let pose = Universal.pose(&x);
            let body = pose.body(&rigid());
            let moment = pose.H.transpose() * momentum.map(|l| l.eps);
            let law = body.Mq * q_ddot - body.Q;
            prop_assert!((moment - law).norm() < 1e-12 * (1.0 + law.norm()));
        }

        /// A planar element is a revolute one in the plane x-z.
        #[test]
        fn planar_is_revolute_in_the_plane(theta in -3.0..3.0, rate in -5.0..5.0, px in -1.0..1.0, pz in -1.0..1.0) {
            let plane: Point<f64, 2, 1> = Planar.pose(&[theta, rate]).point(&Vector2::new(px, pz));
            let space: Point<f64, 3, 1> = Revolute { phi: 0.0 }.pose(&[theta, rate]).point(&Vector3::new(px, 0.0, pz));
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
        let tip = Universal
            .pose(&[0.0, 0.1, 0.0, 0.0])
            .point(&Vector3::new(1.0, 0.0, 0.0));
        assert!(tip.r.z > 0.0 && tip.r.x > 0.0);
        let tip = Planar.pose(&[0.1, 0.0]).point(&Vector2::new(1.0, 0.0));
        assert!(tip.r.y > 0.0);
    }
}
