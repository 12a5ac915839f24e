//! `terminalsAndIcons.xml`: the place of the icon, and the ports of the variable table, so that a host can connect one
//! at once.
//!
//! | port | has | terminal kind |
//! | --- | --- | --- |
//! | leader | inputs `P.F`, `P.M`; outputs `P.r`, `P.v`, `P.a` | `org.koppel.port.leader`, further slots inside it |
//! | follower | inputs `P.r`, `P.v`, `P.a`; outputs `P.F`, `P.F0`, `P.M` | `org.koppel.port.follower` |
//! | force | inputs `P.r`, `P.v`, no `P.a`: a follower without inertia | `org.koppel.port.force` |
//!
//! A follower whose force is not affine in the acceleration has `.not_affine` after its kind, a leader that is known at
//! samples only `.sampled` (fields marked so in the variable table): such a leader takes no inertia.
//!
//! Members with the same name belong together. That is the inertial connection: the follower's `P.F0` meets the
//! leader's `P.F` as member `F`, `M` meets `M`; the follower's true force is the member `force`, which no leader has.
//! Hence the matching rule `bus`.

use std::collections::BTreeSet;
use std::io;

use model::{Causality, PortLaw};
use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesText, Event};

use crate::table::Variable;

/// Kind of a port.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Port {
    Leader,
    Follower,
    Force,
}

impl Port {
    const fn kind(self) -> &'static str {
        match self {
            Self::Leader => "org.koppel.port.leader",
            Self::Follower => "org.koppel.port.follower",
            Self::Force => "org.koppel.port.force",
        }
    }

    pub(crate) const fn description(self) -> &'static str {
        match self {
            Self::Leader => "Gives motion, takes force and inertia",
            Self::Follower => "Takes motion, gives force and inertia",
            Self::Force => "Takes position and velocity, gives a force without inertia",
        }
    }

    /// Member of a leader or follower to which a quantity belongs.
    fn member(self, quantity: &str) -> &str {
        match (self, quantity) {
            (Self::Leader, other) => other,
            (_, "F0") => "F",
            (_, "F") => "force",
            (_, other) => other,
        }
    }
}

/// What comes after the kind of the port `name`.
fn mark(variables: &[Variable], name: &str) -> &'static str {
    let of_port = |v: &&Variable| parts(&v.name).is_some_and(|(p, ..)| p == name);
    let laws = variables.iter().filter(of_port).map(|v| v.entry.port);
    match laws.into_iter().find(|law| *law != PortLaw::Regular) {
        Some(PortLaw::NotAffine) => ".not_affine",
        Some(PortLaw::Sampled) => ".sampled",
        Some(PortLaw::Regular) | None => "",
    }
}

/// Quantities of a port; `s` is the position of a scalar one.
const QUANTITIES: [&str; 7] = ["r", "s", "v", "a", "F", "F0", "M"];

/// Port, quantity and component of `P.F0.x`, and of `upper.P.F0.x` in an assembly; none for other variables.
///
/// The name of a port begins with a capital letter.
#[must_use]
pub fn parts(name: &str) -> Option<(&str, &str, &str)> {
    let mut found = None;
    for quantity in QUANTITIES {
        for (at, dotted) in name.match_indices('.') {
            let rest = name[at..].strip_prefix(dotted)?;
            if let Some(component) = rest.strip_prefix(quantity)
                && (component.is_empty() || component.starts_with('.'))
            {
                found = Some((&name[..at], quantity, component));
            }
        }
    }
    found.filter(|(port, ..)| {
        let own = port.find(".slot[").map_or(*port, |at| &port[..at]);
        own.rsplit('.').next().is_some_and(|name| name.starts_with(|c: char| c.is_ascii_uppercase()))
    })
}

/// What the port `name` is, if it is one.
fn port(variables: &[Variable], name: &str) -> Option<Port> {
    let has = |quantity: &str, causality: Causality| {
        variables.iter().any(|v| {
            v.entry.causality == causality
                && parts(&v.name).is_some_and(|(p, q, _)| p == name && q == quantity)
        })
    };
    let position = |causality| has("r", causality) || has("s", causality);
    match (position(Causality::Input), position(Causality::Output)) {
        (true, _) if has("a", Causality::Input) => Some(Port::Follower),
        (true, _) if has("F", Causality::Output) => Some(Port::Force),
        (_, true) if has("F", Causality::Input) => Some(Port::Leader),
        _ => None,
    }
}

type Xml = Writer<Vec<u8>>;

/// The members of one terminal.
fn members(xml: &mut Xml, variables: &[Variable], name: &str, port: Port) -> io::Result<()> {
    for variable in variables {
        let Some((_, quantity, component)) = parts(&variable.name).filter(|(p, ..)| *p == name) else {
            continue;
        };
        xml.create_element("TerminalMemberVariable")
            .with_attributes([
                ("variableName", variable.name.as_str()),
                ("memberName", &format!("{}{component}", port.member(quantity))),
                ("variableKind", "signal"),
            ])
            .write_empty()?;
    }
    Ok(())
}

/// Names before a port's quantities: ports and slots.
fn names(variables: &[Variable]) -> BTreeSet<&str> {
    variables.iter().filter_map(|v| parts(&v.name)).map(|(p, ..)| p).collect()
}

/// The ports by name.
pub(crate) fn ports(variables: &[Variable]) -> Vec<(&str, Port)> {
    names(variables).into_iter().filter_map(|name| Some((name, port(variables, name)?))).collect()
}

/// Place of the icon: it fills the square of the coordinate system.
fn representation(xml: &mut Xml) -> io::Result<()> {
    const CORNERS: [(&str, &str); 4] = [("x1", "-100"), ("y1", "-100"), ("x2", "100"), ("y2", "100")];
    xml.create_element("GraphicalRepresentation").write_inner_content(|xml| {
        xml.create_element("CoordinateSystem")
            .with_attributes(CORNERS)
            .with_attribute(("suggestedScalingFactorTo_mm", "0.1"))
            .write_empty()?;
        xml.create_element("Icon").with_attributes(CORNERS).write_empty()?;
        Ok(())
    })?;
    Ok(())
}

/// The file.
///
/// # Errors
/// None that are known: writing goes to memory.
pub(crate) fn terminals(variables: &[Variable]) -> io::Result<Vec<u8>> {
    let (names, ports) = (names(variables), ports(variables));
    let mut xml = Writer::new_with_indent(Vec::new(), b' ', 2);
    xml.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
    xml.create_element("fmiTerminalsAndIcons").with_attribute(("fmiVersion", "3.0")).write_inner_content(
        |xml| {
            representation(xml)?;
            if ports.is_empty() {
                return Ok(());
            }
            xml.create_element("Terminals").write_inner_content(|xml| {
                for (name, port) in &ports {
                    terminal(xml, variables, name, *port, &names)?;
                }
                Ok(())
            })?;
            Ok(())
        },
    )?;
    xml.write_event(Event::Text(BytesText::new("\n")))?;
    Ok(xml.into_inner())
}

/// One terminal with its further slots.
fn terminal(
    xml: &mut Xml,
    variables: &[Variable],
    name: &str,
    port: Port,
    names: &BTreeSet<&str>,
) -> io::Result<()> {
    let kind = format!("{}{}", port.kind(), mark(variables, name));
    let attributes = [("name", name), ("matchingRule", "bus"), ("terminalKind", &kind)];
    xml.create_element("Terminal")
        .with_attributes(attributes)
        .with_attribute(("description", port.description()))
        .write_inner_content(|xml| {
            members(xml, variables, name, port)?;
            for slot in names.iter().filter(|n| n.strip_prefix(name).is_some_and(|s| s.starts_with(".slot[")))
            {
                let own_name = &slot[name.len() + 1..];
                xml.create_element("Terminal")
                    .with_attributes([("name", own_name), ("matchingRule", "bus")])
                    .with_attribute(("terminalKind", "org.koppel.port.slot"))
                    .write_inner_content(|xml| members(xml, variables, slot, port))?;
            }
            Ok(())
        })?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use model::{Entry, Kind};

    use super::*;

    #[test]
    fn names_of_port_variables_are_taken_apart() {
        assert_eq!(parts("P.F0.x"), Some(("P", "F0", ".x")));
        assert_eq!(parts("P.slot[2].M.xx"), Some(("P.slot[2]", "M", ".xx")));
        assert_eq!(parts("H.s"), Some(("H", "s", "")));
        assert_eq!(parts("lower.P.slot[2].F.x"), Some(("lower.P.slot[2]", "F", ".x")));
        for other in ["chassis.a.x", "loop.gap", "P", "strut.force", "angle.theta", "der(P.r.x)"] {
            assert_eq!(parts(other), None, "{other}");
        }
    }

    #[test]
    fn ports_are_marked_by_their_variables() {
        let variable = |name: &str, law| {
            let mut entry = Entry::scalar("", Kind::Float64);
            entry.port = law;
            Variable { name: name.into(), entry, derivative_of: None }
        };
        let variables = [
            variable("A.a.x", PortLaw::NotAffine),
            variable("P.r.x", PortLaw::Regular),
            variable("V.s", PortLaw::Sampled),
        ];
        assert_eq!(["A", "P", "V"].map(|name| mark(&variables, name)), [".not_affine", "", ".sampled"]);
    }
}
