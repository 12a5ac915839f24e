#![doc = include_str!("effi_controller.md")]

use mechanics::Scalar;
use model::{
    Documentation, EvaluationError, Experiment, Model, NoStates, ParameterError, PlanarTensor, System,
    Vector2, Visitor,
};
use serde::{Deserialize, Serialize};

use super::controller_variables::{Dynamics, Energy, Inertia, Inputs, Mode, Motion, Parameters};
use super::device::{Leg, Matrix2, damped_inverse, jacobian};
use super::sampler::{Delay, RateFilter, Rendered};

/// The sampled controller.
#[derive(Debug, Clone)]
pub struct Controller {
    p: Parameters,
    /// Share of a new difference in the filtered rate
    beta: f64,
    delay: usize,
}

/// Why a tick had no command.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
enum Cause {
    /// No pose has axes of these lengths
    NoPose([f64; 2]),
    /// The command for axes of these lengths was not finite
    NotFinite([f64; 2]),
}

/// What goes from tick to tick.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
struct Memory {
    /// Number of ticks so far
    ticks: u64,
    rate: [RateFilter; 2],
    /// Integrals of the position errors [m.s]
    sum: [f64; 2],
    delay: [Delay; 2],
    rendered: [Rendered; 2],
    fault: Option<Cause>,
}

/// What a tick puts out.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
struct Output {
    /// Commands of the axes [N]
    f: [f64; 2],
    V_r: [f64; 2],
    V_v: [f64; 2],
    W_F: [f64; 2],
    /// Work of the rendered force [J]
    rendered: f64,
}

/// The last tick, kept with what came before it, so that it can be done again while inputs answer to it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Sampled {
    /// Index of the next tick: its time is index * T
    next: u64,
    before: Memory,
    after: Memory,
    output: Output,
}

/// The measured handle.
struct Measured {
    /// Measured lengths and their filtered rates
    l: [f64; 2],
    l_dot: Vector2<f64>,
    r: Vector2<f64>,
    v: Vector2<f64>,
    legs: [Leg<f64>; 2],
    J: Matrix2<f64>,
    /// J^+
    J_plus: Matrix2<f64>,
}

const fn pair(v: Vector2<f64>) -> [f64; 2] {
    let [[x, z]] = v.data.0;
    [x, z]
}

impl Controller {
    fn measure(&self, memory: &mut Memory, l: [f64; 2]) -> Option<Measured> {
        let [l_1, l_2] = [0, 1].map(|i| memory.rate[i].sample(l[i], self.p.T, self.beta));
        let l_dot = Vector2::new(l_1, l_2);
        let r = self.p.device.pose(l)?;
        let legs = self.p.device.legs(&r).ok()?;
        let J_plus = damped_inverse(&legs, self.p.eps, self.p.lambda)?;
        Some(Measured { l, l_dot, r, v: J_plus * l_dot, legs, J: jacobian(&legs), J_plus })
    }

    /// What the axes add to follow the rendered leader [N]
    fn follow(&self, m: &Measured, sum: &mut [f64; 2], u: &Inputs<f64>) -> Option<Vector2<f64>> {
        let Parameters { kp, kd, ki, m_ff, .. } = self.p;
        let wanted = self.p.device.legs(&(self.p.offset + u.W_r)).ok()?.map(|leg| leg.l);
        let [rate, acceleration] = [m.J * u.W_v - m.l_dot, m.J * u.W_a];
        let f = [0, 1].map(|i| {
            let error = wanted[i] - m.l[i];
            sum[i] += error * self.p.T;
            kp * error + kd * rate[i] + ki * sum[i] + m_ff * acceleration[i]
        });
        Some(Vector2::from(f))
    }

    /// One tick: what is remembered, and what is put out.
    fn tick(&self, before: &Memory, last: &Output, u: &Inputs<f64>) -> (Memory, Output) {
        let first = before.ticks == 0;
        let mut memory = Memory { ticks: before.ticks + 1, ..*before };
        let l = [u.l_1, u.l_2];
        let safe = Output { f: [0.0; 2], W_F: [0.0; 2], ..*last };
        if memory.fault.is_some() {
            return (memory, safe);
        }
        let measured = self.measure(&mut memory, l);
        let Some(m) = &measured else {
            return (Memory { fault: Some(Cause::NoPose(l)), ..memory }, safe);
        };
        let (F_d, W_F, axes) = match self.p.mode {
            Mode::Idle => (Vector2::zeros(), Vector2::zeros(), Some(Vector2::zeros())),
            Mode::Impedance => (u.V_F, Vector2::zeros(), Some(Vector2::zeros())),
            Mode::Admittance => {
                (Vector2::zeros(), u.sensor_F / self.p.scale, self.follow(m, &mut memory.sum, u))
            }
        };
        let weight = self.p.device.weight(&m.legs) * self.p.comp_gravity;
        let at_axes = |F: Vector2<f64>| m.J_plus.transpose() * F;
        let peak = self.p.device.F_peak;
        let wanted = axes.map(|axes| at_axes(F_d + weight) + axes);
        let sound = wanted.filter(|f| f.iter().chain(m.v.iter()).chain(&W_F).all(|f| f.is_finite()));
        let Some(f) = sound else {
            return (Memory { fault: Some(Cause::NotFinite(l)), ..memory }, safe);
        };
        if first && self.p.balanced {
            memory.delay = pair(at_axes(weight)).map(|f| Delay::filled(f.clamp(-peak, peak)));
        }
        let f = [0, 1].map(|i| memory.delay[i].pass(f[i].clamp(-peak, peak), self.delay));
        let rendered = (0..2).map(|i| memory.rendered[i].sample(m.r[i], F_d[i])).sum();
        (memory, Output { f, V_r: pair(m.r), V_v: pair(m.v), W_F: pair(W_F), rendered })
    }

    /// Time of a tick [s]
    #[allow(clippy::cast_precision_loss, reason = "below 2^53")]
    fn time(&self, tick: u64) -> f64 {
        tick as f64 * self.p.T
    }

    /// How far host times may be off [s]
    fn same(&self, t: f64) -> f64 {
        1e-6 * self.p.T + 4.0 * f64::EPSILON * t.abs()
    }
}

impl Model for Controller {
    const NAME: &'static str = "effi_controller";
    const DESCRIPTION: &'static str =
        "Sampled controller of the planar haptic interface: impedance and admittance rendering";
    const EXPERIMENT: Experiment = Experiment { stop: 1.0, step: 0.001 };
    const DOCUMENTATION: Documentation = model::documentation!(
        "effi_controller",
        inputs,
        plots = [
            ("Commands of the axes", ["axis[1].force_command", "axis[2].force_command"]),
            ("Measured position", ["V.r.x"])
        ]
    );
    const MODEL_EXCHANGE: bool = false;
    const PORT_TREATMENT: bool = false;
    const METHODS: &'static [i64] = &[2];
    type Parameters = Parameters;
    type Inputs<S: Scalar> = Inputs<S>;
    type Motion<S: Scalar> = Motion<S>;
    type Inertia<S: Scalar> = Inertia<S>;
    type Dynamics<S: Scalar> = Dynamics<S>;
    type Energy<S: Scalar> = Energy<S>;
    type Discrete = Sampled;

    fn new(p: &Parameters, _start: &Motion<f64>) -> Result<Self, ParameterError> {
        p.device.checked()?;
        let delay = usize::try_from(p.delay).unwrap_or(0); // 0 .. 10 by its range
        Ok(Self { p: *p, beta: RateFilter::beta(p.cutoff, p.T), delay })
    }

    fn retune(&mut self, _p: &Parameters) {}

    fn notice(before: &Sampled, after: &Sampled) -> Option<String> {
        if before.after.fault.is_some() {
            return None;
        }
        let says = match after.after.fault? {
            Cause::NoPose([l_1, l_2]) => format!(
                "axis[1].position = {l_1} m and axis[2].position = {l_2} m make no pose of the handle; allowed: lengths that \
                 form a triangle with the pivots A and B"
            ),
            Cause::NotFinite([l_1, l_2]) => format!(
                "the command at axis[1].position = {l_1} m and axis[2].position = {l_2} m is not finite; allowed: finite"
            ),
        };
        let tick = after.after.ticks - 1;
        Some(format!("fault = 1 in tick {tick} after the start: {says}; commands stay 0 until reset"))
    }

    fn with_system<V: Visitor<Self>>(&self, visitor: V) -> V::Output {
        visitor.visit::<0, 0, _>(self)
    }
}

impl System<0, 0> for Controller {
    type Model = Self;
    type Spectrum = NoStates;

    fn start(&self, t: f64, _given: &Motion<f64>) -> Result<([f64; 0], Sampled), ParameterError> {
        let index = ((t - self.same(t)) / self.p.T).ceil().max(0.0);
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "whole, not negative")]
        let next = index as u64;
        Ok(([], Sampled { next, ..Sampled::default() }))
    }

    /// The pose is known before the first tick, so that a follower at V starts from it; zero where there is none.
    fn begin(&self, _x: &[f64; 0], u: &Inputs<f64>, d: &Sampled) -> Sampled {
        let V_r = self.p.device.pose([u.l_1, u.l_2]).map_or([0.0; 2], pair);
        Sampled { output: Output { V_r, ..d.output }, ..*d }
    }

    fn rates<S: Scalar>(
        &self,
        _t: S,
        _x: &[S; 0],
        _u: &Inputs<S>,
        _d: &Sampled,
    ) -> Result<[S; 0], EvaluationError> {
        Ok([])
    }

    fn motion<S: Scalar>(
        &self,
        _t: S,
        _x: &[S; 0],
        _u: &Inputs<S>,
        d: &Sampled,
    ) -> Result<Motion<S>, EvaluationError> {
        #[allow(clippy::cast_precision_loss, reason = "below 2^53")]
        let tick = S::lift(d.after.ticks as f64);
        let fault = S::lift(f64::from(u8::from(d.after.fault.is_some())));
        Ok(Motion { V_r: vector(d.output.V_r), V_v: vector(d.output.V_v), tick, fault })
    }

    fn inertia<S: Scalar>(
        &self,
        _t: S,
        _x: &[S; 0],
        _u: &Inputs<S>,
        d: &Sampled,
    ) -> Result<Inertia<S>, EvaluationError> {
        Ok(Inertia { W_F0: vector(d.output.W_F), W_M: PlanarTensor::zero() })
    }

    fn dynamics<S: Scalar>(
        &self,
        _t: S,
        _x: &[S; 0],
        _u: &Inputs<S>,
        d: &Sampled,
    ) -> Result<Dynamics<S>, EvaluationError> {
        let [f_1, f_2] = d.output.f.map(S::lift);
        Ok(Dynamics { f_1, f_2, W_F: vector(d.output.W_F) })
    }

    fn energy<S: Scalar>(
        &self,
        _t: S,
        _x: &[S; 0],
        _u: &Inputs<S>,
        d: &Sampled,
    ) -> Result<Energy<S>, EvaluationError> {
        let zero = S::lift(0.0);
        let rendered = S::lift(d.output.rendered);
        Ok(Energy { kinetic: zero, potential: zero, dissipated: zero, supplied: zero, rendered })
    }

    fn state_names(&self) -> [String; 0] {
        []
    }

    fn next_event(&self, d: &Sampled) -> Option<f64> {
        Some(self.time(d.next))
    }

    fn sample_period(&self) -> Option<f64> {
        Some(self.p.T)
    }

    fn update(&self, _t: f64, _x: &mut [f64; 0], u: &Inputs<f64>, d: &Sampled) -> Sampled {
        let (after, output) = self.tick(&d.after, &d.output, u);
        Sampled { next: d.next + 1, before: d.after, after, output }
    }

    fn revise(&self, t: f64, _x: &mut [f64; 0], u: &Inputs<f64>, d: &Sampled) -> Sampled {
        if d.after.ticks == 0 || (self.time(d.next - 1) - t).abs() > self.same(t) {
            return *d;
        }
        let (after, output) = self.tick(&d.before, &d.output, u);
        Sampled { after, output, ..*d }
    }

    #[allow(clippy::float_cmp, reason = "an output has changed or it has not")]
    fn awaits_answer(&self, before: &Sampled, after: &Sampled) -> bool {
        let (then, now) = (&before.output, &after.output);
        match self.p.mode {
            Mode::Idle => false,
            Mode::Impedance => (then.V_r, then.V_v) != (now.V_r, now.V_v),
            Mode::Admittance => self.p.m_ff > 0.0 && then.W_F != now.W_F,
        }
    }
}

/// A vector of constants.
fn vector<S: Scalar>([x, z]: [f64; 2]) -> Vector2<S> {
    Vector2::new(S::lift(x), S::lift(z))
}
