//! Get and Set: values by reference, all or none.

use model::{Causality, Entry, Initial, Kind, Model, Variability};

use crate::phase::{Interface, Phase};
use crate::state::State;
use crate::table::{ALL_PARTS, FLOAT, Layout, Variable, allowed, changes_in_a_run};
use crate::{Fault, Instance};

impl<M: Model> Instance<M> {
    /// Read Float64 variables.
    ///
    /// # Errors
    /// Unknown references, other types, outputs that have no value now.
    pub fn get_float64(&mut self, references: &[u32], values: &mut [f64]) -> Result<(), Fault> {
        same_length(references.len(), values.len())?;
        let mut needed = 0;
        for reference in references {
            match self.table.access.get(*reference as usize) {
                Some(access) if access & FLOAT != 0 => needed |= access,
                _ => return Err(self.not_float(*reference)),
            }
        }
        if self.state.phase == Phase::Instantiated {
            self.have_start(references)?;
        } else {
            self.refresh(needed & ALL_PARTS)?;
        }
        for (value, reference) in values.iter_mut().zip(references) {
            *value = self.state.values[*reference as usize];
        }
        Ok(())
    }

    /// Why a reference is not read as Float64.
    #[cold]
    fn not_float(&self, reference: u32) -> Fault {
        let standard = self.state.interface.standard();
        let found = self.table.typed(reference, standard, standard.type_name(Kind::Float64), |_| false);
        found.err().unwrap_or(Fault::UnknownReference { reference, count: self.table.variables.len() })
    }

    /// Before initialisation there are start values only.
    fn have_start(&self, references: &[u32]) -> Result<(), Fault> {
        references.iter().try_for_each(|reference| has_value(self.variable(*reference)?))
    }

    /// Read variables of another type; all of them are stored as whole numbers. `put` says whether the
    /// number fits into the type of the call.
    ///
    /// # Errors
    /// Unknown references, other types, numbers that do not fit.
    pub fn get_whole(
        &mut self,
        references: &[u32],
        called: &'static str,
        is: impl Fn(Kind) -> bool,
        mut put: impl FnMut(usize, f64) -> bool,
    ) -> Result<(), Fault> {
        let mut needed = 0;
        for reference in references {
            self.table.typed(*reference, self.state.interface.standard(), called, &is)?;
            needed |= self.table.access[*reference as usize];
        }
        if self.state.phase != Phase::Instantiated {
            self.refresh(needed & ALL_PARTS)?;
        }
        for (i, reference) in references.iter().enumerate() {
            let value = self.state.values[*reference as usize];
            if !put(i, value) {
                let variable = self.variable(*reference)?.name.clone();
                return Err(Fault::TooLarge { variable, value, called });
            }
        }
        Ok(())
    }

    /// Set variables; all of them or, on a fault, none.
    ///
    /// # Errors
    /// Unknown references, other types, values out of range, variables that cannot be set now.
    pub fn set(
        &mut self,
        references: &[u32],
        called: &'static str,
        is: impl Fn(Kind) -> bool,
        value: impl Fn(usize) -> f64,
    ) -> Result<(), Fault> {
        for (i, reference) in references.iter().enumerate() {
            let State { interface, phase, values, .. } = &self.state;
            let variable = self.table.typed(*reference, interface.standard(), called, &is)?;
            if !self.is_state_of_host(*reference) {
                settable(*interface, *phase, variable)?;
            }
            let kept = || values[*reference as usize];
            acceptable(variable, value(i), kept)?;
        }
        for (i, reference) in references.iter().enumerate() {
            self.accept(*reference as usize, value(i));
        }
        Ok(())
    }

    /// A state that the host integrates now (FMI 3.0, 3.2.1; FMI 2.0.5, 3.2.3).
    fn is_state_of_host(&self, reference: u32) -> bool {
        self.state.phase == Phase::ContinuousTimeMode && self.table.is_state(reference as usize)
    }

    /// One state, as [`set_continuous_states`](Self::set_continuous_states) sets all: one that is not used keeps its value.
    fn accept_state(&mut self, reference: usize, value: f64) {
        let State { x, places, fresh, .. } = &mut self.state;
        let used = places.iter().position(|place| self.table.states[*place] == reference);
        if let Some(x) = used.and_then(|i| x.get_mut(i))
            && x.to_bits() != value.to_bits()
        {
            *x = value;
            *fresh = 0;
        }
    }

    /// Take over a value that may be set; what depends on it is out of date.
    fn accept(&mut self, i: usize, value: f64) {
        if self.state.phase == Phase::ContinuousTimeMode && self.table.is_state(i) {
            return self.accept_state(i, value);
        }
        let State { values, given, history, motion_start, model, fresh, retune, phase, .. } = &mut self.state;
        if Layout::<M>::INPUTS.contains(&i) {
            let given = &mut given[i - Layout::<M>::INPUTS.start];
            if given.to_bits() != value.to_bits() {
                *given = value;
                history.unsettle();
            }
        } else if Layout::<M>::PORT.contains(&i) {
            history.unsettle();
        } else if Layout::<M>::MOTION.contains(&i) {
            motion_start[i - Layout::<M>::MOTION.start] = value;
            *model = None; // another start: assemble again
        }
        if values[i].to_bits() == value.to_bits() {
            return;
        }
        values[i] = value;
        *fresh &= !self.table.affects[i];
        if *phase == Phase::InitializationMode && Layout::<M>::INPUTS.contains(&i) {
            *fresh = 0; // the discrete states begin with the inputs, and anything may depend on those
        }
        if Layout::<M>::PARAMETERS.contains(&i) {
            if matches!(phase, Phase::Instantiated | Phase::InitializationMode) {
                *model = None;
            } else {
                *retune = true;
            }
        }
    }
}

/// Check that a variable has a value before initialisation.
///
/// # Errors
/// [`Fault::NoValue`].
pub fn has_value(variable: &Variable) -> Result<(), Fault> {
    let Variable { name, entry, .. } = variable;
    if entry.causality == Causality::Inherit || entry.has_start() {
        return Ok(());
    }
    Err(Fault::NoValue { variable: name.clone() })
}

/// Check that a variable may be set in a phase.
///
/// # Errors
/// [`Fault::NotSettable`].
#[inline]
pub fn settable(interface: Interface, phase: Phase, variable: &Variable) -> Result<(), Fault> {
    match not_settable(interface, phase, &variable.entry) {
        None => Ok(()),
        Some(reason) => {
            let phase = format!("{phase:?}");
            Err(Fault::NotSettable { variable: variable.name.clone(), phase, reason })
        }
    }
}

/// Check that a variable may have a value; otherwise `kept` gives the one it keeps.
///
/// # Errors
/// [`Fault::Value`].
#[inline]
pub fn acceptable(variable: &Variable, value: f64, kept: impl FnOnce() -> f64) -> Result<(), Fault> {
    let Variable { name, entry, .. } = variable;
    if in_range(entry, value) {
        return Ok(());
    }
    Err(Fault::Value { variable: name.clone(), value, kept: kept(), allowed: allowed(entry) })
}

fn not_settable(interface: Interface, phase: Phase, entry: &Entry) -> Option<&'static str> {
    let continuous_input =
        entry.causality == Causality::Input && entry.variability == Variability::Continuous;
    match phase {
        Phase::Instantiated | Phase::InitializationMode if !entry.has_start() => {
            Some("it is computed and has no start value")
        }
        Phase::InitializationMode if entry.initial == Initial::Approx => {
            Some("its start value is a guess (initial = approx); set it before Initialization Mode")
        }
        Phase::StepMode | Phase::EventMode | Phase::ContinuousTimeMode if !changes_in_a_run(entry) => {
            Some("only inputs and tunable parameters change in a run")
        }
        Phase::ContinuousTimeMode if !continuous_input => {
            Some("only continuous inputs and states change between events; set it in Event Mode")
        }
        Phase::StepMode if interface == Interface::CoSimulationWithEvents && !continuous_input => {
            Some("only continuous inputs change between steps where Event Mode is used; set it there")
        }
        _ => None,
    }
}

/// Number of references and number of values must agree.
///
/// # Errors
/// [`Fault::Length`].
pub fn same_length(references: usize, values: usize) -> Result<(), Fault> {
    if references == values { Ok(()) } else { Err(Fault::Length { references, values }) }
}

/// True if these may be values of these variables: start values, or what may be set.
pub(crate) fn possible<'a>(entries: impl Iterator<Item = &'a Entry>, values: &[f64]) -> bool {
    entries.zip(values).all(|(entry, v)| in_range(entry, *v) || v.to_bits() == entry.start.to_bits())
}

/// True if `value` may be set.
#[allow(clippy::float_cmp, reason = "items and switches are whole numbers")]
fn in_range(entry: &Entry, value: f64) -> bool {
    if let Kind::Enumeration(t) = entry.kind {
        #[allow(clippy::cast_precision_loss, reason = "items are small")]
        return t.items.iter().any(|i| i.value as f64 == value);
    }
    if entry.switch {
        return value == 0.0 || value == 1.0;
    }
    entry.any || entry.or == Some(value) || value.is_finite() && value >= entry.min && value <= entry.max
}
