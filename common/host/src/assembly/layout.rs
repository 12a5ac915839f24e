//! The variables of an assembly: its own, and those of its elements with the element's name before theirs.
//!
//! | section | holds |
//! | --- | --- |
//! | own parameters | `solver.*`; with ports outwards `port.*` |
//! | parameters | all of the elements, but `solver.*` and `port.*`, which act in an FMU with a solver of its own |
//! | inputs | of ports and other inputs that no connection and no joint reaches; `port.reset` |
//! | outputs | what the scene records, start values of states, outputs of the outer ports |
//! | locals | the distance at each closing joint, counters |

use std::collections::{BTreeSet, HashMap};
use std::ops::Range;

use fmu_export::inputs::{PortParameters, PortReset};
use fmu_export::{
    SolverCounters, SolverMethod, SolverParameters, TIME, Table, Variable, interned, port_parts,
};
use model::{Causality, Entry, EnumType, Initial, Kind, Variability, Variables};

use super::AssemblyError;
use super::reach::Reach;
use crate::import::{self, VariableKind};
use crate::methods::Config;
use crate::run::Scene;
use crate::sweep::Sweeper;

/// Where the value of a variable is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Place {
    /// In the list of the assembly
    Own,
    /// Among the continuous inputs from outside
    Input(usize),
    /// In an element
    Element {
        /// Index of the component
        node: usize,
        /// Value reference there
        reference: u32,
        /// Type there
        kind: VariableKind,
    },
    /// Distance at a closing joint
    Gap(usize),
}

/// The variables of an assembly.
pub(super) struct Layout {
    pub(super) table: Table,
    /// Where each value is, by value reference
    pub(super) places: Vec<Place>,
    /// Value references of sections
    pub(super) solver: Range<usize>,
    pub(super) port: Range<usize>,
    pub(super) parameters: Range<usize>,
    pub(super) inputs: Range<usize>,
    pub(super) reset: Range<usize>,
    pub(super) counters: Range<usize>,
}

/// A table under construction.
struct Builder<'a> {
    scene: &'a Scene,
    variables: Vec<Variable>,
    places: Vec<Place>,
    types: HashMap<String, &'static EnumType>,
}

/// Parts of the solver and of the input treatment of an element, which do nothing where it is integrated by others.
fn acts_alone(name: &str) -> bool {
    name.starts_with("solver.") || name.starts_with("port.")
}

/// The port's own name, without a slot.
fn without_slot(port: &str) -> &str {
    port.find(".slot[").map_or(port, |at| &port[..at])
}

impl Layout {
    /// The variables of a scene whose instances have their parameters and are not initialised; `step` is the start value
    /// of `solver.step` where the scene has none.
    ///
    /// # Errors
    /// Two variables of one name; a start value that an element does not give.
    pub(super) fn of(
        scene: &Scene,
        sweeper: &mut Sweeper,
        config: &Config,
        step: f64,
    ) -> Result<Self, AssemblyError> {
        let outer = Outer::of(scene);
        let mut builder = Builder { scene, variables: Vec::new(), places: Vec::new(), types: HashMap::new() };
        builder.own(&[TIME], &[]);
        #[allow(clippy::cast_precision_loss, reason = "a small number")]
        let method = SolverMethod::from(config.integrator) as i64 as f64;
        let starts = [method, config.step.unwrap_or(step), config.rtol, config.atol];
        let solver = builder.own(<SolverParameters as Variables<f64>>::TABLE, &starts);
        let treated = !outer.inputs.is_empty();
        let on = |table: &'static [Entry]| if treated { table } else { &[] };
        let port = builder.own(on(<PortParameters as Variables<f64>>::TABLE), &[]);
        let parameters = builder.elements(sweeper, |_, v| {
            let wanted = v.causality == import::Causality::Parameter && !acts_alone(&v.name);
            wanted.then_some(Causality::Parameter)
        })?;
        let is_outer = |node, v: &import::Variable| outer.inputs.contains(&(node, v.reference));
        let inputs = builder
            .elements(sweeper, |node, v| (is_outer(node, v) && !v.discrete).then_some(Causality::Input))?;
        for (i, place) in builder.places[inputs.clone()].iter_mut().enumerate() {
            *place = Place::Input(i);
        }
        let reset = builder.own(on(<PortReset as Variables<f64>>::TABLE), &[]);
        builder.elements(sweeper, |node, v| (is_outer(node, v) && v.discrete).then_some(Causality::Input))?;
        let outputs = builder.elements(sweeper, |node, v| outer.shown(scene, node, v))?;
        builder.gaps();
        let counters = builder.own(<SolverCounters as Variables<f64>>::TABLE, &[]);
        builder.depend(inputs.clone(), outputs, &outer.references(scene));
        builder.check()?;
        let table = Table::of(&scene.system.name, builder.variables);
        Ok(Self { table, places: builder.places, solver, port, parameters, inputs, reset, counters })
    }

    /// Components and value references of the continuous inputs from outside.
    pub(super) fn targets(scene: &Scene) -> Vec<(usize, u32)> {
        let outer = Outer::of(scene);
        let discrete = |&(node, reference): &(usize, u32)| {
            let variables = &scene.network.nodes[node].fmu.description.variables;
            variables.iter().any(|v| v.reference == reference && v.discrete)
        };
        outer.references(scene).into_iter().filter(|target| !discrete(target)).collect()
    }
}

/// What leads out of a scene.
struct Outer {
    /// Inputs by component and value reference
    inputs: BTreeSet<(usize, u32)>,
    /// Components and names of ports
    ports: BTreeSet<(usize, String)>,
}

impl Outer {
    fn of(scene: &Scene) -> Self {
        let network = &scene.network;
        let fed: BTreeSet<(usize, u32)> = network.sinks.iter().map(|s| (s.node, s.reference)).collect();
        let port_of = |name: &str| port_parts(name).map(|(port, ..)| port.to_owned());
        let reached: BTreeSet<(usize, String)> =
            network.sinks.iter().filter_map(|s| Some((s.node, port_of(&s.name)?))).collect();
        let (mut inputs, mut ports) = (BTreeSet::new(), BTreeSet::new());
        for (node, component) in network.nodes.iter().enumerate() {
            for v in &component.fmu.description.variables {
                let scalar = v.kind == VariableKind::Real && !v.array;
                if v.causality != import::Causality::Input || !scalar || acts_alone(&v.name) {
                    continue;
                }
                match port_of(&v.name) {
                    Some(port) if !reached.contains(&(node, port.clone())) => {
                        ports.insert((node, without_slot(&port).to_owned()));
                        inputs.insert((node, v.reference));
                    }
                    None if !fed.contains(&(node, v.reference)) => {
                        inputs.insert((node, v.reference));
                    }
                    _ => {}
                }
            }
        }
        Self { inputs, ports }
    }

    /// The inputs in the order of the elements and their variables.
    fn references(&self, scene: &Scene) -> Vec<(usize, u32)> {
        let nodes = scene.network.nodes.iter().enumerate();
        let of = |(node, component): (usize, &crate::scene::Node)| {
            let variables = component.fmu.description.variables.iter().map(move |v| (node, v.reference));
            variables.filter(|target| self.inputs.contains(target)).collect::<Vec<_>>()
        };
        nodes.flat_map(of).collect()
    }

    /// What a computed variable of an element is in the assembly, if it is shown.
    fn shown(&self, scene: &Scene, node: usize, v: &import::Variable) -> Option<Causality> {
        let computed = matches!(v.causality, import::Causality::Output | import::Causality::Local);
        if !computed || v.array || acts_alone(&v.name) || v.name == "time" {
            return None;
        }
        let recorded = scene.network.recorded.iter().any(|r| r.node == node && r.reference == v.reference);
        let output = v.causality == import::Causality::Output;
        let has_start = v.initial != import::Initial::Calculated;
        let of_port =
            port_parts(&v.name).is_some_and(|(port, ..)| self.ports.contains(&(node, port.to_owned())));
        let real = v.kind == VariableKind::Real;
        if real && (recorded || output && (has_start || of_port)) {
            return Some(Causality::Output);
        }
        (recorded || has_start).then_some(Causality::Local)
    }
}

impl Builder<'_> {
    /// Adds variables of the assembly itself, with other start values if there are some.
    fn own(&mut self, table: &[Entry], starts: &[f64]) -> Range<usize> {
        let from = self.variables.len();
        for (i, entry) in table.iter().enumerate() {
            let mut entry = *entry;
            entry.start = starts.get(i).copied().unwrap_or(entry.start);
            self.variables.push(Variable { name: entry.name(), entry, derivative_of: None });
            self.places.push(Place::Own);
        }
        from..self.variables.len()
    }

    /// Adds those variables of all elements to which `wanted` gives a causality.
    fn elements(
        &mut self,
        sweeper: &mut Sweeper,
        wanted: impl Fn(usize, &import::Variable) -> Option<Causality>,
    ) -> Result<Range<usize>, AssemblyError> {
        let from = self.variables.len();
        let scene = self.scene;
        for (node, component) in scene.network.nodes.iter().enumerate() {
            for v in &component.fmu.description.variables {
                let Some(causality) = wanted(node, v) else { continue };
                let Some(kind) = self.kind(node, v) else { continue };
                let mut entry = entry(v, kind, causality);
                if entry.has_start() {
                    entry.start = sweeper.instances[node]
                        .get_number(v.kind, v.reference)
                        .map_err(|fault| sweeper.failed(node, fault))?;
                }
                let name = format!("{}.{}", component.name, v.name);
                self.variables.push(Variable { name, entry, derivative_of: None });
                self.places.push(Place::Element { node, reference: v.reference, kind: v.kind });
            }
        }
        Ok(from..self.variables.len())
    }

    /// Type of an element's variable; none for texts and what the host does not read.
    fn kind(&mut self, node: usize, v: &import::Variable) -> Option<Kind> {
        Some(match v.kind {
            VariableKind::Real => Kind::Float64,
            VariableKind::Int32 => Kind::Int32,
            VariableKind::Int64 => Kind::Int64,
            VariableKind::Boolean => Kind::Boolean,
            VariableKind::Enumeration => {
                let name = v.declared_type.as_deref()?;
                let description = &self.scene.network.nodes[node].fmu.description;
                let import::Enumeration { text, items } = description.enumerations.get(name)?;
                let item = |item: &import::Item| (item.name.clone(), item.value, item.text.clone());
                let items: Vec<_> = items.iter().map(item).collect();
                let found = interned::enumeration(name, text, &items);
                let known = *self.types.entry(name.into()).or_insert(found);
                // two FMUs may mean different things by one name
                let longer = format!("{}.{name}", description.name);
                let same = known.items == found.items;
                Kind::Enumeration(if same { known } else { interned::enumeration(&longer, text, &items) })
            }
            VariableKind::String | VariableKind::Other => return None,
        })
    }

    /// Adds the distances at the closing joints.
    fn gaps(&mut self) {
        for (i, joint) in self.scene.network.joints.iter().enumerate() {
            let mut entry = Entry::scalar("", Kind::Float64);
            let what = format!("Distance of {} and {}, which a joint closes", joint.ports[0], joint.ports[1]);
            (entry.description, entry.unit) = (interned::text(&what), "m");
            entry.causality = Causality::Local;
            let name = format!("joint[{}].gap", i + 1);
            self.variables.push(Variable { name, entry, derivative_of: None });
            self.places.push(Place::Gap(i));
        }
    }

    /// Lists for each output the inputs on which it depends directly.
    fn depend(&mut self, inputs: Range<usize>, outputs: Range<usize>, outer: &[(usize, u32)]) {
        let name_of = |target: &(usize, u32)| {
            let is_it = |place: &Place| match place {
                Place::Element { node, reference, .. } => (*node, *reference) == *target,
                _ => false,
            };
            let continuous = || {
                let node = &self.scene.network.nodes[target.0];
                let v = node.fmu.description.variables.iter().find(|v| v.reference == target.1)?;
                Some(format!("{}.{}", node.name, v.name))
            };
            let discrete = self.places.iter().position(is_it);
            discrete.map(|i| self.variables[i].name.clone()).or_else(continuous).unwrap_or_default()
        };
        let names: Vec<String> = outer.iter().map(|target| format!("={}", name_of(target))).collect();
        debug_assert!(inputs.len() <= names.len(), "continuous inputs are some of all");
        let reach = Reach::of(self.scene, outer);
        for i in outputs {
            let Place::Element { node, reference, .. } = self.places[i] else { continue };
            if self.variables[i].entry.causality == Causality::Output {
                let depends = reach.inputs_of(node, reference);
                let listed: Vec<String> = depends.into_iter().map(|input| names[input].clone()).collect();
                self.variables[i].entry.depends = interned::list(&listed);
            }
        }
    }

    /// No name occurs twice.
    fn check(&self) -> Result<(), AssemblyError> {
        let mut names = BTreeSet::new();
        match self.variables.iter().find(|v| !names.insert(&v.name)) {
            Some(twice) => Err(AssemblyError::Twice(twice.name.clone())),
            None => Ok(()),
        }
    }
}

/// An element's variable as one of the assembly.
fn entry(v: &import::Variable, kind: Kind, causality: Causality) -> Entry {
    let mut entry = Entry::scalar("", kind);
    entry.description = interned::text(&v.text);
    entry.unit = match v.unit.as_deref() {
        None | Some("1") => "",
        Some(unit) => interned::text(unit),
    };
    entry.causality = causality;
    entry.variability = match causality {
        Causality::Parameter if v.tunable => Variability::Tunable,
        Causality::Parameter => Variability::Fixed,
        _ if v.discrete || kind != Kind::Float64 => Variability::Discrete,
        _ => Variability::Continuous,
    };
    entry.initial = match v.initial {
        // inputs and parameters have start values anyway
        _ if matches!(causality, Causality::Parameter | Causality::Input) => Initial::Calculated,
        import::Initial::Exact => Initial::Exact,
        import::Initial::Approx => Initial::Approx,
        import::Initial::Calculated => Initial::Calculated,
    };
    entry.min = v.min.unwrap_or(f64::NEG_INFINITY);
    entry.max = v.max.unwrap_or(f64::INFINITY);
    entry.nominal = v.nominal;
    entry
}
