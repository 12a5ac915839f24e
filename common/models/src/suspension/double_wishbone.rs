#![doc = include_str!("double_wishbone.md")]

use mechanics::{
    Assembly, ClosingJoint, Dim, Member, Parent, Place, Planar, Rigid, Scalar, Space, Spatial, SpringDamper,
    Vector, conditioning, magnitude,
};
use model::{
    Dense, Documentation, EvaluationError, Experiment, Model, NoVariables, ParameterError, Spectrum,
    SymmetricTensor, System, Vector3, Visitor,
};

use super::coordinates::{Coordinates, Orientation};
use super::inertia::{check_inertia, positive_inertia};
use super::parameters::{
    ArmJoint, CarrierJoint, ClosureKind, ForceKind, Parameters, PreloadMode, SceneMotion, StabilisationKind,
};
use super::variables::{Dynamics, Energy, Inputs, Motion, THETA_1};
use super::wishbone::{CARRIER, Closing, LOWER, UPPER, Wishbone, named};
use crate::force_law::{LoadLaw, PulsePhase};

/// Largest ratio of masses that passes without a warning.
const MASS_RATIO: f64 = 1e6;

/// Double wishbone wheel suspension: lower link, carrier with wheel, upper link with strut.
#[derive(Debug, Clone)]
pub struct DoubleWishbone {
    structure: Structure,
    parameters: Parameters,
}

/// In the plane or in space.
#[allow(clippy::large_enum_variant, reason = "one per instance, and the hot path must not follow a pointer")]
#[derive(Debug, Clone)]
enum Structure {
    Planar(Wishbone<Planar, 2, 1>),
    Spatial(Wishbone<Spatial, 3, 3>),
}

/// Do the same with whichever structure there is.
macro_rules! each {
    ($structure:expr, $w:ident => $body:expr) => {
        match $structure {
            Structure::Planar($w) => $body,
            Structure::Spatial($w) => $body,
        }
    };
}

impl Model for DoubleWishbone {
    const NAME: &'static str = "double_wishbone";
    const DESCRIPTION: &'static str = "Double wishbone wheel suspension: two links, carrier with wheel, strut, closed at the upper chassis joint";
    const EXPERIMENT: Experiment = Experiment { stop: 10.0, step: 0.05 };
    const DOCUMENTATION: Documentation = model::documentation!(
        "double_wishbone",
        plots = [
            ("Angle of the lower link (figure 18 of the paper, absolute)", ["lower.angle.theta"]),
            ("Forces on the chassis", ["A.F.z", "D.F.z", "T.F.z"]),
            ("Energies", ["energy.supplied", "energy.dissipated", "energy.kinetic"])
        ]
    );
    type Parameters = Parameters;
    type Inputs<S: Scalar> = Inputs<S>;
    type Motion<S: Scalar> = Motion<S>;
    type Inertia<S: Scalar> = NoVariables;
    type Dynamics<S: Scalar> = Dynamics<S>;
    type Energy<S: Scalar> = Energy<S>;
    type Discrete = PulsePhase;

    fn new(p: &Parameters, _start: &Motion<f64>) -> Result<Self, ParameterError> {
        check(p)?;
        let structure = match p.motion {
            SceneMotion::Planar => Structure::Planar(Wishbone::new(p, |_| Planar, Planar)?),
            SceneMotion::Spatial => {
                let arm = |phi| match p.arm_joint {
                    ArmJoint::Revolute => Spatial::Revolute { phi },
                    ArmJoint::Universal => Spatial::Universal,
                };
                let carrier = match p.carrier_joint {
                    CarrierJoint::Spherical => Spatial::Spherical,
                    CarrierJoint::Universal => Spatial::Universal,
                };
                Structure::Spatial(Wishbone::new(p, arm, carrier)?)
            }
        };
        Ok(Self { structure, parameters: p.clone() })
    }

    fn retune(&mut self, p: &Parameters) {
        self.parameters = p.clone();
        each!(&mut self.structure, w => w.retune(p));
    }

    fn warnings(&self) -> Vec<String> {
        let p = &self.parameters;
        let mut warnings = vec![];
        let masses = [p.lower_mass, p.carrier_mass, p.upper_mass];
        let ratio =
            masses.iter().copied().fold(0.0, f64::max) / masses.iter().copied().fold(f64::INFINITY, f64::min);
        if ratio > MASS_RATIO {
            warnings.push(format!(
                "lower.mass, carrier.mass, upper.mass = {masses:?} kg: ratio {ratio:.1e} above {MASS_RATIO:.0e}, expect a loss of accuracy"
            ));
        }
        let preloaded = each!(&self.structure, w => !w.strut.F_pre.vanishes());
        let universal = p.motion == SceneMotion::Spatial && p.arm_joint == ArmJoint::Universal;
        if universal && preloaded && !p.use_tie {
            warnings.push(
                "arm.joint = universal with a preloaded strut and use.tie = false: the arms are not located out of plane (unstable, growth up to 35 1/s); use arm.joint = revolute or a tie rod".into(),
            );
        }
        warnings
    }

    fn with_system<V: Visitor<Self>>(&self, visitor: V) -> V::Output {
        // coordinates and rates of both arms and the carrier, and three energy integrals
        match &self.structure {
            Structure::Planar(w) => visitor.visit::<9, 0, _>(w),
            Structure::Spatial(w) => match (self.parameters.arm_joint, self.parameters.carrier_joint) {
                (ArmJoint::Revolute, CarrierJoint::Spherical) => visitor.visit::<14, 0, _>(w),
                (ArmJoint::Revolute, CarrierJoint::Universal) => visitor.visit::<11, 0, _>(w),
                (ArmJoint::Universal, CarrierJoint::Spherical) => visitor.visit::<18, 0, _>(w),
                (ArmJoint::Universal, CarrierJoint::Universal) => visitor.visit::<15, 0, _>(w),
            },
        }
    }

    fn for_model_exchange(&mut self) {
        let terms = self.parameters.stabilisation.terms();
        each!(&mut self.structure, w => if let Closing::Projection = w.closing {
            w.closing = Closing::Baumgarte(terms);
        });
    }
}

/// Conditions between parameters.
fn check(p: &Parameters) -> Result<(), ParameterError> {
    let between = |name: [&'static str; 2], a: &Vector3<f64>, b: &Vector3<f64>| {
        let length = (b - a).norm();
        if length > 1e-6 && length.is_finite() {
            return Ok(length);
        }
        Err(ParameterError::refused(
            name[1],
            length,
            format!("its distance to {} is this many metres", name[0]),
            "distance > 1e-6 m",
        ))
    };
    between(["design.A", "design.B"], &p.A, &p.B)?;
    between(["design.B", "design.C"], &p.B, &p.C)?;
    let upper = between(["design.D", "design.C"], &p.D, &p.C)?;
    if p.s1 > upper {
        return Err(ParameterError::refused(
            "strut.s1",
            p.s1,
            "S must lie on the upper link",
            format!("0 < strut.s1 <= {upper:.6} m"),
        ));
    }
    if p.motion == SceneMotion::Planar {
        let points = [
            ("design.A.y", &p.A),
            ("design.B.y", &p.B),
            ("design.C.y", &p.C),
            ("design.D.y", &p.D),
            ("design.G.y", &p.G),
            ("design.P.y", &p.P),
            ("design.T.y", &p.T),
        ];
        for (name, point) in points {
            if !point.y.vanishes() {
                return Err(ParameterError::refused(
                    name,
                    point.y,
                    "scene.motion = planar moves in x-z",
                    "0",
                ));
            }
        }
        return positive_inertia("carrier.inertia", p.carrier_inertia.yy);
    }
    check_inertia("carrier.inertia", &p.carrier_inertia)
}

/// Azimuth and elevation of a link vector; in the plane the azimuth is zero.
fn link_angles(r: &Vector3<f64>) -> (f64, f64) {
    if r.y.vanishes() { (0.0, r.z.atan2(r.x)) } else { (r.y.atan2(r.x), r.z.atan2(r.x.hypot(r.y))) }
}

impl<J, const D: usize, const N: usize> Wishbone<J, D, N>
where
    J: Coordinates<D, N>,
    Dim<D>: Space<D>,
{
    /// The three elements; `bushed`: the upper link hangs at C instead of D.
    fn elements(p: &Parameters, [lower, carrier, upper]: [J; 3], bushed: bool) -> Assembly<J, D, N, 3, 1, 1> {
        let part = |v: Vector3<f64>| Dim::<D>::restrict(&v);
        let along = |x: f64| part(Vector3::new(x, 0.0, 0.0));
        let (L_1, L_3) = ((p.B - p.A).norm(), (p.C - p.D).norm());
        let rod = |m: f64, L: f64, Ixx: f64, root: f64| {
            let across = m * L * L / 12.0;
            let I_c = SymmetricTensor::diagonal(Ixx, across, across).matrix();
            Rigid { m, c: along(0.5 * L - root), I_c }
        };
        let r_BC = part(p.C - p.B);
        let (root, hangs_on) =
            if bushed { (L_3, Parent::Element(CARRIER, r_BC)) } else { (0.0, Parent::Root(1)) };
        let body = Rigid { m: p.carrier_mass, c: part(p.G - p.B), I_c: p.carrier_inertia.matrix() };
        let member = |joint, rigid, parent| Member { joint, rigid, parent };
        Assembly {
            members: [
                member(lower, rod(p.lower_mass, L_1, p.lower_Ixx, 0.0), Parent::Root(0)),
                member(carrier, body, Parent::Element(LOWER, along(L_1))),
                member(upper, rod(p.upper_mass, L_3, p.upper_Ixx, root), hangs_on),
            ],
            closures: [ClosingJoint {
                first: Place { element: CARRIER, point: r_BC },
                second: Place { element: UPPER, point: along(L_3) },
            }],
            closed: usize::from(!bushed),
        }
    }

    fn new(p: &Parameters, arm: impl Fn(f64) -> J, carrier: J) -> Result<Self, ParameterError> {
        let part = |v: Vector3<f64>| Dim::<D>::restrict(&v);
        let along = |x: f64| part(Vector3::new(x, 0.0, 0.0));
        let L_3 = (p.C - p.D).norm();
        let (design_lower, design_upper) = (link_angles(&(p.B - p.A)), link_angles(&(p.C - p.D)));
        let foot = p.D + (p.C - p.D) * (p.s1 / L_3);
        let l0 = if p.strut_l0 > 0.0 { p.strut_l0 } else { (p.T - foot).norm() };
        let bushed = p.closure == ClosureKind::Bushing;
        let joints = [arm(design_lower.0), carrier, arm(design_upper.0)];
        let root = along(if bushed { L_3 } else { 0.0 });
        let mut w = Self {
            assembly: Self::elements(p, joints, bushed),
            rigid: Self::elements(p, joints, false),
            r_BP: part(p.P - p.B),
            r_BR: part(p.tie_R - p.B),
            r_S: along(p.s1) - root,
            r_CD: -root,
            r_A: part(p.A),
            r_D: part(p.D),
            r_T: part(p.T),
            r_tie: part(p.tie_T),
            strut: SpringDamper { k: 0.0, c: None, l0, F_pre: 0.0 },
            tie: p.use_tie.then(|| SpringDamper {
                k: 0.0,
                c: None,
                l0: part(p.tie_T - p.tie_R).norm(),
                F_pre: 0.0,
            }),
            gravity: None,
            load: (p.force_kind == ForceKind::Internal).then(|| LoadLaw::new(&p.force)),
            closing: match (p.closure, p.stabilisation.kind) {
                (ClosureKind::Bushing, _) => Closing::Bushing { k: p.closure_k, c: p.closure_c },
                (_, StabilisationKind::None) => Closing::Rigid,
                (_, StabilisationKind::Baumgarte) => Closing::Baumgarte(p.stabilisation.terms()),
                (_, StabilisationKind::Projection) => Closing::Projection,
            },
            energy: p.use_energy,
            start_override: p.start_override,
            design_lower,
            design_upper,
        };
        w.retune(p);
        if p.preload_mode == PreloadMode::Static {
            w.strut.F_pre = w.static_preload(&part(p.static_load))?;
        }
        Ok(w)
    }

    /// Take over the tunable parameters; a static preload stays as calculated at the start.
    fn retune(&mut self, p: &Parameters) {
        self.strut.k = p.strut_k;
        self.strut.c = p.use_damper.then_some(p.strut_c);
        if p.preload_mode == PreloadMode::Given {
            self.strut.F_pre = p.preload;
        }
        if let Some(tie) = &mut self.tie {
            tie.k = p.tie_k;
            tie.c = Some(p.tie_c);
        }
        let weight = p.use_gravity.then(|| Dim::<D>::restrict(&p.gravity));
        self.gravity = weight.filter(|g| !g.iter().all(|g| g.vanishes()));
    }

    /// Number of states without the energy integrals.
    fn mechanical(&self) -> usize {
        self.assembly.states()
    }

    /// Section 7: the design position at rest, or the given lower angle with the loop closed.
    #[allow(clippy::float_cmp, reason = "was the start value touched at all?")]
    fn start_states(&self, given: &Motion<f64>, x: &mut [f64]) -> Result<(), ParameterError> {
        if self.start_override {
            return self.assemble(x, given);
        }
        for (variable, value, default) in [
            ("lower.angle.theta", given.lower_theta, THETA_1),
            ("lower.angle_rate.theta", given.lower_theta_dot, 0.0),
        ] {
            if value != default {
                let reason = "the start follows from the design points while start.override = false";
                return Err(ParameterError::refused(
                    variable,
                    value,
                    reason,
                    format!("{default}, or start.override = true"),
                ));
            }
        }
        self.design_states(x);
        Ok(())
    }

    fn phase(&self, t: f64) -> PulsePhase {
        self.load.map_or(PulsePhase::After, |law| law.phase(t))
    }
}

/// Equations with `X` states: coordinates, rates and the three energy integrals.
impl<J, const D: usize, const N: usize, const X: usize> System<X, 0> for Wishbone<J, D, N>
where
    J: Coordinates<D, N>,
    Dim<D>: Space<D>,
    Dense: Spectrum<X>,
{
    type Model = DoubleWishbone;
    type Spectrum = Dense;

    fn start(&self, t: f64, given: &Motion<f64>) -> Result<([f64; X], PulsePhase), ParameterError> {
        let mut x = [0.0; X];
        self.start_states(given, &mut x[..self.mechanical()])?;
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
        let mut x_dot = [S::lift(0.0); X];
        let k = self.kinematics(x)?;
        let loads = self.loads(t, u, *d);
        let a = self.accelerate(&k, &loads)?;
        let (coordinates, energies) = x_dot.split_at_mut(self.mechanical());
        self.assembly.derivative(x, &a.q, coordinates);
        if self.energy {
            energies.copy_from_slice(&self.powers(&k, &loads, &a, &Dim::<D>::restrict(&u.chassis_a)));
        }
        Ok(x_dot)
    }

    fn motion<S: Scalar>(
        &self,
        _t: S,
        x: &[S; X],
        _u: &Inputs<S>,
        _d: &PulsePhase,
    ) -> Result<Motion<S>, EvaluationError> {
        let k = self.kinematics(x)?;
        let mut states: [&[S]; 3] = [&[]; 3];
        self.assembly.each(x, |i, own| states[i] = own);
        let orientation = |i: usize| {
            self.assembly.members[i].joint.orientation(states[i], i == CARRIER, Orientation::unused())
        };
        let lower = orientation(LOWER).link();
        let world = |v: Vector<S, D>| Dim::<D>::embed(&v);
        let carrier = |p| k.elements.motion(CARRIER, p);
        let ((P_r, P_v), (C_r, C_v)) = (carrier(&k.P), carrier(&k.C));
        Ok(Motion {
            lower_theta: lower.theta,
            lower_phi: lower.phi,
            lower_theta_dot: lower.theta_dot,
            lower_phi_dot: lower.phi_dot,
            upper: orientation(UPPER).link(),
            carrier: orientation(CARRIER).carrier(),
            P_r: world(P_r),
            P_v: world(P_v),
            B_r: world(k.elements.r[CARRIER]),
            B_v: world(k.elements.v[CARRIER]),
            C_r: world(C_r),
            C_v: world(C_v),
            strut_length: k.strut.l,
            strut_rate: k.strut.l_dot,
            strut_force: k.strut.F_s,
            gap: magnitude(&k.gap),
            gap_rate: magnitude(&k.gap_rate),
        })
    }

    fn inertia<S: Scalar>(
        &self,
        _t: S,
        _x: &[S; X],
        _u: &Inputs<S>,
        _d: &PulsePhase,
    ) -> Result<NoVariables, EvaluationError> {
        Ok(NoVariables)
    }

    fn dynamics<S: Scalar>(
        &self,
        t: S,
        x: &[S; X],
        u: &Inputs<S>,
        d: &PulsePhase,
    ) -> Result<Dynamics<S>, EvaluationError> {
        let k = self.kinematics(x)?;
        let loads = self.loads(t, u, *d);
        let a = self.accelerate(&k, &loads)?;
        let world = |v: Vector<S, D>| Dim::<D>::embed(&v);
        let (D_F, C_F, determined) = if self.bushing().is_some() {
            (-self.bushing_force(&k), a.F[UPPER], None)
        } else {
            let K = self.closure_matrix(&k, &loads)?;
            (a.F[UPPER], a.lambda[0], Some(conditioning(&K)))
        };
        #[allow(clippy::cast_precision_loss, reason = "0..3")]
        let rank = S::lift(determined.map_or(0, |c| c.rank) as f64);
        Ok(Dynamics {
            P_a: world(a.at(CARRIER, &k.P)),
            B_a: world(a.a[CARRIER]),
            C_a: world(a.at(CARRIER, &k.C)),
            A_F: world(a.F[LOWER]),
            D_F: world(D_F),
            T_F: world(-(k.strut.e * k.strut.F_s)),
            B_F: world(a.F[CARRIER]),
            C_F: world(C_F),
            condition: determined.map_or(S::lift(1.0), |c| c.condition),
            rank,
        })
    }

    fn energy<S: Scalar>(
        &self,
        _t: S,
        x: &[S; X],
        _u: &Inputs<S>,
        _d: &PulsePhase,
    ) -> Result<Energy<S>, EvaluationError> {
        let (kinetic, potential) = self.energies(&self.kinematics(x)?);
        let [dissipated, supplied, port] = [0, 1, 2].map(|i| x[self.mechanical() + i]);
        Ok(Energy { kinetic, potential, dissipated, supplied, port })
    }

    fn state_names(&self) -> [String; X] {
        let mut names = Vec::with_capacity(X);
        for (i, element) in ["lower", "carrier", "upper"].iter().enumerate() {
            let joint = &self.assembly.members[i].joint;
            let own = if i == CARRIER { joint.carrier_names() } else { joint.link_names() };
            names.extend(own.iter().map(|n| format!("{element}.{}", n.trim_start_matches("orientation."))));
        }
        names.extend(["dissipated", "supplied", "port"].map(|n| format!("energy.{n}")));
        std::array::from_fn(|i| names[i].clone())
    }

    fn nominals(&self) -> [f64; X] {
        super::coordinates::nominals(self.mechanical())
    }

    fn project(&self, _t: f64, x: &mut [f64; X]) -> Result<bool, EvaluationError> {
        let x = &mut x[..self.mechanical()];
        match self.closing {
            Closing::Projection => self.assembly.project(x, |number| self.root(number)).map_err(named),
            _ => Ok(self.assembly.normalise(x)),
        }
    }

    fn off_manifold(&self, x: &[f64; X]) -> f64 {
        self.assembly.off_manifold(&x[..self.mechanical()])
    }

    fn normalise(&self, x: &mut [f64; X]) -> bool {
        self.assembly.normalise(&mut x[..self.mechanical()])
    }

    fn next_event(&self, d: &PulsePhase) -> Option<f64> {
        self.load.and_then(|law| law.next_event(*d))
    }

    fn update(&self, t: f64, _x: &mut [f64; X], _u: &Inputs<f64>, _d: &PulsePhase) -> PulsePhase {
        self.phase(t)
    }
}
