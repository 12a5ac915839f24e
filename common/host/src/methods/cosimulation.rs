//! Method `cs`: FMUs with their own solvers, a sweep in Event Mode at every communication point.
//!
//! ```text
//! predict   step with extrapolated inputs, sweep
//! pece      step with extrapolated inputs, sweep; back; step with the inputs of the end, sweep
//! error     max |x_C - x_P| / (atol + rtol |x|) / 3 over positions and velocities of all ports
//! ```
//! Without a given step that of pece follows the error, see `step_control.rs`; samples are then communication points,
//! whether they are recorded or not. FMUs without Event Mode answer sweeps by their linear response.

use super::exchange::do_step;
use super::inputs::{Inputs, Treatment};
use super::step_control::StepControl;
use super::{Clock, Config, MethodKind, Progress, Steps, events};
use crate::error::{Error, RunError};
use crate::import::{Instance, Saved};
use crate::record::Recorder;
use crate::scene::SceneError;
use crate::start;
use crate::sweep::Sweeper;

/// Times that differ by less than this part of a step are one.
const SAME_TIME: f64 = 1e-9;
/// Part of the estimate: the error is this part of the difference of predictor and corrector.
const ESTIMATE: f64 = 1.0 / 3.0;

/// Runs from start to stop.
pub(super) fn run(
    sweeper: &mut Sweeper,
    config: &Config,
    recorder: &mut Recorder,
    progress: Progress<'_>,
) -> Result<Steps, Error> {
    check(sweeper, config)?;
    let inputs = Inputs::of(sweeper);
    inputs.set_all(sweeper, Treatment::Extrapolate, config.order)?;
    start::initialise(sweeper, config)?;
    for node in 0..sweeper.instances.len() {
        if !sweeper.instances[node].has_event_mode() {
            sweeper.answer_linearly(node);
        }
    }
    sweeper.observe_responses()?;
    let mut run = Run {
        saved: (0..sweeper.instances.len()).map(|_| None).collect(),
        inputs,
        config: *config,
        t: config.start,
        found: Vec::new(),
        kept: Vec::new(),
        predicted: Vec::new(),
        steps: Steps::default(),
        control: StepControl::new(config),
        grid: 0,
        sample: 0,
        next_event: None,
        event_wanted: false,
        sweeper,
    };
    run.update(false)?;
    recorder.offer(run.sweeper, config, run.t)?;
    let begin = Clock::start();
    let mut result = Ok(());
    while result.is_ok() && run.t < config.stop {
        result = run.advance(recorder);
        progress(run.t);
    }
    (run.steps.seconds, run.steps.cpu) = begin.read();
    run.forget()?;
    result?;
    run.steps.gap = recorder.gap();
    Ok(run.steps)
}

/// All FMUs offer what the method needs.
fn check(sweeper: &Sweeper, config: &Config) -> Result<(), SceneError> {
    for (node, (name, instance)) in sweeper.names.iter().zip(&sweeper.instances).enumerate() {
        let lacks = |wanted| SceneError::Capability {
            method: config.method.name().into(),
            component: name.clone(),
            fmu: instance.fmu().description.name.clone(),
            wanted,
        };
        if !instance.has_event_mode() && !sweeper.can_answer_linearly(node) {
            return Err(lacks("Event Mode or directional derivatives; jacobi and seidel do without"));
        }
        if config.method == MethodKind::CsPece && !instance.capabilities().state_saving {
            return Err(lacks("saving of its state (canGetAndSetFMUState); cs-predict does without"));
        }
    }
    Ok(())
}

struct Run<'a> {
    sweeper: &'a mut Sweeper,
    inputs: Inputs,
    config: Config,
    t: f64,
    /// Where no step is given
    control: StepControl,
    /// Points of a fixed grid so far
    grid: u64,
    /// Next sample, where the step is controlled
    sample: u64,
    /// Next time event [s]
    next_event: Option<f64>,
    /// A component asked for Event Mode in the last step
    event_wanted: bool,
    saved: Vec<Option<Saved>>,
    /// Inputs at the start of the step, as swept
    found: Vec<f64>,
    /// Inputs at the end of the predicted step
    kept: Vec<f64>,
    /// Positions and velocities at its end
    predicted: Vec<f64>,
    steps: Steps,
}

impl Run<'_> {
    /// In Event Mode at an accepted point; `swept`: with all inputs in step.
    fn update(&mut self, swept: bool) -> Result<(), RunError> {
        if self.event_wanted {
            self.steps.events += 1;
            self.inputs.announce(self.sweeper)?;
        }
        let mut happened = events::update(self.sweeper, swept)?;
        if happened.states_changed {
            self.inputs.announce(self.sweeper)?;
            happened = events::update(self.sweeper, false)?;
        }
        self.next_event = happened.next;
        // outputs of sampled FMUs are visible at once
        if self.sweeper.sampled { self.sweeper.sweep() } else { Ok(()) }
    }

    /// From one communication point to the next.
    fn advance(&mut self, recorder: &mut Recorder) -> Result<(), Error> {
        self.found.clear();
        self.found.extend_from_slice(self.sweeper.held());
        let swept = match (self.config.method, self.config.step) {
            (MethodKind::CsPece, None) => self.controlled().map(|()| true)?,
            (MethodKind::CsPece, Some(step)) => {
                self.save()?;
                let end = self.next_grid_point(step);
                self.correct(self.t, end).map(|()| false)?
            }
            (_, step) => {
                let end = self.next_grid_point(step.unwrap_or(self.config.stop - self.config.start));
                self.step_to_event_mode(end, false, false).map(|()| false)?
            }
        };
        self.update(swept)?;
        self.sweeper.check_bounds(self.t)?;
        self.steps.accepted += 1;
        recorder.offer(self.sweeper, &self.config, self.t)?;
        Ok(())
    }

    /// End of a step on the fixed grid, or the time event before it.
    fn next_grid_point(&mut self, step: f64) -> f64 {
        let point = self.config.point(self.grid + 1, step);
        let end = self.up_to_event(point);
        if end >= point - SAME_TIME * step {
            self.grid += 1;
        }
        end
    }

    /// Time events are communication points; one that differs from `end` in its last digits takes its place.
    fn up_to_event(&self, end: f64) -> f64 {
        let near = SAME_TIME * (end - self.t);
        match self.next_event {
            Some(event) if event > self.t + near && event < end - near => event,
            Some(event) if (event - end).abs() <= near && (event > end || end < self.config.stop) => event,
            _ => end,
        }
    }

    /// From Event Mode over Step Mode to Event Mode at `end`; `with_kept`: with the inputs kept from the predicted end.
    fn step_to_event_mode(&mut self, end: f64, with_kept: bool, may_restore: bool) -> Result<(), RunError> {
        let Self { sweeper, found, kept, t, event_wanted, .. } = self;
        let mut h = end - *t;
        if *t + h < end {
            h = h.next_up(); // as the components add it, an event at the end lies inside the step
        }
        let of_events = |instance: &Instance| instance.has_event_mode();
        sweeper.each(|_, i| if of_events(i) { i.enter_step_mode() } else { Ok(()) })?;
        if with_kept {
            sweeper.set_inputs(kept)?;
        } else {
            sweeper.set_answered(found)?;
        }
        *event_wanted = false;
        for node in 0..sweeper.instances.len() {
            *event_wanted |= do_step(sweeper, node, *t, h, may_restore)?;
        }
        *t = end;
        sweeper.t = end;
        sweeper.invalidate();
        sweeper.each(|_, i| if of_events(i) { i.enter_event_mode() } else { Ok(()) })?;
        sweeper.observe_responses()
    }

    fn save(&mut self) -> Result<(), RunError> {
        let saved = &mut self.saved;
        self.sweeper.each(|node, instance| instance.save(&mut saved[node]))
    }

    /// Predicted, evaluated and, from the saved states at `start`, corrected to `end`.
    fn correct(&mut self, start: f64, end: f64) -> Result<(), RunError> {
        let order = self.config.order;
        self.inputs.set_all(self.sweeper, Treatment::Extrapolate, order)?;
        self.step_to_event_mode(end, false, true)?;
        self.sweeper.sweep()?;
        self.keep();
        self.restore(start)?;
        self.inputs.set_all(self.sweeper, Treatment::Endpoint, order + 1)?;
        self.step_to_event_mode(end, true, self.config.step.is_none())
    }

    /// A corrected step, repeated with shorter ones until the error is small enough.
    fn controlled(&mut self) -> Result<(), RunError> {
        self.save()?;
        let start = self.t;
        let limit = self.limit();
        loop {
            let end = self.control.end(start, limit);
            self.correct(start, end)?;
            self.sweeper.sweep()?;
            let (error, signal) = self.error();
            if self.control.judge(end - start, error) {
                return Ok(());
            }
            self.steps.rejected += 1;
            if self.control.is_exhausted() {
                let signal = self.sweeper.signal_name(signal).to_owned();
                return Err(RunError::StepTooSmall { t: start, h: self.control.step, signal });
            }
            self.restore(start)?;
        }
    }

    /// The next sample, time event or stop: where a controlled step ends at the latest.
    fn limit(&mut self) -> f64 {
        let mut limit = self.config.stop;
        if let Some(interval) = self.config.interval {
            while self.config.point(self.sample, interval) <= self.t + SAME_TIME * interval && self.t < limit
            {
                self.sample += 1;
            }
            limit = self.config.point(self.sample, interval);
        }
        self.up_to_event(limit)
    }

    fn keep(&mut self) {
        self.kept.clear();
        self.kept.extend_from_slice(self.sweeper.held());
        self.predicted.clear();
        self.predicted.extend(self.sweeper.motion.iter().map(|&s| self.sweeper.values[s]));
    }

    fn restore(&mut self, t: f64) -> Result<(), RunError> {
        let saved = &self.saved;
        self.t = t;
        self.sweeper.t = t;
        self.sweeper.invalidate();
        self.sweeper.each(|node, instance| match &saved[node] {
            Some(saved) => instance.restore(saved),
            None => Ok(()),
        })
    }

    /// Difference of corrector and predictor in units of the tolerance, and the signal with the largest.
    fn error(&self) -> (f64, usize) {
        let mut worst = (0.0, 0);
        for (&signal, &predicted) in self.sweeper.motion.iter().zip(&self.predicted) {
            let value = self.sweeper.values[signal];
            let scale = self.config.atol + self.config.rtol * value.abs();
            let error = ESTIMATE * (value - predicted).abs() / scale;
            if error.is_nan() || error > worst.0 {
                worst = (error, signal);
            }
        }
        if worst.0.is_nan() { (f64::INFINITY, worst.1) } else { worst }
    }

    fn forget(&mut self) -> Result<(), RunError> {
        let saved = &mut self.saved;
        self.sweeper.each(|node, instance| match saved[node].take() {
            Some(saved) => instance.forget(saved),
            None => Ok(()),
        })
    }
}
