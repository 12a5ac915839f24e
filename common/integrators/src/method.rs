//! The methods on offer.

use serde::{Deserialize, Serialize};

use crate::dop853::Dop853;
use crate::dopri5::DOPRI5;
use crate::exact::Exact;
use crate::explicit::Tableau;
use crate::heun::HEUN;
use crate::radau5::Radau5;
use crate::rk4::RK4;
use crate::rodas4::Rodas4;
use crate::{Complex, stability};

/// An integration method.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Method {
    /// Heun (explicit trapezoidal rule), fixed step, order 2.
    Heun,
    /// Classical Runge-Kutta, fixed step, order 4.
    Rk4,
    /// Dormand & Prince, adaptive step, order 5.
    Dopri5,
    /// Dormand & Prince, adaptive step, order 8.
    Dop853,
    /// Rosenbrock method of Hairer & Wanner, adaptive step, order 4, L-stable: stiff problems, moderate accuracy.
    Rodas4,
    /// Radau IIA of Hairer & Wanner, adaptive step, order 5, L-stable: stiff problems, high accuracy.
    Radau5,
    /// Transition matrix, fixed step: exact for linear systems, refused for others.
    Exact,
}

impl Method {
    /// Every method.
    pub const ALL: [Self; 7] =
        [Self::Heun, Self::Rk4, Self::Dopri5, Self::Dop853, Self::Rodas4, Self::Radau5, Self::Exact];

    /// Exponent of the step size in the global error; of Exact, in that of its dense output.
    #[must_use]
    pub const fn order(self) -> u32 {
        match self {
            Self::Heun => HEUN.order,
            Self::Rk4 => RK4.order,
            Self::Dopri5 => DOPRI5.order,
            Self::Dop853 => Dop853::ORDER,
            Self::Rodas4 => Rodas4::ORDER,
            Self::Radau5 => Radau5::ORDER,
            Self::Exact => Exact::ORDER,
        }
    }

    /// Evaluations of the right-hand side per step in a longer run; Radau5: with two iterations per step.
    #[must_use]
    pub const fn stages(self) -> u32 {
        const fn evaluations<const S: usize>(m: &Tableau<S>) -> u32 {
            #[allow(clippy::cast_possible_truncation, reason = "at most a dozen")]
            let stages = S as u32;
            if m.first_same_as_last { stages - 1 } else { stages }
        }
        match self {
            Self::Heun => evaluations(&HEUN),
            Self::Rk4 => evaluations(&RK4),
            Self::Dopri5 => evaluations(&DOPRI5),
            Self::Dop853 => Dop853::EVALUATIONS,
            Self::Rodas4 => Rodas4::EVALUATIONS,
            Self::Radau5 => Radau5::EVALUATIONS,
            Self::Exact => Exact::EVALUATIONS,
        }
    }

    /// Whether the method chooses its own step size.
    #[must_use]
    pub const fn is_adaptive(self) -> bool {
        !matches!(self, Self::Heun | Self::Rk4 | Self::Exact)
    }

    /// Whether no step is too long for a system that does not grow by itself.
    #[must_use]
    pub const fn is_a_stable(self) -> bool {
        matches!(self, Self::Rodas4 | Self::Radau5 | Self::Exact)
    }

    /// Stability function `R(z)`: one step of `x' = lambda x` multiplies `x` by `R(h lambda)`.
    #[must_use]
    pub fn stability(self, z: Complex) -> Complex {
        match self {
            Self::Heun => stability::explicit(&HEUN, z),
            Self::Rk4 => stability::explicit(&RK4, z),
            Self::Dopri5 => stability::explicit(&DOPRI5, z),
            Self::Dop853 => Dop853::stability(z),
            Self::Rodas4 => Rodas4::stability(z),
            Self::Radau5 => Radau5::stability(z),
            Self::Exact => z.exp(),
        }
    }
}
