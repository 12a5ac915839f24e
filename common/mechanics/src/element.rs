//! A rigid element that hangs at one joint: root port, loads at body points, a tip with unknown force.
//!
//! With the element's own coordinates q, a point k of the body moves as
//!
//! ```text
//! a_k = a_A + J_k q'' + c_k
//! ```
//!
//! and the element is the affine two-port (a_A, F_B) -> (F_A, a_B):
//!
//! ```text
//! Mq  = H^T J_A H + sum J_k^T M_k J_k                                   (12a)
//! K   = m J_c^T + sum J_k^T M_k
//! q'' = Mq^-1 (Q0 - K a_A + J_B^T F_B)                                  (6)
//! F_A = -M_AA a_A + G F_B + f,    a_B = G^T a_A + Y F_B + b             (10)
//! M_AA = m 1 + sum M_k - K^T Mq^-1 K,   f = F0 at a_A = 0               (12b)
//! G    = 1 - K^T Mq^-1 J_B^T,   Y = J_B Mq^-1 J_B^T                     (12c)
//! ```
//!
//! At every loaded point acts `F_k - M_k a_k`. Weight is the load `m g` at the centre of mass.
//! `M_AA` and `Y` are symmetric and positive semidefinite; the cross blocks are transposes of each
//! other (reciprocity).

use crate::{Matrix, Scalar, Vector};

/// A body point relative to the joint A.
#[derive(Debug, Clone, Copy)]
pub struct Point<S, const D: usize, const N: usize> {
    /// Position from A, world frame [m]
    pub r: Vector<S, D>,
    /// Velocity relative to A [m/s]
    pub v: Vector<S, D>,
    /// d v / d q'
    pub J: Matrix<S, D, N>,
    /// Acceleration relative to A at q'' = 0 [m/s2]
    pub c: Vector<S, D>,
}

impl<S: Scalar, const D: usize, const N: usize> Point<S, D, N> {
    /// The joint itself.
    #[must_use]
    pub fn zero() -> Self {
        Self { r: Vector::zeros(), v: Vector::zeros(), J: Matrix::zeros(), c: Vector::zeros() }
    }
}

/// Inertia of an element about its joint.
#[derive(Debug, Clone, Copy)]
pub struct Body<S, const D: usize, const N: usize> {
    /// Mass [kg]
    pub m: S,
    /// Centre of mass
    pub com: Point<S, D, N>,
    /// Generalised inertia about the joint, H^T J_A H
    pub Mq: Matrix<S, N, N>,
    /// Generalised gyroscopic force, -H^T (omega x J_A omega + J_A gamma)
    pub Q: Vector<S, N>,
}

/// A known load at a body point: the force `F - M a` with the point's own acceleration.
#[derive(Debug, Clone, Copy)]
pub struct Load<S, const D: usize> {
    /// Force at rest [N]
    pub F: Vector<S, D>,
    /// Inertia behind the point, symmetric [kg]; `None`: no inertia code is executed
    pub M: Option<Matrix<S, D, D>>,
}

impl<S, const D: usize> Load<S, D> {
    /// A force without inertia.
    #[inline]
    pub fn force(F: Vector<S, D>) -> Self {
        Self { F, M: None }
    }
}

/// Mq is not positive definite: the masses and inertias of the element admit no unique motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the inertia of the element about its joint is not positive definite")]
pub struct NotPositiveDefinite;

/// An element under construction: the loads are added one by one.
#[derive(Debug, Clone, Copy)]
pub struct Loaded<S, const D: usize, const N: usize> {
    Mq: Matrix<S, N, N>,
    Q0: Vector<S, N>,
    K: Matrix<S, N, D>,
    M: Matrix<S, D, D>,
    f: Vector<S, D>,
}

impl<S: Scalar, const D: usize, const N: usize> Loaded<S, D, N> {
    /// The element alone.
    #[inline]
    pub fn new(body: &Body<S, D, N>) -> Self {
        let Body { m, com, .. } = body;
        Self {
            Mq: body.Mq,
            Q0: body.Q,
            K: com.J.transpose() * *m,
            M: Matrix::<S, D, D>::from_diagonal_element(*m),
            f: -com.c * *m,
        }
    }

    /// Add a load at the body point `p` (12a).
    #[inline]
    pub fn add(&mut self, p: &Point<S, D, N>, load: &Load<S, D>) {
        let mut F = load.F;
        if let Some(M_k) = &load.M {
            let JtM = p.J.transpose() * M_k;
            self.Mq += JtM * p.J;
            self.K += JtM;
            self.M += M_k;
            F -= M_k * p.c;
        }
        self.Q0 += p.J.transpose() * F;
        self.f += F;
    }

    /// Add a generalised force, such as that of a drive torque.
    #[inline]
    pub fn drive(&mut self, Q: &Vector<S, N>) {
        self.Q0 += Q;
    }

    /// The element with all its loads, seen from its root (12b).
    ///
    /// # Errors
    /// [`NotPositiveDefinite`] if the generalised inertia has no Cholesky factor.
    #[inline]
    pub fn hinge(&self) -> Result<Hinged<S, D, N>, NotPositiveDefinite> {
        Ok(self.with_inverse(inverse_positive_definite(&self.Mq)?))
    }

    /// The element with its coordinates held, as if its inertia about the joint were infinite.
    #[inline]
    pub fn hold(&self) -> Hinged<S, D, N> {
        self.with_inverse(Matrix::<S, N, N>::zeros())
    }

    #[inline]
    fn with_inverse(&self, inverse: Matrix<S, N, N>) -> Hinged<S, D, N> {
        let Self { K, M, f, Q0, .. } = self;
        let Kq = inverse * K;
        let q0 = inverse * Q0; // (6) at a_A = 0
        let Kt = K.transpose();
        Hinged { M: M - Kt * Kq, f: f - Kt * q0, q0, Kq, inverse }
    }
}

/// An element with its loads, seen from its root.
#[derive(Debug, Clone, Copy)]
pub struct Hinged<S, const D: usize, const N: usize> {
    /// Effective inertia at the root, M_AA = A.M [kg]
    pub M: Matrix<S, D, D>,
    /// Force on the leader at a_A = 0, f = A.F0 [N]
    pub f: Vector<S, D>,
    /// q'' at a_A = 0
    pub q0: Vector<S, N>,
    /// Mq^-1 K: q'' falls by this times a_A
    pub Kq: Matrix<S, N, D>,
    inverse: Matrix<S, N, N>,
}

/// The change of an element by further forces.
#[derive(Debug, Clone, Copy)]
pub struct Answer<S, const D: usize, const N: usize, const R: usize> {
    /// Generalised force
    pub generalised: Matrix<S, N, R>,
    /// q'' at a_A = 0
    pub q: Matrix<S, N, R>,
    /// Force on the leader [N]
    pub f: Matrix<S, D, R>,
}

impl<S: Scalar, const D: usize, const N: usize> Hinged<S, D, N> {
    /// What further forces `F` at `p` change, several at once as columns: the generalised force, q''
    /// at a_A = 0, and the force on the leader (12c).
    #[inline]
    pub fn answer<const R: usize>(&self, p: &Point<S, D, N>, F: &Matrix<S, D, R>) -> Answer<S, D, N, R> {
        let generalised = p.J.transpose() * F;
        Answer { q: self.inverse * generalised, f: F - self.Kq.transpose() * generalised, generalised }
    }

    /// No element at all, to be overwritten.
    #[inline]
    pub(crate) fn zero() -> Self {
        Self {
            M: Matrix::zeros(),
            f: Vector::zeros(),
            q0: Vector::zeros(),
            Kq: Matrix::zeros(),
            inverse: Matrix::zeros(),
        }
    }

    /// q'' under the root acceleration `a_A` (6).
    #[inline]
    pub fn acceleration(&self, a_A: &Vector<S, D>) -> Vector<S, N> {
        self.q0 - self.Kq * a_A
    }

    /// Force on the leader (10).
    #[inline]
    pub fn root_force(&self, a_A: &Vector<S, D>) -> Vector<S, D> {
        self.f - self.M * a_A
    }
}

/// By Cholesky's factors; a single degree of freedom needs neither root nor factor.
#[inline]
fn inverse_positive_definite<S: Scalar, const N: usize>(
    Mq: &Matrix<S, N, N>,
) -> Result<Matrix<S, N, N>, NotPositiveDefinite> {
    if N == 1 {
        let positive = Mq[0].re() > 0.0;
        return positive.then(|| Mq.map(S::recip)).ok_or(NotPositiveDefinite);
    }
    Ok(Mq.cholesky().ok_or(NotPositiveDefinite)?.inverse())
}
