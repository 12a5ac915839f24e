//! The model description from the variable table; what FMI 2.0 and 3.0 write in the same way.

mod fmi2;
mod fmi3;

use std::collections::BTreeSet;
use std::io;

use model::{Causality, EnumType, Initial, Kind, Model, Variability};
use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesText, Event};

use crate::c_abi::LOG_CATEGORIES;
use crate::table::{Table, Variable};
use crate::unit::BaseUnit;
use crate::{Profile, Standard};

type Xml = Writer<Vec<u8>>;
type Attributes = Vec<(&'static str, String)>;

/// The model description of `M`.
///
/// # Errors
/// A unit that is not known; otherwise none (writing goes to memory).
pub fn model_description<M: Model>(standard: Standard) -> io::Result<Vec<u8>> {
    describe(&Profile::of::<M>(), &Table::new::<M>(), standard)
}

/// The model description from a profile and the variables.
///
/// # Errors
/// As [`model_description`].
pub fn describe(profile: &Profile<'_>, table: &Table, standard: Standard) -> io::Result<Vec<u8>> {
    let mut xml = Writer::new_with_indent(Vec::new(), b' ', 2);
    xml.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
    match standard {
        Standard::Fmi2 => fmi2::document(&mut xml, profile, table)?,
        Standard::Fmi3 => fmi3::document(&mut xml, profile, table)?,
    }
    xml.write_event(Event::Text(BytesText::new("\n")))?;
    Ok(xml.into_inner())
}

/// An element without content.
fn leaf(xml: &mut Xml, name: &str, attributes: &[(&str, String)]) -> io::Result<()> {
    let attributes = attributes.iter().map(|(name, value)| (*name, value.as_str()));
    xml.create_element(name).with_attributes(attributes).write_empty()?;
    Ok(())
}

/// A number as XML writes it: shortest text that gives the same bits.
pub(crate) fn number(value: f64) -> String {
    let text = format!("{value:?}");
    text.strip_suffix(".0").map_or(text.clone(), String::from)
}

/// Attributes of the root element; `token` is what the standard calls the instantiation token.
fn root(standard: Standard, profile: &Profile<'_>, table: &Table, token: &'static str) -> Attributes {
    vec![
        ("fmiVersion", standard.version().into()),
        ("modelName", profile.name.into()),
        (token, table.token()),
        ("description", profile.description.into()),
        ("version", env!("CARGO_PKG_VERSION").into()),
        ("license", "MIT OR Apache-2.0".into()),
        ("generationTool", concat!("koppel ", env!("CARGO_PKG_VERSION")).into()),
        ("variableNamingConvention", "structured".into()),
    ]
}

/// Dimensionless numbers have the unit 1.
pub(crate) fn unit_name(unit: &'static str) -> &'static str {
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
            xml.create_element("Unit")
                .with_attribute(("name", name))
                .write_inner_content(|xml| leaf(xml, "BaseUnit", &unit.attributes().collect::<Vec<_>>()))?;
        }
        Ok(())
    })?;
    Ok(())
}

/// The flags of an interface that are true, in the order of the standard.
fn interface(profile: &Profile<'_>, flags: &[(&'static str, bool)]) -> Attributes {
    let yes = flags.iter().filter(|(_, on)| *on).map(|(flag, _)| (*flag, "true".to_string()));
    [("modelIdentifier", profile.name.to_string())].into_iter().chain(yes).collect()
}

/// The enumeration types in the order of their first variables.
fn enumerations(table: &Table) -> Vec<&'static EnumType> {
    let mut types: Vec<&'static EnumType> = Vec::new();
    for v in &table.variables {
        if let Kind::Enumeration(t) = v.entry.kind
            && !types.iter().any(|known| known.name == t.name)
        {
            types.push(t);
        }
    }
    types
}

/// Items of an enumeration with the numbers they have in the code.
fn items(xml: &mut Xml, t: &EnumType) -> io::Result<()> {
    t.items.iter().try_for_each(|item| {
        let mut attributes = vec![("name", item.name.to_string()), ("value", item.value.to_string())];
        if !item.description.is_empty() {
            attributes.push(("description", item.description.into()));
        }
        leaf(xml, "Item", &attributes)
    })
}

fn log_categories(xml: &mut Xml) -> io::Result<()> {
    xml.create_element("LogCategories").write_inner_content(|xml| {
        LOG_CATEGORIES.into_iter().try_for_each(|(name, description)| {
            let name = name.to_string_lossy().into_owned();
            leaf(xml, "Category", &[("name", name), ("description", description.into())])
        })
    })?;
    Ok(())
}

fn default_experiment(xml: &mut Xml, profile: &Profile<'_>) -> io::Result<()> {
    let attributes = [
        ("startTime", number(profile.start)),
        ("stopTime", number(profile.experiment.stop)),
        ("stepSize", number(profile.experiment.step)),
    ];
    leaf(xml, "DefaultExperiment", &attributes)
}

/// What a variable is, whatever its type.
fn identity(reference: usize, Variable { name, entry, .. }: &Variable) -> Attributes {
    let causality = match entry.causality {
        Causality::Parameter => "parameter",
        Causality::CalculatedParameter => "calculatedParameter",
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
        ("valueReference", reference.to_string()),
        ("description", entry.description.to_string()),
        ("causality", causality.to_string()),
        ("variability", variability.to_string()),
    ];
    match entry.initial {
        Initial::Exact => attributes.push(("initial", "exact".into())),
        Initial::Approx => attributes.push(("initial", "approx".into())),
        Initial::Calculated => {}
    }
    attributes
}

/// What belongs to the type of a variable; `derivative` is how the standard refers to the state.
fn typed(variable: &Variable, derivative: Option<usize>, is_state: bool) -> Attributes {
    let entry = &variable.entry;
    let mut attributes = Vec::new();
    match entry.kind {
        Kind::Enumeration(t) => attributes.push(("declaredType", t.name.into())),
        Kind::Float64 => attributes.push(("unit", unit_name(entry.unit).into())),
        _ => {}
    }
    let or = |bound: f64, pick: fn(f64, f64) -> f64| entry.or.map_or(bound, |or| pick(bound, or));
    for (name, value) in [("min", or(entry.min, f64::min)), ("max", or(entry.max, f64::max))] {
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
    if let Some(state) = derivative {
        attributes.push(("derivative", state.to_string()));
    }
    if is_state {
        attributes.push(("reinit", "true".into())); // events may move any state
    }
    attributes
}

/// Variables that are computed, as value references.
struct Unknowns {
    outputs: Vec<usize>,
    /// Time derivatives of the states
    derivatives: Vec<usize>,
    /// What is computed at the start
    initial: Vec<usize>,
}

impl Unknowns {
    fn new(table: &Table) -> Self {
        let of = |i: &usize| &table.variables[*i];
        let all = || 0..table.variables.len();
        let outputs: Vec<_> = all().filter(|i| of(i).entry.causality == Causality::Output).collect();
        let derivatives: Vec<_> = all().filter(|i| of(i).derivative_of.is_some()).collect();
        let calculated: Vec<_> =
            all().filter(|i| of(i).entry.causality == Causality::CalculatedParameter).collect();
        let mut initial = [&outputs[..], &table.states, &derivatives, &calculated[..]].concat();
        initial.retain(|i| of(i).entry.initial != Initial::Exact);
        initial.sort_unstable();
        initial.dedup();
        Self { outputs, derivatives, initial }
    }
}

/// Numbers separated by spaces.
fn list(numbers: impl IntoIterator<Item = usize>) -> String {
    numbers.into_iter().map(|n| n.to_string()).collect::<Vec<_>>().join(" ")
}
