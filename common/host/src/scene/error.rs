//! What can be wrong with a scene.

use crate::import::{Fault, ImportError, listed};
use crate::ssp::SspError;

/// Why a scene is not run.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The files
    #[error(transparent)]
    Ssp(#[from] SspError),
    /// An FMU
    #[error(transparent)]
    Import(#[from] ImportError),
    /// No component of a name
    #[error("{place}: there is no component {name:?}; components: {known}")]
    Component {
        /// Where it is named
        place: String,
        /// As written
        name: String,
        /// All components
        known: String,
    },
    /// Two components of a name
    #[error("two components are named {0:?}")]
    Twice(String),
    /// No variable of a name
    #[error("{place}: {component} ({fmu}) has no variable {variable:?}{}", hint(near))]
    Variable {
        /// Where it is named
        place: String,
        /// Component
        component: String,
        /// Model name
        fmu: String,
        /// As written
        variable: String,
        /// Variables with a similar name
        near: Vec<String>,
    },
    /// A variable of the wrong role or type
    #[error("{place}: {variable} is not {wanted}")]
    Role {
        /// Where it is named
        place: String,
        /// Component and variable
        variable: String,
        /// What is needed
        wanted: &'static str,
    },
    /// Units differ
    #[error("connection {from} -> {to}: unit {from_unit:?} does not fit unit {to_unit:?}")]
    Unit {
        /// Source
        from: String,
        /// Its unit
        from_unit: String,
        /// Sink
        to: String,
        /// Its unit
        to_unit: String,
    },
    /// The scene declares another unit than the FMU
    #[error("connector {variable}: the scene says unit {scene:?}, the FMU {fmu:?}")]
    ConnectorUnit {
        /// Component and variable
        variable: String,
        /// Unit in the scene
        scene: String,
        /// Unit in the FMU
        fmu: String,
    },
    /// An input with two sources
    #[error("input {input} has two sources: {first} and {second}; further followers use P.slot[2]")]
    TwoSources {
        /// Component and variable
        input: String,
        /// Source
        first: String,
        /// Source
        second: String,
    },
    /// A value of the wrong type
    #[error("parameter {parameter} = {value}: {wanted} is needed")]
    ParameterType {
        /// Component and variable
        parameter: String,
        /// As written
        value: String,
        /// What is needed
        wanted: &'static str,
    },
    /// No such enumeration item
    #[error("parameter {parameter}: {item:?} is no item of its enumeration; items: {items}")]
    Item {
        /// Component and variable
        parameter: String,
        /// As written
        item: String,
        /// All items
        items: String,
    },
    /// The FMU refuses a value
    #[error("parameter {parameter} = {value}: {fault}{}", listed(messages))]
    Refused {
        /// Component and variable
        parameter: String,
        /// Value
        value: String,
        /// Cause
        fault: Fault,
        /// What the FMU said
        messages: Vec<String>,
    },
    /// A setting of the run
    #[error("{name} is {value:?}; {wanted}")]
    Setting {
        /// Which
        name: &'static str,
        /// As written
        value: String,
        /// What is needed
        wanted: String,
    },
    /// A setting is missing
    #[error("{name} is not given, neither in the scene nor by the option {option}")]
    MissingSetting {
        /// Which
        name: &'static str,
        /// Command line option
        option: &'static str,
    },
    /// The FMU cannot do what the method needs
    #[error("method {method}: {component} ({fmu}) does not offer {wanted}")]
    Capability {
        /// Method
        method: String,
        /// Component
        component: String,
        /// Model name
        fmu: String,
        /// What is needed
        wanted: &'static str,
    },
}

fn hint(near: &[String]) -> String {
    if near.is_empty() { String::new() } else { format!("; similar: {}", near.join(", ")) }
}
