//! How large a step may be before the method itself makes the solution grow.
//!
//! ```text
//! x' = lambda x:   x_(n+1) = R(h lambda) x_n,   R(z) = 1 + z b^T (I - z A)^(-1) 1 = 1 + sum_k z^k b^T A^(k-1) 1
//! ```
//! The coefficients come from the same table as the steps. Source: Hairer & Wanner, *Solving Ordinary Differential
//! Equations II*, section IV.2.

use crate::explicit::Tableau;
use crate::lu::Lu;
use crate::{Complex, Method};

/// Largest growth per step that is taken for the system's own: 10 %.
///
/// A growing mode (`Re lambda > 0`) reaches it at `h Re(lambda) = 0.095`, where a step is coarse anyway.
pub const MAX_AMPLIFICATION: f64 = 1.1;

/// `R(z)` of an explicit method by Horner's rule.
pub(crate) fn explicit<const S: usize>(method: &Tableau<S>, z: Complex) -> Complex {
    let dot = |u: &[f64; S], v: &[f64; S]| u.iter().zip(v).map(|(u, v)| u * v).sum::<f64>();
    let mut power = [1.0; S]; // A^(k-1) 1
    let coefficients: [f64; S] = std::array::from_fn(|_| {
        let coefficient = dot(&method.b, &power);
        power = std::array::from_fn(|i| dot(&method.a[i], &power));
        coefficient
    });
    let one = Complex::new(1.0, 0.0);
    one + z * coefficients.iter().rev().fold(Complex::default(), |sum, c| Complex::new(*c, 0.0) + z * sum)
}

/// `R(z)` of an implicit method with the table `a` (or `alpha + gamma` of a Rosenbrock method) and the weights `b`.
///
/// Its limit 0 far out: only L-stable methods come here.
pub(crate) fn implicit<const S: usize>(a: &[[f64; S]; S], b: &[f64; S], z: Complex) -> Complex {
    const FAR: f64 = 1e100;
    if z.abs() > FAR {
        return Complex::default();
    }
    let one = Complex::new(1.0, 0.0);
    let equations: [[Complex; S]; S] = std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            let unit = if i == j { one } else { Complex::default() };
            unit - a[i][j] * z
        })
    });
    let Some(lu) = Lu::new(&equations) else {
        return Complex::new(f64::INFINITY, 0.0); // a pole, or not a number
    };
    let k = lu.solve(&[one; S]);
    one + z * b.iter().zip(k).fold(Complex::default(), |sum, (b, k)| sum + *b * k)
}

/// Whether a step of `h` makes the mode `lambda` grow by more than [`MAX_AMPLIFICATION`].
///
/// True as well where the growth is not a number. Never for A-stable methods: what grows there grows by itself.
#[must_use]
pub fn violates(method: Method, h: f64, lambda: Complex) -> bool {
    if method.is_a_stable() {
        return !(lambda.re.is_finite() && lambda.im.is_finite());
    }
    let growth = method.stability(h * lambda).abs();
    growth.is_nan() || growth > MAX_AMPLIFICATION
}

/// Largest step `h` so that no step up to `h` lets a mode grow by more than [`MAX_AMPLIFICATION`].
///
/// Infinite when no eigenvalue limits it (all are 0, or the method allows any step), 0 when an eigenvalue is not
/// finite.
#[must_use]
pub fn largest_stable_step(method: Method, eigenvalues: &[Complex]) -> f64 {
    eigenvalues.iter().map(|&lambda| largest_for(method, lambda)).fold(f64::INFINITY, f64::min)
}

fn largest_for(method: Method, lambda: Complex) -> f64 {
    /// Resolution and end of the search along the ray, as `|h lambda|`; explicit methods end below 2 S, and where
    /// a method with an unbounded region does not grow up to the end it is taken as free.
    const FINE: f64 = 1.0 / 256.0;
    const END: f64 = 100.0;

    let size = lambda.abs();
    if !size.is_finite() {
        return 0.0;
    }
    let stable = |r: f64| !violates(method, r / size, lambda);
    let mut inside = 0.0;
    while size > 0.0 && inside < END {
        let mut outside = inside + FINE;
        if stable(outside) {
            inside = outside;
            continue;
        }
        loop {
            let middle = 0.5 * (inside + outside);
            if middle <= inside || middle >= outside {
                return inside / size;
            }
            if stable(middle) {
                inside = middle;
            } else {
                outside = middle;
            }
        }
    }
    f64::INFINITY
}
