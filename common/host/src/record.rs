//! Recording of variables at given times.

use std::io::{self, Write};

use crate::error::RunError;
use crate::import::VariableKind;
use crate::methods::Config;
use crate::scene::{Network, Recorded};
use crate::sweep::Sweeper;

/// Distance in units of the interval at which two times are taken as equal.
const SLACK: f64 = 1e-9;

/// Reals of one component, read by one call.
struct Block {
    node: usize,
    references: Vec<u32>,
    columns: Vec<usize>,
}

/// A table of values over time.
pub struct Recorder {
    /// Names of the columns after time
    pub names: Vec<String>,
    /// Times [s]
    pub times: Vec<f64>,
    /// Values, one row per time
    pub rows: Vec<Vec<f64>>,
    blocks: Vec<Block>,
    others: Vec<(usize, Recorded)>,
    interval: Option<f64>,
    next: u64,
    gap: f64,
    enabled: bool,
}

impl Recorder {
    /// Records the scene's variables and then `further` ones.
    #[must_use]
    pub fn new(network: &Network, further: &[Recorded], interval: Option<f64>) -> Self {
        let mut blocks: Vec<Block> = Vec::new();
        let mut others = Vec::new();
        for (column, recorded) in network.recorded.iter().chain(further).enumerate() {
            if recorded.kind != VariableKind::Real {
                others.push((column, recorded.clone()));
                continue;
            }
            let place = blocks.iter().position(|b| b.node == recorded.node).unwrap_or_else(|| {
                blocks.push(Block { node: recorded.node, references: vec![], columns: vec![] });
                blocks.len() - 1
            });
            blocks[place].references.push(recorded.reference);
            blocks[place].columns.push(column);
        }
        Self {
            names: network.recorded.iter().chain(further).map(|r| r.name.clone()).collect(),
            times: Vec::new(),
            rows: Vec::new(),
            blocks,
            others,
            interval,
            next: 0,
            gap: 0.0,
            enabled: true,
        }
    }

    /// Records nothing, for timing.
    #[must_use]
    pub fn off() -> Self {
        Self {
            names: Vec::new(),
            times: Vec::new(),
            rows: Vec::new(),
            blocks: Vec::new(),
            others: Vec::new(),
            interval: None,
            next: 0,
            gap: 0.0,
            enabled: false,
        }
    }

    /// The next time to be recorded before `t`, but for rounding.
    #[must_use]
    pub fn due_before(&self, config: &Config, t: f64) -> Option<f64> {
        let interval = self.interval.filter(|_| self.enabled)?;
        let next = config.point(self.next, interval);
        (next < t - SLACK * interval).then_some(next)
    }

    /// Whether `t` is to be recorded.
    #[must_use]
    pub fn is_due(&self, config: &Config, t: f64) -> bool {
        let due = |interval: f64| config.point(self.next, interval) <= t + SLACK * interval;
        self.enabled && self.interval.is_none_or(due)
    }

    /// Keeps the first columns only.
    pub fn keep(&mut self, columns: usize) {
        self.names.truncate(columns);
        self.rows.iter_mut().for_each(|row| row.truncate(columns));
    }

    /// Largest gap of closing joints at recorded times [m].
    #[must_use]
    pub fn gap(&self) -> f64 {
        self.gap
    }

    /// Reads all variables at the present time.
    ///
    /// # Errors
    /// A read that fails.
    pub fn record(&mut self, sweeper: &mut Sweeper, t: f64) -> Result<(), RunError> {
        let mut row = vec![0.0; self.names.len()];
        let mut values = Vec::new();
        for block in &self.blocks {
            values.resize(block.references.len(), 0.0);
            sweeper.instances[block.node]
                .get(&block.references, &mut values)
                .map_err(|fault| sweeper.failed(block.node, fault))?;
            for (&column, &value) in block.columns.iter().zip(&values) {
                row[column] = value;
            }
        }
        for (column, recorded) in &self.others {
            row[*column] = sweeper.instances[recorded.node]
                .get_number(recorded.kind, recorded.reference)
                .map_err(|fault| sweeper.failed(recorded.node, fault))?;
        }
        if let Some(column) = row.iter().position(|v| !v.is_finite()) {
            return Err(RunError::NotFinite { t, signal: self.names[column].clone(), value: row[column] });
        }
        if let Some((gap, _, _)) = sweeper.gap() {
            self.gap = self.gap.max(gap);
        }
        self.times.push(t);
        self.rows.push(row);
        self.next += 1;
        Ok(())
    }

    /// Records if it is time.
    ///
    /// # Errors
    /// A read that fails.
    pub fn offer(&mut self, sweeper: &mut Sweeper, config: &Config, t: f64) -> Result<(), RunError> {
        if self.is_due(config, t) { self.record(sweeper, t) } else { Ok(()) }
    }

    /// A column by its name.
    #[must_use]
    pub fn column(&self, name: &str) -> Option<Vec<f64>> {
        let column = self.names.iter().position(|n| n == name)?;
        Some(self.rows.iter().map(|row| row[column]).collect())
    }

    /// Writes a CSV file: time, then the variables.
    ///
    /// # Errors
    /// What writing says.
    pub fn write(&self, to: impl Write) -> io::Result<()> {
        let mut csv = csv::Writer::from_writer(to);
        csv.write_record(std::iter::once("time").chain(self.names.iter().map(String::as_str)))?;
        for (t, row) in self.times.iter().zip(&self.rows) {
            csv.write_record(std::iter::once(t).chain(row).map(f64::to_string))?;
        }
        csv.flush()
    }
}
