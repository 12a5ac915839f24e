//! Which outer inputs an output of an element depends on, through the connections and joints of the scene.

use std::collections::{BTreeSet, HashMap};

use crate::import;
use crate::run::Scene;

/// Dependencies of a scene on its outer inputs.
pub(super) struct Reach<'a> {
    scene: &'a Scene,
    /// Outer inputs by component and value reference
    outer: HashMap<(usize, u32), usize>,
    /// Inputs in use by component and value reference
    sinks: HashMap<(usize, u32), usize>,
    /// Outer inputs on which each signal depends
    signals: Vec<BTreeSet<usize>>,
    /// The same for the forces of joints and loops
    unknowns: BTreeSet<usize>,
}

impl<'a> Reach<'a> {
    /// Follows all connections until nothing is added.
    pub(super) fn of(scene: &'a Scene, outer: &[(usize, u32)]) -> Self {
        let network = &scene.network;
        let mut reach = Self {
            scene,
            outer: outer.iter().enumerate().map(|(i, target)| (*target, i)).collect(),
            sinks: network.sinks.iter().enumerate().map(|(i, s)| ((s.node, s.reference), i)).collect(),
            signals: vec![BTreeSet::new(); network.signals.len()],
            unknowns: BTreeSet::new(),
        };
        let cut = |sink: &&crate::scene::Sink| sink.unknown.is_some();
        let cuts = network.sinks.iter().filter(cut).filter_map(|sink| sink.source).map(|s| s.signal);
        let axes = network.joints.iter().flat_map(|j| &j.axes).flat_map(|a| [a.r, a.v, a.a].concat());
        let residuals: Vec<usize> = axes.chain(cuts).collect();
        loop {
            let signals: Vec<BTreeSet<usize>> =
                network.signals.iter().map(|s| reach.inputs_of(s.node, s.reference)).collect();
            let unknowns = residuals.iter().flat_map(|&s| signals[s].iter().copied()).collect();
            if signals == reach.signals && unknowns == reach.unknowns {
                return reach;
            }
            (reach.signals, reach.unknowns) = (signals, unknowns);
        }
    }

    /// Outer inputs on which an output of a component depends, as far as is known.
    pub(super) fn inputs_of(&self, node: usize, reference: u32) -> BTreeSet<usize> {
        let description = &self.scene.network.nodes[node].fmu.description;
        let inputs = || description.variables.iter().filter(|v| v.causality == import::Causality::Input);
        let known: Vec<u32> = match description.dependencies.get(&reference) {
            Some(Some(references)) => references.clone(),
            _ => inputs().map(|v| v.reference).collect(),
        };
        let mut found = BTreeSet::new();
        for input in known {
            found.extend(self.outer.get(&(node, input)));
            let Some(&sink) = self.sinks.get(&(node, input)) else { continue };
            let sink = &self.scene.network.sinks[sink];
            if let Some(source) = sink.source {
                found.extend(&self.signals[source.signal]);
            }
            if sink.unknown.is_some() {
                found.extend(&self.unknowns);
            }
        }
        found
    }
}
