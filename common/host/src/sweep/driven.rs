//! Inputs from outside the scene: those of the ports that no connection and no joint reaches.

use fmu_export::inputs::Polynomials;
use serde::{Deserialize, Serialize};

use super::Sweeper;
use crate::error::RunError;

/// Inputs of one component, set by one call.
struct Target {
    node: usize,
    references: Vec<u32>,
    /// Their places among all
    places: Vec<usize>,
}

/// Inputs from outside.
#[derive(Default)]
pub struct Driven {
    targets: Vec<Target>,
    /// Their values, at the present time where they move
    pub values: Vec<f64>,
    /// How they move over a step
    pub course: Option<Polynomials>,
    /// What the FMUs hold; NaN: not known
    held: Vec<f64>,
    scratch: Vec<f64>,
}

/// What connected and outer inputs the FMUs hold, for a saved state.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct SweepState {
    t: f64,
    values: Vec<f64>,
    held: Vec<f64>,
    unknowns: Vec<f64>,
    driven: Vec<f64>,
}

impl Driven {
    /// Continuous inputs by component and value reference, with their start values.
    #[must_use]
    pub fn new(inputs: &[(usize, u32)], values: Vec<f64>) -> Self {
        let mut targets: Vec<Target> = Vec::new();
        for (place, &(node, reference)) in inputs.iter().enumerate() {
            let known = targets.iter().position(|target| target.node == node);
            let at = known.unwrap_or_else(|| {
                targets.push(Target { node, references: Vec::new(), places: Vec::new() });
                targets.len() - 1
            });
            targets[at].references.push(reference);
            targets[at].places.push(place);
        }
        Self {
            targets,
            held: vec![f64::NAN; values.len()],
            scratch: Vec::with_capacity(values.len()),
            values,
            course: None,
        }
    }
}

impl Driven {
    /// Component and value reference of an input.
    pub(crate) fn target(&self, input: usize) -> (usize, u32) {
        let of = |target: &Target| {
            let at = target.places.iter().position(|&place| place == input)?;
            Some((target.node, target.references[at]))
        };
        self.targets.iter().find_map(of).unwrap_or_default()
    }
}

impl Sweeper {
    /// Brings the inputs from outside to the time `t`.
    ///
    /// # Errors
    /// A value that an FMU refuses.
    #[inline]
    pub fn drive(&mut self, t: f64) -> Result<(), RunError> {
        let Driven { course, values, .. } = &mut self.driven;
        if let Some(course) = course {
            course.evaluate(t, values);
            self.drive_all()?;
        }
        Ok(())
    }

    /// Sets the inputs from outside that have changed.
    ///
    /// # Errors
    /// A value that an FMU refuses.
    pub fn drive_all(&mut self) -> Result<(), RunError> {
        for target in 0..self.driven.targets.len() {
            let Driven { targets, values, held, scratch, .. } = &mut self.driven;
            let Target { node, references, places } = &targets[target];
            let node = *node;
            if places.iter().all(|&i| values[i].to_bits() == held[i].to_bits()) {
                continue;
            }
            scratch.clear();
            scratch.extend(places.iter().map(|&i| values[i]));
            let result = self.instances[node].set(references, scratch);
            for &i in places {
                held[i] = if result.is_ok() { values[i] } else { f64::NAN };
            }
            result.map_err(|fault| self.failed(node, fault))?;
        }
        Ok(())
    }

    /// What the FMUs hold.
    pub(crate) fn save(&self) -> SweepState {
        let Self { t, values, held, unknowns, driven, .. } = self;
        SweepState {
            t: *t,
            values: values.clone(),
            held: held.clone(),
            unknowns: unknowns.clone(),
            driven: driven.values.clone(),
        }
    }

    /// The FMUs are back in the states that belong to `state`.
    pub(crate) fn restore(&mut self, state: &SweepState) {
        self.t = state.t;
        self.values.clone_from(&state.values);
        self.held.clone_from(&state.held);
        self.unknowns.clone_from(&state.unknowns);
        self.driven.values.clone_from(&state.driven);
        self.driven.held.clone_from(&state.driven);
        self.driven.course = None;
    }

    /// Whether a state may be one of this scene.
    pub(crate) fn fits(&self, state: &SweepState) -> bool {
        state.values.len() == self.values.len()
            && state.held.len() == self.held.len()
            && state.unknowns.len() == self.unknowns.len()
            && state.driven.len() == self.driven.values.len()
    }
}
