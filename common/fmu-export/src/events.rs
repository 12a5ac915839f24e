//! Event Mode, the same for Co-Simulation and Model Exchange.

use model::Model;

use crate::jobs::{Update, Updated};
use crate::phase::Phase;
use crate::state::State;
use crate::table::{Layout, Part};
use crate::{Fault, Instance};

/// How near to zero an event indicator counts as zero; as in [`integrators::Indicators::band`].
const BAND: f64 = 1e-10;

/// What an update of the discrete states says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Event {
    /// Another update is needed
    pub again: bool,
    /// Continuous states have changed
    pub states_changed: bool,
    /// Time of the next event, if known [s]
    pub next: Option<f64>,
}

impl<M: Model> Instance<M> {
    /// Go to Event Mode.
    ///
    /// # Errors
    /// In Model Exchange, where the event indicators have no value.
    pub fn enter_event_mode(&mut self) -> Result<(), Fault> {
        if self.state.phase == Phase::EventMode {
            return Ok(()); // FMI 2.0 allows it there; what has crossed is known already
        }
        if self.state.interface.is_model_exchange() && !M::INDICATORS.is_empty() {
            self.refresh(Part::Indicators.bit())?;
            let State { sides, values, .. } = &self.state;
            let mut now = sides.iter().zip(&values[Layout::<M>::part(Part::Indicators)]);
            // as inside a step: what had a side and is at zero or beyond has crossed
            self.state.crossed = now.any(|(side, z)| side.abs() > 0.0 && side * z <= BAND);
        }
        self.state.phase = Phase::EventMode;
        Ok(())
    }

    /// Carry out what is due: time events, crossed indicators, states off their manifold, a signalled
    /// discontinuity of the inputs.
    ///
    /// # Errors
    /// Parameters that cannot be taken over; states that would not be finite or stay off their manifold, then nothing
    /// changes.
    pub fn update_discrete_states(&mut self) -> Result<Event, Fault> {
        self.tuned()?;
        let State { values, model, x, discrete, crossed, fresh, solver, .. } = &mut self.state;
        let (t, u) = (values[0], &values[Layout::<M>::INPUTS]);
        let before = *discrete;
        let Updated { changed, states, again, next } = match model {
            Some(model) => model.with_system(Update { t, crossed: *crossed, u, x, d: discrete })?,
            None => Updated { changed: false, states: false, again: false, next: None },
        };
        self.warnings.extend(M::notice(&before, discrete));
        *crossed = false;
        if changed {
            *fresh = 0;
            if let Some(solver) = solver {
                solver.reset();
            }
        }
        self.see_reset();
        Ok(Event { again, states_changed: states, next })
    }

    /// Remember on which side of zero the indicators are; those at zero have none yet.
    pub(crate) fn take_sides(&mut self, all: bool) -> Result<(), Fault> {
        if M::INDICATORS.is_empty() {
            return Ok(());
        }
        self.refresh(Part::Indicators.bit())?;
        let State { sides, values, .. } = &mut self.state;
        for (side, z) in sides.iter_mut().zip(&values[Layout::<M>::part(Part::Indicators)]) {
            if all || side.abs() <= 0.0 {
                *side = if z.abs() > BAND { z.signum() } else { 0.0 };
            }
        }
        Ok(())
    }
}
