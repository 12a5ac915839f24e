//! Parameters and start values.

use super::network::{Node, variable};
use super::{Network, SceneError};
use crate::import::{Instance, Value, Variable, VariableKind};
use crate::ssp::{ParameterValue, System};

/// A value given by the user: component, variable, value.
pub type Override = (String, ParameterValue);

/// Reads a value as the variable's type wants it.
fn resolve(node: &Node, variable: &Variable, value: &ParameterValue) -> Result<Value, SceneError> {
    let name = format!("{}.{}", node.name, variable.name);
    let wrong = |wanted| SceneError::ParameterType { parameter: name.clone(), value: shown(value), wanted };
    match variable.kind {
        VariableKind::Real => real(value).map(Value::Real).ok_or_else(|| wrong("a number")),
        VariableKind::Int32 | VariableKind::Int64 => {
            integer(value).map(Value::Integer).ok_or_else(|| wrong("an integer"))
        }
        VariableKind::Boolean => boolean(value).map(Value::Boolean).ok_or_else(|| wrong("true or false")),
        VariableKind::Enumeration => item(node, variable, value, &name),
        VariableKind::String => match value {
            ParameterValue::String(text) | ParameterValue::Text(text) => Ok(Value::String(text.clone())),
            _ => Err(wrong("a text")),
        },
        VariableKind::Other => Err(wrong("a supported type of variable")),
    }
}

fn real(value: &ParameterValue) -> Option<f64> {
    match value {
        ParameterValue::Real(v) => Some(*v),
        #[allow(clippy::cast_precision_loss, reason = "as written by hand")]
        ParameterValue::Integer(v) => Some(*v as f64),
        ParameterValue::Text(text) => text.parse().ok(),
        _ => None,
    }
}

fn integer(value: &ParameterValue) -> Option<i64> {
    match value {
        ParameterValue::Integer(v) => Some(*v),
        ParameterValue::Text(text) => text.parse().ok(),
        _ => None,
    }
}

fn boolean(value: &ParameterValue) -> Option<bool> {
    match value {
        ParameterValue::Boolean(v) => Some(*v),
        ParameterValue::Text(text) => text.parse().ok(),
        _ => None,
    }
}

/// An enumeration by item name, or by its number.
fn item(node: &Node, variable: &Variable, value: &ParameterValue, name: &str) -> Result<Value, SceneError> {
    let types = &node.fmu.description.enumerations;
    let known = variable.declared_type.as_ref().and_then(|t| types.get(t));
    let items = known.map_or(&[][..], |known| &known.items);
    let found = match value {
        ParameterValue::Integer(number) => items.iter().find(|item| item.value == *number),
        ParameterValue::Item(text) | ParameterValue::String(text) | ParameterValue::Text(text) => {
            let number = text.parse::<i64>().ok();
            items.iter().find(|item| item.name == *text || Some(item.value) == number)
        }
        _ => None,
    };
    found.map(|item| Value::Integer(item.value)).ok_or_else(|| SceneError::Item {
        parameter: name.into(),
        item: shown(value),
        items: items.iter().map(|item| item.name.as_str()).collect::<Vec<_>>().join(", "),
    })
}

fn shown(value: &ParameterValue) -> String {
    match value {
        ParameterValue::Real(v) => v.to_string(),
        ParameterValue::Integer(v) => v.to_string(),
        ParameterValue::Boolean(v) => v.to_string(),
        ParameterValue::String(v) | ParameterValue::Item(v) | ParameterValue::Text(v) => v.clone(),
    }
}

/// Sets one parameter or start value.
fn set(node: &Node, instance: &mut Instance, name: &str, value: &ParameterValue) -> Result<(), SceneError> {
    let variable = variable(node, name, "parameter")?;
    let resolved = resolve(node, variable, value)?;
    instance.set_value(variable.kind, variable.reference, &resolved).map_err(|fault| SceneError::Refused {
        parameter: format!("{}.{name}", node.name),
        value: shown(value),
        fault,
        messages: instance.messages(),
    })
}

impl Network {
    /// Sets the parameters of the scene, then those of the user.
    ///
    /// # Errors
    /// A parameter or enumeration item that does not exist, a value that the FMU refuses.
    pub fn set_parameters(
        &self,
        system: &System,
        overrides: &[Override],
        instances: &mut [Instance],
    ) -> Result<(), SceneError> {
        for ((component, node), instance) in system.components.iter().zip(&self.nodes).zip(&mut *instances) {
            for (name, value) in &component.parameters {
                set(node, instance, name, value)?;
            }
        }
        for (name, value) in overrides {
            if let Some(variable) = name.strip_prefix("*.") {
                self.set_everywhere(variable, value, instances)?;
            } else {
                let (node, variable) = self.find(name, "option --set")?;
                set(&self.nodes[node], &mut instances[node], &variable.name, value)?;
            }
        }
        Ok(())
    }

    /// Sets a parameter of every component that has it; one must.
    fn set_everywhere(
        &self,
        name: &str,
        value: &ParameterValue,
        instances: &mut [Instance],
    ) -> Result<(), SceneError> {
        let has = |node: &Node| node.fmu.description.variable(name).is_some();
        if !self.nodes.iter().any(has) {
            let place = "option --set".into();
            return Err(SceneError::Component {
                place,
                name: format!("*.{name}"),
                known: "none has it".into(),
            });
        }
        for (node, instance) in self.nodes.iter().zip(instances).filter(|(node, _)| has(node)) {
            set(node, instance, name, value)?;
        }
        Ok(())
    }
}
