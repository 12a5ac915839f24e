#![doc = include_str!("effi_plant.md")]

use std::f64::consts::TAU;

use mechanics::Scalar;
use model::{
    Dense, Documentation, EvaluationError, Experiment, Model, NoVariables, ParameterError, System, Vector2,
    Visitor,
};
use serde::{Deserialize, Serialize};

use super::device::{Leg, Matrix2, determinant};
use super::friction::Rubbing;
use super::plant_variables::{Dynamics, Energy, Inputs, Motion, Parameters};
use super::stop::Stop;
use crate::port::planar_slots;

/// Smallest determinant of the inertia at H, with the slots' inertia [kg2]
const SMALLEST_INERTIA: f64 = f64::MIN_POSITIVE;

/// The planar haptic interface.
#[derive(Debug, Clone)]
pub struct Plant {
    p: Parameters,
    /// Mass that moves along with a rod: itself and the reflected rotor [kg]
    m_l: f64,
    /// Time constant of the current loop [s]
    tau: f64,
    stop: Stop,
}

/// Whether the pose counts as singular.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Singular(bool);

/// The device at a moment, without what accelerates it.
struct Pose<S> {
    r: Vector2<S>,
    v: Vector2<S>,
    /// Forces of the drives [N]
    f: [S; 2],
    /// Deflections of the bristles [m]
    z: [S; 2],
    legs: [Leg<S>; 2],
    /// Rates of the lengths [m/s] and angular velocities of the legs [rad/s]
    l_dot: [S; 2],
    theta_dot: [S; 2],
    rubbing: [Rubbing<S>; 2],
}

/// What accelerates the handle.
struct Moved<S> {
    a: Vector2<S>,
    /// True load of the followers [N]
    load: Vector2<S>,
}

impl Plant {
    #[inline]
    fn pose<S: Scalar>(&self, x: &[S; 11]) -> Result<Pose<S>, EvaluationError> {
        let [x_H, z_H, v_x, v_z, f_1, f_2, z_1, z_2, ..] = *x;
        let (r, v, z) = (Vector2::new(x_H, z_H), Vector2::new(v_x, v_z), [z_1, z_2]);
        let legs = self.p.device.legs(&r)?;
        let rates = legs.map(|leg| leg.rates(&v));
        let [l_dot, theta_dot] = [rates.map(|(l_dot, _)| l_dot), rates.map(|(_, theta_dot)| theta_dot)];
        let rubbing = [0, 1].map(|i| self.p.friction.at(l_dot[i], z[i]));
        Ok(Pose { r, v, f: [f_1, f_2], z, legs, l_dot, theta_dot, rubbing })
    }

    /// I(l) of a leg about its pivot [kg.m2] and its derivative [kg.m]
    fn leg_inertia<S: Scalar>(&self, l: S) -> (S, S) {
        let arm = l - self.p.device.rod_com;
        let m = self.p.device.m_rod;
        (arm * arm * m + self.p.drive.I_housing + self.p.drive.I_rod, arm * (2.0 * m))
    }

    /// M (4)
    fn inertia_at<S: Scalar>(&self, legs: &[Leg<S>; 2]) -> Matrix2<S> {
        legs.iter().fold(Matrix2::identity() * S::lift(self.p.device.m_H), |M, Leg { l, u, t }| {
            let (I, _) = self.leg_inertia(*l);
            M + u * u.transpose() * S::lift(self.m_l) + t * t.transpose() * (I / (*l * *l))
        })
    }

    /// h (5)
    fn bias<S: Scalar>(&self, pose: &Pose<S>) -> Vector2<S> {
        let weight =
            if self.p.use_gravity { self.p.device.weight(&pose.legs) } else { Vector2::<S>::zeros() };
        (0..2).fold(weight, |h, i| {
            let (Leg { l, u, t }, l_dot, th) = (pose.legs[i], pose.l_dot[i], pose.theta_dot[i]);
            let (I, I_prime) = self.leg_inertia(l);
            let along = (l * self.m_l - I_prime * 0.5) * th * th;
            let across = (I_prime - I / l * 2.0) * l_dot * th / l;
            h + u * along + t * across
        })
    }

    /// Force that the drive aims at (7) [N]
    fn saturated<S: Scalar>(&self, u: S, v: S) -> S {
        let d = &self.p.drive;
        let mut limit = S::lift(self.p.device.F_peak);
        if (u * v).re() > 0.0 {
            let share = (-v.abs() + d.v_max) / (d.v_max - d.v_knee);
            limit *= share.clamp(S::lift(0.0), S::lift(1.0));
        }
        u.clamp(-limit, limit)
    }

    /// Force of an end stop along the axis (9) [N]
    fn stop_force<S: Scalar>(&self, pose: &Pose<S>, axis: usize) -> S {
        if self.p.use_stop { self.stop.force(pose.legs[axis].l, pose.l_dot[axis]) } else { S::lift(0.0) }
    }

    /// Acceleration and load (6)
    #[inline]
    fn moved<S: Scalar>(&self, pose: &Pose<S>, u: &Inputs<S>) -> Result<Moved<S>, EvaluationError> {
        let (F, M_H) = planar_slots(&u.H, &u.H_2);
        let M = self.inertia_at(&pose.legs) + M_H;
        let mut Q = F - self.bias(pose);
        for i in 0..2 {
            Q += pose.legs[i].u * (pose.f[i] - pose.rubbing[i].F + self.stop_force(pose, i));
        }
        let det = M.m11 * M.m22 - M.m12 * M.m21;
        if det.re() < SMALLEST_INERTIA {
            let quantity = "determinant of the inertia at H with the slots' inertia";
            return Err(EvaluationError::Vanishes { quantity, value: det.re(), limit: SMALLEST_INERTIA });
        }
        let a = Vector2::new(M.m22 * Q.x - M.m12 * Q.y, M.m11 * Q.y - M.m21 * Q.x) / det;
        Ok(Moved { a, load: F - M_H * a })
    }

    /// Heat [W]
    fn heat<S: Scalar>(&self, pose: &Pose<S>) -> S {
        let mut heat = S::lift(0.0);
        for i in 0..2 {
            let (l_dot, Rubbing { F, z_dot }) = (pose.l_dot[i], pose.rubbing[i]);
            heat += F * l_dot - pose.z[i] * z_dot * self.p.friction.s0;
            if self.p.use_stop {
                heat += self.stop.heat(pose.legs[i].l, l_dot);
            }
        }
        heat
    }

    fn is_singular(&self, x: &[f64; 11]) -> bool {
        self.p.device.legs(&Vector2::new(x[0], x[1])).is_ok_and(|legs| self.margin(&legs) < 0.0)
    }

    fn margin(&self, legs: &[Leg<f64>; 2]) -> f64 {
        determinant(legs).abs() - self.p.tolerance
    }

    fn measured<S: Scalar>(&self, l: S) -> S {
        let resolution = self.p.resolution;
        if !self.p.use_encoder || resolution.vanishes() {
            return l;
        }
        S::lift((l.re() / resolution + 0.5).floor() * resolution) // (10)
    }
}

impl Model for Plant {
    const NAME: &'static str = "effi_plant";
    const DESCRIPTION: &'static str = "Planar haptic interface: two screw-driven cylinders carry a handle, with motors, friction, end stops and encoders";
    const EXPERIMENT: Experiment = Experiment { stop: 1.0, step: 0.001 };
    const DOCUMENTATION: Documentation = model::documentation!(
        "effi_plant",
        plots = [
            ("Height of the handle", ["H.r.z"]),
            ("Friction of an axis", ["axis[1].friction"]),
            ("Energies", ["energy.kinetic", "energy.potential", "energy.dissipated"])
        ]
    );
    const INDICATORS: &'static [&'static str] = &["singularity.margin"];
    const METHODS: &'static [i64] = &[2, 3, 5];
    const METHOD: i64 = 2;
    const STEP: f64 = 5e-5;
    const TOLERANCES: [f64; 2] = [1e-7, 1e-10];
    type Parameters = Parameters;
    type Inputs<S: Scalar> = Inputs<S>;
    type Motion<S: Scalar> = Motion<S>;
    type Inertia<S: Scalar> = NoVariables;
    type Dynamics<S: Scalar> = Dynamics<S>;
    type Energy<S: Scalar> = Energy<S>;
    type Discrete = Singular;

    fn new(p: &Parameters, _start: &Motion<f64>) -> Result<Self, ParameterError> {
        p.device.checked()?;
        p.friction.checked()?;
        let d = &p.drive;
        if d.v_max <= d.v_knee {
            let reason = "the driving force has to fall between axis.v_knee and axis.v_max";
            return Err(ParameterError::refused(
                "axis.v_max",
                d.v_max,
                reason,
                format!("> {} m/s", d.v_knee),
            ));
        }
        if p.stroke.max <= p.stroke.min {
            let allowed = format!("> {} m", p.stroke.min);
            return Err(ParameterError::refused("stroke.max", p.stroke.max, "no stroke is left", allowed));
        }
        Ok(Self {
            p: *p,
            m_l: p.device.m_rod + d.J_rotor * (TAU / d.lead).powi(2),
            tau: 1.0 / (TAU * d.bandwidth),
            stop: Stop { lo: p.stroke.min, hi: p.stroke.max, k: p.stroke.k, chi: p.stroke.chi },
        })
    }

    fn retune(&mut self, _p: &Parameters) {}

    fn with_system<V: Visitor<Self>>(&self, visitor: V) -> V::Output {
        visitor.visit::<11, 1, _>(self)
    }
}

impl System<11, 1> for Plant {
    type Model = Self;
    type Spectrum = Dense;

    fn start(&self, _t: f64, _given: &Motion<f64>) -> Result<([f64; 11], Singular), ParameterError> {
        let Parameters { device, start: H, start_v: v, stroke, .. } = &self.p;
        let legs = device.start(H, self.p.use_stop.then_some([stroke.min, stroke.max]))?;
        let f = if self.p.balanced && self.p.use_gravity { device.balance(&legs)? } else { Vector2::zeros() };
        let x = [H.x, H.y, v.x, v.y, f.x, f.y, 0.0, 0.0, 0.0, 0.0, 0.0];
        Ok((x, Singular(self.is_singular(&x))))
    }

    #[inline]
    fn rates<S: Scalar>(
        &self,
        _t: S,
        x: &[S; 11],
        u: &Inputs<S>,
        _d: &Singular,
    ) -> Result<[S; 11], EvaluationError> {
        let pose = self.pose(x)?;
        let Moved { a, load } = self.moved(&pose, u)?;
        let Pose { v, f, l_dot, rubbing, .. } = &pose;
        let drive = |u: S, i: usize| (self.saturated(u, l_dot[i]) - f[i]) / self.tau; // (7)
        let zero = S::lift(0.0);
        let [heat, supplied, port] = if self.p.use_energy {
            let port = load.dot(v);
            [self.heat(&pose), port + f[0] * l_dot[0] + f[1] * l_dot[1], port]
        } else {
            [zero; 3]
        };
        let [z_1, z_2] = rubbing.map(|r| r.z_dot);
        Ok([v.x, v.y, a.x, a.y, drive(u.u_1, 0), drive(u.u_2, 1), z_1, z_2, heat, supplied, port])
    }

    fn motion<S: Scalar>(
        &self,
        _t: S,
        x: &[S; 11],
        _u: &Inputs<S>,
        d: &Singular,
    ) -> Result<Motion<S>, EvaluationError> {
        let Pose { r, v, f, z, legs, l_dot, rubbing, .. } = self.pose(x)?;
        Ok(Motion {
            r,
            v,
            l_1: self.measured(legs[0].l),
            l_2: self.measured(legs[1].l),
            v_1: l_dot[0],
            v_2: l_dot[1],
            f_1: f[0],
            f_2: f[1],
            z_1: z[0],
            z_2: z[1],
            F_fr_1: rubbing[0].F,
            F_fr_2: rubbing[1].F,
            determinant: determinant(&legs),
            singular: S::lift(f64::from(u8::from(d.0))),
        })
    }

    fn inertia<S: Scalar>(
        &self,
        _t: S,
        _x: &[S; 11],
        _u: &Inputs<S>,
        _d: &Singular,
    ) -> Result<NoVariables, EvaluationError> {
        Ok(NoVariables)
    }

    fn dynamics<S: Scalar>(
        &self,
        _t: S,
        x: &[S; 11],
        u: &Inputs<S>,
        _d: &Singular,
    ) -> Result<Dynamics<S>, EvaluationError> {
        let Moved { a, load } = self.moved(&self.pose(x)?, u)?;
        Ok(Dynamics { a, sensor_F: load })
    }

    fn energy<S: Scalar>(
        &self,
        _t: S,
        x: &[S; 11],
        _u: &Inputs<S>,
        _d: &Singular,
    ) -> Result<Energy<S>, EvaluationError> {
        let pose = self.pose(x)?;
        let [.., dissipated, supplied, port] = *x;
        let kinetic = pose.v.dot(&(self.inertia_at(&pose.legs) * pose.v)) * 0.5;
        let mut potential =
            if self.p.use_gravity { self.p.device.potential(&pose.r, &pose.legs) } else { S::lift(0.0) };
        for i in 0..2 {
            potential += pose.z[i] * pose.z[i] * (0.5 * self.p.friction.s0);
            if self.p.use_stop {
                potential += self.stop.energy(pose.legs[i].l);
            }
        }
        Ok(Energy { kinetic, potential, dissipated, supplied, port })
    }

    fn state_names(&self) -> [String; 11] {
        [
            "H.r.x",
            "H.r.z",
            "H.v.x",
            "H.v.z",
            "axis[1].force",
            "axis[2].force",
            "axis[1].bristle",
            "axis[2].bristle",
            "energy.dissipated",
            "energy.supplied",
            "energy.port",
        ]
        .map(String::from)
    }

    fn nominals(&self) -> [f64; 11] {
        const NONE: f64 = f64::INFINITY;
        [1.0, 1.0, 0.1, 0.1, 1e2, 1e2, 1e-5, 1e-5, NONE, NONE, NONE]
    }

    fn indicators(&self, _t: f64, x: &[f64; 11], _u: &Inputs<f64>, _d: &Singular) -> [f64; 1] {
        let legs = self.p.device.legs(&Vector2::new(x[0], x[1]));
        [legs.map_or(-self.p.tolerance, |legs| self.margin(&legs))]
    }

    fn update(&self, _t: f64, x: &mut [f64; 11], _u: &Inputs<f64>, _d: &Singular) -> Singular {
        Singular(self.is_singular(x))
    }
}
