//! How far the machine is from tipping over the edges of its support polygon.
//!
//! ```text
//! delta_k = (b_k x (c - f_k))_z/|b_k|,  b_k = f_(k+1) - f_k        positive inside (feet counter-clockwise)   (B15)
//! beta_k = atan2(delta_k, c_z)                                                                              (B16)
//! beta_min = min beta_k, edge: the first index of the minimum                                               (B17)
//! ```

use mechanics::Scalar;
use model::Vector3;

/// Angles about the edges 1 left, 2 rear, 3 right, 4 front.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stability<S> {
    /// Distance of the centre of mass from each edge, positive inside [m]
    pub delta: [S; 4],
    /// Tip-over angles [rad]
    pub beta: [S; 4],
    /// Number of the edge with the smallest angle, from 1
    pub edge: usize,
}

impl<S: Scalar> Stability<S> {
    /// For the centre of mass `c` over the feet `feet`.
    pub fn new(feet: &[[f64; 2]; 4], c: &Vector3<S>) -> Self {
        let delta = std::array::from_fn(|k| {
            let (from, to) = (feet[k], feet[(k + 1) % 4]);
            let b = [to[0] - from[0], to[1] - from[1]];
            let length = b[0].hypot(b[1]);
            ((c.y - from[1]) * b[0] - (c.x - from[0]) * b[1]) / length
        });
        let beta = delta.map(|delta| delta.atan2(c.z));
        let mut edge = 1;
        for k in 1..4 {
            if beta[k] < beta[edge - 1] {
                edge = k + 1;
            }
        }
        Self { delta, beta, edge }
    }

    /// The smallest angle [rad].
    pub fn beta_min(&self) -> S {
        self.beta[self.edge - 1]
    }
}
