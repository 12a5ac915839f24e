//! The reader: SSP 1.0 and 2.0.

use std::path::PathBuf;

use super::{Component, Connection, Connector, ParameterValue, Settings, System};
use crate::import::ImportError;
use crate::xml::{self, Element, XmlError};

/// Type of the annotation that says how to run a scene.
const ANNOTATION: &str = "org.fmu-suite.scene";

/// Why a scene is not read.
#[derive(Debug, thiserror::Error)]
pub enum SspError {
    /// A file cannot be read
    #[error("{path}: {source}")]
    Io {
        /// File
        path: PathBuf,
        /// Cause
        source: std::io::Error,
    },
    /// Not well-formed
    #[error("{file}: {source}")]
    Xml {
        /// File in the scene
        file: String,
        /// Cause
        source: XmlError,
    },
    /// Not what SSP asks for
    #[error("{file}: element {element}: {problem}")]
    Structure {
        /// File in the scene
        file: String,
        /// Element
        element: String,
        /// What is wrong
        problem: Problem,
    },
    /// A path that leads out of the scene
    #[error("{name} leads out of the scene")]
    Outside {
        /// As written
        name: String,
    },
    /// No FMU
    #[error("{source_name} is neither in {scene} nor in the FMU folder {folder} (option --fmus)")]
    NoFmu {
        /// As written
        source_name: String,
        /// Scene
        scene: PathBuf,
        /// Fallback
        folder: PathBuf,
    },
    /// An FMU or archive
    #[error(transparent)]
    Import(Box<ImportError>),
}

/// What is wrong with an element.
#[derive(Debug, thiserror::Error)]
pub enum Problem {
    /// An attribute is missing
    #[error("attribute {0} is missing")]
    Missing(&'static str),
    /// An attribute has a wrong value
    #[error("attribute {0} is {1:?}")]
    Value(&'static str, String),
    /// Version of SSP
    #[error("version {0:?} is not supported; 1.0 and 2.0 are")]
    Version(String),
    /// Something the host does not do
    #[error("{0} is not supported")]
    Unsupported(&'static str),
    /// A parameter that does not name a component and a variable
    #[error("parameter {0:?} names no component of the system")]
    Parameter(String),
}

/// Reads files of the scene by name.
type Files<'a> = &'a dyn Fn(&str) -> Result<Vec<u8>, SspError>;

struct Reader<'a> {
    file: &'a str,
    files: Files<'a>,
}

/// Reads a system structure description.
pub(super) fn system(text: &[u8], file: &str, files: Files<'_>) -> Result<System, SspError> {
    let root = xml::parse(text).map_err(|source| SspError::Xml { file: file.into(), source })?;
    Reader { file, files }.system(&root)
}

impl Reader<'_> {
    fn problem(&self, element: &Element, problem: Problem) -> SspError {
        SspError::Structure { file: self.file.into(), element: element.name.clone(), problem }
    }

    fn required<'e>(&self, element: &'e Element, name: &'static str) -> Result<&'e str, SspError> {
        element.attribute(name).ok_or_else(|| self.problem(element, Problem::Missing(name)))
    }

    fn optional<T: std::str::FromStr>(
        &self,
        element: &Element,
        name: &'static str,
    ) -> Result<Option<T>, SspError> {
        let Some(text) = element.attribute(name).map(str::trim).filter(|text| !text.is_empty()) else {
            return Ok(None);
        };
        let value = text.parse();
        value.map(Some).map_err(|_| self.problem(element, Problem::Value(name, text.into())))
    }

    fn number<T: std::str::FromStr>(&self, element: &Element, name: &'static str) -> Result<T, SspError> {
        self.optional(element, name)?.ok_or_else(|| self.problem(element, Problem::Missing(name)))
    }

    fn system(&self, root: &Element) -> Result<System, SspError> {
        match root.attribute("version") {
            Some("1.0" | "2.0") => {}
            version => {
                let version = version.unwrap_or_default().into();
                return Err(self.problem(root, Problem::Version(version)));
            }
        }
        let inner = root.child("System").ok_or_else(|| self.problem(root, Problem::Missing("System")))?;
        let mut system = System { name: self.required(root, "name")?.into(), ..System::default() };
        for element in inner.inside("Elements") {
            match element.name.as_str() {
                "Component" => system.components.push(self.component(element)?),
                _ => return Err(self.problem(element, Problem::Unsupported("a subsystem"))),
            }
        }
        for element in inner.inside("Connections") {
            system.connections.push(self.connection(element)?);
        }
        self.system_parameters(inner, &mut system)?;
        if let Some(experiment) = root.child("DefaultExperiment").or_else(|| inner.child("DefaultExperiment"))
        {
            system.start = self.optional(experiment, "startTime")?;
            system.stop = self.optional(experiment, "stopTime")?;
        }
        for annotations in [root, inner] {
            for annotation in annotations.inside("Annotations") {
                if annotation.attribute("type") == Some(ANNOTATION) {
                    self.settings(annotation, &mut system.settings)?;
                }
            }
        }
        Ok(system)
    }

    fn component(&self, element: &Element) -> Result<Component, SspError> {
        let mut component = Component {
            name: self.required(element, "name")?.into(),
            source: self.required(element, "source")?.into(),
            ..Component::default()
        };
        for connector in element.inside("Connectors") {
            let unit = connector.children.iter().find_map(|kind| kind.attribute("unit"));
            component.connectors.push(Connector {
                name: self.required(connector, "name")?.into(),
                kind: self.required(connector, "kind")?.into(),
                unit: unit.map(String::from),
            });
        }
        component.parameters = self.parameters(element)?;
        Ok(component)
    }

    /// Parameters of an element, bindings in their order: later values replace earlier ones.
    fn parameters(&self, element: &Element) -> Result<Vec<(String, ParameterValue)>, SspError> {
        let mut parameters = Vec::new();
        for binding in element.inside("ParameterBindings") {
            if binding.child("ParameterMapping").is_some() {
                return Err(self.problem(binding, Problem::Unsupported("a parameter mapping")));
            }
            let prefix = binding.attribute("prefix").unwrap_or_default();
            let loaded;
            let set = match (binding.child("ParameterValues"), binding.attribute("source")) {
                (Some(values), _) => values.child("ParameterSet"),
                (None, Some(source)) => {
                    let text = (self.files)(source)?;
                    let root = xml::parse(&text);
                    loaded = root.map_err(|cause| SspError::Xml { file: source.into(), source: cause })?;
                    Some(&loaded)
                }
                (None, None) => None,
            };
            let set = set.ok_or_else(|| self.problem(binding, Problem::Missing("ParameterSet")))?;
            for parameter in set.inside("Parameters") {
                let name = format!("{prefix}{}", self.required(parameter, "name")?);
                parameters.push((name, self.value(parameter)?));
            }
        }
        Ok(parameters)
    }

    /// Bindings of the system name component and variable.
    fn system_parameters(&self, inner: &Element, system: &mut System) -> Result<(), SspError> {
        for (name, value) in self.parameters(inner)? {
            let target = system
                .components
                .iter_mut()
                .filter(|c| name.starts_with(&format!("{}.", c.name)))
                .max_by_key(|c| c.name.len())
                .ok_or_else(|| self.problem(inner, Problem::Parameter(name.clone())))?;
            let variable = name[target.name.len() + 1..].to_owned();
            target.parameters.push((variable, value));
        }
        Ok(())
    }

    fn value(&self, parameter: &Element) -> Result<ParameterValue, SspError> {
        let Some(typed) = parameter.children.iter().find(|c| c.name != "Annotations") else {
            return Err(self.problem(parameter, Problem::Missing("value")));
        };
        let text = self.required(typed, "value")?;
        Ok(match typed.name.as_str() {
            "Real" | "Float64" | "Float32" => ParameterValue::Real(self.number(typed, "value")?),
            "Integer" | "Int8" | "Int16" | "Int32" | "Int64" | "UInt8" | "UInt16" | "UInt32" | "UInt64" => {
                ParameterValue::Integer(self.number(typed, "value")?)
            }
            "Boolean" => ParameterValue::Boolean(match text {
                "true" | "1" => true,
                "false" | "0" => false,
                _ => return Err(self.problem(typed, Problem::Value("value", text.into()))),
            }),
            "String" => ParameterValue::String(text.into()),
            "Enumeration" => ParameterValue::Item(text.into()),
            _ => return Err(self.problem(typed, Problem::Unsupported("this type of parameter"))),
        })
    }

    fn connection(&self, element: &Element) -> Result<Connection, SspError> {
        let end = |component, connector| {
            // the system's own connectors have no element
            let component = element.attribute(component).ok_or_else(|| {
                self.problem(element, Problem::Unsupported("a connection to the system's border"))
            })?;
            Ok::<_, SspError>((component.to_owned(), self.required(element, connector)?.to_owned()))
        };
        let transformation = element.children.iter().find(|c| c.name.ends_with("Transformation"));
        let (factor, offset) = match transformation {
            None => (1.0, 0.0),
            Some(t) if t.name == "LinearTransformation" => {
                (self.optional(t, "factor")?.unwrap_or(1.0), self.optional(t, "offset")?.unwrap_or(0.0))
            }
            Some(t) => return Err(self.problem(t, Problem::Unsupported("a map transformation"))),
        };
        Ok(Connection {
            from: end("startElement", "startConnector")?,
            to: end("endElement", "endConnector")?,
            factor,
            offset,
        })
    }

    fn settings(&self, annotation: &Element, settings: &mut Settings) -> Result<(), SspError> {
        let words = |element: &Element, name: &'static str| -> Result<Vec<String>, SspError> {
            Ok(self.required(element, name)?.split_whitespace().map(String::from).collect())
        };
        // the entries may stand beside or inside the element scene
        let inner = annotation.child("scene").map_or(&[][..], |scene| &scene.children);
        for element in annotation.children.iter().chain(inner) {
            match element.name.as_str() {
                "scene" => {
                    settings.method = self.optional(element, "method")?;
                    settings.integrator = self.optional(element, "integrator")?;
                    settings.step = self.optional(element, "step")?;
                    settings.rtol = self.optional(element, "rtol")?;
                    settings.atol = self.optional(element, "atol")?;
                    settings.order = self.optional(element, "order")?;
                    settings.macro_step = self.optional(element, "H")?;
                    settings.alpha = self.optional(element, "alpha")?;
                }
                "joint" => {
                    let [first, second] =
                        [self.required(element, "first")?, self.required(element, "second")?];
                    settings.joints.push((first.into(), second.into()));
                }
                "assemble" => settings.assemble.extend(words(element, "variables")?),
                "record" => {
                    settings.record.extend(words(element, "variables")?);
                    settings.interval = self.optional(element, "interval")?.or(settings.interval);
                }
                "reference" => settings.reference = Some(self.required(element, "file")?.into()),
                "norm" => {
                    settings
                        .norms
                        .push((self.required(element, "variable")?.into(), self.number(element, "value")?));
                }
                _ => return Err(self.problem(element, Problem::Unsupported("this entry of the scene"))),
            }
        }
        Ok(())
    }
}
