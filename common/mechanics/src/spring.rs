//! Spring-damper between two points: strut, tie rod.
//!
//! ```text
//! l = |T - S|,  e = (T - S)/l,  l' = e.(v_T - v_S)                      (15)
//! F_s = k (l - l0) + c l' - F_pre      tension positive                 (16)
//! force on the body at S: F_s e, on the other side at T: -F_s e
//! ```

use crate::{Scalar, Vector};

/// A linear spring-damper; `c` may be left out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpringDamper {
    /// Stiffness k [N/m], >= 0
    pub k: f64,
    /// Damping c [N.s/m], >= 0; `None`: no damper code is executed
    pub c: Option<f64>,
    /// Free length [m], > 0
    pub l0: f64,
    /// Preload, > 0 pushes the ends apart [N]
    pub F_pre: f64,
}

/// State of a spring-damper between S and T.
#[derive(Debug, Clone, Copy)]
pub struct SpringState<S, const D: usize> {
    /// Length [m]
    pub l: S,
    /// Rate of length [m/s]
    pub l_dot: S,
    /// Unit vector from S to T
    pub e: Vector<S, D>,
    /// Tension [N]
    pub F_s: S,
}

impl SpringDamper {
    /// Shortest usable length [m]: below it the direction is lost.
    pub const SHORTEST: f64 = 1e-9;

    /// Length, rate and tension (15), (16); `v_ST` and `r_ST` are T relative to S.
    ///
    /// `None` where the length is at most [`Self::SHORTEST`].
    #[inline]
    pub fn state<S: Scalar, const D: usize>(
        &self,
        r_ST: &Vector<S, D>,
        v_ST: &Vector<S, D>,
    ) -> Option<SpringState<S, D>> {
        let l = r_ST.dot(r_ST).sqrt();
        if l.re() <= Self::SHORTEST {
            return None;
        }
        let e = r_ST / l;
        let l_dot = e.dot(v_ST); // (15)
        let mut F_s = (l - self.l0) * self.k - self.F_pre; // (16)
        if let Some(c) = self.c {
            F_s += l_dot * c;
        }
        Some(SpringState { l, l_dot, e, F_s })
    }

    /// Energy stored at length `l` [J], zero at the free length.
    #[inline]
    pub fn energy<S: Scalar>(&self, l: S) -> S {
        let s = l - self.l0;
        s * s * (0.5 * self.k) - s * self.F_pre
    }

    /// Power turned into heat [W], never negative.
    #[inline]
    pub fn dissipation<S: Scalar>(&self, l_dot: S) -> S {
        self.c.map_or(S::lift(0.0), |c| l_dot * l_dot * c)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    /// A stretched spring pulls the body towards T: the sign convention of (16) in one place.
    #[test]
    fn tension_pulls_towards_the_other_end() {
        let spring = SpringDamper { k: 100.0, c: Some(2.0), l0: 1.0, F_pre: 0.0 };
        let at_rest = spring.state(&Vector3::new(0.0, 0.0, 1.5), &Vector3::zeros());
        let s = at_rest.expect("the spring has a length");
        assert!((s.F_s - 50.0).abs() < 1e-13);
        assert!((s.e * s.F_s).z > 0.0);
    }

    /// A preload pushes apart: at the free length the tension is -F_pre.
    #[test]
    fn preload_pushes_apart() {
        let spring = SpringDamper { k: 100.0, c: None, l0: 1.0, F_pre: 7.0 };
        let s = spring.state(&Vector3::new(1.0, 0.0, 0.0), &Vector3::zeros());
        assert!((s.expect("length 1").F_s + 7.0).abs() < 1e-13);
    }

    /// The force is the slope of the energy: central difference at 1e-6 m, error about 1e-9 k.
    #[test]
    fn force_is_the_slope_of_the_energy() {
        let spring = SpringDamper { k: 2.0e4, c: None, l0: 0.36, F_pre: 500.0 };
        let (l, d) = (0.31, 1e-6);
        let slope = (spring.energy(l + d) - spring.energy(l - d)) / (2.0 * d);
        let s = spring.state(&Vector3::new(l, 0.0, 0.0), &Vector3::zeros()).expect("length");
        assert!((slope - s.F_s).abs() < 1e-5);
    }

    /// The direction is lost at zero length; no number is made up.
    #[test]
    fn vanishing_length_has_no_state() {
        let spring = SpringDamper { k: 1.0, c: None, l0: 1.0, F_pre: 0.0 };
        assert!(spring.state(&Vector3::new(1e-10, 0.0, 0.0), &Vector3::zeros()).is_none());
    }
}
