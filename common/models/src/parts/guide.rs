#![doc = include_str!("guide.md")]

use mechanics::Scalar;
use model::{
    Dense, Documentation, Enumeration, EvaluationError, Experiment, Model, NoVariables, ParameterError,
    System, Variables, Vector3, Visitor,
};
use serde::{Deserialize, Serialize};

use crate::min_jerk::{MinJerk, Moved, next_of};
use crate::port::{ScalarSlot, Slot, slots};

/// How a coordinate moves
#[derive(Debug, Clone, Copy, PartialEq, Eq, Enumeration)]
pub enum GuideKind {
    /// From rest to rest with minimum jerk
    MinJerk = 1,
    /// Sine about the start position
    Sine = 2,
    /// It rests at the start position
    Rest = 3,
}

/// Parameters of a guide: axes x, y, z of P, and s of H.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(parameter)]
pub struct Parameters {
    /// Motion of P along x
    #[var(name = "kind.x", item = GuideKind::Rest)]
    pub kind_x: GuideKind,
    /// Motion of P along y
    #[var(name = "kind.y", item = GuideKind::Rest)]
    pub kind_y: GuideKind,
    /// Motion of P along z
    #[var(name = "kind.z", item = GuideKind::MinJerk)]
    pub kind_z: GuideKind,
    /// Motion of H
    #[var(name = "kind.s", item = GuideKind::MinJerk)]
    pub kind_s: GuideKind,
    /// Position of P before a minimum-jerk motion, centre of a sine [m]
    #[var(name = "start")]
    pub start: Vector3<f64>,
    /// The same for H [m]
    #[var(name = "start.s")]
    pub start_s: f64,
    /// Position of P after a minimum-jerk motion [m]
    #[var(name = "end", start = [0.0, 0.0, 0.1])]
    pub end: Vector3<f64>,
    /// The same for H [m]
    #[var(name = "end.s", start = 0.1)]
    pub end_s: f64,
    /// Time at which a minimum-jerk motion of P begins [s]
    #[var(name = "t0")]
    pub t0: Vector3<f64>,
    /// The same for H [s]
    #[var(name = "t0.s")]
    pub t0_s: f64,
    /// Duration of a minimum-jerk motion of P [s]
    #[var(name = "duration", start = [1.0, 1.0, 1.0], above = 0.0)]
    pub duration: Vector3<f64>,
    /// The same for H [s]
    #[var(name = "duration.s", start = 1.0, above = 0.0)]
    pub duration_s: f64,
    /// Amplitude of a sine of P [m]
    #[var(name = "amplitude", start = [0.01, 0.01, 0.01])]
    pub amplitude: Vector3<f64>,
    /// The same for H [m]
    #[var(name = "amplitude.s", start = 0.01)]
    pub amplitude_s: f64,
    /// Angular frequency of a sine of P [rad/s]
    #[var(name = "omega", start = [10.0, 10.0, 10.0])]
    pub omega: Vector3<f64>,
    /// The same for H [rad/s]
    #[var(name = "omega.s", start = 10.0)]
    pub omega_s: f64,
    /// Phase of a sine of P [rad]
    #[var(name = "phase")]
    pub phase: Vector3<f64>,
    /// The same for H [rad]
    #[var(name = "phase.s")]
    pub phase_s: f64,
    /// Energy integral
    #[var(name = "use.energy", start = true)]
    pub use_energy: bool,
}

/// Inputs of a guide.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(input)]
pub struct Inputs<S> {
    #[var(prefix = "P.")]
    #[allow(missing_docs, reason = "leader port P, first slot")]
    pub P: Slot<S>,
    #[var(prefix = "P.slot[2].")]
    #[allow(missing_docs, reason = "leader port P, second slot")]
    pub P_2: Slot<S>,
    #[var(prefix = "H.")]
    #[allow(missing_docs, reason = "leader port H")]
    pub H: ScalarSlot<S>,
}

/// Prescribed positions and velocities.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Motion<S> {
    /// Position of P [m]
    #[var(name = "P.r")]
    pub P_r: Vector3<S>,
    /// Velocity of P [m/s]
    #[var(name = "P.v")]
    pub P_v: Vector3<S>,
    /// Position of H [m]
    #[var(name = "H.s")]
    pub H_s: S,
    /// Velocity of H [m/s]
    #[var(name = "H.v")]
    pub H_v: S,
}

const LOAD: [&[&str]; 3] = [
    &[
        "P.F.x",
        "P.M.xx",
        "P.M.xy",
        "P.M.xz",
        "P.slot[2].F.x",
        "P.slot[2].M.xx",
        "P.slot[2].M.xy",
        "P.slot[2].M.xz",
    ],
    &[
        "P.F.y",
        "P.M.xy",
        "P.M.yy",
        "P.M.yz",
        "P.slot[2].F.y",
        "P.slot[2].M.xy",
        "P.slot[2].M.yy",
        "P.slot[2].M.yz",
    ],
    &[
        "P.F.z",
        "P.M.xz",
        "P.M.yz",
        "P.M.zz",
        "P.slot[2].F.z",
        "P.slot[2].M.xz",
        "P.slot[2].M.yz",
        "P.slot[2].M.zz",
    ],
];
const LOAD_X: &[&str] = LOAD[0];
const LOAD_Y: &[&str] = LOAD[1];
const LOAD_Z: &[&str] = LOAD[2];
const WORK: &[&str] = &["P.F", "P.M", "P.slot[2]", "H.F", "H.M"];

/// Prescribed accelerations and the loads received.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Dynamics<S> {
    /// Acceleration of P [m/s2]
    #[var(name = "P.a")]
    pub P_a: Vector3<S>,
    /// Acceleration of H [m/s2]
    #[var(name = "H.a")]
    pub H_a: S,
    /// Force of the followers on P [N]
    #[var(name = "P.load", nominal = 1e1, depends = [LOAD_X, LOAD_Y, LOAD_Z])]
    pub P_load: Vector3<S>,
    /// Force of the follower on H [N]
    #[var(name = "H.load", nominal = 1e1, depends = ["H.F", "H.M"])]
    pub H_load: S,
}

/// Work of the drive.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Energy<S> {
    /// Work of the guide on its followers since the start [J]
    #[var(name = "energy.supplied", state, rate_depends = WORK)]
    pub supplied: S,
    /// Work through the ports on the guide since the start: what is supplied leaves there [J]
    #[var(name = "energy.port", depends = ["energy.supplied"])]
    pub port: S,
}

/// The law of one coordinate.
#[derive(Debug, Clone, Copy)]
struct Law {
    kind: GuideKind,
    start: f64,
    end: f64,
    t0: f64,
    duration: f64,
    amplitude: f64,
    omega: f64,
    phase: f64,
}

impl Law {
    fn at<S: Scalar>(&self, t: S) -> Moved<S> {
        let zero = S::lift(0.0);
        match self.kind {
            GuideKind::Rest => Moved { r: S::lift(self.start), v: zero, a: zero },
            GuideKind::Sine => {
                let (sin, cos) = (t * self.omega + self.phase).sin_cos();
                let (v, a) = (self.amplitude * self.omega, self.amplitude * self.omega * self.omega);
                Moved { r: sin * self.amplitude + self.start, v: cos * v, a: -(sin * a) }
            }
            GuideKind::MinJerk => self.min_jerk().at(t),
        }
    }

    fn min_jerk(&self) -> MinJerk {
        let Self { start, end, t0, duration, .. } = *self;
        MinJerk { start, end, t0, duration }
    }

    /// Times at which the jerk jumps.
    fn kinks(&self) -> [f64; 2] {
        match self.kind {
            GuideKind::MinJerk => self.min_jerk().kinks(),
            GuideKind::Sine | GuideKind::Rest => [f64::INFINITY; 2],
        }
    }
}

/// A leader that moves as prescribed.
#[derive(Debug, Clone)]
pub struct Guide {
    P: [Law; 3],
    H: Law,
    energy: bool,
}

/// Motion of both ports and the loads on them.
struct Led<S> {
    P: Moved<Vector3<S>>,
    H: Moved<S>,
    P_load: Vector3<S>,
    H_load: S,
}

impl Guide {
    fn move_P<S: Scalar>(&self, t: S) -> Moved<Vector3<S>> {
        let [x, y, z] = self.P.map(|law| law.at(t));
        Moved {
            r: Vector3::new(x.r, y.r, z.r),
            v: Vector3::new(x.v, y.v, z.v),
            a: Vector3::new(x.a, y.a, z.a),
        }
    }

    fn led<S: Scalar>(&self, t: S, u: &Inputs<S>) -> Led<S> {
        let (P, H) = (self.move_P(t), self.H.at(t));
        let P_load = match slots::<S, 3>(&[&u.P, &u.P_2]) {
            Some(load) => load.M.map_or(load.F, |M| load.F - M * P.a),
            None => Vector3::zeros(),
        };
        let H_load = u.H.F - u.H.M * H.a;
        Led { P, H, P_load, H_load }
    }

    /// The first kink after `t`.
    fn next_kink(&self, t: f64) -> f64 {
        let laws = self.P.iter().chain(std::iter::once(&self.H));
        next_of(laws.flat_map(Law::kinks), t)
    }
}

/// Time of the next kink; infinite: none.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct NextKink(f64);

impl Default for NextKink {
    fn default() -> Self {
        Self(f64::INFINITY)
    }
}

impl Model for Guide {
    const NAME: &'static str = "guide";
    const DESCRIPTION: &'static str =
        "Leader with prescribed motion: minimum jerk, sine or rest, in space at P and in one coordinate at H";
    const EXPERIMENT: Experiment = Experiment { stop: 2.0, step: 0.01 };
    const DOCUMENTATION: Documentation = model::documentation!(
        "guide",
        plots = [("Position", ["P.r.z", "H.s"]), ("Acceleration", ["P.a.z", "H.a"])]
    );
    type Parameters = Parameters;
    type Inputs<S: Scalar> = Inputs<S>;
    type Motion<S: Scalar> = Motion<S>;
    type Inertia<S: Scalar> = NoVariables;
    type Dynamics<S: Scalar> = Dynamics<S>;
    type Energy<S: Scalar> = Energy<S>;
    type Discrete = NextKink;

    fn new(p: &Parameters, _start: &Motion<f64>) -> Result<Self, ParameterError> {
        let kinds = [p.kind_x, p.kind_y, p.kind_z];
        let P = std::array::from_fn(|i| Law {
            kind: kinds[i],
            start: p.start[i],
            end: p.end[i],
            t0: p.t0[i],
            duration: p.duration[i],
            amplitude: p.amplitude[i],
            omega: p.omega[i],
            phase: p.phase[i],
        });
        let H = Law {
            kind: p.kind_s,
            start: p.start_s,
            end: p.end_s,
            t0: p.t0_s,
            duration: p.duration_s,
            amplitude: p.amplitude_s,
            omega: p.omega_s,
            phase: p.phase_s,
        };
        Ok(Self { P, H, energy: p.use_energy })
    }

    fn retune(&mut self, _p: &Parameters) {}

    fn with_system<V: Visitor<Self>>(&self, visitor: V) -> V::Output {
        visitor.visit::<1, 0, _>(self)
    }
}

impl System<1, 0> for Guide {
    type Model = Self;
    type Spectrum = Dense;

    fn start(&self, t: f64, _given: &Motion<f64>) -> Result<([f64; 1], NextKink), ParameterError> {
        Ok(([0.0], NextKink(self.next_kink(t))))
    }

    #[inline]
    fn rates<S: Scalar>(
        &self,
        t: S,
        _x: &[S; 1],
        u: &Inputs<S>,
        _d: &NextKink,
    ) -> Result<[S; 1], EvaluationError> {
        if !self.energy {
            return Ok([S::lift(0.0)]);
        }
        let Led { P, H, P_load, H_load } = self.led(t, u);
        Ok([-P_load.dot(&P.v) - H_load * H.v])
    }

    fn motion<S: Scalar>(
        &self,
        t: S,
        _x: &[S; 1],
        _u: &Inputs<S>,
        _d: &NextKink,
    ) -> Result<Motion<S>, EvaluationError> {
        let (P, H) = (self.move_P(t), self.H.at(t));
        Ok(Motion { P_r: P.r, P_v: P.v, H_s: H.r, H_v: H.v })
    }

    fn inertia<S: Scalar>(
        &self,
        _t: S,
        _x: &[S; 1],
        _u: &Inputs<S>,
        _d: &NextKink,
    ) -> Result<NoVariables, EvaluationError> {
        Ok(NoVariables)
    }

    fn dynamics<S: Scalar>(
        &self,
        t: S,
        _x: &[S; 1],
        u: &Inputs<S>,
        _d: &NextKink,
    ) -> Result<Dynamics<S>, EvaluationError> {
        let Led { P, H, P_load, H_load } = self.led(t, u);
        Ok(Dynamics { P_a: P.a, H_a: H.a, P_load, H_load })
    }

    fn energy<S: Scalar>(
        &self,
        _t: S,
        x: &[S; 1],
        _u: &Inputs<S>,
        _d: &NextKink,
    ) -> Result<Energy<S>, EvaluationError> {
        let [supplied] = *x;
        Ok(Energy { supplied, port: -supplied })
    }

    fn state_names(&self) -> [String; 1] {
        ["energy.supplied".into()]
    }

    fn next_event(&self, d: &NextKink) -> Option<f64> {
        d.0.is_finite().then_some(d.0)
    }

    fn update(&self, t: f64, _x: &mut [f64; 1], _u: &Inputs<f64>, _d: &NextKink) -> NextKink {
        NextKink(self.next_kink(t))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_dual::Dual64;

    fn law(kind: GuideKind) -> Law {
        Law { kind, start: 0.2, end: -0.3, t0: 0.5, duration: 2.0, amplitude: 0.4, omega: 3.0, phase: 0.7 }
    }

    /// Velocity and acceleration are the derivatives of what stands before them.
    #[test]
    fn motion_is_consistent() {
        for kind in [GuideKind::MinJerk, GuideKind::Sine, GuideKind::Rest] {
            for t in [0.0, 0.6, 1.5, 2.2, 3.0] {
                let m = law(kind).at(Dual64::new(t, 1.0));
                assert!(
                    (m.r.eps - m.v.re).abs() < 1e-14 && (m.v.eps - m.a.re).abs() < 1e-14,
                    "{kind:?} at {t}"
                );
            }
        }
    }

    /// Half the way at half the time with 15/8 of the mean speed, rest at both ends (Flash & Hogan).
    #[test]
    fn minimum_jerk_goes_from_rest_to_rest() {
        let law = law(GuideKind::MinJerk);
        let middle = law.at(1.5);
        assert!((middle.r + 0.05).abs() < 1e-15 && (middle.v + 15.0 / 8.0 * 0.25).abs() < 1e-15);
        for (t, r) in [(0.5, 0.2), (2.5, -0.3)] {
            for side in [-1e-9, 1e-9] {
                let at = law.at(t + side);
                assert!((at.r - r).abs() < 1e-15 && at.v.abs() < 1e-14 && at.a.abs() < 1e-7);
            }
        }
    }
}
