//! Cascaded limitation of the joint rates (B20).
//!
//! ```text
//! 0  u_i not finite -> 0
//! 1  joint at a limit and u_i points beyond it -> 0
//! 2  |u_i| <= rate_max_i
//! 3  |u_i| <= tangential_max_i / max_k rho_ik
//! 4  Q_i = |u_i| A_i |ds_i/dq_i| <= limit_i        (i = 1: |u_1| displacement)
//! 5  sum Q_i <= flow_total_max: all u_i shrink alike
//! ```
//! Each stage can only shrink `|u_i|`, so that earlier ones stay satisfied. The cascade works on numbers and, for the
//! accelerations (B20a), on numbers with their time derivative ([`Jet`]).

use std::ops::{Add, Div, Mul, Neg};

use mechanics::Scalar;

use super::machine::JOINTS;

/// Smallest lever that stage 3 divides by [m].
pub(crate) const LEAST_LEVER: f64 = 1e-9;

/// Bits of `limiter.stage`.
pub(crate) mod stage {
    pub(crate) const NOT_FINITE: u8 = 1;
    pub(crate) const JOINT: u8 = 2;
    pub(crate) const RATE: u8 = 4;
    pub(crate) const TANGENTIAL: u8 = 8;
    pub(crate) const OWN_FLOW: u8 = 16;
    pub(crate) const TOTAL_FLOW: u8 = 32;
}

/// What the cascade calculates with.
pub(crate) trait Value:
    Copy + Add<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// A constant.
    fn constant(value: f64) -> Self;
    /// The value itself.
    fn plain(self) -> f64;
}

impl<S: Scalar> Value for S {
    #[inline]
    fn constant(value: f64) -> Self {
        S::lift(value)
    }
    #[inline]
    fn plain(self) -> f64 {
        self.re()
    }
}

/// A value and its time derivative.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Jet<S> {
    pub(crate) value: S,
    pub(crate) rate: S,
}

impl<S: Scalar> Add for Jet<S> {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self { value: self.value + o.value, rate: self.rate + o.rate }
    }
}

impl<S: Scalar> Neg for Jet<S> {
    type Output = Self;
    fn neg(self) -> Self {
        Self { value: -self.value, rate: -self.rate }
    }
}

#[allow(clippy::suspicious_arithmetic_impl, reason = "product rule")]
impl<S: Scalar> Mul for Jet<S> {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        Self { value: self.value * o.value, rate: self.rate * o.value + self.value * o.rate }
    }
}

#[allow(clippy::suspicious_arithmetic_impl, reason = "quotient rule")]
impl<S: Scalar> Div for Jet<S> {
    type Output = Self;
    fn div(self, o: Self) -> Self {
        let value = self.value / o.value;
        Self { value, rate: (self.rate - value * o.rate) / o.value }
    }
}

impl<S: Scalar> Value for Jet<S> {
    fn constant(value: f64) -> Self {
        Self { value: S::lift(value), rate: S::lift(0.0) }
    }
    fn plain(self) -> f64 {
        self.value.re()
    }
}

/// Limits that are in force: those of the variant, or the parameters that replace them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Limits {
    /// Stages 2 to 5 act
    pub(crate) active: bool,
    pub(crate) rate_max: [f64; JOINTS],
    /// Stage 3 acts
    pub(crate) tangential_active: bool,
    pub(crate) tangential_max: [f64; JOINTS],
    /// Stages 4 and 5 act
    pub(crate) flows_active: bool,
    /// By direction: retracting, extending
    pub(crate) flow_max: [[f64; 2]; JOINTS],
    pub(crate) flow_total_max: f64,
}

impl Limits {
    /// Stage 3 needs levers.
    pub(crate) fn needs_levers(&self) -> bool {
        self.active && self.tangential_active
    }

    /// Stages 4 and 5 need slopes.
    pub(crate) fn needs_slopes(&self) -> bool {
        self.active && self.flows_active
    }
}

/// Oil that a joint takes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Intake<V> {
    /// Direction of the cylinder for a positive rate: 1 extends, -1 retracts
    pub(crate) sense: f64,
    /// Oil per angle by direction: retracting, extending [m3/rad]
    pub(crate) per_angle: [V; 2],
}

impl<V: Value> Intake<V> {
    /// Index of the direction at the rate `u`; a cylinder at rest counts as extending.
    pub(crate) fn direction(&self, u: f64) -> usize {
        usize::from(self.sense * u >= 0.0)
    }

    /// Flow at the rate `u` [m3/s].
    pub(crate) fn flow(&self, u: V) -> V {
        let per_angle = self.per_angle[self.direction(u.plain())];
        magnitude(u) * per_angle
    }
}

/// What the limits depend on at a pose; only what the active stages need is there.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Geometry<V> {
    /// Longest lever of each joint [m]
    pub(crate) levers: Option<[V; JOINTS]>,
    pub(crate) intakes: Option<[Intake<V>; JOINTS]>,
}

/// Rates after the cascade, and the stages that acted on each.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Limited<V> {
    pub(crate) rate: [V; JOINTS],
    pub(crate) stage: [u8; JOINTS],
}

fn magnitude<V: Value>(u: V) -> V {
    if u.plain() < 0.0 { -u } else { u }
}

/// `bound` with the sign of `u` if `u` is larger.
fn bounded<V: Value>(u: V, bound: V) -> Option<V> {
    let plain = u.plain();
    (plain.abs() > bound.plain()).then(|| if plain < 0.0 { -bound } else { bound })
}

impl Limits {
    /// Stages 1 to 5 on rates that are finite; `blocked`: stage 1 acts.
    #[inline]
    pub(crate) fn limit<V: Value>(
        &self,
        u: &[V; JOINTS],
        blocked: [bool; JOINTS],
        geometry: &Geometry<V>,
    ) -> Limited<V> {
        let (mut rate, mut stage) = (*u, [0; JOINTS]);
        for i in 0..JOINTS {
            if blocked[i] {
                rate[i] = V::constant(0.0);
                stage[i] |= stage::JOINT;
            }
        }
        if !self.active {
            return Limited { rate, stage };
        }
        for i in 0..JOINTS {
            let shrink = |rate: &mut V, stage: &mut u8, bound: V, bit: u8| {
                if let Some(smaller) = bounded(*rate, bound) {
                    *rate = smaller;
                    *stage |= bit;
                }
            };
            shrink(&mut rate[i], &mut stage[i], V::constant(self.rate_max[i]), stage::RATE);
            if let Some(levers) = &geometry.levers {
                let lever =
                    if levers[i].plain() > LEAST_LEVER { levers[i] } else { V::constant(LEAST_LEVER) };
                let bound = V::constant(self.tangential_max[i]) / lever;
                shrink(&mut rate[i], &mut stage[i], bound, stage::TANGENTIAL);
            }
        }
        if let Some(intakes) = &geometry.intakes {
            self.limit_flows(&mut rate, &mut stage, intakes);
        }
        Limited { rate, stage }
    }

    fn limit_flows<V: Value>(
        &self,
        rate: &mut [V; JOINTS],
        stage: &mut [u8; JOINTS],
        intakes: &[Intake<V>; JOINTS],
    ) {
        let mut total = V::constant(0.0);
        for i in 0..JOINTS {
            let limit = self.flow_max[i][intakes[i].direction(rate[i].plain())];
            let mut flow = intakes[i].flow(rate[i]);
            if flow.plain() > limit {
                let limit = V::constant(limit);
                rate[i] = rate[i] * (limit / flow);
                flow = limit;
                stage[i] |= stage::OWN_FLOW;
            }
            total = total + flow;
        }
        if total.plain() > self.flow_total_max {
            let scale = V::constant(self.flow_total_max) / total;
            for i in 0..JOINTS {
                if rate[i].plain().abs() > 0.0 {
                    stage[i] |= stage::TOTAL_FLOW;
                }
                rate[i] = rate[i] * scale;
            }
        }
    }
}
