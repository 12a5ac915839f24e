//! Point masses of the machine: centre of mass, potential and its gradient.
//!
//! ```text
//! links 1 to 6, concrete, tip mass; per cylinder from C along e: barrel at p0 + S/2, rod at (p0 + s + L)/2,
//! oil rho A_p s at p0 + s/2 and rho A_r (S - s) at p0 + (s + S)/2; tank with the rest of the oil; chassis; legs  (B13)
//! c = sum m r/sum m                                                                                        (B14)
//! V = g sum m z,   dV/dq_i = g (z_(i-1) x (sum_later m (r - o_(i-1))))_z + own cylinder                   (B21)
//! ```

use mechanics::Scalar;
use model::Vector3;

use super::kinematics::Frames;
use super::linkage::Stroke;
use super::machine::{CYLINDERS, Cylinder, JOINTS, Machine, Support};

/// Mass and first moment.
#[derive(Debug, Clone, Copy)]
pub struct Lump<S> {
    /// Mass [kg]
    pub mass: S,
    /// Sum of m r [kg.m]
    pub moment: Vector3<S>,
}

impl<S: Scalar> Lump<S> {
    fn add(&mut self, other: &Self) {
        self.mass += other.mass;
        self.moment += other.moment;
    }
}

/// The masses that move, in their frames.
#[derive(Debug, Clone, PartialEq)]
pub struct Masses {
    gravity: f64,
    /// Mass and moment of links 1 to 6 with what hangs on them, in K_i
    links: [(f64, Vector3<f64>); JOINTS],
    cylinders: [Cylinder; CYLINDERS],
    density: f64,
    tank: Vector3<f64>,
    oil: f64,
    standing: (f64, Vector3<f64>),
}

/// Moments by what they hang on: nothing, or link 1 to 6.
#[derive(Debug, Clone, Copy)]
pub struct Distribution<S> {
    lumps: [Lump<S>; JOINTS + 1],
    /// Change of the moment by the own joint of each cylinder, in the world [kg.m/rad]
    own: [Vector3<S>; CYLINDERS],
}

impl Masses {
    /// The masses with the pipe filled to the part `fill` and `tip` at its end [kg].
    #[must_use]
    pub fn new(machine: &Machine, support: &Support, fill: f64, tip: f64) -> Self {
        let links = std::array::from_fn(|i| {
            let (mut mass, mut moment) = (machine.arm_mass[i], machine.arm_com[i] * machine.arm_mass[i]);
            if i > 0 {
                let concrete = fill * machine.concrete * machine.links[i].a;
                mass += concrete;
                moment.x -= 0.5 * concrete * machine.links[i].a;
            }
            if i + 1 == JOINTS {
                mass += tip;
            }
            (mass, moment)
        });
        Self {
            gravity: machine.gravity,
            links,
            cylinders: machine.cylinders,
            density: machine.oil.density,
            tank: machine.oil.tank_position.into(),
            oil: machine.oil.total_mass,
            standing: machine.standing(support),
        }
    }

    /// Where the masses are (B13).
    pub fn distribution<S: Scalar>(
        &self,
        frames: &Frames<S>,
        strokes: &[Stroke<S>; CYLINDERS],
    ) -> Distribution<S> {
        let lift = |p: &Vector3<f64>| p.map(S::lift);
        let empty = Lump { mass: S::lift(0.0), moment: Vector3::zeros() };
        let mut lumps = [empty; JOINTS + 1];
        lumps[0] = Lump { mass: S::lift(self.standing.0), moment: lift(&self.standing.1) };
        for (i, (mass, moment)) in self.links.iter().enumerate() {
            let at = frames.o[i + 1] * S::lift(*mass) + frames.turned(i + 1, &lift(moment));
            lumps[i + 1] = Lump { mass: S::lift(*mass), moment: at };
        }
        let mut tank = S::lift(self.oil);
        let mut own = [Vector3::zeros(); CYLINDERS];
        for (i, cylinder) in self.cylinders.iter().enumerate() {
            let carrier = i + 1; // cylinder i + 2 hangs on link i + 1
            let parts = OnRod::new(cylinder, self.density, &strokes[i]);
            tank -= parts.oil;
            let [x, y] = cylinder.linkage.pin();
            let pin = frames.point(carrier, &Vector3::new(S::lift(x), S::lift(y), S::lift(0.0)));
            let plane =
                |p: nalgebra::Vector2<S>| frames.turned(carrier, &Vector3::new(p.x, p.y, S::lift(0.0)));
            let (e, e_slope) = (plane(strokes[i].e), plane(strokes[i].e_slope));
            lumps[carrier].add(&Lump { mass: parts.mass, moment: pin * parts.mass + e * parts.moment });
            own[i] = pin * parts.oil_slope + e * parts.moment_slope + e_slope * parts.moment
                - lift(&self.tank) * parts.oil_slope;
        }
        lumps[0].add(&Lump { mass: tank, moment: lift(&self.tank) * tank });
        Distribution { lumps, own }
    }

    /// Potential (B21) [J].
    pub fn potential<S: Scalar>(&self, masses: &Distribution<S>) -> S {
        masses.total().moment.z * self.gravity
    }

    /// Its derivatives by the joint angles [N.m].
    pub fn gradient<S: Scalar>(&self, frames: &Frames<S>, masses: &Distribution<S>) -> [S; JOINTS] {
        let mut later = Lump { mass: S::lift(0.0), moment: Vector3::zeros() };
        let mut gradient = [S::lift(0.0); JOINTS];
        for i in (0..JOINTS).rev() {
            later.add(&masses.lumps[i + 1]);
            let arm = later.moment - frames.o[i] * later.mass;
            gradient[i] = frames.axis(i).cross(&arm).z * self.gravity;
            if i > 0 {
                gradient[i] += masses.own[i - 1].z * self.gravity;
            }
        }
        gradient
    }
}

impl<S: Scalar> Distribution<S> {
    /// Everything together.
    pub fn total(&self) -> Lump<S> {
        let mut total = self.lumps[0];
        self.lumps[1..].iter().for_each(|lump| total.add(lump));
        total
    }
}

/// Barrel, rod and oil of a cylinder along its axis, from the barrel's pin.
struct OnRod<S> {
    mass: S,
    /// Sum of m times position [kg.m]
    moment: S,
    /// Its derivative by the angle
    moment_slope: S,
    /// Mass of the oil [kg]
    oil: S,
    /// Its derivative by the angle
    oil_slope: S,
}

impl<S: Scalar> OnRod<S> {
    fn new(c: &Cylinder, density: f64, at: &Stroke<S>) -> Self {
        let Stroke { s, slope, length, .. } = *at;
        let (p0, full) = (c.dead_length, c.stroke_max);
        let piston = density * c.piston_area();
        let ring = density * c.rod_area();
        let (behind, before) = (s * piston, (-s + full) * ring);
        let moment = (s + length + p0) * (0.5 * c.rod_mass)
            + behind * (s * 0.5 + p0)
            + before * ((s + full) * 0.5 + p0)
            + c.barrel_mass * (p0 + 0.5 * full);
        // d/ds of: rod (p0 + s + L)/2, piston s (p0 + s/2), ring (S - s)(p0 + (s + S)/2)
        let by_stroke = (s + p0) * piston - (s + p0) * ring + c.rod_mass;
        let oil = behind + before;
        Self {
            mass: oil + (c.barrel_mass + c.rod_mass),
            moment,
            moment_slope: by_stroke * slope,
            oil,
            oil_slope: slope * (piston - ring),
        }
    }
}
