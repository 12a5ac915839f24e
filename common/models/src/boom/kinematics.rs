//! Frames of the links, velocities and accelerations of their ends.
//!
//! ```text
//! (i-1)T_i = Rz(q_i + theta_i) Trans(0, 0, d_i) Trans(a_i, 0, 0) Rx(alpha_i)                       (B1)
//! W T_i = W T_0 (0)T_1 ... (i-1)T_i;   o_i, z_i: origin and z axis of K_i                          (B2)
//! alpha <- alpha + z_(i-1) q_i'' + omega x z_(i-1) q_i',   omega <- omega + z_(i-1) q_i'
//! v <- v + omega x r,   a <- a + alpha x r + omega x (omega x r),   r = o_i - o_(i-1)              (B3)
//! J_i(p) = z_(i-1) x (p - o_(i-1))                                                                 (B4)
//! rho_ik = |J_i(o_k)|                                                                             (B12)
//! ```

use mechanics::Scalar;
use model::Vector3;

use super::machine::{JOINTS, Machine};

/// Frames K_0 to K_6 in the world.
#[derive(Debug, Clone, Copy)]
pub struct Frames<S> {
    /// Axes x, y, z of each frame
    pub axes: [[Vector3<S>; 3]; JOINTS + 1],
    /// Origins [m]
    pub o: [Vector3<S>; JOINTS + 1],
}

/// Velocities of the frames.
#[derive(Debug, Clone, Copy)]
pub struct Velocities<S> {
    /// Angular velocities [rad/s]
    pub omega: [Vector3<S>; JOINTS + 1],
    /// Velocities of the origins [m/s]
    pub v: [Vector3<S>; JOINTS + 1],
}

/// What the Denavit-Hartenberg parameters give once and for all.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Chain {
    base: ([f64; 2], Vector3<f64>),
    theta: [f64; JOINTS],
    d: [f64; JOINTS],
    a: [f64; JOINTS],
    twist: [(f64, f64); JOINTS],
}

impl Chain {
    /// The chain of a machine.
    #[must_use]
    pub fn new(machine: &Machine) -> Self {
        let (sin, cos) = machine.yaw.sin_cos();
        Self {
            base: ([cos, sin], machine.base),
            theta: machine.links.map(|l| l.theta_offset),
            d: machine.links.map(|l| l.d),
            a: machine.links.map(|l| l.a),
            twist: machine.links.map(|l| l.alpha.sin_cos()),
        }
    }

    /// The frames at the joint angles `q` (B1, B2).
    #[inline]
    pub fn frames<S: Scalar>(&self, q: &[S; JOINTS]) -> Frames<S> {
        let ([cos, sin], origin) = self.base;
        let lift = |x: f64, y: f64, z: f64| Vector3::new(S::lift(x), S::lift(y), S::lift(z));
        let mut axes = [[lift(cos, sin, 0.0), lift(-sin, cos, 0.0), lift(0.0, 0.0, 1.0)]; JOINTS + 1];
        let mut o = [lift(origin.x, origin.y, origin.z); JOINTS + 1];
        for i in 0..JOINTS {
            let [x, y, z] = axes[i];
            let (sin, cos) = (q[i] + self.theta[i]).sin_cos();
            let (sin_alpha, cos_alpha) = self.twist[i];
            let along = x * cos + y * sin;
            let across = y * cos - x * sin;
            let lift = |f: f64| S::lift(f);
            axes[i + 1] = [
                along,
                across * lift(cos_alpha) + z * lift(sin_alpha),
                z * lift(cos_alpha) - across * lift(sin_alpha),
            ];
            o[i + 1] = o[i] + z * lift(self.d[i]) + along * lift(self.a[i]);
        }
        Frames { axes, o }
    }
}

impl<S: Scalar> Frames<S> {
    /// Axis of joint `i`, counted from 0.
    #[inline]
    pub fn axis(&self, i: usize) -> &Vector3<S> {
        &self.axes[i][2]
    }

    /// A point of frame `k` in the world.
    #[inline]
    pub fn point(&self, k: usize, p: &Vector3<S>) -> Vector3<S> {
        self.o[k] + self.turned(k, p)
    }

    /// A vector of frame `k` in the world.
    #[inline]
    pub fn turned(&self, k: usize, p: &Vector3<S>) -> Vector3<S> {
        let [x, y, z] = &self.axes[k];
        x * p.x + y * p.y + z * p.z
    }

    /// Column of joint `i` in the Jacobian of the point `p` on a later link (B4).
    #[inline]
    pub fn column(&self, i: usize, p: &Vector3<S>) -> Vector3<S> {
        self.axis(i).cross(&(p - self.o[i]))
    }

    /// Lever of joint `i` for the origin of K_k (B12) [m].
    #[inline]
    pub fn lever(&self, i: usize, k: usize) -> S {
        root(self.column(i, &self.o[k]).norm_squared())
    }

    /// Largest lever of joint `i` among the later origins, and which one.
    #[inline]
    pub fn longest_lever(&self, i: usize) -> (S, usize) {
        let square = |k: usize| self.column(i, &self.o[k]).norm_squared();
        let mut longest = (square(i + 1), i + 1);
        for k in i + 2..=JOINTS {
            let candidate = square(k);
            if candidate > longest.0 {
                longest = (candidate, k);
            }
        }
        (root(longest.0), longest.1)
    }

    /// Velocities at the rates `q_dot` (B3).
    #[inline]
    pub fn velocities(&self, q_dot: &[S; JOINTS]) -> Velocities<S> {
        let mut omega = [Vector3::zeros(); JOINTS + 1];
        let mut v = [Vector3::zeros(); JOINTS + 1];
        for i in 0..JOINTS {
            omega[i + 1] = omega[i] + self.axis(i) * q_dot[i];
            v[i + 1] = v[i] + omega[i + 1].cross(&(self.o[i + 1] - self.o[i]));
        }
        Velocities { omega, v }
    }

    /// Accelerations of the origins (B3) [m/s2].
    #[inline]
    pub fn accelerations(
        &self,
        Velocities { omega, .. }: &Velocities<S>,
        q_dot: &[S; JOINTS],
        q_ddot: &[S; JOINTS],
    ) -> [Vector3<S>; JOINTS + 1] {
        let mut alpha = Vector3::zeros();
        let mut a = [Vector3::zeros(); JOINTS + 1];
        for i in 0..JOINTS {
            let z = self.axis(i);
            alpha += z * q_ddot[i] + omega[i].cross(z) * q_dot[i];
            let r = self.o[i + 1] - self.o[i];
            a[i + 1] = a[i] + alpha.cross(&r) + omega[i + 1].cross(&omega[i + 1].cross(&r));
        }
        a
    }

    /// Time derivative of the lever of joint `i` for the origin of K_k [m/s].
    pub fn lever_rate(&self, i: usize, k: usize, Velocities { omega, v }: &Velocities<S>) -> S {
        let (z, r) = (self.axis(i), self.o[k] - self.o[i]);
        let arm = z.cross(&r);
        let rate = omega[i].cross(z).cross(&r) + z.cross(&(v[k] - v[i]));
        arm.dot(&rate) / root(arm.norm_squared())
    }
}

/// Square root whose derivative at zero is zero, not infinite.
fn root<S: Scalar>(square: S) -> S {
    if square.re() > 0.0 { square.sqrt() } else { S::lift(0.0) }
}
