//! The machine at one pose and one set of rates: limiter, load at the tip, torques.

use mechanics::Scalar;
use model::{EvaluationError, Vector3};
use nalgebra::Matrix3;

use super::kinematics::{Frames, Velocities};
use super::limiter::{Geometry, Intake, Jet, Limited, stage};
use super::linkage::Stroke;
use super::machine::{CYLINDERS, JOINTS};
use super::plant::Boom;
use super::variables::Inputs;
use crate::port::slots;

/// Eigenvalues of M down to this part of the largest count as zero.
const SEMIDEFINITE: f64 = 1e-9;

/// A command that is not finite acts as 0 (stage 0).
pub(super) fn finite<S: Scalar>(command: &[S; JOINTS]) -> [S; JOINTS] {
    command.map(|u| if u.re().is_finite() { u } else { S::lift(0.0) })
}

/// The load of the followers on the tip: `F - M a`.
pub(super) struct TipLoad<S> {
    F: Vector3<S>,
    M: Option<Matrix3<S>>,
}

/// The load on the slot; `None` if nothing hangs there.
pub(super) fn tip_load<S: Scalar>(u: &Inputs<S>) -> Option<TipLoad<S>> {
    slots::<S, 3>(&[&u.TIP]).map(|load| TipLoad { F: load.F, M: load.M })
}

/// The same, refused if M is the inertia of nothing: for what depends on all of M.
pub(super) fn checked_tip_load<S: Scalar>(u: &Inputs<S>) -> Result<Option<TipLoad<S>>, EvaluationError> {
    let load = tip_load(u);
    if let Some(TipLoad { M: Some(M), .. }) = &load {
        let eigenvalues = M.map(S::re).symmetric_eigenvalues();
        let (least, largest) = (eigenvalues.min(), eigenvalues.amax());
        if least < -SEMIDEFINITE * largest {
            return Err(EvaluationError::Input {
                variable: "TIP.M",
                problem: "has a negative eigenvalue",
                value: least,
                allowed: "positive semidefinite",
            });
        }
    }
    Ok(load)
}

impl Boom {
    /// Strokes at the pose; the range of the joints is where linkages close, beyond it they keep their last value.
    pub(super) fn strokes<S: Scalar>(&self, q: &[S; JOINTS]) -> [Stroke<S>; CYLINDERS] {
        std::array::from_fn(|i| self.machine.cylinders[i].stroke(self.machine.within(i + 1, q[i + 1])))
    }

    /// Oil per angle of each joint.
    pub(super) fn intakes<S: Scalar>(&self, slopes: &[S; CYLINDERS]) -> [Intake<S>; JOINTS] {
        std::array::from_fn(|i| {
            if i == 0 {
                let displacement = S::lift(self.machine.slew_displacement);
                return Intake { sense: 1.0, per_angle: [displacement; 2] };
            }
            let (cylinder, slope) = (&self.machine.cylinders[i - 1], slopes[i - 1]);
            let (sense, size) = if slope.re() < 0.0 { (-1.0, -slope) } else { (1.0, slope) };
            Intake { sense, per_angle: [size * cylinder.rod_area(), size * cylinder.piston_area()] }
        })
    }

    /// What the active stages of the limiter need; frames and strokes are computed if they are not given.
    pub(super) fn geometry<S: Scalar>(
        &self,
        q: &[S; JOINTS],
        frames: Option<&Frames<S>>,
        strokes: Option<&[Stroke<S>; CYLINDERS]>,
    ) -> Geometry<S> {
        let levers = self.limits.needs_levers().then(|| {
            let levers = |frames: &Frames<S>| std::array::from_fn(|i| frames.longest_lever(i).0);
            frames.map_or_else(|| levers(&self.chain.frames(q)), levers)
        });
        let intakes = self.limits.needs_slopes().then(|| {
            let slopes = match strokes {
                Some(strokes) => strokes.map(|s| s.slope),
                None => self.strokes(q).map(|s| s.slope),
            };
            self.intakes(&slopes)
        });
        Geometry { levers, intakes }
    }

    /// The same with time derivatives at the rates `q_dot`.
    fn moving_geometry<S: Scalar>(&self, pose: &Pose<S>, velocities: &Velocities<S>) -> Geometry<Jet<S>> {
        let zero = S::lift(0.0);
        let levers = self.limits.needs_levers().then(|| {
            std::array::from_fn(|i| {
                let (value, k) = pose.frames.longest_lever(i);
                let rate = if value.re() > 0.0 { pose.frames.lever_rate(i, k, velocities) } else { zero };
                Jet { value, rate }
            })
        });
        let intakes = self.limits.needs_slopes().then(|| {
            let strokes = self.strokes(&pose.q);
            let value = self.intakes(&strokes.map(|s| s.slope));
            let rate = |i: usize, area: f64| {
                if i == 0 {
                    return zero;
                }
                strokes[i - 1].curvature * pose.rate[i] * (value[i].sense * area)
            };
            std::array::from_fn(|i| {
                let areas = if i == 0 {
                    [0.0; 2]
                } else {
                    let cylinder = &self.machine.cylinders[i - 1];
                    [cylinder.rod_area(), cylinder.piston_area()]
                };
                let per_angle =
                    std::array::from_fn(|d| Jet { value: value[i].per_angle[d], rate: rate(i, areas[d]) });
                Intake { sense: value[i].sense, per_angle }
            })
        });
        Geometry { levers, intakes }
    }

    /// True for joints that stay at an end of their range: the command would leave it, and the lag does not lead back.
    pub(super) fn resting<S: Scalar>(
        &self,
        q: &[S; JOINTS],
        w: Option<&[S; JOINTS]>,
        command: &[S; JOINTS],
    ) -> [bool; JOINTS] {
        let outward = self.blocked(q, &finite(command));
        let Some(w) = w else { return outward };
        std::array::from_fn(|i| outward[i] && w[i].re() * command[i].re() >= 0.0)
    }

    /// True for joints at an end of their range that would leave it at these rates (stage 1).
    pub(super) fn blocked<S: Scalar>(&self, q: &[S; JOINTS], u: &[S; JOINTS]) -> [bool; JOINTS] {
        std::array::from_fn(|i| {
            let (q, u) = (q[i].re(), u[i].re());
            q >= self.machine.max[i] && u > 0.0 || q <= self.machine.min[i] && u < 0.0
        })
    }

    /// Command after stages 0 and 2, which a lag follows.
    pub(super) fn clipped<S: Scalar>(&self, command: &[S; JOINTS]) -> [S; JOINTS] {
        let u = finite(command);
        if !self.limits.active {
            return u;
        }
        std::array::from_fn(|i| {
            let max = self.limits.rate_max[i];
            if u[i].re().abs() <= max { u[i] } else { S::lift(max.copysign(u[i].re())) }
        })
    }

    /// Pose, limited rates and velocities. `w`: rates behind the lag, if there is one; `resting`: joints that stay at an
    /// end of their range.
    pub(super) fn pose<S: Scalar>(
        &self,
        q: &[S; JOINTS],
        w: Option<&[S; JOINTS]>,
        command: &[S; JOINTS],
        resting: [bool; JOINTS],
    ) -> Pose<S> {
        let frames = self.chain.frames(q);
        let strokes = (self.uses.hydraulics || self.limits.needs_slopes()).then(|| self.strokes(q));
        let wanted = w.map_or_else(|| finite(command), |w| *w);
        let geometry = self.geometry(q, Some(&frames), strokes.as_ref());
        let Limited { rate, mut stage } = self.limits.limit(&wanted, resting, &geometry);
        for i in 0..JOINTS {
            if !command[i].re().is_finite() {
                stage[i] |= stage::NOT_FINITE;
            }
        }
        let velocities = frames.velocities(&rate);
        Pose { q: *q, frames, strokes, wanted, resting, rate, stage, velocities }
    }

    /// Second derivatives of the angles (B20a); zero without lag.
    pub(super) fn accelerations<S: Scalar>(
        &self,
        pose: &Pose<S>,
        w_dot: Option<&[S; JOINTS]>,
    ) -> [S; JOINTS] {
        let Some(w_dot) = w_dot else { return [S::lift(0.0); JOINTS] };
        let wanted = std::array::from_fn(|i| Jet { value: pose.wanted[i], rate: w_dot[i] });
        let geometry = self.moving_geometry(pose, &pose.velocities);
        self.limits.limit(&wanted, pose.resting, &geometry).rate.map(|r| r.rate)
    }

    /// Rates of the lag: w' = (clip(u) - w)/tau, 0 where a joint rests at the end of its range.
    pub(super) fn lag<S: Scalar>(
        &self,
        w: &[S; JOINTS],
        command: &[S; JOINTS],
        resting: [bool; JOINTS],
    ) -> [S; JOINTS] {
        let aim = self.clipped(command);
        std::array::from_fn(|i| if resting[i] { S::lift(0.0) } else { (aim[i] - w[i]) / self.time_constant })
    }
}

/// The machine at one pose and one set of rates.
pub(super) struct Pose<S> {
    pub(super) q: [S; JOINTS],
    pub(super) frames: Frames<S>,
    /// With use.hydraulics
    pub(super) strokes: Option<[Stroke<S>; CYLINDERS]>,
    /// Rates before the limiter
    wanted: [S; JOINTS],
    /// Joints that stay at an end of their range
    resting: [bool; JOINTS],
    /// Rates after the limiter
    pub(super) rate: [S; JOINTS],
    pub(super) stage: [u8; JOINTS],
    pub(super) velocities: Velocities<S>,
}

impl<S: Scalar> Pose<S> {
    /// Force on the tip (B21) at the tip's acceleration.
    pub(super) fn tip_force(
        &self,
        load: Option<&TipLoad<S>>,
        q_ddot: impl FnOnce() -> [S; JOINTS],
    ) -> Vector3<S> {
        match load {
            None => Vector3::zeros(),
            Some(TipLoad { F, M: None }) => *F,
            Some(TipLoad { F, M: Some(M) }) => {
                let a = self.frames.accelerations(&self.velocities, &self.rate, &q_ddot());
                F - M * a[JOINTS]
            }
        }
    }

    /// Torques -J_i F that a force at the tip asks for (B21).
    pub(super) fn load_torques(&self, F: &Vector3<S>) -> [S; JOINTS] {
        let tip = &self.frames.o[JOINTS];
        std::array::from_fn(|i| -self.frames.column(i, tip).dot(F))
    }
}
