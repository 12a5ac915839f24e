#![doc = include_str!("link2.md")]

use mechanics::{Dim, Planar, Pose, Rigid, Scalar, Space, Spatial, Vector};
use model::{
    Dense, Documentation, Enumeration, EvaluationError, Experiment, Model, ParameterError, Spectrum,
    SymmetricTensor, System, Variables, Vector3, Visitor,
};

use super::coordinates::{Coordinates, Orientation};
use super::element::{Element, LoadAt, PosedOf, element_functions, field, restricted, tensor};
use super::rod::{RodParameters, Turning};
use super::variables::ElementEnergy as Energy;
use crate::port::{Root, Slot};

/// Joint of a link at its root
#[derive(Debug, Clone, Copy, PartialEq, Eq, Enumeration)]
pub enum LinkJoint {
    /// Rotation in the plane x-z
    Planar = 1,
    /// Hinge about the horizontal axis across the azimuth given by the start of angle.phi
    Revolute = 2,
    /// The paper's rod: azimuth and elevation, referred to the world
    Universal = 3,
    /// Ball joint, quaternion coordinates
    Spherical = 4,
    /// Rod without spin, unit vector coordinates; no angle singularity
    SphericalRod = 5,
}

/// Parameters of a rod.
#[derive(Debug, Clone, PartialEq, Variables)]
#[variables(parameter)]
pub struct Parameters {
    #[var(prefix = "")]
    #[allow(missing_docs, reason = "a group")]
    pub rod: RodParameters,
    /// Joint at A
    #[var(name = "joint.kind", item = LinkJoint::Planar)]
    pub joint: LinkJoint,
    /// Gravity [m/s2]
    #[var(name = "gravity", start = [0.0, 0.0, -9.80665], tunable)]
    pub gravity: Vector3<f64>,
    /// Weight
    #[var(name = "use.gravity", start = true)]
    pub use_gravity: bool,
    /// Energy integrals
    #[var(name = "use.energy", start = true)]
    pub use_energy: bool,
}

/// Inputs of a rod.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(input)]
pub struct Inputs<S> {
    #[var(prefix = "A.")]
    #[allow(missing_docs, reason = "follower port A")]
    pub A: Root<S>,
    #[var(prefix = "B.")]
    #[allow(missing_docs, reason = "leader port B")]
    pub B: Slot<S>,
    /// Moment on the rod from outside, world frame [N.m]
    #[var(name = "drive.torque")]
    pub torque: Vector3<S>,
}

// What depends on what: inputs and states by name, prefix or component (`@`), united over all joint kinds.
const POINT: &[&str] = &["A.r.@", "angle", "direction", "orientation.q"];
const HEIGHT: &[&str] = &["A.r.z", "angle.theta", "direction", "orientation.q"];
const ALONG: &[&str] = &["A.v.x", "angle", "angle_rate", "direction", "orientation.q", "omega.y", "omega.z"];
const ACROSS: &[&str] = &["A.v.y", "angle", "angle_rate", "direction", "orientation.q", "omega.x", "omega.z"];
const RISE: &[&str] =
    &["A.v.z", "angle.theta", "angle_rate.theta", "direction", "orientation.q", "omega.x", "omega.y"];
const BIAS: &[&str] =
    &["B.F", "B.M", "drive.torque", "angle", "direction", "orientation.q", "angle_rate", "omega"];
const INERTIA: &[&str] = &["B.M", "angle", "direction", "orientation.q"];
const ALL: &[&str] =
    &["A.a", "B.F", "B.M", "drive.torque", "angle", "direction", "orientation.q", "angle_rate", "omega"];
/// A joint passes no moment in the directions in which it turns freely.
const MOMENT: &[&str] = &["A.a", "B.F", "B.M", "drive.torque", "angle", "angle_rate", "direction"];
const MOMENT_Z: &[&str] =
    &["A.a", "B.F", "B.M", "drive.torque", "angle.theta", "angle_rate.theta", "direction"];
const ANGLES: &[&str] = &["A.a", "B.F", "B.M", "drive.torque", "angle", "angle_rate"];
const TURNING: &[&str] = &["A.a", "B.F", "B.M", "drive.torque", "direction", "orientation.q", "omega"];

/// Orientation and tip of a rod; coordinates of joint kinds not in use keep their start values.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Motion<S> {
    /// Elevation of the rod, A to B [rad]
    #[var(name = "angle.theta", state, rate_depends = ["angle_rate.theta"], exact, start = -0.049_958_395_721_942_76)]
    pub theta: S,
    /// Azimuth of the rod; constant with joint.kind revolute [rad]
    #[var(name = "angle.phi", state, rate_depends = ["angle_rate.phi"], exact)]
    pub phi: S,
    /// Rate of the elevation [rad/s]
    #[var(name = "angle_rate.theta", state, rate_depends = ANGLES, exact)]
    pub theta_dot: S,
    /// Rate of the azimuth [rad/s]
    #[var(name = "angle_rate.phi", state, rate_depends = ANGLES, exact)]
    pub phi_dot: S,
    /// Orientation, unit quaternion body to world (w, x, y, z), joint.kind spherical
    #[var(name = "orientation.q", state, rate_depends = [["orientation.q[2]", "orientation.q[3]", "orientation.q[4]", "omega"], ["orientation.q[1]", "orientation.q[3]", "orientation.q[4]", "omega"], ["orientation.q[1]", "orientation.q[2]", "orientation.q[4]", "omega"], ["orientation.q[1]", "orientation.q[2]", "orientation.q[3]", "omega"]], exact, start = [1.0, 0.0, 0.0, 0.0])]
    pub q: [S; 4],
    /// Unit vector along the rod, joint.kind spherical_rod
    #[var(name = "direction", state, rate_depends = [["direction.y", "direction.z", "omega.y", "omega.z"], ["direction.x", "direction.z", "omega.x", "omega.z"], ["direction.x", "direction.y", "omega.x", "omega.y"]], exact, start = [1.0, 0.0, 0.0])]
    pub direction: Vector3<S>,
    /// Angular velocity in the world frame, joint.kind spherical and spherical_rod [rad/s]
    #[var(name = "omega", state, rate_depends = TURNING, exact)]
    pub omega: Vector3<S>,
    /// Position of the tip [m]
    #[var(name = "B.r", depends = [POINT, POINT, HEIGHT])]
    pub B_r: Vector3<S>,
    /// Velocity of the tip [m/s]
    #[var(name = "B.v", depends = [ALONG, ACROSS, RISE])]
    pub B_v: Vector3<S>,
    /// Inertia about the first joint axis over the largest one: small near the vertical; 1 for other joints
    #[var(name = "joint.singularity", local)]
    pub singularity: S,
}

/// What the leader at A has to carry.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Inertia<S> {
    /// Force on the leader at A.a = 0 [N]
    #[var(name = "A.F0", nominal = 1e2, depends = BIAS)]
    pub F0: Vector3<S>,
    /// Effective inertia behind port A [kg]
    #[var(name = "A.M", depends = INERTIA)]
    pub M: SymmetricTensor<S>,
}

/// Accelerations and forces.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Dynamics<S> {
    /// Acceleration of the tip [m/s2]
    #[var(name = "B.a", depends = ALL)]
    pub B_a: Vector3<S>,
    /// Force on the leader (8) [N]
    #[var(name = "A.F", nominal = 1e2, depends = ALL)]
    pub A_F: Vector3<S>,
    /// Moment that the joint passes to the leader side (9); does no work [N.m]
    #[var(name = "joint.moment", depends = [MOMENT, MOMENT, MOMENT_Z])]
    pub moment: Vector3<S>,
}

/// A rod with two ports.
#[derive(Debug, Clone)]
pub struct Link2 {
    structure: Structure,
}

#[derive(Debug, Clone)]
enum Structure {
    Planar(Rod<Planar, 2, 1>),
    Spatial(Rod<Spatial, 3, 3>),
}

/// Constants of a rod.
#[derive(Debug, Clone, Copy)]
struct Rod<J, const D: usize, const N: usize> {
    element: Element<J, D, N>,
    r_B: Vector<f64, D>,
}

/// Orientation variables among the start values.
fn given_orientation(given: &Motion<f64>) -> Orientation<f64> {
    Orientation {
        phi: given.phi,
        theta: given.theta,
        phi_dot: given.phi_dot,
        theta_dot: given.theta_dot,
        q: given.q,
        direction: given.direction,
        omega: given.omega,
        ..Orientation::unused()
    }
}

impl Model for Link2 {
    const NAME: &'static str = "link2";
    const DESCRIPTION: &'static str =
        "Rigid rod with follower port A at its joint and leader port B at its tip";
    const EXPERIMENT: Experiment = Experiment { stop: 2.0, step: 0.01 };
    const DOCUMENTATION: Documentation = model::documentation!(
        "link2",
        plots = [("Angle of the rod", ["angle.theta"]), ("Force on the leader at A", ["A.F.x", "A.F.z"])]
    );
    type Parameters = Parameters;
    type Inputs<S: Scalar> = Inputs<S>;
    type Motion<S: Scalar> = Motion<S>;
    type Inertia<S: Scalar> = Inertia<S>;
    type Dynamics<S: Scalar> = Dynamics<S>;
    type Energy<S: Scalar> = Energy<S>;
    type Discrete = ();

    fn new(p: &Parameters, start: &Motion<f64>) -> Result<Self, ParameterError> {
        let free = match p.joint {
            LinkJoint::Planar | LinkJoint::Revolute => Turning::OneAxis,
            LinkJoint::Universal => Turning::Universal,
            LinkJoint::Spherical => Turning::Free,
            LinkJoint::SphericalRod => Turning::Round,
        };
        let rigid = p.rod.checked(free)?;
        let joint = match p.joint {
            LinkJoint::Planar => {
                return Ok(Self { structure: Structure::Planar(Rod::new(p, Planar, &rigid, start)) });
            }
            LinkJoint::Revolute => Spatial::Revolute { phi: start.phi },
            LinkJoint::Universal => Spatial::Universal,
            LinkJoint::Spherical => Spatial::Spherical,
            LinkJoint::SphericalRod => Spatial::SphericalRod,
        };
        Ok(Self { structure: Structure::Spatial(Rod::new(p, joint, &rigid, start)) })
    }

    fn retune(&mut self, p: &Parameters) {
        match &mut self.structure {
            Structure::Planar(rod) => rod.element.gravity = field(p.use_gravity, &p.gravity),
            Structure::Spatial(rod) => rod.element.gravity = field(p.use_gravity, &p.gravity),
        }
    }

    fn with_system<V: Visitor<Self>>(&self, visitor: V) -> V::Output {
        match &self.structure {
            Structure::Planar(rod) => visitor.visit::<5, 0, _>(rod),
            Structure::Spatial(rod) => match rod.element.joint {
                Spatial::Revolute { .. } => visitor.visit::<5, 0, _>(rod),
                Spatial::Universal => visitor.visit::<7, 0, _>(rod),
                Spatial::Spherical => visitor.visit::<10, 0, _>(rod),
                Spatial::SphericalRod => visitor.visit::<9, 0, _>(rod),
            },
        }
    }
}

impl<J, const D: usize, const N: usize> Rod<J, D, N>
where
    J: Coordinates<D, N>,
    Dim<D>: Space<D>,
{
    fn new(p: &Parameters, joint: J, rigid: &Rigid<3>, start: &Motion<f64>) -> Self {
        let gravity = field(p.use_gravity, &p.gravity);
        let element = Element {
            joint,
            rigid: restricted(rigid),
            gravity,
            energy: p.use_energy,
            start: given_orientation(start),
        };
        Self { element, r_B: Dim::<D>::restrict(&Vector3::new(p.rod.length, 0.0, 0.0)) }
    }

    fn load<S: Scalar>(&self, at: &PosedOf<S, J, D, N>, u: &Inputs<S>) -> [LoadAt<S, D, N>; 1] {
        [Element::<J, D, N>::port(at, &self.r_B, &[&u.B])]
    }
}

/// `None` where the drive does nothing: no code of it is executed.
fn drive<S: Scalar>(u: &Inputs<S>) -> Option<&Vector3<S>> {
    (!u.torque.iter().all(|t| t.vanishes())).then_some(&u.torque)
}

impl<J, const D: usize, const N: usize, const X: usize> System<X, 0> for Rod<J, D, N>
where
    J: Coordinates<D, N>,
    Dim<D>: Space<D>,
    Dense: Spectrum<X>,
{
    type Model = Link2;
    type Spectrum = Dense;

    fn start(&self, _t: f64, given: &Motion<f64>) -> Result<([f64; X], ()), ParameterError> {
        let mut x = [0.0; X];
        let own = &mut x[..self.element.mechanical()];
        self.element.joint.checked_start(&given_orientation(given), own, false)?;
        Ok((x, ()))
    }

    #[inline]
    fn rates<S: Scalar>(&self, _t: S, x: &[S; X], u: &Inputs<S>, _d: &()) -> Result<[S; X], EvaluationError> {
        let at = self.element.pose(x, &u.A);
        let loads = self.load(&at, u);
        let mut x_dot = [S::lift(0.0); X];
        let (own, energies) = x_dot.split_at_mut(self.element.mechanical());
        if self.element.energy {
            let a = self.element.answer(&at, &loads, drive(u))?;
            self.element.joint.derivative(&x[..own.len()], &a.q, own);
            let root = a.F.dot(&at.root.v);
            let port = Element::<J, D, N>::power(&at, &loads[0], &a.q) - root;
            let driven = drive(u).map_or(S::lift(0.0), |torque| torque.dot(&at.pose.omega()));
            energies.copy_from_slice(&[S::lift(0.0), port + driven, port]);
        } else {
            let q = self.element.hinge(&at, &loads, drive(u))?.acceleration(&at.root.a);
            self.element.joint.derivative(&x[..own.len()], &q, own);
        }
        Ok(x_dot)
    }

    fn motion<S: Scalar>(
        &self,
        _t: S,
        x: &[S; X],
        u: &Inputs<S>,
        _d: &(),
    ) -> Result<Motion<S>, EvaluationError> {
        let at = self.element.pose(x, &u.A);
        let o = self.element.orientation(x, false);
        let (B_r, B_v) = at.motion(&at.pose.point(&self.r_B));
        Ok(Motion {
            theta: o.theta,
            phi: o.phi,
            theta_dot: o.theta_dot,
            phi_dot: o.phi_dot,
            q: o.q,
            direction: o.direction,
            omega: o.omega,
            B_r,
            B_v,
            singularity: self.element.joint.singularity(&self.element.rigid, &x[..self.element.mechanical()]),
        })
    }

    fn inertia<S: Scalar>(
        &self,
        _t: S,
        x: &[S; X],
        u: &Inputs<S>,
        _d: &(),
    ) -> Result<Inertia<S>, EvaluationError> {
        let at = self.element.pose(x, &u.A);
        let hinged = self.element.hinge(&at, &self.load(&at, u), drive(u))?;
        Ok(Inertia { F0: Dim::<D>::embed(&hinged.f), M: tensor(&hinged.M) })
    }

    fn dynamics<S: Scalar>(
        &self,
        _t: S,
        x: &[S; X],
        u: &Inputs<S>,
        _d: &(),
    ) -> Result<Dynamics<S>, EvaluationError> {
        let at = self.element.pose(x, &u.A);
        let a = self.element.answer(&at, &self.load(&at, u), drive(u))?;
        let B_a = at.acceleration(&at.pose.point(&self.r_B), &a.q);
        Ok(Dynamics { B_a: Dim::<D>::embed(&B_a), A_F: Dim::<D>::embed(&a.F), moment: a.moment })
    }

    fn energy<S: Scalar>(
        &self,
        _t: S,
        x: &[S; X],
        u: &Inputs<S>,
        _d: &(),
    ) -> Result<Energy<S>, EvaluationError> {
        let (kinetic, potential) = self.element.energies(&self.element.pose(x, &u.A));
        let [dissipated, supplied, port] = [0, 1, 2].map(|i| x[self.element.mechanical() + i]);
        Ok(Energy { kinetic, potential, dissipated, supplied, port })
    }

    element_functions!(link_names);
}
