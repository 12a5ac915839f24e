#![doc = include_str!("virtual_wall.md")]

use mechanics::{Scalar, tanh};
use model::{
    Dense, Documentation, EvaluationError, Experiment, Model, NoVariables, ParameterError, SymmetricTensor,
    System, Variables, Vector3, Visitor,
};

/// Tangential speed at which friction has reached tanh(1) of its value [m/s]
const SMOOTHING: f64 = 1e-3;
/// Shortest normal that has a direction
const SHORTEST: f64 = 1e-12;

/// Parameters of a wall.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(parameter)]
pub struct Parameters {
    /// Normal, out of the solid; any length but zero
    #[var(name = "normal", start = [0.0, 0.0, 1.0])]
    pub n: Vector3<f64>,
    /// A point of the surface [m]
    #[var(name = "point", start = [0.0, 0.0, 0.57])]
    pub r_w: Vector3<f64>,
    /// Stiffness [N/m]
    #[var(name = "stiffness", start = 2e4, min = 0.0, max = 1e8, tunable)]
    pub K: f64,
    /// Damping [N.s/m]
    #[var(name = "damping", start = 0.0, min = 0.0, tunable)]
    pub B: f64,
    /// Coefficient of friction
    #[var(name = "friction", start = 0.0, min = 0.0, tunable)]
    pub mu: f64,
    /// Energy integrals
    #[var(name = "use.energy", start = true)]
    pub use_energy: bool,
}

/// Inputs of a wall: the motion of its leader.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(input)]
pub struct Inputs<S> {
    /// Position of the point that meets the wall [m]
    #[var(name = "A.r")]
    pub r: Vector3<S>,
    /// Velocity of the point that meets the wall [m/s]
    #[var(name = "A.v")]
    pub v: Vector3<S>,
}

const MOVING: &[&str] = &["A.r", "A.v"];

/// What the leader has to carry.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Inertia<S> {
    /// Force on the leader; the same as A.F [N]
    #[var(name = "A.F0", nominal = 1e1, depends = MOVING)]
    pub F0: Vector3<S>,
    /// Inertia behind port A: always zero [kg]
    #[var(name = "A.M")]
    pub M: SymmetricTensor<S>,
}

/// The force.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Dynamics<S> {
    /// Force on the leader [N]
    #[var(name = "A.F", nominal = 1e1, depends = MOVING)]
    pub F: Vector3<S>,
    /// Depth of the point below the surface, negative outside [m]
    #[var(name = "penetration", nominal = 1e-3, depends = ["A.r"])]
    pub penetration: S,
}

/// Energies; kinetic is always zero.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(output)]
pub struct Energy<S> {
    /// Kinetic energy: always zero [J]
    #[var(name = "energy.kinetic")]
    pub kinetic: S,
    /// Energy of the compressed wall [J]
    #[var(name = "energy.potential", depends = ["A.r"])]
    pub potential: S,
    /// Energy turned into heat since the start [J]
    #[var(name = "energy.dissipated", state, rate_depends = MOVING)]
    pub dissipated: S,
    /// Work of the leader on the wall since the start [J]
    #[var(name = "energy.supplied", state, rate_depends = MOVING)]
    pub supplied: S,
    /// The same: all of it comes through the port [J]
    #[var(name = "energy.port", depends = ["energy.supplied"])]
    pub port: S,
}

/// A half space that pushes back.
#[derive(Debug, Clone)]
pub struct Wall(Parameters);

/// A point at the wall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact<S> {
    /// Depth below the surface [m]
    pub penetration: S,
    /// Force on the point [N]
    pub F: Vector3<S>,
}

impl Wall {
    /// Depth and force at a point.
    #[inline]
    pub fn contact<S: Scalar>(&self, r: &Vector3<S>, v: &Vector3<S>) -> Contact<S> {
        let Parameters { n, r_w, K, B, mu, .. } = &self.0;
        let n = n.map(S::lift);
        let penetration = -n.dot(&(r - r_w.map(S::lift)));
        if penetration.re() <= 0.0 {
            return Contact { penetration, F: Vector3::zeros() };
        }
        let v_n = n.dot(v);
        let F_n = (penetration * *K - v_n * *B).max(S::lift(0.0));
        let v_t = v - n * v_n;
        let speed = v_t.norm_squared().sqrt();
        if speed.re() <= 0.0 {
            let F_t = v_t * (F_n * (-mu / SMOOTHING)); // the limit at rest
            return Contact { penetration, F: n * F_n + F_t };
        }
        let F_t = v_t * (-F_n * *mu * tanh(speed / SMOOTHING) / speed);
        Contact { penetration, F: n * F_n + F_t }
    }
}

impl Model for Wall {
    const NAME: &'static str = "virtual_wall";
    const DESCRIPTION: &'static str = "Half space with stiffness, damping and friction, for a leader at A";
    const EXPERIMENT: Experiment = Experiment { stop: 1.0, step: 0.001 };
    const DOCUMENTATION: Documentation = model::documentation!(
        "virtual_wall",
        inputs,
        plots = [
            ("Force on the leader", ["A.F.z"]),
            ("Energies", ["energy.potential", "energy.dissipated", "energy.supplied"])
        ]
    );
    type Parameters = Parameters;
    type Inputs<S: Scalar> = Inputs<S>;
    type Motion<S: Scalar> = NoVariables;
    type Inertia<S: Scalar> = Inertia<S>;
    type Dynamics<S: Scalar> = Dynamics<S>;
    type Energy<S: Scalar> = Energy<S>;
    type Discrete = ();

    fn new(p: &Parameters, _start: &NoVariables) -> Result<Self, ParameterError> {
        let length = p.n.norm();
        if length < SHORTEST {
            let allowed = format!("|normal| >= {SHORTEST:e}");
            return Err(ParameterError::refused("normal.z", p.n.z, "the normal has no direction", allowed));
        }
        Ok(Self(Parameters { n: p.n / length, ..*p }))
    }

    fn retune(&mut self, p: &Parameters) {
        (self.0.K, self.0.B, self.0.mu) = (p.K, p.B, p.mu);
    }

    fn with_system<V: Visitor<Self>>(&self, visitor: V) -> V::Output {
        visitor.visit::<2, 0, _>(self)
    }
}

impl System<2, 0> for Wall {
    type Model = Self;
    type Spectrum = Dense;

    fn start(&self, _t: f64, _given: &NoVariables) -> Result<([f64; 2], ()), ParameterError> {
        Ok(([0.0; 2], ()))
    }

    fn rates<S: Scalar>(
        &self,
        _t: S,
        _x: &[S; 2],
        u: &Inputs<S>,
        _d: &(),
    ) -> Result<[S; 2], EvaluationError> {
        let zero = S::lift(0.0);
        if !self.0.use_energy {
            return Ok([zero; 2]);
        }
        let Contact { penetration, F } = self.contact(&u.r, &u.v);
        let supplied = -F.dot(&u.v);
        let stored = -u.v.dot(&self.0.n.map(S::lift)) * penetration.max(zero) * self.0.K;
        Ok([supplied - stored, supplied])
    }

    fn motion<S: Scalar>(
        &self,
        _t: S,
        _x: &[S; 2],
        _u: &Inputs<S>,
        _d: &(),
    ) -> Result<NoVariables, EvaluationError> {
        Ok(NoVariables)
    }

    fn inertia<S: Scalar>(
        &self,
        _t: S,
        _x: &[S; 2],
        u: &Inputs<S>,
        _d: &(),
    ) -> Result<Inertia<S>, EvaluationError> {
        Ok(Inertia { F0: self.contact(&u.r, &u.v).F, M: SymmetricTensor::zero() })
    }

    fn dynamics<S: Scalar>(
        &self,
        _t: S,
        _x: &[S; 2],
        u: &Inputs<S>,
        _d: &(),
    ) -> Result<Dynamics<S>, EvaluationError> {
        let Contact { penetration, F } = self.contact(&u.r, &u.v);
        Ok(Dynamics { F, penetration })
    }

    fn energy<S: Scalar>(
        &self,
        _t: S,
        x: &[S; 2],
        u: &Inputs<S>,
        _d: &(),
    ) -> Result<Energy<S>, EvaluationError> {
        let [dissipated, supplied] = *x;
        let zero = S::lift(0.0);
        let p = self.contact(&u.r, &u.v).penetration.max(zero);
        Ok(Energy {
            kinetic: zero,
            potential: p * p * (0.5 * self.0.K),
            dissipated,
            supplied,
            port: supplied,
        })
    }

    fn state_names(&self) -> [String; 2] {
        ["energy.dissipated", "energy.supplied"].map(String::from)
    }
}
