//! Reference files by column name.

use std::path::Path;

/// A reference file.
pub(crate) struct Reference {
    columns: Vec<String>,
    pub(crate) rows: Vec<Vec<f64>>,
}

impl Reference {
    /// A file of `tests/reference/effi`.
    pub(crate) fn read(name: &str) -> Self {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/reference/effi");
        let path = root.join(format!("{name}.csv"));
        let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let mut lines = text.lines().filter(|l| !l.starts_with('#'));
        let columns = lines.next().expect("header").split(',').map(String::from).collect();
        let rows = lines.map(|l| l.split(',').map(|v| v.parse().expect("number")).collect()).collect();
        Self { columns, rows }
    }

    fn position(&self, name: &str) -> usize {
        self.columns.iter().position(|c| c == name).unwrap_or_else(|| panic!("no column {name}"))
    }

    /// One value of a row.
    pub(crate) fn at(&self, row: &[f64], name: &str) -> f64 {
        row[self.position(name)]
    }

    /// Several values of a row.
    pub(crate) fn all<const N: usize>(&self, row: &[f64], names: [&str; N]) -> [f64; N] {
        names.map(|name| self.at(row, name))
    }

    /// Largest magnitude in a column.
    pub(crate) fn peak(&self, name: &str) -> f64 {
        let i = self.position(name);
        self.rows.iter().fold(0.0, |m, row| row[i].abs().max(m))
    }
}

/// Fails where two numbers differ by more than the part `tolerance` of `scale`.
#[track_caller]
pub(crate) fn close(what: &str, value: f64, expected: f64, scale: f64, tolerance: f64) {
    let error = (value - expected).abs() / scale;
    assert!(error <= tolerance, "{what}: {value} instead of {expected}, off by {error:.3e} of {scale:.3e}");
}
