//! Model descriptions of FMI 2.0 and 3.0, as far as a host needs them.

use std::collections::HashMap;

use crate::xml::{self, Element, XmlError};

/// Version of the standard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Version {
    /// FMI 2.0
    V2,
    /// FMI 3.0
    V3,
}

/// Type of a variable, as far as the host tells types apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VariableKind {
    /// Float64, Real
    Real,
    /// Int32, Integer
    Int32,
    /// Int64
    Int64,
    /// Boolean
    Boolean,
    /// Enumeration
    Enumeration,
    /// String
    String,
    /// Everything else: neither read nor written
    Other,
}

/// Role of a variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Causality {
    /// Set by the host along a connection
    Input,
    /// Given to others
    Output,
    /// Set before or during a run
    Parameter,
    /// Everything else
    Local,
}

/// An enumeration type.
#[derive(Clone, Debug)]
pub struct Enumeration {
    /// Meaning
    pub text: String,
    /// Its items
    pub items: Vec<Item>,
}

/// An item of an enumeration.
#[derive(Clone, Debug)]
pub struct Item {
    /// Name
    pub name: String,
    /// Number
    pub value: i64,
    /// Meaning
    pub text: String,
}

/// What the start value of a computed variable means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Initial {
    /// Given and kept
    Exact,
    /// Given as a guess
    Approx,
    /// Computed, or not said
    Calculated,
}

/// A scalar variable.
#[derive(Clone, Debug)]
pub struct Variable {
    /// Name
    pub name: String,
    /// Value reference
    pub reference: u32,
    /// Type
    pub kind: VariableKind,
    /// Role
    pub causality: Causality,
    /// Changes only at events
    pub discrete: bool,
    /// May be set after initialisation (parameters)
    pub tunable: bool,
    /// Unit, its own or that of its type
    pub unit: Option<String>,
    /// Name of its type
    pub declared_type: Option<String>,
    /// Meaning
    pub text: String,
    /// Start value as written
    pub start: Option<String>,
    /// What the start value of a computed variable means
    pub initial: Initial,
    /// Smallest allowed value
    pub min: Option<f64>,
    /// Largest allowed value
    pub max: Option<f64>,
    /// Typical magnitude
    pub nominal: f64,
    /// An array
    pub array: bool,
}

/// What an FMU can do under one interface.
#[derive(Clone, Debug, Default)]
#[allow(clippy::struct_excessive_bools, reason = "flags of the standard")]
pub struct Capabilities {
    /// Name of the library
    pub identifier: String,
    /// States can be saved and restored
    pub state_saving: bool,
    /// Saved states can be turned into bytes
    pub serialised_states: bool,
    /// Directional derivatives
    pub directional_derivatives: bool,
    /// Event Mode in Co-Simulation
    pub event_mode: bool,
    /// Wants to hear of completed integrator steps
    pub completed_steps: bool,
    /// Step sizes may differ
    pub variable_steps: bool,
    /// Only one instance per process
    pub single_instance: bool,
}

/// Run proposed by an FMU.
#[derive(Clone, Copy, Debug, Default)]
pub struct Experiment {
    /// Start [s]
    pub start: Option<f64>,
    /// Stop [s]
    pub stop: Option<f64>,
    /// Communication step [s]
    pub step: Option<f64>,
}

/// Exponents of the SI base units and factor.
#[derive(Clone, Debug, PartialEq)]
pub struct BaseUnit {
    exponents: [i32; 8],
    factor: f64,
    offset: f64,
}

/// A model description.
#[derive(Clone, Debug)]
pub struct Description {
    /// Version of the standard
    pub version: Version,
    /// Name of the model
    pub name: String,
    /// Token, to be handed to the library
    pub token: String,
    /// One sentence
    pub text: String,
    /// Co-Simulation
    pub co_simulation: Option<Capabilities>,
    /// Model Exchange
    pub model_exchange: Option<Capabilities>,
    /// All variables, in their order
    pub variables: Vec<Variable>,
    /// Enumerations by the name of the type
    pub enumerations: HashMap<String, Enumeration>,
    /// Units by name
    pub units: HashMap<String, BaseUnit>,
    /// References of the inputs and states that an output depends on; `None`: on all
    pub dependencies: HashMap<u32, Option<Vec<u32>>>,
    /// References of the continuous states
    pub states: Vec<u32>,
    /// FMI 2.0: number of event indicators
    pub indicators: usize,
    /// Run proposed
    pub experiment: Experiment,
    by_name: HashMap<String, usize>,
}

/// Why a model description is not read.
#[derive(Debug, thiserror::Error)]
pub enum DescriptionError {
    /// Not well-formed
    #[error(transparent)]
    Xml(#[from] XmlError),
    /// Another version
    #[error("fmiVersion {0:?} is not supported; 2.0 and 3.0 are")]
    Version(String),
    /// An attribute is missing or no value of its kind
    #[error("element {element}: attribute {attribute} is {value:?}")]
    Attribute {
        /// Element
        element: String,
        /// Attribute
        attribute: &'static str,
        /// Its value
        value: Option<String>,
    },
    /// Two variables of one name
    #[error("two variables are named {0:?}")]
    Twice(String),
    /// A reference to a variable that does not exist
    #[error("ModelStructure refers to variable {0}, which does not exist")]
    Reference(String),
}

fn missing(element: &Element, attribute: &'static str) -> DescriptionError {
    let value = element.attribute(attribute).map(String::from);
    DescriptionError::Attribute { element: element.name.clone(), attribute, value }
}

fn required<'a>(element: &'a Element, attribute: &'static str) -> Result<&'a str, DescriptionError> {
    element.attribute(attribute).ok_or_else(|| missing(element, attribute))
}

fn optional<T: std::str::FromStr>(
    element: &Element,
    attribute: &'static str,
) -> Result<Option<T>, DescriptionError> {
    element
        .attribute(attribute)
        .map(|value| value.trim().parse().map_err(|_| missing(element, attribute)))
        .transpose()
}

fn is_true(element: &Element, attribute: &str) -> bool {
    matches!(element.attribute(attribute), Some("true" | "1"))
}

impl Description {
    /// Reads `modelDescription.xml`.
    ///
    /// # Errors
    /// A text that is not a model description of FMI 2.0 or 3.0.
    pub fn read(text: &[u8]) -> Result<Self, DescriptionError> {
        let root = xml::parse(text)?;
        let version = match required(&root, "fmiVersion")? {
            "2.0" => Version::V2,
            v if v.starts_with("3.") => Version::V3,
            v => return Err(DescriptionError::Version(v.into())),
        };
        let types = type_units(&root);
        let mut variables = Vec::new();
        for element in root.inside("ModelVariables") {
            variables.push(match version {
                Version::V2 => variable_2(element, &types)?,
                Version::V3 => variable_3(element, &types)?,
            });
        }
        let mut by_name = HashMap::new();
        for (i, variable) in variables.iter().enumerate() {
            if by_name.insert(variable.name.clone(), i).is_some() {
                return Err(DescriptionError::Twice(variable.name.clone()));
            }
        }
        let token = match version {
            Version::V2 => "guid",
            Version::V3 => "instantiationToken",
        };
        let mut description = Self {
            version,
            name: required(&root, "modelName")?.into(),
            token: required(&root, token)?.into(),
            text: root.attribute("description").unwrap_or_default().into(),
            co_simulation: capabilities(&root, "CoSimulation", version)?,
            model_exchange: capabilities(&root, "ModelExchange", version)?,
            variables,
            enumerations: enumerations(&root)?,
            units: units(&root)?,
            dependencies: HashMap::new(),
            states: Vec::new(),
            indicators: optional(&root, "numberOfEventIndicators")?.unwrap_or(0),
            experiment: experiment(&root)?,
            by_name,
        };
        description.read_structure(&root)?;
        Ok(description)
    }

    /// The variable of a name.
    #[must_use]
    pub fn variable(&self, name: &str) -> Option<&Variable> {
        self.by_name.get(name).map(|&i| &self.variables[i])
    }

    /// Whether two units mean the same; unknown or missing ones are taken as equal.
    #[must_use]
    pub fn same_unit(&self, unit: &str, other: &Self, other_unit: &str) -> bool {
        match (self.units.get(unit), other.units.get(other_unit)) {
            (Some(a), Some(b)) => a == b,
            _ => unit == other_unit,
        }
    }

    fn read_structure(&mut self, root: &Element) -> Result<(), DescriptionError> {
        let Some(structure) = root.child("ModelStructure") else {
            return Ok(());
        };
        let (outputs, derivatives, key): (Vec<_>, Vec<_>, _) = match self.version {
            Version::V2 => (
                structure.inside("Outputs").iter().collect(),
                structure.inside("Derivatives").iter().collect(),
                "index",
            ),
            Version::V3 => (
                structure.all("Output").collect(),
                structure.all("ContinuousStateDerivative").collect(),
                "valueReference",
            ),
        };
        for output in outputs {
            let reference = self.reference(required(output, key)?)?;
            let dependencies = output
                .attribute("dependencies")
                .map(|list| list.split_whitespace().map(|r| self.reference(r)).collect())
                .transpose()?;
            self.dependencies.insert(reference, dependencies);
        }
        for derivative in derivatives {
            let reference = self.reference(required(derivative, key)?)?;
            self.states.push(reference);
        }
        self.resolve_states(root)
    }

    /// From derivatives to the states they belong to.
    fn resolve_states(&mut self, root: &Element) -> Result<(), DescriptionError> {
        let mut of_derivative = HashMap::new();
        for (i, element) in root.inside("ModelVariables").iter().enumerate() {
            let typed = match self.version {
                Version::V2 => element.child("Real"),
                Version::V3 => Some(element),
            };
            if let Some(state) = typed.and_then(|e| e.attribute("derivative")) {
                of_derivative.insert(self.variables[i].reference, self.reference(state)?);
            }
        }
        for state in &mut self.states {
            *state =
                *of_derivative.get(state).ok_or_else(|| DescriptionError::Reference(state.to_string()))?;
        }
        Ok(())
    }

    /// The reference that an index from 1 (FMI 2.0) or a reference (FMI 3.0) means.
    fn reference(&self, text: &str) -> Result<u32, DescriptionError> {
        let error = || DescriptionError::Reference(text.into());
        let number: u32 = text.parse().map_err(|_| error())?;
        match self.version {
            Version::V2 => (number as usize)
                .checked_sub(1)
                .and_then(|i| self.variables.get(i))
                .map(|v| v.reference)
                .ok_or_else(error),
            Version::V3 => Ok(number),
        }
    }
}

fn capabilities(
    root: &Element,
    name: &str,
    version: Version,
) -> Result<Option<Capabilities>, DescriptionError> {
    let Some(e) = root.child(name) else {
        return Ok(None);
    };
    let (save, serialise, derivatives, skips_completed) = match version {
        Version::V2 => (
            "canGetAndSetFMUstate",
            "canSerializeFMUstate",
            "providesDirectionalDerivative",
            is_true(e, "completedIntegratorStepNotNeeded"),
        ),
        Version::V3 => (
            "canGetAndSetFMUState",
            "canSerializeFMUState",
            "providesDirectionalDerivatives",
            !is_true(e, "needsCompletedIntegratorStep"),
        ),
    };
    Ok(Some(Capabilities {
        identifier: required(e, "modelIdentifier")?.into(),
        state_saving: is_true(e, save),
        serialised_states: is_true(e, serialise),
        directional_derivatives: is_true(e, derivatives),
        event_mode: version == Version::V3 && is_true(e, "hasEventMode"),
        completed_steps: !skips_completed,
        variable_steps: is_true(e, "canHandleVariableCommunicationStepSize"),
        single_instance: is_true(e, "canBeInstantiatedOnlyOncePerProcess"),
    }))
}

fn causality(element: &Element) -> Causality {
    match element.attribute("causality") {
        Some("input") => Causality::Input,
        Some("output") => Causality::Output,
        Some("parameter" | "structuralParameter") => Causality::Parameter,
        _ => Causality::Local,
    }
}

/// Units and nominal values of types by their name.
type Types = HashMap<String, (Option<String>, Option<f64>)>;

fn type_units(root: &Element) -> Types {
    let nominal = |e: &Element| e.attribute("nominal").and_then(|n| n.parse().ok());
    let mut types = Types::new();
    for element in root.inside("TypeDefinitions") {
        let Some(name) = element.attribute("name") else { continue };
        let typed = element.child("Real").unwrap_or(element);
        types.insert(name.into(), (typed.attribute("unit").map(String::from), nominal(typed)));
    }
    types
}

fn variable_3(element: &Element, types: &Types) -> Result<Variable, DescriptionError> {
    let kind = match element.name.as_str() {
        "Float64" => VariableKind::Real,
        "Int32" => VariableKind::Int32,
        "Int64" => VariableKind::Int64,
        "Boolean" => VariableKind::Boolean,
        "Enumeration" => VariableKind::Enumeration,
        "String" => VariableKind::String,
        _ => VariableKind::Other,
    };
    variable(element, element, kind, types)
}

fn variable_2(element: &Element, types: &Types) -> Result<Variable, DescriptionError> {
    let kinds = [
        ("Real", VariableKind::Real),
        ("Integer", VariableKind::Int32),
        ("Boolean", VariableKind::Boolean),
        ("Enumeration", VariableKind::Enumeration),
        ("String", VariableKind::String),
    ];
    for (name, kind) in kinds {
        if let Some(typed) = element.child(name) {
            return variable(element, typed, kind, types);
        }
    }
    Err(missing(element, "name"))
}

fn variable(
    element: &Element,
    typed: &Element,
    kind: VariableKind,
    types: &Types,
) -> Result<Variable, DescriptionError> {
    let declared_type = typed.attribute("declaredType").map(String::from);
    let of_type = declared_type.as_ref().and_then(|name| types.get(name)).cloned().unwrap_or_default();
    let start = typed.attribute("start").or_else(|| typed.child("Start").and_then(|s| s.attribute("value")));
    Ok(Variable {
        name: required(element, "name")?.into(),
        reference: optional(element, "valueReference")?.ok_or_else(|| missing(element, "valueReference"))?,
        kind,
        causality: causality(element),
        discrete: element.attribute("variability") == Some("discrete"),
        tunable: element.attribute("variability") == Some("tunable"),
        unit: typed.attribute("unit").map(String::from).or(of_type.0),
        text: element.attribute("description").unwrap_or_default().into(),
        start: start.map(String::from),
        initial: match element.attribute("initial") {
            Some("exact") => Initial::Exact,
            Some("approx") => Initial::Approx,
            _ => Initial::Calculated,
        },
        min: optional(typed, "min")?,
        max: optional(typed, "max")?,
        nominal: optional(typed, "nominal")?.or(of_type.1).unwrap_or(1.0),
        array: typed.child("Dimension").is_some(),
        declared_type,
    })
}

fn enumerations(root: &Element) -> Result<HashMap<String, Enumeration>, DescriptionError> {
    let text = |e: &Element| e.attribute("description").unwrap_or_default().to_owned();
    let mut types = HashMap::new();
    for element in root.inside("TypeDefinitions") {
        let typed = element.child("Enumeration").unwrap_or(element);
        if typed.child("Item").is_none() {
            continue;
        }
        let items = typed.all("Item").map(|item| {
            let value = optional(item, "value")?.ok_or_else(|| missing(item, "value"))?;
            Ok(Item { name: required(item, "name")?.to_owned(), value, text: text(item) })
        });
        let items = items.collect::<Result<_, DescriptionError>>()?;
        let name = required(element, "name")?.to_owned();
        types.insert(name, Enumeration { text: text(element), items });
    }
    Ok(types)
}

fn units(root: &Element) -> Result<HashMap<String, BaseUnit>, DescriptionError> {
    const BASE: [&str; 8] = ["kg", "m", "s", "A", "K", "mol", "cd", "rad"];
    let mut units = HashMap::new();
    for element in root.inside("UnitDefinitions") {
        let Some(base) = element.child("BaseUnit") else { continue };
        let mut exponents = [0; 8];
        for (exponent, name) in exponents.iter_mut().zip(BASE) {
            *exponent = optional(base, name)?.unwrap_or(0);
        }
        let factor = optional(base, "factor")?.unwrap_or(1.0);
        let offset = optional(base, "offset")?.unwrap_or(0.0);
        units.insert(required(element, "name")?.to_owned(), BaseUnit { exponents, factor, offset });
    }
    Ok(units)
}

fn experiment(root: &Element) -> Result<Experiment, DescriptionError> {
    let Some(e) = root.child("DefaultExperiment") else {
        return Ok(Experiment::default());
    };
    Ok(Experiment {
        start: optional(e, "startTime")?,
        stop: optional(e, "stopTime")?,
        step: optional(e, "stepSize")?,
    })
}
