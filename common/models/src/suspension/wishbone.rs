//! Equations of the double wishbone: an assembly of three elements, in the plane or in space.
//!
//! ```text
//! rigid:    A -> lower link -> B -> carrier -> C  closed with  D -> upper link -> C      (18)
//! bushing:  A -> lower link -> B -> carrier -> C -> upper link, at D the force -k d - c d'
//! ```
//!
//! Chassis acceleration: the roots rest in the chassis frame, and every body carries the load
//! `-m a_ch` beside its weight.

use mechanics::{
    Accelerations, Assembly, AssemblyError, Baumgarte, Dim, Gap, Load, Matrix, Point, Pose, Scalar, Space,
    SpringDamper, SpringState, Tree, Vector,
};
use model::EvaluationError;

use super::coordinates::Coordinates;
use super::variables::Inputs;
use crate::force_law::{LoadLaw, PulsePhase};
use crate::port::slots;

/// Numbers of the elements.
pub(super) const LOWER: usize = 0;
pub(super) const CARRIER: usize = 1;
pub(super) const UPPER: usize = 2;

/// How the loop is closed and held.
#[derive(Debug, Clone, Copy)]
pub(super) enum Closing {
    /// Exactly, without terms against drift
    Rigid,
    /// Exactly, with Baumgarte's terms (19)
    Baumgarte(Baumgarte),
    /// Exactly, projected after each step (20)
    Projection,
    /// Bushing at D
    Bushing { k: f64, c: f64 },
}

/// Constants of the double wishbone in the space of dimension `D`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wishbone<J, const D: usize, const N: usize> {
    pub(super) assembly: Assembly<J, D, N, 3, 1, 1>,
    /// The same with the loop closed rigidly, for a consistent start
    pub(super) rigid: Assembly<J, D, N, 3, 1, 1>,
    /// Body vectors of P and of the tie rod's end R on the carrier, from B
    pub(super) r_BP: Vector<f64, D>,
    pub(super) r_BR: Vector<f64, D>,
    /// Body vector of the strut's foot S on the upper link, from its joint
    pub(super) r_S: Vector<f64, D>,
    /// Body vector of the upper link's chassis end with a bushing, from C
    pub(super) r_CD: Vector<f64, D>,
    /// Chassis points: the joints A and D, the strut top, the end of the tie rod
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
pub(super) struct Kinematics<S, K, const D: usize, const N: usize> {
    pub(super) elements: K,
    pub(super) gaps: [Gap<S, D, N>; 1],
    pub(super) P: Point<S, D, N>,
    pub(super) C: Point<S, D, N>,
    pub(super) foot: Point<S, D, N>,
    /// The chassis end of the upper link, with a bushing
    pub(super) end: Point<S, D, N>,
    pub(super) gap: Vector<S, D>,
    pub(super) gap_rate: Vector<S, D>,
    pub(super) strut: SpringState<S, D>,
    pub(super) tie: Option<(Point<S, D, N>, SpringState<S, D>)>,
}

/// Kinematics with the poses of the joint kind `J`.
pub(super) type KinematicsOf<S, J, const D: usize, const N: usize> =
    Kinematics<S, mechanics::KinematicsOf<S, J, D, N, 3>, D, N>;

/// Loads at P and on all bodies.
pub(super) struct Loads<S, const D: usize> {
    /// Sum of the slots
    pub(super) port: Option<Load<S, D>>,
    pub(super) internal: Option<Vector<S, D>>,
    /// Gravity minus chassis acceleration
    pub(super) field: Option<Vector<S, D>>,
}

/// Names of the elements for messages.
pub(super) fn named(error: AssemblyError) -> EvaluationError {
    match error {
        AssemblyError::Inertia { element, source } => {
            EvaluationError::Inertia { element: ["lower link", "carrier", "upper link"][element], source }
        }
        AssemblyError::Closure(closure) => closure.into(),
    }
}

impl<J, const D: usize, const N: usize> Wishbone<J, D, N>
where
    J: Coordinates<D, N>,
    Dim<D>: Space<D>,
{
    #[inline]
    pub(super) fn bushing(&self) -> Option<(f64, f64)> {
        match self.closing {
            Closing::Bushing { k, c } => Some((k, c)),
            _ => None,
        }
    }

    /// Position of a root point.
    #[inline]
    pub(super) fn root(&self, number: usize) -> Vector<f64, D> {
        if number == 0 { self.r_A } else { self.r_D }
    }

    /// Positions and velocities.
    #[inline]
    pub(super) fn kinematics<S: Scalar>(&self, x: &[S]) -> Result<KinematicsOf<S, J, D, N>, EvaluationError> {
        let elements =
            self.assembly.kinematics(x, |number| (self.root(number).map(S::lift), Vector::zeros()));
        let P = elements.poses[CARRIER].point(&self.r_BP);
        let foot = elements.poses[UPPER].point(&self.r_S);
        let gaps = self.assembly.gaps(&elements);
        let (C, end, gap, gap_rate) = if self.bushing().is_some() {
            let end = elements.poses[UPPER].point(&self.r_CD);
            let (r, v) = elements.motion(UPPER, &end);
            (elements.hangs_at[UPPER], end, r - self.r_D.map(S::lift), v)
        } else {
            (gaps[0].first, Point::zero(), gaps[0].r, gaps[0].v)
        };
        let (r_S, v_S) = elements.motion(UPPER, &foot);
        let strut = span(&self.strut, "strut length", &(self.r_T.map(S::lift) - r_S), &-v_S)?;
        let tie = match &self.tie {
            None => None,
            Some(tie) => {
                let R = elements.poses[CARRIER].point(&self.r_BR);
                let (r_R, v_R) = elements.motion(CARRIER, &R);
                Some((R, span(tie, "tie rod length", &(self.r_tie.map(S::lift) - r_R), &-v_R)?))
            }
        };
        Ok(Kinematics { elements, gaps, P, C, foot, end, gap, gap_rate, strut, tie })
    }

    /// Loads from inputs and time.
    #[inline]
    pub(super) fn loads<S: Scalar>(&self, t: S, u: &Inputs<S>, pulse: PulsePhase) -> Loads<S, D> {
        let a_ch = Dim::<D>::restrict(&u.chassis_a);
        let moving = !a_ch.iter().all(|a| a.vanishes());
        let field = match self.gravity {
            Some(g) => Some(g.map(S::lift) - a_ch),
            None => moving.then_some(-a_ch),
        };
        Loads { port: slots(&[&u.P, &u.P_2]), internal: self.load.map(|law| law.force(t, pulse)), field }
    }

    /// The elements under their loads, open at C.
    #[inline]
    fn tree<S: Scalar>(
        &self,
        k: &KinematicsOf<S, J, D, N>,
        loads: &Loads<S, D>,
    ) -> Result<Tree<S, D, N, 3>, EvaluationError> {
        let bodies = self.assembly.bodies(&k.elements);
        let tree = self.assembly.tree(
            &k.elements,
            &bodies,
            |i, element| {
                if let Some(g) = &loads.field {
                    element.add(&bodies[i].com, &Load::force(g * bodies[i].m));
                }
                if i == CARRIER {
                    if let Some(port) = &loads.port {
                        element.add(&k.P, port);
                    }
                    if let Some(F) = &loads.internal {
                        element.add(&k.P, &Load::force(*F));
                    }
                    if let Some((R, tie)) = &k.tie {
                        element.add(R, &Load::force(tie.e * tie.F_s));
                    }
                } else if i == UPPER {
                    element.add(&k.foot, &Load::force(k.strut.e * k.strut.F_s));
                    if self.bushing().is_some() {
                        element.add(&k.end, &Load::force(self.bushing_force(k)));
                    }
                }
            },
            None,
        );
        tree.map_err(named)
    }

    /// Matrix of the closing joint, Y1 + Y2 of (18).
    pub(super) fn closure_matrix<S: Scalar>(
        &self,
        k: &KinematicsOf<S, J, D, N>,
        loads: &Loads<S, D>,
    ) -> Result<Matrix<S, D, D>, EvaluationError> {
        Ok(*self.assembly.mobility(&k.elements, &self.tree(k, loads)?, &k.gaps).diagonal(0))
    }

    /// Accelerations and forces under the given loads.
    #[inline]
    pub(super) fn accelerate<S: Scalar>(
        &self,
        k: &KinematicsOf<S, J, D, N>,
        loads: &Loads<S, D>,
    ) -> Result<Accelerations<S, D, N, 3, 1>, EvaluationError> {
        let tree = self.tree(k, loads)?;
        let baumgarte = match self.closing {
            Closing::Baumgarte(terms) => Some(terms),
            _ => None,
        };
        self.assembly.accelerate(&k.elements, tree, &k.gaps, |_| Vector::zeros(), baumgarte).map_err(named)
    }

    /// Force of the bushing on the upper link at D.
    #[inline]
    pub(super) fn bushing_force<S: Scalar>(&self, k: &KinematicsOf<S, J, D, N>) -> Vector<S, D> {
        self.bushing().map_or(Vector::zeros(), |(stiffness, damping)| {
            -k.gap * S::lift(stiffness) - k.gap_rate * S::lift(damping)
        })
    }

    /// Rates of the energy integrals (21): dissipated, supplied, port.
    #[inline]
    pub(super) fn powers<S: Scalar>(
        &self,
        k: &KinematicsOf<S, J, D, N>,
        loads: &Loads<S, D>,
        a: &Accelerations<S, D, N, 3, 1>,
        chassis_a: &Vector<S, D>,
    ) -> [S; 3] {
        let mut dissipated = self.strut.dissipation(k.strut.l_dot);
        if let (Some(tie), Some((_, state))) = (&self.tie, &k.tie) {
            dissipated += tie.dissipation(state.l_dot);
        }
        if let Some((_, c)) = self.bushing() {
            dissipated += k.gap_rate.dot(&k.gap_rate) * c;
        }
        let v_P = k.elements.v[CARRIER] + k.P.v;
        let port = loads.port.map_or(S::lift(0.0), |l| {
            let F = l.M.map_or(l.F, |M| l.F - M * a.at(CARRIER, &k.P));
            F.dot(&v_P)
        });
        let mut supplied = port;
        if let Some(F) = &loads.internal {
            supplied += F.dot(&v_P);
        }
        if !chassis_a.iter().all(|a| a.vanishes()) {
            supplied -= chassis_a.dot(&self.assembly.momentum(&k.elements));
        }
        [dissipated, supplied, port]
    }

    /// Kinetic and potential energy (21).
    pub(super) fn energies<S: Scalar>(&self, k: &KinematicsOf<S, J, D, N>) -> (S, S) {
        let mut potential = self.strut.energy(k.strut.l);
        if let (Some(tie), Some((_, state))) = (&self.tie, &k.tie) {
            potential += tie.energy(state.l);
        }
        if let Some((stiffness, _)) = self.bushing() {
            potential += k.gap.dot(&k.gap) * (0.5 * stiffness);
        }
        if let Some(g) = self.gravity {
            potential -= g.map(S::lift).dot(&self.assembly.mass_moment(&k.elements));
        }
        (self.assembly.kinetic_energy(&k.elements), potential)
    }
}

/// State of a spring-damper; a vanishing length is an error with its name.
pub(super) fn span<S: Scalar, const D: usize>(
    spring: &SpringDamper,
    quantity: &'static str,
    r: &Vector<S, D>,
    v: &Vector<S, D>,
) -> Result<SpringState<S, D>, EvaluationError> {
    spring.state(r, v).ok_or_else(|| EvaluationError::Vanishes {
        quantity,
        value: r.map(S::re).norm(),
        limit: SpringDamper::SHORTEST,
    })
}
