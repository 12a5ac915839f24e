//! Dormand & Prince, order 5 with an error estimate of order 4.
//!
//! Seven stages, six evaluations per step: the last stage is the first one of the next step.
//! Source: J. R. Dormand, P. J. Prince, J. Comp. Appl. Math. 6 (1980); continuous extension of order 4:
//! L. F. Shampine, in the form of Hairer, Nørsett & Wanner, section II.6:
//! ```text
//! x(theta) = x_0 + theta D + theta (1 - theta) (B + theta ((D - h k_7 - B) + (1 - theta) h sum_i d_i k_i))
//! D = x_1 - x_0,  B = h k_1 - D
//! ```

use crate::explicit::{POWERS, Tableau};
use crate::pace::Pace;

const B: [f64; 7] = [35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0, 0.0];

/// `d_i` of the continuous extension.
const D: [f64; 7] = [
    -12_715_105_075.0 / 11_282_082_432.0,
    0.0,
    87_487_479_700.0 / 32_700_410_799.0,
    -10_690_763_975.0 / 1_880_347_072.0,
    701_980_252_875.0 / 199_316_789_632.0,
    -1_453_857_185.0 / 822_651_844.0,
    69_997_945.0 / 29_380_423.0,
];

pub(crate) const DOPRI5: Tableau<7> = Tableau {
    order: 5,
    pace: Pace { order: 5.0, beta: 0.04, shrink: 0.2, grow: 10.0, predictive: false },
    a: [
        [0.0; 7],
        [1.0 / 5.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [3.0 / 40.0, 9.0 / 40.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0, 0.0, 0.0, 0.0, 0.0],
        [19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0, 0.0, 0.0, 0.0],
        [9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0, 0.0, 0.0],
        B,
    ],
    b: B,
    c: [0.0, 1.0 / 5.0, 3.0 / 10.0, 4.0 / 5.0, 8.0 / 9.0, 1.0, 1.0],
    error: [
        71.0 / 57600.0,
        0.0,
        -71.0 / 16695.0,
        71.0 / 1920.0,
        -17253.0 / 339_200.0,
        22.0 / 525.0,
        -1.0 / 40.0,
    ],
    dense: powers_of_theta(),
    first_same_as_last: true,
};

/// The continuous extension sorted by powers of theta.
const fn powers_of_theta() -> [[f64; POWERS]; 7] {
    let mut dense = [[0.0; POWERS]; 7];
    let mut i = 0;
    while i < 7 {
        let first = if i == 0 { 1.0 } else { 0.0 };
        let last = if i == 6 { 1.0 } else { 0.0 };
        let b = first - B[i];
        let r = B[i] - last - b;
        dense[i] = [first, r - b + D[i], -r - 2.0 * D[i], D[i]];
        i += 1;
    }
    dense
}
