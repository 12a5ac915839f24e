//! Heun's method (explicit trapezoidal rule), order 2.
//!
//! ```text
//! 0 |
//! 1 | 1
//! --+---------
//!   | 1/2  1/2      b_1(theta) = theta - theta^2/2,  b_2(theta) = theta^2/2
//! ```
//! Source: K. Heun, Z. Math. Phys. 45 (1900); extension: the quadratic through the two slopes.

use crate::explicit::Tableau;
use crate::pace::Pace;

pub(crate) const HEUN: Tableau<2> = Tableau {
    order: 2,
    pace: Pace::NONE,
    a: [[0.0, 0.0], [1.0, 0.0]],
    b: [0.5, 0.5],
    c: [0.0, 1.0],
    error: [0.0; 2],
    dense: [[1.0, -0.5, 0.0, 0.0], [0.0, 0.5, 0.0, 0.0]],
    first_same_as_last: false,
};
