//! The polynomials that inputs follow over one step.

use model::Scalar;

use super::history::identical;
use super::{Bounds, Channels, History, InputTreatment, Motion, PortParameters};

/// Largest degree of an input polynomial, and with two integrations.
const DEGREE: usize = 3;
const INTEGRATED: usize = DEGREE + 2;

/// A step for which polynomials are wanted.
#[derive(Debug, Clone, Copy)]
pub struct Span {
    /// Its start [s]
    pub from: f64,
    /// Its end [s]
    pub to: f64,
}

/// The course of all inputs over one step; only those that move are listed.
#[derive(Debug, Clone)]
pub struct Polynomials {
    from: f64,
    nodes: [f64; DEGREE],
    /// Divided differences
    newton: Vec<(usize, [f64; DEGREE + 1])>,
    /// Coefficients of the powers of `t - from`
    powers: Vec<(usize, [f64; INTEGRATED + 1])>,
}

impl Polynomials {
    /// Room for `channels`.
    #[must_use]
    pub fn new(channels: &Channels) -> Self {
        Self {
            from: 0.0,
            nodes: [0.0; DEGREE],
            newton: Vec::with_capacity(channels.count()),
            powers: Vec::with_capacity(channels.count()),
        }
    }

    /// True if every input keeps its value.
    #[must_use]
    pub fn constant(&self) -> bool {
        self.newton.is_empty() && self.powers.is_empty()
    }

    /// Write the moving inputs at `t`; for dual numbers `t + 1 eps` with their rates.
    #[inline]
    pub fn evaluate<S: Scalar>(&self, t: S, u: &mut [S]) {
        let [d_0, d_1, d_2] = self.nodes.map(|node| t - node);
        for (i, [f_0, f_01, f_012, f_0123]) in &self.newton {
            u[*i] = d_0 * (d_1 * (d_2 * *f_0123 + *f_012) + *f_01) + *f_0;
        }
        let d = t - self.from;
        for (i, c) in &self.powers {
            u[*i] = c.iter().rev().fold(S::lift(0.0), |sum, c| sum * d + *c);
        }
    }

    /// The course over `span`: `u` are the inputs as set, `forget` leaves the history out.
    pub fn plan(
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
            let end = c[0] + change;
            let inside = end.is_finite() && end >= b.min && end <= b.max;
            if !inside || limit > 0.0 && change.abs() > limit * largest {
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
