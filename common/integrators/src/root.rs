//! A bracketing root finder.

/// Narrows `[a, b]` with `f(a) >= 0 > f(b)` to at most `width`, keeping those signs at its ends.
///
/// The ITP method (interpolate, truncate, project): order 1.6 on smooth functions and never more than one evaluation
/// more than bisection. Source: Oliveira & Takahashi, ACM TOMS 47 (2020), `kappa_1 = 0.2 / (b - a)`, `kappa_2 = 2`,
/// `n_0 = 1`.
pub(crate) fn bracket<E>(
    mut f: impl FnMut(f64) -> Result<f64, E>,
    [mut a, mut b]: [f64; 2],
    [mut f_a, mut f_b]: [f64; 2],
    width: f64,
) -> Result<[f64; 2], E> {
    let kappa = 0.2 / (b - a);
    let bisections = ((b - a) / width).log2().ceil().max(0.0);
    // half the width still allowed if bisection were to take over now, n_0 = 1 evaluation late
    let mut allowed = width * bisections.exp2();
    while b - a > width {
        let middle = 0.5 * (a + b);
        let secant = (f_b * a - f_a * b) / (f_b - f_a);
        let toward = (middle - secant).signum();
        let truncated = secant + toward * (kappa * (b - a).powi(2)).min((middle - secant).abs());
        let reach = allowed - 0.5 * (b - a);
        let mut next = if (truncated - middle).abs() <= reach { truncated } else { middle - toward * reach };
        if !(a < next && next < b) {
            next = middle; // rounding
            if !(a < next && next < b) {
                break;
            }
        }
        let value = f(next)?;
        if value >= 0.0 {
            (a, f_a) = (next, value);
        } else {
            (b, f_b) = (next, value);
        }
        allowed *= 0.5;
    }
    Ok([a, b])
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::convert::Infallible;

    /// Bracket, last value of the width and evaluations.
    fn run(f: impl Fn(f64) -> f64, a: f64, b: f64, width: f64) -> ([f64; 2], u32) {
        let mut evaluations = 0;
        let counted = |x: f64| {
            evaluations += 1;
            Ok::<_, Infallible>(f(x))
        };
        let Ok(found) = bracket(counted, [a, b], [f(a), f(b)], width);
        (found, evaluations)
    }

    /// Roots in closed form; the bracket holds each one and is as narrow as asked for.
    #[test]
    fn brackets_known_roots() {
        type Case = (fn(f64) -> f64, f64, f64, f64);
        let cases: [Case; 4] = [
            (|x| 2.0 - x * x, 0.0, 2.0, 2.0_f64.sqrt()),
            (f64::cos, 0.0, 2.0, std::f64::consts::FRAC_PI_2),
            (|x| 0.3 - x.powi(9), 0.0, 1.0, 0.3_f64.powf(1.0 / 9.0)),
            (|x| if x < 0.7 { 1.0 } else { -1e-30 }, 0.0, 1.0, 0.7),
        ];
        for (f, a, b, root) in cases {
            let ([lo, hi], evaluations) = run(f, a, b, 1e-14);
            let rounding = 4.0 * f64::EPSILON;
            assert!(lo - rounding <= root && root <= hi + rounding, "{lo} {root} {hi}");
            assert!(hi - lo <= 1e-14 && f(lo) >= 0.0 && f(hi) < 0.0);
            // bisection halves 2 to 1e-14 in 48
            assert!(evaluations <= 49, "{evaluations}");
        }
    }

    #[test]
    fn smooth_roots_take_few_evaluations() {
        let (_, evaluations) = run(|x| 2.0 - x * x, 0.0, 2.0, 1e-14);
        assert!(evaluations <= 12, "{evaluations}"); // order 1.6 from an error of 1: 8 to 1e-16, and the other side
    }
}
