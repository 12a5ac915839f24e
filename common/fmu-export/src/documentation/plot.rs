//! Diagrams of the reference run as inline SVG. Only sums, products and comparisons: the same text everywhere.

use std::fmt::Write as _;

use model::Plot;

use super::samples::Samples;
use super::{DocumentationError, add, text};
use crate::describe::unit_name;
use crate::table::Table;

/// Frame of the diagram inside the picture [px]
const LEFT: f64 = 70.0;
const RIGHT: f64 = 790.0;
const TOP: f64 = 30.0;
const BOTTOM: f64 = 230.0;

/// An axis: its ends, and the distance of its ticks.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Axis {
    low: f64,
    high: f64,
    tick: f64,
    /// Power of ten taken out of the labels
    exponent: i32,
    /// Digits after the point in the labels
    digits: usize,
}

impl Axis {
    /// An axis with round ticks over all values.
    fn over(values: impl Iterator<Item = f64> + Clone) -> Self {
        let mut low = values.clone().fold(f64::INFINITY, f64::min);
        let mut high = values.fold(f64::NEG_INFINITY, f64::max);
        if high - low <= 1e-9 * high.abs().max(low.abs()) {
            let room = if high.abs() > 0.0 { 0.5 * high.abs() } else { 1.0 };
            (low, high) = (low - room, high + room);
        }
        // the tick: 1, 2 or 5 times 10^power, four to nine of them
        let (mut tick, mut power) = (1.0, 0);
        while tick * 10.0 <= high - low {
            (tick, power) = (tick * 10.0, power + 1);
        }
        while tick > high - low {
            (tick, power) = (tick / 10.0, power - 1);
        }
        let count = (high - low) / tick; // 1 to 10
        let (factor, power) = match count {
            c if c < 2.0 => (2.0, power - 1),
            c if c < 4.0 => (5.0, power - 1),
            _ => (1.0, power),
        };
        tick = if factor > 1.0 { tick / 10.0 * factor } else { tick };
        let exponent = if (-2..4).contains(&power) { 0 } else { power };
        let digits = usize::try_from((exponent - power).max(0)).unwrap_or(0);
        Self { low: (low / tick).floor() * tick, high: (high / tick).ceil() * tick, tick, exponent, digits }
    }

    /// Place of a value between two pixels.
    fn place(&self, value: f64, from: f64, to: f64) -> f64 {
        from + (value - self.low) / (self.high - self.low) * (to - from)
    }

    /// Value and label of each tick.
    fn ticks(&self) -> Vec<(f64, String)> {
        let mut scale = 1.0;
        for _ in 0..self.exponent.unsigned_abs() {
            scale *= 10.0;
        }
        let label = |value: f64| {
            let shown = if self.exponent < 0 { value * scale } else { value / scale };
            let written = format!("{shown:.*}", self.digits);
            written
                .strip_prefix('-')
                .filter(|w| w.chars().all(|c| matches!(c, '0' | '.')))
                .map_or(written.clone(), Into::into)
        };
        let (mut found, mut i) = (Vec::new(), 0);
        loop {
            let value = self.low + f64::from(i) * self.tick;
            if value > self.high + 0.5 * self.tick {
                return found;
            }
            found.push((value, label(value)));
            i += 1;
        }
    }
}

/// One diagram with its caption.
pub(super) fn figure(
    page: &mut String,
    plot: &Plot,
    table: &Table,
    samples: &Samples<'_>,
) -> Result<(), DocumentationError> {
    let Plot { title, signals } = *plot;
    let unit_of =
        |name: &str| table.variables().iter().find(|v| v.name == name).map(|v| unit_name(v.entry.unit));
    let unit = signals.first().and_then(|s| unit_of(s)).unwrap_or("1");
    let mut columns = Vec::new();
    for signal in signals {
        if unit_of(signal) != Some(unit) {
            return Err(DocumentationError::Unit { title, signal, unit });
        }
        columns.push(samples.column(signal).ok_or(DocumentationError::NoColumn { title, signal })?);
    }
    let time = samples.time();
    let x = Axis { low: time[0], high: time[time.len() - 1], ..Axis::over(time.iter().copied()) };
    let y = Axis::over(columns.iter().flatten().copied());

    add!(page, "<figure>\n<svg viewBox=\"0 0 800 270\" role=\"img\">\n<title>{}</title>\n", text(title));
    frame(page, &x, &y, unit);
    for (i, (signal, column)) in signals.iter().zip(&columns).enumerate() {
        let class = i % 4;
        add!(page, "<polyline class=\"s{class}\" points=\"");
        for (t, value) in time.iter().zip(column) {
            add!(page, "{:.1},{:.1} ", x.place(*t, LEFT, RIGHT), y.place(*value, BOTTOM, TOP));
        }
        let at = LEFT + 130.0 + 170.0 * f64::from(u8::try_from(i).unwrap_or(0));
        add!(page, "\"/>\n<path class=\"s{class}\" d=\"M{at:.0} 16h18\"/>");
        add!(page, "<text x=\"{:.0}\" y=\"20\">{}</text>\n", at + 23.0, text(signal));
    }
    add!(page, "</svg>\n<figcaption>{}</figcaption>\n</figure>\n", text(title));
    Ok(())
}

/// Axes with ticks, labels and units.
fn frame(page: &mut String, x: &Axis, y: &Axis, unit: &str) {
    for (value, label) in y.ticks() {
        let at = y.place(value, BOTTOM, TOP);
        add!(page, "<path class=\"axis\" d=\"M{LEFT:.0} {at:.1}H{RIGHT:.0}\"/>");
        add!(
            page,
            "<text x=\"{:.0}\" y=\"{:.1}\" text-anchor=\"end\">{label}</text>\n",
            LEFT - 6.0,
            at + 4.0
        );
    }
    for (value, label) in x.ticks().into_iter().filter(|(value, _)| *value <= x.high + 1e-9 * x.tick) {
        let at = x.place(value, LEFT, RIGHT);
        add!(page, "<path class=\"axis\" d=\"M{at:.1} {BOTTOM:.0}v5\"/>");
        add!(page, "<text x=\"{at:.1}\" y=\"{:.0}\" text-anchor=\"middle\">{label}</text>\n", BOTTOM + 18.0);
    }
    let unit = text(unit);
    let power = if y.exponent == 0 { String::new() } else { format!("10^{} ", y.exponent) };
    add!(page, "<text x=\"8\" y=\"20\">in {power}{unit}</text>\n");
    add!(page, "<text x=\"{RIGHT:.0}\" y=\"{:.0}\" text-anchor=\"end\">t in s</text>\n", BOTTOM + 36.0);
}

#[cfg(test)]
mod tests {
    use model::{Entry, Kind};

    use super::*;
    use crate::table::Variable;

    #[test]
    fn ticks_are_round_and_cover_the_values() {
        for (low, high, labels) in [
            (0.0, 10.0, vec!["0", "2", "4", "6", "8", "10"]),
            (-0.012, 0.031, vec!["-0.02", "-0.01", "0.00", "0.01", "0.02", "0.03", "0.04"]),
            (0.0, 3.2e6, vec!["0", "5", "10", "15", "20", "25", "30", "35"]),
            (0.0, 0.0, vec!["-1.0", "-0.5", "0.0", "0.5", "1.0"]),
        ] {
            let axis = Axis::over([low, high].into_iter());
            let found: Vec<_> = axis.ticks().into_iter().map(|(_, label)| label).collect();
            assert_eq!(found, labels, "{low} .. {high}");
            assert!(axis.low <= low && high <= axis.high);
        }
    }

    #[test]
    fn a_diagram_of_what_is_not_there_or_of_two_units_is_refused() {
        let variable = |name: &str, unit| {
            let mut entry = Entry::scalar("", Kind::Float64);
            entry.unit = unit;
            Variable { name: name.into(), entry, derivative_of: None }
        };
        let variables = vec![variable("F", "N"), variable("G", "N"), variable("s", "m")];
        let table = Table { variables, states: Vec::new(), access: Vec::new(), affects: Vec::new(), hash: 0 };
        let samples = Samples::parse("time,F,s\n0,1,2\n1,3,4\n").expect("a table");
        let draw = |signals| figure(&mut String::new(), &Plot { title: "T", signals }, &table, &samples);
        assert_eq!(draw(&["F"]), Ok(()));
        assert_eq!(draw(&["F", "G"]), Err(DocumentationError::NoColumn { title: "T", signal: "G" }));
        assert_eq!(draw(&["F", "s"]), Err(DocumentationError::Unit { title: "T", signal: "s", unit: "N" }));
        assert_eq!(draw(&["x"]), Err(DocumentationError::Unit { title: "T", signal: "x", unit: "1" }));
    }
}
