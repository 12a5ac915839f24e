//! Exact steps of linear systems `x' = A x + b`, by their transition matrix.
//!
//! ```text
//! x(t + h) = x + Psi(h) (A x + b),   Psi(h) = int_0^h e^(s A) ds
//! ```
//! One evaluation of the right-hand side and one matrix times vector per step; `b` may differ from step to step. `A` is
//! the Jacobian, `Psi` (see `matrix.rs`) is made once for each step size and kept in a [`Transition`].
//!
//! Source: Hochbruck & Ostermann, Acta Numerica 19 (2010), the exponential Euler method, exact for these systems.

use crate::matrix::{Matrix, integral_of_exponential, norm, times};
use crate::one_step::{Call, Estimate, OneStep, Start};
use crate::pace::Pace;
use crate::{Dense, Ode, StepError};

/// What the method `exact` knows of a linear system: its matrix and the transition matrices of two step sizes.
///
/// With [`Solver::advance_cached`](crate::Solver::advance_cached) it lives on between calls. It holds for one `A`: after
/// a change of parameters, [`forget`](Self::forget). The constant `b` (inputs) may change freely. No part of a saved
/// state: it follows from the system.
#[derive(Clone, Debug)]
pub struct Transition<const N: usize> {
    system: Option<Matrix<N>>,
    /// Norm of the system.
    norm: f64,
    slots: [Slot<N>; 2],
}

/// The transition of one step size.
#[derive(Clone, Copy, Debug)]
struct Slot<const N: usize> {
    h: f64,
    psi: Matrix<N>,
    uses: u64,
}

impl<const N: usize> Slot<N> {
    const EMPTY: Self = Self { h: 0.0, psi: [[0.0; N]; N], uses: 0 };
}

impl<const N: usize> Default for Transition<N> {
    fn default() -> Self {
        Self { system: None, norm: 0.0, slots: [Slot::EMPTY; 2] }
    }
}

impl<const N: usize> Transition<N> {
    /// Starts anew: after a change of the matrix `A`.
    pub fn forget(&mut self) {
        *self = Self::default();
    }

    /// Slot of the step size `h`, up to what a correction of first order makes good; filled if need be.
    ///
    /// A step size met rarely (the search for an event) never replaces one met often.
    fn slot(&mut self, h: f64, decompositions: &mut u64) -> Option<&Slot<N>> {
        /// Its square is the relative error left, below rounding.
        const NEAR: f64 = 1e-9;
        let near = |s: &Slot<N>| {
            let off = (s.h - h).abs();
            s.uses > 0 && off <= NEAR * h && off * self.norm <= NEAR
        };
        let index = if let Some(index) = self.slots.iter().position(near) {
            index
        } else {
            let index = usize::from(self.slots[1].uses < self.slots[0].uses);
            *decompositions += 1;
            let psi = integral_of_exponential(self.system.as_ref()?, h)?;
            self.slots[index] = Slot { h, psi, uses: 0 };
            index
        };
        self.slots[index].uses += 1;
        Some(&self.slots[index])
    }
}

/// The method.
pub(crate) struct Exact;

impl Exact {
    /// Exponent of the step size in the error of the dense output; the steps have none.
    pub(crate) const ORDER: u32 = 5;
    pub(crate) const EVALUATIONS: u32 = 1;
}

/// New state of one step.
pub(crate) struct Trial<const N: usize> {
    x: [f64; N],
}

impl<const N: usize> OneStep<N> for Exact {
    type Trial = Trial<N>;
    type Work = Transition<N>;

    fn pace(&self) -> Pace {
        Pace::NONE
    }

    #[inline]
    fn begin<O: Ode<N>>(
        &self,
        call: &mut Call<'_, N, O, Transition<N>>,
        from: &Start<N>,
    ) -> Result<(), StepError<O::Error>> {
        if call.work.system.is_none() {
            let (a, _) = call.jacobian(from)?;
            call.work.norm = norm(&a);
            call.work.system = Some(a);
        }
        Ok(())
    }

    #[inline]
    fn step<O: Ode<N>>(
        &self,
        call: &mut Call<'_, N, O, Transition<N>>,
        from: &Start<N>,
        h: f64,
    ) -> Result<Trial<N>, StepError<O::Error>> {
        let Start { t, x, slope } = from;
        let slot = call
            .work
            .slot(h, &mut call.statistics.decompositions)
            .ok_or(StepError::NoSolution { t: *t, h })?;
        let by = times(&slot.psi, slope);
        let mut x: [f64; N] = std::array::from_fn(|n| x[n] + by[n]);
        let late = h - slot.h;
        if late != 0.0
            && let Some(a) = &call.work.system
        {
            let turn = times(a, &by);
            for n in 0..N {
                x[n] += late * (slope[n] + turn[n]);
            }
        }
        Ok(Trial { x })
    }

    fn state(trial: &Trial<N>) -> &[f64; N] {
        &trial.x
    }

    fn slope<'a>(&self, _trial: &'a Trial<N>) -> Option<&'a [f64; N]> {
        None
    }

    fn error<O: Ode<N>>(
        &self,
        _call: &mut Call<'_, N, O, Transition<N>>,
        _from: &Start<N>,
        _trial: &Trial<N>,
        _h: f64,
        _fresh: bool,
    ) -> Estimate<N> {
        Estimate::NONE
    }

    /// The quintic with the slopes and curvatures at both ends.
    fn dense<O: Ode<N>>(
        &self,
        call: &mut Call<'_, N, O, Transition<N>>,
        from: &Start<N>,
        trial: &mut Trial<N>,
        h: f64,
    ) -> Result<Dense<N>, StepError<O::Error>> {
        let a = call.work.system.unwrap_or([[0.0; N]; N]);
        let rise: [f64; N] = std::array::from_fn(|n| trial.x[n] - from.x[n]);
        let turn = times(&a, &rise);
        let slope: [f64; N] = std::array::from_fn(|n| from.slope[n] + turn[n]);
        let [bend, bend_end] = [times(&a, &from.slope), times(&a, &slope)];
        let mut c = [[0.0; N]; 5];
        for n in 0..N {
            let [c_1, c_2] = [h * from.slope[n], 0.5 * h * h * bend[n]];
            // what is left at the end of position, slope and curvature
            let r = rise[n] - c_1 - c_2;
            let r_1 = h * slope[n] - c_1 - 2.0 * c_2;
            let r_2 = h * h * bend_end[n] - 2.0 * c_2;
            c[0][n] = c_1;
            c[1][n] = c_2;
            c[2][n] = 10.0 * r - 4.0 * r_1 + 0.5 * r_2;
            c[3][n] = -15.0 * r + 7.0 * r_1 - r_2;
            c[4][n] = 6.0 * r - 3.0 * r_1 + 0.5 * r_2;
        }
        Ok(Dense::new(from, h, trial.x, &c))
    }
}
