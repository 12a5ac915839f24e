//! The table against the order conditions.

use super::*;

/// Rounding of sums of a dozen terms of size up to 44 (the largest entry).
const ROUNDING: f64 = 12.0 * 44.0 * f64::EPSILON;

fn c(j: usize) -> f64 {
    match j {
        0 => 0.0,
        1..STAGES => C[j - 1],
        STAGES => 1.0,
        _ => C_DENSE[j - STAGES - 1],
    }
}

fn moment(row: Row, q: i32) -> f64 {
    row.iter().map(|&(j, w)| w * c(j).powi(q)).sum()
}

/// `sum_j a_ij c_j^q = c_i^(q+1)/(q+1)`: for q = 0 in every row, for q = 1, 2, 3 from the third, fourth and sixth stage on.
#[test]
fn stages_have_their_orders() {
    for (i, row) in A.iter().chain(&A_DENSE).enumerate() {
        let stage = if i < STAGES - 1 { i + 1 } else { i + 2 };
        for q in 0..4 {
            let defect = moment(row, q) - c(stage).powi(q + 1) / f64::from(q + 1);
            let promised = q == 0 || q == 1 && stage > 1 || q == 2 && stage > 2 || stage > 4;
            assert!(!promised || defect.abs() < ROUNDING, "stage {stage}, q = {q}: {defect:e}");
        }
    }
}

/// Quadrature: `sum b_i c_i^q = 1/(q+1)` for q < 8 and not beyond; the embedded weights up to their orders.
#[test]
fn weights_integrate_powers_of_time() {
    for q in 0..9_i32 {
        let exact = 1.0 / f64::from(q + 1);
        assert_eq!((moment(B, q) - exact).abs() < ROUNDING, q < 8, "b, q = {q}");
        assert_eq!(moment(ERROR_5, q).abs() < ROUNDING, q < 5, "order 5, q = {q}");
        assert_eq!((moment(WEIGHTS_3, q) - exact).abs() < ROUNDING, q < 3, "order 3, q = {q}");
    }
}

/// Each nested condition `b^T A^i C^p A^j c^q` of order up to 8: `b^T` on `A v` must be the integral of the monomial.
#[test]
fn nested_conditions_hold_up_to_order_8() {
    let apply = |v: &[f64; STAGES]| -> [f64; STAGES] {
        std::array::from_fn(|i| match i {
            0 => 0.0,
            _ => A[i - 1].iter().map(|&(j, w)| w * v[j]).sum(),
        })
    };
    let times = |v: &[f64; STAGES], p: i32| -> [f64; STAGES] { std::array::from_fn(|i| v[i] * c(i).powi(p)) };
    for (q, first, p, second, r) in (0..7).flat_map(|q| {
        (0..5).flat_map(move |first| {
            (0..5).flat_map(move |p| {
                (0..5).flat_map(move |second| (0..5).map(move |r| (q, first, p, second, r)))
            })
        })
    }) {
        let degree = q + first + p + second + r;
        if degree >= 8 {
            continue;
        }
        // t^q integrated `first` times, times t^p, integrated `second` times, times t^r, integrated over the step
        let (mut v, mut exact, mut power) = (times(&[1.0; STAGES], q), 1.0, f64::from(q));
        for _ in 0..first {
            (v, power) = (apply(&v), power + 1.0);
            exact /= power;
        }
        (v, power) = (times(&v, p), power + f64::from(p));
        for _ in 0..second {
            (v, power) = (apply(&v), power + 1.0);
            exact /= power;
        }
        (v, power) = (times(&v, r), power + f64::from(r) + 1.0);
        exact /= power;
        let sum: f64 = B.iter().map(|&(j, w)| w * v[j]).sum();
        assert!((sum - exact).abs() < ROUNDING, "{:?}: {:e}", (q, first, p, second, r), sum - exact);
    }
}

/// The extension integrates powers of time up to its order 7, inside the step.
#[test]
fn extension_integrates_powers_of_time() {
    for q in 0..8 {
        let k: [[f64; 1]; ALL_STAGES] = std::array::from_fn(|j| [c(j).powi(q)]);
        let f_1 = combine(1.0, B, &k);
        let [k_1, k_13] = [k[0][0], k[STAGES][0]];
        let [f_4, f_5, f_6, f_7] = D.map(|row| combine(1.0, row, &k));
        let f = [f_1, [k_1 - f_1[0]], [2.0 * f_1[0] - k_1 - k_13], f_4, f_5, f_6, f_7];
        let p = powers_of_theta(&f);
        for theta in [0.1_f64, 0.5, 0.9] {
            let value = p.iter().rev().fold(0.0, |sum, p| theta * (sum + p[0]));
            let defect = value - theta.powi(q + 1) / f64::from(q + 1);
            // entries of the extension go up to 545
            assert_eq!(defect.abs() < 12.0 * ROUNDING, q < 7, "q = {q}: {defect:e}");
        }
    }
}
