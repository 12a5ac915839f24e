//! The model description (FMI 3.0) from the variable table.

use std::collections::BTreeSet;
use std::io;
use std::ops::Range;

use model::{Causality, EnumType, Initial, Kind, Model, Variability};
use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesText, Event};

use crate::c_abi::LOG_CATEGORIES;
use crate::table::{Layout, Part, Table, Variable, kind_name};
use crate::unit::BaseUnit;

type Xml = Writer<Vec<u8>>;

/// A number as XML writes it: shortest text that gives the same bits.
fn number(value: f64) -> String {
    let text = format!("{value:?}");
    text.strip_suffix(".0").map_or(text.clone(), String::from)
}

/// The model description of `M` for FMI 3.0.
///
/// # Errors
/// A unit that is not known; otherwise none (writing goes to memory).
pub fn model_description<M: Model>() -> io::Result<Vec<u8>> {
    let table = Table::new::<M>();
    let mut xml = Writer::new_with_indent(Vec::new(), b' ', 2);
    xml.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
    xml.create_element("fmiModelDescription")
        .with_attributes([
            ("fmiVersion", "3.0"),
            ("modelName", M::NAME),
            ("instantiationToken", &table.token(M::NAME)),
            ("description", M::DESCRIPTION),
            ("version", env!("CARGO_PKG_VERSION")),
            ("license", "MIT OR Apache-2.0"),
            ("generationTool", concat!("koppel ", env!("CARGO_PKG_VERSION"))),
            ("variableNamingConvention", "structured"),
        ])
        .write_inner_content(|xml| {
            let common = [
                ("modelIdentifier", M::NAME),
                ("canGetAndSetFMUState", "true"),
                ("providesDirectionalDerivatives", "true"),
            ];
            if M::MODEL_EXCHANGE {
                xml.create_element("ModelExchange")
                    .with_attributes(common)
                    .with_attribute(("needsCompletedIntegratorStep", "true"))
                    .write_empty()?;
            }
            xml.create_element("CoSimulation")
                .with_attributes(common)
                .with_attributes([
                    ("canHandleVariableCommunicationStepSize", "true"),
                    ("hasEventMode", "true"),
                ])
                .write_empty()?;
            units(xml, &table)?;
            types(xml, &table)?;
            xml.create_element("LogCategories").write_inner_content(|xml| {
                for (name, description) in LOG_CATEGORIES {
                    let name = name.to_string_lossy();
                    xml.create_element("Category")
                        .with_attributes([("name", &*name), ("description", description)])
                        .write_empty()?;
                }
                Ok(())
            })?;
            let experiment = M::EXPERIMENT;
            xml.create_element("DefaultExperiment")
                .with_attributes([
                    ("startTime", "0"),
                    ("stopTime", &number(experiment.stop)),
                    ("stepSize", &number(experiment.step)),
                ])
                .write_empty()?;
            xml.create_element("ModelVariables").write_inner_content(|xml| {
                table
                    .variables
                    .iter()
                    .enumerate()
                    .try_for_each(|(reference, v)| variable(xml, reference, v, table.is_state(reference)))
            })?;
            let indicators = Layout::<M>::part(Part::Indicators);
            xml.create_element("ModelStructure")
                .write_inner_content(|xml| structure(xml, &table, indicators))?;
            Ok(())
        })?;
    xml.write_event(Event::Text(BytesText::new("\n")))?;
    Ok(xml.into_inner())
}

/// Dimensionless numbers have the unit 1.
fn unit_name(unit: &'static str) -> &'static str {
    if unit.is_empty() { "1" } else { unit }
}

fn units(xml: &mut Xml, table: &Table) -> io::Result<()> {
    let names: BTreeSet<_> = table
        .variables
        .iter()
        .filter(|v| v.entry.kind == Kind::Float64)
        .map(|v| unit_name(v.entry.unit))
        .collect();
    xml.create_element("UnitDefinitions").write_inner_content(|xml| {
        for name in names {
            let unit =
                BaseUnit::parse(name).ok_or_else(|| io::Error::other(format!("unit {name} is not known")))?;
            xml.create_element("Unit").with_attribute(("name", name)).write_inner_content(|xml| {
                let attributes: Vec<_> = unit.attributes().collect();
                let attributes = attributes.iter().map(|(name, exponent)| (*name, exponent.as_str()));
                xml.create_element("BaseUnit").with_attributes(attributes).write_empty()?;
                Ok(())
            })?;
        }
        Ok(())
    })?;
    Ok(())
}

fn types(xml: &mut Xml, table: &Table) -> io::Result<()> {
    let mut types: Vec<&'static EnumType> = Vec::new();
    for v in &table.variables {
        if let Kind::Enumeration(t) = v.entry.kind
            && !types.iter().any(|known| known.name == t.name)
        {
            types.push(t);
        }
    }
    xml.create_element("TypeDefinitions").write_inner_content(|xml| {
        for t in types {
            xml.create_element("EnumerationType")
                .with_attributes([("name", t.name), ("description", t.description)])
                .write_inner_content(|xml| {
                    for item in t.items {
                        xml.create_element("Item")
                            .with_attributes([
                                ("name", item.name),
                                ("value", &item.value.to_string()),
                                ("description", item.description),
                            ])
                            .write_empty()?;
                    }
                    Ok(())
                })?;
        }
        Ok(())
    })?;
    Ok(())
}

fn variable(xml: &mut Xml, reference: usize, variable: &Variable, is_state: bool) -> io::Result<()> {
    let Variable { name, entry, derivative_of } = variable;
    let reference = reference.to_string();
    let causality = match entry.causality {
        Causality::Parameter => "parameter",
        Causality::Input => "input",
        Causality::Output => "output",
        Causality::Local => "local",
        Causality::Inherit => "independent",
    };
    let variability = match entry.variability {
        Variability::Fixed => "fixed",
        Variability::Tunable => "tunable",
        Variability::Discrete => "discrete",
        Variability::Continuous => "continuous",
    };
    let mut attributes = vec![
        ("name", name.clone()),
        ("valueReference", reference),
        ("description", entry.description.to_string()),
        ("causality", causality.to_string()),
        ("variability", variability.to_string()),
    ];
    match entry.initial {
        Initial::Exact => attributes.push(("initial", "exact".into())),
        Initial::Approx => attributes.push(("initial", "approx".into())),
        Initial::Calculated => {}
    }
    match entry.kind {
        Kind::Enumeration(t) => attributes.push(("declaredType", t.name.into())),
        Kind::Float64 => attributes.push(("unit", unit_name(entry.unit).into())),
        _ => {}
    }
    for (name, value) in [("min", entry.min), ("max", entry.max)] {
        if value.is_finite() {
            attributes.push((name, number(value)));
        }
    }
    if (entry.nominal - 1.0).abs() > 0.0 {
        attributes.push(("nominal", number(entry.nominal)));
    }
    if entry.has_start() {
        let start = match entry.kind {
            Kind::Boolean => (entry.start > 0.5).to_string(),
            _ => number(entry.start),
        };
        attributes.push(("start", start));
    }
    if let Some(state) = derivative_of {
        attributes.push(("derivative", state.to_string()));
    }
    if is_state {
        attributes.push(("reinit", "true".into())); // events may move any state
    }
    let attributes = attributes.iter().map(|(name, value)| (*name, value.as_str()));
    xml.create_element(kind_name(entry.kind)).with_attributes(attributes).write_empty()?;
    Ok(())
}

/// Outputs and derivatives with their exact direct dependencies; what is computed at the start as
/// initial unknowns; event indicators.
fn structure(xml: &mut Xml, table: &Table, indicators: Range<usize>) -> io::Result<()> {
    let all = || 0..table.variables.len();
    let of = |i: usize| &table.variables[i];
    let outputs: Vec<_> = all().filter(|i| of(*i).entry.causality == Causality::Output).collect();
    let derivatives: Vec<_> = all().filter(|i| of(*i).derivative_of.is_some()).collect();
    for (element, unknowns) in [("Output", &outputs), ("ContinuousStateDerivative", &derivatives)] {
        for unknown in unknowns {
            let knowns: Vec<_> = table.dependencies(*unknown).iter().map(ToString::to_string).collect();
            xml.create_element(element)
                .with_attributes([
                    ("valueReference", unknown.to_string().as_str()),
                    ("dependencies", &knowns.join(" ")),
                ])
                .write_empty()?;
        }
    }
    let mut initial: Vec<_> = [outputs, table.states.clone(), derivatives].concat();
    initial.retain(|i| of(*i).entry.initial != Initial::Exact);
    initial.sort_unstable();
    initial.dedup();
    for (element, unknowns) in [("InitialUnknown", initial), ("EventIndicator", indicators.collect())] {
        for unknown in unknowns {
            xml.create_element(element)
                .with_attribute(("valueReference", unknown.to_string().as_str()))
                .write_empty()?;
        }
    }
    Ok(())
}
