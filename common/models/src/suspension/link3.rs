#![doc = include_str!("link3.md")]

use mechanics::{Dim, Load, Planar, Pose, Rigid, Scalar, Space, Spatial, Vector};
use model::{
    Dense, Documentation, Enumeration, EvaluationError, Experiment, Model, ParameterError, Spectrum,
    SymmetricTensor, System, Variables, Vector3, Visitor,
};

use super::coordinates::{Coordinates, Orientation};
use super::element::{Element, LoadAt, PosedOf, element_functions, field, tensor};
use super::inertia::{check_inertia, positive_inertia};
use super::parameters::ForceKind;
use super::variables::ElementEnergy as Energy;
use crate::force_law::{LoadLaw, LoadParameters, PulsePhase};
use crate::port::{Root, Slot};

/// Joint of the carrier at its root
#[derive(Debug, Clone, Copy, PartialEq, Eq, Enumeration)]
pub enum BodyJoint {
    /// Rotation in the plane x-z
    Planar = 1,
    /// Hinge about the horizontal axis across the azimuth given by the start of angle.phi
    Revolute = 2,
    /// Azimuth and elevation, referred to the world
    Universal = 3,
    /// Ball joint, quaternion coordinates
    Spherical = 4,
}

/// The end at which the carrier hangs
#[derive(Debug, Clone, Copy, PartialEq, Eq, Enumeration)]
pub enum BodyRoot {
    /// The lower joint
    B = 1,
    /// The upper joint
    C = 2,
}

/// Parameters of the carrier.
#[derive(Debug, Clone, PartialEq, Variables)]
#[variables(parameter)]
pub struct Parameters {
    /// Mass [kg]
    #[var(name = "mass", start = 25.0, above = 0.0)]
    pub mass: f64,
    /// Centre of mass from B, body axes [m]
    #[var(name = "com", start = [0.08, 0.0, 0.14])]
    pub com: Vector3<f64>,
    /// Inertia about the centre of mass; plane motion uses yy only [kg.m2]
    #[var(name = "inertia", start = [1.2, 0.0, 0.0, 0.8, 0.0, 0.8])]
    pub inertia: SymmetricTensor<f64>,
    /// Point C from B, body axes [m]
    #[var(name = "point.C", start = [-0.04, 0.0, 0.29])]
    pub C: Vector3<f64>,
    /// Force point P from B, body axes [m]
    #[var(name = "point.P", start = [0.10, 0.0, 0.14])]
    pub P: Vector3<f64>,
    /// Joint at the root
    #[var(name = "joint.kind", item = BodyJoint::Planar)]
    pub joint: BodyJoint,
    /// The end at which the element hangs
    #[var(name = "root", item = BodyRoot::B)]
    pub root: BodyRoot,
    /// Source of the load at P
    #[var(name = "force.kind", item = ForceKind::Input)]
    pub force_kind: ForceKind,
    #[var(prefix = "force.")]
    #[allow(missing_docs, reason = "a group")]
    pub force: LoadParameters,
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

/// Inputs of the carrier.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(input)]
pub struct Inputs<S> {
    #[var(prefix = "B.", start = [0.40, 0.0, -0.02, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])]
    #[allow(missing_docs, reason = "follower port B")]
    pub B: Root<S>,
    #[var(prefix = "C.")]
    #[allow(missing_docs, reason = "leader port C")]
    pub C: Slot<S>,
    #[var(prefix = "P.")]
    #[allow(missing_docs, reason = "leader port P, first slot")]
    pub P: Slot<S>,
    #[var(prefix = "P.slot[2].")]
    #[allow(missing_docs, reason = "leader port P, second slot")]
    pub P_2: Slot<S>,
}

// What depends on what: inputs and states by name, prefix or component (`@`), united over all joint kinds.
const POINT: &[&str] = &["B.r.@", "angle", "orientation.q"];
const HEIGHT: &[&str] = &["B.r.z", "angle.psi", "angle.theta", "orientation.q"];
const ALONG: &[&str] = &["B.v.x", "angle", "angle_rate", "orientation.q", "omega.y", "omega.z"];
const ACROSS: &[&str] = &["B.v.y", "angle", "angle_rate", "orientation.q", "omega.x", "omega.z"];
const RISE: &[&str] = &[
    "B.v.z",
    "angle.psi",
    "angle.theta",
    "angle_rate.psi",
    "angle_rate.theta",
    "orientation.q",
    "omega.x",
    "omega.y",
];
const BIAS: &[&str] =
    &["C.F", "C.M", "P.F", "P.M", "P.slot[2]", "angle", "orientation.q", "angle_rate", "omega"];
const INERTIA: &[&str] = &["C.M", "P.M", "P.slot[2].M", "angle", "orientation.q"];
const ALL: &[&str] =
    &["B.a", "C.F", "C.M", "P.F", "P.M", "P.slot[2]", "angle", "orientation.q", "angle_rate", "omega"];
/// A joint passes no moment in the directions in which it turns freely.
const MOMENT: &[&str] = &["B.a", "C.F", "C.M", "P.F", "P.M", "P.slot[2]", "angle", "angle_rate"];
const MOMENT_Z: &[&str] = &["B.a", "C.F", "C.M", "P.F", "P.M", "P.slot[2]", "angle.psi", "angle_rate.psi"];
const HINGE: &[&str] = &["B.a", "C.F", "C.M", "P.F", "P.M", "P.slot[2]", "angle.psi", "angle_rate.psi"];
const CARDAN: &[&str] = &[
    "B.a",
    "C.F",
    "C.M",
    "P.F",
    "P.M",
    "P.slot[2]",
    "angle.phi",
    "angle.theta",
    "angle_rate.phi",
    "angle_rate.theta",
];
const BALL: &[&str] = &["B.a", "C.F", "C.M", "P.F", "P.M", "P.slot[2]", "orientation.q", "omega"];

/// Orientation and points of the carrier; coordinates of joint kinds not in use keep their start values.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Motion<S> {
    /// Rotation from the design position about -y, joint.kind planar and revolute [rad]
    #[var(name = "angle.psi", state, rate_depends = ["angle_rate.psi"], exact)]
    pub psi: S,
    /// Azimuth, joint.kind universal; the azimuth of the hinge with revolute [rad]
    #[var(name = "angle.phi", state, rate_depends = ["angle_rate.phi"], exact)]
    pub phi: S,
    /// Elevation, joint.kind universal [rad]
    #[var(name = "angle.theta", state, rate_depends = ["angle_rate.theta"], exact)]
    pub theta: S,
    /// Rate of psi [rad/s]
    #[var(name = "angle_rate.psi", state, rate_depends = HINGE, exact)]
    pub psi_dot: S,
    /// Rate of the azimuth [rad/s]
    #[var(name = "angle_rate.phi", state, rate_depends = CARDAN, exact)]
    pub phi_dot: S,
    /// Rate of the elevation [rad/s]
    #[var(name = "angle_rate.theta", state, rate_depends = CARDAN, exact)]
    pub theta_dot: S,
    /// Orientation, unit quaternion body to world (w, x, y, z), joint.kind spherical
    #[var(name = "orientation.q", state, rate_depends = [["orientation.q[2]", "orientation.q[3]", "orientation.q[4]", "omega"], ["orientation.q[1]", "orientation.q[3]", "orientation.q[4]", "omega"], ["orientation.q[1]", "orientation.q[2]", "orientation.q[4]", "omega"], ["orientation.q[1]", "orientation.q[2]", "orientation.q[3]", "omega"]], exact, start = [1.0, 0.0, 0.0, 0.0])]
    pub q: [S; 4],
    /// Angular velocity in the world frame, joint.kind spherical [rad/s]
    #[var(name = "omega", state, rate_depends = BALL, exact)]
    pub omega: Vector3<S>,
    /// Position of C [m]
    #[var(name = "C.r", depends = [POINT, POINT, HEIGHT])]
    pub C_r: Vector3<S>,
    /// Velocity of C [m/s]
    #[var(name = "C.v", depends = [ALONG, ACROSS, RISE])]
    pub C_v: Vector3<S>,
    /// Position of the force point P [m]
    #[var(name = "P.r", depends = [POINT, POINT, HEIGHT])]
    pub P_r: Vector3<S>,
    /// Velocity of the force point P [m/s]
    #[var(name = "P.v", depends = [ALONG, ACROSS, RISE])]
    pub P_v: Vector3<S>,
    /// Inertia about the first joint axis over the largest one, joint.kind universal; 1 for other joints
    #[var(name = "joint.singularity", local)]
    pub singularity: S,
}

/// What the leader at B has to carry.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Inertia<S> {
    /// Force on the leader at B.a = 0 [N]
    #[var(name = "B.F0", nominal = 1e2, depends = BIAS)]
    pub F0: Vector3<S>,
    /// Effective inertia behind port B [kg]
    #[var(name = "B.M", depends = INERTIA)]
    pub M: SymmetricTensor<S>,
}

/// Accelerations and forces.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Dynamics<S> {
    /// Acceleration of C [m/s2]
    #[var(name = "C.a", depends = ALL)]
    pub C_a: Vector3<S>,
    /// Acceleration of the force point P [m/s2]
    #[var(name = "P.a", depends = ALL)]
    pub P_a: Vector3<S>,
    /// Force on the leader (8) [N]
    #[var(name = "B.F", nominal = 1e2, depends = ALL)]
    pub B_F: Vector3<S>,
    /// Moment that the joint passes to the leader side (9); does no work [N.m]
    #[var(name = "joint.moment", depends = [MOMENT, MOMENT, MOMENT_Z])]
    pub moment: Vector3<S>,
}

/// The carrier with three ports.
#[derive(Debug, Clone)]
pub struct Link3 {
    structure: Structure,
}

#[derive(Debug, Clone)]
enum Structure {
    Planar(Carrier<Planar, 2, 1>),
    Spatial(Carrier<Spatial, 3, 3>),
}

/// Constants of the carrier; body vectors from the root.
#[derive(Debug, Clone, Copy)]
struct Carrier<J, const D: usize, const N: usize> {
    element: Element<J, D, N>,
    r_C: Vector<f64, D>,
    r_P: Vector<f64, D>,
    load: Option<LoadLaw<D>>,
}

/// Orientation variables among the start values.
fn given_orientation(given: &Motion<f64>) -> Orientation<f64> {
    Orientation {
        psi: given.psi,
        psi_dot: given.psi_dot,
        phi: given.phi,
        theta: given.theta,
        phi_dot: given.phi_dot,
        theta_dot: given.theta_dot,
        q: given.q,
        omega: given.omega,
        ..Orientation::unused()
    }
}

impl Model for Link3 {
    const NAME: &'static str = "link3";
    const DESCRIPTION: &'static str =
        "Rigid carrier with follower port B, leader port C and force point P with two slots";
    const EXPERIMENT: Experiment = Experiment { stop: 2.0, step: 0.01 };
    const DOCUMENTATION: Documentation = model::documentation!(
        "link3",
        plots = [("Angle of the carrier", ["angle.psi"]), ("Force on the leader at B", ["B.F.x", "B.F.z"])]
    );
    type Parameters = Parameters;
    type Inputs<S: Scalar> = Inputs<S>;
    type Motion<S: Scalar> = Motion<S>;
    type Inertia<S: Scalar> = Inertia<S>;
    type Dynamics<S: Scalar> = Dynamics<S>;
    type Energy<S: Scalar> = Energy<S>;
    type Discrete = PulsePhase;

    fn new(p: &Parameters, start: &Motion<f64>) -> Result<Self, ParameterError> {
        let structure = match p.joint {
            BodyJoint::Planar => {
                positive_inertia("inertia", p.inertia.yy)?;
                Structure::Planar(Carrier::new(p, Planar, start))
            }
            BodyJoint::Revolute => {
                check_inertia("inertia", &p.inertia)?;
                Structure::Spatial(Carrier::new(p, Spatial::Revolute { phi: start.phi }, start))
            }
            BodyJoint::Universal | BodyJoint::Spherical => {
                check_inertia("inertia", &p.inertia)?;
                let universal = p.joint == BodyJoint::Universal;
                let joint = if universal { Spatial::Universal } else { Spatial::Spherical };
                Structure::Spatial(Carrier::new(p, joint, start))
            }
        };
        Ok(Self { structure })
    }

    fn retune(&mut self, p: &Parameters) {
        match &mut self.structure {
            Structure::Planar(carrier) => carrier.element.gravity = field(p.use_gravity, &p.gravity),
            Structure::Spatial(carrier) => carrier.element.gravity = field(p.use_gravity, &p.gravity),
        }
    }

    fn with_system<V: Visitor<Self>>(&self, visitor: V) -> V::Output {
        match &self.structure {
            Structure::Planar(carrier) => visitor.visit::<5, 0, _>(carrier),
            Structure::Spatial(carrier) => match carrier.element.joint {
                Spatial::Universal => visitor.visit::<7, 0, _>(carrier),
                Spatial::Spherical => visitor.visit::<10, 0, _>(carrier),
                _ => visitor.visit::<5, 0, _>(carrier),
            },
        }
    }
}

impl<J, const D: usize, const N: usize> Carrier<J, D, N>
where
    J: Coordinates<D, N>,
    Dim<D>: Space<D>,
{
    fn new(p: &Parameters, joint: J, start: &Motion<f64>) -> Self {
        let (root, tip) = match p.root {
            BodyRoot::B => (Vector3::zeros(), p.C),
            BodyRoot::C => (p.C, Vector3::zeros()),
        };
        let part = |v: Vector3<f64>| Dim::<D>::restrict(&v);
        let rigid = Rigid { m: p.mass, c: part(p.com - root), I_c: p.inertia.matrix() };
        Self {
            element: Element {
                joint,
                rigid,
                gravity: field(p.use_gravity, &p.gravity),
                energy: p.use_energy,
                start: given_orientation(start),
            },
            r_C: part(tip - root),
            r_P: part(p.P - root),
            load: (p.force_kind == ForceKind::Internal).then(|| LoadLaw::new(&p.force)),
        }
    }

    fn loads<S: Scalar>(
        &self,
        t: S,
        at: &PosedOf<S, J, D, N>,
        u: &Inputs<S>,
        d: PulsePhase,
    ) -> [LoadAt<S, D, N>; 3] {
        let internal = self.load.map(|law| (at.pose.point(&self.r_P), Load::force(law.force(t, d))));
        [
            Element::<J, D, N>::port(at, &self.r_C, &[&u.C]),
            Element::<J, D, N>::port(at, &self.r_P, &[&u.P, &u.P_2]),
            internal,
        ]
    }

    fn phase(&self, t: f64) -> PulsePhase {
        self.load.map_or(PulsePhase::After, |law| law.phase(t))
    }
}

impl<J, const D: usize, const N: usize, const X: usize> System<X, 0> for Carrier<J, D, N>
where
    J: Coordinates<D, N>,
    Dim<D>: Space<D>,
    Dense: Spectrum<X>,
{
    type Model = Link3;
    type Spectrum = Dense;

    fn start(&self, t: f64, given: &Motion<f64>) -> Result<([f64; X], PulsePhase), ParameterError> {
        let mut x = [0.0; X];
        self.element.joint.checked_start(
            &given_orientation(given),
            &mut x[..self.element.mechanical()],
            true,
        )?;
        Ok((x, self.phase(t)))
    }

    #[inline]
    fn rates<S: Scalar>(
        &self,
        t: S,
        x: &[S; X],
        u: &Inputs<S>,
        d: &PulsePhase,
    ) -> Result<[S; X], EvaluationError> {
        let at = self.element.pose(x, &u.B);
        let loads = self.loads(t, &at, u, *d);
        let mut x_dot = [S::lift(0.0); X];
        let (own, energies) = x_dot.split_at_mut(self.element.mechanical());
        if self.element.energy {
            let a = self.element.answer(&at, &loads, None)?;
            self.element.joint.derivative(&x[..own.len()], &a.q, own);
            let power = |load| Element::<J, D, N>::power(&at, load, &a.q);
            let port = power(&loads[0]) + power(&loads[1]) - a.F.dot(&at.root.v);
            energies.copy_from_slice(&[S::lift(0.0), port + power(&loads[2]), port]);
        } else {
            let q = self.element.hinge(&at, &loads, None)?.acceleration(&at.root.a);
            self.element.joint.derivative(&x[..own.len()], &q, own);
        }
        Ok(x_dot)
    }

    fn motion<S: Scalar>(
        &self,
        _t: S,
        x: &[S; X],
        u: &Inputs<S>,
        _d: &PulsePhase,
    ) -> Result<Motion<S>, EvaluationError> {
        let at = self.element.pose(x, &u.B);
        let own = &x[..self.element.mechanical()];
        let o = self.element.orientation(x, true);
        let (C_r, C_v) = at.motion(&at.pose.point(&self.r_C));
        let (P_r, P_v) = at.motion(&at.pose.point(&self.r_P));
        Ok(Motion {
            psi: o.psi,
            phi: o.phi,
            theta: o.theta,
            psi_dot: o.psi_dot,
            phi_dot: o.phi_dot,
            theta_dot: o.theta_dot,
            q: o.q,
            omega: o.omega,
            C_r,
            C_v,
            P_r,
            P_v,
            singularity: self.element.joint.singularity(&self.element.rigid, own),
        })
    }

    fn inertia<S: Scalar>(
        &self,
        t: S,
        x: &[S; X],
        u: &Inputs<S>,
        d: &PulsePhase,
    ) -> Result<Inertia<S>, EvaluationError> {
        let at = self.element.pose(x, &u.B);
        let hinged = self.element.hinge(&at, &self.loads(t, &at, u, *d), None)?;
        Ok(Inertia { F0: Dim::<D>::embed(&hinged.f), M: tensor(&hinged.M) })
    }

    fn dynamics<S: Scalar>(
        &self,
        t: S,
        x: &[S; X],
        u: &Inputs<S>,
        d: &PulsePhase,
    ) -> Result<Dynamics<S>, EvaluationError> {
        let at = self.element.pose(x, &u.B);
        let a = self.element.answer(&at, &self.loads(t, &at, u, *d), None)?;
        let of = |p: &Vector<f64, D>| Dim::<D>::embed(&at.acceleration(&at.pose.point(p), &a.q));
        Ok(Dynamics { C_a: of(&self.r_C), P_a: of(&self.r_P), B_F: Dim::<D>::embed(&a.F), moment: a.moment })
    }

    fn energy<S: Scalar>(
        &self,
        _t: S,
        x: &[S; X],
        u: &Inputs<S>,
        _d: &PulsePhase,
    ) -> Result<Energy<S>, EvaluationError> {
        let (kinetic, potential) = self.element.energies(&self.element.pose(x, &u.B));
        let [dissipated, supplied, port] = [0, 1, 2].map(|i| x[self.element.mechanical() + i]);
        Ok(Energy { kinetic, potential, dissipated, supplied, port })
    }

    fn next_event(&self, d: &PulsePhase) -> Option<f64> {
        self.load.and_then(|law| law.next_event(*d))
    }

    fn update(&self, t: f64, _x: &mut [f64; X], _u: &Inputs<f64>, _d: &PulsePhase) -> PulsePhase {
        self.phase(t)
    }

    element_functions!(carrier_names);
}
