//! Tables of variables: one row for the components of a vector.

use std::fmt::Write as _;

use model::{Causality, Kind, Variability};

use super::{add, text};
use crate::describe::{number, unit_name};
use crate::table::{Table, Variable, allowed};

/// Name without its last part, `P.r` of `P.r.x`.
fn stem(name: &str) -> &str {
    name.rsplit_once('.').map_or(name, |(stem, _)| stem)
}

/// True if two neighbours of the list are components of one quantity.
fn same(a: &Variable, b: &Variable) -> bool {
    let is_part = a.name.contains('.') && stem(&a.name) == stem(&b.name);
    let (p, q) = (&a.entry, &b.entry);
    let ranges = [(p.min, q.min), (p.max, q.max)].iter().all(|(x, y)| x.to_bits() == y.to_bits());
    is_part
        && ranges
        && (p.description, p.unit, p.kind) == (q.description, q.unit, q.kind)
        && p.variability == q.variability
}

/// A value as a reader writes it.
fn value(Variable { entry, .. }: &Variable) -> String {
    match entry.kind {
        Kind::Boolean => (entry.start > 0.5).to_string(),
        Kind::Enumeration(t) => {
            let item = t.items.iter().find(|i| number(entry.start) == i.value.to_string());
            item.map_or_else(|| number(entry.start), |i| i.name.into())
        }
        _ => number(entry.start),
    }
}

/// The values that a variable may have.
fn range(Variable { entry, .. }: &Variable) -> String {
    match entry.kind {
        Kind::Boolean => "true, false".into(),
        Kind::Enumeration(t) => {
            let item =
                |i: &model::Item| format!("<code>{}</code> ({}): {}", i.name, i.value, text(i.description));
            t.items.iter().map(item).collect::<Vec<_>>().join("<br />")
        }
        _ => text(allowed(entry).trim()),
    }
}

/// What is said about variables of this causality, besides name, meaning and unit.
const fn columns(causality: Causality) -> &'static [&'static str] {
    match causality {
        Causality::Parameter => &["Default", "Allowed", "Tunable"],
        Causality::Input => &["Start", "Allowed"],
        _ => &["Kind"],
    }
}

/// The same for one row.
fn details(row: &[&Variable]) -> Vec<String> {
    let entry = &row[0].entry;
    let starts = || row.iter().map(|v| value(v)).collect::<Vec<_>>().join(", ");
    match entry.causality {
        Causality::Parameter => {
            let tunable = entry.variability == Variability::Tunable;
            vec![starts(), range(row[0]), if tunable { "yes" } else { "no" }.into()]
        }
        Causality::Input => vec![starts(), range(row[0])],
        _ if entry.rate.is_some() && entry.has_start() => vec![format!("state, start {}", starts())],
        _ if entry.rate.is_some() => vec!["state".into()],
        _ if entry.variability == Variability::Discrete => vec!["changes at events".into()],
        _ => vec![String::new()],
    }
}

/// The variables of one causality whose value references are `wanted`.
pub(super) fn table(page: &mut String, table: &Table, causality: Causality, wanted: impl Fn(usize) -> bool) {
    let shown: Vec<_> = table
        .variables()
        .iter()
        .enumerate()
        .filter(|(i, v)| v.entry.causality == causality && wanted(*i))
        .map(|(_, v)| v)
        .collect();
    if shown.is_empty() {
        page.push_str("<p>None.</p>\n");
        return;
    }
    page.push_str("<div class=\"wide\">\n<table>\n<thead><tr><th>Name</th><th>Meaning</th><th>Unit</th>");
    for title in columns(causality) {
        add!(page, "<th>{title}</th>");
    }
    page.push_str("</tr></thead>\n<tbody>\n");
    for row in shown.chunk_by(|a, b| same(a, b)) {
        let names: Vec<_> = row.iter().map(|v| format!("<code>{}</code>", v.name)).collect();
        let entry = &row[0].entry;
        let unit = if entry.kind == Kind::Float64 { unit_name(entry.unit) } else { "" };
        add!(
            page,
            "<tr><td>{}</td><td>{}</td><td>{unit}</td>",
            names.join("<br />"),
            text(entry.description)
        );
        for cell in details(row) {
            add!(page, "<td>{cell}</td>");
        }
        page.push_str("</tr>\n");
    }
    page.push_str("</tbody>\n</table>\n</div>\n");
}
