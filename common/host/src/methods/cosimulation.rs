//! Method `cs`: FMUs with their own solvers, a sweep in Event Mode at every communication point.
//!
//! ```text
//! predict   step with extrapolated inputs, sweep
//! pece      step with extrapolated inputs, sweep; back; step with the inputs of the end, sweep
//! error     max |x_C - x_P| / (atol + rtol |x|) / 3 over positions and velocities of all ports
//! H         <- H min(2, max(0.2, 0.9 error^(-1/(k + 2))))
//! ```

use super::exchange::do_step;
use super::inputs::{Inputs, Treatment};
use super::{Clock, Config, MethodKind, Progress, Steps, events};
use crate::error::{Error, RunError};
use crate::import::Saved;
use crate::record::Recorder;
use crate::scene::SceneError;
use crate::start;
use crate::sweep::Sweeper;

/// First step of a controlled run, relative to its length.
const FIRST_STEP: f64 = 1e-3;
/// Times that differ by less than this part of a step are one.
const SAME_TIME: f64 = 1e-9;
/// Smallest step, relative to the length of the run.
const LEAST_STEP: f64 = 1e-10;

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
    let mut run = Run {
        saved: (0..sweeper.instances.len()).map(|_| None).collect(),
        inputs,
        config: *config,
        t: config.start,
        kept: Vec::new(),
        predicted: Vec::new(),
        steps: Steps::default(),
        step: config.step.unwrap_or(FIRST_STEP * (config.stop - config.start)),
        grid: 0,
        next_event: None,
        event_wanted: false,
        sweeper,
    };
    run.update()?;
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
    for (name, instance) in sweeper.names.iter().zip(&sweeper.instances) {
        let lacks = |wanted| SceneError::Capability {
            method: config.method.name().into(),
            component: name.clone(),
            fmu: instance.fmu().description.name.clone(),
            wanted,
        };
        if !instance.capabilities().event_mode {
            return Err(lacks("Event Mode (hasEventMode); jacobi and seidel do without"));
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
    /// Communication step [s]
    step: f64,
    /// Points of a fixed grid so far
    grid: u64,
    /// Next time event [s]
    next_event: Option<f64>,
    /// A component asked for Event Mode in the last step
    event_wanted: bool,
    saved: Vec<Option<Saved>>,
    /// Inputs at the end of the predicted step
    kept: Vec<f64>,
    /// Positions and velocities at its end
    predicted: Vec<f64>,
    steps: Steps,
}

impl Run<'_> {
    /// In Event Mode at an accepted point.
    fn update(&mut self) -> Result<(), RunError> {
        if self.event_wanted {
            self.steps.events += 1;
            self.inputs.announce(self.sweeper)?;
        }
        let mut happened = events::update(self.sweeper)?;
        if happened.states_changed {
            self.inputs.announce(self.sweeper)?;
            happened = events::update(self.sweeper)?;
        }
        self.next_event = happened.next;
        // outputs of sampled FMUs are visible at once
        if self.sweeper.sampled { self.sweeper.sweep() } else { Ok(()) }
    }

    /// From one communication point to the next.
    fn advance(&mut self, recorder: &mut Recorder) -> Result<(), Error> {
        if self.config.method == MethodKind::CsPece {
            self.corrected(recorder)?;
        } else {
            let end = self.next_grid_point();
            self.step_to_event_mode(end, false, false)?;
        }
        self.update()?;
        self.steps.accepted += 1;
        recorder.offer(self.sweeper, &self.config, self.t)?;
        Ok(())
    }

    /// End of a step on the fixed grid, or the time event before it.
    fn next_grid_point(&mut self) -> f64 {
        let point = self.config.point(self.grid + 1, self.step);
        let end = self.up_to_event(point);
        if end >= point - SAME_TIME * self.step {
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
        let Self { sweeper, kept, t, event_wanted, .. } = self;
        let mut h = end - *t;
        if *t + h < end {
            h = h.next_up(); // as the components add it, an event at the end lies inside the step
        }
        sweeper.each(|_, instance| instance.enter_step_mode())?;
        if with_kept {
            sweeper.set_inputs(kept)?;
        }
        *event_wanted = false;
        for node in 0..sweeper.instances.len() {
            *event_wanted |= do_step(sweeper, node, *t, h, may_restore)?;
        }
        *t = end;
        sweeper.t = end;
        sweeper.invalidate();
        sweeper.each(|_, instance| instance.enter_event_mode())
    }

    /// Predicted, evaluated, corrected, evaluated; repeated with shorter steps until the error is small enough.
    fn corrected(&mut self, recorder: &Recorder) -> Result<(), Error> {
        let saved = &mut self.saved;
        self.sweeper.each(|node, instance| instance.save(&mut saved[node]))?;
        let start = self.t;
        let order = self.config.order;
        loop {
            let end = if self.config.step.is_some() {
                self.next_grid_point()
            } else {
                self.up_to_event(self.reach(recorder))
            };
            let h = end - start;
            self.inputs.set_all(self.sweeper, Treatment::Extrapolate, order)?;
            self.step_to_event_mode(end, false, true)?;
            self.sweeper.sweep()?;
            self.keep();
            self.restore(start)?;
            self.inputs.set_all(self.sweeper, Treatment::Endpoint, order + 1)?;
            self.step_to_event_mode(end, true, true)?;
            self.sweeper.sweep()?;
            if self.config.step.is_some() {
                return Ok(());
            }
            let (error, signal) = self.error();
            #[allow(clippy::cast_precision_loss, reason = "0, 1 or 2")]
            let exponent = -1.0 / (order as f64 + 2.0);
            let factor = (0.9 * error.max(1e-10).powf(exponent)).clamp(0.2, 2.0);
            if error <= 1.0 {
                // cut short by a sample, not by the error
                self.step = if factor >= 1.0 { self.step.max(h * factor) } else { h * factor };
                return Ok(());
            }
            self.steps.rejected += 1;
            self.step = h * factor;
            if self.step < LEAST_STEP * (self.config.stop - self.config.start) {
                let signal = self.sweeper.signal_name(signal).to_owned();
                return Err(RunError::StepTooSmall { t: start, h: self.step, signal }.into());
            }
            self.restore(start)?;
        }
    }

    /// End of a controlled step: samples and stop are communication points, no tiny rest is left.
    fn reach(&self, recorder: &Recorder) -> f64 {
        let far = self.t + 2.0 * self.step;
        let limit = recorder.due_before(&self.config, far).unwrap_or(self.config.stop).min(self.config.stop);
        let remaining = limit - self.t;
        if self.step >= remaining {
            limit
        } else if 2.0 * self.step > remaining {
            self.t + 0.5 * remaining
        } else {
            self.t + self.step
        }
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
            let error = (value - predicted).abs() / scale / 3.0;
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
