//! Co-Simulation: steps of the own solver, with the inputs on their polynomials.

use model::{Model, Variables};

use crate::inputs::{PortParameters, Span};
use crate::jobs::{Course, Step};
use crate::phase::{Interface, Phase};
use crate::solver::AutoCounters;
use crate::state::State;
use crate::table::Layout;
use crate::{Fault, InputTreatment, Instance, SolverCounters, SolverParameters, times};

/// Relative change of the inner step from which the stability guard looks again.
const SAME_STEP: f64 = 1e-6;

impl<M: Model> Instance<M> {
    /// Treatment of the inputs, if its parameters fit together.
    pub(crate) fn port(&self) -> Result<PortParameters, Fault> {
        if !Layout::<M>::TREATED {
            return Ok(PortParameters::HOLD);
        }
        let parameters = PortParameters::load(&self.state.values[Layout::<M>::PORT]);
        Ok(parameters.checked()?)
    }

    fn reset_signal(&self) -> f64 {
        if Layout::<M>::TREATED { self.state.values[Layout::<M>::RESET.start] } else { 0.0 }
    }

    /// The inputs at the start are the first sample.
    pub(crate) fn begin_inputs(&mut self) {
        self.state.reset_seen = self.reset_signal();
        self.state.history.clear();
        self.sample();
    }

    /// Forget the samples if `port.reset` has changed.
    pub(crate) fn see_reset(&mut self) {
        let signal = self.reset_signal();
        if signal.to_bits() != self.state.reset_seen.to_bits() {
            self.state.reset_seen = signal;
            self.state.history.clear();
        }
    }

    /// The inputs as set, now, become a sample.
    fn sample(&mut self) {
        if Layout::<M>::TREATED {
            let State { history, given, values, .. } = &mut self.state;
            history.push(values[0], given);
        }
    }

    /// Go to Step Mode: what the host has set is a sample, and holds again where a polynomial went on.
    ///
    /// # Errors
    /// Parameters of the input treatment that do not fit together.
    pub fn enter_step_mode(&mut self) -> Result<(), Fault> {
        self.port()?;
        let inputs = Layout::<M>::INPUTS;
        for i in 0..inputs.len() {
            let (given, value) = (self.state.given[i], &mut self.state.values[inputs.start + i]);
            if value.to_bits() != given.to_bits() {
                *value = given;
                self.state.fresh &= !self.table.affects[inputs.start + i];
            }
        }
        self.sample();
        self.state.phase = Phase::StepMode;
        Ok(())
    }

    /// Advance by one communication step; true if an event at its end is left to Event Mode.
    ///
    /// # Errors
    /// Arguments that make no sense; a step that cannot be done (then nothing has changed).
    pub fn do_step(&mut self, t: f64, step: f64) -> Result<bool, Fault> {
        let to = times::end_of_step(self.state.values[0], self.state.stop_time, t, step)?;
        self.tuned()?;
        let forget = self.reset_signal().to_bits() != self.state.reset_seen.to_bits();
        let State {
            interface, values, model, x, discrete, solver, statistics, guarded, given, history, ..
        } = &mut self.state;
        let (Some(model), Some(solver)) = (model, solver) else {
            return Ok(false);
        };
        let from = values[0];
        let span = Span { from, to };
        let settled = !Layout::<M>::TREATED || history.settled() && !forget && !self.channels.moving();
        if !settled {
            let port = PortParameters::load(&values[Layout::<M>::PORT]).checked()?;
            self.polynomials.plan(&self.channels, history, &port, span, given, forget);
        }
        let course = if settled || self.polynomials.constant() {
            None
        } else {
            self.moving.copy_from_slice(given);
            self.polynomials.evaluate(to, &mut self.moving);
            if let Some(i) = self.moving.iter().position(|u| !u.is_finite()) {
                let variable = self.table.variables[Layout::<M>::INPUTS.start + i].name.clone();
                return Err(Fault::NotFinite { variable, value: self.moving[i], t: to });
            }
            self.polynomials.evaluate(from, &mut self.moving);
            Some(Course { polynomials: &self.polynomials, u: &mut self.moving })
        };
        let h = solver.settings().inner_step(step);
        let fixed = !solver.settings().method.is_adaptive();
        let before = *discrete;
        let leave_events = *interface == Interface::CoSimulationWithEvents;
        let event = model.with_system(Step {
            from,
            to,
            interval: step,
            u: given,
            course,
            leave_events,
            auto: SolverParameters::load(&values[Layout::<M>::SOLVER]).auto(),
            guard: fixed && (h - *guarded).abs() > SAME_STEP * h,
            duals: &mut self.duals[Layout::<M>::INPUTS],
            x,
            d: discrete,
            solver,
            statistics,
            linear: &mut self.linear,
        })?;
        self.warnings.extend(M::notice(&before, discrete));
        *guarded = h;
        SolverCounters::from(*statistics).store(&mut values[Layout::<M>::COUNTERS]);
        if let [jacobians] = &mut values[Layout::<M>::AUTO_COUNTERS] {
            AutoCounters { jacobians: statistics.jacobians }.store(std::slice::from_mut(jacobians));
        }
        self.finish_inputs(span, settled, forget);
        self.state.values[0] = to;
        self.state.fresh = 0;
        Ok(leave_events && event)
    }

    /// After a step: its sample goes into the history, the inputs stand where their polynomials ended.
    #[inline]
    fn finish_inputs(&mut self, span: Span, settled: bool, forget: bool) {
        if !Layout::<M>::TREATED {
            return;
        }
        if forget {
            self.see_reset();
        }
        let State { values, given, history, .. } = &mut self.state;
        let endpoint = InputTreatment::load(&values[Layout::<M>::PORT]) == InputTreatment::Endpoint;
        let sampled = if endpoint { span.to } else { span.from };
        let integrate =
            self.channels.moving() && PortParameters::load(&values[Layout::<M>::PORT]).integrate_motion;
        let u = &mut values[Layout::<M>::INPUTS];
        u.copy_from_slice(given);
        if settled {
            return history.push_again(sampled);
        }
        history.push(sampled, given);
        if endpoint {
            return;
        }
        self.polynomials.evaluate(span.to, u);
        if integrate {
            // positions and velocities go on from here unless the host sets them
            for i in self.channels.integrated() {
                given[i] = u[i];
            }
            history.unsettle();
        }
    }
}
