#![doc = include_str!("strut_link.md")]

use mechanics::{
    Dim, Load, Planar, Point, Pose, Rigid, Scalar, Space, Spatial, SpringDamper, SpringState, Vector,
};
use model::{
    Dense, Documentation, Enumeration, EvaluationError, Experiment, Model, ParameterError, Spectrum,
    SymmetricTensor, System, Variables, Vector3, Visitor,
};

use super::coordinates::{Coordinates, Orientation};
use super::element::{Element, LoadAt, PosedOf, element_functions, field, restricted, tensor};
use super::rod::{RodParameters, Turning};
use super::wishbone::span;
use crate::port::{Root, Slot};

/// Joint of the strut link at its root
#[derive(Debug, Clone, Copy, PartialEq, Eq, Enumeration)]
pub enum StrutJoint {
    /// Rotation in the plane x-z
    Planar = 1,
    /// Hinge about the horizontal axis across the azimuth given by the start of angle.phi
    Revolute = 2,
    /// Ball joint, quaternion coordinates
    Spherical = 3,
}

/// The end at which the strut link hangs
#[derive(Debug, Clone, Copy, PartialEq, Eq, Enumeration)]
pub enum StrutRoot {
    /// The chassis end
    D = 1,
    /// The carrier end
    C = 2,
}

/// Parameters of a strut link.
#[allow(clippy::struct_excessive_bools, reason = "each leaves out a part of its own")]
#[derive(Debug, Clone, PartialEq, Variables)]
#[variables(parameter)]
pub struct Parameters {
    #[var(prefix = "", start = [2.5, 0.280_713_376_952_364, true, 0.140_356_688_476_182, 1e-3, 0.016_416_666_666_666_666, 0.016_416_666_666_666_666])]
    #[allow(missing_docs, reason = "a group")]
    pub rod: RodParameters,
    /// Joint at the root
    #[var(name = "joint.kind", item = StrutJoint::Planar)]
    pub joint: StrutJoint,
    /// The end at which the element hangs
    #[var(name = "root", item = StrutRoot::D)]
    pub root: StrutRoot,
    /// Distance from D to the strut's foot S [m]
    #[var(name = "strut.s1", start = 0.14, above = 0.0)]
    pub s1: f64,
    /// Spring rate of the strut [N/m]
    #[var(name = "strut.k", start = 22000.0, min = 0.0, tunable)]
    pub k: f64,
    /// Damping of the strut [N.s/m]
    #[var(name = "strut.c", start = 1000.0, min = 0.0, tunable)]
    pub c: f64,
    /// Free length of the strut [m]
    #[var(name = "strut.l0", start = 0.360_025_588_795_974, above = 0.0)]
    pub l0: f64,
    /// Preload of the strut, positive pushes its ends apart [N]
    #[var(name = "strut.preload", start = 0.0, tunable)]
    pub preload: f64,
    /// Gravity [m/s2]
    #[var(name = "gravity", start = [0.0, 0.0, -9.80665], tunable)]
    pub gravity: Vector3<f64>,
    /// Damper of the strut
    #[var(name = "use.damper", start = true)]
    pub use_damper: bool,
    /// Weight
    #[var(name = "use.gravity", start = true)]
    pub use_gravity: bool,
    /// Energy integrals
    #[var(name = "use.energy", start = true)]
    pub use_energy: bool,
}

/// Motion of the strut's chassis point.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(input)]
pub struct ChassisPoint<S> {
    /// Position of the strut top [m]
    #[var(name = "r", start = [0.22, 0.0, 0.62])]
    pub r: Vector3<S>,
    /// Velocity of the strut top [m/s]
    #[var(name = "v")]
    pub v: Vector3<S>,
}

/// Inputs of a strut link.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(input)]
pub struct Inputs<S> {
    #[var(prefix = "D.", start = [0.08, 0.0, 0.25, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])]
    #[allow(missing_docs, reason = "follower port D")]
    pub D: Root<S>,
    #[var(prefix = "T.")]
    #[allow(missing_docs, reason = "massless port T")]
    pub T: ChassisPoint<S>,
    #[var(prefix = "C.")]
    #[allow(missing_docs, reason = "leader port C")]
    pub C: Slot<S>,
}

// What depends on what: inputs and states by name, prefix or component (`@`), united over all joint kinds.
const POINT: &[&str] = &["D.r.@", "angle.theta", "orientation.q"];
const ALONG: &[&str] = &["D.v.x", "angle.theta", "angle_rate.theta", "orientation.q", "omega.y", "omega.z"];
const ACROSS: &[&str] = &["D.v.y", "angle.theta", "angle_rate.theta", "orientation.q", "omega.x", "omega.z"];
const RISE: &[&str] = &["D.v.z", "angle.theta", "angle_rate.theta", "orientation.q", "omega.x", "omega.y"];
const SPAN: &[&str] = &["D.r", "T.r", "angle.theta", "orientation.q"];
const STRUT: &[&str] =
    &["D.r", "D.v", "T.r", "T.v", "angle.theta", "orientation.q", "angle_rate.theta", "omega"];
const BIAS: &[&str] =
    &["C.F", "C.M", "D.r", "D.v", "T.r", "T.v", "angle.theta", "orientation.q", "angle_rate.theta", "omega"];
const INERTIA: &[&str] = &["C.M", "angle.theta", "orientation.q"];
const ALL: &[&str] = &["D", "T", "C.F", "C.M", "angle.theta", "orientation.q", "angle_rate.theta", "omega"];
const HINGE: &[&str] = &["D", "T", "C.F", "C.M", "angle.theta", "angle_rate.theta"];
const BALL: &[&str] = &["D", "T", "C.F", "C.M", "orientation.q", "omega"];

/// Orientation, tip and strut; coordinates of joint kinds not in use keep their start values.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Motion<S> {
    /// Elevation of the link, D to C [rad]
    #[var(name = "angle.theta", state, rate_depends = ["angle_rate.theta"], exact, start = 0.071_307_464_785_290_4)]
    pub theta: S,
    /// Azimuth of the rod; constant with joint.kind revolute [rad]
    #[var(name = "angle.phi", exact)]
    pub phi: S,
    /// Rate of the elevation [rad/s]
    #[var(name = "angle_rate.theta", state, rate_depends = HINGE, exact)]
    pub theta_dot: S,
    /// Rate of the azimuth [rad/s]
    #[var(name = "angle_rate.phi", exact)]
    pub phi_dot: S,
    /// Orientation, unit quaternion body to world (w, x, y, z), joint.kind spherical
    #[var(name = "orientation.q", state, rate_depends = [["orientation.q[2]", "orientation.q[3]", "orientation.q[4]", "omega"], ["orientation.q[1]", "orientation.q[3]", "orientation.q[4]", "omega"], ["orientation.q[1]", "orientation.q[2]", "orientation.q[4]", "omega"], ["orientation.q[1]", "orientation.q[2]", "orientation.q[3]", "omega"]], exact, start = [1.0, 0.0, 0.0, 0.0])]
    pub q: [S; 4],
    /// Angular velocity in the world frame, joint.kind spherical [rad/s]
    #[var(name = "omega", state, rate_depends = BALL, exact)]
    pub omega: Vector3<S>,
    /// Position of the tip [m]
    #[var(name = "C.r", depends = POINT)]
    pub C_r: Vector3<S>,
    /// Velocity of the tip [m/s]
    #[var(name = "C.v", depends = [ALONG, ACROSS, RISE])]
    pub C_v: Vector3<S>,
    /// Length of the strut [m]
    #[var(name = "strut.length", depends = SPAN)]
    pub length: S,
    /// Rate of the strut's length [m/s]
    #[var(name = "strut.rate", depends = STRUT)]
    pub rate: S,
    /// Tension of the strut (16) [N]
    #[var(name = "strut.force", nominal = 1e3, depends = STRUT)]
    pub force: S,
}

/// What the leaders at D and T have to carry.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Inertia<S> {
    /// Force on the leader at D.a = 0 [N]
    #[var(name = "D.F0", nominal = 1e2, depends = BIAS)]
    pub F0: Vector3<S>,
    /// Effective inertia behind port D [kg]
    #[var(name = "D.M", depends = INERTIA)]
    pub M: SymmetricTensor<S>,
    /// Force on the chassis by the strut; the same as T.F [N]
    #[var(name = "T.F0", nominal = 1e2, depends = STRUT)]
    pub T_F0: Vector3<S>,
    /// Inertia behind port T: always zero [kg]
    #[var(name = "T.M")]
    pub T_M: SymmetricTensor<S>,
}

/// Accelerations and forces.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Dynamics<S> {
    /// Acceleration of the tip [m/s2]
    #[var(name = "C.a", depends = ALL)]
    pub C_a: Vector3<S>,
    /// Force on the leader (8) [N]
    #[var(name = "D.F", nominal = 1e2, depends = ALL)]
    pub D_F: Vector3<S>,
    /// Force on the chassis by the strut [N]
    #[var(name = "T.F", nominal = 1e2, depends = STRUT)]
    pub T_F: Vector3<S>,
    /// Moment that the joint passes to the leader side (9); does no work [N.m]
    #[var(name = "joint.moment", depends = HINGE)]
    pub moment: Vector3<S>,
}

/// Energies (21), on a moving root and chassis point.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Energy<S> {
    /// Kinetic energy [J]
    #[var(name = "energy.kinetic", depends = ["D.v", "angle.theta", "angle_rate.theta", "orientation.q", "omega"])]
    pub kinetic: S,
    /// Potential energy of gravity and spring [J]
    #[var(name = "energy.potential", depends = SPAN)]
    pub potential: S,
    /// Energy turned into heat by the damper since the start [J]
    #[var(name = "energy.dissipated", state, rate_depends = STRUT)]
    pub dissipated: S,
    /// Work of all loads, of root and chassis point on the element since the start [J]
    #[var(name = "energy.supplied", state, rate_depends = ALL)]
    pub supplied: S,
    /// Work through the ports since the start [J]
    #[var(name = "energy.port", state, rate_depends = ALL)]
    pub port: S,
}

/// A rod with a strut.
#[derive(Debug, Clone)]
pub struct StrutLink {
    structure: Structure,
}

#[derive(Debug, Clone)]
enum Structure {
    Planar(StrutRod<Planar, 2, 1>),
    Spatial(StrutRod<Spatial, 3, 3>),
}

/// Constants of a strut link; body vectors from the root.
#[derive(Debug, Clone, Copy)]
struct StrutRod<J, const D: usize, const N: usize> {
    element: Element<J, D, N>,
    r_tip: Vector<f64, D>,
    r_S: Vector<f64, D>,
    strut: SpringDamper,
}

/// Orientation variables among the start values.
fn given_orientation(given: &Motion<f64>) -> Orientation<f64> {
    Orientation {
        phi: given.phi,
        theta: given.theta,
        phi_dot: given.phi_dot,
        theta_dot: given.theta_dot,
        q: given.q,
        omega: given.omega,
        ..Orientation::unused()
    }
}

impl Model for StrutLink {
    const NAME: &'static str = "strut_link";
    const DESCRIPTION: &'static str = "Rigid rod with a spring-damper to the chassis, follower port D at its joint and leader port C at its tip";
    const EXPERIMENT: Experiment = Experiment { stop: 2.0, step: 0.01 };
    const DOCUMENTATION: Documentation = model::documentation!(
        "strut_link",
        plots = [
            ("Angle of the rod", ["angle.theta"]),
            ("Force on the leader at D, tension of the strut", ["D.F.x", "D.F.z", "strut.force"])
        ]
    );
    type Parameters = Parameters;
    type Inputs<S: Scalar> = Inputs<S>;
    type Motion<S: Scalar> = Motion<S>;
    type Inertia<S: Scalar> = Inertia<S>;
    type Dynamics<S: Scalar> = Dynamics<S>;
    type Energy<S: Scalar> = Energy<S>;
    type Discrete = ();

    fn new(p: &Parameters, start: &Motion<f64>) -> Result<Self, ParameterError> {
        if p.s1 > p.rod.length {
            let allowed = format!("0 < strut.s1 <= {} m", p.rod.length);
            return Err(ParameterError::refused("strut.s1", p.s1, "S must lie on the link", allowed));
        }
        let turning = if p.joint == StrutJoint::Spherical { Turning::Free } else { Turning::OneAxis };
        let rigid = p.rod.checked(turning)?;
        let structure = match p.joint {
            StrutJoint::Planar => Structure::Planar(StrutRod::new(p, Planar, &rigid, start)),
            StrutJoint::Revolute => {
                Structure::Spatial(StrutRod::new(p, Spatial::Revolute { phi: start.phi }, &rigid, start))
            }
            StrutJoint::Spherical => Structure::Spatial(StrutRod::new(p, Spatial::Spherical, &rigid, start)),
        };
        Ok(Self { structure })
    }

    fn retune(&mut self, p: &Parameters) {
        match &mut self.structure {
            Structure::Planar(rod) => rod.retune(p),
            Structure::Spatial(rod) => rod.retune(p),
        }
    }

    fn with_system<V: Visitor<Self>>(&self, visitor: V) -> V::Output {
        match &self.structure {
            Structure::Planar(rod) => visitor.visit::<5, 0, _>(rod),
            Structure::Spatial(rod) if rod.element.joint == Spatial::Spherical => {
                visitor.visit::<10, 0, _>(rod)
            }
            Structure::Spatial(rod) => visitor.visit::<5, 0, _>(rod),
        }
    }
}

/// Strut and its foot at a moment.
type Strut<S, const D: usize, const N: usize> = (Point<S, D, N>, SpringState<S, D>);

impl<J, const D: usize, const N: usize> StrutRod<J, D, N>
where
    J: Coordinates<D, N>,
    Dim<D>: Space<D>,
{
    fn new(p: &Parameters, joint: J, rigid: &Rigid<3>, start: &Motion<f64>) -> Self {
        let along = |x: f64| Dim::<D>::restrict(&Vector3::new(x, 0.0, 0.0));
        let (root, tip) = match p.root {
            StrutRoot::D => (0.0, p.rod.length),
            StrutRoot::C => (p.rod.length, 0.0),
        };
        let rigid: Rigid<D> = restricted(rigid);
        let rigid = Rigid { c: rigid.c - along(root), ..rigid };
        let mut rod = Self {
            element: Element {
                joint,
                rigid,
                gravity: None,
                energy: p.use_energy,
                start: given_orientation(start),
            },
            r_tip: along(tip - root),
            r_S: along(p.s1 - root),
            strut: SpringDamper { k: 0.0, c: None, l0: p.l0, F_pre: 0.0 },
        };
        rod.retune(p);
        rod
    }

    fn retune(&mut self, p: &Parameters) {
        self.element.gravity = field(p.use_gravity, &p.gravity);
        self.strut = SpringDamper { k: p.k, c: p.use_damper.then_some(p.c), F_pre: p.preload, ..self.strut };
    }

    fn strut<S: Scalar>(
        &self,
        at: &PosedOf<S, J, D, N>,
        u: &Inputs<S>,
    ) -> Result<Strut<S, D, N>, EvaluationError> {
        let foot = at.pose.point(&self.r_S);
        let part = |v: &Vector3<S>| Dim::<D>::restrict(v);
        let (r, v) = (part(&u.T.r) - at.root.r - foot.r, part(&u.T.v) - at.root.v - foot.v);
        Ok((foot, span(&self.strut, "strut length", &r, &v)?))
    }

    fn loads<S: Scalar>(
        &self,
        at: &PosedOf<S, J, D, N>,
        (foot, strut): &Strut<S, D, N>,
        u: &Inputs<S>,
    ) -> [LoadAt<S, D, N>; 2] {
        let tension = Load::force(strut.e * strut.F_s);
        [Element::<J, D, N>::port(at, &self.r_tip, &[&u.C]), Some((*foot, tension))]
    }
}

impl<J, const D: usize, const N: usize, const X: usize> System<X, 0> for StrutRod<J, D, N>
where
    J: Coordinates<D, N>,
    Dim<D>: Space<D>,
    Dense: Spectrum<X>,
{
    type Model = StrutLink;
    type Spectrum = Dense;

    fn start(&self, _t: f64, given: &Motion<f64>) -> Result<([f64; X], ()), ParameterError> {
        let mut x = [0.0; X];
        self.element.joint.checked_start(
            &given_orientation(given),
            &mut x[..self.element.mechanical()],
            false,
        )?;
        Ok((x, ()))
    }

    #[inline]
    fn rates<S: Scalar>(&self, _t: S, x: &[S; X], u: &Inputs<S>, _d: &()) -> Result<[S; X], EvaluationError> {
        let at = self.element.pose(x, &u.D);
        let strut = self.strut(&at, u)?;
        let loads = self.loads(&at, &strut, u);
        let mut x_dot = [S::lift(0.0); X];
        let (own, energies) = x_dot.split_at_mut(self.element.mechanical());
        if self.element.energy {
            let a = self.element.answer(&at, &loads, None)?;
            self.element.joint.derivative(&x[..own.len()], &a.q, own);
            let (_, strut) = strut;
            let at_T = (strut.e * strut.F_s).dot(&Dim::<D>::restrict(&u.T.v));
            let port = Element::<J, D, N>::power(&at, &loads[0], &a.q) - a.F.dot(&at.root.v) + at_T;
            energies.copy_from_slice(&[self.strut.dissipation(strut.l_dot), port, port]);
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
        _d: &(),
    ) -> Result<Motion<S>, EvaluationError> {
        let at = self.element.pose(x, &u.D);
        let o = self.element.orientation(x, false);
        let (C_r, C_v) = at.motion(&at.pose.point(&self.r_tip));
        let (_, strut) = self.strut(&at, u)?;
        Ok(Motion {
            theta: o.theta,
            phi: o.phi,
            theta_dot: o.theta_dot,
            phi_dot: o.phi_dot,
            q: o.q,
            omega: o.omega,
            C_r,
            C_v,
            length: strut.l,
            rate: strut.l_dot,
            force: strut.F_s,
        })
    }

    fn inertia<S: Scalar>(
        &self,
        _t: S,
        x: &[S; X],
        u: &Inputs<S>,
        _d: &(),
    ) -> Result<Inertia<S>, EvaluationError> {
        let at = self.element.pose(x, &u.D);
        let strut = self.strut(&at, u)?;
        let hinged = self.element.hinge(&at, &self.loads(&at, &strut, u), None)?;
        Ok(Inertia {
            F0: Dim::<D>::embed(&hinged.f),
            M: tensor(&hinged.M),
            T_F0: Dim::<D>::embed(&-(strut.1.e * strut.1.F_s)),
            T_M: SymmetricTensor::diagonal(S::lift(0.0), S::lift(0.0), S::lift(0.0)),
        })
    }

    fn dynamics<S: Scalar>(
        &self,
        _t: S,
        x: &[S; X],
        u: &Inputs<S>,
        _d: &(),
    ) -> Result<Dynamics<S>, EvaluationError> {
        let at = self.element.pose(x, &u.D);
        let strut = self.strut(&at, u)?;
        let a = self.element.answer(&at, &self.loads(&at, &strut, u), None)?;
        let C_a = at.acceleration(&at.pose.point(&self.r_tip), &a.q);
        let world = |v: &Vector<S, D>| Dim::<D>::embed(v);
        let T_F = -(strut.1.e * strut.1.F_s);
        Ok(Dynamics { C_a: world(&C_a), D_F: world(&a.F), T_F: world(&T_F), moment: a.moment })
    }

    fn energy<S: Scalar>(
        &self,
        _t: S,
        x: &[S; X],
        u: &Inputs<S>,
        _d: &(),
    ) -> Result<Energy<S>, EvaluationError> {
        let at = self.element.pose(x, &u.D);
        let (kinetic, gravity) = self.element.energies(&at);
        let potential = gravity + self.strut.energy(self.strut(&at, u)?.1.l);
        let [dissipated, supplied, port] = [0, 1, 2].map(|i| x[self.element.mechanical() + i]);
        Ok(Energy { kinetic, potential, dissipated, supplied, port })
    }

    element_functions!(link_names);
}
