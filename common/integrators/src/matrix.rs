//! Functions of a square matrix: the integral of its exponential.
//!
//! ```text
//! Psi(h) = int_0^h e^(s A) ds = h phi_1(h A),   e^(h A) = I + A Psi(h)
//! ```
//! With `Z = A h / 2^s` and the Padé approximant `e^Z = (V - U)^(-1) (V + U)`, `U = Z W`, `V` and `W` even in `Z`,
//! `phi_1(Z) = 2 (V - U)^(-1) W`; then `s` times `Psi <- Psi + E Psi`, `E <- E E`. The matrix is balanced first: states of
//! different units would scale it too far down.
//!
//! Source: N. J. Higham, SIAM J. Matrix Anal. Appl. 26 (2005) (degree 13, bound 5.37, scaling and squaring);
//! Hochbruck & Ostermann, Acta Numerica 19 (2010) (`phi_1`); Parlett & Reinsch, Numer. Math. 13 (1969) (balancing).

use crate::lu::Lu;

pub(crate) type Matrix<const N: usize> = [[f64; N]; N];

/// Numerator of the Padé approximant of degree 13.
const PADE: [f64; 14] = [
    64_764_752_532_480_000.0,
    32_382_376_266_240_000.0,
    7_771_770_303_897_600.0,
    1_187_353_796_428_800.0,
    129_060_195_264_000.0,
    10_559_470_521_600.0,
    670_442_572_800.0,
    33_522_128_640.0,
    1_323_241_920.0,
    40_840_800.0,
    960_960.0,
    16_380.0,
    182.0,
    1.0,
];
/// Norm up to which it is exact to rounding.
const BOUND: f64 = 5.371_920_351_148_152;

/// `a b`
#[inline]
pub(crate) fn product<const N: usize>(a: &Matrix<N>, b: &Matrix<N>) -> Matrix<N> {
    let mut c = [[0.0; N]; N];
    for (c, a) in c.iter_mut().zip(a) {
        for (a, b) in a.iter().zip(b) {
            for (c, b) in c.iter_mut().zip(b) {
                *c += a * b;
            }
        }
    }
    c
}

/// `a x`
#[inline]
pub(crate) fn times<const N: usize>(a: &Matrix<N>, x: &[f64; N]) -> [f64; N] {
    let mut y = [0.0; N];
    for (y, row) in y.iter_mut().zip(a) {
        // four sums side by side
        let mut sums = [0.0; 4];
        let (rows, xs) = (row.chunks_exact(4), x.chunks_exact(4));
        let rest: f64 = rows.remainder().iter().zip(xs.remainder()).map(|(a, x)| a * x).sum();
        for (a, x) in rows.zip(xs) {
            for k in 0..4 {
                sums[k] += a[k] * x[k];
            }
        }
        *y = (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest;
    }
    y
}

/// Largest column sum.
pub(crate) fn norm<const N: usize>(a: &Matrix<N>) -> f64 {
    (0..N).map(|j| a.iter().map(|row| row[j].abs()).sum()).fold(0.0, f64::max)
}

/// `sum_k c_k m_k + c I`
fn combine<const N: usize>(terms: &[(f64, &Matrix<N>)], c: f64) -> Matrix<N> {
    let mut sum = [[0.0; N]; N];
    for (factor, m) in terms {
        for (sum, m) in sum.iter_mut().zip(*m) {
            for (sum, m) in sum.iter_mut().zip(m) {
                *sum += factor * m;
            }
        }
    }
    for i in 0..N {
        sum[i][i] += c;
    }
    sum
}

/// Powers of two `d` so that rows and columns of `d^(-1) a d` are of like size; `a` becomes that matrix.
fn balance<const N: usize>(a: &mut Matrix<N>) -> [f64; N] {
    const SWEEPS: u32 = 20;
    let mut d = [1.0; N];
    for _ in 0..SWEEPS {
        let mut changed = false;
        for i in 0..N {
            let (mut column, mut row) = (0.0, 0.0);
            for j in (0..N).filter(|&j| j != i) {
                column += a[j][i].abs();
                row += a[i][j].abs();
            }
            if !(column > 0.0 && row > 0.0 && column.is_finite() && row.is_finite()) {
                continue;
            }
            let factor = (0.5 * (row / column).log2()).round().exp2();
            if column * factor + row / factor < 0.95 * (column + row) {
                changed = true;
                d[i] *= factor;
                for j in 0..N {
                    a[j][i] *= factor;
                    a[i][j] /= factor;
                }
            }
        }
        if !changed {
            break;
        }
    }
    d
}

/// `Psi(h)`; `None` if it is not finite.
pub(crate) fn integral_of_exponential<const N: usize>(a: &Matrix<N>, h: f64) -> Option<Matrix<N>> {
    let mut z = *a;
    let d = balance(&mut z);
    let size = h * norm(&z);
    if !size.is_finite() {
        return None;
    }
    let mut doublings = 0;
    let mut scale = h;
    while size > BOUND * f64::from(doublings).exp2() {
        doublings += 1;
        scale *= 0.5;
    }
    let z = z.map(|row| row.map(|z| scale * z));
    let b = &PADE;
    let z_2 = product(&z, &z);
    let z_4 = product(&z_2, &z_2);
    let z_6 = product(&z_4, &z_2);
    let even = |high: [f64; 3], low: [f64; 4]| {
        let inner = combine(&[(high[0], &z_6), (high[1], &z_4), (high[2], &z_2)], 0.0);
        let outer = product(&z_6, &inner);
        combine(&[(1.0, &outer), (low[0], &z_6), (low[1], &z_4), (low[2], &z_2)], low[3])
    };
    let w = even([b[13], b[11], b[9]], [b[7], b[5], b[3], b[1]]);
    let v = even([b[12], b[10], b[8]], [b[6], b[4], b[2], b[0]]);
    let u = product(&z, &w);
    let lu = Lu::new(&combine(&[(1.0, &v), (-1.0, &u)], 0.0))?;
    // columns of phi_1, as rows; it commutes with z, so products may be formed on either side
    let mut psi = [[0.0; N]; N];
    for j in 0..N {
        let column = lu.solve(&std::array::from_fn(|i| 2.0 * w[i][j]));
        for i in 0..N {
            psi[i][j] = scale * column[i];
        }
    }
    let mut exponential = combine(&[(1.0 / scale, &product(&z, &psi))], 1.0);
    for step in 0..doublings {
        psi = combine(&[(1.0, &psi), (1.0, &product(&exponential, &psi))], 0.0);
        if step + 1 < doublings {
            exponential = product(&exponential, &exponential);
        }
    }
    for i in 0..N {
        for j in 0..N {
            psi[i][j] *= d[i] / d[j];
        }
    }
    psi.iter().flatten().all(|v| v.is_finite()).then_some(psi)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `phi_1` of numbers: `(e^z - 1)/z`.
    #[test]
    fn numbers_come_out_as_in_closed_form() {
        for (a, h) in [(-3.0, 0.2), (-2e4, 1.0), (5.0, 2.0), (1e-9, 1.0), (0.0, 0.7)] {
            let psi = integral_of_exponential(&[[a]], h).expect("finite")[0][0];
            let exact = if a == 0.0 { h } else { f64::exp_m1(a * h) / a };
            assert!((psi / exact - 1.0).abs() < 1e-14, "{a} {h}: {psi} {exact}");
        }
    }

    /// A chain of integrators (nilpotent) has `Psi_ij = h^(k+1)/(k+1)!`, `k = j - i`, whatever the units.
    #[test]
    fn chain_of_integrators_gives_powers_of_time() {
        for unit in [1.0, 1e6] {
            let a = [[0.0, unit, 0.0], [0.0, 0.0, 1.0], [0.0; 3]];
            let psi = integral_of_exponential(&a, 3.0).expect("finite");
            let exact = [[3.0, 4.5 * unit, 4.5 * unit], [0.0, 3.0, 4.5], [0.0, 0.0, 3.0]];
            for (p, e) in psi.iter().flatten().zip(exact.iter().flatten()) {
                assert!((p - e).abs() <= 1e-14 * e.abs(), "{p} {e}");
            }
        }
    }

    /// Rotation: `Psi = ((sin, 1 - cos), (cos - 1, sin))`, over many turns, and the rates in units of 1e6.
    #[test]
    fn rotation_keeps_its_phase() {
        for unit in [1.0, 1e-6] {
            for h in [0.3_f64, 40.0] {
                let psi = integral_of_exponential(&[[0.0, unit], [-1.0 / unit, 0.0]], h).expect("finite");
                let exact = [[h.sin(), unit * (1.0 - h.cos())], [(h.cos() - 1.0) / unit, h.sin()]];
                for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                    let scale = unit.powi([[0, 1], [-1, 0]][i][j]);
                    // rounding of the phase grows with the squarings, at most as h |A|
                    assert!(
                        (psi[i][j] - exact[i][j]).abs() < 1e-15 * (4.0 + h) * scale,
                        "{unit} {h} {i} {j}"
                    );
                }
            }
        }
    }

    #[test]
    fn products_of_any_size_are_those_of_their_sums() {
        let mut next = 0.0;
        let a: Matrix<7> = [[0.0; 7]; 7].map(|row| {
            row.map(|_| {
                next = (next + 5.0) % 7.0;
                next
            })
        });
        let x = [-2.0, 3.0, 0.5, 1.0, -7.0, 0.25, 2.0];
        let y = times(&a, &x);
        for i in 0..7 {
            let sum: f64 = (0..7).map(|j| a[i][j] * x[j]).sum();
            assert!((y[i] - sum).abs() < 1e-13);
        }
    }
}
