//! Components without Event Mode between two steps: no Get after Set is allowed there, so their outputs follow the inputs
//! by directional derivatives, `y = y_old + D (u - u_old)`, which is exact for affine ports.

use super::{Call, Port, Sweeper};
use crate::error::RunError;
use crate::import::{Fault, Instance};

/// Outputs of one component as a linear function of its inputs.
pub(super) struct Response {
    /// Places in the port of the inputs on which outputs depend
    columns: Vec<usize>,
    /// All inputs at the end of the last step
    u_old: Vec<f64>,
    /// All outputs there
    y_old: Vec<f64>,
    /// One row for each output, one column for each of `columns`
    derivatives: Vec<f64>,
    scratch: Vec<f64>,
}

/// Places of the outputs that are declared to depend on an input.
fn dependent(instance: &Instance, port: &Port, input: usize) -> Vec<usize> {
    let declared = &instance.fmu().description.dependencies;
    let depends = |output: &u32| match declared.get(output) {
        Some(Some(knowns)) => knowns.contains(&port.inputs[input]),
        _ => true,
    };
    (0..port.outputs.len()).filter(|&row| depends(&port.outputs[row])).collect()
}

impl Response {
    fn new(instance: &Instance, port: &Port) -> Self {
        let inputs = 0..port.inputs.len();
        let columns: Vec<usize> =
            inputs.filter(|&input| !dependent(instance, port, input).is_empty()).collect();
        Self {
            u_old: vec![0.0; port.inputs.len()],
            y_old: vec![0.0; port.outputs.len()],
            derivatives: vec![0.0; port.outputs.len() * columns.len()],
            scratch: vec![0.0; port.outputs.len()],
            columns,
        }
    }

    /// Reads values and derivatives.
    fn observe(&mut self, instance: &mut Instance, port: &Port) -> Result<(), Fault> {
        if !port.inputs.is_empty() {
            instance.get(&port.inputs, &mut self.u_old)?;
        }
        if !port.outputs.is_empty() {
            instance.get(&port.outputs, &mut self.y_old)?;
        }
        let width = self.columns.len();
        for (column, &input) in self.columns.iter().enumerate() {
            let rows = dependent(instance, port, input);
            let unknowns: Vec<u32> = rows.iter().map(|&row| port.outputs[row]).collect();
            let out = &mut self.scratch[..rows.len()];
            instance.directional(&unknowns, &[port.inputs[input]], &[1.0], out)?;
            for (&row, &derivative) in rows.iter().zip(out.iter()) {
                self.derivatives[row * width + column] = derivative;
            }
        }
        Ok(())
    }

    /// An output with the inputs `u`.
    fn output(&self, row: usize, u: impl Fn(usize) -> f64) -> f64 {
        let width = self.columns.len();
        let terms = self.columns.iter().zip(&self.derivatives[row * width..]);
        terms.fold(self.y_old[row], |y, (&column, d)| y + d * (u(column) - self.u_old[column]))
    }
}

impl Sweeper {
    /// Whether a component could answer sweeps by its linear response: no output depends on inputs, or it has derivatives.
    pub(crate) fn can_answer_linearly(&self, node: usize) -> bool {
        let instance = &self.instances[node];
        let derivatives = instance.capabilities().directional_derivatives;
        derivatives || Response::new(instance, &self.ports[node]).columns.is_empty()
    }

    /// From now on a component answers sweeps by its linear response.
    pub(crate) fn answer_linearly(&mut self, node: usize) {
        self.responses[node] = Some(Response::new(&self.instances[node], &self.ports[node]));
    }

    /// After a step: takes values and derivatives of its end from the components that answer linearly; their inputs are
    /// those of the ends of their polynomials.
    ///
    /// # Errors
    /// A call that fails.
    pub(crate) fn observe_responses(&mut self) -> Result<(), RunError> {
        for node in 0..self.responses.len() {
            let Some(response) = &mut self.responses[node] else { continue };
            let port = &self.ports[node];
            let observed = response.observe(&mut self.instances[node], port);
            for (&sink, &value) in port.sinks.iter().zip(&response.u_old) {
                self.held[sink] = value;
            }
            observed.map_err(|fault| self.failed(node, fault))?;
        }
        Ok(())
    }

    /// Before a step: gives components that answer linearly the inputs of a sweep.
    ///
    /// # Errors
    /// A call that fails.
    pub(crate) fn set_answered(&mut self, values: &[f64]) -> Result<(), RunError> {
        for node in 0..self.responses.len() {
            if self.responses[node].is_some() {
                self.set_inputs_of(node, values)?;
            }
        }
        Ok(())
    }

    /// A call of the sweep that the component's response answers; whether it has one.
    #[inline]
    pub(super) fn answered(&mut self, call: &Call) -> bool {
        if self.responses[call.node].is_none() {
            return false;
        }
        for &sink in &call.sinks {
            self.held[sink] = self.wanted(&self.inputs[sink]);
        }
        if let Some(response) = &self.responses[call.node] {
            let port = &self.ports[call.node];
            for &signal in &call.signals {
                let row = port.signals.partition_point(|&s| s < signal);
                self.values[signal] = response.output(row, |place| self.held[port.sinks[place]]);
            }
        }
        true
    }
}
