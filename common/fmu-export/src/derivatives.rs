//! Dependencies, and exact derivatives in a direction by dual numbers.

use model::{Causality, Model};
use num_dual::Dual64;

use crate::jobs::{Evaluate, Rates};
use crate::phase::Phase;
use crate::state::State;
use crate::table::{ALL_PARTS, Layout, Part, Variable};
use crate::values::same_length;
use crate::{Fault, Instance};

impl<M: Model> Instance<M> {
    /// d(unknowns) / d(knowns) in the direction `seed`, exact.
    ///
    /// Unknowns are outputs and derivatives of states; knowns are inputs and, where they are given from
    /// outside (Model Exchange, Event Mode), continuous states.
    ///
    /// # Errors
    /// Other knowns or unknowns; where the equations, or the derivative, have no value.
    pub fn directional_derivative(
        &mut self,
        unknowns: &[u32],
        knowns: &[u32],
        seed: &[f64],
        sensitivity: &mut [f64],
    ) -> Result<(), Fault> {
        same_length(knowns.len(), seed.len())?;
        same_length(unknowns.len(), sensitivity.len())?;
        let needed = self.check_unknowns(unknowns)?;
        self.check_knowns(knowns, seed)?;
        self.tuned()?;
        self.lift(knowns, seed);
        let State { values, model, places, discrete: d, .. } = &mut self.state;
        let Some(model) = model else { return Ok(()) };
        let t = values[0];
        for part in Part::ALL {
            if needed & part.bit() == 0 {
                continue;
            }
            let range = Layout::<M>::part(part);
            let (before, values) = self.duals.split_at_mut(range.start);
            let (u, values) = (&before[Layout::<M>::INPUTS], &mut values[..range.len()]);
            let x = &self.dual_states[..];
            match part {
                Part::Outputs(group) => model.with_system(Evaluate { group, t, x, u, d, values }),
                Part::Rates => model.with_system(Rates { t, x, u, d, places, values }),
                Part::Indicators => Ok(()),
            }
            .map_err(|source| Fault::Evaluation { t, source })?;
        }
        let derivative = |unknown: &u32| self.duals[*unknown as usize].eps;
        if let Some(unknown) = unknowns.iter().find(|unknown| !derivative(unknown).is_finite()) {
            let name = &self.table.variables[*unknown as usize].name;
            let variable = format!("the directional derivative of {name}");
            return Err(Fault::NotFinite { variable, value: derivative(unknown), t });
        }
        for (s, unknown) in sensitivity.iter_mut().zip(unknowns) {
            *s = derivative(unknown);
        }
        Ok(())
    }

    /// The parts that the unknowns belong to.
    fn check_unknowns(&self, unknowns: &[u32]) -> Result<u8, Fault> {
        let mut needed = 0;
        for unknown in unknowns {
            let v = self.variable(*unknown)?;
            if v.entry.causality != Causality::Output && v.derivative_of.is_none() {
                return Err(no_derivative(v, "unknowns are outputs and derivatives of states"));
            }
            needed |= self.table.access[*unknown as usize] & ALL_PARTS;
        }
        Ok(needed)
    }

    fn check_knowns(&self, knowns: &[u32], seed: &[f64]) -> Result<(), Fault> {
        let State { interface, phase, .. } = self.state;
        let states =
            phase == Phase::EventMode || interface.is_model_exchange() && phase != Phase::InitializationMode;
        for known in knowns {
            let v = self.variable(*known)?;
            let state = self.table.is_state(*known as usize);
            if state && !states {
                return Err(no_derivative(v, "states are knowns in Model Exchange and in Event Mode only"));
            }
            if !state && v.entry.causality != Causality::Input {
                return Err(no_derivative(v, "knowns are inputs and continuous states"));
            }
        }
        if let Some(s) = seed.iter().find(|s| !s.is_finite()) {
            return Err(Fault::Argument { argument: "seed", value: *s, allowed: "finite".into() });
        }
        Ok(())
    }

    /// Present inputs and states, with the direction as their derivative.
    fn lift(&mut self, knowns: &[u32], seed: &[f64]) {
        let State { values, x, places, .. } = &self.state;
        for i in Layout::<M>::INPUTS {
            self.duals[i] = Dual64::from_re(values[i]);
        }
        for (dual, x) in self.dual_states.iter_mut().zip(x) {
            *dual = Dual64::from_re(*x);
        }
        for (known, s) in knowns.iter().zip(seed) {
            match self.table.states.binary_search(&(*known as usize)) {
                Ok(declared) => {
                    if let Some(i) = places.iter().position(|place| *place == declared) {
                        self.dual_states[i].eps += s;
                    }
                }
                Err(_) => self.duals[*known as usize].eps += s,
            }
        }
    }

    /// Inputs and states that a variable depends on directly.
    ///
    /// # Errors
    /// [`Fault::UnknownReference`].
    pub fn dependencies(&self, reference: u32) -> Result<Vec<usize>, Fault> {
        self.variable(reference)?;
        Ok(self.table.dependencies(reference as usize))
    }
}

fn no_derivative(variable: &Variable, reason: &'static str) -> Fault {
    Fault::NotSettable { variable: variable.name.clone(), phase: "directional derivatives".into(), reason }
}
