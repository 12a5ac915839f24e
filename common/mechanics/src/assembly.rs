//! Assembly: a tree of elements with closing joints, solved exactly in one pass each way.
//!
//! ```text
//! poses, r, v     root -> tips
//! F0, M           tips -> root        every element is a load of its parent
//! a, q''          root -> tips
//! closing joints  K lambda = -(da + 2a dv + b^2 dr),   K = d(da)/d(lambda)      (18), (19)
//! ```
//!
//! `lambda` acts + on the first place of a closing joint and - on the second. A column of K visits
//! only the elements between a joint and its roots, so K is banded where loops share elements with
//! their neighbours only.
//!
//! Sizes are static: `B` elements, `C` closing joints, `W` blocks in a row of K from the diagonal on.
//! Elements are numbered so that parents come first.

use crate::closure::{Band, InconsistentClosure};
use crate::{
    Answer, Body, Dim, Hinged, Joint, Load, Loaded, Matrix, NotPositiveDefinite, Point, Pose, Rigid, Scalar,
    Space, Vector,
};

/// What an element hangs on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Parent<const D: usize> {
    /// A root point of the scene, by its number
    Root(usize),
    /// A point of another element with a lower number, body vector from that element's joint
    Element(usize, Vector<f64, D>),
}

/// An element and how it hangs.
#[derive(Debug, Clone, Copy)]
pub struct Member<J, const D: usize> {
    /// Joint kind
    pub joint: J,
    /// Mass properties, from the joint
    pub rigid: Rigid<D>,
    /// What it hangs on
    pub parent: Parent<D>,
}

/// A point of an element, body vector from its joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place<const D: usize> {
    /// Number of the element
    pub element: usize,
    /// Body vector [m]
    pub point: Vector<f64, D>,
}

/// Two places that must stay together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClosingJoint<const D: usize> {
    /// lambda acts on it
    pub first: Place<D>,
    /// -lambda acts on it
    pub second: Place<D>,
}

/// How drift of closed joints is held inside the equations (19).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Baumgarte {
    /// a [1/s]
    pub a: f64,
    /// b [1/s]
    pub b: f64,
}

/// A tree of elements with closing joints.
#[derive(Debug, Clone, Copy)]
pub struct Assembly<J, const D: usize, const N: usize, const B: usize, const C: usize, const W: usize> {
    /// The elements, parents first
    pub members: [Member<J, D>; B],
    /// The closing joints
    pub closures: [ClosingJoint<D>; C],
    /// Number of closing joints in use (the first ones)
    pub closed: usize,
}

/// Positions and velocities.
#[derive(Debug, Clone, Copy)]
pub struct Kinematics<S, P, const D: usize, const N: usize, const B: usize> {
    /// Pose of each element
    pub poses: [P; B],
    /// Point of the parent at which each element hangs (unused for roots)
    pub hangs_at: [Point<S, D, N>; B],
    /// Position of each element's joint [m]
    pub r: [Vector<S, D>; B],
    /// Velocity of each element's joint [m/s]
    pub v: [Vector<S, D>; B],
}

/// The relative motion of the two places of a closing joint, first minus second.
#[derive(Debug, Clone, Copy)]
pub struct Gap<S, const D: usize, const N: usize> {
    /// Relative position [m]
    pub r: Vector<S, D>,
    /// Relative velocity [m/s]
    pub v: Vector<S, D>,
    /// The first place
    pub first: Point<S, D, N>,
    /// The second place
    pub second: Point<S, D, N>,
}

/// The elements with their loads, seen from their roots, closing joints open.
#[derive(Debug, Clone, Copy)]
pub struct Tree<S, const D: usize, const N: usize, const B: usize> {
    /// Each element with everything that hangs on it
    pub hinged: [Hinged<S, D, N>; B],
}

/// Accelerations and forces.
#[derive(Debug, Clone, Copy)]
pub struct Accelerations<S, const D: usize, const N: usize, const B: usize, const C: usize> {
    /// q'' of each element
    pub q: [Vector<S, N>; B],
    /// Acceleration of each element's joint [m/s2]
    pub a: [Vector<S, D>; B],
    /// Force of each element on what it hangs on [N]
    pub F: [Vector<S, D>; B],
    /// Force of each closing joint on its first place [N]
    pub lambda: [Vector<S, D>; C],
    /// True if the closing joints left a direction undetermined
    pub deficient: bool,
}

/// The equations of an assembly have no unique solution.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum AssemblyError {
    /// An element's inertia
    #[error("element {element}: {source}")]
    Inertia {
        /// Number of the element
        element: usize,
        /// Cause
        source: NotPositiveDefinite,
    },
    /// The closing joints
    #[error(transparent)]
    Closure(#[from] InconsistentClosure),
}

/// Kinematics with the poses of the joint kind `J`.
pub type KinematicsOf<S, J, const D: usize, const N: usize, const B: usize> =
    Kinematics<S, <J as Joint<D, N>>::Pose<S>, D, N, B>;

impl<S: Scalar, P: Pose<S, D, N>, const D: usize, const N: usize, const B: usize> Kinematics<S, P, D, N, B> {
    /// A point of an element.
    #[inline]
    pub fn point(&self, place: &Place<D>) -> Point<S, D, N> {
        self.poses[place.element].point(&place.point)
    }

    /// Position and velocity of a point of an element in the world.
    #[inline]
    pub fn motion(&self, element: usize, p: &Point<S, D, N>) -> (Vector<S, D>, Vector<S, D>) {
        (self.r[element] + p.r, self.v[element] + p.v)
    }
}

impl<S: Scalar, const D: usize, const N: usize, const B: usize, const C: usize> Accelerations<S, D, N, B, C> {
    /// Acceleration of a point of an element [m/s2].
    #[inline]
    pub fn at(&self, element: usize, p: &Point<S, D, N>) -> Vector<S, D> {
        self.a[element] + p.J * self.q[element] + p.c
    }
}

impl<J, const D: usize, const N: usize, const B: usize, const C: usize, const W: usize>
    Assembly<J, D, N, B, C, W>
where
    J: Joint<D, N>,
    Dim<D>: Space<D>,
{
    /// The states of element `i` within all states.
    #[inline]
    pub fn range(&self, i: usize) -> std::ops::Range<usize> {
        let start: usize = self.members[..i].iter().map(|m| m.joint.states()).sum();
        start..start + self.members[i].joint.states()
    }

    /// Number of states of all elements.
    pub fn states(&self) -> usize {
        self.members.iter().map(|m| m.joint.states()).sum()
    }

    /// Call `visit` with each element's number and states.
    #[inline]
    pub fn each<'x, T>(&self, x: &'x [T], mut visit: impl FnMut(usize, &'x [T])) {
        let mut rest = x;
        for (i, member) in self.members.iter().enumerate() {
            let (own, others) = rest.split_at(member.joint.states());
            visit(i, own);
            rest = others;
        }
    }

    /// The same with states that may be changed.
    #[inline]
    pub fn each_mut<'x, T>(&self, x: &'x mut [T], mut visit: impl FnMut(usize, &'x mut [T])) {
        let mut rest = x;
        for (i, member) in self.members.iter().enumerate() {
            let (own, others) = rest.split_at_mut(member.joint.states());
            visit(i, own);
            rest = others;
        }
    }

    /// Positions and velocities, given those of the root points.
    #[inline]
    pub fn kinematics<S: Scalar>(
        &self,
        x: &[S],
        root: impl Fn(usize) -> (Vector<S, D>, Vector<S, D>),
    ) -> KinematicsOf<S, J, D, N, B> {
        let mut at = 0;
        let poses: [J::Pose<S>; B] = std::array::from_fn(|i| {
            let joint = &self.members[i].joint;
            let own = &x[at..at + joint.states()];
            at += joint.states();
            joint.pose(own)
        });
        let hangs_at = std::array::from_fn(|i| match &self.members[i].parent {
            Parent::Root(_) => Point::zero(),
            Parent::Element(parent, point) => poses[*parent].point(point),
        });
        let (mut r, mut v) = ([Vector::<S, D>::zeros(); B], [Vector::<S, D>::zeros(); B]);
        for i in 0..B {
            (r[i], v[i]) = match self.members[i].parent {
                Parent::Root(number) => root(number),
                Parent::Element(parent, _) => (r[parent] + hangs_at[i].r, v[parent] + hangs_at[i].v),
            };
        }
        Kinematics { poses, hangs_at, r, v }
    }

    /// Inertia of each element about its joint.
    #[inline]
    pub fn bodies<S: Scalar>(&self, k: &KinematicsOf<S, J, D, N, B>) -> [Body<S, D, N>; B] {
        std::array::from_fn(|i| k.poses[i].body(&self.members[i].rigid))
    }

    /// Every element with its loads and with everything that hangs on it; `load` adds the loads of
    /// an element, `held` keeps the coordinates of one.
    ///
    /// # Errors
    /// [`AssemblyError::Inertia`].
    #[inline]
    pub fn tree<S: Scalar>(
        &self,
        k: &KinematicsOf<S, J, D, N, B>,
        bodies: &[Body<S, D, N>; B],
        load: impl Fn(usize, &mut Loaded<S, D, N>),
        held: Option<usize>,
    ) -> Result<Tree<S, D, N, B>, AssemblyError> {
        let mut loaded: [Loaded<S, D, N>; B] = std::array::from_fn(|i| {
            let mut element = Loaded::new(&bodies[i]);
            load(i, &mut element);
            element
        });
        let mut hinged = loaded.map(|_| Hinged::zero());
        for i in (0..B).rev() {
            hinged[i] = if held == Some(i) {
                loaded[i].hold()
            } else {
                loaded[i].hinge().map_err(|source| AssemblyError::Inertia { element: i, source })?
            };
            if let Parent::Element(parent, _) = self.members[i].parent {
                let Hinged { f, M, .. } = hinged[i];
                loaded[parent].add(&k.hangs_at[i], &Load { F: f, M: Some(M) });
            }
        }
        Ok(Tree { hinged })
    }

    /// Relative motion at closing joint `c`.
    #[inline]
    fn gap<S: Scalar>(&self, k: &KinematicsOf<S, J, D, N, B>, c: usize) -> Gap<S, D, N> {
        let ClosingJoint { first, second } = &self.closures[c];
        let (p_1, p_2) = (k.point(first), k.point(second));
        let ((r_1, v_1), (r_2, v_2)) = (k.motion(first.element, &p_1), k.motion(second.element, &p_2));
        Gap { r: r_1 - r_2, v: v_1 - v_2, first: p_1, second: p_2 }
    }

    /// Relative motion at all closing joints; zero for those not in use.
    #[inline]
    pub fn gaps<S: Scalar>(&self, k: &KinematicsOf<S, J, D, N, B>) -> [Gap<S, D, N>; C] {
        let none =
            Gap { r: Vector::zeros(), v: Vector::zeros(), first: Point::zero(), second: Point::zero() };
        std::array::from_fn(|c| if c < self.closed { self.gap(k, c) } else { none })
    }

    /// Walk from a place to its root with forces `F`; `visit` sees each element's answer.
    #[inline]
    fn inwards<S: Scalar, const R: usize>(
        &self,
        k: &KinematicsOf<S, J, D, N, B>,
        tree: &Tree<S, D, N, B>,
        place: &Place<D>,
        point: &Point<S, D, N>,
        mut F: Matrix<S, D, R>,
        mut visit: impl FnMut(usize, &Answer<S, D, N, R>),
    ) {
        let (mut element, mut point) = (place.element, point);
        loop {
            let answer = tree.hinged[element].answer(point, &F);
            visit(element, &answer);
            F = answer.f;
            match self.members[element].parent {
                Parent::Root(_) => return,
                Parent::Element(parent, _) => {
                    point = &k.hangs_at[element];
                    element = parent;
                }
            }
        }
    }

    /// The same for the pair of forces of a closing joint, `F` on its first place.
    #[inline]
    fn pair_inwards<S: Scalar, const R: usize>(
        &self,
        k: &KinematicsOf<S, J, D, N, B>,
        tree: &Tree<S, D, N, B>,
        c: usize,
        gap: &Gap<S, D, N>,
        F: Matrix<S, D, R>,
        mut visit: impl FnMut(usize, &Answer<S, D, N, R>),
    ) {
        let ClosingJoint { first, second } = &self.closures[c];
        self.inwards(k, tree, first, &gap.first, F, &mut visit);
        self.inwards(k, tree, second, &gap.second, -F, &mut visit);
    }

    /// K of all closing joints, d(relative acceleration)/d(lambda) = sum over the elements of
    /// g_i^T Mq^-1 g_j, with g the generalised forces of unit lambdas on their way to the roots.
    #[inline]
    pub fn mobility<S: Scalar>(
        &self,
        k: &KinematicsOf<S, J, D, N, B>,
        tree: &Tree<S, D, N, B>,
        gaps: &[Gap<S, D, N>; C],
    ) -> Band<S, D, C, W> {
        let mut band = Band::new(self.closed);
        let mut dq = [Matrix::<S, N, D>::zeros(); B];
        let unit = Matrix::<S, D, D>::identity();
        for i in 0..self.closed {
            self.pair_inwards(k, tree, i, &gaps[i], unit, |element, answer| {
                dq[element] += answer.q;
            });
            for (j, gap) in gaps.iter().enumerate().take((i + W).min(self.closed)).skip(i) {
                let mut block = Matrix::<S, D, D>::zeros();
                self.pair_inwards(k, tree, j, gap, unit, |element, answer| {
                    block += dq[element].transpose() * answer.generalised;
                });
                band.set(i, j, block);
            }
            for place in [&self.closures[i].first, &self.closures[i].second] {
                self.clear(place.element, &mut dq);
            }
        }
        band
    }

    /// Set the entries of an element and of all on which it hangs to zero.
    #[inline]
    fn clear<S: Scalar>(&self, mut element: usize, dq: &mut [Matrix<S, N, D>; B]) {
        loop {
            dq[element] = Matrix::<S, N, D>::zeros();
            match self.members[element].parent {
                Parent::Root(_) => return,
                Parent::Element(parent, _) => element = parent,
            }
        }
    }

    /// Put the forces of the closing joints on the tree: change of q0 and of f.
    #[inline]
    fn apply<S: Scalar>(
        &self,
        k: &KinematicsOf<S, J, D, N, B>,
        tree: &mut Tree<S, D, N, B>,
        gaps: &[Gap<S, D, N>; C],
        lambda: &[Vector<S, D>; C],
    ) {
        let (mut dq, mut df) = ([Vector::<S, N>::zeros(); B], [Vector::<S, D>::zeros(); B]);
        for (c, F) in lambda.iter().enumerate().take(self.closed) {
            self.pair_inwards(k, tree, c, &gaps[c], *F, |element, answer| {
                dq[element] += answer.q;
                df[element] += answer.f;
            });
        }
        for (hinged, (dq, df)) in tree.hinged.iter_mut().zip(dq.iter().zip(&df)) {
            hinged.q0 += dq;
            hinged.f += df;
        }
    }

    /// q'' and joint accelerations of the tree, given those of the root points.
    #[inline]
    fn outwards<S: Scalar>(
        &self,
        k: &KinematicsOf<S, J, D, N, B>,
        tree: &Tree<S, D, N, B>,
        root: &impl Fn(usize) -> Vector<S, D>,
        bias: bool,
    ) -> ([Vector<S, N>; B], [Vector<S, D>; B]) {
        let (mut q, mut a) = ([Vector::<S, N>::zeros(); B], [Vector::<S, D>::zeros(); B]);
        for i in 0..B {
            a[i] = match self.members[i].parent {
                Parent::Root(number) => root(number),
                Parent::Element(parent, _) => {
                    let p = &k.hangs_at[i];
                    let a = a[parent] + p.J * q[parent];
                    if bias { a + p.c } else { a }
                }
            };
            q[i] = tree.hinged[i].acceleration(&a[i]);
        }
        (q, a)
    }

    /// Accelerations and forces of the tree with all closing joints closed; `gaps` from
    /// [`Self::gaps`], `root`: accelerations of the root points.
    ///
    /// # Errors
    /// [`AssemblyError::Closure`].
    #[inline]
    pub fn accelerate<S: Scalar>(
        &self,
        k: &KinematicsOf<S, J, D, N, B>,
        mut tree: Tree<S, D, N, B>,
        gaps: &[Gap<S, D, N>; C],
        root: impl Fn(usize) -> Vector<S, D>,
        baumgarte: Option<Baumgarte>,
    ) -> Result<Accelerations<S, D, N, B, C>, AssemblyError> {
        let (mut q, mut a) = self.outwards(k, &tree, &root, true);
        let mut lambda = [Vector::<S, D>::zeros(); C];
        let mut deficient = false;
        if self.closed > 0 {
            for (c, gap) in gaps.iter().enumerate().take(self.closed) {
                let ClosingJoint { first, second } = &self.closures[c];
                let at =
                    |place: &Place<D>, p: &Point<S, D, N>| a[place.element] + p.J * q[place.element] + p.c;
                let mut da = at(first, &gap.first) - at(second, &gap.second);
                if let Some(Baumgarte { a, b }) = baumgarte {
                    da += gap.v * S::lift(2.0 * a) + gap.r * S::lift(b * b); // (19)
                }
                lambda[c] = -da;
            }
            deficient = self.mobility(k, &tree, gaps).solve(&mut lambda)?;
            self.apply(k, &mut tree, gaps, &lambda);
            (q, a) = self.outwards(k, &tree, &root, true);
        }
        let F = std::array::from_fn(|i| tree.hinged[i].root_force(&a[i]));
        Ok(Accelerations { q, a, F, lambda, deficient })
    }

    /// Time derivative of all states.
    #[inline]
    pub fn derivative<S: Scalar>(&self, x: &[S], q_ddot: &[Vector<S, N>; B], x_dot: &mut [S]) {
        let mut rest = x;
        self.each_mut(x_dot, |i, own_dot| {
            let joint = &self.members[i].joint;
            let (own, others) = rest.split_at(joint.states());
            joint.derivative(own, &q_ddot[i], own_dot);
            rest = others;
        });
    }

    /// Sum of mass times velocity [kg.m/s].
    pub fn momentum<S: Scalar>(&self, k: &KinematicsOf<S, J, D, N, B>) -> Vector<S, D> {
        (0..B).fold(Vector::zeros(), |sum, i| {
            let rigid = &self.members[i].rigid;
            sum + (k.v[i] + k.poses[i].point(&rigid.c).v) * S::lift(rigid.m)
        })
    }

    /// Sum of mass times position of the centres of mass [kg.m].
    pub fn mass_moment<S: Scalar>(&self, k: &KinematicsOf<S, J, D, N, B>) -> Vector<S, D> {
        (0..B).fold(Vector::zeros(), |sum, i| {
            let rigid = &self.members[i].rigid;
            sum + (k.r[i] + k.poses[i].point(&rigid.c).r) * S::lift(rigid.m)
        })
    }

    /// Kinetic energy of all elements (21) [J].
    pub fn kinetic_energy<S: Scalar>(&self, k: &KinematicsOf<S, J, D, N, B>) -> S {
        (0..B).fold(S::lift(0.0), |sum, i| {
            let rigid = &self.members[i].rigid;
            let v = k.v[i] + k.poses[i].point(&rigid.c).v;
            sum + v.dot(&v) * (0.5 * rigid.m) + k.poses[i].spin_energy(rigid)
        })
    }

    /// The smallest mass-weighted change of coordinates (or rates) that takes away `off` at the
    /// closing joints (20): per element, as q.
    ///
    /// # Errors
    /// [`AssemblyError::Closure`].
    pub fn correction(
        &self,
        k: &KinematicsOf<f64, J, D, N, B>,
        free: &Tree<f64, D, N, B>,
        gaps: &[Gap<f64, D, N>; C],
        off: impl Fn(usize) -> Vector<f64, D>,
        mobility: &Band<f64, D, C, W>,
    ) -> Result<[Vector<f64, N>; B], AssemblyError> {
        let mut lambda: [Vector<f64, D>; C] = std::array::from_fn(|c| -off(c));
        mobility.solve(&mut lambda)?;
        // the change goes out as an acceleration would, without any bias
        let mut tree = *free;
        for hinged in &mut tree.hinged {
            hinged.q0 = Vector::zeros();
        }
        self.apply(k, &mut tree, gaps, &lambda);
        Ok(self.outwards(k, &tree, &|_| Vector::zeros(), false).0)
    }
}
