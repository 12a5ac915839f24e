//! A run that can be stopped between two steps of the integrator.

use std::ops::Range;

use integrators::{DynamicOde, DynamicSolver, DynamicState, Settings, Statistics};
use serde::{Deserialize, Serialize};

use super::{Whole, integrator, refused};
use crate::error::{Error, RunError};
use crate::import::{Fault, Status};
use crate::methods::{Config, events};
use crate::sweep::Sweeper;

/// Width to which a state event is located, relative to the step.
const EVENT_WIDTH: f64 = 1e-12;

/// A step of the integrator that does not count yet: nothing beyond its start was told to the FMUs for good.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Ahead {
    /// Its end [s]
    t: f64,
    /// An event indicator has crossed zero there
    crossed: bool,
    /// The FMUs hold states inside the step
    moved: bool,
}

/// A run between two steps of the integrator.
pub(crate) struct Run {
    ranges: Vec<Range<usize>>,
    pub(super) solver: DynamicSolver,
    /// How far the steps count [s]
    pub(crate) t: f64,
    x: Vec<f64>,
    /// Next time event [s]
    pub(crate) next_event: Option<f64>,
    /// Event indicators of each FMU
    indicators: Vec<Range<usize>>,
    z: Vec<f64>,
    z_new: Vec<f64>,
    inside: Vec<f64>,
    /// State at the event that ends the step ahead
    at_event: Vec<f64>,
    slope: Vec<f64>,
    before: Vec<f64>,
    grid: u64,
    pub(super) events: u64,
    ahead: Option<Ahead>,
}

/// What goes on in a run, for a saved state.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct RunState {
    t: f64,
    x: Vec<f64>,
    next_event: Option<f64>,
    z: Vec<f64>,
    z_new: Vec<f64>,
    at_event: Vec<f64>,
    before: Vec<f64>,
    grid: u64,
    events: u64,
    ahead: Option<Ahead>,
    solver: DynamicState,
}

/// Consecutive ranges of given lengths.
fn ranges(lengths: impl Iterator<Item = usize>) -> Vec<Range<usize>> {
    let mut end = 0;
    lengths
        .map(|n| {
            end += n;
            end - n..end
        })
        .collect()
}

impl Run {
    /// Begins a run; the FMUs have been initialised.
    pub(crate) fn start(sweeper: &mut Sweeper, config: &Config) -> Result<Self, Error> {
        let happened = events::update(sweeper, false)?;
        sweeper.each(|_, instance| instance.enter_continuous_time_mode())?;
        let mut run = Self::of(sweeper, config)?;
        run.next_event = happened.next;
        Whole { sweeper, ranges: &run.ranges }.fetch(&mut run.x)?;
        run.read_indicators(sweeper)?;
        std::mem::swap(&mut run.z, &mut run.z_new);
        Ok(run)
    }

    /// Goes on with a run that was saved; the FMUs are in the states that belong to it.
    ///
    /// None if the state has other sizes.
    pub(crate) fn resume(
        sweeper: &mut Sweeper,
        config: &Config,
        state: &RunState,
    ) -> Result<Option<Self>, Error> {
        let mut run = Self::of(sweeper, config)?;
        if !run.fits(state) {
            return Ok(None);
        }
        run.restore(state);
        Ok(Some(run))
    }

    /// A run without states.
    fn of(sweeper: &mut Sweeper, config: &Config) -> Result<Self, Error> {
        let state_ranges = ranges(sweeper.instances.iter().map(|i| i.fmu().description.states.len()));
        let n = state_ranges.last().map_or(0, |r| r.end);
        let mut counts = Vec::new();
        sweeper.each(|_, instance| instance.number_of_indicators().map(|n| counts.push(n)))?;
        let indicators = ranges(counts.into_iter());
        let m = indicators.last().map_or(0, |r| r.end);
        let mut nominal = vec![1.0; n];
        sweeper.each(|node, instance| instance.get_nominals(&mut nominal[state_ranges[node].clone()]))?;
        let settings = Settings {
            method: config.integrator,
            step: config.step.unwrap_or(config.stop - config.start),
            rtol: config.rtol,
            atol: config.atol,
        };
        Ok(Self {
            solver: DynamicSolver::new(settings, nominal).map_err(refused)?,
            before: sweeper.values.clone(),
            ranges: state_ranges,
            t: config.start,
            x: vec![0.0; n],
            next_event: None,
            indicators,
            z: vec![0.0; m],
            z_new: vec![0.0; m],
            inside: vec![0.0; n],
            at_event: vec![0.0; n],
            slope: vec![0.0; n],
            grid: 0,
            events: 0,
            ahead: None,
        })
    }

    /// What goes on.
    pub(crate) fn save(&self) -> RunState {
        let Self { t, x, next_event, z, z_new, at_event, before, grid, events, ahead, solver, .. } = self;
        RunState {
            x: x.clone(),
            z: z.clone(),
            z_new: z_new.clone(),
            at_event: at_event.clone(),
            before: before.clone(),
            solver: solver.save(),
            t: *t,
            next_event: *next_event,
            grid: *grid,
            events: *events,
            ahead: *ahead,
        }
    }

    /// Goes back to what went on.
    pub(crate) fn restore(&mut self, state: &RunState) {
        self.x.clone_from(&state.x);
        self.z.clone_from(&state.z);
        self.z_new.clone_from(&state.z_new);
        self.at_event.clone_from(&state.at_event);
        self.before.clone_from(&state.before);
        self.solver.restore(&state.solver);
        (self.t, self.next_event) = (state.t, state.next_event);
        (self.grid, self.events, self.ahead) = (state.grid, state.events, state.ahead);
    }

    /// Whether a saved state may be one of this run.
    fn fits(&self, state: &RunState) -> bool {
        let n = self.x.len();
        state.x.len() == n
            && state.z.len() == self.z.len()
            && state.z_new.len() == self.z.len()
            && state.at_event.len() == n
            && state.before.len() == self.before.len()
            && self.solver.fits(&state.solver)
    }

    /// The integrator forgets its past: after a jump that it does not see.
    pub(crate) fn restart(&mut self) {
        self.solver.restart();
    }

    /// Counters of the integrator.
    pub(crate) fn statistics(&self) -> Statistics {
        self.solver.statistics()
    }

    /// How far the equations are solved, whether the last step counts or not [s].
    pub(crate) fn reached(&self) -> f64 {
        self.ahead.map_or(self.t, |ahead| ahead.t)
    }

    /// A step is solved that does not count yet.
    pub(crate) fn is_ahead(&self) -> bool {
        self.ahead.is_some()
    }

    /// The event indicators at the present time into `z_new`.
    fn read_indicators(&mut self, sweeper: &mut Sweeper) -> Result<(), RunError> {
        let (ranges, z) = (&self.indicators, &mut self.z_new);
        sweeper.each(|node, instance| match ranges[node].clone() {
            range if range.is_empty() => Ok(()),
            range => instance.get_indicators(&mut z[range]),
        })
    }

    /// The furthest time of the next step: grid of fixed steps, time event, `limit`.
    fn target(&mut self, config: &Config, limit: f64) -> f64 {
        let mut target = limit;
        if let (false, Some(step)) = (self.solver.is_adaptive(), config.step) {
            while config.point(self.grid, step) <= self.t + 1e-9 * step && self.t < config.stop {
                self.grid += 1;
            }
            let point = config.point(self.grid, step);
            if point <= limit - 1e-9 * step {
                target = point;
            }
        }
        match self.next_event {
            Some(event) if event > self.t => target.min(event),
            _ => target,
        }
    }

    /// Solves the next step, not beyond `limit`; it does not count yet.
    pub(crate) fn advance(
        &mut self,
        sweeper: &mut Sweeper,
        config: &Config,
        limit: f64,
    ) -> Result<(), Error> {
        let target = self.target(config, limit);
        let mut ode = Whole { sweeper, ranges: &self.ranges };
        let mut t = self.solver.step(&mut ode, self.t, &self.x, target).map_err(integrator)?;
        let mut crossed = false;
        if !self.z.is_empty() {
            self.solver.slope(&mut ode).map_err(integrator)?;
            self.read_indicators(sweeper)?;
            if self.has_crossed() {
                t = self.locate(sweeper, t)?;
                crossed = true;
            }
        }
        self.ahead = Some(Ahead { t, crossed, moved: crossed });
        Ok(())
    }

    /// Brings the FMUs to the time `t` inside the step that was solved last.
    pub(crate) fn look(&mut self, sweeper: &mut Sweeper, t: f64) -> Result<(), Error> {
        let mut ode = Whole { sweeper, ranges: &self.ranges };
        let theta = (t - self.t) / self.solver.interval().1;
        self.solver.inside(&mut ode, theta, &mut self.inside).map_err(integrator)?;
        ode.place(t, &self.inside)?;
        sweeper.sweep()?;
        if let Some(ahead) = &mut self.ahead {
            ahead.moved = true;
        }
        Ok(())
    }

    /// The step solved last counts: the FMUs are brought to its end and hear of it, events are carried out.
    pub(crate) fn accept(&mut self, sweeper: &mut Sweeper) -> Result<(), Error> {
        let Some(Ahead { t, crossed, moved }) = self.ahead.take() else { return Ok(()) };
        let mut ode = Whole { sweeper, ranges: &self.ranges };
        if crossed {
            self.x.copy_from_slice(&self.at_event);
        } else {
            self.x.copy_from_slice(self.solver.state());
            self.solver.slope(&mut ode).map_err(integrator)?;
        }
        if moved {
            ode.rhs(t, &self.x, &mut self.slope)?;
        }
        self.t = t;
        self.complete(sweeper, crossed)
    }

    fn has_crossed(&self) -> bool {
        self.z.iter().zip(&self.z_new).any(|(a, b)| a * b < 0.0)
    }

    /// The first crossing inside the last step by bisection, each time with a step of the method; leaves the state just
    /// behind it in `at_event` and the indicators in `z_new`.
    fn locate(&mut self, sweeper: &mut Sweeper, t_end: f64) -> Result<f64, Error> {
        let (start, h) = self.solver.interval();
        let (mut lo, mut hi) = (0.0, 1.0);
        let width = EVENT_WIDTH.max(4.0 * f64::EPSILON * start.abs().max(t_end.abs()) / h);
        while hi - lo > width {
            let theta = 0.5 * (lo + hi);
            let mut ode = Whole { sweeper, ranges: &self.ranges };
            self.solver.repeat(&mut ode, theta, &mut self.inside).map_err(integrator)?;
            ode.rhs(start + theta * h, &self.inside, &mut self.slope)?;
            self.read_indicators(sweeper)?;
            if self.has_crossed() { hi = theta } else { lo = theta }
        }
        let mut ode = Whole { sweeper, ranges: &self.ranges };
        self.solver.repeat(&mut ode, hi, &mut self.at_event).map_err(integrator)?;
        Ok(if hi >= 1.0 { t_end } else { start + hi * h })
    }

    /// FMUs hear of the end of a step, events are carried out.
    fn complete(&mut self, sweeper: &mut Sweeper, crossed: bool) -> Result<(), Error> {
        let mut event = crossed || self.next_event.is_some_and(|event| event <= self.t);
        for node in 0..sweeper.instances.len() {
            let instance = &mut sweeper.instances[node];
            if instance.capabilities().completed_steps {
                let (wanted, terminate) =
                    instance.completed_step().map_err(|fault| sweeper.failed(node, fault))?;
                if terminate {
                    let fault = Fault { function: "CompletedIntegratorStep", status: Status::Terminate };
                    return Err(sweeper.failed(node, fault).into());
                }
                event |= wanted;
            }
        }
        if event {
            self.events += 1;
            self.enter_event_mode(sweeper)?;
            self.leave_event_mode(sweeper)?;
        } else {
            std::mem::swap(&mut self.z, &mut self.z_new);
        }
        Ok(())
    }

    /// Into Event Mode of all FMUs, where what changes at events only may be set.
    pub(crate) fn enter_event_mode(&mut self, sweeper: &mut Sweeper) -> Result<(), Error> {
        self.before.copy_from_slice(&sweeper.values);
        Ok(sweeper.each(|_, instance| instance.enter_event_mode())?)
    }

    /// Carries out the event and goes on with Continuous-Time Mode.
    pub(crate) fn leave_event_mode(&mut self, sweeper: &mut Sweeper) -> Result<(), Error> {
        let happened = events::update(sweeper, false)?;
        // states may have jumped: all signals once more
        sweeper.sweep()?;
        sweeper.each(|_, instance| instance.enter_continuous_time_mode())?;
        self.next_event = happened.next;
        // a zero that changes its sign is no jump
        let jumped = self.before.iter().zip(&sweeper.values).any(|(a, b)| (a - b).abs() > 0.0);
        if happened.states_changed {
            Whole { sweeper, ranges: &self.ranges }.fetch(&mut self.x)?;
        }
        if happened.states_changed || jumped {
            self.solver.restart();
        } else {
            self.solver.changed();
        }
        self.read_indicators(sweeper)?;
        std::mem::swap(&mut self.z, &mut self.z_new);
        Ok(())
    }

    /// Inputs change at `t`: a step that does not count ends there, the FMUs stand there with the inputs of the sweeper.
    pub(crate) fn turn(&mut self, sweeper: &mut Sweeper, t: f64) -> Result<(), Error> {
        let mut ode = Whole { sweeper, ranges: &self.ranges };
        if self.ahead.take().is_some() {
            let theta = (t - self.t) / self.solver.interval().1;
            self.solver.inside(&mut ode, theta, &mut self.inside).map_err(integrator)?;
            self.x.copy_from_slice(&self.inside);
            self.t = t;
        }
        self.solver.changed();
        ode.rhs(self.t, &self.x, &mut self.slope)?;
        self.read_indicators(sweeper)?;
        std::mem::swap(&mut self.z, &mut self.z_new);
        Ok(())
    }
}
