//! Reference results: a table of numbers whose first column is time.

use super::DocumentationError;

/// The table.
#[derive(Debug)]
pub(super) struct Samples<'a> {
    names: Vec<&'a str>,
    rows: Vec<Vec<f64>>,
}

impl<'a> Samples<'a> {
    /// From comma-separated values.
    ///
    /// # Errors
    /// A file that is no such table.
    pub(super) fn parse(csv: &'a str) -> Result<Self, DocumentationError> {
        let wrong = |line, reason| DocumentationError::Samples { line, reason };
        let mut lines = csv.lines().zip(1..);
        let (header, _) = lines.next().ok_or(wrong(1, "the file is empty"))?;
        let names: Vec<_> = header.split(',').collect();
        if names[0] != "time" {
            return Err(wrong(1, "the first column is not time"));
        }
        let row = |(line, number): (&str, usize)| {
            let values: Result<Vec<f64>, _> = line.split(',').map(str::parse).collect();
            let values = values.map_err(|_| wrong(number, "not a number"))?;
            if values.len() != names.len() || !values.iter().all(|v| v.is_finite()) {
                return Err(wrong(number, "too few, too many or infinite values"));
            }
            Ok(values)
        };
        let rows: Vec<_> = lines.map(row).collect::<Result<_, _>>()?;
        if rows.len() < 2 || !rows.windows(2).all(|pair| pair[0][0] < pair[1][0]) {
            return Err(wrong(2, "time does not ascend from the first row to the last"));
        }
        Ok(Self { names, rows })
    }

    /// A column.
    pub(super) fn column(&self, name: &str) -> Option<Vec<f64>> {
        let i = self.names.iter().position(|n| *n == name)?;
        Some(self.rows.iter().map(|row| row[i]).collect())
    }

    /// The times.
    pub(super) fn time(&self) -> Vec<f64> {
        self.rows.iter().map(|row| row[0]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_found_by_name() {
        let samples = Samples::parse("time,a,b\n0,1,2\n0.5,3,-4e-3\n").expect("a table");
        assert_eq!(samples.time(), [0.0, 0.5]);
        assert_eq!(samples.column("b"), Some(vec![2.0, -4e-3]));
        assert_eq!(samples.column("c"), None);
    }

    #[test]
    fn files_that_are_no_table_are_refused_with_their_line() {
        for (csv, line) in [
            ("", 1),
            ("t,a\n0,1\n1,1\n", 1),
            ("time,a\n0,1\n", 2),
            ("time,a\n0,1\n0,1\n", 2),
            ("time,a\n0,1\n1,x\n", 3),
            ("time,a\n0,1\n1,1,1\n", 3),
            ("time,a\n0,1\n1,inf\n", 3),
        ] {
            let Err(DocumentationError::Samples { line: found, .. }) = Samples::parse(csv) else {
                panic!("{csv:?} was taken")
            };
            assert_eq!(found, line, "{csv:?}");
        }
    }
}
