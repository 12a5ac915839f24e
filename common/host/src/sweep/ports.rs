//! All inputs and outputs of a component at once: what a plain exchange and a corrected step need.

use super::Sweeper;
use crate::error::RunError;
use crate::import::{Fault, Status};
use crate::scene::{Network, Source};

/// Signals beyond this multiple of their nominal value have run away.
pub(super) const RUN_AWAY: f64 = 1e9;

/// What one component gives and takes, for a plain exchange.
pub struct Port {
    /// Signals it gives
    pub signals: Vec<usize>,
    /// Their value references
    pub outputs: Vec<u32>,
    /// Inputs it takes, by index
    pub sinks: Vec<usize>,
    /// Their value references
    pub inputs: Vec<u32>,
    /// Where their values come from
    sources: Vec<Option<Source>>,
    /// It follows the motion of others
    pub follows: bool,
}

impl Sweeper {
    /// Inputs that the FMUs hold after a sweep.
    #[must_use]
    pub fn held(&self) -> &[f64] {
        &self.held
    }

    /// Sets all connected inputs to values kept from [`held`](Self::held).
    ///
    /// # Errors
    /// A call that fails.
    pub fn set_inputs(&mut self, values: &[f64]) -> Result<(), RunError> {
        (0..self.ports.len()).try_for_each(|node| self.set_inputs_of(node, values))
    }

    /// The same for one component.
    pub(super) fn set_inputs_of(&mut self, node: usize, values: &[f64]) -> Result<(), RunError> {
        self.scratch.clear();
        self.scratch.extend(self.ports[node].sinks.iter().map(|&sink| values[sink]));
        self.push(node)
    }

    /// Reads all signals of a component.
    ///
    /// # Errors
    /// A call that fails.
    pub fn take(&mut self, node: usize) -> Result<(), RunError> {
        let port = &self.ports[node];
        if port.signals.is_empty() {
            return Ok(());
        }
        self.scratch.resize(port.signals.len(), 0.0);
        let result = self.instances[node].get(&port.outputs, &mut self.scratch);
        for (&signal, &value) in port.signals.iter().zip(&self.scratch) {
            self.values[signal] = value;
        }
        result.map_err(|fault| self.failed(node, fault))
    }

    /// No signal has run away, as they do in a plain exchange of true forces.
    ///
    /// # Errors
    /// The first signal that has, at the time `t`.
    pub fn check_bounds(&self, t: f64) -> Result<(), RunError> {
        let within = |(value, bound): (&f64, &f64)| value.abs() <= *bound;
        match self.values.iter().zip(&self.bounds).position(|pair| !within(pair)) {
            Some(signal) => {
                let value = self.values[signal];
                Err(RunError::Diverged { t, signal: self.signal_names[signal].clone(), value })
            }
            None => Ok(()),
        }
    }

    /// The same error, or divergence as its cause: an FMU refuses values before they reach the bound here.
    pub(crate) fn explained(&self, error: RunError) -> RunError {
        let RunError::Call { t, fault: Fault { status: Status::Discard, .. }, .. } = error else {
            return error;
        };
        match self.values.iter().position(|value| value.is_nan() || value.abs() >= RUN_AWAY) {
            Some(signal) => {
                let value = self.values[signal];
                RunError::Diverged { t, signal: self.signal_names[signal].clone(), value }
            }
            None => error,
        }
    }

    /// Sets all inputs of a component from the signals as they are.
    ///
    /// # Errors
    /// A call that fails.
    pub fn give(&mut self, node: usize) -> Result<(), RunError> {
        let values = &self.values;
        let value = |source: &Option<Source>| source.map_or(0.0, |s| s.factor * values[s.signal] + s.offset);
        self.scratch.clear();
        self.scratch.extend(self.ports[node].sources.iter().map(value));
        self.push(node)
    }

    fn push(&mut self, node: usize) -> Result<(), RunError> {
        if self.scratch.is_empty() {
            return Ok(());
        }
        let result = self.instances[node].set(&self.ports[node].inputs, &self.scratch);
        result.map_err(|fault| self.failed(node, fault))
    }
}

/// The ports of all components.
pub(super) fn of(network: &Network) -> Vec<Port> {
    let port = |node: usize| {
        let signals: Vec<usize> =
            (0..network.signals.len()).filter(|&s| network.signals[s].node == node).collect();
        let sinks: Vec<usize> = (0..network.sinks.len()).filter(|&s| network.sinks[s].node == node).collect();
        Port {
            outputs: signals.iter().map(|&s| network.signals[s].reference).collect(),
            inputs: sinks.iter().map(|&s| network.sinks[s].reference).collect(),
            sources: sinks.iter().map(|&s| network.sinks[s].source).collect(),
            follows: sinks
                .iter()
                .any(|&s| network.sinks[s].source.is_some_and(|source| network.is_motion(source.signal))),
            signals,
            sinks,
        }
    };
    (0..network.nodes.len()).map(port).collect()
}
