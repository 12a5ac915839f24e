#![doc = include_str!("virtual_mechanism.md")]

use mechanics::Scalar;
use model::{
    Dense, Documentation, EvaluationError, Experiment, Model, NoVariables, ParameterError, System, Vector2,
    Visitor,
};
use serde::{Deserialize, Serialize};

use super::drawer::Drawer;
use super::fourbar::Fourbar;
use super::mechanism_variables::{Dynamics, Energy, Inputs, Kind, Motion, Parameters};
use super::reduced::Reduced;
use super::stop::Stop;
use crate::port::planar_slots;

/// Smallest inertia that can be accelerated.
const SMALLEST_INERTIA: f64 = f64::MIN_POSITIVE;

/// A hand-operated mechanism with one coordinate.
#[derive(Debug, Clone)]
pub struct Mechanism {
    p: Parameters,
    fourbar: Fourbar,
    drawer: Drawer,
    stop: Stop,
}

/// Whether the four-bar is at its toggle.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Singular(bool);

/// What accelerates the mechanism.
struct Moved<S> {
    /// Second derivative of the coordinate
    q_2: S,
    /// Acceleration of the hand [m/s2] and true load of the followers [N]
    a: Vector2<S>,
    load: Vector2<S>,
}

impl Mechanism {
    fn reduced<S: Scalar>(&self, q: S) -> Result<Reduced<S>, EvaluationError> {
        match self.p.kind {
            Kind::Fourbar => self.fourbar.reduced(q),
            Kind::Drawer => Ok(self.drawer.reduced(q)),
        }
    }

    fn friction<S: Scalar>(&self, q: S, q_1: S) -> S {
        match self.p.kind {
            Kind::Fourbar => self.fourbar.friction(q_1),
            Kind::Drawer => self.drawer.friction(q, q_1),
        }
    }

    /// (14)
    fn moved<S: Scalar>(
        &self,
        x: &[S; 4],
        reduced: &Reduced<S>,
        u: &Inputs<S>,
    ) -> Result<Moved<S>, EvaluationError> {
        let [q, q_1, ..] = *x;
        let Reduced { M, M_1, V_1, H, .. } = reduced;
        let (F, M_H) = planar_slots(&u.H, &u.H_2);
        let turning = H.r_2 * (q_1 * q_1);
        let inertia = *M + H.r_1.dot(&(M_H * H.r_1));
        if inertia.re() < SMALLEST_INERTIA {
            let quantity = "inertia of the mechanism with that of the slots";
            return Err(EvaluationError::Vanishes { quantity, value: inertia.re(), limit: SMALLEST_INERTIA });
        }
        let Q = H.r_1.dot(&(F - M_H * turning)) - *M_1 * q_1 * q_1 * 0.5 - *V_1 - self.friction(q, q_1)
            + self.stop.force(q, q_1);
        let q_2 = Q / inertia;
        let a = H.r_1 * q_2 + turning;
        Ok(Moved { q_2, a, load: F - M_H * a })
    }

    /// How far the four-bar is from its toggle; a loop that cannot be closed is at it.
    fn margin(&self, x: &[f64; 4]) -> f64 {
        match self.p.kind {
            Kind::Drawer => 1.0,
            Kind::Fourbar => {
                let tolerance = self.p.fourbar.toggle;
                self.fourbar.close(x[0]).map_or(-tolerance, |l| l.toggle.abs() - tolerance)
            }
        }
    }
}

impl Model for Mechanism {
    const NAME: &'static str = "virtual_mechanism";
    const DESCRIPTION: &'static str =
        "Hand-operated mechanism with one degree of freedom: flap or bed on a four-bar, drawer, guided tool";
    const EXPERIMENT: Experiment = Experiment { stop: 2.0, step: 0.002 };
    const DOCUMENTATION: Documentation = model::documentation!(
        "virtual_mechanism",
        plots = [
            ("Crank angle", ["phi"]),
            ("Energies", ["energy.kinetic", "energy.potential", "energy.dissipated"])
        ]
    );
    const INDICATORS: &'static [&'static str] = &["toggle.margin"];
    type Parameters = Parameters;
    type Inputs<S: Scalar> = Inputs<S>;
    type Motion<S: Scalar> = Motion<S>;
    type Inertia<S: Scalar> = NoVariables;
    type Dynamics<S: Scalar> = Dynamics<S>;
    type Energy<S: Scalar> = Energy<S>;
    type Discrete = Singular;

    fn new(p: &Parameters, _start: &Motion<f64>) -> Result<Self, ParameterError> {
        let g = Vector2::new(p.gravity.x, p.gravity.z);
        let (f, d) = (&p.fourbar, &p.drawer);
        let stop = match p.kind {
            Kind::Fourbar => Stop { lo: f.stop.lo, hi: f.stop.hi, k: f.stop.k, chi: f.stop.chi },
            Kind::Drawer => Stop { lo: 0.0, hi: d.stroke, k: d.k, chi: d.chi },
        };
        Ok(Self { p: *p, fourbar: Fourbar::new(f, p.parts, g)?, drawer: Drawer::new(d, p.parts, g)?, stop })
    }

    fn retune(&mut self, _p: &Parameters) {}

    fn with_system<V: Visitor<Self>>(&self, visitor: V) -> V::Output {
        visitor.visit::<4, 1, _>(self)
    }
}

impl System<4, 1> for Mechanism {
    type Model = Self;
    type Spectrum = Dense;

    fn start(&self, _t: f64, _given: &Motion<f64>) -> Result<([f64; 4], Singular), ParameterError> {
        let (f, d) = (&self.p.fourbar, &self.p.drawer);
        let [q, q_1] = match self.p.kind {
            Kind::Fourbar => [f.phi, f.phi_rate],
            Kind::Drawer => [d.s, d.v],
        };
        let x = [q, q_1, 0.0, 0.0];
        Ok((x, Singular(self.margin(&x) < 0.0)))
    }

    #[inline]
    fn rates<S: Scalar>(
        &self,
        _t: S,
        x: &[S; 4],
        u: &Inputs<S>,
        _d: &Singular,
    ) -> Result<[S; 4], EvaluationError> {
        let [q, q_1, ..] = *x;
        let reduced = self.reduced(q)?;
        let Moved { q_2, load, .. } = self.moved(x, &reduced, u)?;
        if !self.p.parts.energy {
            let zero = S::lift(0.0);
            return Ok([q_1, q_2, zero, zero]);
        }
        let heat = self.friction(q, q_1) * q_1 + self.stop.heat(q, q_1);
        Ok([q_1, q_2, heat, load.dot(&reduced.H.r_1) * q_1])
    }

    fn motion<S: Scalar>(
        &self,
        _t: S,
        x: &[S; 4],
        _u: &Inputs<S>,
        d: &Singular,
    ) -> Result<Motion<S>, EvaluationError> {
        let [q, q_1, ..] = *x;
        let H = self.reduced(q)?.H;
        let (f, drawer) = (&self.p.fourbar, &self.p.drawer);
        let rest = |v: [f64; 2]| v.map(S::lift);
        let ([phi, phi_rate], [s, s_rate]) = match self.p.kind {
            Kind::Fourbar => ([q, q_1], rest([drawer.s, drawer.v])),
            Kind::Drawer => (rest([f.phi, f.phi_rate]), [q, q_1]),
        };
        let singular = S::lift(f64::from(u8::from(d.0)));
        Ok(Motion { r: H.r, v: H.r_1 * q_1, phi, phi_rate, s, s_rate, singular })
    }

    fn inertia<S: Scalar>(
        &self,
        _t: S,
        _x: &[S; 4],
        _u: &Inputs<S>,
        _d: &Singular,
    ) -> Result<NoVariables, EvaluationError> {
        Ok(NoVariables)
    }

    fn dynamics<S: Scalar>(
        &self,
        _t: S,
        x: &[S; 4],
        u: &Inputs<S>,
        _d: &Singular,
    ) -> Result<Dynamics<S>, EvaluationError> {
        let reduced = self.reduced(x[0])?;
        Ok(Dynamics { a: self.moved(x, &reduced, u)?.a })
    }

    fn energy<S: Scalar>(
        &self,
        _t: S,
        x: &[S; 4],
        _u: &Inputs<S>,
        _d: &Singular,
    ) -> Result<Energy<S>, EvaluationError> {
        let [q, q_1, dissipated, supplied] = *x;
        let Reduced { M, V, .. } = self.reduced(q)?;
        Ok(Energy {
            kinetic: M * q_1 * q_1 * 0.5,
            potential: V + self.stop.energy(q),
            dissipated,
            supplied,
            port: supplied,
        })
    }

    fn state_names(&self) -> [String; 4] {
        let [q, q_1] = match self.p.kind {
            Kind::Fourbar => ["phi", "phi_rate"],
            Kind::Drawer => ["drawer.s", "drawer.v"],
        };
        [q, q_1, "energy.dissipated", "energy.supplied"].map(String::from)
    }

    fn nominals(&self) -> [f64; 4] {
        let q = match self.p.kind {
            Kind::Fourbar => 1.0,
            Kind::Drawer => 0.1,
        };
        [q, q, f64::INFINITY, f64::INFINITY]
    }

    fn indicators(&self, _t: f64, x: &[f64; 4], _u: &Inputs<f64>, _d: &Singular) -> [f64; 1] {
        [self.margin(x)]
    }

    fn update(&self, _t: f64, x: &mut [f64; 4], _u: &Inputs<f64>, _d: &Singular) -> Singular {
        Singular(self.margin(x) < 0.0)
    }
}
