//! What several systems need to check parameters, and to say no.

use mechanics::{Scalar, Vector};
use model::{ParameterError, SymmetricTensor};

pub(super) fn refused(
    variable: &'static str,
    value: f64,
    reason: impl Into<String>,
    allowed: impl Into<String>,
) -> ParameterError {
    ParameterError::Refused { variable, value, reason: reason.into(), allowed: allowed.into() }
}

/// A tensor that a rigid body can have.
pub(super) fn check_inertia(
    name: &'static str,
    inertia: &SymmetricTensor<f64>,
) -> Result<(), ParameterError> {
    let moments = inertia.matrix().symmetric_eigenvalues();
    positive_inertia(name, moments.min())?;
    let largest = moments.max();
    let excess = 2.0 * largest - moments.sum();
    if excess > 1e-12 * largest {
        let reason =
            format!("the largest principal moment exceeds the sum of the others by {excess:.3e} kg.m2");
        return Err(refused(name, largest, reason, "principal moments that satisfy the triangle inequality"));
    }
    Ok(())
}

pub(super) fn positive_inertia(name: &'static str, smallest: f64) -> Result<(), ParameterError> {
    if smallest > 0.0 {
        return Ok(());
    }
    Err(refused(name, smallest, "the smallest principal moment is not positive", "positive definite"))
}

/// Length of a vector, smooth enough at zero for dual numbers.
pub(super) fn magnitude<S: Scalar, const D: usize>(v: &Vector<S, D>) -> S {
    let squared = v.dot(v);
    if squared.re().vanishes() { S::lift(0.0) } else { squared.sqrt() }
}
