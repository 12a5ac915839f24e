//! Start step of adaptive methods: an Euler step shows how fast the slope turns.
//!
//! ```text
//! h_0 = 0.01 |x| / |f|,   h_1 = (0.01 / max(|f|, |f(x + h_0 f) - f| / h_0))^(1/p),   h = min(100 h_0, h_1)
//! ```
//! Source: Hairer, Nørsett & Wanner, section II.4.

/// Length of the Euler step from the sizes of state and slope [s].
pub(crate) fn euler(state: f64, slope: f64, remaining: f64) -> f64 {
    if state < 1e-5 || slope < 1e-5 { 1e-6 } else { 0.01 * state / slope }.min(remaining)
}

/// First step from the sizes of the slope and of its rate [s].
pub(crate) fn length([slope, rate]: [f64; 2], euler: f64, order: f64, remaining: f64) -> f64 {
    let steepest = slope.max(rate);
    let turning =
        if steepest <= 1e-15 { (1e-3 * euler).max(1e-6) } else { (0.01 / steepest).powf(1.0 / order) };
    let h = (100.0 * euler).min(turning).min(remaining);
    if h > 0.0 { h } else { euler } // not a number
}
