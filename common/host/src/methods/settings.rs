//! What a run is made with: the scene's settings, then the options of the user.

use std::str::FromStr;

use integrators::Method as Integrator;

use crate::scene::SceneError;
use crate::ssp::System;

/// A method of the host, see the coupling specification, section 3.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MethodKind {
    /// One integrator over all states, Model Exchange
    Common,
    /// Co-Simulation: inputs are extrapolated
    CsPredict,
    /// Co-Simulation: predicted, evaluated, corrected, evaluated
    CsPece,
    /// Plain exchange, all at once
    Jacobi,
    /// Plain exchange, leaders first
    Seidel,
}

/// Names of the methods.
const METHODS: [(&str, MethodKind); 5] = [
    ("common", MethodKind::Common),
    ("cs-predict", MethodKind::CsPredict),
    ("cs-pece", MethodKind::CsPece),
    ("jacobi", MethodKind::Jacobi),
    ("seidel", MethodKind::Seidel),
];

/// Names of the integrators of method `common`.
const INTEGRATORS: [(&str, Integrator); 6] = [
    ("heun", Integrator::Heun),
    ("rk4", Integrator::Rk4),
    ("dopri5", Integrator::Dopri5),
    ("dop853", Integrator::Dop853),
    ("rodas4", Integrator::Rodas4),
    ("radau5", Integrator::Radau5),
];

impl MethodKind {
    /// Name in scenes and options.
    #[must_use]
    pub fn name(self) -> &'static str {
        METHODS.iter().find(|(_, m)| *m == self).map_or("", |(name, _)| name)
    }
}

/// Name of an integrator in scenes and options.
#[must_use]
pub fn integrator_name(integrator: Integrator) -> &'static str {
    INTEGRATORS.iter().find(|(_, i)| *i == integrator).map_or("", |(name, _)| name)
}

fn named<T: Copy>(table: &[(&str, T)], what: &'static str, name: &str) -> Result<T, SceneError> {
    table.iter().find(|(known, _)| *known == name).map(|(_, value)| *value).ok_or_else(|| {
        let known = table.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
        SceneError::Setting { name: what, value: name.into(), wanted: format!("known: {known}") }
    })
}

impl FromStr for MethodKind {
    type Err = SceneError;

    fn from_str(name: &str) -> Result<Self, SceneError> {
        named(&METHODS, "method", name)
    }
}

/// Options of the user; what is not given comes from the scene.
#[derive(Clone, Debug, Default)]
pub struct Choices {
    /// Method
    pub method: Option<String>,
    /// Integrator of method `common`
    pub integrator: Option<String>,
    /// Communication step, and step of fixed-step integrators [s]
    pub step: Option<f64>,
    /// Relative tolerance
    pub rtol: Option<f64>,
    /// Absolute tolerance
    pub atol: Option<f64>,
    /// Degree of the input polynomials
    pub order: Option<i64>,
    /// Stabilisation of closing joints [1/s]
    pub alpha: Option<f64>,
    /// End of the run [s]
    pub stop: Option<f64>,
    /// Interval of recording [s]
    pub interval: Option<f64>,
}

/// All settings of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Config {
    /// Method
    pub method: MethodKind,
    /// Integrator of method `common`
    pub integrator: Integrator,
    /// Communication step, and step of fixed-step integrators; none: controlled by the error [s]
    pub step: Option<f64>,
    /// Relative tolerance
    pub rtol: f64,
    /// Absolute tolerance
    pub atol: f64,
    /// Degree of the input polynomials
    pub order: i64,
    /// Stabilisation of closing joints [1/s]
    pub alpha: f64,
    /// Start [s]
    pub start: f64,
    /// Stop [s]
    pub stop: f64,
    /// Interval of recording; none: every step [s]
    pub interval: Option<f64>,
}

impl Config {
    /// Joins the scene's settings and the user's.
    ///
    /// # Errors
    /// A name that is not known, a number out of range, a missing step or stop.
    pub fn new(system: &System, choices: &Choices) -> Result<Self, SceneError> {
        let scene = &system.settings;
        let method = choices.method.as_ref().or(scene.method.as_ref());
        let method = method.map_or(Ok(MethodKind::Common), |m| m.parse())?;
        let integrator = choices.integrator.as_ref().or(scene.integrator.as_ref());
        let integrator =
            integrator.map_or(Ok(Integrator::Dopri5), |i| named(&INTEGRATORS, "integrator", i))?;
        let scene_step = match method {
            MethodKind::Common => scene.step.or(scene.macro_step),
            _ => scene.macro_step.or(scene.step),
        };
        let start = system.start.unwrap_or(0.0);
        let config = Self {
            method,
            integrator,
            step: choices.step.or(scene_step),
            rtol: choices.rtol.or(scene.rtol).unwrap_or(1e-6),
            atol: choices.atol.or(scene.atol).unwrap_or(1e-9),
            order: choices.order.or(scene.order).unwrap_or(1),
            alpha: choices.alpha.or(scene.alpha).unwrap_or(2.0),
            start,
            stop: choices
                .stop
                .or(system.stop)
                .ok_or(SceneError::MissingSetting { name: "the stop time", option: "--stop" })?,
            interval: choices.interval.or(scene.interval),
        };
        config.check()?;
        Ok(config)
    }

    fn check(&self) -> Result<(), SceneError> {
        let positive = [
            ("H (or step)", self.step.unwrap_or(1.0), "it must be finite and greater than 0"),
            ("rtol", self.rtol, "it must be finite and greater than 0"),
            ("atol", self.atol, "it must be finite and greater than 0"),
            ("interval", self.interval.unwrap_or(1.0), "it must be finite and greater than 0"),
            ("the length of the run", self.stop - self.start, "stop must come after start"),
        ];
        for (name, value, wanted) in positive {
            if !(value.is_finite() && value > 0.0) {
                return Err(SceneError::Setting { name, value: value.to_string(), wanted: wanted.into() });
            }
        }
        if !(self.alpha.is_finite() && self.alpha >= 0.0) {
            let wanted = "it must be finite and not negative".into();
            return Err(SceneError::Setting { name: "alpha", value: self.alpha.to_string(), wanted });
        }
        if !(0..=2).contains(&self.order) {
            let wanted = "it must be 0, 1 or 2".into();
            return Err(SceneError::Setting { name: "order", value: self.order.to_string(), wanted });
        }
        if self.method == MethodKind::CsPece && self.order == 0 {
            let wanted = "cs-pece has k = 1 or 2".into();
            return Err(SceneError::Setting { name: "order", value: self.order.to_string(), wanted });
        }
        if self.method != MethodKind::CsPece && self.is_fixed_step() && self.step.is_none() {
            return Err(SceneError::MissingSetting { name: "the step", option: "--H" });
        }
        Ok(())
    }

    /// Whether the steps are given, not controlled by the error.
    #[must_use]
    pub fn is_fixed_step(&self) -> bool {
        self.method != MethodKind::Common || !self.integrator.is_adaptive()
    }

    /// The `k`-th point of the grid of step or interval [s].
    #[must_use]
    #[allow(clippy::cast_precision_loss, reason = "fewer than 2^52 points")]
    pub fn point(&self, k: u64, interval: f64) -> f64 {
        let t = self.start + k as f64 * interval;
        if t > self.stop - 1e-9 * interval { self.stop } else { t }
    }
}
