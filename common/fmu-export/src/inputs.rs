//! How inputs go on inside a step: held, extrapolated, or interpolated to values given for its end.
//!
//! ```text
//! p(t) = f_0 + (t - t_0) (f_01 + (t - t_1) (f_012 + (t - t_2) f_0123))      divided differences
//! v(t) = v_n + integral of p_a,   r(t) = r_n + integral of v                port.integrate_motion
//! ```
//! Nodes, newest first: `t_0` is the start of the step (extrapolate) or its end (endpoint), the others
//! come from the history. Fewer samples give a lower degree. Nothing here knows a model.

mod history;
mod polynomials;
#[cfg(test)]
mod tests;

use model::{Enumeration, ParameterError, Variability, Variables};

use crate::Variable;

pub use history::History;
pub use polynomials::{Polynomials, Span};

/// How inputs go on inside a step
#[derive(Debug, Clone, Copy, PartialEq, Eq, Enumeration)]
pub enum InputTreatment {
    /// They keep their values
    Hold = 1,
    /// They follow the polynomial through the last samples
    Extrapolate = 2,
    /// The values set before the step belong to its end; inside, they are interpolated
    Endpoint = 3,
}

/// Treatment of continuous inputs inside a step.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(parameter)]
pub struct PortParameters {
    /// How inputs go on inside a step
    #[var(name = "port.inputs", item = InputTreatment::Extrapolate, tunable)]
    pub inputs: InputTreatment,
    /// Degree of the input polynomials, 0 to 2, endpoint 1 to 3; lower while the history is short
    #[var(name = "port.order", start = 1.0, min = 0.0, max = 3.0, tunable)]
    pub order: i32,
    /// Position and velocity of a port are integrals of its acceleration
    #[var(name = "port.integrate_motion", start = true, tunable)]
    pub integrate_motion: bool,
    /// Largest extrapolated change over a step, relative to the last two values and the nominal value; beyond, the input is held; 0: no limit
    #[var(name = "port.limit", start = 0.0, min = 0.0, tunable)]
    pub limit: f64,
}

/// The signal that inputs jump.
#[derive(Debug, Clone, Copy, PartialEq, Variables)]
#[variables(input)]
pub struct PortReset {
    /// A change of this value announces a discontinuity: the samples so far are forgotten
    #[var(name = "port.reset", discrete)]
    pub reset: f64,
}

impl PortParameters {
    /// All inputs keep their values.
    pub const HOLD: Self =
        Self { inputs: InputTreatment::Hold, order: 0, integrate_motion: false, limit: 0.0 };

    /// The parameters themselves, if they fit together.
    ///
    /// # Errors
    /// An order that the treatment does not have.
    pub fn checked(self) -> Result<Self, ParameterError> {
        let (low, high, name) = match self.inputs {
            InputTreatment::Hold => return Ok(self),
            InputTreatment::Extrapolate => (0, 2, "extrapolate"),
            InputTreatment::Endpoint => (1, 3, "endpoint"),
        };
        if (low..=high).contains(&self.order) {
            return Ok(self);
        }
        let (reason, allowed) = (format!("port.inputs = {name}"), format!("{low} .. {high}"));
        Err(ParameterError::refused("port.order", f64::from(self.order), reason, allowed))
    }

    /// Number of nodes of the polynomials.
    fn nodes(&self) -> usize {
        match self.inputs {
            InputTreatment::Hold => 1,
            _ => usize::try_from(self.order).map_or(1, |order| order + 1),
        }
    }
}

/// Position, velocity and acceleration of one port coordinate, as places among the inputs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Motion {
    r: usize,
    v: usize,
    a: usize,
}

/// What a continuous input may become.
#[derive(Debug, Clone, Copy)]
struct Bounds {
    min: f64,
    max: f64,
    nominal: f64,
}

/// What is known about the inputs of an FMU.
#[derive(Debug, Clone)]
pub struct Channels {
    count: usize,
    /// Continuous inputs
    continuous: Vec<(usize, Bounds)>,
    motions: Vec<Motion>,
}

impl Channels {
    /// Of the inputs among the variables of an FMU.
    #[must_use]
    pub fn of(inputs: &[Variable]) -> Self {
        Self::new(inputs.iter().map(|Variable { name, entry: e, .. }| {
            (name.as_str(), e.variability == Variability::Continuous, e.min, e.max, e.nominal)
        }))
    }

    /// From name, continuity, smallest, largest and nominal value of each input.
    pub(crate) fn new<'a>(inputs: impl Iterator<Item = (&'a str, bool, f64, f64, f64)>) -> Self {
        let inputs: Vec<_> = inputs.collect();
        let find = |name: &str| inputs.iter().position(|i| i.0 == name && i.1);
        let mut motions = Vec::new();
        for (a, (name, ..)) in inputs.iter().enumerate() {
            // P.a.x belongs to P.v.x and P.r.x, P.a to P.v and P.s
            let relatives = match name.rfind(".a.") {
                Some(at) => {
                    let (port, axis) = (&name[..at], &name[at + 3..]);
                    [format!("{port}.r.{axis}"), format!("{port}.v.{axis}")]
                }
                None => match name.strip_suffix(".a") {
                    Some(port) => [format!("{port}.s"), format!("{port}.v")],
                    None => continue,
                },
            };
            if let (true, Some(r), Some(v)) = (inputs[a].1, find(&relatives[0]), find(&relatives[1])) {
                motions.push(Motion { r, v, a });
            }
        }
        let continuous = inputs.iter().enumerate().filter(|(_, i)| i.1);
        Self {
            count: inputs.len(),
            continuous: continuous
                .map(|(i, &(_, _, min, max, nominal))| (i, Bounds { min, max, nominal }))
                .collect(),
            motions,
        }
    }

    /// Number of inputs.
    #[must_use]
    pub fn count(&self) -> usize {
        self.count
    }

    /// True if positions and velocities may move by themselves.
    #[must_use]
    pub fn moving(&self) -> bool {
        !self.motions.is_empty()
    }

    /// Positions and velocities that are integrals of accelerations.
    pub fn integrated(&self) -> impl Iterator<Item = usize> {
        self.motions.iter().flat_map(|m| [m.r, m.v])
    }
}
