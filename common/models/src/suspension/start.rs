//! Consistent start of the double wishbone (section 7) and its static preload.

use mechanics::{Dim, Scalar, Space, Vector};
use model::{EvaluationError, ParameterError};

use super::checks::refused;
use super::coordinates::Coordinates;
use super::variables::Motion;
use super::wishbone::{CARRIER, LOWER, Loads, UPPER, Wishbone};

/// Largest step of the lower angle on the way from the design position [rad]
const CONTINUATION_STEP: f64 = 0.05;
/// Preload of the second evaluation, of the size of a wheel load so that nothing cancels [N]
const TRIAL_PRELOAD: f64 = 1e4;
/// More states than any structure has
const MANY: usize = 32;

impl<J, const D: usize, const N: usize> Wishbone<J, D, N>
where
    J: Coordinates<D, N>,
    Dim<D>: Space<D>,
{
    /// States at rest in the design position.
    pub(super) fn design_states(&self, x: &mut [f64]) {
        self.assembly.each_mut(x, |i, own| {
            let joint = &self.assembly.members[i].joint;
            match i {
                LOWER => joint.link_states(self.design_lower.0, self.design_lower.1, own),
                CARRIER => joint.carrier_states(own),
                UPPER => joint.link_states(self.design_upper.0, self.design_upper.1, own),
                _ => {}
            }
        });
    }

    /// States with the given angle and rate of the lower link; the loop closed on positions and
    /// velocities (with a bushing too) with the least change of all other coordinates, on the branch of the design
    /// position.
    pub(super) fn assemble(&self, x: &mut [f64], given: &Motion<f64>) -> Result<(), ParameterError> {
        self.design_states(x);
        let joint = self.assembly.members[LOWER].joint;
        let (phi, from) = self.design_lower;
        let way = given.lower_theta - from;
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small count")]
        let steps = (way.abs() / CONTINUATION_STEP).ceil().clamp(1.0, 1e4) as u32;
        let rate = joint.coordinates() + joint.elevation();
        for i in 1..=steps {
            let theta = from + way * f64::from(i) / f64::from(steps);
            joint.link_states(phi, theta, &mut x[self.assembly.range(LOWER)]);
            if i == steps {
                x[rate] = given.lower_theta_dot;
            }
            self.rigid.close_loops(x, |number| self.root(number), LOWER).map_err(|error| {
                refused(
                    "lower.angle.theta",
                    given.lower_theta,
                    format!("the loop cannot close at {theta:.6} rad: {error}"),
                    format!("angles that the upper link can follow from {from:.6} rad"),
                )
            })?;
        }
        Ok(())
    }

    /// Preload that makes the design position an equilibrium: affine in the unknown.
    pub(super) fn static_preload(&self, static_load: &Vector<f64, D>) -> Result<f64, EvaluationError> {
        let mut x = [0.0; MANY];
        let x = &mut x[..self.assembly.states()];
        self.design_states(x);
        let loads = Loads { port: None, internal: Some(*static_load), field: self.gravity };
        let elevation = self.assembly.members[LOWER].joint.elevation();
        let acceleration = |F_pre: f64| -> Result<f64, EvaluationError> {
            let mut trial = *self;
            trial.strut.F_pre = F_pre;
            let k = trial.kinematics(x)?;
            Ok(trial.accelerate(&k, &loads)?.q[LOWER][elevation])
        };
        let at_0 = acceleration(0.0)?;
        let slope = (acceleration(TRIAL_PRELOAD)? - at_0) / TRIAL_PRELOAD;
        if slope.vanishes() {
            return Err(EvaluationError::Vanishes {
                quantity: "effect of the strut preload on the lower link",
                value: slope,
                limit: 0.0,
            });
        }
        Ok(-at_0 / slope)
    }
}
