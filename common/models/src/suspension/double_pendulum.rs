#![doc = include_str!("double_pendulum.md")]

use mechanics::{Assembly, Member, Parent, Place, Planar, Scalar, Vector};
use model::{
    Dense, Documentation, EvaluationError, Experiment, Model, NoVariables, ParameterError, System, Variables,
    Vector3, Visitor,
};

use super::element::field;
use super::linkage::{Energy, Held, Linkage, PlanarRod, check_plane, plane, world};
use crate::port::Slot;

/// A rod of given length.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(parameter)]
pub struct Rod {
    /// Length [m]
    #[var(name = "length", start = 1.0, above = 0.0)]
    pub length: f64,
    #[var(prefix = "", start = [1.0, true, 0.5, 0.083_333_333_333_333_3])]
    #[allow(missing_docs, reason = "a group")]
    pub rod: PlanarRod,
}

/// Parameters of the double pendulum.
#[derive(Debug, Clone, PartialEq, Variables)]
#[variables(parameter)]
pub struct Parameters {
    /// Fixed point A [m]
    #[var(name = "origin", start = 0.0)]
    pub origin: Vector3<f64>,
    #[var(prefix = "upper.")]
    #[allow(missing_docs, reason = "a group")]
    pub upper: Rod,
    #[var(prefix = "lower.")]
    #[allow(missing_docs, reason = "a group")]
    pub lower: Rod,
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

/// Inputs of the double pendulum.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(input)]
pub struct Inputs<S> {
    #[var(prefix = "C.")]
    #[allow(missing_docs, reason = "leader port C")]
    pub C: Slot<S>,
}

// What depends on what: inputs and states by name or prefix.
const TIP: &[&str] = &["upper.angle", "lower.angle"];
const STATES: &[&str] = &["upper", "lower"];
const ALL: &[&str] = &["C.F.x", "C.F.z", "C.M.xx", "C.M.xz", "C.M.zz", "upper", "lower"];

/// Angles and points; angles are absolute and not wrapped.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Motion<S> {
    /// Angle of the upper rod, A to B [rad]
    #[var(name = "upper.angle.theta", state, rate_depends = ["upper.angle_rate.theta"], exact, start = -1.2)]
    pub upper: S,
    /// Rate of the upper rod [rad/s]
    #[var(name = "upper.angle_rate.theta", state, rate_depends = ALL, exact)]
    pub upper_rate: S,
    /// Angle of the lower rod, B to C [rad]
    #[var(name = "lower.angle.theta", state, rate_depends = ["lower.angle_rate.theta"], exact, start = -1.0)]
    pub lower: S,
    /// Rate of the lower rod [rad/s]
    #[var(name = "lower.angle_rate.theta", state, rate_depends = ALL, exact)]
    pub lower_rate: S,
    /// Position of the joint between the rods [m]
    #[var(name = "B.r", depends = [["upper.angle"], [], ["upper.angle"]])]
    pub B_r: Vector3<S>,
    /// Position of the tip [m]
    #[var(name = "C.r", depends = [TIP, [], TIP])]
    pub C_r: Vector3<S>,
    /// Velocity of the tip [m/s]
    #[var(name = "C.v", depends = [STATES, [], STATES])]
    pub C_v: Vector3<S>,
}

/// Accelerations and forces.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Dynamics<S> {
    /// Acceleration of the tip [m/s2]
    #[var(name = "C.a", depends = [ALL, [], ALL])]
    pub C_a: Vector3<S>,
    /// Force on the ground by the upper rod [N]
    #[var(name = "A.F", depends = [ALL, [], ALL])]
    pub A_F: Vector3<S>,
    /// Force on the upper rod by the lower rod [N]
    #[var(name = "B.F", depends = [ALL, [], ALL])]
    pub B_F: Vector3<S>,
}

/// The double pendulum.
#[derive(Debug, Clone)]
pub struct DoublePendulum(Linkage<2, 0>);

const UPPER: usize = 0;
const LOWER: usize = 1;

impl Model for DoublePendulum {
    const NAME: &'static str = "double_pendulum";
    const DESCRIPTION: &'static str = "Planar double pendulum of two rods with a leader port at the tip";
    const EXPERIMENT: Experiment = Experiment { stop: 3.0, step: 0.02 };
    const DOCUMENTATION: Documentation = model::documentation!(
        "double_pendulum",
        plots = [
            ("Angles", ["upper.angle.theta", "lower.angle.theta"]),
            ("Force on the ground", ["A.F.x", "A.F.z"]),
            ("Energies", ["energy.kinetic", "energy.potential"])
        ]
    );
    type Parameters = Parameters;
    type Inputs<S: Scalar> = Inputs<S>;
    type Motion<S: Scalar> = Motion<S>;
    type Inertia<S: Scalar> = NoVariables;
    type Dynamics<S: Scalar> = Dynamics<S>;
    type Energy<S: Scalar> = Energy<S>;
    type Discrete = ();

    fn new(p: &Parameters, start: &Motion<f64>) -> Result<Self, ParameterError> {
        check_plane(&[("origin.y", &p.origin)])?;
        let along = |x: f64| Vector::<f64, 2>::new(x, 0.0);
        let upper = p.upper.rod.checked("upper.com.x", p.upper.length)?;
        let lower = p.lower.rod.checked("lower.com.x", p.lower.length)?;
        let member = |rigid, parent| Member { joint: Planar, rigid, parent };
        Ok(Self(Linkage {
            assembly: Assembly {
                members: [
                    member(upper, Parent::Root(0)),
                    member(lower, Parent::Element(UPPER, along(p.upper.length))),
                ],
                closures: [],
                closed: 0,
            },
            roots: [plane(&p.origin); 2],
            gravity: field(p.use_gravity, &p.gravity),
            port: Place { element: LOWER, point: along(p.lower.length) },
            held: Held::Not,
            energy: p.use_energy,
            start: [start.upper, start.lower],
        }))
    }

    fn retune(&mut self, p: &Parameters) {
        self.0.gravity = field(p.use_gravity, &p.gravity);
    }

    fn with_system<V: Visitor<Self>>(&self, visitor: V) -> V::Output {
        visitor.visit::<7, 0, _>(self)
    }
}

impl System<7, 0> for DoublePendulum {
    type Model = Self;
    type Spectrum = Dense;

    fn start(&self, _t: f64, given: &Motion<f64>) -> Result<([f64; 7], ()), ParameterError> {
        let [upper, lower] = self.0.start;
        Ok(([upper, given.upper_rate, lower, given.lower_rate, 0.0, 0.0, 0.0], ()))
    }

    #[inline]
    fn rates<S: Scalar>(&self, _t: S, x: &[S; 7], u: &Inputs<S>, _d: &()) -> Result<[S; 7], EvaluationError> {
        self.0.rates(x, &u.C, S::lift(0.0))
    }

    fn motion<S: Scalar>(
        &self,
        _t: S,
        x: &[S; 7],
        _u: &Inputs<S>,
        _d: &(),
    ) -> Result<Motion<S>, EvaluationError> {
        let at = self.0.at(x);
        let [upper, upper_rate, lower, lower_rate, ..] = *x;
        let (C_r, C_v) = at.k.motion(LOWER, &at.P);
        Ok(Motion {
            upper,
            upper_rate,
            lower,
            lower_rate,
            B_r: world(&at.k.r[LOWER]),
            C_r: world(&C_r),
            C_v: world(&C_v),
        })
    }

    fn inertia<S: Scalar>(
        &self,
        _: S,
        _: &[S; 7],
        _: &Inputs<S>,
        (): &(),
    ) -> Result<NoVariables, EvaluationError> {
        Ok(NoVariables)
    }

    fn dynamics<S: Scalar>(
        &self,
        _t: S,
        x: &[S; 7],
        u: &Inputs<S>,
        _d: &(),
    ) -> Result<Dynamics<S>, EvaluationError> {
        let at = self.0.at(x);
        let a = self.0.accelerate(&at, &u.C, S::lift(0.0))?;
        Ok(Dynamics { C_a: world(&a.at(LOWER, &at.P)), A_F: world(&a.F[UPPER]), B_F: world(&a.F[LOWER]) })
    }

    fn energy<S: Scalar>(
        &self,
        _t: S,
        x: &[S; 7],
        _u: &Inputs<S>,
        _d: &(),
    ) -> Result<Energy<S>, EvaluationError> {
        let (kinetic, potential) = self.0.energies(&self.0.at(x));
        let [.., dissipated, supplied, port] = *x;
        Ok(Energy { kinetic, potential, dissipated, supplied, port })
    }

    fn state_names(&self) -> [String; 7] {
        super::linkage::state_names(&["upper", "lower"])
    }

    fn nominals(&self) -> [f64; 7] {
        super::coordinates::nominals(4)
    }
}
