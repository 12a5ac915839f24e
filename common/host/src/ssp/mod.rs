//! Scenes as SSP: archive or folder, system structure, annotation.

mod pack;
mod package;
mod read;

pub use pack::{files, pack};
pub use package::{Package, outside_reference};
pub use read::SspError;

/// A system of components.
#[derive(Clone, Debug, Default)]
pub struct System {
    /// Name
    pub name: String,
    /// Components in the order of the file
    pub components: Vec<Component>,
    /// Connections in the order of the file
    pub connections: Vec<Connection>,
    /// How to run it
    pub settings: Settings,
    /// Start of the default experiment [s]
    pub start: Option<f64>,
    /// Stop of the default experiment [s]
    pub stop: Option<f64>,
}

impl System {
    /// The same with raw connections: followers give their true force `F` instead of `F0` and `M`.
    #[must_use]
    pub fn raw(&self) -> Self {
        let mut raw = self.clone();
        raw.connections.retain(|c| !c.from.1.split('.').any(|part| part == "M"));
        for connection in &mut raw.connections {
            connection.from.1 = connection.from.1.replace(".F0.", ".F.");
            if let Some(port) = connection.from.1.strip_suffix(".F0") {
                connection.from.1 = format!("{port}.F");
            }
        }
        raw
    }
}

/// A component.
#[derive(Clone, Debug, Default)]
pub struct Component {
    /// Name
    pub name: String,
    /// FMU, relative to the scene
    pub source: String,
    /// Declared connectors
    pub connectors: Vec<Connector>,
    /// Parameters and start values
    pub parameters: Vec<(String, ParameterValue)>,
}

/// A declared connector.
#[derive(Clone, Debug)]
pub struct Connector {
    /// Name of the variable
    pub name: String,
    /// input, output, parameter, ...
    pub kind: String,
    /// Unit
    pub unit: Option<String>,
}

/// A parameter value as written.
#[derive(Clone, Debug, PartialEq)]
pub enum ParameterValue {
    /// ssv:Real, Float64
    Real(f64),
    /// ssv:Integer
    Integer(i64),
    /// ssv:Boolean
    Boolean(bool),
    /// ssv:String
    String(String),
    /// ssv:Enumeration: name of the item
    Item(String),
    /// From the command line: as the variable's type reads it
    Text(String),
}

/// A connection of two connectors.
#[derive(Clone, Debug)]
pub struct Connection {
    /// Component and variable of the source
    pub from: (String, String),
    /// Component and variable of the sink
    pub to: (String, String),
    /// Factor of the linear transformation
    pub factor: f64,
    /// Offset of the linear transformation
    pub offset: f64,
}

/// The scene's annotation `org.fmu-suite.scene`.
#[derive(Clone, Debug, Default)]
pub struct Settings {
    /// Method of the host
    pub method: Option<String>,
    /// Integrator of method `common`
    pub integrator: Option<String>,
    /// Step of fixed-step integrators [s]
    pub step: Option<f64>,
    /// Relative tolerance
    pub rtol: Option<f64>,
    /// Absolute tolerance
    pub atol: Option<f64>,
    /// Degree of the input polynomials
    pub order: Option<i64>,
    /// Communication step [s]
    pub macro_step: Option<f64>,
    /// Stabilisation of closing joints [1/s]
    pub alpha: Option<f64>,
    /// Closing joints: ports of two leaders
    pub joints: Vec<(String, String)>,
    /// Start parameters the host may change to close the joints
    pub assemble: Vec<String>,
    /// Recorded variables
    pub record: Vec<String>,
    /// Interval of recording [s]
    pub interval: Option<f64>,
    /// Reference results, relative to the scene
    pub reference: Option<String>,
    /// Norms of recorded variables
    pub norms: Vec<(String, f64)>,
}
