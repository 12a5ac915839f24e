//! The solver: settings and the little that a call leaves for the next one.

use serde::{Deserialize, Serialize};

use crate::adaptive::adaptive;
use crate::dop853::Dop853;
use crate::dopri5::DOPRI5;
use crate::events::{Indicators, Monitor, Reached};
use crate::exact::{Exact, Transition};
use crate::fixed::fixed;
use crate::heun::HEUN;
use crate::norm::Norm;
use crate::one_step::{Call, OneStep};
use crate::radau5::{self, Radau5};
use crate::rk4::RK4;
use crate::rodas4::{self, Rodas4};
use crate::run::{Run, Show, Unwatched, Watch};
use crate::{Dense, Method, Ode, Settings, SettingsError, Statistics, StepError};

/// What an adaptive method remembers from call to call; fixed-step methods remember nothing.
///
/// Part of a saved state: with it a run goes on bit by bit as if it had not been interrupted.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Memory {
    /// Next step size [s]; 0: none yet, the next call guesses one.
    pub step: f64,
    /// Error of the last step in units of the tolerance.
    pub error: f64,
}

impl Default for Memory {
    fn default() -> Self {
        Self { step: 0.0, error: 1e-4 }
    }
}

/// Integrates initial value problems with one method.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Solver {
    settings: Settings,
    memory: Memory,
}

impl Solver {
    /// A solver without a past.
    ///
    /// # Errors
    /// A step size or tolerance that is not finite and positive.
    pub fn new(settings: Settings) -> Result<Self, SettingsError> {
        Ok(Self { settings: settings.check()?, memory: Memory::default() })
    }

    /// What the solver was made with.
    #[must_use]
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// A solver with the same tolerances, step size and memory, and another method.
    #[must_use]
    pub fn with_method(&self, method: Method) -> Self {
        Self { settings: Settings { method, ..self.settings }, memory: self.memory }
    }

    /// For a saved state.
    #[must_use]
    pub fn memory(&self) -> Memory {
        self.memory
    }

    /// Goes on from a saved state.
    pub fn restore(&mut self, memory: Memory) {
        self.memory = memory;
    }

    /// Forgets the proposed step size: after a jump of the state or of an input.
    pub fn reset(&mut self) {
        self.memory = Memory::default();
    }

    /// Integrates `x` from `t` to exactly `t_end`.
    ///
    /// A fixed-step method takes `n = max(1, ceil(H/step - 1e-9))` equal steps of `H = t_end - t`; an adaptive
    /// one chooses its steps and cuts the last two so that no tiny rest is left.
    ///
    /// # Errors
    /// See [`StepError`]. Then `x`, the statistics and the solver's memory are as before the call.
    #[inline]
    pub fn advance<const N: usize, O: Ode<N>>(
        &mut self,
        ode: &O,
        t: f64,
        t_end: f64,
        x: &mut [f64; N],
        statistics: &mut Statistics,
    ) -> Result<(), StepError<O::Error>> {
        self.run(ode, [t, t_end], x, statistics, &mut Unwatched, None).map(|_| ())
    }

    /// As [`advance`](Self::advance), and the method `exact` keeps its matrices in `cache` for the next call.
    ///
    /// # Errors
    /// As [`advance`](Self::advance); the cache then may have changed and still holds.
    pub fn advance_cached<const N: usize, O: Ode<N>>(
        &mut self,
        ode: &O,
        cache: &mut Transition<N>,
        t: f64,
        t_end: f64,
        x: &mut [f64; N],
        statistics: &mut Statistics,
    ) -> Result<(), StepError<O::Error>> {
        self.run(ode, [t, t_end], x, statistics, &mut Unwatched, Some(cache)).map(|_| ())
    }

    /// As [`advance`](Self::advance), and shows the dense output of every accepted step to `each`.
    ///
    /// # Errors
    /// As [`advance`](Self::advance); `each` has then seen the steps before the error.
    pub fn advance_dense<const N: usize, O: Ode<N>>(
        &mut self,
        ode: &O,
        t: f64,
        t_end: f64,
        x: &mut [f64; N],
        statistics: &mut Statistics,
        each: impl FnMut(&Dense<N>),
    ) -> Result<(), StepError<O::Error>> {
        self.run(ode, [t, t_end], x, statistics, &mut Show(each), None).map(|_| ())
    }

    /// As [`advance`](Self::advance), but stops just after the first zero crossing of any indicator.
    ///
    /// What counts as a crossing, also at the very start and end, is said at [`Indicators`]. After an event that
    /// changes the state, call [`reset`](Self::reset).
    ///
    /// # Errors
    /// As [`advance`](Self::advance), and an indicator that is not finite.
    pub fn advance_until<const N: usize, const M: usize, O: Ode<N>, E: Indicators<N, M>>(
        &mut self,
        ode: &O,
        events: &E,
        t: f64,
        t_end: f64,
        x: &mut [f64; N],
        statistics: &mut Statistics,
    ) -> Result<Reached<M>, StepError<O::Error>> {
        let mut monitor = Monitor::new(events);
        let t = self.run(ode, [t, t_end], x, statistics, &mut monitor, None)?;
        Ok(monitor.which.map_or(Reached::End, |which| Reached::Event { t, which }))
    }

    /// Works on copies and hands them over when all went well; the result is the time reached.
    #[inline]
    fn run<const N: usize, O: Ode<N>, W: Watch<N>>(
        &mut self,
        ode: &O,
        [t, t_end]: [f64; 2],
        x: &mut [f64; N],
        statistics: &mut Statistics,
        watch: &mut W,
        cache: Option<&mut Transition<N>>,
    ) -> Result<f64, StepError<O::Error>> {
        if !(t.is_finite() && t_end.is_finite() && t <= t_end) {
            return Err(StepError::Interval { t, t_end });
        }
        if t >= t_end {
            return Ok(t);
        }
        let mut call = Called {
            settings: self.settings,
            memory: self.memory,
            ode,
            run: Run { t, x: *x },
            statistics: *statistics,
            t_end,
            watch,
        };
        match self.settings.method {
            Method::Heun => call.with(&HEUN, &mut ())?,
            Method::Rk4 => call.with(&RK4, &mut ())?,
            Method::Dopri5 => call.with(&DOPRI5, &mut ())?,
            Method::Dop853 => call.with(&Dop853, &mut ())?,
            Method::Rodas4 => call.with(&Rodas4, &mut rodas4::Work::default())?,
            Method::Radau5 => call.with(&Radau5, &mut radau5::Work::default())?,
            Method::Exact if !ode.linear() => return Err(StepError::NotLinear { t }),
            Method::Exact => match cache {
                Some(cache) => call.with(&Exact, cache)?,
                None => call.with(&Exact, &mut Transition::default())?,
            },
        }
        *x = call.run.x;
        *statistics = call.statistics;
        self.memory = call.memory;
        Ok(call.run.t)
    }
}

/// Working copies of a call.
struct Called<'a, const N: usize, O, W> {
    settings: Settings,
    memory: Memory,
    ode: &'a O,
    run: Run<N>,
    statistics: Statistics,
    t_end: f64,
    watch: &'a mut W,
}

impl<const N: usize, O: Ode<N>, W: Watch<N>> Called<'_, N, O, W> {
    /// Carries out the call with one method.
    #[inline]
    fn with<M: OneStep<N>>(&mut self, method: &M, work: &mut M::Work) -> Result<(), StepError<O::Error>> {
        let Self { settings, run, t_end, watch, .. } = self;
        let mut call = Call {
            ode: self.ode,
            norm: Norm::new(self.ode, settings, method.tolerance(settings.rtol)),
            statistics: self.statistics,
            work,
        };
        if settings.method.is_adaptive() {
            adaptive(method, &mut self.memory, &mut call, run, *t_end, *watch)?;
        } else {
            fixed(method, settings, &mut call, run, *t_end, *watch)?;
        }
        self.statistics = call.statistics;
        Ok(())
    }
}
