//! Components, their variables in use, and what feeds what.

use std::collections::HashMap;
use std::path::Path;
use std::rc::Rc;

use super::SceneError;
use super::order::{Role, role};
use crate::import::{Causality, Fmu, Variable, VariableKind};
use crate::ssp::{Connection, Package, System};

/// A component with its FMU.
pub struct Node {
    /// Name in the scene
    pub name: String,
    /// Its FMU
    pub fmu: Rc<Fmu>,
}

/// An output in use.
#[derive(Clone, Debug)]
pub struct Signal {
    /// Index of the component
    pub node: usize,
    /// Value reference
    pub reference: u32,
    /// Name of the variable
    pub name: String,
    /// Typical magnitude
    pub nominal: f64,
}

/// What an input takes from a signal.
#[derive(Clone, Copy, Debug)]
pub struct Source {
    /// Index of the signal
    pub signal: usize,
    /// Factor of the connection
    pub factor: f64,
    /// Offset of the connection
    pub offset: f64,
}

/// An input that the host sets.
#[derive(Clone, Debug)]
pub struct Sink {
    /// Index of the component
    pub node: usize,
    /// Value reference
    pub reference: u32,
    /// Name of the variable
    pub name: String,
    /// Where the value comes from
    pub source: Option<Source>,
    /// Unknown of the closure that acts here, with its sign
    pub unknown: Option<(usize, f64)>,
}

/// One direction of a closing joint: signals on the first and second port.
#[derive(Clone, Copy, Debug)]
pub struct Axis {
    /// Position
    pub r: [usize; 2],
    /// Velocity
    pub v: [usize; 2],
    /// Acceleration
    pub a: [usize; 2],
}

/// A closing joint.
#[derive(Clone, Debug)]
pub struct Joint {
    /// Ports
    pub ports: [String; 2],
    /// Its directions; each is one unknown
    pub axes: Vec<Axis>,
}

/// A recorded variable.
#[derive(Clone, Debug)]
pub struct Recorded {
    /// Index of the component
    pub node: usize,
    /// Value reference
    pub reference: u32,
    /// Type
    pub kind: VariableKind,
    /// Component and variable
    pub name: String,
}

/// A scene without instances.
pub struct Network {
    /// Components
    pub nodes: Vec<Node>,
    /// Outputs in use
    pub signals: Vec<Signal>,
    /// Inputs in use
    pub sinks: Vec<Sink>,
    /// Closing joints
    pub joints: Vec<Joint>,
    /// Recorded variables
    pub recorded: Vec<Recorded>,
    /// Number of unknowns of closing joints
    pub unknowns: usize,
}

/// Splits `component.variable` at the longest component name.
fn split<'a>(nodes: &[Node], text: &'a str, place: &str) -> Result<(usize, &'a str), SceneError> {
    nodes
        .iter()
        .enumerate()
        .filter(|(_, n)| {
            text.len() > n.name.len() && text.starts_with(&n.name) && text.as_bytes()[n.name.len()] == b'.'
        })
        .max_by_key(|(_, n)| n.name.len())
        .map(|(i, n)| (i, &text[n.name.len() + 1..]))
        .ok_or_else(|| unknown_component(nodes, text, place))
}

fn unknown_component(nodes: &[Node], name: &str, place: &str) -> SceneError {
    let known = nodes.iter().map(|n| n.name.as_str()).collect::<Vec<_>>().join(", ");
    SceneError::Component { place: place.into(), name: name.into(), known }
}

/// A variable of a component, or the error that it has none.
pub(super) fn variable<'a>(node: &'a Node, name: &str, place: &str) -> Result<&'a Variable, SceneError> {
    node.fmu.description.variable(name).ok_or_else(|| {
        let last = name.rsplit('.').next().unwrap_or(name);
        let near =
            |v: &&Variable| v.name.eq_ignore_ascii_case(name) || v.name.rsplit('.').next() == Some(last);
        let variables = &node.fmu.description.variables;
        SceneError::Variable {
            place: place.into(),
            component: node.name.clone(),
            fmu: node.fmu.description.name.clone(),
            variable: name.into(),
            near: variables.iter().filter(near).take(4).map(|v| v.name.clone()).collect(),
        }
    })
}

impl Network {
    /// Resolves the names of a system.
    ///
    /// # Errors
    /// A missing FMU, component or variable; units that do not fit; two sources of an input.
    pub fn build(system: &System, package: &Package, fmus: &Path) -> Result<Self, SceneError> {
        let mut nodes: Vec<Node> = Vec::new();
        for component in &system.components {
            if nodes.iter().any(|n| n.name == component.name) {
                return Err(SceneError::Twice(component.name.clone()));
            }
            let fmu = package.fmu(&component.source, fmus)?;
            nodes.push(Node { name: component.name.clone(), fmu });
        }
        let mut builder = Builder::new(nodes);
        builder.connectors(system)?;
        for connection in &system.connections {
            builder.connect(connection)?;
        }
        let planar = is_planar(&system.connections);
        for (first, second) in &system.settings.joints {
            builder.join(first, second, planar)?;
        }
        let recorded = builder.recorded(&system.settings.record)?;
        let Builder { nodes, signals, sinks, joints, unknowns, .. } = builder;
        Ok(Self { nodes, signals, sinks, joints, recorded, unknowns })
    }

    /// Component and variable of a recorded or named variable.
    ///
    /// # Errors
    /// A name that is not in the scene.
    pub fn find(&self, name: &str, place: &str) -> Result<(usize, &Variable), SceneError> {
        let (node, name) = split(&self.nodes, name, place)?;
        Ok((node, variable(&self.nodes[node], name, place)?))
    }

    /// Whether a signal is a position or velocity of a port.
    #[must_use]
    pub fn is_motion(&self, signal: usize) -> bool {
        role(&self.signals[signal].name) == Role::Motion
    }

    /// Whether a signal changes at events only.
    #[must_use]
    pub fn is_discrete(&self, signal: usize) -> bool {
        let signal = &self.signals[signal];
        let description = &self.nodes[signal.node].fmu.description;
        description.variable(&signal.name).is_some_and(|v| v.discrete)
    }

    /// Components in the order in which motion goes from one to the next.
    #[must_use]
    pub fn leaders_first(&self) -> Vec<usize> {
        let leads = |sink: &Sink| {
            sink.source.filter(|s| self.is_motion(s.signal)).map(|s| self.signals[s.signal].node)
        };
        let mut order: Vec<usize> = Vec::new();
        while order.len() < self.nodes.len() {
            let waits = |node: usize| {
                let of_node = self.sinks.iter().filter(|s| s.node == node);
                of_node.filter_map(leads).any(|leader| !order.contains(&leader) && leader != node)
            };
            let open = (0..self.nodes.len()).filter(|node| !order.contains(node));
            // in a circle of leaders the file decides
            let next = open.clone().find(|&node| !waits(node)).or_else(|| open.clone().next());
            order.extend(next);
        }
        order
    }

    /// Scene name of a signal.
    #[must_use]
    pub fn signal_name(&self, signal: usize) -> String {
        let signal = &self.signals[signal];
        format!("{}.{}", self.nodes[signal.node].name, signal.name)
    }
}

/// Whether the connections of ports leave out the y components everywhere.
fn is_planar(connections: &[Connection]) -> bool {
    let component = |c: &Connection| c.to.1.rsplit_once('.').map(|(_, last)| last.to_owned());
    let any = |wanted: &str| connections.iter().any(|c| component(c).as_deref() == Some(wanted));
    (any("x") || any("z")) && !any("y")
}

struct Builder {
    nodes: Vec<Node>,
    signals: Vec<Signal>,
    sinks: Vec<Sink>,
    joints: Vec<Joint>,
    unknowns: usize,
    signal_of: HashMap<(usize, u32), usize>,
    sink_of: HashMap<(usize, u32), usize>,
}

impl Builder {
    fn new(nodes: Vec<Node>) -> Self {
        Self {
            nodes,
            signals: Vec::new(),
            sinks: Vec::new(),
            joints: Vec::new(),
            unknowns: 0,
            signal_of: HashMap::new(),
            sink_of: HashMap::new(),
        }
    }

    fn node(&self, name: &str, place: &str) -> Result<usize, SceneError> {
        let found = self.nodes.iter().position(|n| n.name == name);
        found.ok_or_else(|| unknown_component(&self.nodes, name, place))
    }

    /// Declared connectors exist in the FMU, with the units that the scene says.
    fn connectors(&self, system: &System) -> Result<(), SceneError> {
        for (component, node) in system.components.iter().zip(&self.nodes) {
            for connector in &component.connectors {
                let name = format!("{}.{}", component.name, connector.name);
                let variable = variable(node, &connector.name, "connector")?;
                let fits = match connector.kind.as_str() {
                    "input" => variable.causality == Causality::Input,
                    "output" => matches!(variable.causality, Causality::Output | Causality::Local),
                    _ => true,
                };
                if !fits {
                    let wanted = if connector.kind == "input" { "an input" } else { "an output" };
                    return Err(SceneError::Role { place: "connector".into(), variable: name, wanted });
                }
                if let (Some(scene), Some(fmu)) = (&connector.unit, &variable.unit)
                    && scene != fmu
                {
                    return Err(SceneError::ConnectorUnit {
                        variable: name,
                        scene: scene.clone(),
                        fmu: fmu.clone(),
                    });
                }
            }
        }
        Ok(())
    }

    fn role(
        &self,
        node: usize,
        name: &str,
        place: &str,
        causality: Causality,
        wanted: &'static str,
    ) -> Result<&Variable, SceneError> {
        let variable = variable(&self.nodes[node], name, place)?;
        let exported = causality == Causality::Output && variable.causality == Causality::Local;
        let fits = variable.causality == causality || exported;
        if !fits || variable.kind != VariableKind::Real || variable.array {
            let name = format!("{}.{name}", self.nodes[node].name);
            return Err(SceneError::Role { place: place.into(), variable: name, wanted });
        }
        Ok(variable)
    }

    /// The signal of an output, made at its first use.
    fn signal(&mut self, node: usize, name: &str, place: &str) -> Result<usize, SceneError> {
        let variable = self.role(node, name, place, Causality::Output, "a real scalar output")?;
        let (reference, nominal) = (variable.reference, variable.nominal);
        let next = self.signals.len();
        let index = *self.signal_of.entry((node, reference)).or_insert(next);
        if index == next {
            self.signals.push(Signal { node, reference, name: name.into(), nominal });
        }
        Ok(index)
    }

    /// The sink of an input, made at its first use.
    fn sink(&mut self, node: usize, name: &str, place: &str) -> Result<usize, SceneError> {
        let reference = self.role(node, name, place, Causality::Input, "a real scalar input")?.reference;
        let next = self.sinks.len();
        let index = *self.sink_of.entry((node, reference)).or_insert(next);
        if index == next {
            self.sinks.push(Sink { node, reference, name: name.into(), source: None, unknown: None });
        }
        Ok(index)
    }

    fn connect(&mut self, connection: &Connection) -> Result<(), SceneError> {
        let Connection { from, to, factor, offset } = connection;
        let (from_name, to_name) = (format!("{}.{}", from.0, from.1), format!("{}.{}", to.0, to.1));
        let place = format!("connection {from_name} -> {to_name}");
        let [source, target] = [self.node(&from.0, &place)?, self.node(&to.0, &place)?];
        let signal = self.signal(source, &from.1, &place)?;
        let sink = self.sink(target, &to.1, &place)?;
        let [a, b] = [&self.nodes[source].fmu.description, &self.nodes[target].fmu.description];
        let units = (
            variable(&self.nodes[source], &from.1, &place)?.unit.clone(),
            variable(&self.nodes[target], &to.1, &place)?.unit.clone(),
        );
        if let (Some(from_unit), Some(to_unit)) = units
            && !a.same_unit(&from_unit, b, &to_unit)
        {
            return Err(SceneError::Unit { from: from_name, from_unit, to: to_name, to_unit });
        }
        if let Some(before) = self.sinks[sink].source {
            let other = &self.signals[before.signal];
            let first = format!("{}.{}", self.nodes[other.node].name, other.name);
            return Err(SceneError::TwoSources { input: to_name, first, second: from_name });
        }
        self.sinks[sink].source = Some(Source { signal, factor: *factor, offset: *offset });
        Ok(())
    }

    /// A closing joint of two leader ports.
    fn join(&mut self, first: &str, second: &str, planar: bool) -> Result<(), SceneError> {
        let place = format!("joint {first} - {second}");
        let mut ports = Vec::new();
        for name in [first, second] {
            let (node, port) = split(&self.nodes, name, &place)?;
            ports.push((node, port.to_owned()));
        }
        let mut axes = Vec::new();
        for axis in if planar { &["x", "z"][..] } else { &["x", "y", "z"] } {
            let unknown = self.unknowns;
            let mut pair = |quantity: &str| -> Result<[usize; 2], SceneError> {
                let mut at = |i: usize| {
                    let (node, port) = &ports[i];
                    self.signal(*node, &format!("{port}.{quantity}.{axis}"), &place)
                };
                Ok([at(0)?, at(1)?])
            };
            let axis_signals = Axis { r: pair("r")?, v: pair("v")?, a: pair("a")? };
            for ((node, port), sign) in ports.iter().zip([1.0, -1.0]) {
                let sink = self.sink(*node, &format!("{port}.F.{axis}"), &place)?;
                if self.sinks[sink].unknown.is_some() {
                    let variable = format!("{}.{port}", self.nodes[*node].name);
                    return Err(SceneError::Role {
                        place,
                        variable,
                        wanted: "free: another joint ends there",
                    });
                }
                self.sinks[sink].unknown = Some((unknown, sign));
            }
            axes.push(axis_signals);
            self.unknowns += 1;
        }
        self.joints.push(Joint { ports: [first.into(), second.into()], axes });
        Ok(())
    }

    fn recorded(&self, names: &[String]) -> Result<Vec<Recorded>, SceneError> {
        let place = "recorded variable";
        let record = |name: &String| {
            let (node, local) = split(&self.nodes, name, place)?;
            let variable = variable(&self.nodes[node], local, place)?;
            if matches!(variable.kind, VariableKind::String | VariableKind::Other) || variable.array {
                let wanted = "a scalar number";
                return Err(SceneError::Role { place: place.into(), variable: name.clone(), wanted });
            }
            let (reference, kind) = (variable.reference, variable.kind);
            Ok(Recorded { node, reference, kind, name: name.clone() })
        };
        names.iter().map(record).collect()
    }
}
