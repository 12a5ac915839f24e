//! In which order signals can be evaluated, from the dependencies that the FMUs declare.
//!
//! Signals of one component that belong together are read by one call: motion, inertia, acceleration (and what has no
//! role, by equal dependencies). Where groups depend on each other in a circle, single signals are ordered; where a circle
//! is left, inputs are cut: their values are unknowns of the affine loop. Raw forces are cut first.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap, HashMap};

use super::Network;

/// What a signal is to the sweep, in the order of its passes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) enum Role {
    /// r, v, s
    Motion,
    /// F0, M
    Inertia,
    /// a
    Acceleration,
    /// F
    Force,
    /// No port variable
    Other,
}

pub(super) fn role(name: &str) -> Role {
    name.split('.')
        .skip(1)
        .find_map(|part| match part {
            "r" | "v" | "s" => Some(Role::Motion),
            "F0" | "M" => Some(Role::Inertia),
            "a" => Some(Role::Acceleration),
            "F" => Some(Role::Force),
            _ => None,
        })
        .unwrap_or(Role::Other)
}

/// Signals of one component that are read together.
#[derive(Clone, Debug)]
pub(super) struct Group {
    pub(super) node: usize,
    pub(super) signals: Vec<usize>,
    role: Role,
}

/// The order.
pub(super) struct Order {
    /// Groups, each after all that it depends on
    pub(super) groups: Vec<Group>,
    /// Cut inputs
    pub(super) cuts: Vec<usize>,
    /// Inputs on which a signal depends
    pub(super) inputs_of: Vec<Vec<usize>>,
}

/// Inputs of its component on which each signal depends.
fn dependencies(network: &Network) -> Vec<Vec<usize>> {
    let mut sinks_of = HashMap::new();
    let mut all = vec![Vec::new(); network.nodes.len()];
    for (i, sink) in network.sinks.iter().enumerate() {
        sinks_of.insert((sink.node, sink.reference), i);
        all[sink.node].push(i);
    }
    let of = |signal: &super::Signal| match network.nodes[signal.node]
        .fmu
        .description
        .dependencies
        .get(&signal.reference)
    {
        Some(Some(references)) => {
            references.iter().filter_map(|r| sinks_of.get(&(signal.node, *r)).copied()).collect()
        }
        _ => all[signal.node].clone(),
    };
    network.signals.iter().map(of).collect()
}

impl Order {
    pub(super) fn of(network: &Network) -> Self {
        let inputs_of = dependencies(network);
        let mut cuts = Vec::new();
        loop {
            let mut left = Vec::new();
            for together in [true, false] {
                let graph = Graph::new(network, &inputs_of, &cuts, together);
                match graph.sorted() {
                    Ok(groups) => return Self { groups, cuts, inputs_of },
                    Err(circle) => left = circle,
                }
            }
            cuts.extend(next_cut(network, &inputs_of, &cuts, &left));
        }
    }
}

/// Inputs to cut: all that one component takes from another inside a circle, raw forces first.
fn next_cut(network: &Network, inputs_of: &[Vec<usize>], cuts: &[usize], left: &[usize]) -> Vec<usize> {
    let inside = |sink: usize| {
        network.sinks[sink].source.is_some_and(|s| left.contains(&s.signal)) && !cuts.contains(&sink)
    };
    let candidates: Vec<usize> = (0..network.sinks.len())
        .filter(|&sink| inside(sink) && in_circle(network, inputs_of, cuts, sink))
        .collect();
    let source = |sink: usize| network.sinks[sink].source.map_or(0, |s| s.signal);
    let first = candidates
        .iter()
        .copied()
        .min_by_key(|&sink| (role(&network.signals[source(sink)].name) != Role::Force, source(sink)));
    let Some(first) = first else {
        return candidates; // not reached: what is left lies in or behind a circle
    };
    let key = |sink: usize| {
        let signal = &network.signals[source(sink)];
        (signal.node, role(&signal.name), network.sinks[sink].node)
    };
    candidates.into_iter().filter(|&sink| key(sink) == key(first)).collect()
}

/// Whether a change of the input comes back to it.
fn in_circle(network: &Network, inputs_of: &[Vec<usize>], cuts: &[usize], sink: usize) -> bool {
    let mut changed = vec![false; network.sinks.len()];
    let mut open = vec![sink];
    while let Some(input) = open.pop() {
        let node = network.sinks[input].node;
        for (signal, inputs) in inputs_of.iter().enumerate() {
            if network.signals[signal].node != node || !inputs.contains(&input) {
                continue;
            }
            for (next, other) in network.sinks.iter().enumerate() {
                if other.source.is_some_and(|s| s.signal == signal) && !cuts.contains(&next) && !changed[next]
                {
                    if next == sink {
                        return true;
                    }
                    changed[next] = true;
                    open.push(next);
                }
            }
        }
    }
    false
}

struct Graph {
    groups: Vec<Group>,
    /// Groups that come after
    after: Vec<Vec<usize>>,
    /// Number of groups before
    before: Vec<usize>,
}

impl Graph {
    fn new(network: &Network, inputs_of: &[Vec<usize>], cuts: &[usize], together: bool) -> Self {
        let mut keyed: BTreeMap<(usize, Role, &[usize], usize), Vec<usize>> = BTreeMap::new();
        for (i, signal) in network.signals.iter().enumerate() {
            let role = role(&signal.name);
            let inputs = if role == Role::Other { &inputs_of[i][..] } else { &[] };
            let single = if together { 0 } else { i };
            keyed.entry((signal.node, role, inputs, single)).or_default().push(i);
        }
        let groups: Vec<Group> =
            keyed.into_iter().map(|((node, role, ..), signals)| Group { node, signals, role }).collect();
        let mut group_of = vec![0; network.signals.len()];
        for (g, group) in groups.iter().enumerate() {
            for &signal in &group.signals {
                group_of[signal] = g;
            }
        }
        let mut after = vec![Vec::new(); groups.len()];
        let mut before = vec![0; groups.len()];
        for (g, group) in groups.iter().enumerate() {
            let mut sources: Vec<usize> = group
                .signals
                .iter()
                .flat_map(|&signal| &inputs_of[signal])
                .filter(|sink| !cuts.contains(sink))
                .filter_map(|&sink| network.sinks[sink].source.map(|s| group_of[s.signal]))
                .collect();
            sources.sort_unstable();
            sources.dedup();
            before[g] = sources.len();
            for source in sources {
                after[source].push(g);
            }
        }
        Self { groups, after, before }
    }

    /// Kahn's algorithm, passes first, then components in their order; or the signals that are left.
    fn sorted(mut self) -> Result<Vec<Group>, Vec<usize>> {
        let key = |groups: &[Group], g: usize| Reverse((groups[g].role, groups[g].node, g));
        let mut ready: BinaryHeap<_> =
            (0..self.groups.len()).filter(|&g| self.before[g] == 0).map(|g| key(&self.groups, g)).collect();
        let mut order = Vec::new();
        while let Some(Reverse((_, _, g))) = ready.pop() {
            order.push(g);
            for &next in &self.after[g] {
                self.before[next] -= 1;
                if self.before[next] == 0 {
                    ready.push(key(&self.groups, next));
                }
            }
        }
        if order.len() == self.groups.len() {
            return Ok(order.into_iter().map(|g| self.groups[g].clone()).collect());
        }
        let left = (0..self.groups.len()).filter(|&g| self.before[g] > 0);
        Err(left.flat_map(|g| self.groups[g].signals.clone()).collect())
    }
}
