#![doc = include_str!("rvdp_absorber.md")]

use mechanics::Scalar;
use model::{
    Dense, Documentation, EvaluationError, Experiment, Matrix, Model, Pace, ParameterError, Spectrum,
    SymmetricTensor, System, Vector3, Visitor,
};
use serde::{Deserialize, Serialize};

use super::control_law::{ControlLaw, Design};
use super::primary_variables::PortKind;
use super::rvdp_variables::{
    DesignOutputs, Dynamics, Energy, Inertia, Inputs, LawKind, Motion, Parameters, StabilityOutputs,
};
use super::synchronisation::Stability;
use crate::port::along;

/// Largest usable displacement and velocity [m, m/s]
const LARGEST: f64 = 1e150;
/// Shortest usable `axis`
const SHORTEST: f64 = 1e-12;
/// Rate of the velocity relative to the drive's frequency from which an implicit method is cheaper
const STIFF: f64 = 50.0;

/// A mass on a spring whose controlled force makes it swing with one amplitude at one frequency.
#[derive(Debug, Clone)]
pub struct RvdpAbsorber {
    p: Parameters,
    law: ControlLaw,
    /// Axis, unit vector
    e: Vector3<f64>,
    /// Gravity along the axis [m/s2]
    g_e: f64,
}

/// What changes at events only.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Discrete {
    /// Stiffness for which x counts from rest [N/m]
    c: f64,
    stability: Stability,
}

/// Forces inside the absorber.
struct Forces<S> {
    /// Controlled force on the mass
    F1: S,
    /// Force of spring, damper, stop and controller on the port: the mass feels the opposite
    R: S,
    stop: Stop<S>,
}

/// A stop that is touched; zeros otherwise.
struct Stop<S> {
    /// Force on the port along the axis
    F: S,
    energy: S,
    loss: S,
}

impl RvdpAbsorber {
    fn spatial(&self) -> bool {
        self.p.kind == PortKind::Spatial
    }

    fn along<S: Scalar>(&self, v: &Vector3<S>) -> S {
        along(&self.e, v)
    }

    fn axis<S: Scalar>(&self) -> Vector3<S> {
        self.e.map(S::lift)
    }

    /// m (1 - e e^T)
    fn lateral<S: Scalar>(&self) -> Matrix<S, 3, 3> {
        let across = Matrix::<f64, 3, 3>::identity() - self.e * self.e.transpose();
        across.map(|m| S::lift(m * self.p.m))
    }

    /// Velocity and acceleration of the port along the axis.
    fn port<S: Scalar>(&self, u: &Inputs<S>) -> (S, S) {
        if self.spatial() { (self.along(&u.A.v), self.along(&u.A.a)) } else { (u.P.v, u.P.a) }
    }

    fn law_of(p: &Parameters) -> ControlLaw {
        let (sin_alpha, cos_alpha) = p.control.alpha.sin_cos();
        let d = if p.control.compensate { p.d } else { 0.0 };
        let Parameters { m, c, .. } = *p;
        let super::rvdp_variables::Control { gamma, X, F_d, H0, .. } = p.control;
        ControlLaw { m, c, d, gamma, X, F_d, sin_alpha, cos_alpha, H0 }
    }

    /// Controlled force on the mass: (14), (16), limited.
    #[inline]
    fn controlled<S: Scalar>(&self, x: S, w: S, u: &Inputs<S>) -> Result<S, EvaluationError> {
        if u.enabled.vanishes() {
            return Ok(S::lift(0.0));
        }
        let F1 = match self.p.control.law {
            LawKind::Off => return Ok(S::lift(0.0)),
            LawKind::Direct => self.law.direct(u.omega, x, w),
            LawKind::Paper => self.law.paper(u.omega, x, w)?,
        } * u.enabled;
        let limit = self.p.control.limit;
        if self.p.control.use_limit && F1.re().abs() > limit {
            return Ok(S::lift(limit.copysign(F1.re())));
        }
        Ok(F1)
    }

    /// Force `k p max(0, 1 + chi p')` beyond the end of the stroke.
    fn stop<S: Scalar>(&self, x: S, w: S) -> Stop<S> {
        let zero = S::lift(0.0);
        let stop = &self.p.stop;
        if !stop.used || x.re().abs() <= stop.limit {
            return Stop { F: zero, energy: zero, loss: zero };
        }
        let side = x.re().signum();
        let (p, p_dot) = (x * side - stop.limit, w * side);
        let spring = p * stop.k;
        let factor = p_dot * stop.chi + 1.0;
        let force = if factor.re() > 0.0 { spring * factor } else { zero };
        Stop { F: force * side, energy: spring * p * 0.5, loss: (force - spring) * p_dot }
    }

    #[inline]
    fn forces<S: Scalar>(&self, x: S, w: S, u: &Inputs<S>) -> Result<Forces<S>, EvaluationError> {
        for (variable, value) in [("x", x.re()), ("w", w.re())] {
            if value.abs() > LARGEST {
                return Err(EvaluationError::TooLarge { variable, value, limit: LARGEST });
            }
        }
        if !self.g_e.vanishes() && self.p.c.vanishes() {
            let quantity = "stiffness of a spring that carries a weight";
            return Err(EvaluationError::Vanishes { quantity, value: 0.0, limit: f64::MIN_POSITIVE });
        }
        let F1 = self.controlled(x, w, u)?;
        let stop = self.stop(x, w);
        Ok(Forces { F1, R: x * self.p.c + w * self.p.d + stop.F - F1, stop })
    }

    /// Force of the drive on the mass.
    fn drive<S: Scalar>(&self, t: S, u: &Inputs<S>) -> S {
        if self.p.amplitude.vanishes() {
            return u.force;
        }
        (u.omega * t + self.p.phase).sin() * self.p.amplitude + u.force
    }

    /// F0 and F of the spatial port.
    fn spatial_bias<S: Scalar>(&self, R: S) -> Vector3<S> {
        let weight = self.p.gravity.map(|g| S::lift(g * self.p.m));
        self.axis() * R + weight
    }

    fn spatial_force<S: Scalar>(&self, R: S, a: &Vector3<S>) -> Vector3<S> {
        let across = a - self.axis() * self.along(a);
        self.spatial_bias(R) - across * S::lift(self.p.m)
    }

    /// Power of the leader on the absorber [W].
    fn port_power<S: Scalar>(&self, R: S, u: &Inputs<S>) -> S {
        if self.spatial() {
            -self.spatial_force(R, &u.A.a).dot(&u.A.v)
        } else {
            -(R + self.p.m * self.g_e) * u.P.v
        }
    }

    fn design<S: Scalar>(&self, omega: S) -> Result<Design<S>, EvaluationError> {
        match self.p.control.law {
            LawKind::Paper => self.law.paper_design(omega),
            LawKind::Off | LawKind::Direct => Ok(self.law.direct_design(omega)),
        }
    }
}

impl Model for RvdpAbsorber {
    const NAME: &'static str = "rvdp_absorber";
    const DESCRIPTION: &'static str = "Vibration absorber whose controlled force makes it a Rayleigh-van-der-Pol oscillator at the drive's frequency";
    const EXPERIMENT: Experiment = Experiment { stop: 10.0, step: 0.01 };
    const DOCUMENTATION: Documentation = model::documentation!(
        "rvdp_absorber",
        plots = [
            ("Displacement of the mass", ["x"]),
            ("Controlled force", ["control.F1"]),
            ("Energies", ["energy.supplied", "energy.dissipated", "energy.kinetic"])
        ]
    );
    const INDICATORS: &'static [&'static str] = &["stroke.upper", "stroke.lower"];
    const METHODS: &'static [i64] = &[2, 3, 4, 5, 6, 8];
    const METHOD: i64 = 8;
    const TOLERANCES: [f64; 2] = [1e-8, 1e-12];
    type Parameters = Parameters;
    type Inputs<S: Scalar> = Inputs<S>;
    type Motion<S: Scalar> = Motion<S>;
    type Inertia<S: Scalar> = Inertia<S>;
    type Dynamics<S: Scalar> = Dynamics<S>;
    type Energy<S: Scalar> = Energy<S>;
    type Discrete = Discrete;

    fn new(p: &Parameters, _start: &Motion<f64>) -> Result<Self, ParameterError> {
        let length = p.axis.norm();
        if length < SHORTEST {
            let reason = format!("the axis has the length {length:.3e}");
            return Err(ParameterError::refused("axis.x", p.axis.x, reason, "|axis| >= 1e-12"));
        }
        let e = p.axis / length;
        let g_e = p.gravity.dot(&e);
        if !g_e.vanishes() && p.c.vanishes() {
            let reason = format!("gravity along the axis is {g_e} m/s2: the mass would never rest");
            return Err(ParameterError::refused(
                "stiffness",
                p.c,
                reason,
                "> 0 N/m, or gravity across the axis",
            ));
        }
        Ok(Self { p: *p, law: Self::law_of(p), e, g_e })
    }

    fn retune(&mut self, p: &Parameters) {
        // everything else is fixed, so that it has not changed
        self.p = *p;
        self.law = Self::law_of(p);
    }

    fn warnings(&self) -> Vec<String> {
        let Parameters { x_start, w_start, amplitude, control, .. } = &self.p;
        if [x_start, w_start, amplitude].iter().all(|v| v.vanishes()) && control.law != LawKind::Off {
            return vec![
                "x.start = w.start = 0 without drive: the controller does nothing until the port or drive.force moves the mass".into(),
            ];
        }
        Vec::new()
    }

    fn with_system<V: Visitor<Self>>(&self, visitor: V) -> V::Output {
        match (self.p.use_energy, self.p.stop.used) {
            (false, false) => visitor.visit::<2, 0, _>(self),
            (false, true) => visitor.visit::<2, 2, _>(self),
            (true, false) => visitor.visit::<5, 0, _>(self),
            (true, true) => visitor.visit::<5, 2, _>(self),
        }
    }
}

impl<const N: usize, const Z: usize> System<N, Z> for RvdpAbsorber
where
    Dense: Spectrum<N>,
{
    type Model = Self;
    type Spectrum = Dense;

    fn start(&self, _t: f64, _given: &Motion<f64>) -> Result<([f64; N], Discrete), ParameterError> {
        let mut x = [0.0; N];
        (x[0], x[1]) = (self.p.x_start, self.p.w_start);
        Ok((x, Discrete { c: self.p.c, stability: Stability::default() }))
    }

    fn begin(&self, _x: &[f64; N], u: &Inputs<f64>, d: &Discrete) -> Discrete {
        match self.design(u.omega) {
            Ok(Design { f, g, .. }) if self.p.use_check => {
                Discrete { stability: Stability::new(g, f, self.p.control.alpha), ..*d }
            }
            _ => *d,
        }
    }

    #[inline]
    fn rates<S: Scalar>(
        &self,
        t: S,
        x: &[S; N],
        u: &Inputs<S>,
        _d: &Discrete,
    ) -> Result<[S; N], EvaluationError> {
        let w = x[1];
        let Forces { F1, R, stop } = self.forces(x[0], w, u)?;
        let (v, a) = self.port(u);
        let drive = self.drive(t, u);
        let mut x_dot = [S::lift(0.0); N];
        x_dot[0] = w;
        x_dot[1] = (drive - R) / self.p.m - a; // (22)
        if let [_, _, dissipated, supplied, port] = &mut x_dot[..] {
            *dissipated = w * w * self.p.d + stop.loss;
            *port = self.port_power(R, u);
            *supplied = F1 * w + drive * (w + v) + *port;
        }
        Ok(x_dot)
    }

    fn motion<S: Scalar>(
        &self,
        _t: S,
        x: &[S; N],
        _u: &Inputs<S>,
        _d: &Discrete,
    ) -> Result<Motion<S>, EvaluationError> {
        Ok(Motion { x: x[0], w: x[1] })
    }

    fn inertia<S: Scalar>(
        &self,
        _t: S,
        x: &[S; N],
        u: &Inputs<S>,
        _d: &Discrete,
    ) -> Result<Inertia<S>, EvaluationError> {
        let zero = S::lift(0.0);
        let nothing = Inertia { P_F0: zero, P_M: zero, A_F0: Vector3::zeros(), A_M: SymmetricTensor::zero() };
        let R = self.forces(x[0], x[1], u)?.R;
        if !self.spatial() {
            return Ok(Inertia { P_F0: R + self.p.m * self.g_e, ..nothing });
        }
        let A_M = SymmetricTensor::from_matrix(&self.lateral());
        Ok(Inertia { A_F0: self.spatial_bias(R), A_M, ..nothing })
    }

    fn dynamics<S: Scalar>(
        &self,
        _t: S,
        x: &[S; N],
        u: &Inputs<S>,
        d: &Discrete,
    ) -> Result<Dynamics<S>, EvaluationError> {
        let Forces { F1, R, .. } = self.forces(x[0], x[1], u)?;
        let (P_F, A_F) = if self.spatial() {
            (S::lift(0.0), self.spatial_force(R, &u.A.a))
        } else {
            (R + self.p.m * self.g_e, Vector3::zeros())
        };
        let Design { n, eta, X, f, g } = self.design(u.omega)?;
        let Stability { trace, determinant, stiffness, multiplier, predicted } = d.stability;
        let [trace, determinant, stiffness, multiplier, predicted] =
            [trace, determinant, stiffness, multiplier, f64::from(u8::from(predicted))].map(S::lift);
        Ok(Dynamics {
            P_F,
            A_F,
            F1,
            power: F1 * x[1],
            design: DesignOutputs { n, eta, X, f, g },
            stability: StabilityOutputs { trace, determinant, stiffness, multiplier, predicted },
        })
    }

    fn energy<S: Scalar>(
        &self,
        _t: S,
        x: &[S; N],
        u: &Inputs<S>,
        _d: &Discrete,
    ) -> Result<Energy<S>, EvaluationError> {
        let m = self.p.m;
        let stored = x[0] * x[0] * (0.5 * self.p.c) + self.stop(x[0], x[1]).energy;
        let (v, height) = if self.spatial() {
            (u.A.v + self.axis() * x[1], self.p.gravity.map(S::lift).dot(&u.A.r))
        } else {
            (Vector3::new(u.P.v + x[1], S::lift(0.0), S::lift(0.0)), u.P.s * self.g_e)
        };
        let [dissipated, supplied, port] =
            [2, 3, 4].map(|i| x.get(i).copied().unwrap_or_else(|| S::lift(0.0)));
        Ok(Energy {
            kinetic: v.dot(&v) * (0.5 * m),
            potential: stored - height * m,
            dissipated,
            supplied,
            port,
        })
    }

    fn state_names(&self) -> [String; N] {
        let names = ["x", "w", "energy.dissipated", "energy.supplied", "energy.port"];
        std::array::from_fn(|i| names[i].into())
    }

    fn nominals(&self) -> [f64; N] {
        std::array::from_fn(|i| if i < 2 { 1.0 } else { f64::INFINITY })
    }

    /// Section 7 of the specification: the rate of w alone decides; asked again once a period.
    fn pace(&self, _t: f64, x: &[f64; N], u: &Inputs<f64>, _d: &Discrete) -> Pace {
        let (omega, p) = (u.omega, &self.p);
        let touched = if p.stop.used { (x[0].abs() - p.stop.limit).max(0.0) } else { 0.0 };
        let mut rate = (p.d + p.stop.k * touched * p.stop.chi) / p.m;
        // not `design`: the limit cycle, an eigenvalue problem, would be found anew in every span
        let motion = match p.control.law {
            LawKind::Paper => self.law.paper_design(omega).ok().map(|design| (design.X, design.f)),
            LawKind::Direct => Some(self.law.direct_motion(omega)),
            LawKind::Off => None,
        };
        if let Some((X, f)) = motion.filter(|_| u.enabled > 0.0) {
            let square = 3.0 * x[1] * x[1] + omega * omega * (x[0] * x[0] - X * X);
            rate += 0.5 * p.control.gamma * square + f * omega * self.law.sin_alpha - self.law.d / p.m;
        }
        Pace { stiff: rate.abs() > STIFF * omega, span: std::f64::consts::TAU / omega }
    }

    fn indicators(&self, _t: f64, x: &[f64; N], _u: &Inputs<f64>, _d: &Discrete) -> [f64; Z] {
        let limit = self.p.stop.limit;
        std::array::from_fn(|i| if i == 0 { limit - x[0] } else { limit + x[0] })
    }

    /// A changed stiffness is an event, due at once.
    fn next_event(&self, d: &Discrete) -> Option<f64> {
        let changed = d.c.to_bits() != self.p.c.to_bits() && !self.p.c.vanishes();
        changed.then_some(f64::MIN)
    }

    /// The elongation under the weight stays, so that x counts from another rest position.
    fn update(&self, _t: f64, x: &mut [f64; N], _u: &Inputs<f64>, d: &Discrete) -> Discrete {
        let c = self.p.c;
        if !self.g_e.vanishes() && d.c > 0.0 && c > 0.0 {
            x[0] += self.p.m * self.g_e * (1.0 / d.c - 1.0 / c);
        }
        Discrete { c: if c > 0.0 { c } else { d.c }, ..*d }
    }
}
