//! The methods on offer.

use crate::dop853::Dop853;
use crate::dopri5::DOPRI5;
use crate::explicit::Tableau;
use crate::heun::HEUN;
use crate::rk4::RK4;
use crate::rodas4::Rodas4;
use crate::{Complex, stability};

/// An integration method.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
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
}

impl Method {
    /// Every method.
    pub const ALL: [Self; 5] = [Self::Heun, Self::Rk4, Self::Dopri5, Self::Dop853, Self::Rodas4];

    /// Exponent of the step size in the global error.
    #[must_use]
    pub const fn order(self) -> u32 {
        match self {
            Self::Heun => HEUN.order,
            Self::Rk4 => RK4.order,
            Self::Dopri5 => DOPRI5.order,
            Self::Dop853 => Dop853::ORDER,
            Self::Rodas4 => Rodas4::ORDER,
        }
    }

    /// Evaluations of the right-hand side per step in a longer run.
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
        }
    }

    /// Whether the method chooses its own step size.
    #[must_use]
    pub const fn is_adaptive(self) -> bool {
        !matches!(self, Self::Heun | Self::Rk4)
    }

    /// Whether no step is too long for a system that does not grow by itself.
    #[must_use]
    pub const fn is_a_stable(self) -> bool {
        matches!(self, Self::Rodas4)
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
        }
    }
}
