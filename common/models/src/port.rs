//! Ports of points: motion goes forward, force goes backward.
//!
//! ```text
//! leader    gives r, v, a    takes slots F, M: the load F - M a acts on it, all slots added
//! follower  takes r, v, a    gives F0, M and F = F0 - M a
//! ```

use mechanics::{Dim, Load, Matrix, Scalar, Space, Vector};
use model::{PlanarTensor, SymmetricTensor, Variables, Vector2, Vector3};

/// Part of a vector along a fixed direction, a unit vector.
pub(crate) fn along<S: Scalar>(direction: &Vector3<f64>, v: &Vector3<S>) -> S {
    v.x * direction.x + v.y * direction.y + v.z * direction.z
}

/// A slot of a leader port: the load `F - M a` acts on the leader.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
pub struct Slot<S> {
    /// Force on the leader at rest [N]
    #[var(name = "F")]
    pub F: Vector3<S>,
    /// Inertia behind the port [kg]
    #[var(name = "M")]
    pub M: SymmetricTensor<S>,
}

/// A follower port's motion: given by the leader.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(input)]
pub struct Root<S> {
    /// Position of the root port [m]
    #[var(name = "r")]
    pub r: Vector3<S>,
    /// Velocity of the root port [m/s]
    #[var(name = "v")]
    pub v: Vector3<S>,
    /// Acceleration of the root port [m/s2]
    #[var(name = "a")]
    pub a: Vector3<S>,
}

/// A slot of a leader port in one coordinate.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
pub struct ScalarSlot<S> {
    /// Force on the leader at rest [N]
    #[var(name = "F")]
    pub F: S,
    /// Inertia behind the port [kg]
    #[var(name = "M")]
    pub M: S,
}

/// A follower port's motion in one coordinate: given by the leader.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(input)]
pub struct ScalarRoot<S> {
    /// Position of the root port [m]
    #[var(name = "s")]
    pub s: S,
    /// Velocity of the root port [m/s]
    #[var(name = "v")]
    pub v: S,
    /// Acceleration of the root port [m/s2]
    #[var(name = "a")]
    pub a: S,
}

/// A slot of a leader port that moves in the x-z plane.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
pub struct PlanarSlot<S> {
    /// Force on the leader at rest [N]
    #[var(name = "F")]
    pub F: Vector2<S>,
    /// Inertia behind the port [kg]
    #[var(name = "M")]
    pub M: PlanarTensor<S>,
}

/// Force and inertia of two planar slots together.
pub(crate) fn planar_slots<S: Scalar>(a: &PlanarSlot<S>, b: &PlanarSlot<S>) -> (Vector2<S>, Matrix<S, 2, 2>) {
    (a.F + b.F, a.M.matrix() + b.M.matrix())
}

/// The sum of the slots of a port; `None` if nothing acts.
pub(crate) fn slots<S: Scalar, const D: usize>(slots: &[&Slot<S>]) -> Option<Load<S, D>>
where
    Dim<D>: Space<D>,
{
    let F = slots.iter().fold(Vector::<S, D>::zeros(), |sum, s| sum + Dim::<D>::restrict(&s.F));
    let M = slots.iter().filter(|s| !s.M.vanishes()).map(|s| {
        let m = &s.M;
        Dim::<D>::restrict_tensor(m.xx, m.xy, m.xz, m.yy, m.yz, m.zz)
    });
    let M = M.reduce(|sum, m| sum + m);
    (M.is_some() || !F.iter().all(|f| f.vanishes())).then_some(Load { F, M })
}
