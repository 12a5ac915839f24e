//! What the boom reports, from a pose and its rates.

use mechanics::Scalar;
use model::Vector3;

use super::distance::{self, TOUCHING};
use super::kinematics::Frames;
use super::linkage::Stroke;
use super::machine::{BoxShape, CYLINDERS, JOINTS, PlacedBox};
use super::masses::Lump;
use super::plant::{Boom, Rest};
use super::pose::Pose;
use super::stability::Stability;
use super::variables::indexed::{
    Accelerations, Angles, Count, Flows, Forces, GravityTorques, HoldingTorques, LoadTorques, OfArms,
    OfJoints, PointAccelerations, PointVelocities, Positions, Pressures, Slopes, Speeds, Strokes,
    Tangential1, Tangential2, Tangential3, Tangential4, Tangential5, Tangential6, Velocities,
};
use super::variables::outputs::{Dynamics, Motion, Safety};

/// What a part that is left out reports instead of a distance or a margin.
const OFF: f64 = 1e9;

fn flag<S: Scalar>(is: bool) -> S {
    S::lift(f64::from(u8::from(is)))
}

#[allow(clippy::cast_precision_loss, reason = "small numbers")]
fn count<S: Scalar>(n: usize) -> S {
    S::lift(n as f64)
}

impl Boom {
    pub(super) fn motion<S: Scalar>(&self, pose: &Pose<S>, command: &[S; JOINTS], d: &Rest) -> Motion<S> {
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

    pub(super) fn safety<S: Scalar>(
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

    pub(super) fn dynamics<S: Scalar>(
        &self,
        pose: &Pose<S>,
        q_ddot: &[S; JOINTS],
        F: &Vector3<S>,
    ) -> Dynamics<S> {
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
