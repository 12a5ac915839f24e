//! What is integrated.

/// `df/dx` (row `i`, column `j`: `d f_i / d x_j`) and `df/dt`.
pub type Jacobian<const N: usize> = ([[f64; N]; N], [f64; N]);

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

    /// Derivatives at a point with the slope `f`, for implicit methods.
    ///
    /// Exact where the model can (dual numbers); by default forward differences, or backward ones where the model has
    /// no value ahead.
    ///
    /// # Errors
    /// Where the model has no value near `x`.
    fn jacobian(&self, t: f64, x: &[f64; N], f: &[f64; N]) -> Result<Jacobian<N>, Self::Error> {
        let relative = f64::EPSILON.sqrt();
        let nominal = self.nominal();
        let mut jacobian = [[0.0; N]; N];
        for j in 0..N {
            let size = if nominal[j].is_finite() { nominal[j] } else { 1.0 };
            let mut moved = *x;
            let mut shift = |delta: f64| {
                moved[j] = x[j] + delta;
                let delta = moved[j] - x[j]; // as rounded
                self.rhs(t, &moved).map(|f| (f, delta))
            };
            let delta = relative * x[j].abs().max(size);
            let (shifted, delta) = shift(delta).or_else(|_| shift(-delta))?;
            for i in 0..N {
                jacobian[i][j] = (shifted[i] - f[i]) / delta;
            }
        }
        let delta = (t + relative * t.abs().max(1.0)) - t;
        let shifted = self.rhs(t + delta, x)?;
        let rate = std::array::from_fn(|i| (shifted[i] - f[i]) / delta);
        Ok((jacobian, rate))
    }

    /// Whether `f(t, x) = A x + b` with `A` and `b` constant within a call: what the method `exact` asks for.
    fn linear(&self) -> bool {
        false
    }
}
