//! The equations of the boom: limited rates of the joints, lag, energy integrals, events at the ends of the ranges.

use mechanics::Scalar;
use model::{Dense, EvaluationError, ParameterError, Spectrum, System};

use super::limiter::Limited;
use super::machine::JOINTS;
use super::plant::{Boom, Rest};
use super::pose::{Pose, TipLoad, checked_tip_load, finite, tip_load};
use super::variables::Inputs;
use super::variables::outputs::{Dynamics, Energy, Motion, Safety};

/// A joint this near to an end of its range is there [rad].
const ARRIVED: f64 = 1e-12;
/// Event indicator per distance from the end of the range: its band of 1e-10 is then [`ARRIVED`] [1/rad].
const SCALE: f64 = 100.0;

/// No joint turns by more in an adaptive step while the limiter acts [rad]: the error estimate of `dopri5` is blind to a
/// kink at 0.42 of the step, where the error is 0.004 h^2 times the jump of the acceleration.
const TURN: f64 = 1e-3;

/// The boom with `N` states: 6 angles, behind a lag 6 wanted rates, 2 energy integrals.
pub(super) struct Plant<'a, const N: usize>(pub(super) &'a Boom);

/// The states by their meaning.
struct Parts<S> {
    q: [S; JOINTS],
    w: Option<[S; JOINTS]>,
    drives: S,
    port: S,
}

fn parts<S: Scalar, const N: usize>(x: &[S; N]) -> Parts<S> {
    let six = |from: usize| std::array::from_fn(|i| x[from + i]);
    Parts { q: six(0), w: (N > JOINTS + 2).then(|| six(JOINTS)), drives: x[N - 2], port: x[N - 1] }
}

impl<const N: usize> Plant<'_, N> {
    /// Where a joint arrives next, and how far it is: the end ahead; behind a lag the nearer end.
    fn ahead(&self, i: usize, q: f64, u: f64) -> (f64, f64) {
        let (min, max) = (self.0.machine.min[i], self.0.machine.max[i]);
        let upper = if N > JOINTS + 2 { max - q < q - min } else { u > 0.0 };
        if upper { (max, max - q) } else { (min, q - min) }
    }

    /// Bring joints that have arrived exactly onto the end of their range; how many these are.
    fn arrive(&self, x: &mut [f64; N], command: &[f64; JOINTS], rest: &mut Rest) -> u64 {
        let u = finite(command);
        let mut arrivals = 0;
        for i in 0..JOINTS {
            let (end, way) = self.ahead(i, x[i], u[i]);
            let lag = N > JOINTS + 2;
            let outward = |rate: f64| if end > self.0.machine.min[i] { rate > 0.0 } else { rate < 0.0 };
            let wanted = if lag { x[JOINTS + i] } else { u[i] };
            rest.resting[i] = way <= ARRIVED && outward(u[i]) && (outward(wanted) || wanted.abs() <= 0.0);
            if way <= ARRIVED && (outward(wanted) || rest.resting[i]) {
                arrivals += u64::from(outward(wanted));
                x[i] = end;
                if lag {
                    x[JOINTS + i] = 0.0;
                }
            }
        }
        arrivals
    }

    /// Pose and rates for the outputs: joints at the ends of their ranges by angle and command alone.
    fn pose<S: Scalar>(&self, x: &[S; N], u: &Inputs<S>) -> Pose<S> {
        let Parts { q, w, .. } = parts(x);
        let resting = self.0.resting(&q, w.as_ref(), &u.command.0);
        self.0.pose(&q, w.as_ref(), &u.command.0, resting)
    }

    /// Second derivatives of the angles.
    fn accelerations<S: Scalar>(
        &self,
        pose: &Pose<S>,
        w: Option<&[S; JOINTS]>,
        u: &Inputs<S>,
    ) -> [S; JOINTS] {
        let w_dot = w.map(|w| self.0.lag(w, &u.command.0, self.0.resting(&pose.q, Some(w), &u.command.0)));
        self.0.accelerations(pose, w_dot.as_ref())
    }

    /// Work of drives and port per time [W].
    fn powers<S: Scalar>(
        &self,
        pose: &Pose<S>,
        w: Option<&[S; JOINTS]>,
        load: Option<&TipLoad<S>>,
        u: &Inputs<S>,
    ) -> [S; 2] {
        let F = pose.tip_force(load, || self.accelerations(pose, w, u));
        let strokes = pose.strokes.unwrap_or_else(|| self.0.strokes(&pose.q));
        let masses = self.0.masses.distribution(&pose.frames, &strokes);
        let gravity = self.0.masses.gradient(&pose.frames, &masses);
        let carried = pose.load_torques(&F);
        let drives = (0..JOINTS).fold(S::lift(0.0), |sum, i| sum + (gravity[i] + carried[i]) * pose.rate[i]);
        [drives, F.dot(&pose.velocities.v[JOINTS])]
    }
}

impl<const N: usize> System<N, JOINTS> for Plant<'_, N>
where
    Dense: Spectrum<N>,
{
    type Model = Boom;
    type Spectrum = Dense;

    fn start(&self, _t: f64, _given: &Motion<f64>) -> Result<([f64; N], Rest), ParameterError> {
        let mut x = [0.0; N];
        x[..JOINTS].copy_from_slice(&self.0.angle_start);
        Ok((x, Rest::default()))
    }

    fn settle(&self, x: &mut [f64; N], u: &Inputs<f64>, d: &Rest) -> Rest {
        let mut rest = Rest { bad_command: u.command.0.iter().any(|u| !u.is_finite()), ..*d };
        self.arrive(x, &u.command.0, &mut rest);
        rest
    }

    #[inline]
    fn rates<S: Scalar>(
        &self,
        _t: S,
        x: &[S; N],
        u: &Inputs<S>,
        d: &Rest,
    ) -> Result<[S; N], EvaluationError> {
        let Parts { q, w, .. } = parts(x);
        let load = checked_tip_load(u)?;
        let mut rates = [S::lift(0.0); N];
        if self.0.uses.energy {
            let pose = self.0.pose(&q, w.as_ref(), &u.command.0, d.resting);
            rates[..JOINTS].copy_from_slice(&pose.rate);
            rates[N - 2..].copy_from_slice(&self.powers(&pose, w.as_ref(), load.as_ref(), u));
        } else {
            let wanted = w.unwrap_or_else(|| finite(&u.command.0));
            let Limited { rate, .. } =
                self.0.limits.limit(&wanted, d.resting, &self.0.geometry(&q, None, None));
            rates[..JOINTS].copy_from_slice(&rate);
        }
        if let Some(w) = &w {
            rates[JOINTS..2 * JOINTS].copy_from_slice(&self.0.lag(w, &u.command.0, d.resting));
        }
        Ok(rates)
    }

    fn motion<S: Scalar>(
        &self,
        _t: S,
        x: &[S; N],
        u: &Inputs<S>,
        d: &Rest,
    ) -> Result<Motion<S>, EvaluationError> {
        let pose = self.pose(x, u);
        Ok(self.0.motion(&pose, &u.command.0, d))
    }

    fn inertia<S: Scalar>(
        &self,
        _t: S,
        x: &[S; N],
        u: &Inputs<S>,
        _d: &Rest,
    ) -> Result<Safety<S>, EvaluationError> {
        let load = tip_load(u);
        let Parts { q, w, .. } = parts(x);
        let frames = self.0.chain.frames(&q);
        let tip_force = (self.0.include_tip_force && load.is_some()).then(|| {
            let pose = self.pose(x, u);
            pose.tip_force(load.as_ref(), || self.accelerations(&pose, w.as_ref(), u)).z
        });
        Ok(self.0.safety(&frames, &self.0.strokes(&q), tip_force))
    }

    fn dynamics<S: Scalar>(
        &self,
        _t: S,
        x: &[S; N],
        u: &Inputs<S>,
        _d: &Rest,
    ) -> Result<Dynamics<S>, EvaluationError> {
        let load = checked_tip_load(u)?;
        let pose = self.pose(x, u);
        let q_ddot = self.accelerations(&pose, parts(x).w.as_ref(), u);
        let F = pose.tip_force(load.as_ref(), || q_ddot);
        Ok(self.0.dynamics(&pose, &q_ddot, &F))
    }

    fn energy<S: Scalar>(
        &self,
        _t: S,
        x: &[S; N],
        _u: &Inputs<S>,
        _d: &Rest,
    ) -> Result<Energy<S>, EvaluationError> {
        let Parts { q, drives, port, .. } = parts(x);
        let frames = self.0.chain.frames(&q);
        let masses = self.0.masses.distribution(&frames, &self.0.strokes(&q));
        let zero = S::lift(0.0);
        let potential = self.0.masses.potential(&masses);
        Ok(Energy { potential, kinetic: zero, supplied: drives + port, dissipated: zero, port })
    }

    fn longest_step(&self, x: &[f64; N], u: &Inputs<f64>, d: &Rest) -> f64 {
        if !self.0.limits.active {
            return f64::INFINITY;
        }
        let (Parts { q, w, .. }, aim) = (parts(x), self.0.clipped(&u.command.0));
        let geometry = self.0.geometry(&q, None, None);
        let fastest = |wanted: &[f64; JOINTS]| {
            let rates = self.0.limits.limit(wanted, d.resting, &geometry).rate;
            rates.into_iter().fold(0.0_f64, |most, rate| most.max(rate.abs()))
        };
        TURN / fastest(&aim).max(w.map_or(0.0, |w| fastest(&w)))
    }

    fn state_names(&self) -> [String; N] {
        std::array::from_fn(|i| match i {
            i if i < JOINTS => format!("joint[{}].angle", i + 1),
            i if i + 2 == N => "energy.supplied".into(),
            i if i + 1 == N => "energy.port".into(),
            i => format!("joint[{}] behind its lag", i - JOINTS + 1),
        })
    }

    fn nominals(&self) -> [f64; N] {
        std::array::from_fn(|i| if i + 2 >= N { f64::INFINITY } else { 1.0 })
    }

    fn indicators(&self, _t: f64, x: &[f64; N], u: &Inputs<f64>, d: &Rest) -> [f64; JOINTS] {
        let command = finite(&u.command.0);
        std::array::from_fn(|i| {
            let still = N <= JOINTS + 2 && command[i].abs() <= 0.0;
            if d.resting[i] || still { 1.0 } else { SCALE * self.ahead(i, x[i], command[i]).1 }
        })
    }

    fn update(&self, _t: f64, x: &mut [f64; N], u: &Inputs<f64>, d: &Rest) -> Rest {
        let mut rest = *d;
        let before = d.resting;
        let arrivals = self.arrive(x, &u.command.0, &mut rest);
        let stayed = (0..JOINTS).filter(|i| before[*i] && rest.resting[*i]).count() as u64;
        rest.events += if N > JOINTS + 2 { arrivals } else { arrivals - stayed };
        rest
    }
}
