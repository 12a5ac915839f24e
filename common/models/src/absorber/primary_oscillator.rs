#![doc = include_str!("primary_oscillator.md")]

use mechanics::{Load, Scalar};
use model::{
    Dense, Documentation, EvaluationError, Experiment, Linear, Matrix, Model, ParameterError, Spectrum,
    SymmetricTensor, System, Vector3, Visitor,
};
use serde::{Deserialize, Serialize};

use super::primary_variables::{Dynamics, Energy, Inertia, Inputs, Motion, Parameters, PortKind};
use crate::port::{along, slots};

/// Smallest mass with everything on it that can be accelerated [kg]
const SMALLEST_MASS: f64 = f64::MIN_POSITIVE;

/// A chain of one or two masses.
#[derive(Debug, Clone)]
pub struct PrimaryOscillator {
    p: Parameters,
    /// Direction of the motion, unit vector
    e: Vector3<f64>,
    /// The mass that carries the port, from 0
    port: usize,
}

/// What stays constant after initialisation.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Base {
    /// e . A.r at the end of initialisation [m]
    start: f64,
}

/// The chain at a moment.
struct Chain<S> {
    s: [S; 2],
    v: [S; 2],
    v_A: S,
    stretch: [S; 2],
    /// T_1, T_2 [N]
    T: [S; 2],
    /// Forces on the masses without slots (27) [N]
    f: [S; 2],
}

/// The slots of the port.
struct Carried<S> {
    F: Vector3<S>,
    M: Option<Matrix<S, 3, 3>>,
    /// Part of F along e, e . M e, E M e
    F_e: S,
    mu: S,
    nu: Vector3<S>,
}

impl PrimaryOscillator {
    fn dof(&self) -> usize {
        if self.p.dof == 1 { 1 } else { 2 }
    }

    fn spatial(&self) -> bool {
        self.p.kind == PortKind::Spatial
    }

    /// Mass of the chain with its root [kg]
    fn total(&self) -> f64 {
        self.p.M[..self.dof()].iter().sum::<f64>() + self.p.M_r
    }

    /// The part of a vector along e, and across it.
    fn along<S: Scalar>(&self, v: &Vector3<S>) -> S {
        along(&self.e, v)
    }

    fn across<S: Scalar>(&self, v: &Vector3<S>) -> Vector3<S> {
        v - self.direction() * self.along(v)
    }

    fn direction<S: Scalar>(&self) -> Vector3<S> {
        self.e.map(S::lift)
    }

    fn drive_omega<S: Scalar>(&self, t: S) -> S {
        t * self.p.sweep + self.p.omega_start
    }

    fn drive<S: Scalar>(&self, t: S, u: &Inputs<S>) -> S {
        if self.p.amplitude.vanishes() {
            return u.drive_force;
        }
        let angle = t * (t * (0.5 * self.p.sweep) + self.p.omega_start) + self.p.phase;
        angle.sin() * self.p.amplitude + u.drive_force
    }

    /// s_A, v_A
    fn base<S: Scalar>(&self, u: &Inputs<S>, d: Base) -> (S, S) {
        match (self.p.use_base, self.p.kind) {
            (false, _) => (S::lift(0.0), S::lift(0.0)),
            (true, PortKind::Scalar) => (u.A.s, u.A.v),
            (true, PortKind::Spatial) => (self.along(&u.A_spatial.r) - d.start, self.along(&u.A_spatial.v)),
        }
    }

    fn chain<S: Scalar>(&self, t: S, x: &[S], u: &Inputs<S>, d: Base) -> Chain<S> {
        let Parameters { K, C, K_g, C_g, .. } = &self.p;
        let zero = S::lift(0.0);
        let two = self.dof() == 2;
        let (s, v) = if two { ([x[0], x[2]], [x[1], x[3]]) } else { ([x[0], zero], [x[1], zero]) };
        let (s_A, v_A) = self.base(u, d);
        let stretch = [s[0] - s_A, if two { s[1] - s[0] } else { zero }];
        let rate = [v[0] - v_A, if two { v[1] - v[0] } else { zero }];
        let T = [0, 1].map(|i| rate[i] * C[i] + stretch[i] * K[i]);
        let mut f = [T[1] - T[0] - s[0] * *K_g - v[0] * *C_g, -T[1]];
        f[usize::from(self.p.drive_mass == 2)] += self.drive(t, u);
        Chain { s, v, v_A, stretch, T, f }
    }

    fn carried<S: Scalar>(&self, u: &Inputs<S>) -> Carried<S> {
        let zero = S::lift(0.0);
        if !self.spatial() {
            let (F, mu) = (u.P.F + u.P_2.F, u.P.M + u.P_2.M);
            return Carried { F: Vector3::zeros(), M: None, F_e: F, mu, nu: Vector3::zeros() };
        }
        let Load { F, M } = slots(&[&u.P_spatial, &u.P_2_spatial]).unwrap_or(Load::force(Vector3::zeros()));
        let F_e = self.along(&F);
        let Some(m) = &M else {
            return Carried { F, M, F_e, mu: zero, nu: Vector3::zeros() };
        };
        let M_e = m * self.direction::<S>();
        Carried { F, M, F_e, mu: self.along(&M_e), nu: self.across(&M_e) }
    }

    /// Acceleration of the base across e.
    fn a_A<S: Scalar>(&self, u: &Inputs<S>) -> Vector3<S> {
        if self.p.use_base && self.spatial() { u.A_spatial.a } else { Vector3::zeros() }
    }

    /// s_1'', s_2'' (27), (28)
    fn accelerated<S: Scalar>(
        &self,
        chain: &Chain<S>,
        carried: &Carried<S>,
        a_A: &Vector3<S>,
    ) -> Result<[S; 2], EvaluationError> {
        let (m, s_p0) = self.port_mass(chain, carried)?;
        let mut a = [0, 1].map(|i| chain.f[i] / self.p.M[i]);
        a[self.port] = s_p0 - carried.nu.dot(a_A) / m;
        Ok(a)
    }

    /// m' and s_p0''
    fn port_mass<S: Scalar>(
        &self,
        chain: &Chain<S>,
        carried: &Carried<S>,
    ) -> Result<(S, S), EvaluationError> {
        let m = carried.mu + self.p.M[self.port];
        if m.re() < SMALLEST_MASS {
            let quantity = "mass at P with the slots' inertia";
            return Err(EvaluationError::Vanishes { quantity, value: m.re(), limit: SMALLEST_MASS });
        }
        Ok((m, (chain.f[self.port] + carried.F_e) / m))
    }

    /// Velocity and acceleration of P in space.
    fn v_P<S: Scalar>(&self, chain: &Chain<S>, u: &Inputs<S>) -> Vector3<S> {
        let along = self.direction() * chain.v[self.port];
        if self.p.use_base { self.across(&u.A_spatial.v) + along } else { along }
    }

    fn a_P<S: Scalar>(&self, a: &[S; 2], a_A: &Vector3<S>) -> Vector3<S> {
        self.across(a_A) + self.direction() * a[self.port]
    }

    fn weight<S: Scalar>(&self) -> Vector3<S> {
        self.p.gravity.map(|g| S::lift(g * self.total()))
    }

    /// True load of the slots in space.
    fn load<S: Scalar>(carried: &Carried<S>, a_P: &Vector3<S>) -> Vector3<S> {
        carried.M.map_or(carried.F, |M| carried.F - M * a_P)
    }

    /// A.F in space.
    fn spatial_force<S: Scalar>(
        &self,
        chain: &Chain<S>,
        carried: &Carried<S>,
        a: &[S; 2],
        a_A: &Vector3<S>,
    ) -> Vector3<S> {
        let load = Self::load(carried, &self.a_P(a, a_A));
        let masses = self.total() - self.p.M_r;
        self.weight() + self.direction() * chain.T[0] + self.across(&load)
            - a_A * S::lift(self.p.M_r)
            - self.across(a_A) * S::lift(masses)
    }

    /// Power through the ports [W].
    fn port_power<S: Scalar>(&self, chain: &Chain<S>, carried: &Carried<S>, a: &[S; 2], u: &Inputs<S>) -> S {
        if !self.spatial() {
            let v_p = chain.v[self.port];
            let slots = (carried.F_e - carried.mu * a[self.port]) * v_p;
            let base =
                if self.p.use_base { (u.A.a * self.p.M_r - chain.T[0]) * chain.v_A } else { S::lift(0.0) };
            return slots + base;
        }
        let a_A = self.a_A(u);
        let slots = Self::load(carried, &self.a_P(a, &a_A)).dot(&self.v_P(chain, u));
        if !self.p.use_base {
            return slots;
        }
        slots - self.spatial_force(chain, carried, a, &a_A).dot(&u.A_spatial.v)
    }
}

impl Model for PrimaryOscillator {
    const NAME: &'static str = "primary_oscillator";
    const DESCRIPTION: &'static str =
        "Chain of one or two driven masses with a leader port, on the ground or on a moving base";
    const EXPERIMENT: Experiment = Experiment { stop: 10.0, step: 0.01 };
    const DOCUMENTATION: Documentation = model::documentation!(
        "primary_oscillator",
        plots = [
            ("Displacement of the mass", ["s[1]"]),
            ("Energies", ["energy.supplied", "energy.dissipated", "energy.kinetic"])
        ]
    );
    const METHODS: &'static [i64] = &[1, 2, 3, 4, 5, 6, 7];
    const METHOD: i64 = 7;
    type Parameters = Parameters;
    type Inputs<S: Scalar> = Inputs<S>;
    type Motion<S: Scalar> = Motion<S>;
    type Inertia<S: Scalar> = Inertia<S>;
    type Dynamics<S: Scalar> = Dynamics<S>;
    type Energy<S: Scalar> = Energy<S>;
    type Discrete = Base;

    fn new(p: &Parameters, _start: &Motion<f64>) -> Result<Self, ParameterError> {
        let length = p.direction.norm();
        if length.vanishes() {
            return Err(ParameterError::refused(
                "direction.x",
                0.0,
                "the direction has no length",
                "|direction| > 0",
            ));
        }
        for (name, mass) in [("port.mass", p.port_mass), ("drive.mass", p.drive_mass)] {
            if mass > p.dof {
                let (reason, allowed) = (format!("dof = {}", p.dof), format!("<= {}", p.dof));
                return Err(ParameterError::refused(name, f64::from(mass), reason, allowed));
            }
        }
        if p.K_g > 0.0 && !p.gravity.iter().all(|g| g.vanishes()) {
            let reason = "with gravity the masses would not rest at s = 0";
            return Err(ParameterError::refused("ground.stiffness", p.K_g, reason, "0, or gravity = 0"));
        }
        let carrier = if p.port_mass == 0 { p.dof } else { p.port_mass };
        Ok(Self { p: p.clone(), e: p.direction / length, port: usize::from(carrier == 2) })
    }

    fn retune(&mut self, p: &Parameters) {
        let Parameters { amplitude, omega_start, sweep, phase, .. } = *p;
        self.p = Parameters { amplitude, omega_start, sweep, phase, ..self.p.clone() };
    }

    fn warnings(&self) -> Vec<String> {
        let weightless = !self.spatial() || !self.p.use_base;
        if weightless && !self.p.gravity.iter().all(|g| g.vanishes()) {
            return vec!["gravity acts on the base of a spatial port only: without use.base and port.kind = spatial it does nothing".into()];
        }
        Vec::new()
    }

    fn with_system<V: Visitor<Self>>(&self, visitor: V) -> V::Output {
        if self.dof() == 1 { visitor.visit::<5, 0, _>(self) } else { visitor.visit::<7, 0, _>(self) }
    }
}

impl<const X: usize> System<X, 0> for PrimaryOscillator
where
    Dense: Spectrum<X>,
{
    type Model = Self;
    type Spectrum = Dense;

    fn start(&self, _t: f64, _given: &Motion<f64>) -> Result<([f64; X], Base), ParameterError> {
        let s = &self.p.start;
        let start = [s.s_1, s.v_1, s.s_2, s.v_2];
        let mechanical = 2 * self.dof();
        Ok((std::array::from_fn(|i| if i < mechanical { start[i] } else { 0.0 }), Base::default()))
    }

    fn begin(&self, _x: &[f64; X], u: &Inputs<f64>, _d: &Base) -> Base {
        Base { start: self.along(&u.A_spatial.r) }
    }

    #[inline]
    fn rates<S: Scalar>(&self, t: S, x: &[S; X], u: &Inputs<S>, d: &Base) -> Result<[S; X], EvaluationError> {
        let chain = self.chain(t, x, u, *d);
        let carried = self.carried(u);
        let a = self.accelerated(&chain, &carried, &self.a_A(u))?;
        let mut x_dot = [S::lift(0.0); X];
        for i in 0..self.dof() {
            x_dot[2 * i] = chain.v[i];
            x_dot[2 * i + 1] = a[i];
        }
        if self.p.use_energy {
            let Parameters { C, C_g, .. } = &self.p;
            let rate = [chain.v[0] - chain.v_A, chain.v[1] - chain.v[0]];
            let mut heat = rate[0] * rate[0] * C[0] + chain.v[0] * chain.v[0] * *C_g;
            if self.dof() == 2 {
                heat += rate[1] * rate[1] * C[1];
            }
            let port = self.port_power(&chain, &carried, &a, u);
            let driven = self.drive(t, u) * chain.v[usize::from(self.p.drive_mass == 2)];
            x_dot[2 * self.dof()..].copy_from_slice(&[heat, port + driven, port]);
        }
        Ok(x_dot)
    }

    fn motion<S: Scalar>(
        &self,
        t: S,
        x: &[S; X],
        u: &Inputs<S>,
        d: &Base,
    ) -> Result<Motion<S>, EvaluationError> {
        let chain = self.chain(t, x, u, *d);
        let (zero, none) = (S::lift(0.0), Vector3::zeros());
        let start = &self.p.start;
        let (mut s, mut v) = (chain.s, chain.v);
        if self.dof() == 1 {
            (s[1], v[1]) = (S::lift(start.s_2), S::lift(start.v_2));
        }
        let (s_p, v_p) = (chain.s[self.port], chain.v[self.port]);
        let drive_omega = self.drive_omega(t);
        if !self.spatial() {
            return Ok(Motion {
                s,
                v,
                P_s: s_p,
                P_v: v_p,
                P_r_spatial: none,
                P_v_spatial: none,
                drive_omega,
            });
        }
        let P_r_spatial = if self.p.use_base {
            let (s_A, _) = self.base(u, *d);
            u.A_spatial.r + self.direction() * (s_p - s_A)
        } else {
            self.p.origin.map(S::lift) + self.direction() * s_p
        };
        let P_v_spatial = self.v_P(&chain, u);
        Ok(Motion { s, v, P_s: zero, P_v: zero, P_r_spatial, P_v_spatial, drive_omega })
    }

    fn inertia<S: Scalar>(
        &self,
        t: S,
        x: &[S; X],
        u: &Inputs<S>,
        d: &Base,
    ) -> Result<Inertia<S>, EvaluationError> {
        let zero = S::lift(0.0);
        let nothing =
            Inertia { F0: zero, M: zero, F0_spatial: Vector3::zeros(), M_spatial: SymmetricTensor::zero() };
        if !self.p.use_base {
            return Ok(nothing);
        }
        let chain = self.chain(t, x, u, *d);
        if !self.spatial() {
            return Ok(Inertia { F0: chain.T[0], M: S::lift(self.p.M_r), ..nothing });
        }
        let carried = self.carried(u);
        let (m, s_p0) = self.port_mass(&chain, &carried)?;
        let e = self.direction::<S>();
        let F0_spatial = self.weight() + e * chain.T[0] + self.across(&carried.F) - carried.nu * s_p0;
        let one = Matrix::<S, 3, 3>::identity();
        let E = one - e * e.transpose();
        let masses = self.total() - self.p.M_r;
        let mut M = one * S::lift(self.p.M_r) + E * S::lift(masses);
        if let Some(slots) = &carried.M {
            M += E * slots * E - carried.nu * carried.nu.transpose() / m;
        }
        Ok(Inertia { F0_spatial, M_spatial: SymmetricTensor::from_matrix(&M), ..nothing })
    }

    fn dynamics<S: Scalar>(
        &self,
        t: S,
        x: &[S; X],
        u: &Inputs<S>,
        d: &Base,
    ) -> Result<Dynamics<S>, EvaluationError> {
        let chain = self.chain(t, x, u, *d);
        let carried = self.carried(u);
        let a_A = self.a_A(u);
        let a = self.accelerated(&chain, &carried, &a_A)?;
        let (zero, none) = (S::lift(0.0), Vector3::zeros());
        let base = self.p.use_base;
        if !self.spatial() {
            let A_F = if base { chain.T[0] - u.A.a * self.p.M_r } else { zero };
            return Ok(Dynamics { P_a: a[self.port], P_a_spatial: none, A_F, A_F_spatial: none });
        }
        let A_F_spatial = if base { self.spatial_force(&chain, &carried, &a, &a_A) } else { none };
        Ok(Dynamics { P_a: zero, P_a_spatial: self.a_P(&a, &a_A), A_F: zero, A_F_spatial })
    }

    fn energy<S: Scalar>(
        &self,
        t: S,
        x: &[S; X],
        u: &Inputs<S>,
        d: &Base,
    ) -> Result<Energy<S>, EvaluationError> {
        let chain = self.chain(t, x, u, *d);
        let Parameters { M, K, K_g, M_r, .. } = &self.p;
        let square = |v: S| v * v;
        let mut kinetic = S::lift(0.0);
        let mut potential = square(chain.s[0]) * (0.5 * *K_g);
        for i in 0..self.dof() {
            kinetic += square(chain.v[i]) * (0.5 * M[i]);
            potential += square(chain.stretch[i]) * (0.5 * K[i]);
        }
        if self.p.use_base && self.spatial() {
            let (v_A, across) = (&u.A_spatial.v, self.across(&u.A_spatial.v));
            kinetic += v_A.dot(v_A) * (0.5 * *M_r) + across.dot(&across) * (0.5 * (self.total() - *M_r));
            potential -= self.weight().dot(&u.A_spatial.r);
        } else if self.p.use_base {
            kinetic += square(chain.v_A) * (0.5 * *M_r);
        }
        let [dissipated, supplied, port] = [0, 1, 2].map(|i| x[2 * self.dof() + i]);
        Ok(Energy { kinetic, potential, dissipated, supplied, port })
    }

    fn linear(&self, u: &Inputs<f64>, _d: &Base) -> Option<Linear<X>> {
        let Parameters { amplitude, omega_start: omega, sweep, phase, M, .. } = &self.p;
        if !sweep.vanishes() {
            return None;
        }
        let driven = usize::from(self.p.drive_mass == 2);
        let carried = if driven == self.port { self.carried(u).mu } else { 0.0 };
        let mut c = [0.0; X];
        c[2 * driven + 1] = amplitude / (M[driven] + carried);
        Some(Linear { states: 2 * self.dof(), amplitude: c, omega: *omega, phase: *phase })
    }

    fn state_names(&self) -> [String; X] {
        let names = ["s[1]", "v[1]", "s[2]", "v[2]"];
        let energies = ["energy.dissipated", "energy.supplied", "energy.port"];
        let mechanical = 2 * self.dof();
        std::array::from_fn(|i| (if i < mechanical { names[i] } else { energies[i - mechanical] }).into())
    }

    fn nominals(&self) -> [f64; X] {
        let mechanical = 2 * self.dof();
        std::array::from_fn(|i| if i < mechanical { 1.0 } else { f64::INFINITY })
    }
}
