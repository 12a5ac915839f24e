//! Motion of a coordinate from rest to rest with minimum jerk.
//!
//! ```text
//! r = start + (end - start) (10 s^3 - 15 s^4 + 6 s^5),   s = clip((t - t0)/duration, 0, 1)
//! ```
//! Source: Flash & Hogan (1985).

use mechanics::Scalar;

/// Position, velocity and acceleration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Moved<S> {
    pub(crate) r: S,
    pub(crate) v: S,
    pub(crate) a: S,
}

/// From rest to rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct MinJerk {
    pub(crate) start: f64,
    pub(crate) end: f64,
    pub(crate) t0: f64,
    pub(crate) duration: f64,
}

impl MinJerk {
    #[inline]
    pub(crate) fn at<S: Scalar>(&self, t: S) -> Moved<S> {
        let zero = S::lift(0.0);
        let tau = (t - self.t0) / self.duration;
        if tau.re() <= 0.0 {
            return Moved { r: S::lift(self.start), v: zero, a: zero };
        }
        if tau.re() >= 1.0 {
            return Moved { r: S::lift(self.end), v: zero, a: zero };
        }
        let way = self.end - self.start;
        let (left, square) = (-tau + 1.0, tau * tau);
        Moved {
            r: square * tau * (tau * (tau * 6.0 - 15.0) + 10.0) * way + self.start,
            v: square * left * left * (30.0 * way / self.duration),
            a: tau * left * (tau * -2.0 + 1.0) * (60.0 * way / (self.duration * self.duration)),
        }
    }

    /// Times at which the jerk jumps.
    pub(crate) fn kinks(&self) -> [f64; 2] {
        [self.t0, self.t0 + self.duration]
    }
}

/// The first of some times after `t`; infinite: none.
pub(crate) fn next_of(times: impl Iterator<Item = f64>, t: f64) -> f64 {
    times.filter(|time| *time > t).fold(f64::INFINITY, f64::min)
}
