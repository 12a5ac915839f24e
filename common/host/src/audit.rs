//! The energy audit of a scene: what is stored, lost and supplied must balance.
//!
//! ```text
//! supplied   work from outside: of components that store energy, what they are supplied with; of all, less their port work
//! balance    max |stored - stored(0) + dissipated - supplied| / largest change of any energy of any component
//! ```
//! Where both sides of a connection are in the scene their port works cancel. A source (load, guide) stores nothing: what
//! leaves it through its port has come from outside. The ports of a component that nothing is connected to are outside.

use crate::scene::{Network, Recorded};

const KINETIC: &str = "energy.kinetic";
const SUPPLIED: &str = "energy.supplied";
const PORT: &str = "energy.port";
const ENERGIES: [&str; 5] = [KINETIC, "energy.potential", "energy.dissipated", SUPPLIED, PORT];

/// Where one energy of one component counts.
struct Column {
    stored: f64,
    dissipated: f64,
    supplied: f64,
}

/// Energies of the components, recorded beside other variables.
pub struct Audit {
    columns: Vec<Column>,
}

/// Variables of all components with one of the names.
pub(crate) fn offered(network: &Network, names: &[&str]) -> Vec<Recorded> {
    let mut found = Vec::new();
    for (node, component) in network.nodes.iter().enumerate() {
        let variables = names.iter().filter_map(|name| component.fmu.description.variable(name));
        found.extend(variables.map(|variable| Recorded {
            node,
            reference: variable.reference,
            kind: variable.kind,
            name: format!("{}.{}", component.name, variable.name),
        }));
    }
    found
}

impl Audit {
    /// The audit of a scene and what it needs to be recorded, in this order.
    #[must_use]
    pub fn of(network: &Network) -> (Self, Vec<Recorded>) {
        let recorded = offered(network, &ENERGIES);
        let is = |r: &Recorded, energy: &str| r.name.ends_with(energy);
        let storing = |node: usize| recorded.iter().any(|r| r.node == node && is(r, KINETIC));
        let connected = |node: usize| {
            network.signals.iter().any(|s| s.node == node) || network.sinks.iter().any(|s| s.node == node)
        };
        let on = |condition: bool| f64::from(u8::from(condition));
        let column = |r: &Recorded| Column {
            stored: on(is(r, KINETIC) || is(r, "energy.potential")),
            dissipated: on(is(r, "energy.dissipated")),
            supplied: on(is(r, SUPPLIED) && storing(r.node)) - on(is(r, PORT) && connected(r.node)),
        };
        (Self { columns: recorded.iter().map(column).collect() }, recorded)
    }

    /// The balance over all rows; `first` is the column of the first energy. None without any energy.
    #[must_use]
    pub fn balance(&self, rows: &[Vec<f64>], first: usize) -> Option<f64> {
        let start = rows.first().filter(|_| !self.columns.is_empty())?;
        let sum = |row: &[f64], part: fn(&Column) -> f64| -> f64 {
            self.columns.iter().zip(&row[first..]).map(|(column, value)| part(column) * value).sum()
        };
        let stored = sum(start, |c| c.stored);
        let (mut largest, mut wrong) = (0.0_f64, 0.0_f64);
        for row in rows {
            let change = sum(row, |c| c.stored) - stored;
            let (dissipated, supplied) = (sum(row, |c| c.dissipated), sum(row, |c| c.supplied));
            let changes = row[first..].iter().zip(&start[first..]).take(self.columns.len());
            largest = changes.map(|(value, start)| (value - start).abs()).fold(largest, f64::max);
            wrong = wrong.max((change + dissipated - supplied).abs());
        }
        Some(if largest > 0.0 { wrong / largest } else { 0.0 })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;

    /// A body that is pushed: of 4 J through its port, 3 J are stored and half a joule is lost.
    #[test]
    fn what_is_missing_shows() {
        let column = |stored, dissipated, supplied| Column { stored, dissipated, supplied };
        let body = column(1.0, 0.0, 0.0);
        let columns = vec![body, column(0.0, 1.0, 0.0), column(0.0, 0.0, -1.0)];
        let audit = Audit { columns };
        let rows = [vec![9.0, 1.0, 0.0, 0.0], vec![9.0, 4.0, 0.5, -4.0]];
        assert!((audit.balance(&rows, 1).unwrap() - 0.5 / 4.0).abs() < 1e-15);
        assert_eq!(Audit { columns: vec![] }.balance(&rows, 1), None);
    }
}
