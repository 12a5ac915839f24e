//! Linkages from the elements of the suspension as initial value problems: what tests and examples share.

use std::cell::Cell;

use integrators::Ode;
use mechanics::{Assembly, AssemblyError, ClosingJoint, Load, Member, Parent, Place, Planar, Rigid, Vector};

/// Vector in the x-z plane.
pub(crate) type V2 = Vector<f64, 2>;

/// An assembly of planar links under gravity and further loads as an initial value problem.
pub(crate) struct Linkage<const B: usize, const C: usize, const W: usize, L> {
    pub(crate) assembly: Assembly<Planar, 2, 1, B, C, W>,
    pub(crate) roots: Vec<V2>,
    pub(crate) gravity: V2,
    /// Further loads: element, its states' kinematics, what to add
    pub(crate) loads: L,
    pub(crate) project: bool,
    /// Evaluations in which the closing joints left a direction undetermined
    pub(crate) deficient: Cell<u32>,
}

/// Kinematics of `B` planar links.
pub(crate) type K<const B: usize> = mechanics::KinematicsOf<f64, Planar, 2, 1, B>;

impl<const B: usize, const C: usize, const W: usize, const X: usize, L> Ode<X> for Linkage<B, C, W, L>
where
    L: Fn(&K<B>, usize, &mut mechanics::Loaded<f64, 2, 1>),
{
    type Error = AssemblyError;

    fn rhs(&self, _t: f64, x: &[f64; X]) -> Result<[f64; X], AssemblyError> {
        let k = self.assembly.kinematics(x, |n| (self.roots[n], V2::zeros()));
        let bodies = self.assembly.bodies(&k);
        let tree = self.assembly.tree(
            &k,
            &bodies,
            |i, link| {
                link.add(&bodies[i].com, &Load::force(self.gravity * bodies[i].m));
                (self.loads)(&k, i, link);
            },
            None,
        )?;
        let a = self.assembly.accelerate(&k, tree, &self.assembly.gaps(&k), |_| V2::zeros(), None)?;
        self.deficient.set(self.deficient.get() + u32::from(a.deficient));
        let mut x_dot = [0.0; X];
        self.assembly.derivative(x, &a.q, &mut x_dot);
        Ok(x_dot)
    }

    fn project(&self, _t: f64, x: &mut [f64; X]) -> Result<bool, AssemblyError> {
        if self.project { self.assembly.project(x, |n| self.roots[n]) } else { Ok(false) }
    }
}

/// A planar body: mass [kg], centre of mass in its frame [m], moment of inertia about it [kg.m2].
pub(crate) fn rigid(m: f64, c: V2, I: f64) -> Rigid<2> {
    let mut I_c = mechanics::Matrix::<f64, 3, 3>::zeros();
    I_c[(1, 1)] = I;
    Rigid { m, c, I_c }
}

/// (x, z)
pub(crate) fn v(x: f64, z: f64) -> V2 {
    V2::new(x, z)
}

/// Loads of a linkage that has none but its weight.
pub(crate) type NoLoads<const B: usize> = fn(&K<B>, usize, &mut mechanics::Loaded<f64, 2, 1>);

/// IFToMM A02: N loops of 1 m, 1 kg rods under gravity, B = 2 N + 1. Elements: uprights 0..=N, then the horizontals. Loops share an
/// upright with their neighbours only: two blocks in a row of K from the diagonal on (`W = 2`) hold all of it.
pub(crate) fn n_four_bar<const B: usize, const N: usize, const W: usize>() -> Linkage<B, N, W, NoLoads<B>> {
    assert_eq!(B, 2 * N + 1);
    let rod = rigid(1.0, v(0.5, 0.0), 1.0 / 12.0);
    let tip = v(1.0, 0.0);
    let n = u32::try_from(N).expect("small");
    Linkage {
        assembly: Assembly {
            members: std::array::from_fn(|i| Member {
                joint: Planar,
                rigid: rod,
                parent: if i <= N { Parent::Root(i) } else { Parent::Element(i - N - 1, tip) },
            }),
            closures: std::array::from_fn(|i| ClosingJoint {
                first: Place { element: N + 1 + i, point: tip },
                second: Place { element: i + 1, point: tip },
            }),
            closed: N,
        },
        roots: (0..=n).map(|i| v(f64::from(i), 0.0)).collect(),
        gravity: v(0.0, -9.81),
        loads: |_, _, _| {},
        project: true,
        deficient: Cell::new(0),
    }
}

/// Uprights at `phi` with the rate -1 rad/s, horizontals at rest: the loops are closed.
pub(crate) fn n_four_bar_state<const X: usize>(n: usize, phi: f64) -> [f64; X] {
    std::array::from_fn(|i| match (i / 2 <= n, i % 2) {
        (true, 0) => phi,
        (true, _) => -1.0,
        _ => 0.0,
    })
}
