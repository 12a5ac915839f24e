//! Saved states, and the way back from a step that cannot be done.

use fmu_export::inputs::History;
use fmu_export::{Fault, Interface, Phase, SerialisedStateError};
use serde::{Deserialize, Serialize};

use super::{Assembly, refused};
use crate::import::Saved;
use crate::methods::{Run, RunState};
use crate::sweep::{SweepState, Sweeper};

/// Everything that a run changes.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct AssemblyState {
    interface: Interface,
    phase: Phase,
    start_time: f64,
    stop_time: Option<f64>,
    values: Vec<f64>,
    given: Vec<f64>,
    inputs: Vec<f64>,
    history: History,
    reset_seen: f64,
    flags: Flags,
    sweep: SweepState,
    run: Option<RunState>,
    /// States of the elements as bytes, so that they do not belong to the instances that made them
    elements: Vec<Vec<u8>>,
}

/// How far the elements have heard of what was set.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
#[allow(clippy::struct_excessive_bools, reason = "each is set and asked by itself")]
pub(super) struct Flags {
    /// In Initialization Mode: values were set since all were in step
    pub(super) stale: bool,
    /// The elements are in Event Mode, where something was set that changes at events only
    pub(super) in_event: bool,
    /// Something was taken over since the last step
    pub(super) changed: bool,
    /// What was set is taken over
    pub(super) settled: bool,
    /// The elements stand at the present time
    pub(super) shown: bool,
}

impl Flags {
    /// Of a fresh instance.
    pub(super) const START: Self =
        Self { stale: true, in_event: false, changed: false, settled: true, shown: true };
}

/// Where a step began.
#[derive(Default)]
pub(super) struct Backup {
    elements: Vec<Option<Saved>>,
    run: Option<RunState>,
    sweep: Option<SweepState>,
    flags: Option<Flags>,
}

impl Backup {
    /// Gives the saved states back to the elements that made them.
    pub(super) fn forget(&mut self, sweeper: &mut Sweeper) {
        for (saved, instance) in self.elements.drain(..).zip(&mut sweeper.instances) {
            if let Some(saved) = saved {
                let _ = instance.forget(saved); // nothing is left to do for an element that refuses
            }
        }
    }
}

impl Assembly {
    /// Whether all elements can turn their states into bytes.
    fn serialises(&self) -> bool {
        self.sweeper.instances.iter().all(|instance| instance.capabilities().serialised_states)
    }

    /// Whether all elements can save their states.
    fn saves(&self) -> bool {
        self.sweeper.instances.iter().all(|instance| instance.capabilities().state_saving)
    }

    /// Remembers where a step begins.
    pub(super) fn keep(&mut self) -> Result<(), Fault> {
        let Self { backup, sweeper, run, flags, .. } = self;
        backup.flags = Some(*flags);
        backup.sweep = Some(sweeper.save());
        backup.run = run.as_ref().map(Run::save);
        backup.elements.resize_with(sweeper.instances.len(), || None);
        let elements = &mut backup.elements;
        sweeper
            .each(|node, instance| {
                if instance.capabilities().state_saving { instance.save(&mut elements[node]) } else { Ok(()) }
            })
            .map_err(refused)
    }

    /// Back to where the step began.
    pub(super) fn go_back(&mut self) {
        let Self { backup, sweeper, run, .. } = self;
        self.flags = backup.flags.unwrap_or(self.flags);
        let elements = &backup.elements;
        let restored = sweeper.each(|node, instance| match &elements[node] {
            Some(saved) => instance.restore(saved),
            None => Ok(()),
        });
        if let (Some(run), Some(state)) = (run.as_mut(), &backup.run) {
            run.restore(state);
        }
        if let Some(state) = &backup.sweep {
            sweeper.restore(state);
        }
        if restored.is_err() || !self.saves() {
            // an element does not come back: nothing can be computed any more
            self.phase = Phase::Terminated;
        }
    }

    /// The present state.
    pub(super) fn saved(&mut self) -> Result<AssemblyState, Fault> {
        if !self.serialises() {
            return Err(Fault::Unsupported { reason: "an element cannot serialise its state" });
        }
        let mut elements = Vec::new();
        let saved = self.sweeper.each(|_, instance| instance.save_bytes().map(|bytes| elements.push(bytes)));
        saved.map_err(refused)?;
        Ok(AssemblyState {
            interface: self.interface,
            phase: self.phase,
            start_time: self.start_time,
            stop_time: self.stop_time,
            values: self.values.clone(),
            given: self.given.clone(),
            inputs: self.inputs.clone(),
            history: self.history.clone(),
            reset_seen: self.reset_seen,
            flags: self.flags,
            sweep: self.sweeper.save(),
            run: self.run.as_ref().map(Run::save),
            elements,
        })
    }

    /// Back to a saved state.
    pub(super) fn restored(&mut self, saved: &AssemblyState) -> Result<(), Fault> {
        if saved.interface != self.interface {
            return Err(Fault::ForeignState { saved: saved.interface, instance: self.interface });
        }
        let elements = &saved.elements;
        self.sweeper.each(|node, instance| instance.restore_bytes(&elements[node])).map_err(refused)?;
        self.sweeper.restore(&saved.sweep);
        (self.phase, self.start_time, self.stop_time) = (saved.phase, saved.start_time, saved.stop_time);
        self.values.clone_from(&saved.values);
        self.given.clone_from(&saved.given);
        self.inputs.clone_from(&saved.inputs);
        self.history.clone_from(&saved.history);
        self.reset_seen = saved.reset_seen;
        self.flags = saved.flags;
        self.config = self.configured()?;
        self.run = match &saved.run {
            None => None,
            Some(state) => {
                let run = Run::resume(&mut self.sweeper, &self.config, state).map_err(refused)?;
                Some(run.ok_or(SerialisedStateError::Content)?)
            }
        };
        Ok(())
    }

    /// A saved state from bytes.
    pub(super) fn unpacked(&self, bytes: &[u8]) -> Result<Box<AssemblyState>, Fault> {
        let state: AssemblyState = self.layout.table.unframed(bytes)?;
        let fits = state.values.len() == self.values.len()
            && state.given.len() == self.given.len()
            && state.inputs.len() == self.inputs.len()
            && state.history.fits(self.given.len())
            && state.elements.len() == self.sweeper.instances.len()
            && self.sweeper.fits(&state.sweep);
        if fits { Ok(Box::new(state)) } else { Err(SerialisedStateError::Content.into()) }
    }
}
