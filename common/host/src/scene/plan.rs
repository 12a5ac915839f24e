//! The plan of a sweep: which component sets and reads what, in which order.
//!
//! ```text
//! base     all signals with the unknowns of closing joints and affine loops at 0
//! probes   one per joint or loop: what changes at the residuals when one of its unknowns is 1
//! last     what depends on the unknowns, with their solution
//! ```

use super::Network;
use super::order::Order;

/// Set some inputs of a component, then read some of its signals.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Step {
    /// Index of the component
    pub node: usize,
    /// Inputs
    pub sinks: Vec<usize>,
    /// Signals
    pub signals: Vec<usize>,
}

/// Unknowns that are probed together, one after the other.
#[derive(Clone, Debug, Default)]
pub struct Probe {
    /// The unknowns
    pub unknowns: Vec<usize>,
    /// What changes on the way to the residuals
    pub steps: Vec<Step>,
    /// Residuals that change
    pub rows: Vec<usize>,
}

/// The plan.
#[derive(Clone, Debug, Default)]
pub struct Plan {
    /// Everything once
    pub base: Vec<Step>,
    /// Columns of the linear system
    pub probes: Vec<Probe>,
    /// What depends on the unknowns, then the inputs on which no signal depends
    pub last: Vec<Step>,
    /// Cut inputs: unknowns after those of the joints
    pub cuts: Vec<usize>,
}

/// Marks of signals and sinks.
struct Marks {
    signals: Vec<bool>,
    sinks: Vec<bool>,
}

impl Plan {
    /// Makes the plan; cut inputs become unknowns of the network.
    #[must_use]
    pub fn of(network: &mut Network) -> Self {
        let order = Order::of(network);
        for &sink in &order.cuts {
            network.sinks[sink].unknown = Some((network.unknowns, 1.0));
            network.unknowns += 1;
        }
        Planner { network, order: &order }.plan()
    }
}

struct Planner<'a> {
    network: &'a Network,
    order: &'a Order,
}

impl Planner<'_> {
    fn plan(&self) -> Plan {
        let all: Vec<usize> = (0..self.network.unknowns).collect();
        let affected = self.affected(&all);
        let on_the_way = self.on_the_way(&affected);
        let base = self.steps(
            |sink| !self.is_cut(sink) || affected.sinks[sink],
            |signal| !affected.signals[signal] || on_the_way.signals[signal],
        );
        let probes: Vec<Probe> =
            self.blocks().into_iter().map(|unknowns| self.probe(unknowns, &on_the_way)).collect();
        let mut last = self
            .steps(|sink| affected.sinks[sink], |signal| affected.signals[signal] && self.is_used(signal));
        last.extend(self.rest(&base, &last, &affected));
        Plan { base, probes, last, cuts: self.order.cuts.clone() }
    }

    fn is_cut(&self, sink: usize) -> bool {
        self.order.cuts.contains(&sink)
    }

    /// Whether a signal goes to an input, or is compared with a cut one.
    fn is_used(&self, signal: usize) -> bool {
        self.network.sinks.iter().any(|s| s.source.is_some_and(|s| s.signal == signal))
    }

    /// Unknowns that are probed with the same steps: those of a joint, and each set of cuts.
    fn blocks(&self) -> Vec<Vec<usize>> {
        let mut blocks = Vec::new();
        let mut next = 0;
        for joint in &self.network.joints {
            blocks.push((next..next + joint.axes.len()).collect());
            next += joint.axes.len();
        }
        if next < self.network.unknowns {
            blocks.push((next..self.network.unknowns).collect());
        }
        blocks
    }

    /// What depends on some unknowns.
    fn affected(&self, unknowns: &[usize]) -> Marks {
        let Self { network, order } = self;
        let starts = |sink: &super::Sink| sink.unknown.is_some_and(|(u, _)| unknowns.contains(&u));
        let mut marks = Marks {
            signals: vec![false; network.signals.len()],
            sinks: network.sinks.iter().map(starts).collect(),
        };
        let fed = self.fed();
        for group in &order.groups {
            for &signal in &group.signals {
                if order.inputs_of[signal].iter().any(|&sink| marks.sinks[sink]) {
                    marks.signals[signal] = true;
                    for &sink in &fed[signal] {
                        marks.sinks[sink] = true;
                    }
                }
            }
        }
        marks
    }

    /// Inputs that each signal feeds; cut ones do not count.
    fn fed(&self) -> Vec<Vec<usize>> {
        let mut fed = vec![Vec::new(); self.network.signals.len()];
        for (i, sink) in self.network.sinks.iter().enumerate() {
            if let (Some(source), false) = (sink.source, self.is_cut(i)) {
                fed[source.signal].push(i);
            }
        }
        fed
    }

    /// Signals of the residuals by unknown.
    fn targets(&self) -> Vec<Vec<usize>> {
        let axes = self.network.joints.iter().flat_map(|j| &j.axes).map(|axis| axis.a.to_vec());
        let cuts = self.order.cuts.iter().filter_map(|&sink| self.network.sinks[sink].source);
        axes.chain(cuts.map(|source| vec![source.signal])).collect()
    }

    /// What lies between the affected inputs and the residuals.
    fn on_the_way(&self, affected: &Marks) -> Marks {
        let Self { network, order } = self;
        let mut marks =
            Marks { signals: vec![false; network.signals.len()], sinks: vec![false; network.sinks.len()] };
        for target in self.targets().into_iter().flatten() {
            marks.signals[target] = affected.signals[target];
        }
        let fed = self.fed();
        for group in order.groups.iter().rev() {
            for &signal in &group.signals {
                if affected.signals[signal] && fed[signal].iter().any(|&sink| marks.sinks[sink]) {
                    marks.signals[signal] = true;
                }
                if marks.signals[signal] {
                    for &sink in &order.inputs_of[signal] {
                        marks.sinks[sink] |= affected.sinks[sink];
                    }
                }
            }
        }
        marks
    }

    /// Steps over all groups: each input at the first step of its component after its source.
    fn steps(&self, sink_wanted: impl Fn(usize) -> bool, signal_wanted: impl Fn(usize) -> bool) -> Vec<Step> {
        let Self { network, order } = self;
        let mut known = vec![false; network.signals.len()];
        let mut listed = vec![false; network.sinks.len()];
        let mut of_node = vec![Vec::new(); network.nodes.len()];
        for (i, sink) in network.sinks.iter().enumerate() {
            of_node[sink.node].push(i);
        }
        let mut steps = Vec::new();
        for group in &order.groups {
            let signals: Vec<usize> = group.signals.iter().copied().filter(|&s| signal_wanted(s)).collect();
            if !signals.is_empty() {
                let ready = |sink: usize| {
                    self.is_cut(sink) || network.sinks[sink].source.is_none_or(|s| known[s.signal])
                };
                let sinks: Vec<usize> = of_node[group.node]
                    .iter()
                    .copied()
                    .filter(|&sink| !listed[sink] && sink_wanted(sink) && ready(sink))
                    .collect();
                for &sink in &sinks {
                    listed[sink] = true;
                }
                steps.push(Step { node: group.node, sinks, signals });
            }
            for &signal in &group.signals {
                known[signal] = true;
            }
        }
        steps
    }

    fn probe(&self, unknowns: Vec<usize>, way_of_all: &Marks) -> Probe {
        let affected = self.affected(&unknowns);
        let way = self.on_the_way(&affected);
        // also inputs that another probe has moved: they go back to their values
        let steps = self.steps(|sink| way_of_all.sinks[sink], |signal| way.signals[signal]);
        let rows = self
            .targets()
            .iter()
            .enumerate()
            .filter(|(row, targets)| targets.iter().any(|&t| affected.signals[t]) || unknowns.contains(row))
            .map(|(row, _)| row)
            .collect();
        Probe { unknowns, steps, rows }
    }

    /// Inputs on which no signal depends, and those that depend on unknowns and were not set with their solution.
    fn rest(&self, base: &[Step], last: &[Step], affected: &Marks) -> Vec<Step> {
        let listed = |steps: &[Step]| {
            let mut listed = vec![false; self.network.sinks.len()];
            for &sink in steps.iter().flat_map(|s| &s.sinks) {
                listed[sink] = true;
            }
            listed
        };
        let (in_base, in_last) = (listed(base), listed(last));
        let mut rest: Vec<Step> =
            (0..self.network.nodes.len()).map(|node| Step { node, ..Step::default() }).collect();
        for (i, sink) in self.network.sinks.iter().enumerate() {
            let done = if affected.sinks[i] { in_last[i] } else { in_base[i] };
            if !done {
                rest[sink.node].sinks.push(i);
            }
        }
        rest.retain(|step| !step.sinks.is_empty());
        rest
    }
}
