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

/// A load without inertia.
#[derive(Debug, Clone, Copy)]
pub struct Force;

impl Force {
    /// The load of a pure force.
    #[inline]
    pub fn load<S, const D: usize>(F: Vector<S, D>) -> Load<S, D> {
        Load { F, M: None }
    }
}

/// Mq is not positive definite: the masses and inertias of the element admit no unique motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the inertia of the element about its joint is not positive definite")]
pub struct NotPositiveDefinite;

/// An element with its loads, seen from its root.
#[derive(Debug, Clone, Copy)]
pub struct Hinged<S, const D: usize, const N: usize> {
    /// Effective inertia at the root, M_AA = A.M [kg]
    pub M: Matrix<S, D, D>,
    /// Force on the leader at a_A = 0, f = A.F0 [N]
    pub f: Vector<S, D>,
    /// q'' at a_A = 0 and F_B = 0
    pub q0: Vector<S, N>,
    /// Mq^-1 K: q'' falls by this times a_A
    pub Kq: Matrix<S, N, D>,
    K: Matrix<S, N, D>,
    inverse: Matrix<S, N, N>,
}

/// The tip of an element, where an unknown force F_B acts.
#[derive(Debug, Clone, Copy)]
pub struct Tip<S, const D: usize, const N: usize> {
    /// Force transmission tip to root
    pub G: Matrix<S, D, D>,
    /// Mobility at the tip, symmetric [1/kg]
    pub Y: Matrix<S, D, D>,
    /// Tip acceleration at a_A = 0 and F_B = 0 [m/s2]
    pub b: Vector<S, D>,
    /// Mq^-1 J_B^T: q'' rises by this times F_B
    pub Rq: Matrix<S, N, D>,
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

impl<S: Scalar, const D: usize, const N: usize> Hinged<S, D, N> {
    /// The element `body` with known `loads` at body points (12a), (12b); `None`: not there.
    ///
    /// # Errors
    /// [`NotPositiveDefinite`] if the generalised inertia has no Cholesky factor.
    #[inline]
    pub fn new<const L: usize>(
        body: &Body<S, D, N>,
        loads: [Option<(&Point<S, D, N>, Load<S, D>)>; L],
    ) -> Result<Self, NotPositiveDefinite> {
        let Body { m, com, .. } = body;
        let mut Mq = body.Mq;
        let mut Q0 = body.Q;
        let mut K = com.J.transpose() * *m;
        let mut M = Matrix::<S, D, D>::from_diagonal_element(*m);
        let mut f = -com.c * *m;
        for (p, load) in loads.into_iter().flatten() {
            let mut F = load.F;
            if let Some(M_k) = &load.M {
                let JtM = p.J.transpose() * M_k;
                Mq += JtM * p.J;
                K += JtM;
                M += M_k;
                F -= M_k * p.c;
            }
            Q0 += p.J.transpose() * F;
            f += F;
        }
        let inverse = inverse_positive_definite(&Mq)?;
        let Kq = inverse * K;
        let q0 = inverse * Q0; // (6) at a_A = 0
        M -= K.transpose() * Kq; // (12b)
        f -= K.transpose() * q0;
        Ok(Self {
            M,
            f,
            q0,
            Kq,
            K,
            inverse,
        })
    }

    /// The two-port columns of the tip `p` (12c).
    #[inline]
    pub fn tip(&self, p: &Point<S, D, N>) -> Tip<S, D, N> {
        let Rq = self.inverse * p.J.transpose();
        let G = Matrix::<S, D, D>::identity() - self.K.transpose() * Rq;
        let Y = p.J * Rq;
        let b = p.J * self.q0 + p.c;
        Tip { G, Y, b, Rq }
    }
}
