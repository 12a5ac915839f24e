#![doc = include_str!("four_bar.md")]

use mechanics::{
    Assembly, Baumgarte, ClosingJoint, Member, Parent, Place, Planar, Scalar, Vector, conditioning, magnitude,
};
use model::{
    Dense, Documentation, EvaluationError, Experiment, Model, NoVariables, ParameterError, System, Variables,
    Vector3, Visitor,
};

use super::element::field;
use super::linkage::{Energy, Held, Linkage, PlanarRod, check_plane, length, plane, world};
use super::parameters::StabilisationParameters;
use crate::port::Slot;

/// Parameters of the four-bar linkage. Defaults: the Grashof crank-rocker of the reference.
#[derive(Debug, Clone, PartialEq, Variables)]
#[variables(parameter)]
pub struct Parameters {
    /// Ground point of the crank [m]
    #[var(name = "design.A", start = [0.0, 0.0, 0.0])]
    pub A: Vector3<f64>,
    /// Joint crank - coupler at the start [m]
    #[var(name = "design.B", start = [0.0, 0.0, 0.2])]
    pub B: Vector3<f64>,
    /// Joint coupler - rocker at the start [m]
    #[var(name = "design.C", start = [0.459_164_027_781_647_67, 0.0, 0.397_910_069_454_119_2])]
    pub C: Vector3<f64>,
    /// Ground point of the rocker [m]
    #[var(name = "design.D", start = [0.5, 0.0, 0.0])]
    pub D: Vector3<f64>,
    /// Point on the coupler at the start [m]
    #[var(name = "design.P", start = [0.229_582_013_890_823_84, 0.0, 0.298_955_034_727_059_6])]
    pub P: Vector3<f64>,
    #[var(prefix = "crank.", start = [0.4, true, 0.1, 0.001_333_333_333_333_33])]
    #[allow(missing_docs, reason = "a group")]
    pub crank: PlanarRod,
    #[var(prefix = "coupler.", start = [1.0, true, 0.25, 0.020_833_333_333_333_3])]
    #[allow(missing_docs, reason = "a group")]
    pub coupler: PlanarRod,
    #[var(prefix = "rocker.", start = [0.8, true, 0.2, 0.010_666_666_666_666_6])]
    #[allow(missing_docs, reason = "a group")]
    pub rocker: PlanarRod,
    #[var(prefix = "stabilisation.")]
    #[allow(missing_docs, reason = "a group")]
    pub stabilisation: StabilisationParameters,
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

/// Inputs of the four-bar linkage.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(input)]
pub struct Inputs<S> {
    #[var(prefix = "P.")]
    #[allow(missing_docs, reason = "leader port P")]
    pub P: Slot<S>,
    /// Torque on the crank, positive in the sense of theta [N.m]
    #[var(name = "crank.torque")]
    pub torque: S,
}

// What depends on what: inputs and states by name or prefix.
const OUTER: &[&str] = &["crank.angle", "coupler.angle"];
const OUTER_RATE: &[&str] = &["crank.angle", "crank.angle_rate", "coupler"];
const GAP: &[&str] = &["crank.angle", "coupler.angle", "rocker.angle"];
const GAP_RATE: &[&str] = &["crank.angle", "crank.angle_rate", "coupler", "rocker"];
const MOBILITY: &[&str] = &["P.M.xx", "P.M.xz", "P.M.zz", "crank.angle", "coupler.angle", "rocker.angle"];
const ALL: &[&str] = &[
    "P.F.x",
    "P.F.z",
    "P.M.xx",
    "P.M.xz",
    "P.M.zz",
    "crank.torque",
    "crank.angle",
    "crank.angle_rate",
    "coupler",
    "rocker",
];

/// Angles and points; angles are absolute and not wrapped.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Motion<S> {
    /// Angle of the crank, A to B [rad]
    #[var(name = "crank.angle.theta", state, rate_depends = ["crank.angle_rate.theta"])]
    pub crank: S,
    /// Angle of the coupler, B to C [rad]
    #[var(name = "coupler.angle.theta", state, rate_depends = ["coupler.angle_rate.theta"])]
    pub coupler: S,
    /// Angle of the rocker, D to C [rad]
    #[var(name = "rocker.angle.theta", state, rate_depends = ["rocker.angle_rate.theta"])]
    pub rocker: S,
    /// Rate of the crank [rad/s]
    #[var(name = "crank.angle_rate.theta", state, rate_depends = ALL, exact, start = 6.0)]
    pub crank_rate: S,
    /// Rate of the coupler [rad/s]
    #[var(name = "coupler.angle_rate.theta", state, rate_depends = ALL)]
    pub coupler_rate: S,
    /// Rate of the rocker [rad/s]
    #[var(name = "rocker.angle_rate.theta", state, rate_depends = ALL)]
    pub rocker_rate: S,
    /// Position of the coupler point P [m]
    #[var(name = "P.r", depends = [OUTER, [], OUTER])]
    pub P_r: Vector3<S>,
    /// Velocity of the coupler point P [m/s]
    #[var(name = "P.v", depends = [OUTER_RATE, [], OUTER_RATE])]
    pub P_v: Vector3<S>,
    /// Position of the joint crank - coupler [m]
    #[var(name = "B.r", depends = [["crank.angle"], [], ["crank.angle"]])]
    pub B_r: Vector3<S>,
    /// Position of the joint coupler - rocker, on the coupler [m]
    #[var(name = "C.r", depends = [OUTER, [], OUTER])]
    pub C_r: Vector3<S>,
    /// Distance of the two sides of the closed joint [m]
    #[var(name = "loop.gap", nominal = 1e-6, depends = GAP)]
    pub gap: S,
    /// Relative speed of the two sides of the closed joint [m/s]
    #[var(name = "loop.gap_rate", nominal = 1e-6, depends = GAP_RATE)]
    pub gap_rate: S,
}

/// Accelerations and forces.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Dynamics<S> {
    /// Acceleration of the coupler point P [m/s2]
    #[var(name = "P.a", depends = [ALL, [], ALL])]
    pub P_a: Vector3<S>,
    /// Force on the ground by the crank [N]
    #[var(name = "A.F", depends = [ALL, [], ALL])]
    pub A_F: Vector3<S>,
    /// Force on the ground by the rocker [N]
    #[var(name = "D.F", depends = [ALL, [], ALL])]
    pub D_F: Vector3<S>,
    /// Force on the crank by the coupler [N]
    #[var(name = "B.F", depends = [ALL, [], ALL])]
    pub B_F: Vector3<S>,
    /// Force on the coupler by the rocker [N]
    #[var(name = "C.F", depends = [ALL, [], ALL])]
    pub C_F: Vector3<S>,
    /// Condition of the loop closure (18), largest over smallest kept eigenvalue
    #[var(name = "loop.condition", depends = MOBILITY)]
    pub condition: S,
}

/// The four-bar linkage, and Baumgarte's constants for hosts that integrate the states.
#[derive(Debug, Clone)]
pub struct FourBar(Linkage<3, 1>, Baumgarte);

const CRANK: usize = 0;
const COUPLER: usize = 1;
const ROCKER: usize = 2;

impl Model for FourBar {
    const NAME: &'static str = "four_bar";
    const DESCRIPTION: &'static str = "Planar four-bar linkage with a leader port on the coupler";
    const EXPERIMENT: Experiment = Experiment { stop: 5.0, step: 0.02 };
    const DOCUMENTATION: Documentation = model::documentation!(
        "four_bar",
        plots = [
            ("Angles of coupler and rocker", ["coupler.angle.theta", "rocker.angle.theta"]),
            ("Forces on the ground", ["A.F.x", "A.F.z", "D.F.x"]),
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

    fn new(p: &Parameters, _start: &Motion<f64>) -> Result<Self, ParameterError> {
        check_plane(&[
            ("design.A.y", &p.A),
            ("design.B.y", &p.B),
            ("design.C.y", &p.C),
            ("design.D.y", &p.D),
            ("design.P.y", &p.P),
        ])?;
        let crank = p.crank.checked("crank.com.x", length("design.B", &p.A, &p.B)?)?;
        let coupler_length = length("design.C", &p.B, &p.C)?;
        let coupler = p.coupler.checked("coupler.com.x", coupler_length)?;
        let rocker_length = length("design.D", &p.C, &p.D)?;
        let rocker = p.rocker.checked("rocker.com.x", rocker_length)?;
        let along = |x: f64| Vector::<f64, 2>::new(x, 0.0);
        let member = |rigid, parent| Member { joint: Planar, rigid, parent };
        let axis = plane(&(p.C - p.B)) / coupler_length;
        let r_BP = plane(&(p.P - p.B));
        let linkage = Linkage {
            assembly: Assembly {
                members: [
                    member(crank, Parent::Root(0)),
                    member(coupler, Parent::Element(CRANK, along((p.B - p.A).norm()))),
                    member(rocker, Parent::Root(1)),
                ],
                closures: [ClosingJoint {
                    first: Place { element: COUPLER, point: along(coupler_length) },
                    second: Place { element: ROCKER, point: along(rocker_length) },
                }],
                closed: 1,
            },
            roots: [plane(&p.A), plane(&p.D)],
            gravity: field(p.use_gravity, &p.gravity),
            port: Place {
                element: COUPLER,
                point: Vector::<f64, 2>::new(axis.dot(&r_BP), axis.x * r_BP.y - axis.y * r_BP.x),
            },
            held: Held::new(&p.stabilisation),
            energy: p.use_energy,
            start: [p.B - p.A, p.C - p.B, p.C - p.D].map(|r| r.z.atan2(r.x)),
        };
        Ok(Self(linkage, p.stabilisation.terms()))
    }

    fn retune(&mut self, p: &Parameters) {
        self.0.gravity = field(p.use_gravity, &p.gravity);
    }

    fn for_model_exchange(&mut self) {
        self.0.hold_by_equations(self.1);
    }

    fn with_system<V: Visitor<Self>>(&self, visitor: V) -> V::Output {
        visitor.visit::<9, 0, _>(self)
    }
}

impl System<9, 0> for FourBar {
    type Model = Self;
    type Spectrum = Dense;

    fn start(&self, _t: f64, given: &Motion<f64>) -> Result<([f64; 9], ()), ParameterError> {
        let [crank, coupler, rocker] = self.0.start;
        let mut x = [crank, given.crank_rate, coupler, 0.0, rocker, 0.0, 0.0, 0.0, 0.0];
        self.0.assembly.close_loops(&mut x[..6], |n| self.0.roots[n], CRANK).map_err(|error| {
            let reason = format!("no rates of coupler and rocker belong to it: {error}");
            ParameterError::refused(
                "crank.angle_rate.theta",
                given.crank_rate,
                reason,
                "0, or design points off the change point",
            )
        })?;
        Ok((x, ()))
    }

    #[inline]
    fn rates<S: Scalar>(&self, _t: S, x: &[S; 9], u: &Inputs<S>, _d: &()) -> Result<[S; 9], EvaluationError> {
        self.0.rates(x, &u.P, u.torque)
    }

    fn motion<S: Scalar>(
        &self,
        _t: S,
        x: &[S; 9],
        _u: &Inputs<S>,
        _d: &(),
    ) -> Result<Motion<S>, EvaluationError> {
        let at = self.0.at(x);
        let [crank, crank_rate, coupler, coupler_rate, rocker, rocker_rate, ..] = *x;
        let (P_r, P_v) = at.k.motion(COUPLER, &at.P);
        Ok(Motion {
            crank,
            coupler,
            rocker,
            crank_rate,
            coupler_rate,
            rocker_rate,
            P_r: world(&P_r),
            P_v: world(&P_v),
            B_r: world(&at.k.r[COUPLER]),
            C_r: world(&at.k.motion(COUPLER, &at.gaps[0].first).0),
            gap: magnitude(&at.gaps[0].r),
            gap_rate: magnitude(&at.gaps[0].v),
        })
    }

    fn inertia<S: Scalar>(
        &self,
        _: S,
        _: &[S; 9],
        _: &Inputs<S>,
        (): &(),
    ) -> Result<NoVariables, EvaluationError> {
        Ok(NoVariables)
    }

    fn dynamics<S: Scalar>(
        &self,
        _t: S,
        x: &[S; 9],
        u: &Inputs<S>,
        _d: &(),
    ) -> Result<Dynamics<S>, EvaluationError> {
        let at = self.0.at(x);
        let a = self.0.accelerate(&at, &u.P, u.torque)?;
        Ok(Dynamics {
            P_a: world(&a.at(COUPLER, &at.P)),
            A_F: world(&a.F[CRANK]),
            D_F: world(&a.F[ROCKER]),
            B_F: world(&a.F[COUPLER]),
            C_F: world(&a.lambda[0]),
            condition: conditioning(&self.0.closure_matrix(&at, &u.P)?).condition,
        })
    }

    fn energy<S: Scalar>(
        &self,
        _t: S,
        x: &[S; 9],
        _u: &Inputs<S>,
        _d: &(),
    ) -> Result<Energy<S>, EvaluationError> {
        let (kinetic, potential) = self.0.energies(&self.0.at(x));
        let [.., dissipated, supplied, port] = *x;
        Ok(Energy { kinetic, potential, dissipated, supplied, port })
    }

    fn state_names(&self) -> [String; 9] {
        super::linkage::state_names(&["crank", "coupler", "rocker"])
    }

    fn nominals(&self) -> [f64; 9] {
        super::coordinates::nominals(6)
    }

    fn project(&self, _t: f64, x: &mut [f64; 9]) -> Result<bool, EvaluationError> {
        self.0.project(x)
    }
}
