//! What the model description promises, as far as calls are judged by it.

use std::collections::HashMap;

use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

use crate::standard::Version;

/// Type of a variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    Float64,
    Int32,
    Int64,
    Boolean,
    Enumeration,
}

/// Where the value comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Causality {
    Independent,
    Parameter,
    Input,
    Output,
    Local,
}

/// What the start value means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Initial {
    Exact,
    Approx,
    Calculated,
}

/// What the description of a variable says about its range in words.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Range {
    /// Nothing
    Declared,
    /// "one that is not finite acts as": every value is taken
    Any,
    /// "> 0; -1:" or ">= 0; -1:": -1 stands for another source
    MinusOneOr {
        /// 0 is taken
        zero: bool,
    },
}

impl Range {
    fn of(description: &str) -> Self {
        if description.contains("not finite acts as") {
            Self::Any
        } else if description.contains("> 0; -1:") {
            Self::MinusOneOr { zero: false }
        } else if description.contains(">= 0; -1:") {
            Self::MinusOneOr { zero: true }
        } else {
            Self::Declared
        }
    }
}

/// A variable; its value reference is its place in the list.
#[derive(Debug, Clone)]
#[allow(clippy::struct_excessive_bools, reason = "attributes of the description")]
pub(crate) struct Variable {
    pub(crate) name: String,
    pub(crate) kind: Kind,
    pub(crate) causality: Causality,
    pub(crate) continuous: bool,
    pub(crate) tunable: bool,
    pub(crate) initial: Initial,
    pub(crate) min: Option<f64>,
    pub(crate) max: Option<f64>,
    /// What the text says about the range besides
    pub(crate) range: Range,
    pub(crate) start: Option<f64>,
    /// Items of an enumeration: name and value
    pub(crate) items: Vec<(String, i64)>,
    /// A continuous state
    pub(crate) state: bool,
    /// The time derivative of one
    pub(crate) derivative: bool,
}

impl Variable {
    /// True if `value` lies in the declared range.
    #[allow(clippy::float_cmp, clippy::cast_precision_loss, reason = "items are small whole numbers")]
    pub(crate) fn in_range(&self, value: f64) -> bool {
        if self.kind == Kind::Enumeration {
            return self.items.iter().any(|(_, item)| *item as f64 == value);
        }
        if self.is_switch() {
            return value == 0.0 || value == 1.0;
        }
        let declared = value.is_finite()
            && self.min.is_none_or(|min| value >= min)
            && self.max.is_none_or(|max| value <= max);
        match self.range {
            Range::Declared => declared,
            Range::Any => true,
            Range::MinusOneOr { zero } => {
                declared && (value == -1.0 || value >= if zero { 0.0 } else { f64::MIN_POSITIVE })
            }
        }
    }

    /// A discrete number from 0 to 1 is a switch: inputs are Float64 for all hosts, Boolean ones too.
    #[allow(clippy::float_cmp, reason = "as declared")]
    fn is_switch(&self) -> bool {
        let discrete = self.causality == Causality::Input && !self.continuous;
        discrete && self.min == Some(0.0) && self.max == Some(1.0)
    }
}

/// A model description.
#[derive(Debug, Clone, Default)]
pub(crate) struct Description {
    pub(crate) version: Version,
    pub(crate) identifier: String,
    pub(crate) token: String,
    pub(crate) model_exchange: bool,
    pub(crate) serialises: bool,
    pub(crate) derives: bool,
    pub(crate) stop: f64,
    pub(crate) step: f64,
    pub(crate) variables: Vec<Variable>,
    pub(crate) states: usize,
    pub(crate) indicators: usize,
    pub(crate) categories: Vec<String>,
}

/// Why a model description cannot be used.
#[derive(Debug, thiserror::Error)]
pub(crate) enum DescriptionError {
    #[error("model description: {0}")]
    Xml(#[from] quick_xml::Error),
    #[error("model description: {0}")]
    Attribute(#[from] quick_xml::events::attributes::AttrError),
    #[error("{variable} has value reference {reference}, {expected} was expected: they count from 0 here")]
    Reference { variable: String, reference: String, expected: usize },
}

type Attributes = HashMap<String, String>;

fn attributes(element: &BytesStart) -> Result<Attributes, DescriptionError> {
    element
        .attributes()
        .map(|attribute| {
            let attribute = attribute?;
            let name = attribute.key.as_ref().to_string();
            let value = quick_xml::escape::unescape(&attribute.value)
                .map_or_else(|_| attribute.value.to_string(), std::borrow::Cow::into_owned);
            Ok((name, value))
        })
        .collect()
}

impl Description {
    /// Read a model description.
    pub(crate) fn parse(xml: &str) -> Result<Self, DescriptionError> {
        let mut found = Self::default();
        let mut types: HashMap<String, Vec<(String, i64)>> = HashMap::new();
        let mut open_type = String::new();
        let mut states = Vec::new();
        let mut identity = Attributes::new();
        let mut reader = Reader::from_str(xml);
        loop {
            let event = reader.read_event()?;
            let element = match &event {
                Event::Start(element) | Event::Empty(element) => element,
                Event::Eof => break,
                _ => continue,
            };
            let name = element.name().as_ref().to_string();
            let mut a = attributes(element)?;
            if name == "ScalarVariable" {
                identity = a; // the type follows as an element inside
                continue;
            }
            let number = |name: &str| a.get(name).and_then(|v| v.parse::<f64>().ok());
            match name.as_str() {
                "fmiModelDescription" if text(&a, "fmiVersion").starts_with('2') => {
                    found.version = Version::Fmi2;
                    found.token = text(&a, "guid");
                    found.indicators = text(&a, "numberOfEventIndicators").parse().unwrap_or(0);
                }
                "fmiModelDescription" => found.token = text(&a, "instantiationToken"),
                "CoSimulation" => {
                    found.identifier = text(&a, "modelIdentifier");
                    let serialises = a.get("canSerializeFMUState").or(a.get("canSerializeFMUstate"));
                    found.serialises = serialises.is_some_and(|v| v == "true");
                    let derives =
                        a.get("providesDirectionalDerivatives").or(a.get("providesDirectionalDerivative"));
                    found.derives = derives.is_some_and(|v| v == "true");
                }
                "ModelExchange" => found.model_exchange = true,
                "EnumerationType" | "SimpleType" => open_type = text(&a, "name"),
                "Item" => {
                    let value = text(&a, "value").parse().unwrap_or(0);
                    types.entry(open_type.clone()).or_default().push((text(&a, "name"), value));
                }
                "Category" => found.categories.push(text(&a, "name")),
                "DefaultExperiment" => {
                    found.stop = number("stopTime").unwrap_or(1.0);
                    found.step = number("stepSize").unwrap_or(0.01);
                }
                "EventIndicator" => found.indicators += 1,
                // inside the element of an FMI 2.0 type
                "Enumeration" if a.is_empty() => {}
                "Float64" | "Int32" | "Int64" | "Boolean" | "Enumeration" | "Real" | "Integer" => {
                    a.extend(identity.drain());
                    let variable = variable(&name, &a, &types);
                    let reference = text(&a, "valueReference");
                    let expected = found.variables.len();
                    if reference != expected.to_string() {
                        return Err(DescriptionError::Reference {
                            variable: variable.name,
                            reference,
                            expected,
                        });
                    }
                    // FMI 2.0 counts from 1
                    let first = usize::from(found.version == Version::Fmi2);
                    let state = a.get("derivative").and_then(|state| state.parse::<usize>().ok());
                    states.extend(state.and_then(|state| state.checked_sub(first)));
                    found.variables.push(variable);
                }
                _ => {}
            }
        }
        found.states = states.len();
        for state in states {
            if let Some(variable) = found.variables.get_mut(state) {
                variable.state = true;
            }
        }
        Ok(found)
    }

    /// References of the variables that `wanted` selects.
    pub(crate) fn references(&self, wanted: impl Fn(&Variable) -> bool) -> Vec<u32> {
        let chosen = self.variables.iter().zip(0_u32..).filter(|(v, _)| wanted(v));
        chosen.map(|(_, reference)| reference).collect()
    }
}

fn text(a: &Attributes, name: &str) -> String {
    a.get(name).cloned().unwrap_or_default()
}

fn variable(element: &str, a: &Attributes, types: &HashMap<String, Vec<(String, i64)>>) -> Variable {
    let kind = match element {
        "Float64" | "Real" => Kind::Float64,
        "Int32" | "Integer" => Kind::Int32,
        "Int64" => Kind::Int64,
        "Boolean" => Kind::Boolean,
        _ => Kind::Enumeration,
    };
    let causality = match text(a, "causality").as_str() {
        "independent" => Causality::Independent,
        "parameter" => Causality::Parameter,
        "input" => Causality::Input,
        "output" => Causality::Output,
        _ => Causality::Local,
    };
    let initial = match text(a, "initial").as_str() {
        "exact" => Initial::Exact,
        "approx" => Initial::Approx,
        "" if matches!(causality, Causality::Parameter | Causality::Input) => Initial::Exact,
        _ => Initial::Calculated,
    };
    let number = |name: &str| a.get(name).and_then(|v| v.parse::<f64>().ok());
    let start = match text(a, "start").as_str() {
        "true" => Some(1.0),
        "false" => Some(0.0),
        other => other.parse().ok(),
    };
    let variability = text(a, "variability");
    Variable {
        name: text(a, "name"),
        kind,
        causality,
        continuous: variability == "continuous",
        tunable: variability == "tunable",
        initial,
        min: number("min"),
        max: number("max"),
        range: Range::of(&text(a, "description")),
        start,
        items: types.get(&text(a, "declaredType")).cloned().unwrap_or_default(),
        state: false,
        derivative: a.contains_key("derivative"),
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by it")]
mod tests {
    use super::*;

    const XML: &str = r#"<fmiModelDescription instantiationToken="{t}"><ModelExchange modelIdentifier="m"/>
        <CoSimulation modelIdentifier="m" canSerializeFMUState="true"/>
        <TypeDefinitions><EnumerationType name="E"><Item name="one" value="1"/></EnumerationType></TypeDefinitions>
        <DefaultExperiment stopTime="2" stepSize="0.1"/>
        <ModelVariables><Float64 name="time" valueReference="0" causality="independent" variability="continuous"/>
        <Float64 name="a&lt;b" valueReference="1" causality="parameter" variability="tunable" min="0" start="3"/>
        <Enumeration name="e" valueReference="2" causality="parameter" variability="fixed" declaredType="E" start="1"/>
        <Float64 name="x" valueReference="3" causality="output" variability="continuous" initial="exact" start="1"/>
        <Float64 name="der(x)" valueReference="4" causality="local" variability="continuous" derivative="3"/>
        </ModelVariables></fmiModelDescription>"#;

    #[test]
    fn a_description_is_read() {
        let d = Description::parse(XML).unwrap();
        assert!(d.model_exchange && d.serialises);
        assert_eq!((d.token.as_str(), d.identifier.as_str(), d.states, d.indicators), ("{t}", "m", 1, 0));
        let [time, a, e, x, rate] = &d.variables[..] else { panic!("five variables") };
        assert_eq!((a.name.as_str(), a.min, a.tunable, a.initial), ("a<b", Some(0.0), true, Initial::Exact));
        assert!(a.in_range(0.0) && !a.in_range(-1e-300) && !a.in_range(f64::NAN));
        assert!(e.in_range(1.0) && !e.in_range(2.0));
        assert!(x.state && rate.derivative && !rate.state && time.causality == Causality::Independent);
    }

    const XML_2: &str = r#"<fmiModelDescription fmiVersion="2.0" guid="{t}" numberOfEventIndicators="2"><CoSimulation modelIdentifier="m"/>
        <TypeDefinitions><SimpleType name="E"><Enumeration><Item name="one" value="1"/></Enumeration></SimpleType></TypeDefinitions>
        <ModelVariables><ScalarVariable name="e" valueReference="0" causality="parameter" variability="fixed">
        <Enumeration declaredType="E" start="1"/></ScalarVariable>
        <ScalarVariable name="x" valueReference="1" causality="output" variability="continuous"><Real start="1"/></ScalarVariable>
        <ScalarVariable name="der(x)" valueReference="2" causality="local" variability="continuous"><Real derivative="2"/></ScalarVariable>
        </ModelVariables></fmiModelDescription>"#;

    #[test]
    fn a_description_of_fmi2_is_read() {
        let d = Description::parse(XML_2).unwrap();
        assert_eq!((d.version, d.token.as_str(), d.states, d.indicators), (Version::Fmi2, "{t}", 1, 2));
        let [e, x, rate] = &d.variables[..] else { panic!("three variables") };
        assert!(e.in_range(1.0) && !e.in_range(2.0) && x.state && rate.derivative);
        assert_eq!((x.name.as_str(), x.kind, rate.causality), ("x", Kind::Float64, Causality::Local));
    }

    #[test]
    fn other_references_are_refused() {
        assert!(Description::parse(&XML.replace(r#"valueReference="4""#, r#"valueReference="7""#)).is_err());
    }
}
