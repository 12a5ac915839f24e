//! Planar linkages of rods: the equations that `four_bar` and `double_pendulum` share.
//!
//! An assembly of links in the plane x-z with weight, one leader port on a link and, where there is a
//! closing joint, its stabilisation.

use mechanics::{
    Accelerations, Assembly, AssemblyError, Baumgarte, Dim, Gap, KinematicsOf, Load, Matrix, Place, Planar,
    Point, Rigid, Scalar, Space, Tree, Vector,
};
use model::{EvaluationError, ParameterError, Variables, Vector3};

use super::parameters::{StabilisationKind, StabilisationParameters};
use crate::port::Slot;
use crate::port::slots;

/// Mass and shape of a rod in the plane.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(parameter)]
pub struct PlanarRod {
    /// Mass [kg]
    #[var(name = "mass", above = 0.0)]
    pub mass: f64,
    /// Uniform rod: com.x and inertia.yy follow from mass and length
    #[var(name = "rod.uniform")]
    pub uniform: bool,
    /// Distance from the joint to the centre of mass; only with rod.uniform false [m]
    #[var(name = "com.x", min = 0.0)]
    pub com: f64,
    /// Inertia about the centre of mass; only with rod.uniform false [kg.m2]
    #[var(name = "inertia.yy", min = 0.0)]
    pub Iyy: f64,
}

impl PlanarRod {
    /// The rod of the given length as a rigid body; `name`: its centre of mass for messages.
    pub(super) fn checked(&self, name: &'static str, length: f64) -> Result<Rigid<2>, ParameterError> {
        let Self { mass: m, uniform, com, Iyy } = *self;
        let (c, Iyy) = if uniform { (0.5 * length, m * length * length / 12.0) } else { (com, Iyy) };
        if c > length {
            return Err(ParameterError::refused(
                name,
                c,
                "the centre of mass lies on the rod",
                format!("0 .. {length} m"),
            ));
        }
        if Iyy + m * c * c <= 0.0 {
            return Err(ParameterError::refused(
                name,
                c,
                "the inertia about the joint vanishes",
                "> 0, or inertia.yy > 0",
            ));
        }
        let mut I_c = Matrix::<f64, 3, 3>::zeros();
        I_c[(1, 1)] = Iyy;
        Ok(Rigid { m, c: Vector::<f64, 2>::new(c, 0.0), I_c })
    }
}

/// What the work on a linkage depends on.
const WORK: &[&str] = &[
    "P.F.x",
    "P.F.z",
    "P.M.xx",
    "P.M.xz",
    "P.M.zz",
    "C.F.x",
    "C.F.z",
    "C.M.xx",
    "C.M.xz",
    "C.M.zz",
    "crank.torque",
    "crank.angle",
    "crank.angle_rate",
    "coupler",
    "rocker",
    "upper",
    "lower",
];

/// Energies of a linkage (21).
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Energy<S> {
    /// Kinetic energy [J]
    #[var(name = "energy.kinetic", depends = ["crank.angle", "crank.angle_rate", "coupler", "rocker.angle_rate", "upper", "lower"])]
    pub kinetic: S,
    /// Potential energy of gravity [J]
    #[var(name = "energy.potential", depends = ["crank.angle", "coupler.angle", "rocker.angle", "upper.angle", "lower.angle"])]
    pub potential: S,
    /// Energy turned into heat since the start: none [J]
    #[var(name = "energy.dissipated", state)]
    pub dissipated: S,
    /// Work of load and torque since the start [J]
    #[var(name = "energy.supplied", state, rate_depends = WORK)]
    pub supplied: S,
    /// Work through the port since the start [J]
    #[var(name = "energy.port", state, rate_depends = WORK)]
    pub port: S,
}

/// How drift of the closing joint is held.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Held {
    Not,
    Baumgarte(Baumgarte),
    Projection,
}

impl Held {
    pub(super) fn new(p: &StabilisationParameters) -> Self {
        match p.kind {
            StabilisationKind::None => Self::Not,
            StabilisationKind::Baumgarte => Self::Baumgarte(p.terms()),
            StabilisationKind::Projection => Self::Projection,
        }
    }
}

/// Constants of a linkage of `B` links with `C` closing joints.
#[derive(Debug, Clone, Copy)]
pub(super) struct Linkage<const B: usize, const C: usize> {
    pub(super) assembly: Assembly<Planar, 2, 1, B, C, 1>,
    /// Ground points
    pub(super) roots: [Vector<f64, 2>; 2],
    pub(super) gravity: Option<Vector<f64, 2>>,
    /// The leader port
    pub(super) port: Place<2>,
    pub(super) held: Held,
    pub(super) energy: bool,
    /// Angles at the start
    pub(super) start: [f64; B],
}

/// Names of the states of a linkage: angle and rate of each link, then the energy integrals.
pub(super) fn state_names<const X: usize>(links: &[&str]) -> [String; X] {
    let own: Vec<String> =
        links.iter().flat_map(|l| [format!("{l}.angle.theta"), format!("{l}.angle_rate.theta")]).collect();
    super::coordinates::state_names(&own.iter().map(String::as_str).collect::<Vec<_>>())
}

/// The linkage at a moment.
pub(super) struct At<S: Scalar, const B: usize, const C: usize> {
    pub(super) k: KinematicsOf<S, Planar, 2, 1, B>,
    pub(super) gaps: [Gap<S, 2, 1>; C],
    pub(super) P: Point<S, 2, 1>,
}

/// World vector of a vector in the plane.
pub(super) fn world<S: Scalar>(v: &Vector<S, 2>) -> Vector3<S> {
    Dim::<2>::embed(v)
}

/// Part of a world vector in the plane.
pub(super) fn plane(v: &Vector3<f64>) -> Vector<f64, 2> {
    Dim::<2>::restrict(v)
}

/// Points of a planar linkage must lie in the plane.
pub(super) fn check_plane(points: &[(&'static str, &Vector3<f64>)]) -> Result<(), ParameterError> {
    match points.iter().find(|(_, p)| !p.y.vanishes()) {
        Some((name, p)) => Err(ParameterError::refused(name, p.y, "the linkage moves in x-z", "0")),
        None => Ok(()),
    }
}

/// Length of a link between two points, far enough apart.
pub(super) fn length(name: &'static str, a: &Vector3<f64>, b: &Vector3<f64>) -> Result<f64, ParameterError> {
    let length = (b - a).norm();
    if length > 1e-6 {
        return Ok(length);
    }
    Err(ParameterError::refused(
        name,
        length,
        "the distance to its neighbour is this many metres",
        "distance > 1e-6 m",
    ))
}

fn named(error: AssemblyError) -> EvaluationError {
    match error {
        AssemblyError::Inertia { source, .. } => EvaluationError::Inertia { element: "link", source },
        AssemblyError::Closure(closure) => closure.into(),
    }
}

impl<const B: usize, const C: usize> Linkage<B, C> {
    /// Number of states without the energy integrals.
    pub(super) const MECHANICAL: usize = 2 * B;

    #[inline]
    pub(super) fn at<S: Scalar>(&self, x: &[S]) -> At<S, B, C> {
        let k = self
            .assembly
            .kinematics(&x[..Self::MECHANICAL], |n| (self.roots[n].map(S::lift), Vector::zeros()));
        At { gaps: self.assembly.gaps(&k), P: k.point(&self.port), k }
    }

    #[inline]
    fn tree<S: Scalar>(
        &self,
        at: &At<S, B, C>,
        port: Option<Load<S, 2>>,
        torque: S,
    ) -> Result<Tree<S, 2, 1, B>, EvaluationError> {
        let bodies = self.assembly.bodies(&at.k);
        let loads = |i: usize, link: &mut mechanics::Loaded<S, 2, 1>| {
            if let Some(g) = &self.gravity {
                link.add(&bodies[i].com, &Load::force(g.map(S::lift) * bodies[i].m));
            }
            if let (true, Some(load)) = (i == self.port.element, &port) {
                link.add(&at.P, load);
            }
            if i == 0 && !torque.vanishes() {
                link.drive(&Vector::<S, 1>::new(torque));
            }
        };
        self.assembly.tree(&at.k, &bodies, loads, None).map_err(named)
    }

    /// Accelerations and forces; `torque` on the first link in the sense of theta.
    #[inline]
    pub(super) fn accelerate<S: Scalar>(
        &self,
        at: &At<S, B, C>,
        port: &Slot<S>,
        torque: S,
    ) -> Result<Accelerations<S, 2, 1, B, C>, EvaluationError> {
        let baumgarte = if let Held::Baumgarte(terms) = self.held { Some(terms) } else { None };
        let tree = self.tree(at, slots(&[port]), torque)?;
        self.assembly.accelerate(&at.k, tree, &at.gaps, |_| Vector::zeros(), baumgarte).map_err(named)
    }

    /// Matrix of the first closing joint (18).
    pub(super) fn closure_matrix<S: Scalar>(
        &self,
        at: &At<S, B, C>,
        port: &Slot<S>,
    ) -> Result<Matrix<S, 2, 2>, EvaluationError> {
        let tree = self.tree(at, slots(&[port]), S::lift(0.0))?;
        Ok(*self.assembly.mobility(&at.k, &tree, &at.gaps).diagonal(0))
    }

    /// Time derivative of all states: coordinates, rates, energy integrals.
    #[inline]
    pub(super) fn rates<S: Scalar, const X: usize>(
        &self,
        x: &[S; X],
        port: &Slot<S>,
        torque: S,
    ) -> Result<[S; X], EvaluationError> {
        let at = self.at(x);
        let a = self.accelerate(&at, port, torque)?;
        let mut x_dot = [S::lift(0.0); X];
        let (own, energies) = x_dot.split_at_mut(Self::MECHANICAL);
        self.assembly.derivative(&x[..Self::MECHANICAL], &a.q, own);
        if self.energy {
            let element = self.port.element;
            let through = slots(&[port]).map_or(S::lift(0.0), |load| {
                let F = load.M.map_or(load.F, |M| load.F - M * a.at(element, &at.P));
                F.dot(&(at.k.v[element] + at.P.v))
            });
            energies.copy_from_slice(&[S::lift(0.0), through + torque * x[1], through]);
        }
        Ok(x_dot)
    }

    /// Kinetic and potential energy (21).
    pub(super) fn energies<S: Scalar>(&self, at: &At<S, B, C>) -> (S, S) {
        let potential =
            self.gravity.map_or(S::lift(0.0), |g| -g.map(S::lift).dot(&self.assembly.mass_moment(&at.k)));
        (self.assembly.kinetic_energy(&at.k), potential)
    }

    /// What a host that integrates the states gets in place of projection.
    pub(super) fn hold_by_equations(&mut self, terms: Baumgarte) {
        if self.held == Held::Projection {
            self.held = Held::Baumgarte(terms);
        }
    }

    /// Bring the states back on the loop (20).
    pub(super) fn project(&self, x: &mut [f64]) -> Result<bool, EvaluationError> {
        match self.held {
            Held::Projection => {
                self.assembly.project(&mut x[..Self::MECHANICAL], |n| self.roots[n]).map_err(named)
            }
            _ => Ok(false),
        }
    }
}
