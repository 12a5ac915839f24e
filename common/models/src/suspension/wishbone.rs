//! Equations of the double wishbone for any combination of joint kinds, in the plane or in space.
//!
//! ```text
//! chain 1: chassis A -> lower link -> B -> carrier -> C
//! chain 2: chassis D -> upper link -> C
//! closure: (Y1 + Y2) F = b2 - b1 - 2a Phi' - b^2 Phi,   Phi = r_C1 - r_C2      (18), (19)
//! bushing: A -> lower link -> B -> carrier -> C -> upper link, at D the force -k d - c d'
//! ```
//!
//! Chassis acceleration: the roots rest in the chassis frame, and every body carries the load
//! `-m a_ch` beside its weight.

use mechanics::{
    Chain, Dim, Force, Hinged, Load, Matrix, Point, Pose, Rigid, Scalar, Space, SpringDamper, SpringState,
    Tip, Vector, close,
};
use model::EvaluationError;

use super::coordinates::{ArmCoordinates, CarrierCoordinates};
use super::load::{LoadLaw, PulsePhase};
use super::variables::Inputs;

/// Shortest usable spring length [m]
const SHORTEST: f64 = 1e-9;

fn vanishes<S: Scalar, const D: usize>(quantity: &'static str, r: &Vector<S, D>) -> EvaluationError {
    EvaluationError::Vanishes {
        quantity,
        value: r.map(S::re).norm(),
        limit: SHORTEST,
    }
}

/// How the loop is closed.
#[derive(Debug, Clone, Copy)]
pub(super) enum Closing {
    /// Exactly, without terms against drift
    Rigid,
    /// Exactly, with Baumgarte's terms (19)
    Baumgarte { a: f64, b: f64 },
    /// Exactly, projected after each step (20)
    Projection,
    /// Bushing at D
    Bushing { k: f64, c: f64 },
}

/// Constants of the double wishbone in the space of dimension `D`.
///
/// `NA`, `NC`: degrees of freedom of an arm and of the carrier, with the joint kinds `A` and `C`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wishbone<const D: usize, const NA: usize, const NC: usize, A, C> {
    pub(super) lower_joint: A,
    pub(super) carrier_joint: C,
    pub(super) upper_joint: A,
    pub(super) lower: Rigid<D>,
    pub(super) carrier: Rigid<D>,
    pub(super) upper: Rigid<D>,
    /// Body vectors: A to B on the lower link; B to C, P, R on the carrier; D to C, S on the upper
    pub(super) r_AB: Vector<f64, D>,
    pub(super) r_BC: Vector<f64, D>,
    pub(super) r_BP: Vector<f64, D>,
    pub(super) r_BR: Vector<f64, D>,
    pub(super) r_DC: Vector<f64, D>,
    pub(super) r_DS: Vector<f64, D>,
    /// Chassis points: the joints, the strut top, the end of the tie rod
    pub(super) r_A: Vector<f64, D>,
    pub(super) r_D: Vector<f64, D>,
    pub(super) r_T: Vector<f64, D>,
    pub(super) r_tie: Vector<f64, D>,
    pub(super) strut: SpringDamper,
    pub(super) tie: Option<SpringDamper>,
    pub(super) gravity: Option<Vector<f64, D>>,
    pub(super) load: Option<LoadLaw<D>>,
    pub(super) closing: Closing,
    pub(super) energy: bool,
    pub(super) start_override: bool,
    /// Angles phi, theta of the arms in the design position
    pub(super) design_lower: (f64, f64),
    pub(super) design_upper: (f64, f64),
}

/// Positions and velocities of everything that the equations use.
pub(super) struct Kinematics<S, const D: usize, const NA: usize, const NC: usize, PA, PC> {
    pub(super) lower: PA,
    pub(super) carrier: PC,
    pub(super) upper: PA,
    /// Points from the joint of their element
    pub(super) B: Point<S, D, NA>,
    pub(super) C: Point<S, D, NC>,
    pub(super) P: Point<S, D, NC>,
    /// End of the upper link at C seen from its root (D, or C itself with a bushing)
    pub(super) far: Point<S, D, NA>,
    pub(super) foot: Point<S, D, NA>,
    /// Joint of the upper link: position, velocity
    pub(super) root: (Vector<S, D>, Vector<S, D>),
    pub(super) r_B: Vector<S, D>,
    pub(super) gap: Vector<S, D>,
    pub(super) gap_rate: Vector<S, D>,
    pub(super) strut: SpringState<S, D>,
    pub(super) tie: Option<(Point<S, D, NC>, SpringState<S, D>)>,
}

/// Accelerations and forces.
pub(super) struct Accelerations<S, const D: usize, const NA: usize, const NC: usize> {
    pub(super) q_lower: Vector<S, NA>,
    pub(super) q_carrier: Vector<S, NC>,
    pub(super) q_upper: Vector<S, NA>,
    pub(super) a_B: Vector<S, D>,
    pub(super) a_C: Vector<S, D>,
    pub(super) a_P: Vector<S, D>,
    /// On the chassis by the links
    pub(super) F_A: Vector<S, D>,
    pub(super) F_D: Vector<S, D>,
    /// On the lower link by the carrier, on the carrier by the upper link
    pub(super) F_B: Vector<S, D>,
    pub(super) F_C: Vector<S, D>,
    /// Y1 + Y2 of the closure (18); `None` with a bushing
    pub(super) closure: Option<Matrix<S, D, D>>,
}

/// Loads at P and on the bodies.
pub(super) struct Loads<S, const D: usize> {
    /// Sum of the slots
    pub(super) port: Option<Load<S, D>>,
    pub(super) internal: Option<Vector<S, D>>,
    /// Gravity minus chassis acceleration
    pub(super) field: Option<Vector<S, D>>,
}

/// The two chains, ready to be closed at C.
pub(super) struct OpenLoop<S, const D: usize, const NA: usize, const NC: usize> {
    pub(super) lower: Hinged<S, D, NA>,
    pub(super) lower_tip: Tip<S, D, NA>,
    pub(super) carrier: Hinged<S, D, NC>,
    pub(super) carrier_tip: Tip<S, D, NC>,
    pub(super) upper: Hinged<S, D, NA>,
    pub(super) upper_tip: Tip<S, D, NA>,
    pub(super) chain: Chain<S, D>,
}

/// Kinematics with the poses of the joint kinds `A` and `C`.
pub(super) type KinematicsOf<S, const D: usize, const NA: usize, const NC: usize, A, C> = Kinematics<
    S,
    D,
    NA,
    NC,
    <A as mechanics::Joint<D, NA>>::Pose<S>,
    <C as mechanics::Joint<D, NC>>::Pose<S>,
>;

impl<const D: usize, const NA: usize, const NC: usize, A, C> Wishbone<D, NA, NC, A, C>
where
    A: ArmCoordinates<D, NA>,
    C: CarrierCoordinates<D, NC>,
    Dim<D>: Space<D>,
{
    /// Number of states without the energy integrals.
    pub(super) const MECHANICAL: usize = 2 * A::STATES + C::STATES;

    /// The states of lower link, carrier and upper link.
    #[inline]
    pub(super) fn split<S>(x: &[S]) -> (&[S], &[S], &[S]) {
        let (lower, rest) = x.split_at(A::STATES);
        let (carrier, rest) = rest.split_at(C::STATES);
        (lower, carrier, &rest[..A::STATES])
    }

    #[inline]
    fn bushing(&self) -> Option<(f64, f64)> {
        match self.closing {
            Closing::Bushing { k, c } => Some((k, c)),
            _ => None,
        }
    }

    /// Positions and velocities.
    #[inline]
    pub(super) fn kinematics<S: Scalar>(
        &self,
        x: &[S],
    ) -> Result<KinematicsOf<S, D, NA, NC, A, C>, EvaluationError> {
        let (lower, carrier, upper) = Self::split(x);
        let lower = self.lower_joint.pose(lower);
        let carrier = self.carrier_joint.pose(carrier);
        let upper = self.upper_joint.pose(upper);
        let (B, C, P) = (
            lower.point(&self.r_AB),
            carrier.point(&self.r_BC),
            carrier.point(&self.r_BP),
        );
        let r_B = self.r_A.map(S::lift) + B.r;
        let (r_C1, v_C1) = (r_B + C.r, B.v + C.v);
        let r_D = self.r_D.map(S::lift);

        let (root, far, foot, gap, gap_rate) = if self.bushing().is_some() {
            let (end, foot) = (upper.point(&-self.r_DC), upper.point(&(self.r_DS - self.r_DC)));
            ((r_C1, v_C1), end, foot, r_C1 + end.r - r_D, v_C1 + end.v)
        } else {
            let (end, foot) = (upper.point(&self.r_DC), upper.point(&self.r_DS));
            (
                (r_D, Vector::zeros()),
                end,
                foot,
                r_C1 - (r_D + end.r),
                v_C1 - end.v,
            )
        };
        let r_T = self.r_T.map(S::lift);
        let r_ST = r_T - (root.0 + foot.r);
        let strut = self
            .strut
            .state(&r_ST, &-(root.1 + foot.v))
            .ok_or_else(|| vanishes("strut length", &r_ST))?;
        let tie = match self.tie {
            None => None,
            Some(tie) => {
                let R = carrier.point(&self.r_BR);
                let r_RT = self.r_tie.map(S::lift) - (r_B + R.r);
                let state = tie
                    .state(&r_RT, &-(B.v + R.v))
                    .ok_or_else(|| vanishes("tie rod length", &r_RT))?;
                Some((R, state))
            }
        };
        Ok(Kinematics {
            lower,
            carrier,
            upper,
            B,
            C,
            P,
            far,
            foot,
            root,
            r_B,
            gap,
            gap_rate,
            strut,
            tie,
        })
    }

    /// Loads from inputs and time.
    #[inline]
    pub(super) fn loads<S: Scalar>(&self, t: S, u: &Inputs<S>, pulse: PulsePhase) -> Loads<S, D> {
        let F = Dim::<D>::restrict(&(u.P.F + u.P_2.F));
        let inertia =
            |m: &model::SymmetricTensor<S>| Dim::<D>::restrict_tensor(m.xx, m.xy, m.xz, m.yy, m.yz, m.zz);
        let M = (!u.P.M.vanishes() || !u.P_2.M.vanishes()).then(|| inertia(&u.P.M) + inertia(&u.P_2.M));
        let port = (M.is_some() || !F.iter().all(|f| f.vanishes())).then_some(Load { F, M });
        let a_ch = Dim::<D>::restrict(&u.chassis_a);
        let moving = !a_ch.iter().all(|a| a.vanishes());
        let field = match self.gravity {
            Some(g) => Some(g.map(S::lift) - a_ch),
            None => moving.then_some(-a_ch),
        };
        Loads {
            port,
            internal: self.load.map(|law| law.force(t, pulse)),
            field,
        }
    }

    /// Lower link and carrier under their loads; `at_C`: what hangs at C.
    #[allow(clippy::type_complexity, reason = "two elements of different size")]
    #[inline]
    fn inner<S: Scalar>(
        &self,
        k: &KinematicsOf<S, D, NA, NC, A, C>,
        loads: &Loads<S, D>,
        at_C: Option<Load<S, D>>,
    ) -> Result<(mechanics::Body<S, D, NA>, Hinged<S, D, NC>), EvaluationError> {
        let lower = k.lower.body(&self.lower);
        let carrier = k.carrier.body(&self.carrier);
        let weight = loads.field.map(|g| (&carrier.com, Force::load(g * carrier.m)));
        let tie = k.tie.as_ref().map(|(R, s)| (R, Force::load(s.e * s.F_s)));
        let carrier_loads = [
            weight,
            loads.port.map(|l| (&k.P, l)),
            loads.internal.map(|F| (&k.P, Force::load(F))),
            tie,
            at_C.map(|l| (&k.C, l)),
        ];
        let hinged = Hinged::new(&carrier, carrier_loads).map_err(|source| EvaluationError::Inertia {
            element: "carrier",
            source,
        })?;
        Ok((lower, hinged))
    }

    /// Both chains with their loads, open at C.
    #[inline]
    pub(super) fn open<S: Scalar>(
        &self,
        k: &KinematicsOf<S, D, NA, NC, A, C>,
        loads: &Loads<S, D>,
        strut_force: Option<Vector<S, D>>,
    ) -> Result<OpenLoop<S, D, NA, NC>, EvaluationError> {
        let (body, carrier) = self.inner(k, loads, None)?;
        let weight = loads.field.map(|g| (&body.com, Force::load(g * body.m)));
        let lower = Hinged::new(&body, [weight]).map_err(|source| EvaluationError::Inertia {
            element: "lower link",
            source,
        })?;
        let upper = self.hang_upper(k, loads, strut_force, None)?;
        let (lower_tip, carrier_tip, upper_tip) = (lower.tip(&k.B), carrier.tip(&k.C), upper.tip(&k.far));
        let chain = Chain::new(&lower_tip, &carrier, &carrier_tip);
        Ok(OpenLoop {
            lower,
            lower_tip,
            carrier,
            carrier_tip,
            upper,
            upper_tip,
            chain,
        })
    }

    /// The upper link under weight, strut and, with a bushing, the bushing's force at D.
    #[inline]
    fn hang_upper<S: Scalar>(
        &self,
        k: &KinematicsOf<S, D, NA, NC, A, C>,
        loads: &Loads<S, D>,
        strut_force: Option<Vector<S, D>>,
        at_D: Option<Vector<S, D>>,
    ) -> Result<Hinged<S, D, NA>, EvaluationError> {
        let rigid = if at_D.is_some() {
            Rigid {
                c: self.upper.c - self.r_DC,
                ..self.upper
            }
        } else {
            self.upper
        };
        let body = k.upper.body(&rigid);
        let upper_loads = [
            loads.field.map(|g| (&body.com, Force::load(g * body.m))),
            strut_force.map(|F| (&k.foot, Force::load(F))),
            at_D.map(|F| (&k.far, Force::load(F))),
        ];
        Hinged::new(&body, upper_loads).map_err(|source| EvaluationError::Inertia {
            element: "upper link",
            source,
        })
    }

    /// Accelerations and forces under the given loads.
    #[inline]
    pub(super) fn accelerate<S: Scalar>(
        &self,
        k: &KinematicsOf<S, D, NA, NC, A, C>,
        loads: &Loads<S, D>,
    ) -> Result<Accelerations<S, D, NA, NC>, EvaluationError> {
        let strut_force = Some(k.strut.e * k.strut.F_s);
        if let Some((stiffness, damping)) = self.bushing() {
            return self.accelerate_chain(
                k,
                loads,
                strut_force,
                -k.gap * S::lift(stiffness) - k.gap_rate * S::lift(damping),
            );
        }
        let o = self.open(k, loads, strut_force)?;
        let mut rhs = o.upper_tip.b - o.chain.b; // (18)
        if let Closing::Baumgarte { a, b } = self.closing {
            rhs -= k.gap_rate * S::lift(2.0 * a) + k.gap * S::lift(b * b); // (19)
        }
        let closure = o.mobility();
        let F = close(&closure, &rhs)?;
        let a_B = o.chain.joint_acceleration(&F);
        let F_B = o.chain.joint_force(&a_B, &F);
        let q_carrier = o.carrier.q0 - o.carrier.Kq * a_B + o.carrier_tip.Rq * F; // (6)
        Ok(Accelerations {
            q_lower: o.lower.q0 + o.lower_tip.Rq * F_B,
            q_carrier,
            q_upper: o.upper.q0 - o.upper_tip.Rq * F,
            a_B,
            a_C: a_B + k.C.J * q_carrier + k.C.c,
            a_P: a_B + k.P.J * q_carrier + k.P.c,
            F_A: o.lower_tip.G * F_B + o.lower.f, // (10)
            F_D: o.upper.f - o.upper_tip.G * F,
            F_B,
            F_C: F,
            closure: Some(closure),
        })
    }

    /// The open chain of three with the force `F_D` on the upper link at D.
    fn accelerate_chain<S: Scalar>(
        &self,
        k: &KinematicsOf<S, D, NA, NC, A, C>,
        loads: &Loads<S, D>,
        strut_force: Option<Vector<S, D>>,
        F_D: Vector<S, D>,
    ) -> Result<Accelerations<S, D, NA, NC>, EvaluationError> {
        let upper = self.hang_upper(k, loads, strut_force, Some(F_D))?;
        let (body, carrier) = self.inner(
            k,
            loads,
            Some(Load {
                F: upper.f,
                M: Some(upper.M),
            }),
        )?;
        let weight = loads.field.map(|g| (&body.com, Force::load(g * body.m)));
        let outer = Some((
            &k.B,
            Load {
                F: carrier.f,
                M: Some(carrier.M),
            },
        ));
        let lower = Hinged::new(&body, [weight, outer]).map_err(|source| EvaluationError::Inertia {
            element: "lower link",
            source,
        })?;
        let a_B = k.B.J * lower.q0 + k.B.c;
        let q_carrier = carrier.q0 - carrier.Kq * a_B;
        let a_C = a_B + k.C.J * q_carrier + k.C.c;
        Ok(Accelerations {
            q_lower: lower.q0,
            q_carrier,
            q_upper: upper.q0 - upper.Kq * a_C,
            a_B,
            a_C,
            a_P: a_B + k.P.J * q_carrier + k.P.c,
            F_A: lower.f,
            F_D: -F_D,
            F_B: carrier.f - carrier.M * a_B,
            F_C: upper.f - upper.M * a_C,
            closure: None,
        })
    }

    /// Rates of the energy integrals (21): dissipated, supplied, port.
    #[inline]
    pub(super) fn powers<S: Scalar>(
        &self,
        k: &KinematicsOf<S, D, NA, NC, A, C>,
        loads: &Loads<S, D>,
        a: &Accelerations<S, D, NA, NC>,
        chassis_a: &Vector<S, D>,
    ) -> [S; 3] {
        let mut dissipated = self.strut.dissipation(k.strut.l_dot);
        if let (Some(tie), Some((_, state))) = (&self.tie, &k.tie) {
            dissipated += tie.dissipation(state.l_dot);
        }
        if let Some((_, c)) = self.bushing() {
            dissipated += k.gap_rate.dot(&k.gap_rate) * c;
        }
        let v_P = k.B.v + k.P.v;
        let port = loads.port.map_or(S::lift(0.0), |l| {
            let F = l.M.map_or(l.F, |M| l.F - M * a.a_P);
            F.dot(&v_P)
        });
        let mut supplied = port;
        if let Some(F) = &loads.internal {
            supplied += F.dot(&v_P);
        }
        if !chassis_a.iter().all(|a| a.vanishes()) {
            supplied -= chassis_a.dot(&self.momentum(k));
        }
        [dissipated, supplied, port]
    }

    /// Velocities of the centres of mass: lower, carrier, upper.
    fn com_velocities<S: Scalar>(&self, k: &KinematicsOf<S, D, NA, NC, A, C>) -> [Vector<S, D>; 3] {
        let c_upper = if self.bushing().is_some() {
            self.upper.c - self.r_DC
        } else {
            self.upper.c
        };
        [
            k.lower.point(&self.lower.c).v,
            k.B.v + k.carrier.point(&self.carrier.c).v,
            k.root.1 + k.upper.point(&c_upper).v,
        ]
    }

    fn momentum<S: Scalar>(&self, k: &KinematicsOf<S, D, NA, NC, A, C>) -> Vector<S, D> {
        let [lower, carrier, upper] = self.com_velocities(k);
        lower * S::lift(self.lower.m) + carrier * S::lift(self.carrier.m) + upper * S::lift(self.upper.m)
    }

    /// Kinetic and potential energy (21).
    pub(super) fn energies<S: Scalar>(&self, k: &KinematicsOf<S, D, NA, NC, A, C>) -> (S, S) {
        let [lower, carrier, upper] = self.com_velocities(k);
        let kinetic = (lower.dot(&lower) * self.lower.m
            + carrier.dot(&carrier) * self.carrier.m
            + upper.dot(&upper) * self.upper.m)
            * 0.5
            + k.lower.spin_energy(&self.lower)
            + k.carrier.spin_energy(&self.carrier)
            + k.upper.spin_energy(&self.upper);
        let mut potential = self.strut.energy(k.strut.l);
        if let (Some(tie), Some((_, state))) = (&self.tie, &k.tie) {
            potential += tie.energy(state.l);
        }
        if let Some((stiffness, _)) = self.bushing() {
            potential += k.gap.dot(&k.gap) * (0.5 * stiffness);
        }
        if let Some(g) = self.gravity {
            let c_upper = if self.bushing().is_some() {
                self.upper.c - self.r_DC
            } else {
                self.upper.c
            };
            let moment = (self.r_A.map(S::lift) + k.lower.point(&self.lower.c).r) * S::lift(self.lower.m)
                + (k.r_B + k.carrier.point(&self.carrier.c).r) * S::lift(self.carrier.m)
                + (k.root.0 + k.upper.point(&c_upper).r) * S::lift(self.upper.m);
            potential -= g.map(S::lift).dot(&moment);
        }
        (kinetic, potential)
    }
}

/// Mobility of the loop at C and the changes of velocity that a closing impulse makes (20).
impl<S: Scalar, const D: usize, const NA: usize, const NC: usize> OpenLoop<S, D, NA, NC> {
    pub(super) fn mobility(&self) -> Matrix<S, D, D> {
        self.chain.Y + self.upper_tip.Y
    }

    /// (lower, carrier, upper) answer to the pair of forces F at C.
    #[allow(clippy::type_complexity, reason = "three elements")]
    pub(super) fn response(&self, F: &Vector<S, D>) -> (Vector<S, NA>, Vector<S, NC>, Vector<S, NA>) {
        let (a_B, F_B) = self.chain.response(F);
        (
            self.lower_tip.Rq * F_B,
            self.carrier_tip.Rq * F - self.carrier.Kq * a_B,
            -(self.upper_tip.Rq * F),
        )
    }
}
