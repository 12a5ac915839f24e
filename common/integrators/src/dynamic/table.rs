//! The numbers of the explicit methods as rows of any length, for systems whose size is known only at run time.

use crate::Method;
use crate::dop853;
use crate::dopri5::DOPRI5;
use crate::explicit::{POWERS, Tableau};
use crate::heun::HEUN;
use crate::pace::Pace;
use crate::rk4::RK4;

/// Nonzero weights with the stages they belong to.
pub(super) type Row = Vec<(usize, f64)>;

/// How the local error is estimated.
pub(super) enum Errors {
    /// Not at all: fixed steps
    None,
    /// From one embedded method
    Embedded(Row),
    /// From the two of Dop853: weights of order 5 minus those of the method, weights of order 3
    Two(Row, Row),
}

/// The solution inside a step.
pub(super) enum Extension {
    /// `sum_i k_i sum_p dense_ip theta^p`
    Powers(Vec<[f64; POWERS]>),
    /// Of Dop853, with three stages more
    Dop853,
}

/// An explicit method.
pub(super) struct Table {
    pub(super) pace: Pace,
    /// Row `i` makes stage `i + 1`
    pub(super) a: Vec<Row>,
    pub(super) b: Row,
    pub(super) c: Vec<f64>,
    pub(super) errors: Errors,
    pub(super) extension: Extension,
    /// The last row of `a` is `b`
    pub(super) first_same_as_last: bool,
}

impl Table {
    /// The table of an explicit method, nothing for the others.
    pub(super) fn of(method: Method) -> Option<Self> {
        match method {
            Method::Heun => Some(Self::from_tableau(&HEUN)),
            Method::Rk4 => Some(Self::from_tableau(&RK4)),
            Method::Dopri5 => Some(Self::from_tableau(&DOPRI5)),
            Method::Dop853 => Some(Self::dop853()),
            Method::Rodas4 | Method::Radau5 | Method::Exact => None,
        }
    }

    fn from_tableau<const S: usize>(m: &Tableau<S>) -> Self {
        let error = nonzero(&m.error);
        Self {
            pace: m.pace,
            a: m.a[1..].iter().map(|row| nonzero(row)).collect(),
            b: nonzero(&m.b),
            c: m.c.to_vec(),
            errors: if error.is_empty() { Errors::None } else { Errors::Embedded(error) },
            extension: Extension::Powers(m.dense.to_vec()),
            first_same_as_last: m.first_same_as_last,
        }
    }

    fn dop853() -> Self {
        Self {
            pace: dop853::PACE,
            a: dop853::A.iter().map(|row| row.to_vec()).collect(),
            b: dop853::B.to_vec(),
            c: std::iter::once(0.0).chain(dop853::C).collect(),
            errors: Errors::Two(dop853::ERROR_5.to_vec(), dop853::WEIGHTS_3.to_vec()),
            extension: Extension::Dop853,
            first_same_as_last: false,
        }
    }

    /// Number of stages of a step.
    pub(super) fn stages(&self) -> usize {
        self.c.len()
    }

    /// Number of stages with those of the extension.
    pub(super) fn all_stages(&self) -> usize {
        match self.extension {
            Extension::Powers(_) => self.stages(),
            Extension::Dop853 => dop853::ALL_STAGES,
        }
    }
}

fn nonzero(weights: &[f64]) -> Row {
    weights.iter().copied().enumerate().filter(|(_, w)| w.to_bits() != 0).collect()
}
