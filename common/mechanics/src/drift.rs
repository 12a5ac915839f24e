//! Consistent states of an assembly: closing the loops on positions and velocities.
//!
//! ```text
//! dq = -M^-1 G^T (G M^-1 G^T)^-1 Phi,   G M^-1 G^T = K                  (20)
//! ```
//!
//! The correction is the smallest one in the sense of the kinetic energy. An element that is held
//! takes no part, as if its inertia about its joint were infinite.

use crate::{Assembly, AssemblyError, Band, Dim, Gap, Joint, KinematicsOf, Space, Tree, Vector};

/// A gap that counts as rounding of positions of about 1 m [m]
const ROUNDING: f64 = 1e-15;
/// A loop is closed when its gap is below this [m]
const CLOSED: f64 = 1e-13;
/// Gap that is accepted when Newton stalls [m]
const ACCEPTED: f64 = 1e-10;
/// Newton passes of an assembly
const MAX_PASSES: usize = 30;

/// The loops do not close.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum NotClosed {
    /// A gap remains
    #[error("a gap of {gap:.3e} m remains")]
    Gap {
        /// Largest gap [m]
        gap: f64,
    },
    /// The equations have no solution on the way
    #[error(transparent)]
    Equations(#[from] AssemblyError),
}

/// Mobility of the closing joints without any load.
struct Mobility<J, const D: usize, const N: usize, const B: usize, const C: usize, const W: usize>
where
    J: Joint<D, N>,
{
    k: KinematicsOf<f64, J, D, N, B>,
    tree: Tree<f64, D, N, B>,
    gaps: [Gap<f64, D, N>; C],
    band: Band<f64, D, C, W>,
}

impl<J, const D: usize, const N: usize, const B: usize, const C: usize, const W: usize>
    Assembly<J, D, N, B, C, W>
where
    J: Joint<D, N>,
    Dim<D>: Space<D>,
{
    fn unloaded(
        &self,
        k: KinematicsOf<f64, J, D, N, B>,
        held: Option<usize>,
    ) -> Result<Mobility<J, D, N, B, C, W>, AssemblyError> {
        let tree = self.tree(&k, &self.bodies(&k), |_, _| {}, held)?;
        let gaps = self.gaps(&k);
        let band = self.mobility(&k, &tree, &gaps);
        Ok(Mobility { k, tree, gaps, band })
    }

    /// Move the coordinates (`rates`: the rates) so that `off` vanishes to first order.
    fn correct(
        &self,
        x: &mut [f64],
        m: &Mobility<J, D, N, B, C, W>,
        off: impl Fn(usize) -> Vector<f64, D>,
        rates: bool,
    ) -> Result<(), AssemblyError> {
        let change = self.correction(&m.k, &m.tree, &m.gaps, off, &m.band)?;
        self.each_mut(x, |i, own| {
            let joint = &self.members[i].joint;
            if rates {
                joint.push(own, &change[i]);
            } else {
                joint.shift(own, &change[i]);
            }
        });
        Ok(())
    }

    fn largest(&self, gaps: &[Gap<f64, D, N>; C], part: impl Fn(&Gap<f64, D, N>) -> Vector<f64, D>) -> f64 {
        gaps.iter().take(self.closed).map(|gap| part(gap).norm()).fold(0.0, f64::max)
    }

    /// Bring the states back on the loops, and every orientation on its manifold; true if they
    /// changed. Two Newton passes on positions with the mobility of the first one, one exact solve
    /// for the rates. The root points rest at `root`.
    ///
    /// # Errors
    /// [`AssemblyError`].
    pub fn project(
        &self,
        x: &mut [f64],
        root: impl Fn(usize) -> Vector<f64, D>,
    ) -> Result<bool, AssemblyError> {
        let at_rest = |number| (root(number), Vector::zeros());
        let mut changed = false;
        let mut k = self.kinematics(x, at_rest);
        let mut gaps = self.gaps(&k);
        if self.largest(&gaps, |gap| gap.r) > ROUNDING {
            let mobility = self.unloaded(k, None)?;
            for _ in 0..2 {
                self.correct(x, &mobility, |c| gaps[c].r, false)?;
                k = self.kinematics(x, at_rest);
                gaps = self.gaps(&k);
                if self.largest(&gaps, |gap| gap.r) <= ROUNDING {
                    break;
                }
            }
            changed = true;
        }
        if self.largest(&gaps, |gap| gap.v) > ROUNDING {
            let mobility = self.unloaded(k, None)?;
            self.correct(x, &mobility, |c| gaps[c].v, true)?;
            changed = true;
        }
        Ok(changed | self.normalise(x))
    }

    /// Bring every orientation on its manifold; true if one was off by more than rounding.
    pub fn normalise(&self, x: &mut [f64]) -> bool {
        let mut changed = false;
        self.each_mut(x, |i, own| changed |= self.members[i].joint.normalise(own));
        changed
    }

    /// Largest distance of an orientation from its manifold.
    pub fn off_manifold(&self, x: &[f64]) -> f64 {
        let mut off = 0.0;
        self.each(x, |i, own| {
            off = f64::max(off, self.members[i].joint.off_manifold(own));
        });
        off
    }

    /// Close the loops on positions, then on velocities, with the element `held` as it is.
    ///
    /// # Errors
    /// [`NotClosed`].
    pub fn close_loops(
        &self,
        x: &mut [f64],
        root: impl Fn(usize) -> Vector<f64, D>,
        held: usize,
    ) -> Result<(), NotClosed> {
        let at_rest = |number| (root(number), Vector::zeros());
        let mut gap = f64::INFINITY;
        for _ in 0..MAX_PASSES {
            let mobility = self.unloaded(self.kinematics(x, at_rest), Some(held))?;
            gap = self.largest(&mobility.gaps, |gap| gap.r);
            if gap <= CLOSED {
                break;
            }
            self.correct(x, &mobility, |c| mobility.gaps[c].r, false)?;
        }
        if gap.is_nan() || gap > ACCEPTED {
            return Err(NotClosed::Gap { gap });
        }
        let mobility = self.unloaded(self.kinematics(x, at_rest), Some(held))?;
        self.correct(x, &mobility, |c| mobility.gaps[c].v, true)?;
        Ok(())
    }
}
