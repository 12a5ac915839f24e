//! Get and Set: own values from the list, the others from the elements.

use fmu_export::{Fault, Phase, values as check};
use model::{Causality, Kind};

use super::layout::Place;
use super::{Assembly, refused};
use crate::import::{Value, VariableKind};

/// The value of a variable as the host hands it to an element.
#[allow(clippy::cast_possible_truncation, reason = "whole numbers were checked")]
fn typed(kind: VariableKind, value: f64) -> Value {
    match kind {
        VariableKind::Boolean => Value::Boolean(value > 0.5),
        VariableKind::Int32 | VariableKind::Int64 | VariableKind::Enumeration => Value::Integer(value as i64),
        _ => Value::Real(value),
    }
}

impl Assembly {
    /// Brings the elements to the present time, with the inputs and parameters as they are set.
    pub(super) fn show(&mut self) -> Result<(), Fault> {
        match self.phase {
            Phase::InitializationMode => self.close(),
            Phase::StepMode | Phase::EventMode => {
                let inputs = std::mem::take(&mut self.inputs);
                let result = self.settle(&inputs);
                self.inputs = inputs;
                result?;
                let t = self.values[0];
                if let Some(run) = self.run.as_mut().filter(|_| !self.flags.shown) {
                    run.look(&mut self.sweeper, t).map_err(refused)?;
                    self.flags.shown = true;
                }
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// Value of a variable where it is.
    fn value(&mut self, reference: u32) -> Result<f64, Fault> {
        let i = reference as usize;
        match self.layout.places[i] {
            Place::Own => Ok(self.values[i]),
            Place::Input(input) => Ok(self.inputs[input]),
            Place::Gap(joint) => Ok(self.sweeper.distance(&self.scene.network.joints[joint])),
            Place::Element { node, reference, kind } => self.sweeper.instances[node]
                .get_number(kind, reference)
                .map_err(|fault| refused(self.sweeper.failed(node, fault))),
        }
    }

    /// Reads Float64 variables.
    pub(super) fn read(&mut self, references: &[u32], values: &mut [f64]) -> Result<(), Fault> {
        check::same_length(references.len(), values.len())?;
        let standard = self.interface.standard();
        let mut computed = false;
        for reference in references {
            let called = standard.type_name(Kind::Float64);
            let v = self.layout.table.typed(*reference, standard, called, |kind| kind == Kind::Float64)?;
            computed |= matches!(v.entry.causality, Causality::Output | Causality::Local);
        }
        if self.phase == Phase::Instantiated {
            references.iter().try_for_each(|r| check::has_value(self.layout.table.variable(*r)?))?;
        }
        if computed {
            self.show()?;
        }
        for (value, reference) in values.iter_mut().zip(references) {
            *value = self.value(*reference)?;
            if !value.is_finite() {
                let variable = self.layout.table.variable(*reference)?.name.clone();
                return Err(Fault::NotFinite { variable, value: *value, t: self.values[0] });
            }
        }
        Ok(())
    }

    /// Reads variables of other types.
    pub(super) fn read_whole(
        &mut self,
        references: &[u32],
        called: &'static str,
        is: impl Fn(Kind) -> bool,
        mut put: impl FnMut(usize, f64) -> bool,
    ) -> Result<(), Fault> {
        let standard = self.interface.standard();
        for reference in references {
            self.layout.table.typed(*reference, standard, called, &is)?;
        }
        for (i, reference) in references.iter().enumerate() {
            let value = self.value(*reference)?;
            if !put(i, value) {
                let variable = self.layout.table.variable(*reference)?.name.clone();
                return Err(Fault::TooLarge { variable, value, called });
            }
        }
        Ok(())
    }

    /// Sets variables; all of them or, on a fault, none.
    pub(super) fn write(
        &mut self,
        references: &[u32],
        called: &'static str,
        is: impl Fn(Kind) -> bool,
        value: impl Fn(usize) -> f64,
    ) -> Result<(), Fault> {
        let layout = std::rc::Rc::clone(&self.layout);
        for (i, reference) in references.iter().enumerate() {
            let v = layout.table.typed(*reference, self.interface.standard(), called, &is)?;
            check::settable(self.interface, self.phase, v)?;
            check::acceptable(v, value(i), || self.kept(*reference as usize))?;
        }
        let mut before = Vec::new();
        for (i, reference) in references.iter().enumerate() {
            let kept = self.kept(*reference as usize);
            if let Err(fault) = self.accept(*reference as usize, value(i)) {
                for (reference, kept) in before.into_iter().rev() {
                    self.accept(reference, kept)?;
                }
                return Err(fault);
            }
            before.push((*reference as usize, kept));
        }
        Ok(())
    }

    /// The value that a variable was set to last.
    fn kept(&self, i: usize) -> f64 {
        match self.layout.places[i] {
            Place::Input(input) => self.inputs[input],
            _ => self.values[i],
        }
    }

    /// Takes over a value that may be set.
    fn accept(&mut self, i: usize, value: f64) -> Result<(), Fault> {
        match self.layout.places[i] {
            Place::Own => {
                if self.layout.port.contains(&i) {
                    self.history.unsettle();
                }
                self.values[i] = value;
            }
            Place::Input(input) => {
                self.given[input] = value;
                self.inputs[input] = value;
                self.flags.stale = true;
                if matches!(self.phase, Phase::Instantiated) {
                    // a start value
                    return self.hand(i, value);
                }
            }
            Place::Gap(_) => {}
            Place::Element { .. } => {
                if matches!(self.phase, Phase::StepMode | Phase::EventMode) {
                    if self.values[i].to_bits() == value.to_bits() {
                        return Ok(());
                    }
                    self.begin_event()?;
                }
                self.hand(i, value)?;
                self.values[i] = value;
                self.flags.stale = true;
            }
        }
        Ok(())
    }

    /// Hands a value to the element that holds it.
    fn hand(&mut self, i: usize, value: f64) -> Result<(), Fault> {
        let (node, reference, kind) = match self.layout.places[i] {
            Place::Element { node, reference, kind } => (node, reference, kind),
            Place::Input(input) => {
                let (node, reference) = self.sweeper.driven.target(input);
                (node, reference, VariableKind::Real)
            }
            Place::Own | Place::Gap(_) => return Ok(()),
        };
        let instance = &mut self.sweeper.instances[node];
        let result = instance.set_value(kind, reference, &typed(kind, value));
        result.map_err(|fault| match refused(self.sweeper.failed(node, fault)) {
            Fault::Part { message, status } => {
                let name = &self.layout.table.variables()[i].name;
                Fault::Part { message: format!("{name} = {value} is refused: {message}"), status }
            }
            other => other,
        })
    }
}
