//! How inputs go on inside a step: held, extrapolated, or interpolated to values given for its end.
//!
//! ```text
//! p(t) = f_0 + (t - t_0) (f_01 + (t - t_1) (f_012 + (t - t_2) f_0123))      divided differences
//! v(t) = v_n + integral of p_a,   r(t) = r_n + integral of v                port.integrate_motion
//! ```
//! Nodes, newest first: `t_0` is the start of the step (extrapolate) or its end (endpoint), the others
//! come from the history. Fewer samples give a lower degree. Nothing here knows a model.

use model::{Enumeration, ParameterError, Variables};

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
    pub(crate) const HOLD: Self =
        Self { inputs: InputTreatment::Hold, order: 0, integrate_motion: false, limit: 0.0 };

    /// The parameters themselves, if they fit together.
    pub(crate) fn checked(self) -> Result<Self, ParameterError> {
        let (low, high, name) = match self.inputs {
            InputTreatment::Hold => return Ok(self),
            InputTreatment::Extrapolate => (0, 2, "extrapolate"),
            InputTreatment::Endpoint => (1, 3, "endpoint"),
        };
        if (low..=high).contains(&self.order) {
            return Ok(self);
        }
        Err(ParameterError::Refused {
            variable: "port.order",
            value: f64::from(self.order),
            reason: format!("port.inputs = {name}"),
            allowed: format!("{low} .. {high}"),
        })
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
pub(crate) struct Channels {
    count: usize,
    /// Continuous inputs
    continuous: Vec<(usize, Bounds)>,
    motions: Vec<Motion>,
}

impl Channels {
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
    pub(crate) fn count(&self) -> usize {
        self.count
    }

    /// True if positions and velocities may move by themselves.
    pub(crate) fn moving(&self) -> bool {
        !self.motions.is_empty()
    }

    /// Positions and velocities that are integrals of accelerations.
    pub(crate) fn integrated(&self) -> impl Iterator<Item = usize> {
        self.motions.iter().flat_map(|m| [m.r, m.v])
    }
}

/// Samples that a polynomial of degree 3 to the end of a step needs before it.
const SAMPLES: usize = 3;

/// The last samples of all inputs.
#[derive(Debug, Clone)]
pub(crate) struct History {
    /// Times, newest first
    t: [f64; SAMPLES],
    /// Values, newest sample first
    u: Vec<f64>,
    len: usize,
    /// So many of the newest samples are known to be the inputs as set
    same: usize,
}

impl History {
    /// No samples of `count` inputs.
    pub(crate) fn new(count: usize) -> Self {
        Self { t: [0.0; SAMPLES], u: vec![0.0; SAMPLES * count], len: 0, same: 0 }
    }

    /// Overwrite with another history, without allocation.
    pub(crate) fn copy_from(&mut self, other: &Self) {
        self.u.clone_from(&other.u);
        (self.t, self.len, self.same) = (other.t, other.len, other.same);
    }

    /// The inputs, or their treatment, are no longer those of the samples.
    pub(crate) fn unsettle(&mut self) {
        self.same = 0;
    }

    /// True if all samples are the inputs as set, so that no polynomial moves.
    pub(crate) fn settled(&self) -> bool {
        self.same == SAMPLES
    }

    /// Forget all samples.
    pub(crate) fn clear(&mut self) {
        (self.len, self.same) = (0, 0);
    }

    /// Add a sample at `t` of the inputs as set, which are [settled](Self::settled).
    pub(crate) fn push_again(&mut self, t: f64) {
        if t > self.t[0] {
            self.t = [t, self.t[0], self.t[1]];
        }
    }

    /// Add the values `u` at `t`; samples that are not older are replaced.
    pub(crate) fn push(&mut self, t: f64, u: &[f64]) {
        let n = u.len();
        let newer = self.newer(t);
        let kept = (self.len - newer).min(SAMPLES - 1);
        let same = match newer {
            0 if self.len > 0 && identical(self.sample(0), u) => self.same.max(1) + 1,
            1 if identical(self.sample(0), u) => self.same.max(1),
            _ => 1,
        };
        if newer != 1 {
            self.t.copy_within(newer..newer + kept, 1);
            self.u.copy_within(newer * n..(newer + kept) * n, n);
        }
        self.t[0] = t;
        self.u[..n].copy_from_slice(u);
        self.len = kept + 1;
        self.same = same.min(self.len);
    }

    /// Number of samples that are not older than `t`.
    fn newer(&self, t: f64) -> usize {
        self.t[..self.len].iter().take_while(|s| **s >= t).count()
    }

    fn sample(&self, i: usize) -> &[f64] {
        let n = self.u.len() / SAMPLES;
        &self.u[i * n..(i + 1) * n]
    }
}

/// True if the bits are the same.
fn identical(a: &[f64], b: &[f64]) -> bool {
    a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits())
}

/// Largest degree of an input polynomial, and with two integrations.
const DEGREE: usize = 3;
const INTEGRATED: usize = DEGREE + 2;

/// A step for which polynomials are wanted.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Span {
    pub(crate) from: f64,
    pub(crate) to: f64,
}

/// The course of all inputs over one step; only those that move are listed.
#[derive(Debug, Clone)]
pub(crate) struct Polynomials {
    from: f64,
    nodes: [f64; DEGREE],
    /// Divided differences
    newton: Vec<(usize, [f64; DEGREE + 1])>,
    /// Coefficients of the powers of `t - from`
    powers: Vec<(usize, [f64; INTEGRATED + 1])>,
}

impl Polynomials {
    /// Room for `channels`.
    pub(crate) fn new(channels: &Channels) -> Self {
        Self {
            from: 0.0,
            nodes: [0.0; DEGREE],
            newton: Vec::with_capacity(channels.count()),
            powers: Vec::with_capacity(channels.count()),
        }
    }

    /// True if every input keeps its value.
    pub(crate) fn constant(&self) -> bool {
        self.newton.is_empty() && self.powers.is_empty()
    }

    /// Write the moving inputs at `t`.
    #[inline]
    pub(crate) fn evaluate(&self, t: f64, u: &mut [f64]) {
        let [d_0, d_1, d_2] = self.nodes.map(|node| t - node);
        for (i, [f_0, f_01, f_012, f_0123]) in &self.newton {
            u[*i] = f_0 + d_0 * (f_01 + d_1 * (f_012 + d_2 * f_0123));
        }
        let d = t - self.from;
        for (i, c) in &self.powers {
            u[*i] = c.iter().rev().fold(0.0, |sum, c| sum * d + c);
        }
    }

    /// The course over `span`: `u` are the inputs as set, `forget` leaves the history out.
    pub(crate) fn plan(
        &mut self,
        channels: &Channels,
        history: &History,
        parameters: &PortParameters,
        span: Span,
        u: &[f64],
        forget: bool,
    ) {
        self.newton.clear();
        self.powers.clear();
        self.from = span.from;
        let endpoint = parameters.inputs == InputTreatment::Endpoint;
        let first = if endpoint { span.to } else { span.from };
        let older = history.newer(first);
        let available = if forget { 0 } else { history.len - older };
        let nodes = parameters.nodes().min(available + 1);
        let samples: [&[f64]; DEGREE + 1] =
            std::array::from_fn(|j| if j == 0 || j >= nodes { u } else { history.sample(older + j - 1) });
        let times: [f64; DEGREE + 1] =
            std::array::from_fn(|j| if j == 0 || j >= nodes { first } else { history.t[older + j - 1] });
        self.nodes.copy_from_slice(&times[..DEGREE]);

        let limit = if endpoint { None } else { Some((parameters.limit, span.to)) };
        if !samples[1..nodes].iter().all(|s| identical(s, u)) {
            for (i, bounds) in &channels.continuous {
                let f = samples.map(|s| s[*i]);
                if f[1..nodes].iter().any(|g| g.to_bits() != f[0].to_bits()) {
                    self.follow(*i, divided_differences(&times, f, nodes), f[1], bounds, limit);
                }
            }
        }
        if parameters.integrate_motion && !channels.motions.is_empty() {
            // where the step begins: the inputs as set, or the sample taken there
            let start = match (endpoint, available > 0 && history.t[older] >= span.from) {
                (false, _) => u,
                (true, true) => history.sample(older),
                (true, false) => return,
            };
            for motion in &channels.motions {
                self.integrate(*motion, start, u);
            }
        }
    }

    /// List input `i`, unless the limit or the variable's range wants it held.
    fn follow(&mut self, i: usize, c: [f64; DEGREE + 1], last: f64, b: &Bounds, limit: Option<(f64, f64)>) {
        if let Some((limit, to)) = limit {
            let [d_0, d_1, d_2] = self.nodes.map(|node| to - node);
            let change = d_0 * (c[1] + d_1 * (c[2] + d_2 * c[3]));
            let largest = c[0].abs().max(last.abs()).max(b.nominal);
            let outside = c[0] + change < b.min || c[0] + change > b.max;
            if outside || limit > 0.0 && change.abs() > limit * largest {
                return;
            }
        }
        self.newton.push((i, c));
    }

    /// Replace position and velocity by integrals of the acceleration from where the step begins.
    fn integrate(&mut self, Motion { r: i_r, v: i_v, a: i_a }: Motion, start: &[f64], u: &[f64]) {
        let p = match self.newton.iter().find(|(i, _)| *i == i_a) {
            Some((_, c)) => self.powers_of(c),
            None => [u[i_a], 0.0, 0.0, 0.0],
        };
        self.newton.retain(|(i, _)| *i != i_r && *i != i_v);
        let (r, v) = (start[i_r], start[i_v]);
        let moving = |(i, c): &(usize, [f64; INTEGRATED + 1])| {
            c[0].to_bits() != u[*i].to_bits() || c[1..].iter().any(|c| c.to_bits() << 1 != 0)
        };
        let v = [v, p[0], p[1] / 2.0, p[2] / 3.0, p[3] / 4.0, 0.0];
        let r = [r, v[0], v[1] / 2.0, v[2] / 3.0, v[3] / 4.0, v[4] / 5.0];
        self.powers.extend([(i_v, v), (i_r, r)].into_iter().filter(moving));
    }

    /// Coefficients of the powers of `t - from`.
    fn powers_of(&self, c: &[f64; DEGREE + 1]) -> [f64; DEGREE + 1] {
        let mut p = [c[DEGREE], 0.0, 0.0, 0.0];
        for j in (0..DEGREE).rev() {
            let s = self.from - self.nodes[j];
            for k in (1..=DEGREE).rev() {
                p[k] = p[k - 1] + s * p[k];
            }
            p[0] = c[j] + s * p[0];
        }
        p
    }
}

/// Newton's coefficients for the first `nodes` values.
fn divided_differences(t: &[f64; DEGREE + 1], mut f: [f64; DEGREE + 1], nodes: usize) -> [f64; DEGREE + 1] {
    f[nodes..].fill(0.0);
    for level in 1..nodes {
        for j in (level..nodes).rev() {
            f[j] = (f[j] - f[j - 1]) / (t[j] - t[j - level]);
        }
    }
    f
}

#[cfg(test)]
mod tests;
