#![doc = include_str!("operator_arm.md")]

use mechanics::Scalar;
use model::{
    Dense, Documentation, EvaluationError, Experiment, Model, ParameterError, PlanarTensor, System, Vector2,
    Visitor,
};
use serde::{Deserialize, Serialize};

use super::arm_variables::{Dynamics, Energy, Inertia, Inputs, Intent, Motion, Parameters};
use crate::min_jerk::{MinJerk, Moved, next_of};

/// A hand on an arm that holds a handle.
#[derive(Debug, Clone)]
pub struct Arm {
    p: Parameters,
    /// Intended motion of the hand, by component
    intent: [MinJerk; 2],
}

/// Where intention and grip stand.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Hold {
    /// Time of the next kink of the intention; infinite: none [s]
    next: f64,
    /// Last value of `grip.enabled`
    enabled: f64,
}

impl Default for Hold {
    fn default() -> Self {
        Self { next: f64::INFINITY, enabled: 1.0 }
    }
}

/// The arm at a moment.
struct Held<S> {
    r: Vector2<S>,
    v: Vector2<S>,
    /// Intended motion
    r_int: Vector2<S>,
    v_int: Vector2<S>,
    /// Force of the hand on the handle [N]
    F_H: Vector2<S>,
    /// Force of the arm on the hand, of its damper alone [N]
    F_arm: Vector2<S>,
    F_damper: Vector2<S>,
}

impl Arm {
    fn intended<S: Scalar>(&self, t: S, u: &Inputs<S>) -> [Vector2<S>; 2] {
        match self.p.kind {
            Intent::Input => [u.r_int, u.v_int],
            Intent::MinJerk => {
                let [x, z]: [Moved<S>; 2] = self.intent.map(|law| law.at(t));
                [Vector2::new(x.r, z.r), Vector2::new(x.v, z.v)]
            }
        }
    }

    #[inline]
    fn held<S: Scalar>(&self, t: S, x: &[S; 7], u: &Inputs<S>) -> Held<S> {
        let [x_a, z_a, v_x, v_z, ..] = *x;
        let (r, v) = (Vector2::new(x_a, z_a), Vector2::new(v_x, v_z));
        let [r_int, v_int] = self.intended(t, u);
        let F_H = ((r - u.r) * S::lift(self.p.k_g) + (v - u.v) * S::lift(self.p.b_g)) * u.enabled; // (20)
        let F_damper = (v_int - v) * S::lift(self.p.b_a);
        let F_arm = (r_int - r) * S::lift(self.p.k_a) + F_damper;
        Held { r, v, r_int, v_int, F_H, F_arm, F_damper }
    }

    fn next_kink(&self, t: f64) -> f64 {
        match self.p.kind {
            Intent::Input => f64::INFINITY,
            Intent::MinJerk => next_of(self.intent[0].kinks().into_iter(), t),
        }
    }
}

impl Model for Arm {
    const NAME: &'static str = "operator_arm";
    const DESCRIPTION: &'static str =
        "Hand and arm of an operator who holds a handle and moves it by intention";
    const EXPERIMENT: Experiment = Experiment { stop: 1.0, step: 0.001 };
    const DOCUMENTATION: Documentation = model::documentation!(
        "operator_arm",
        inputs,
        plots = [
            ("Height of the hand", ["hand.r.z"]),
            ("Force on the handle", ["H.F.z"]),
            ("Energies", ["energy.supplied", "energy.dissipated", "energy.potential"])
        ]
    );
    type Parameters = Parameters;
    type Inputs<S: Scalar> = Inputs<S>;
    type Motion<S: Scalar> = Motion<S>;
    type Inertia<S: Scalar> = Inertia<S>;
    type Dynamics<S: Scalar> = Dynamics<S>;
    type Energy<S: Scalar> = Energy<S>;
    type Discrete = Hold;

    fn new(p: &Parameters, _start: &Motion<f64>) -> Result<Self, ParameterError> {
        let law = |start, end| MinJerk { start, end, t0: p.t0, duration: p.duration };
        Ok(Self { p: *p, intent: [law(p.from.x, p.to.x), law(p.from.y, p.to.y)] })
    }

    fn retune(&mut self, p: &Parameters) {
        (self.p.k_g, self.p.b_g) = (p.k_g, p.b_g);
    }

    fn with_system<V: Visitor<Self>>(&self, visitor: V) -> V::Output {
        visitor.visit::<7, 0, _>(self)
    }
}

impl System<7, 0> for Arm {
    type Model = Self;
    type Spectrum = Dense;

    fn start(&self, t: f64, _given: &Motion<f64>) -> Result<([f64; 7], Hold), ParameterError> {
        let Parameters { start: r, start_v: v, .. } = &self.p;
        Ok(([r.x, r.y, v.x, v.y, 0.0, 0.0, 0.0], Hold { next: self.next_kink(t), ..Hold::default() }))
    }

    #[inline]
    fn rates<S: Scalar>(
        &self,
        t: S,
        x: &[S; 7],
        u: &Inputs<S>,
        _d: &Hold,
    ) -> Result<[S; 7], EvaluationError> {
        let Held { v, v_int, F_H, F_arm, F_damper, .. } = self.held(t, x, u);
        let a = (F_arm + u.F_vol - F_H) / S::lift(self.p.m_a);
        if !self.p.use_energy {
            let zero = S::lift(0.0);
            return Ok([v.x, v.y, a.x, a.y, zero, zero, zero]);
        }
        let port = -F_H.dot(&u.v);
        let grip = v - u.v;
        let heat = F_damper.dot(&(v_int - v)) + grip.norm_squared() * u.enabled * self.p.b_g;
        let supplied = F_arm.dot(&v_int) + u.F_vol.dot(&v) + port;
        Ok([v.x, v.y, a.x, a.y, heat, supplied, port])
    }

    fn motion<S: Scalar>(
        &self,
        t: S,
        x: &[S; 7],
        u: &Inputs<S>,
        _d: &Hold,
    ) -> Result<Motion<S>, EvaluationError> {
        let Held { r, v, .. } = self.held(t, x, u);
        Ok(Motion { r, v })
    }

    fn inertia<S: Scalar>(
        &self,
        t: S,
        x: &[S; 7],
        u: &Inputs<S>,
        _d: &Hold,
    ) -> Result<Inertia<S>, EvaluationError> {
        Ok(Inertia { F0: self.held(t, x, u).F_H, M: PlanarTensor::zero() })
    }

    fn dynamics<S: Scalar>(
        &self,
        t: S,
        x: &[S; 7],
        u: &Inputs<S>,
        _d: &Hold,
    ) -> Result<Dynamics<S>, EvaluationError> {
        Ok(Dynamics { F: self.held(t, x, u).F_H })
    }

    fn energy<S: Scalar>(
        &self,
        t: S,
        x: &[S; 7],
        u: &Inputs<S>,
        _d: &Hold,
    ) -> Result<Energy<S>, EvaluationError> {
        let Held { r, v, r_int, .. } = self.held(t, x, u);
        let [.., dissipated, supplied, port] = *x;
        let grip = (r - u.r).norm_squared() * u.enabled * (0.5 * self.p.k_g);
        let potential = (r - r_int).norm_squared() * (0.5 * self.p.k_a) + grip;
        let kinetic = v.norm_squared() * (0.5 * self.p.m_a);
        Ok(Energy { kinetic, potential, dissipated, supplied, port })
    }

    fn state_names(&self) -> [String; 7] {
        [
            "hand.r.x",
            "hand.r.z",
            "hand.v.x",
            "hand.v.z",
            "energy.dissipated",
            "energy.supplied",
            "energy.port",
        ]
        .map(String::from)
    }

    fn nominals(&self) -> [f64; 7] {
        const NONE: f64 = f64::INFINITY;
        [1.0, 1.0, 1.0, 1.0, NONE, NONE, NONE]
    }

    fn next_event(&self, d: &Hold) -> Option<f64> {
        d.next.is_finite().then_some(d.next)
    }

    fn begin(&self, _x: &[f64; 7], u: &Inputs<f64>, d: &Hold) -> Hold {
        Hold { enabled: u.enabled, ..*d }
    }

    fn update(&self, t: f64, x: &mut [f64; 7], u: &Inputs<f64>, d: &Hold) -> Hold {
        Hold { next: self.next_kink(t), ..self.revise(t, x, u, d) }
    }

    /// A grip that lets go loses its elastic energy as heat; one that takes hold of a distant handle gets it from the hand.
    fn revise(&self, _t: f64, x: &mut [f64; 7], u: &Inputs<f64>, d: &Hold) -> Hold {
        let [x_a, z_a, .., dissipated, supplied, _] = x;
        if self.p.use_energy {
            let stretch = Vector2::new(*x_a, *z_a) - u.r;
            let stored = stretch.norm_squared() * (0.5 * self.p.k_g);
            *dissipated += (d.enabled - u.enabled).max(0.0) * stored;
            *supplied += (u.enabled - d.enabled).max(0.0) * stored;
        }
        Hold { enabled: u.enabled, ..*d }
    }
}
