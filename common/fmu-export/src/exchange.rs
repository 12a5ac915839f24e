//! Model Exchange: states, derivatives and indicators for a foreign integrator.

use model::Model;

use crate::jobs::{Astray, Nominals};
use crate::phase::Phase;
use crate::state::State;
use crate::table::{ALL_PARTS, Layout, Part};
use crate::values::same_length;
use crate::{Fault, Instance};

impl<M: Model> Instance<M> {
    /// Number of continuous states; those that the present parameters do not use are constant.
    #[must_use]
    pub fn state_count(&self) -> usize {
        self.table.states.len()
    }

    /// Go to Continuous-Time Mode.
    ///
    /// # Errors
    /// Where the event indicators have no value.
    pub fn enter_continuous_time_mode(&mut self) -> Result<(), Fault> {
        self.take_sides(true)?;
        self.state.phase = Phase::ContinuousTimeMode;
        Ok(())
    }

    /// Move to another time, back too, and beyond the stop time: integrators try steps that they cut short.
    ///
    /// # Errors
    /// A time that is not finite.
    pub fn set_time(&mut self, t: f64) -> Result<(), Fault> {
        if !t.is_finite() {
            return Err(Fault::Argument { argument: "time", value: t, allowed: "finite".into() });
        }
        if self.state.values[0].to_bits() != t.to_bits() {
            self.state.values[0] = t;
            self.state.fresh = 0;
        }
        Ok(())
    }

    /// Set all continuous states. Those that are not used keep their start values.
    ///
    /// # Errors
    /// A wrong number of values, or a value that is not finite: then none is set.
    pub fn set_continuous_states(&mut self, states: &[f64]) -> Result<(), Fault> {
        same_length(self.state_count(), states.len())?;
        if let Some(i) = states.iter().position(|s| !s.is_finite()) {
            let reference = self.table.states[i];
            return Err(Fault::Value {
                variable: self.table.variables[reference].name.clone(),
                value: states[i],
                kept: self.state.values[reference],
                allowed: "finite".into(),
            });
        }
        let State { x, places, fresh, .. } = &mut self.state;
        for (x, place) in x.iter_mut().zip(places) {
            if x.to_bits() != states[*place].to_bits() {
                *x = states[*place];
                *fresh = 0;
            }
        }
        Ok(())
    }

    /// All continuous states.
    ///
    /// # Errors
    /// A wrong number of values; before the end of initialisation, parameters that do not fit together.
    pub fn get_continuous_states(&mut self, states: &mut [f64]) -> Result<(), Fault> {
        same_length(self.state_count(), states.len())?;
        if self.state.phase == Phase::InitializationMode {
            let of = |acc, state: &usize| acc | self.table.access[*state];
            let parts = self.table.states.iter().fold(0, of);
            self.refresh(parts & ALL_PARTS)?;
            for (value, state) in states.iter_mut().zip(&self.table.states) {
                *value = self.state.values[*state];
            }
            return Ok(());
        }
        let State { x, places, unused, .. } = &self.state;
        states.copy_from_slice(unused);
        for (x, place) in x.iter().zip(places) {
            states[*place] = *x;
        }
        Ok(())
    }

    /// Time derivatives of all continuous states.
    ///
    /// # Errors
    /// A wrong number of values; where the equations have no value.
    pub fn get_derivatives(&mut self, derivatives: &mut [f64]) -> Result<(), Fault> {
        same_length(self.state_count(), derivatives.len())?;
        self.refresh(Part::Rates.bit())?;
        derivatives.copy_from_slice(&self.state.values[Layout::<M>::RATES]);
        Ok(())
    }

    /// Typical magnitudes of all continuous states; before initialisation those that are declared.
    ///
    /// # Errors
    /// A wrong number of values; before the end of initialisation, parameters that do not fit together.
    pub fn get_nominals(&mut self, nominals: &mut [f64]) -> Result<(), Fault> {
        same_length(self.state_count(), nominals.len())?;
        if self.state.phase != Phase::Instantiated {
            self.tuned()?;
        }
        for (nominal, state) in nominals.iter_mut().zip(&self.table.states) {
            *nominal = self.table.variables[*state].entry.nominal;
        }
        let State { model, places, .. } = &self.state;
        if let Some(model) = model {
            model.with_system(Nominals { places, values: nominals });
        }
        Ok(())
    }

    /// Number of event indicators.
    #[must_use]
    pub fn indicator_count(&self) -> usize {
        M::INDICATORS.len()
    }

    /// Event indicators; 1 for those that are not used.
    ///
    /// # Errors
    /// A wrong number of values; where the equations have no value.
    pub fn get_indicators(&mut self, indicators: &mut [f64]) -> Result<(), Fault> {
        same_length(self.indicator_count(), indicators.len())?;
        self.refresh(Part::Indicators.bit())?;
        indicators.copy_from_slice(&self.state.values[Layout::<M>::part(Part::Indicators)]);
        Ok(())
    }

    /// A step of the integrator is done; true if an event has to bring states back on their manifold.
    ///
    /// # Errors
    /// Where the event indicators have no value.
    pub fn completed_integrator_step(&mut self) -> Result<bool, Fault> {
        self.take_sides(false)?;
        let State { model, x, .. } = &self.state;
        Ok(model.as_ref().is_some_and(|model| model.with_system(Astray { x })))
    }
}
