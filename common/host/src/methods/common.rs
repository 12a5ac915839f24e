//! Method `common`: the states of all FMUs in one vector, one integrator, Model Exchange.

use std::ops::Range;

use integrators::{DynamicOde, ExplicitSolver, NotExplicit, Settings, StepError};

use super::{Clock, Config, Progress, Steps, events};
use crate::error::{Error, RunError};
use crate::import::{Fault, Status};
use crate::record::Recorder;
use crate::scene::SceneError;
use crate::start;
use crate::sweep::Sweeper;

/// Width to which a state event is located, relative to the step.
const EVENT_WIDTH: f64 = 1e-12;

/// Runs from start to stop.
pub(super) fn run(
    sweeper: &mut Sweeper,
    config: &Config,
    recorder: &mut Recorder,
    progress: Progress<'_>,
) -> Result<Steps, Error> {
    start::initialise(sweeper, config)?;
    let mut run = Run::start(sweeper, config)?;
    recorder.offer(run.ode.sweeper, config, run.t)?;
    let begin = Clock::start();
    while run.t < config.stop {
        run.step(config, recorder)?;
        progress(run.t);
    }
    let (seconds, cpu) = begin.read();
    let statistics = run.solver.statistics;
    Ok(Steps {
        accepted: statistics.steps,
        rejected: statistics.rejected,
        rhs_evaluations: statistics.rhs_evaluations,
        events: run.events,
        gap: recorder.gap(),
        seconds,
        cpu,
    })
}

/// The right-hand side of the whole scene.
struct Whole<'a> {
    sweeper: &'a mut Sweeper,
    ranges: Vec<Range<usize>>,
}

impl DynamicOde for Whole<'_> {
    type Error = RunError;

    #[inline]
    fn rhs(&mut self, t: f64, x: &[f64], dx: &mut [f64]) -> Result<(), RunError> {
        self.place(t, x)?;
        self.sweeper.sweep()?;
        for node in 0..self.ranges.len() {
            let range = self.ranges[node].clone();
            if !range.is_empty() {
                self.sweeper.instances[node]
                    .get_derivatives(&mut dx[range])
                    .map_err(|fault| self.sweeper.failed(node, fault))?;
            }
        }
        Ok(())
    }
}

impl Whole<'_> {
    /// Time and states into the FMUs.
    #[inline]
    fn place(&mut self, t: f64, x: &[f64]) -> Result<(), RunError> {
        let moved = t.to_bits() != self.sweeper.t.to_bits();
        self.sweeper.t = t;
        for (node, range) in self.ranges.iter().enumerate() {
            let instance = &mut self.sweeper.instances[node];
            let mut result = if moved { instance.set_time(t) } else { Ok(()) };
            if result.is_ok() && !range.is_empty() {
                result = instance.set_states(&x[range.clone()]);
            }
            result.map_err(|fault| self.sweeper.failed(node, fault))?;
        }
        Ok(())
    }

    /// States out of the FMUs.
    fn fetch(&mut self, x: &mut [f64]) -> Result<(), RunError> {
        let ranges = &self.ranges;
        self.sweeper.each(|node, instance| match ranges[node].clone() {
            range if range.is_empty() => Ok(()),
            range => instance.get_states(&mut x[range]),
        })
    }
}

struct Run<'a> {
    ode: Whole<'a>,
    solver: ExplicitSolver,
    t: f64,
    x: Vec<f64>,
    /// Next time event [s]
    next_event: Option<f64>,
    /// Event indicators of each FMU
    indicators: Vec<Range<usize>>,
    z: Vec<f64>,
    z_new: Vec<f64>,
    inside: Vec<f64>,
    slope: Vec<f64>,
    before: Vec<f64>,
    grid: u64,
    events: u64,
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

impl<'a> Run<'a> {
    fn start(sweeper: &'a mut Sweeper, config: &Config) -> Result<Self, Error> {
        let happened = events::update(sweeper)?;
        sweeper.each(|_, instance| instance.enter_continuous_time_mode())?;
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
        let solver = ExplicitSolver::new(settings, nominal).map_err(refused)?;
        let before = sweeper.values.clone();
        let mut run = Self {
            ode: Whole { sweeper, ranges: state_ranges },
            solver,
            t: config.start,
            x: vec![0.0; n],
            next_event: happened.next,
            indicators,
            z: vec![0.0; m],
            z_new: vec![0.0; m],
            inside: vec![0.0; n],
            slope: vec![0.0; n],
            before,
            grid: 0,
            events: 0,
        };
        run.ode.fetch(&mut run.x)?;
        run.read_indicators()?;
        std::mem::swap(&mut run.z, &mut run.z_new);
        Ok(run)
    }

    /// The event indicators at the present time into `z_new`.
    fn read_indicators(&mut self) -> Result<(), RunError> {
        let (ranges, z) = (&self.indicators, &mut self.z_new);
        self.ode.sweeper.each(|node, instance| match ranges[node].clone() {
            range if range.is_empty() => Ok(()),
            range => instance.get_indicators(&mut z[range]),
        })
    }

    /// The furthest time of the next step: grid of fixed steps, time event, stop.
    fn target(&mut self, config: &Config) -> f64 {
        let mut target = config.stop;
        if let (false, Some(step)) = (self.solver.is_adaptive(), config.step) {
            while config.point(self.grid, step) <= self.t + 1e-9 * step && self.t < config.stop {
                self.grid += 1;
            }
            target = target.min(config.point(self.grid, step));
        }
        match self.next_event {
            Some(event) if event > self.t => target.min(event),
            _ => target,
        }
    }

    fn step(&mut self, config: &Config, recorder: &mut Recorder) -> Result<(), Error> {
        let target = self.target(config);
        let mut t = self.solver.step(&mut self.ode, self.t, &self.x, target).map_err(integrator)?;
        let mut crossed = false;
        let mut moved = false;
        if !self.z.is_empty() {
            self.solver.slope(&mut self.ode).map_err(integrator)?;
            self.read_indicators()?;
            if self.has_crossed() {
                t = self.locate(t)?;
                crossed = true;
            }
        }
        while let Some(sample) = recorder.due_before(config, t) {
            let theta = (sample - self.t) / self.solver.interval().1;
            self.solver.inside(&mut self.ode, theta, &mut self.inside).map_err(integrator)?;
            self.ode.place(sample, &self.inside)?;
            self.ode.sweeper.sweep()?;
            recorder.record(self.ode.sweeper, sample)?;
            moved = true;
        }
        if crossed {
            // `inside` may have been used for samples: the state at the event stands in x
            self.ode.rhs(t, &self.x, &mut self.slope)?;
        } else {
            self.x.copy_from_slice(self.solver.state());
            self.solver.slope(&mut self.ode).map_err(integrator)?;
            if moved {
                self.ode.rhs(t, &self.x, &mut self.slope)?;
            }
        }
        self.t = t;
        self.complete(crossed)?;
        recorder.offer(self.ode.sweeper, config, t)?;
        Ok(())
    }

    fn has_crossed(&self) -> bool {
        self.z.iter().zip(&self.z_new).any(|(a, b)| a * b < 0.0)
    }

    /// The first crossing inside the last step by bisection, each time with a step of the method; leaves the state just
    /// behind it in `x` and the indicators in `z_new`.
    fn locate(&mut self, t_end: f64) -> Result<f64, Error> {
        let (start, h) = self.solver.interval();
        let (mut lo, mut hi) = (0.0, 1.0);
        let width = EVENT_WIDTH.max(4.0 * f64::EPSILON * start.abs().max(t_end.abs()) / h);
        while hi - lo > width {
            let theta = 0.5 * (lo + hi);
            self.solver.repeat(&mut self.ode, theta, &mut self.inside).map_err(integrator)?;
            self.ode.rhs(start + theta * h, &self.inside, &mut self.slope)?;
            self.read_indicators()?;
            if self.has_crossed() { hi = theta } else { lo = theta }
        }
        self.solver.repeat(&mut self.ode, hi, &mut self.inside).map_err(integrator)?;
        self.x.copy_from_slice(&self.inside);
        Ok(if hi >= 1.0 { t_end } else { start + hi * h })
    }

    /// The step counts: FMUs hear of it, events are carried out.
    fn complete(&mut self, crossed: bool) -> Result<(), Error> {
        let mut event = crossed || self.next_event.is_some_and(|event| event <= self.t);
        for node in 0..self.ode.sweeper.instances.len() {
            let instance = &mut self.ode.sweeper.instances[node];
            if instance.capabilities().completed_steps {
                let (wanted, terminate) =
                    instance.completed_step().map_err(|fault| self.ode.sweeper.failed(node, fault))?;
                if terminate {
                    let fault = Fault { function: "CompletedIntegratorStep", status: Status::Terminate };
                    return Err(self.ode.sweeper.failed(node, fault).into());
                }
                event |= wanted;
            }
        }
        if event {
            self.event()?;
        } else {
            std::mem::swap(&mut self.z, &mut self.z_new);
        }
        Ok(())
    }

    fn event(&mut self) -> Result<(), Error> {
        self.events += 1;
        let sweeper = &mut *self.ode.sweeper;
        self.before.copy_from_slice(&sweeper.values);
        sweeper.each(|_, instance| instance.enter_event_mode())?;
        let happened = events::update(sweeper)?;
        // states may have jumped: all signals once more
        sweeper.sweep()?;
        sweeper.each(|_, instance| instance.enter_continuous_time_mode())?;
        self.next_event = happened.next;
        let jumped = self.before.iter().zip(&sweeper.values).any(|(a, b)| a.to_bits() != b.to_bits());
        if happened.states_changed {
            self.ode.fetch(&mut self.x)?;
        }
        if happened.states_changed || jumped {
            self.solver.restart();
        } else {
            self.solver.changed();
        }
        self.read_indicators()?;
        std::mem::swap(&mut self.z, &mut self.z_new);
        Ok(())
    }
}

fn integrator(error: StepError<RunError>) -> Error {
    match error {
        StepError::Rhs { source, .. } => Error::Run(source),
        other => Error::Run(RunError::Integrator(other.to_string())),
    }
}

fn refused(error: NotExplicit) -> Error {
    let wanted = error.to_string();
    SceneError::Setting { name: "integrator", value: String::new(), wanted }.into()
}
