//! The classical Runge-Kutta method, order 4.
//!
//! ```text
//! 0   |
//! 1/2 | 1/2                       b_1(theta) = theta - 3/2 theta^2 + 2/3 theta^3
//! 1/2 | 0    1/2                  b_2(theta) = b_3(theta) = theta^2 - 2/3 theta^3
//! 1   | 0    0    1               b_4(theta) = -1/2 theta^2 + 2/3 theta^3
//! ----+--------------------
//!     | 1/6  1/3  1/3  1/6
//! ```
//! Source: W. Kutta, Z. Math. Phys. 46 (1901); extension: M. Zennaro, Math. Comp. 46 (1986), the natural one. It
//! has the order of a cubic Hermite polynomial (3, local error `O(h^4)`) and needs no slope at the new state.

use crate::explicit::Tableau;
use crate::pace::Pace;

const THIRD: f64 = 1.0 / 3.0;
const SIXTH: f64 = 1.0 / 6.0;

pub(crate) const RK4: Tableau<4> = Tableau {
    order: 4,
    pace: Pace::NONE,
    a: [[0.0, 0.0, 0.0, 0.0], [0.5, 0.0, 0.0, 0.0], [0.0, 0.5, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]],
    b: [SIXTH, THIRD, THIRD, SIXTH],
    c: [0.0, 0.5, 0.5, 1.0],
    error: [0.0; 4],
    dense: [
        [1.0, -1.5, 2.0 * THIRD, 0.0],
        [0.0, 1.0, -2.0 * THIRD, 0.0],
        [0.0, 1.0, -2.0 * THIRD, 0.0],
        [0.0, -0.5, 2.0 * THIRD, 0.0],
    ],
    first_same_as_last: false,
};
