//! How our FMUs treat their inputs inside a step: `port.inputs`, `port.order`.

use crate::error::RunError;
use crate::import::{Instance, Value, VariableKind};
use crate::sweep::Sweeper;

/// Values of `port.inputs`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Treatment {
    /// Inputs follow the polynomial through the last samples
    Extrapolate = 2,
    /// Inputs set before the step belong to its end
    Endpoint = 3,
}

/// The two parameters of a component that has them.
#[derive(Clone, Copy)]
struct Parameters {
    inputs: Option<u32>,
    order: Option<u32>,
}

/// The parameters of all components.
pub(super) struct Inputs {
    parameters: Vec<Parameters>,
    /// References of `port.reset`
    resets: Vec<Option<u32>>,
    announced: f64,
}

impl Inputs {
    pub(super) fn of(sweeper: &Sweeper) -> Self {
        let parameters = sweeper.instances.iter().map(|instance| {
            let find = |name: &str, kind: VariableKind| {
                let variable = instance.fmu().description.variable(name);
                variable.filter(|v| v.kind == kind && v.tunable).map(|v| v.reference)
            };
            Parameters {
                inputs: find("port.inputs", VariableKind::Enumeration),
                order: find("port.order", VariableKind::Int32),
            }
        });
        let reset =
            |instance: &Instance| instance.fmu().description.variable("port.reset").map(|v| v.reference);
        Self {
            parameters: parameters.collect(),
            resets: sweeper.instances.iter().map(reset).collect(),
            announced: 0.0,
        }
    }

    /// Announces a discontinuity: a new value of `port.reset` lets the components forget the samples of their inputs.
    pub(super) fn announce(&mut self, sweeper: &mut Sweeper) -> Result<(), RunError> {
        self.announced += 1.0;
        let (resets, value) = (&self.resets, self.announced);
        sweeper.each(|node, instance| match resets[node] {
            Some(reference) => instance.set(&[reference], &[value]),
            None => Ok(()),
        })
    }

    /// Sets one component.
    pub(super) fn set(
        &self,
        sweeper: &mut Sweeper,
        node: usize,
        treatment: Treatment,
        order: i64,
    ) -> Result<(), RunError> {
        let Parameters { inputs, order: degree } = self.parameters[node];
        let instance = &mut sweeper.instances[node];
        let mut result = Ok(());
        if let Some(reference) = inputs {
            let value = Value::Integer(treatment as i64);
            result = instance.set_value(VariableKind::Enumeration, reference, &value);
        }
        if let (Ok(()), Some(reference)) = (&result, degree) {
            result = instance.set_value(VariableKind::Int32, reference, &Value::Integer(order));
        }
        result.map_err(|fault| sweeper.failed(node, fault))
    }

    /// Sets all components.
    pub(super) fn set_all(
        &self,
        sweeper: &mut Sweeper,
        treatment: Treatment,
        order: i64,
    ) -> Result<(), RunError> {
        (0..self.parameters.len()).try_for_each(|node| self.set(sweeper, node, treatment, order))
    }
}
