//! Dependencies as dual numbers see them, over many settings and points, against the declared ones.

use std::collections::BTreeSet;

use fmu_export::Interface;
use model::{Causality, Initial, Model};

use crate::{Named, Random};

/// Part of the largest derivative that counts as zero where terms cancel.
const ROUNDING: f64 = 1e-13;

/// What outputs and state derivatives of a model depend on.
#[derive(Debug)]
pub struct Sparsity<M: Model> {
    fmu: Named<M>,
    knowns: Vec<u32>,
    unknowns: Vec<u32>,
    observed: Vec<Vec<bool>>,
}

impl<M: Model> Default for Sparsity<M> {
    fn default() -> Self {
        let fmu = Named::<M>::default();
        let number = |i: usize| u32::try_from(i).expect("few variables");
        let of = |causality| {
            let variables = fmu.table().variables().iter().enumerate();
            variables.filter(move |(_, v)| v.entry.causality == causality).map(|(i, _)| number(i))
        };
        let states: Vec<u32> = fmu.table().states().iter().map(|s| number(*s)).collect();
        let name = |r: &u32| fmu.table().variables()[*r as usize].name.clone();
        let knowns = of(Causality::Input).chain(states.iter().copied()).collect::<Vec<_>>();
        let rates = states.iter().map(|s| fmu.reference(&format!("der({})", name(s))));
        let unknowns = of(Causality::Output).chain(rates).collect::<Vec<_>>();
        let observed = vec![vec![false; knowns.len()]; unknowns.len()];
        Self { fmu, knowns, unknowns, observed }
    }
}

impl<M: Model> Sparsity<M> {
    /// Look at random inputs and start states under the given parameters.
    ///
    /// # Panics
    /// If the settings are refused.
    pub fn look(&mut self, settings: &[(&str, f64)], random: &mut Random) {
        let mut fmu = Named::<M>::with_interface(Interface::CoSimulationWithEvents);
        for (name, value) in settings {
            fmu.set(name, *value).expect("a setting of the model");
        }
        let variables: Vec<_> = fmu.table().variables().iter().map(|v| (v.name.clone(), v.entry)).collect();
        for (name, entry) in &variables {
            let start = entry.initial == Initial::Exact && entry.causality == Causality::Output;
            if entry.causality == Causality::Input
                || start && !name.contains(".q[") && !name.starts_with("direction")
            {
                let diagonal = [".xx", ".yy", ".zz"].iter().any(|d| name.ends_with(d));
                let value = if diagonal { random.between(2.0, 4.0) } else { random.between(-1.0, 1.0) };
                let value = if name == "port.reset" { 0.0 } else { value };
                let value = if entry.switch { 1.0 } else { value };
                let value = if entry.min >= 0.0 && !diagonal { value.abs().max(entry.min) } else { value };
                fmu.set(name, value).expect("an input or a start value");
            }
        }
        let unit = |n: usize, random: &mut Random| {
            let v: Vec<f64> = (0..n).map(|_| random.between(0.2, 1.0)).collect();
            let norm = v.iter().map(|c| c * c).sum::<f64>().sqrt();
            v.into_iter().map(|c| c / norm).collect::<Vec<_>>()
        };
        for (prefix, components) in [
            ("orientation.q", ["[1]", "[2]", "[3]", "[4]"].as_slice()),
            ("direction", [".x", ".y", ".z"].as_slice()),
        ] {
            let values = unit(components.len(), random);
            for (component, value) in components.iter().zip(values) {
                let name = format!("{prefix}{component}");
                if variables.iter().any(|(n, _)| *n == name) {
                    fmu.set(&name, value).expect("a start value");
                }
            }
        }
        if settings.contains(&("joint.kind", 5.0)) {
            // omega across the direction, and both general
            let d = [".x", ".y", ".z"].map(|c| fmu.start(&format!("direction{c}")));
            let omega = [d[1] - 0.3 * d[2], 0.7 * d[2] - d[0], 0.3 * d[0] - 0.7 * d[1]];
            for (c, value) in [".x", ".y", ".z"].iter().zip(omega) {
                fmu.set(&format!("omega{c}"), value).expect("a start value");
            }
        }
        fmu.initialize().expect("a consistent start");
        // leave the start, where a closed loop has no gap at all
        fmu.pass_event_mode(Interface::CoSimulationWithEvents).expect("Step Mode");
        fmu.step(1e-3).expect("a step");
        fmu.instance.enter_event_mode().expect("Event Mode");
        self.observe(&mut fmu, ROUNDING);
    }

    /// Look at an instance where it stands; derivatives up to the part `rounding` of the largest by the same known are zero.
    ///
    /// # Panics
    /// If a derivative has no value.
    pub fn observe(&mut self, fmu: &mut Named<M>, rounding: f64) {
        let mut column = vec![0.0; self.unknowns.len()];
        for (j, known) in self.knowns.iter().enumerate() {
            fmu.instance
                .directional_derivative(&self.unknowns, &[*known], &[1.0], &mut column)
                .expect("a derivative");
            let largest = column.iter().fold(0.0_f64, |m, d| m.max(d.abs()));
            for (seen, d) in self.observed.iter_mut().zip(&column) {
                seen[j] |= d.abs() > rounding * largest;
            }
        }
    }

    fn name(&self, reference: u32) -> &str {
        &self.fmu.table().variables()[reference as usize].name
    }

    /// The unknowns whose declared dependencies are not the observed ones, each with the observed list.
    ///
    /// # Panics
    /// Never for the model's own unknowns.
    #[must_use]
    pub fn wrong(&self) -> Vec<String> {
        let mut wrong = vec![];
        for (unknown, seen) in self.unknowns.iter().zip(&self.observed) {
            let declared = self.fmu.instance.dependencies(*unknown).expect("an unknown");
            let differs = self.knowns.iter().zip(seen).any(|(k, s)| declared.contains(&(*k as usize)) != *s);
            if differs {
                wrong.push(format!(
                    "{}: observed [{}]",
                    self.name(*unknown),
                    self.compressed(seen).join(", ")
                ));
            }
        }
        wrong
    }

    /// Names of the observed knowns, whole groups by their prefix.
    fn compressed(&self, seen: &[bool]) -> Vec<String> {
        let prefix = |n: &str| n.rfind(['.', '[']).map_or(n, |i| &n[..i]).to_string();
        let names: Vec<_> = self.knowns.iter().map(|k| self.name(*k)).collect();
        let mut out = BTreeSet::new();
        for (name, _) in names.iter().zip(seen).filter(|(_, s)| **s) {
            let group = prefix(name);
            let whole = names.iter().zip(seen).all(|(n, s)| prefix(n) != group || *s);
            out.insert(format!("\"{}\"", if whole { group.as_str() } else { name }));
        }
        out.into_iter().collect()
    }
}
