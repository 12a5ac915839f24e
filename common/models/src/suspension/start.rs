//! Consistent start and drift: assembly from a given lower angle (section 7), projection (20).

use mechanics::{Dim, Matrix, Scalar, Space, Vector, close};
use model::{EvaluationError, ParameterError};

use super::coordinates::{ArmCoordinates, CarrierCoordinates};
use super::variables::Motion;
use super::wishbone::{Closing, KinematicsOf, Loads, OpenLoop, Wishbone};

/// Largest step of the lower angle on the way from the design position [rad]
const CONTINUATION_STEP: f64 = 0.05;
/// A loop is closed when its gap is below this [m]
const CLOSED: f64 = 1e-13;
/// A gap that counts as rounding of positions of about 1 m [m]
const ROUNDING: f64 = 1e-15;
/// Preload of the second evaluation, of the size of a wheel load so that nothing cancels [N]
const TRIAL_PRELOAD: f64 = 1e4;
/// Gap that is accepted after assembly [m]
const ASSEMBLED: f64 = 1e-10;

impl<const D: usize, const NA: usize, const NC: usize, A, C> Wishbone<D, NA, NC, A, C>
where
    A: ArmCoordinates<D, NA>,
    C: CarrierCoordinates<D, NC>,
    Dim<D>: Space<D>,
{
    /// States at rest in the design position.
    pub(super) fn design_states(&self, x: &mut [f64]) {
        let (lower, rest) = x.split_at_mut(A::STATES);
        let (carrier, rest) = rest.split_at_mut(C::STATES);
        A::states(self.design_lower.0, self.design_lower.1, lower);
        C::design(carrier);
        A::states(self.design_upper.0, self.design_upper.1, &mut rest[..A::STATES]);
    }

    /// Move the coordinates (`false`) or the rates (`true`) of all elements.
    fn displace(
        &self,
        x: &mut [f64],
        change: &(Vector<f64, NA>, Vector<f64, NC>, Vector<f64, NA>),
        rates: bool,
    ) {
        let (lower, rest) = x.split_at_mut(A::STATES);
        let (carrier, rest) = rest.split_at_mut(C::STATES);
        let upper = &mut rest[..A::STATES];
        if rates {
            self.lower_joint.push(lower, &change.0);
            self.carrier_joint.push(carrier, &change.1);
            self.upper_joint.push(upper, &change.2);
        } else {
            self.lower_joint.shift(lower, &change.0);
            self.carrier_joint.shift(carrier, &change.1);
            self.upper_joint.shift(upper, &change.2);
        }
    }

    /// States with the given angle and rate of the lower link; the loop closed on positions and
    /// velocities with the least change of all other coordinates, on the branch of the design
    /// position.
    pub(super) fn assemble(&self, x: &mut [f64], given: &Motion<f64>) -> Result<(), ParameterError> {
        self.design_states(x);
        let (phi, from) = self.design_lower;
        let way = given.lower_theta - from;
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a small count"
        )]
        let steps = (way.abs() / CONTINUATION_STEP).ceil().clamp(1.0, 1e4) as u32;
        for i in 1..=steps {
            let theta = from + way * f64::from(i) / f64::from(steps);
            A::states(phi, theta, &mut x[..A::STATES]);
            self.close_positions(x).map_err(|gap| ParameterError::Refused {
                variable: "lower.angle.theta",
                value: given.lower_theta,
                reason: format!("the loop cannot close, a gap of {gap:.3e} m remains at {theta:.6} rad"),
                allowed: format!("angles that the upper link can follow from {from:.6} rad"),
            })?;
        }
        x[A::COORDINATES + A::THETA] = given.lower_theta_dot;
        let k = self.kinematics(x)?;
        self.correct_free(x, &k.gap_rate, true)?;
        Ok(())
    }

    /// Newton on the gap with the lower link held; the remaining gap if it does not close.
    fn close_positions(&self, x: &mut [f64]) -> Result<(), f64> {
        let mut gap = f64::INFINITY;
        for _ in 0..30 {
            let k = self.kinematics(x).map_err(|_| gap)?;
            gap = k.gap.norm();
            if gap <= CLOSED {
                return Ok(());
            }
            self.correct_free(x, &k.gap, false).map_err(|_| gap)?;
        }
        if gap <= ASSEMBLED { Ok(()) } else { Err(gap) }
    }

    /// One least-change correction of carrier and upper link against `gap`.
    fn correct_free(&self, x: &mut [f64], gap: &Vector<f64, D>, rates: bool) -> Result<(), EvaluationError> {
        let k = self.kinematics(x)?;
        let G: Matrix<f64, D, D> = k.C.J * k.C.J.transpose() + k.far.J * k.far.J.transpose();
        let F = close(&G, &-gap)?;
        self.displace(
            x,
            &(Vector::zeros(), k.C.J.transpose() * F, -(k.far.J.transpose() * F)),
            rates,
        );
        Ok(())
    }

    /// Bring the states back on the loop and every orientation on its manifold (20).
    ///
    /// Two Newton passes on positions with the mobility of the first one, one exact solve for the rates.
    pub(super) fn project_states(&self, x: &mut [f64]) -> Result<bool, EvaluationError> {
        let mut changed = false;
        if let Closing::Projection = self.closing {
            let mut k = self.kinematics(x)?;
            if k.gap.norm() > ROUNDING {
                let open = self.unloaded(&k)?;
                for _ in 0..2 {
                    self.correct(x, &open, &k.gap, false)?;
                    k = self.kinematics(x)?;
                    if k.gap.norm() <= ROUNDING {
                        break;
                    }
                }
                changed = true;
            }
            if k.gap_rate.norm() > ROUNDING {
                self.correct(x, &self.unloaded(&k)?, &k.gap_rate, true)?;
                changed = true;
            }
        }
        let (_, rest) = x.split_at_mut(A::STATES);
        Ok(self.carrier_joint.normalise(&mut rest[..C::STATES]) | changed)
    }

    /// The two chains without any load.
    fn unloaded(
        &self,
        k: &KinematicsOf<f64, D, NA, NC, A, C>,
    ) -> Result<OpenLoop<f64, D, NA, NC>, EvaluationError> {
        self.open(
            k,
            &Loads {
                port: None,
                internal: None,
                field: None,
            },
            None,
        )
    }

    /// One mass-weighted correction of the gap (`rates`: of the gap rate).
    fn correct(
        &self,
        x: &mut [f64],
        open: &OpenLoop<f64, D, NA, NC>,
        gap: &Vector<f64, D>,
        rates: bool,
    ) -> Result<(), EvaluationError> {
        let F = close(&open.mobility(), &-gap)?;
        self.displace(x, &open.response(&F), rates);
        Ok(())
    }

    /// Preload that makes the design position an equilibrium: affine in the unknown.
    pub(super) fn static_preload(&self, static_load: &Vector<f64, D>) -> Result<f64, EvaluationError> {
        let mut x = [0.0; 32];
        self.design_states(&mut x);
        let loads = Loads {
            port: None,
            internal: Some(*static_load),
            field: self.gravity,
        };
        let acceleration = |F_pre: f64| -> Result<f64, EvaluationError> {
            let mut trial = *self;
            trial.strut.F_pre = F_pre;
            let k = trial.kinematics(&x)?;
            Ok(trial.accelerate(&k, &loads)?.q_lower[A::THETA])
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
