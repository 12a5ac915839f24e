//! The table of ports.

use std::fmt::Write as _;

use model::Causality;

use super::{add, text};
use crate::table::Table;
use crate::terminals::{parts, ports};

/// Quantities of a port with this causality, without components: `P.F, P.M`.
fn quantities(table: &Table, port: &str, causality: Causality) -> String {
    let mut found: Vec<String> = Vec::new();
    for variable in table.variables().iter().filter(|v| v.entry.causality == causality) {
        let Some((of, quantity, _)) = parts(&variable.name) else { continue };
        if of == port || of.strip_prefix(port).is_some_and(|rest| rest.starts_with(".slot[")) {
            let name = format!("<code>{of}.{quantity}</code>");
            if !found.contains(&name) {
                found.push(name);
            }
        }
    }
    found.join(", ")
}

/// The ports with what they take and give.
pub(super) fn section(page: &mut String, table: &Table) {
    page.push_str(concat!(
        "<p>A port is one point with motion forward and force backward. A leader gives r, v, a and is acted on by ",
        "F &#8722; M a of every slot; a follower takes r, v, a and gives F0 and M, its true force is F = F0 &#8722; M a. ",
        "Connect the follower's F0 and M to the leader's F and M. World frame, z up. ",
        "Every port is a terminal in FMI 3.0.</p>\n"
    ));
    page.push_str("<div class=\"wide\">\n<table>\n<thead><tr><th>Port</th><th>Kind</th><th>Takes</th><th>Gives</th></tr></thead>\n<tbody>\n");
    for (name, port) in ports(table.variables()) {
        let (takes, gives) =
            (quantities(table, name, Causality::Input), quantities(table, name, Causality::Output));
        let what = text(port.description());
        add!(page, "<tr><td><code>{name}</code></td><td>{what}</td><td>{takes}</td><td>{gives}</td></tr>\n");
    }
    page.push_str("</tbody>\n</table>\n</div>\n");
}
