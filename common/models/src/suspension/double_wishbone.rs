//! The double wishbone as a model: parameters checked, structure chosen, equations in named groups.

use mechanics::{
    Dim, Planar, Revolute, Rigid, Scalar, Space, Spherical, SpringDamper, Universal, Vector, conditioning,
};
use model::{
    Dense, EvaluationError, Experiment, Model, NoVariables, ParameterError, SymmetricTensor, System, Vector3,
    Visitor,
};

use super::coordinates::{ArmCoordinates, CarrierCoordinates};
use super::load::{LoadLaw, PulsePhase};
use super::parameters::{
    ArmJoint, CarrierJoint, ClosureKind, ForceKind, Parameters, PreloadMode, SceneMotion, StabilisationKind,
};
use super::variables::{Dynamics, Energy, Inputs, Motion, THETA_1};
use super::wishbone::{Closing, Wishbone};

/// Largest ratio of masses that passes without a warning.
const MASS_RATIO: f64 = 1e6;

/// Double wishbone wheel suspension: lower link, carrier with wheel, upper link with strut.
#[derive(Debug, Clone)]
pub struct DoubleWishbone {
    structure: Structure,
    parameters: Parameters,
}

/// One system for each combination of joint kinds; all but the planar one in space.
#[derive(Debug, Clone)]
enum Structure {
    Planar(Wishbone<2, 1, 1, Planar, Planar>),
    RevoluteSpherical(Wishbone<3, 1, 3, Revolute, Spherical>),
    RevoluteUniversal(Wishbone<3, 1, 2, Revolute, Universal>),
    UniversalSpherical(Wishbone<3, 2, 3, Universal, Spherical>),
    UniversalUniversal(Wishbone<3, 2, 2, Universal, Universal>),
}

/// Do the same with whichever structure there is.
macro_rules! each {
    ($structure:expr, $w:ident => $body:expr) => {
        match $structure {
            Structure::Planar($w) => $body,
            Structure::RevoluteSpherical($w) => $body,
            Structure::RevoluteUniversal($w) => $body,
            Structure::UniversalSpherical($w) => $body,
            Structure::UniversalUniversal($w) => $body,
        }
    };
}

impl Model for DoubleWishbone {
    const NAME: &'static str = "double_wishbone";
    const DESCRIPTION: &'static str = "Double wishbone wheel suspension: two links, carrier with wheel, strut, closed at the upper chassis joint";
    const EXPERIMENT: Experiment = Experiment {
        stop: 10.0,
        step: 0.05,
    };
    type Parameters = Parameters;
    type Inputs<S: Scalar> = Inputs<S>;
    type Motion<S: Scalar> = Motion<S>;
    type Inertia<S: Scalar> = NoVariables;
    type Dynamics<S: Scalar> = Dynamics<S>;
    type Energy<S: Scalar> = Energy<S>;
    type Discrete = PulsePhase;

    fn new(p: &Parameters) -> Result<Self, ParameterError> {
        check(p)?;
        let structure = match (p.motion, p.arm_joint, p.carrier_joint) {
            (SceneMotion::Planar, ..) => Structure::Planar(Wishbone::new(p)?),
            (_, ArmJoint::Revolute, CarrierJoint::Spherical) => {
                Structure::RevoluteSpherical(Wishbone::new(p)?)
            }
            (_, ArmJoint::Revolute, CarrierJoint::Universal) => {
                Structure::RevoluteUniversal(Wishbone::new(p)?)
            }
            (_, ArmJoint::Universal, CarrierJoint::Spherical) => {
                Structure::UniversalSpherical(Wishbone::new(p)?)
            }
            (_, ArmJoint::Universal, CarrierJoint::Universal) => {
                Structure::UniversalUniversal(Wishbone::new(p)?)
            }
        };
        Ok(Self {
            structure,
            parameters: p.clone(),
        })
    }

    fn retune(&mut self, p: &Parameters) {
        self.parameters = p.clone();
        each!(&mut self.structure, w => w.retune(p));
    }

    fn for_model_exchange(&mut self) {
        let p = &self.parameters;
        each!(&mut self.structure, w => if let Closing::Projection = w.closing {
            w.closing = Closing::Baumgarte { a: p.stabilisation_a, b: p.stabilisation_b };
        });
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
        match &self.structure {
            Structure::Planar(w) => visitor.visit::<9, 0, _>(w),
            Structure::RevoluteSpherical(w) => visitor.visit::<14, 0, _>(w),
            Structure::RevoluteUniversal(w) => visitor.visit::<11, 0, _>(w),
            Structure::UniversalSpherical(w) => visitor.visit::<18, 0, _>(w),
            Structure::UniversalUniversal(w) => visitor.visit::<15, 0, _>(w),
        }
    }
}

fn refused(
    variable: &'static str,
    value: f64,
    reason: impl Into<String>,
    allowed: impl Into<String>,
) -> ParameterError {
    ParameterError::Refused {
        variable,
        value,
        reason: reason.into(),
        allowed: allowed.into(),
    }
}

/// Conditions between parameters.
fn check(p: &Parameters) -> Result<(), ParameterError> {
    let between = |name: [&'static str; 2], a: &Vector3<f64>, b: &Vector3<f64>| {
        let length = (b - a).norm();
        if length > 1e-6 && length.is_finite() {
            return Ok(length);
        }
        Err(refused(
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
        return Err(refused(
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
                return Err(refused(name, point.y, "scene.motion = planar moves in x-z", "0"));
            }
        }
        return positive_inertia(p.carrier_inertia.yy);
    }
    let moments = p.carrier_inertia.matrix().symmetric_eigenvalues();
    positive_inertia(moments.min())?;
    let excess = 2.0 * moments.max() - moments.sum();
    if excess > 1e-12 * moments.max() {
        let largest = moments.max();
        return Err(refused(
            "carrier.inertia",
            largest,
            format!("the largest principal moment exceeds the sum of the others by {excess:.3e} kg.m2"),
            "principal moments that satisfy the triangle inequality",
        ));
    }
    Ok(())
}

fn positive_inertia(smallest: f64) -> Result<(), ParameterError> {
    if smallest > 0.0 {
        return Ok(());
    }
    Err(refused(
        "carrier.inertia",
        smallest,
        "the smallest principal moment is not positive",
        "positive definite",
    ))
}

/// Azimuth and elevation of a link vector; in the plane the azimuth is zero.
fn link_angles(r: &Vector3<f64>) -> (f64, f64) {
    if r.y.vanishes() {
        (0.0, r.z.atan2(r.x))
    } else {
        (r.y.atan2(r.x), r.z.atan2(r.x.hypot(r.y)))
    }
}

impl<const D: usize, const NA: usize, const NC: usize, A, C> Wishbone<D, NA, NC, A, C>
where
    A: ArmCoordinates<D, NA>,
    C: CarrierCoordinates<D, NC>,
    Dim<D>: Space<D>,
{
    fn new(p: &Parameters) -> Result<Self, ParameterError> {
        let part = |v: Vector3<f64>| Dim::<D>::restrict(&v);
        let along = |x: f64| part(Vector3::new(x, 0.0, 0.0));
        let (L_1, L_3) = ((p.B - p.A).norm(), (p.C - p.D).norm());
        let rod = |m: f64, L: f64, Ixx: f64| {
            let across = m * L * L / 12.0;
            Rigid {
                m,
                c: along(0.5 * L),
                I_c: SymmetricTensor::diagonal(Ixx, across, across).matrix(),
            }
        };
        let (design_lower, design_upper) = (link_angles(&(p.B - p.A)), link_angles(&(p.C - p.D)));
        let foot = p.D + (p.C - p.D) * (p.s1 / L_3);
        let l0 = if p.strut_l0 > 0.0 {
            p.strut_l0
        } else {
            (p.T - foot).norm()
        };
        let mut w = Self {
            lower_joint: A::at_azimuth(design_lower.0),
            carrier_joint: C::NEW,
            upper_joint: A::at_azimuth(design_upper.0),
            lower: rod(p.lower_mass, L_1, p.lower_Ixx),
            carrier: Rigid {
                m: p.carrier_mass,
                c: part(p.G - p.B),
                I_c: p.carrier_inertia.matrix(),
            },
            upper: rod(p.upper_mass, L_3, p.upper_Ixx),
            r_AB: along(L_1),
            r_BC: part(p.C - p.B),
            r_BP: part(p.P - p.B),
            r_BR: part(p.tie_R - p.B),
            r_DC: along(L_3),
            r_DS: along(p.s1),
            r_A: part(p.A),
            r_D: part(p.D),
            r_T: part(p.T),
            r_tie: part(p.tie_T),
            strut: SpringDamper {
                k: 0.0,
                c: None,
                l0,
                F_pre: 0.0,
            },
            tie: p.use_tie.then(|| SpringDamper {
                k: 0.0,
                c: None,
                l0: part(p.tie_T - p.tie_R).norm(),
                F_pre: 0.0,
            }),
            gravity: None,
            load: (p.force_kind == ForceKind::Internal).then(|| LoadLaw::new(p)),
            closing: match (p.closure, p.stabilisation) {
                (ClosureKind::Bushing, _) => Closing::Bushing {
                    k: p.closure_k,
                    c: p.closure_c,
                },
                (_, StabilisationKind::None) => Closing::Rigid,
                (_, StabilisationKind::Baumgarte) => Closing::Baumgarte {
                    a: p.stabilisation_a,
                    b: p.stabilisation_b,
                },
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
        self.gravity = p
            .use_gravity
            .then(|| Dim::<D>::restrict(&p.gravity))
            .filter(|g| !g.iter().all(|g| g.vanishes()));
    }
}

/// Equations with `$n` states: coordinates, rates and the three energy integrals.
macro_rules! system {
    ($n:literal, $d:literal, $na:literal, $nc:literal, $A:ty, $C:ty) => {
        impl System<$n, 0> for Wishbone<$d, $na, $nc, $A, $C> {
            type Model = DoubleWishbone;
            type Spectrum = Dense;

            fn start(&self, t: f64, given: &Motion<f64>) -> Result<([f64; $n], PulsePhase), ParameterError> {
                let mut x = [0.0; $n];
                self.start_states(given, &mut x)?;
                Ok((x, self.load.map_or(PulsePhase::After, |law| law.phase(t))))
            }

            #[inline]
            fn rates<S: Scalar>(
                &self,
                t: S,
                x: &[S; $n],
                u: &Inputs<S>,
                d: &PulsePhase,
            ) -> Result<[S; $n], EvaluationError> {
                let mut x_dot = [S::lift(0.0); $n];
                self.state_rates(t, x, u, *d, &mut x_dot)?;
                Ok(x_dot)
            }

            fn motion<S: Scalar>(
                &self,
                _t: S,
                x: &[S; $n],
                _u: &Inputs<S>,
                _d: &PulsePhase,
            ) -> Result<Motion<S>, EvaluationError> {
                self.motion_outputs(x)
            }

            fn inertia<S: Scalar>(
                &self,
                _t: S,
                _x: &[S; $n],
                _u: &Inputs<S>,
                _d: &PulsePhase,
            ) -> Result<NoVariables, EvaluationError> {
                Ok(NoVariables)
            }

            fn dynamics<S: Scalar>(
                &self,
                t: S,
                x: &[S; $n],
                u: &Inputs<S>,
                d: &PulsePhase,
            ) -> Result<Dynamics<S>, EvaluationError> {
                self.dynamic_outputs(t, x, u, *d)
            }

            fn energy<S: Scalar>(
                &self,
                _t: S,
                x: &[S; $n],
                _u: &Inputs<S>,
                _d: &PulsePhase,
            ) -> Result<Energy<S>, EvaluationError> {
                self.energy_outputs(x)
            }

            fn state_names(&self) -> [String; $n] {
                let names = Self::names();
                std::array::from_fn(|i| names[i].clone())
            }

            fn nominals(&self) -> [f64; $n] {
                // energy integrals are quadratures: they follow the states and do not choose the step
                std::array::from_fn(|i| {
                    if i < Self::MECHANICAL {
                        1.0
                    } else {
                        f64::INFINITY
                    }
                })
            }

            fn project(&self, _t: f64, x: &mut [f64; $n]) -> Result<bool, EvaluationError> {
                self.project_states(x)
            }

            fn off_manifold(&self, x: &[f64; $n]) -> f64 {
                let mut y = *x;
                System::<$n, 0>::normalise(self, &mut y);
                x.iter()
                    .zip(y)
                    .map(|(x, y)| (x - y).abs())
                    .fold(0.0, f64::max)
            }

            fn normalise(&self, x: &mut [f64; $n]) {
                let (_, rest) = x.split_at_mut(<$A as mechanics::Joint<$d, $na>>::STATES);
                let states = <$C as mechanics::Joint<$d, $nc>>::STATES;
                mechanics::Joint::normalise(&self.carrier_joint, &mut rest[..states]);
            }

            fn next_event(&self, d: &PulsePhase) -> Option<f64> {
                self.load.and_then(|law| law.next_event(*d))
            }

            fn update(&self, t: f64, _x: &mut [f64; $n], _u: &Inputs<f64>, _d: &PulsePhase) -> PulsePhase {
                self.load.map_or(PulsePhase::After, |law| law.phase(t))
            }
        }
    };
}
system!(9, 2, 1, 1, Planar, Planar);
system!(14, 3, 1, 3, Revolute, Spherical);
system!(11, 3, 1, 2, Revolute, Universal);
system!(18, 3, 2, 3, Universal, Spherical);
system!(15, 3, 2, 2, Universal, Universal);

impl<const D: usize, const NA: usize, const NC: usize, A, C> Wishbone<D, NA, NC, A, C>
where
    A: ArmCoordinates<D, NA>,
    C: CarrierCoordinates<D, NC>,
    Dim<D>: Space<D>,
{
    fn names() -> Vec<String> {
        let element = |element: &str, names: &[&str]| -> Vec<String> {
            names.iter().map(|n| format!("{element}.{n}")).collect()
        };
        [
            element("lower", A::NAMES),
            element("carrier", C::NAMES),
            element("upper", A::NAMES),
            element("energy", &["dissipated", "supplied", "port"]),
        ]
        .concat()
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
                return Err(refused(
                    variable,
                    value,
                    "the start follows from the design points while start.override = false",
                    format!("{default}, or start.override = true"),
                ));
            }
        }
        self.design_states(x);
        Ok(())
    }

    #[inline]
    fn state_rates<S: Scalar>(
        &self,
        t: S,
        x: &[S],
        u: &Inputs<S>,
        d: PulsePhase,
        x_dot: &mut [S],
    ) -> Result<(), EvaluationError> {
        let k = self.kinematics(x)?;
        let loads = self.loads(t, u, d);
        let a = self.accelerate(&k, &loads)?;
        let (lower, carrier, upper) = Self::split(x);
        let (lower_dot, rest) = x_dot.split_at_mut(A::STATES);
        let (carrier_dot, rest) = rest.split_at_mut(C::STATES);
        let (upper_dot, energies) = rest.split_at_mut(A::STATES);
        self.lower_joint.derivative(lower, &a.q_lower, lower_dot);
        self.carrier_joint.derivative(carrier, &a.q_carrier, carrier_dot);
        self.upper_joint.derivative(upper, &a.q_upper, upper_dot);
        if self.energy {
            energies.copy_from_slice(&self.powers(&k, &loads, &a, &Dim::<D>::restrict(&u.chassis_a)));
        }
        Ok(())
    }

    fn motion_outputs<S: Scalar>(&self, x: &[S]) -> Result<Motion<S>, EvaluationError> {
        let k = self.kinematics(x)?;
        let (lower, carrier, upper) = Self::split(x);
        let lower = self.lower_joint.angles(lower);
        let world = |v: Vector<S, D>| Dim::<D>::embed(&v);
        Ok(Motion {
            lower_theta: lower.theta,
            lower_phi: lower.phi,
            lower_theta_dot: lower.theta_dot,
            lower_phi_dot: lower.phi_dot,
            upper: self.upper_joint.angles(upper),
            carrier: C::orientation(carrier),
            P_r: world(k.r_B + k.P.r),
            P_v: world(k.B.v + k.P.v),
            B_r: world(k.r_B),
            B_v: world(k.B.v),
            C_r: world(k.r_B + k.C.r),
            C_v: world(k.B.v + k.C.v),
            strut_length: k.strut.l,
            strut_rate: k.strut.l_dot,
            strut_force: k.strut.F_s,
            gap: magnitude(&k.gap),
            gap_rate: magnitude(&k.gap_rate),
        })
    }

    fn dynamic_outputs<S: Scalar>(
        &self,
        t: S,
        x: &[S],
        u: &Inputs<S>,
        d: PulsePhase,
    ) -> Result<Dynamics<S>, EvaluationError> {
        let k = self.kinematics(x)?;
        let a = self.accelerate(&k, &self.loads(t, u, d))?;
        let world = |v: Vector<S, D>| Dim::<D>::embed(&v);
        let determined = a.closure.map(|Y| conditioning(&Y));
        #[allow(clippy::cast_precision_loss, reason = "0..3")]
        let rank = S::lift(determined.map_or(0, |c| c.rank) as f64);
        Ok(Dynamics {
            P_a: world(a.a_P),
            B_a: world(a.a_B),
            C_a: world(a.a_C),
            A_F: world(a.F_A),
            D_F: world(a.F_D),
            T_F: world(-(k.strut.e * k.strut.F_s)),
            B_F: world(a.F_B),
            C_F: world(a.F_C),
            condition: determined.map_or(S::lift(1.0), |c| c.condition),
            rank,
        })
    }

    fn energy_outputs<S: Scalar>(&self, x: &[S]) -> Result<Energy<S>, EvaluationError> {
        let (kinetic, potential) = self.energies(&self.kinematics(x)?);
        let [dissipated, supplied, port] = [0, 1, 2].map(|i| x[Self::MECHANICAL + i]);
        Ok(Energy {
            kinetic,
            potential,
            dissipated,
            supplied,
            port,
        })
    }
}

/// Length of a vector, smooth enough at zero for dual numbers.
fn magnitude<S: Scalar, const D: usize>(v: &Vector<S, D>) -> S {
    let squared = v.dot(v);
    if squared.re().vanishes() {
        S::lift(0.0)
    } else {
        squared.sqrt()
    }
}
