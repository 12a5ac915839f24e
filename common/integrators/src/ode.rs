//! What is integrated.

/// An initial value problem `x' = f(t, x)`.
pub trait Ode<const N: usize> {
    /// Why the right-hand side may fail, e.g. a strut of length zero.
    type Error;

    /// `f(t, x)`: a pure function of its arguments and of what `self` holds.
    ///
    /// # Errors
    /// Where the model has no value. An adaptive method takes an error inside a trial step as a step too long and
    /// shrinks it; at the start of a step, and in fixed steps, the error is returned.
    fn rhs(&self, t: f64, x: &[f64; N]) -> Result<[f64; N], Self::Error>;

    /// Brings a new state back on its manifold (closed loop, unit quaternion); called once after every accepted step.
    ///
    /// The result says whether `x` was changed: then the last slope of the step is not reused as the first one of
    /// the next.
    ///
    /// # Errors
    /// When the projection does not converge; the call then fails as a whole.
    fn project(&self, _t: f64, _x: &mut [f64; N]) -> Result<bool, Self::Error> {
        Ok(false)
    }

    /// Typical magnitude of each state, for the error norm of adaptive methods:
    /// `scale_i = atol nominal_i + rtol max(|x_i|, |x_new_i|)`.
    ///
    /// Infinite: the component does not count (quadratures such as energies).
    fn nominal(&self) -> [f64; N] {
        [1.0; N]
    }
}
