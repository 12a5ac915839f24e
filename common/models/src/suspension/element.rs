//! One rigid element with a follower port at its joint and leader ports at body points.
//!
//! ```text
//! A.F0, A.M by (12b);  q'' = Mq^-1 (Q0 - K a_A)                         (6)
//! A.F  = m g + sum (F_k - M_k a_k) - m a_c                              (8)
//! N_A  = sum p_k x (F_k - M_k a_k) + c x m (g - a_A) - J_A alpha - omega x J_A omega + drive   (9)
//! ```
//!
//! `A.F` is summed from the accelerations, not taken from `A.F0 - A.M a`, so that the two can be
//! held against each other.

use mechanics::{Body, Dim, Hinged, Load, Loaded, Point, Pose, Rigid, Scalar, Space, Vector};
use model::{EvaluationError, SymmetricTensor, Vector3};

use super::coordinates::{Coordinates, Orientation};
use crate::port::{Root, Slot};

/// Constants of an element.
#[derive(Debug, Clone, Copy)]
pub(super) struct Element<J, const D: usize, const N: usize> {
    pub(super) joint: J,
    pub(super) rigid: Rigid<D>,
    pub(super) gravity: Option<Vector<f64, D>>,
    pub(super) energy: bool,
    /// Start values of all orientation variables
    pub(super) start: Orientation<f64>,
}

/// Motion of the root port in the element's space.
#[derive(Debug, Clone, Copy)]
pub(super) struct RootMotion<S, const D: usize> {
    pub(super) r: Vector<S, D>,
    pub(super) v: Vector<S, D>,
    pub(super) a: Vector<S, D>,
}

/// Position and velocity of an element.
pub(super) struct Posed<S, P, const D: usize, const N: usize> {
    pub(super) pose: P,
    pub(super) body: Body<S, D, N>,
    pub(super) root: RootMotion<S, D>,
}

/// A load at a body point; `None`: nothing acts.
pub(super) type LoadAt<S, const D: usize, const N: usize> = Option<(Point<S, D, N>, Load<S, D>)>;

/// Accelerations and forces.
pub(super) struct Answer<S, const D: usize, const N: usize> {
    pub(super) q: Vector<S, N>,
    /// Force on the leader (8)
    pub(super) F: Vector<S, D>,
    /// Moment on the leader side (9)
    pub(super) moment: Vector3<S>,
}

/// Posed element with the pose of the joint kind `J`.
pub(super) type PosedOf<S, J, const D: usize, const N: usize> =
    Posed<S, <J as mechanics::Joint<D, N>>::Pose<S>, D, N>;

/// A symmetric matrix of the element's space as a world tensor.
pub(super) fn tensor<S: Scalar, const D: usize>(m: &mechanics::Matrix<S, D, D>) -> SymmetricTensor<S>
where
    Dim<D>: Space<D>,
{
    let column = |v: Vector3<f64>| Dim::<D>::embed(&(m * Dim::<D>::restrict(&v.map(S::lift))));
    let (x, y, z) = (column(Vector3::x()), column(Vector3::y()), column(Vector3::z()));
    SymmetricTensor { xx: x.x, xy: y.x, xz: z.x, yy: y.y, yz: z.y, zz: z.z }
}

impl<S: Scalar, P: Pose<S, D, N>, const D: usize, const N: usize> Posed<S, P, D, N>
where
    Dim<D>: Space<D>,
{
    /// World position and velocity of a body point.
    pub(super) fn motion(&self, p: &Point<S, D, N>) -> (Vector3<S>, Vector3<S>) {
        (Dim::<D>::embed(&(self.root.r + p.r)), Dim::<D>::embed(&(self.root.v + p.v)))
    }

    /// World acceleration of a body point.
    pub(super) fn acceleration(&self, p: &Point<S, D, N>, q: &Vector<S, N>) -> Vector<S, D> {
        self.root.a + p.J * q + p.c
    }
}

impl<J, const D: usize, const N: usize> Element<J, D, N>
where
    J: Coordinates<D, N>,
    Dim<D>: Space<D>,
{
    /// Number of states without the energy integrals.
    pub(super) fn mechanical(&self) -> usize {
        self.joint.states()
    }

    /// All orientation variables; those of other joint kinds keep their start values.
    pub(super) fn orientation<S: Scalar>(&self, x: &[S], carrier: bool) -> Orientation<S> {
        self.joint.orientation(&x[..self.mechanical()], carrier, Orientation::constant(&self.start))
    }

    /// The element at the states `x` on its root.
    #[inline]
    pub(super) fn pose<S: Scalar>(&self, x: &[S], root: &Root<S>) -> PosedOf<S, J, D, N> {
        let pose = self.joint.pose(&x[..self.mechanical()]);
        let part = |v: &Vector3<S>| Dim::<D>::restrict(v);
        let root = RootMotion { r: part(&root.r), v: part(&root.v), a: part(&root.a) };
        Posed { body: pose.body(&self.rigid), pose, root }
    }

    /// The load of the slots of a port at the body point `p`.
    #[inline]
    pub(super) fn port<S: Scalar>(
        at: &PosedOf<S, J, D, N>,
        p: &Vector<f64, D>,
        slots: &[&Slot<S>],
    ) -> LoadAt<S, D, N> {
        crate::port::slots(slots).map(|load| (at.pose.point(p), load))
    }

    /// The element with its loads, seen from its root (12a), (12b).
    #[inline]
    pub(super) fn hinge<S: Scalar>(
        &self,
        at: &PosedOf<S, J, D, N>,
        loads: &[LoadAt<S, D, N>],
        drive: Option<&Vector3<S>>,
    ) -> Result<Hinged<S, D, N>, EvaluationError> {
        let mut loaded = Loaded::new(&at.body);
        if let Some(g) = &self.gravity {
            loaded.add(&at.body.com, &Load::force(g.map(S::lift) * at.body.m));
        }
        for (p, load) in loads.iter().flatten() {
            loaded.add(p, load);
        }
        if let Some(torque) = drive {
            loaded.drive(&at.pose.drive(torque));
        }
        loaded.hinge().map_err(|source| EvaluationError::Inertia { element: "element", source })
    }

    /// q'' and the true force and moment on the leader (6), (8), (9).
    pub(super) fn answer<S: Scalar>(
        &self,
        at: &PosedOf<S, J, D, N>,
        loads: &[LoadAt<S, D, N>],
        drive: Option<&Vector3<S>>,
    ) -> Result<Answer<S, D, N>, EvaluationError> {
        let q = self.hinge(at, loads, drive)?.acceleration(&at.root.a);
        let world = |v: &Vector<S, D>| Dim::<D>::embed(v);
        let com = &at.body.com;
        let weight = self.gravity.map_or(Vector::zeros(), |g| g.map(S::lift) * at.body.m);
        let mut F = weight - at.acceleration(com, &q) * at.body.m;
        let mut moment = world(&com.r).cross(&world(&(weight - at.root.a * at.body.m)))
            - at.pose.momentum_rate(&self.rigid, &q);
        for (p, load) in loads.iter().flatten() {
            let force = load.M.map_or(load.F, |M| load.F - M * at.acceleration(p, &q));
            F += force;
            moment += world(&p.r).cross(&world(&force));
        }
        if let Some(torque) = drive {
            moment += torque;
        }
        Ok(Answer { q, F, moment })
    }

    /// Power of a load with the point's own acceleration [W].
    pub(super) fn power<S: Scalar>(at: &PosedOf<S, J, D, N>, load: &LoadAt<S, D, N>, q: &Vector<S, N>) -> S {
        load.as_ref().map_or(S::lift(0.0), |(p, load)| {
            let force = load.M.map_or(load.F, |M| load.F - M * at.acceleration(p, q));
            force.dot(&(at.root.v + p.v))
        })
    }

    /// Kinetic energy and the energy of gravity (21) [J].
    pub(super) fn energies<S: Scalar>(&self, at: &PosedOf<S, J, D, N>) -> (S, S) {
        let com = &at.body.com;
        let v = at.root.v + com.v;
        let kinetic = v.dot(&v) * at.body.m * 0.5 + at.pose.spin_energy(&self.rigid);
        let potential =
            self.gravity.map_or(S::lift(0.0), |g| -(g.map(S::lift).dot(&(at.root.r + com.r)) * at.body.m));
        (kinetic, potential)
    }
}

/// Take over tunable gravity; `None` where nothing would act.
pub(super) fn field<const D: usize>(used: bool, g: &Vector3<f64>) -> Option<Vector<f64, D>>
where
    Dim<D>: Space<D>,
{
    let g = Dim::<D>::restrict(g);
    (used && !g.iter().all(|g| g.vanishes())).then_some(g)
}

/// The part of a rigid body that acts in the element's space.
pub(super) fn restricted<const D: usize>(rigid: &Rigid<3>) -> Rigid<D>
where
    Dim<D>: Space<D>,
{
    Rigid { m: rigid.m, c: Dim::<D>::restrict(&rigid.c), I_c: rigid.I_c }
}

/// The functions of a system that concern the states of one element only; `$names`: link or carrier.
macro_rules! element_functions {
    ($names:ident) => {
        fn state_names(&self) -> [String; X] {
            super::coordinates::state_names(self.element.joint.$names())
        }

        fn nominals(&self) -> [f64; X] {
            super::coordinates::nominals(self.element.mechanical())
        }

        fn project(&self, _t: f64, x: &mut [f64; X]) -> Result<bool, EvaluationError> {
            Ok(self.element.joint.normalise(&mut x[..self.element.mechanical()]))
        }

        fn off_manifold(&self, x: &[f64; X]) -> f64 {
            self.element.joint.off_manifold(&x[..self.element.mechanical()])
        }

        fn normalise(&self, x: &mut [f64; X]) -> bool {
            self.element.joint.normalise(&mut x[..self.element.mechanical()])
        }
    };
}
pub(super) use element_functions;
