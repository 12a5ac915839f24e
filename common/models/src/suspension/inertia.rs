//! Conditions on the inertia of a rigid body.

use model::{ParameterError, SymmetricTensor};

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
        return Err(ParameterError::refused(
            name,
            largest,
            reason,
            "principal moments that satisfy the triangle inequality",
        ));
    }
    Ok(())
}

/// A smallest principal moment that a body can have.
pub(super) fn positive_inertia(name: &'static str, smallest: f64) -> Result<(), ParameterError> {
    if smallest > 0.0 {
        return Ok(());
    }
    Err(ParameterError::refused(
        name,
        smallest,
        "the smallest principal moment is not positive",
        "positive definite",
    ))
}
