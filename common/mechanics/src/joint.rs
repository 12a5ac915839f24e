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
//! | spherical_rod | 2 | two columns across d | 0 | unit vector d along the rod, omega across d |
//!
//! The body x axis points from joint to tip for links; theta > 0 lifts the tip. All orientations
//! refer to the world frame E, not to the leader.

use nalgebra::{Matrix3, Vector2, Vector3};

use crate::{Body, Matrix, Point, Scalar, Vector};

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
    /// The generalised force of a moment on the element, world frame.
    fn drive(&self, torque: &Vector3<S>) -> Vector<S, N>;
    /// Angular velocity, world frame [rad/s].
    fn omega(&self) -> Vector3<S>;
    /// Rate of the moment of momentum about the joint, J_A alpha + omega x J_A omega [N.m].
    fn momentum_rate(&self, rigid: &Rigid<D>, q_ddot: &Vector<S, N>) -> Vector3<S>;
}

/// A joint kind with `N` degrees of freedom in the space of dimension `D`.
pub trait Joint<const D: usize, const N: usize>: Copy {
    /// Number of states: coordinates first, then rates.
    fn states(&self) -> usize;
    /// Number of coordinates among the states.
    fn coordinates(&self) -> usize;
    /// Position and velocity.
    type Pose<S: Scalar>: Pose<S, D, N> + Copy;
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
    /// How far the coordinates are off their manifold.
    fn off_manifold(&self, _x: &[f64]) -> f64 {
        0.0
    }
    /// Change the rates by dq'.
    #[inline]
    fn push(&self, x: &mut [f64], dq_dot: &Vector<f64, N>) {
        for (rate, d) in x[self.coordinates()..].iter_mut().zip(dq_dot.iter()) {
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
        Point { r, v: n * theta_dot, J: n, c: -r * (theta_dot * theta_dot) }
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
    #[inline]
    fn drive(&self, torque: &Vector3<S>) -> Vector<S, 1> {
        Vector::<S, 1>::new(-torque.y)
    }
    #[inline]
    fn omega(&self) -> Vector3<S> {
        Vector3::new(S::lift(0.0), -self.theta_dot, S::lift(0.0))
    }
    #[inline]
    fn momentum_rate(&self, rigid: &Rigid<2>, q_ddot: &Vector<S, 1>) -> Vector3<S> {
        let J_y = rigid.I_c[(1, 1)] + rigid.m * rigid.c.norm_squared();
        Vector3::new(S::lift(0.0), -q_ddot[0] * J_y, S::lift(0.0))
    }
}

impl Joint<2, 1> for Planar {
    type Pose<S: Scalar> = PlanarPose<S>;
    #[inline]
    fn states(&self) -> usize {
        2
    }
    #[inline]
    fn coordinates(&self) -> usize {
        1
    }
    #[inline]
    fn pose<S: Scalar>(&self, x: &[S]) -> PlanarPose<S> {
        let (sin, cos) = x[0].sin_cos();
        PlanarPose { sin, cos, theta_dot: x[1] }
    }
    #[inline]
    fn derivative<S: Scalar>(&self, x: &[S], q_ddot: &Vector<S, 1>, x_dot: &mut [S]) {
        x_dot[0] = x[1];
        x_dot[1] = q_ddot[0];
    }
    #[inline]
    fn shift(&self, x: &mut [f64], dq: &Vector<f64, 1>) {
        x[0] += dq[0];
    }
}
