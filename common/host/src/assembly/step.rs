//! Communication steps over the integrator's own steps.

use fmu_export::inputs::Span;
use fmu_export::{Fault, InputTreatment};
use model::Variables;

use super::{Assembly, refused};
use crate::error::{Error, RunError};
use crate::methods::Run;

/// Times that differ by less than this part of a fixed step are one.
const SAME_TIME: f64 = 1e-9;

/// Most evaluations of the scene in one step: a tenth of those of an FMU, since one costs more than ten times as much.
const MAX_EVALUATIONS: u64 = integrators::MAX_EVALUATIONS / 10;

/// True if the bits are the same.
fn identical(a: &[f64], b: &[f64]) -> bool {
    a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits())
}

impl Assembly {
    /// Something changes that changes at events only: the elements go to Event Mode at the present time.
    pub(super) fn begin_event(&mut self) -> Result<(), Fault> {
        let t = self.values[0];
        let Some(run) = self.run.as_mut().filter(|_| !self.flags.in_event) else { return Ok(()) };
        if run.is_ahead() {
            run.turn(&mut self.sweeper, t).map_err(refused)?;
        }
        run.enter_event_mode(&mut self.sweeper).map_err(refused)?;
        (self.flags.in_event, self.flags.shown) = (true, true);
        Ok(())
    }

    /// Takes over what was set: the elements stand at the present time with these inputs. After a fault the next call
    /// tries again.
    pub(super) fn settle(&mut self, inputs: &[f64]) -> Result<(), Fault> {
        let t = self.values[0];
        let changed = !identical(inputs, &self.sweeper.driven.values);
        let Some(run) = self.run.as_mut() else { return Ok(()) };
        if !changed && self.flags.settled && !self.flags.in_event {
            return Ok(());
        }
        (self.flags.settled, self.flags.changed) = (false, true);
        self.sweeper.driven.values.copy_from_slice(inputs);
        self.sweeper.driven.course = None;
        self.sweeper.drive_all().map_err(refused)?;
        if self.flags.in_event {
            run.leave_event_mode(&mut self.sweeper).map_err(refused)?;
            run.restart();
            self.flags.in_event = false;
        } else {
            run.turn(&mut self.sweeper, t).map_err(refused)?;
        }
        (self.flags.settled, self.flags.shown) = (true, true);
        Ok(())
    }

    /// One communication step; on a fault everything is as before.
    pub(super) fn step_to(&mut self, to: f64) -> Result<(), Fault> {
        self.keep()?;
        let result = self.attempt(to);
        if result.is_err() {
            self.go_back();
        }
        result
    }

    fn attempt(&mut self, to: f64) -> Result<(), Fault> {
        let from = self.values[0];
        let span = Span { from, to };
        let forget = self.reset_signal().to_bits() != self.reset_seen.to_bits();
        let port = self.port()?;
        self.polynomials.plan(&self.channels, &self.history, &port, span, &self.given, forget);
        let moving = !self.polynomials.constant();
        let mut inputs = self.given.clone();
        if moving {
            self.polynomials.evaluate(to, &mut inputs);
            if let Some(i) = inputs.iter().position(|u| !u.is_finite()) {
                let variable = self.layout.table.variables()[self.layout.inputs.start + i].name.clone();
                return Err(Fault::NotFinite { variable, value: inputs[i], t: to });
            }
            self.polynomials.evaluate(from, &mut inputs);
        }
        self.settle(&inputs)?;
        // steps end where inputs may change again
        let limit = if moving || self.flags.changed { to } else { self.stop_time.unwrap_or(to) };
        self.advance(to, limit, moving)?;
        self.finish_inputs(span, forget, moving);
        self.values[0] = to;
        self.flags.changed = false;
        self.count();
        Ok(())
    }

    /// Steps of the integrator until `to` lies inside or at the end of one.
    fn advance(&mut self, to: f64, limit: f64, moving: bool) -> Result<(), Fault> {
        let config = self.config;
        let slack = match config.step.filter(|_| config.is_fixed_step()) {
            Some(step) => SAME_TIME * step.min(to - self.values[0]),
            None => 4.0 * f64::EPSILON * to.abs(),
        };
        let Some(run) = self.run.as_mut() else { return Ok(()) };
        if moving {
            self.sweeper.driven.course = Some(self.polynomials.clone());
        }
        let most = run.statistics().rhs_evaluations + MAX_EVALUATIONS;
        self.flags.shown = true;
        loop {
            if !run.is_ahead() {
                if run.t >= to - slack || run.t >= config.stop {
                    break;
                }
                run.advance(&mut self.sweeper, &config, limit).map_err(refused)?;
            }
            if run.reached() > to + slack {
                self.flags.shown = false;
                break;
            }
            run.accept(&mut self.sweeper).map_err(refused)?;
            if run.statistics().rhs_evaluations > most {
                return Err(refused(too_much_work(run, to)));
            }
        }
        if moving {
            self.sweeper.driven.course = None;
            self.polynomials.evaluate(to, &mut self.sweeper.driven.values);
            self.sweeper.drive_all().map_err(refused)?;
        }
        Ok(())
    }

    /// After a step: its sample goes into the history, the inputs stand where their polynomials ended.
    fn finish_inputs(&mut self, span: Span, forget: bool, moving: bool) {
        if self.layout.port.is_empty() {
            return;
        }
        if forget {
            self.see_reset();
        }
        let parameters = &self.values[self.layout.port.clone()];
        let endpoint = InputTreatment::load(parameters) == InputTreatment::Endpoint;
        self.history.push(if endpoint { span.to } else { span.from }, &self.given);
        self.inputs.clone_from(&self.given);
        if endpoint || !moving {
            return;
        }
        self.inputs.clone_from(&self.sweeper.driven.values);
        if self.port().is_ok_and(|port| port.integrate_motion) {
            // positions and velocities go on from here unless the host sets them
            for i in self.channels.integrated() {
                self.given[i] = self.inputs[i];
            }
        }
    }
}

fn too_much_work(run: &Run, to: f64) -> Error {
    let t = run.t;
    let text = format!(
        "the step needs more than {MAX_EVALUATIONS} evaluations of the equations: it has come to t = {t:.6} s of {to:.6} s"
    );
    Error::Run(RunError::Integrator(text))
}
