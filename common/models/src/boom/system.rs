//! The equations of the boom: limited rates of the joints, lag, energy integrals, events at the ends of the ranges.

use mechanics::Scalar;
use model::{Dense, EvaluationError, ParameterError, Spectrum, System, Vector3};

use super::distance::{self, TOUCHING};
use super::kinematics::Frames;
use super::limiter::Limited;
use super::linkage::Stroke;
use super::machine::{BoxShape, CYLINDERS, JOINTS, PlacedBox};
use super::masses::Lump;
use super::plant::{Boom, Rest};
use super::pose::{Pose, TipLoad, finite, tip_load};
use super::stability::Stability;
use super::variables::Inputs;
use super::variables::indexed::{
    Accelerations, Angles, Count, Flows, Forces, GravityTorques, HoldingTorques, LoadTorques, OfArms,
    OfJoints, PointAccelerations, PointVelocities, Positions, Pressures, Slopes, Speeds, Strokes,
    Tangential1, Tangential2, Tangential3, Tangential4, Tangential5, Tangential6, Velocities,
};
use super::variables::outputs::{Dynamics, Energy, Motion, Safety};

/// What a part that is left out reports instead of a distance or a margin.
const OFF: f64 = 1e9;
/// A joint this near to an end of its range is there [rad].
const ARRIVED: f64 = 1e-12;
/// Event indicator per distance from the end of the range: its band of 1e-10 is then [`ARRIVED`] [1/rad].
const SCALE: f64 = 100.0;

/// Longest adaptive step while the limiter may switch [s]: the error estimate of `dopri5` is blind to a kink at 0.42 of
/// the step, where the error is 0.004 h^2 times the jump of the acceleration.
const LONGEST: f64 = 0.05;

/// The boom with `N` states: 6 angles, behind a lag 6 wanted rates, 2 energy integrals.
pub(super) struct Plant<'a, const N: usize>(pub(super) &'a Boom);

/// The states by their meaning.
struct Parts<S> {
    q: [S; JOINTS],
    w: Option<[S; JOINTS]>,
    drives: S,
    port: S,
}

fn parts<S: Scalar, const N: usize>(x: &[S; N]) -> Parts<S> {
    let six = |from: usize| std::array::from_fn(|i| x[from + i]);
    Parts { q: six(0), w: (N > JOINTS + 2).then(|| six(JOINTS)), drives: x[N - 2], port: x[N - 1] }
}

fn flag<S: Scalar>(is: bool) -> S {
    S::lift(f64::from(u8::from(is)))
}

#[allow(clippy::cast_precision_loss, reason = "small numbers")]
fn count<S: Scalar>(n: usize) -> S {
    S::lift(n as f64)
}

impl<const N: usize> Plant<'_, N> {
    /// Where a joint arrives next, and how far it is: the end ahead; behind a lag the nearer end.
    fn ahead(&self, i: usize, q: f64, u: f64) -> (f64, f64) {
        let (min, max) = (self.0.machine.min[i], self.0.machine.max[i]);
        let upper = if N > JOINTS + 2 { max - q < q - min } else { u > 0.0 };
        if upper { (max, max - q) } else { (min, q - min) }
    }

    /// Bring joints that have arrived exactly onto the end of their range; how many these are.
    fn arrive(&self, x: &mut [f64; N], command: &[f64; JOINTS], rest: &mut Rest) -> u64 {
        let u = finite(command);
        let mut arrivals = 0;
        for i in 0..JOINTS {
            let (end, way) = self.ahead(i, x[i], u[i]);
            let lag = N > JOINTS + 2;
            let outward = |rate: f64| if end > self.0.machine.min[i] { rate > 0.0 } else { rate < 0.0 };
            let wanted = if lag { x[JOINTS + i] } else { u[i] };
            rest.resting[i] = way <= ARRIVED && outward(u[i]) && (outward(wanted) || wanted.abs() <= 0.0);
            if way <= ARRIVED && (outward(wanted) || rest.resting[i]) {
                arrivals += u64::from(outward(wanted));
                x[i] = end;
                if lag {
                    x[JOINTS + i] = 0.0;
                }
            }
        }
        arrivals
    }

    /// Pose and rates for the outputs: joints at the ends of their ranges by angle and command alone.
    fn pose<S: Scalar>(&self, x: &[S; N], u: &Inputs<S>) -> Pose<S> {
        let Parts { q, w, .. } = parts(x);
        let resting = self.0.resting(&q, w.as_ref(), &u.command.0);
        self.0.pose(&q, w.as_ref(), &u.command.0, &resting)
    }

    /// Second derivatives of the angles.
    fn accelerations<S: Scalar>(
        &self,
        pose: &Pose<S>,
        w: Option<&[S; JOINTS]>,
        u: &Inputs<S>,
    ) -> [S; JOINTS] {
        let w_dot = w.map(|w| self.0.lag(w, &u.command.0, &self.0.resting(&pose.q, Some(w), &u.command.0)));
        self.0.accelerations(pose, w_dot.as_ref())
    }

    /// Work of drives and port per time [W].
    fn powers<S: Scalar>(
        &self,
        pose: &Pose<S>,
        w: Option<&[S; JOINTS]>,
        load: &TipLoad<S>,
        u: &Inputs<S>,
    ) -> [S; 2] {
        let F = pose.tip_force(load, || self.accelerations(pose, w, u));
        let strokes = pose.strokes.unwrap_or_else(|| self.0.strokes(&pose.q));
        let masses = self.0.masses.distribution(&pose.frames, &strokes);
        let gravity = self.0.masses.gradient(&pose.frames, &masses);
        let carried = pose.load_torques(&F);
        let drives = (0..JOINTS).fold(S::lift(0.0), |sum, i| sum + (gravity[i] + carried[i]) * pose.rate[i]);
        [drives, F.dot(&pose.velocities.v[JOINTS])]
    }
}

impl<const N: usize> System<N, JOINTS> for Plant<'_, N>
where
    Dense: Spectrum<N>,
{
    type Model = Boom;
    type Spectrum = Dense;

    fn start(&self, _t: f64, _given: &Motion<f64>) -> Result<([f64; N], Rest), ParameterError> {
        let mut x = [0.0; N];
        x[..JOINTS].copy_from_slice(&self.0.angle_start);
        Ok((x, Rest::default()))
    }

    fn settle(&self, x: &mut [f64; N], u: &Inputs<f64>, d: &Rest) -> Rest {
        let mut rest = Rest { bad_command: u.command.0.iter().any(|u| !u.is_finite()), ..*d };
        self.arrive(x, &u.command.0, &mut rest);
        rest
    }

    #[inline]
    fn rates<S: Scalar>(
        &self,
        _t: S,
        x: &[S; N],
        u: &Inputs<S>,
        d: &Rest,
    ) -> Result<[S; N], EvaluationError> {
        let Parts { q, w, .. } = parts(x);
        let load = tip_load(u)?;
        let mut rates = [S::lift(0.0); N];
        if self.0.uses.energy {
            let pose = self.0.pose(&q, w.as_ref(), &u.command.0, &d.resting);
            rates[..JOINTS].copy_from_slice(&pose.rate);
            rates[N - 2..].copy_from_slice(&self.powers(&pose, w.as_ref(), &load, u));
        } else {
            let wanted = w.unwrap_or_else(|| finite(&u.command.0));
            let Limited { rate, .. } =
                self.0.limits.limit(&wanted, &d.resting, &self.0.geometry(&q, None, None));
            rates[..JOINTS].copy_from_slice(&rate);
        }
        if let Some(w) = &w {
            rates[JOINTS..2 * JOINTS].copy_from_slice(&self.0.lag(w, &u.command.0, &d.resting));
        }
        Ok(rates)
    }

    fn motion<S: Scalar>(
        &self,
        _t: S,
        x: &[S; N],
        u: &Inputs<S>,
        d: &Rest,
    ) -> Result<Motion<S>, EvaluationError> {
        let pose = self.pose(x, u);
        Ok(self.0.motion(&pose, &u.command.0, d))
    }

    fn inertia<S: Scalar>(
        &self,
        _t: S,
        x: &[S; N],
        u: &Inputs<S>,
        _d: &Rest,
    ) -> Result<Safety<S>, EvaluationError> {
        let load = tip_load(u)?;
        let Parts { q, w, .. } = parts(x);
        let frames = self.0.chain.frames(&q);
        let tip_force = (self.0.include_tip_force && load.is_some()).then(|| {
            let pose = self.pose(x, u);
            pose.tip_force(&load, || self.accelerations(&pose, w.as_ref(), u)).z
        });
        Ok(self.0.safety(&frames, &self.0.strokes(&q), tip_force))
    }

    fn dynamics<S: Scalar>(
        &self,
        _t: S,
        x: &[S; N],
        u: &Inputs<S>,
        _d: &Rest,
    ) -> Result<Dynamics<S>, EvaluationError> {
        let load = tip_load(u)?;
        let pose = self.pose(x, u);
        let q_ddot = self.accelerations(&pose, parts(x).w.as_ref(), u);
        let F = pose.tip_force(&load, || q_ddot);
        Ok(self.0.dynamics(&pose, &q_ddot, &F))
    }

    fn energy<S: Scalar>(
        &self,
        _t: S,
        x: &[S; N],
        u: &Inputs<S>,
        _d: &Rest,
    ) -> Result<Energy<S>, EvaluationError> {
        tip_load(u)?;
        let Parts { q, drives, port, .. } = parts(x);
        let frames = self.0.chain.frames(&q);
        let masses = self.0.masses.distribution(&frames, &self.0.strokes(&q));
        let zero = S::lift(0.0);
        let potential = self.0.masses.potential(&masses);
        Ok(Energy { potential, kinetic: zero, supplied: drives + port, dissipated: zero, port })
    }

    fn longest_step(&self, x: &[f64; N], u: &Inputs<f64>, d: &Rest) -> f64 {
        let command = finite(&u.command.0);
        let still = |i: usize| command[i].abs() <= 0.0 && parts(x).w.is_none_or(|w| w[i].abs() <= 0.0);
        let kinks = self.0.limits.active && (0..JOINTS).any(|i| !d.resting[i] && !still(i));
        if kinks { LONGEST } else { f64::INFINITY }
    }

    fn state_names(&self) -> [String; N] {
        std::array::from_fn(|i| match i {
            i if i < JOINTS => format!("joint[{}].angle", i + 1),
            i if i + 2 == N => "energy.supplied".into(),
            i if i + 1 == N => "energy.port".into(),
            i => format!("joint[{}] behind its lag", i - JOINTS + 1),
        })
    }

    fn nominals(&self) -> [f64; N] {
        std::array::from_fn(|i| if i + 2 >= N { f64::INFINITY } else { 1.0 })
    }

    fn indicators(&self, _t: f64, x: &[f64; N], u: &Inputs<f64>, d: &Rest) -> [f64; JOINTS] {
        let command = finite(&u.command.0);
        std::array::from_fn(|i| {
            let still = N <= JOINTS + 2 && command[i].abs() <= 0.0;
            if d.resting[i] || still { 1.0 } else { SCALE * self.ahead(i, x[i], command[i]).1 }
        })
    }

    fn update(&self, _t: f64, x: &mut [f64; N], u: &Inputs<f64>, d: &Rest) -> Rest {
        let mut rest = *d;
        let before = d.resting;
        let arrivals = self.arrive(x, &u.command.0, &mut rest);
        let stayed = (0..JOINTS).filter(|i| before[*i] && rest.resting[*i]).count() as u64;
        rest.events += if N > JOINTS + 2 { arrivals } else { arrivals - stayed };
        rest
    }
}

impl Boom {
    fn motion<S: Scalar>(&self, pose: &Pose<S>, command: &[S; JOINTS], d: &Rest) -> Motion<S> {
        let zero = S::lift(0.0);
        let Pose { q, frames, rate, velocities, .. } = pose;
        let speed = |i: usize, k: usize| frames.lever(i, k) * rate[i];
        let fastest = |i: usize| (frames.longest_lever(i).0 * rate[i]).abs();
        let hydraulic = self.hydraulics(pose);
        let limits = &self.limits;
        let points = |of: &[Vector3<S>; JOINTS + 1]| -> [Vector3<S>; CYLINDERS] {
            if self.uses.frames { std::array::from_fn(|k| of[k + 1]) } else { [Vector3::zeros(); CYLINDERS] }
        };
        let scale = |i: usize| {
            let u = command[i];
            if u.re().is_finite() && u.re().abs() > 0.0 { rate[i] / u } else { S::lift(1.0) }
        };
        let at_limit = |i: usize| q[i].re() >= self.machine.max[i] || q[i].re() <= self.machine.min[i];
        #[allow(clippy::cast_precision_loss, reason = "below 2^53")]
        let events = S::lift(d.events as f64);
        Motion {
            gravity: Vector3::new(zero, zero, S::lift(-self.machine.gravity)),
            angle: Angles(*q),
            velocity: Velocities(*rate),
            TIP_r: frames.o[JOINTS],
            TIP_v: velocities.v[JOINTS],
            K_r: Positions(points(&frames.o)),
            K_v: PointVelocities(points(&velocities.v)),
            tangential_1: Tangential1(std::array::from_fn(|k| speed(0, k + 1))),
            tangential_2: Tangential2(std::array::from_fn(|k| speed(1, k + 2))),
            tangential_3: Tangential3(std::array::from_fn(|k| speed(2, k + 3))),
            tangential_4: Tangential4(std::array::from_fn(|k| speed(3, k + 4))),
            tangential_5: Tangential5(std::array::from_fn(|k| speed(4, k + 5))),
            tangential_6: Tangential6([speed(5, 6)]),
            stroke: Strokes(hydraulic.stroke),
            speed: Speeds(hydraulic.speed),
            flow: Flows(std::array::from_fn(|i| hydraulic.flow[i + 1])),
            slope: Slopes(hydraulic.slope),
            slew_flow: hydraulic.flow[0],
            flow_total: hydraulic.total,
            w4: OfJoints(std::array::from_fn(|i| -fastest(i) + limits.tangential_max[i])),
            w5: OfJoints(std::array::from_fn(|i| {
                -hydraulic.flow[i] + limits.flow_max[i][hydraulic.direction[i]]
            })),
            w6: -hydraulic.total + limits.flow_total_max,
            stage: OfJoints(pose.stage.map(|s| S::lift(f64::from(s)))),
            scale: OfJoints(std::array::from_fn(scale)),
            bad_command: flag(command.iter().any(|u| !u.re().is_finite())),
            at_limit: OfJoints(std::array::from_fn(|i| flag(at_limit(i)))),
            events: Count(events),
        }
    }

    fn hydraulics<S: Scalar>(&self, pose: &Pose<S>) -> Hydraulics<S> {
        let zero = S::lift(0.0);
        let off = Hydraulics {
            stroke: [zero; CYLINDERS],
            slope: [zero; CYLINDERS],
            speed: [zero; CYLINDERS],
            flow: [zero; JOINTS],
            total: zero,
            direction: [1; JOINTS],
        };
        let Some(strokes) = pose.strokes.filter(|_| self.uses.hydraulics) else { return off };
        let slope = strokes.map(|s| s.slope);
        let intakes = self.intakes(&slope);
        let flow = std::array::from_fn(|i| intakes[i].flow(pose.rate[i]));
        Hydraulics {
            stroke: strokes.map(|s| s.s),
            slope,
            speed: std::array::from_fn(|i| slope[i] * pose.rate[i + 1]),
            flow,
            total: flow.into_iter().fold(zero, |sum, q| sum + q),
            direction: std::array::from_fn(|i| intakes[i].direction(pose.rate[i].re())),
        }
    }

    fn safety<S: Scalar>(
        &self,
        frames: &Frames<S>,
        strokes: &[Stroke<S>; CYLINDERS],
        tip_force: Option<S>,
    ) -> Safety<S> {
        let Lump { mut mass, mut moment } = self.masses.distribution(frames, strokes).total();
        if let Some(F_z) = tip_force {
            let carried = -F_z / self.machine.gravity;
            mass += carried;
            moment += frames.o[JOINTS] * carried;
        }
        let com = moment / mass;
        let off = S::lift(OFF);
        let stability = self.uses.stability.then(|| Stability::new(&self.feet, &com));
        let beta_min = stability.as_ref().map_or(off, Stability::beta_min);
        let threshold = &self.machine.threshold;
        let w3 = if stability.is_some() { beta_min - threshold.tip_over } else { off };
        let near = self.distances(frames);
        let w1: [f64; CYLINDERS] = std::array::from_fn(|i| match near.distance[i] {
            OFF => OFF,
            distance => distance - threshold.collision[i],
        });
        let w2: [S; JOINTS] = std::array::from_fn(|i| frames.o[i + 1].z - threshold.ground[i]);
        let below = w1.iter().any(|w| *w < 0.0) || w2.iter().any(|w| w.re() < 0.0) || w3.re() < 0.0;
        Safety {
            com,
            mass,
            beta: stability.as_ref().map_or([off; 4], |s| s.beta),
            beta_min,
            edge: count(stability.as_ref().map_or(0, |s| s.edge)),
            distance: OfArms(near.distance.map(S::lift)),
            nearest: OfArms(near.nearest.map(count)),
            w1: OfArms(w1.map(S::lift)),
            w2: OfJoints(w2),
            w3,
            collision: flag(near.distance.iter().any(|d| *d <= TOUCHING)),
            tip_over: flag(beta_min.re() <= 0.0),
            below_threshold: flag(below),
            evaluations: Count(count(near.evaluations)),
        }
    }

    fn distances<S: Scalar>(&self, frames: &Frames<S>) -> Distances {
        let mut found = Distances { distance: [OFF; CYLINDERS], nearest: [0; CYLINDERS], evaluations: 0 };
        if !self.uses.collision {
            return found;
        }
        for (i, shape) in self.machine.arms.iter().enumerate() {
            let near = distance::nearest(&placed(frames, i + 2, shape), &self.obstacles);
            found.distance[i] = near.distance;
            found.nearest[i] = near.index + 1;
            found.evaluations += near.evaluations;
        }
        found
    }

    fn dynamics<S: Scalar>(&self, pose: &Pose<S>, q_ddot: &[S; JOINTS], F: &Vector3<S>) -> Dynamics<S> {
        let zero = S::lift(0.0);
        let Pose { q, frames, rate, velocities, .. } = pose;
        let a = frames.accelerations(velocities, rate, q_ddot);
        let (mut gravity, mut load) = ([zero; JOINTS], [zero; JOINTS]);
        let (mut force, mut pressure) = ([zero; CYLINDERS], [zero; CYLINDERS]);
        if self.uses.forces {
            let strokes = pose.strokes.unwrap_or_else(|| self.strokes(q));
            let masses = self.masses.distribution(frames, &strokes);
            gravity = self.masses.gradient(frames, &masses);
            load = pose.load_torques(F);
            if self.uses.hydraulics {
                for (i, cylinder) in self.machine.cylinders.iter().enumerate() {
                    force[i] = (gravity[i + 1] + load[i + 1]) / strokes[i].slope; // (B22)
                    let (thrust, pull) = (cylinder.piston_area(), cylinder.rod_area());
                    pressure[i] = if force[i].re() >= 0.0 { force[i] / thrust } else { -force[i] / pull };
                }
            }
        }
        let K_a =
            if self.uses.frames { std::array::from_fn(|k| a[k + 1]) } else { [Vector3::zeros(); CYLINDERS] };
        Dynamics {
            acceleration: Accelerations(*q_ddot),
            TIP_a: a[JOINTS],
            K_a: PointAccelerations(K_a),
            TIP_load: *F,
            gravity: GravityTorques(gravity),
            load: LoadTorques(load),
            holding: HoldingTorques(std::array::from_fn(|i| gravity[i] + load[i])),
            force: Forces(force),
            pressure: Pressures(pressure),
        }
    }
}

/// Strokes and flows.
struct Hydraulics<S> {
    stroke: [S; CYLINDERS],
    slope: [S; CYLINDERS],
    speed: [S; CYLINDERS],
    flow: [S; JOINTS],
    total: S,
    /// 1 extending, 0 retracting
    direction: [usize; JOINTS],
}

/// Distances of the arms.
struct Distances {
    distance: [f64; CYLINDERS],
    /// Numbers of the nearest boxes, from 1
    nearest: [usize; CYLINDERS],
    evaluations: usize,
}

/// A box of link `k` in space.
fn placed<S: Scalar>(frames: &Frames<S>, k: usize, shape: &BoxShape) -> PlacedBox {
    let center = frames.point(k, &Vector3::from(shape.center).map(S::lift));
    PlacedBox {
        center: center.map(S::re),
        half: shape.half,
        axes: frames.axes[k].map(|axis| axis.map(S::re)),
    }
}
