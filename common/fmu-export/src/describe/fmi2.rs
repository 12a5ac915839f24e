//! What FMI 2.0 writes in its own way: variables and their references by index, counting from 1.

use std::io;

use super::{
    Unknowns, Xml, default_experiment, enumerations, identity, interface, items, leaf, list, log_categories,
    root, typed, units,
};
use crate::table::{Table, Variable};
use crate::{Profile, Standard};

/// Place in `ModelVariables` of the variable with a value reference.
fn index(reference: usize) -> usize {
    reference + 1
}

pub(super) fn document(xml: &mut Xml, profile: &Profile<'_>, table: &Table) -> io::Result<()> {
    let mut attributes = root(Standard::Fmi2, profile, table, "guid");
    if profile.model_exchange {
        attributes.push(("numberOfEventIndicators", profile.indicators.len().to_string()));
    }
    xml.create_element("fmiModelDescription")
        .with_attributes(attributes.iter().map(|(name, value)| (*name, value.as_str())))
        .write_inner_content(|xml| {
            interfaces(xml, profile)?;
            units(xml, table)?;
            types(xml, table)?;
            log_categories(xml)?;
            default_experiment(xml, profile)?;
            xml.create_element("ModelVariables").write_inner_content(|xml| {
                table
                    .variables
                    .iter()
                    .enumerate()
                    .try_for_each(|(i, v)| variable(xml, i, v, table.is_state(i)))
            })?;
            xml.create_element("ModelStructure").write_inner_content(|xml| structure(xml, table))?;
            Ok(())
        })?;
    Ok(())
}

fn interfaces(xml: &mut Xml, profile: &Profile<'_>) -> io::Result<()> {
    let with = |steps: bool| {
        let flags = [
            ("canNotUseMemoryManagementFunctions", true),
            ("canGetAndSetFMUstate", profile.serialised_states),
            ("canSerializeFMUstate", profile.serialised_states),
            ("providesDirectionalDerivative", profile.directional_derivatives),
            ("canHandleVariableCommunicationStepSize", steps),
        ];
        interface(profile, &flags)
    };
    if profile.model_exchange {
        leaf(xml, "ModelExchange", &with(false))?;
    }
    leaf(xml, "CoSimulation", &with(true))
}

fn types(xml: &mut Xml, table: &Table) -> io::Result<()> {
    xml.create_element("TypeDefinitions").write_inner_content(|xml| {
        for t in enumerations(table) {
            xml.create_element("SimpleType")
                .with_attributes([("name", t.name), ("description", t.description)])
                .write_inner_content(|xml| {
                    xml.create_element("Enumeration").write_inner_content(|xml| items(xml, t))?;
                    Ok(())
                })?;
        }
        Ok(())
    })?;
    Ok(())
}

fn variable(xml: &mut Xml, reference: usize, variable: &Variable, is_state: bool) -> io::Result<()> {
    let attributes = identity(reference, variable);
    xml.create_element("ScalarVariable")
        .with_attributes(attributes.iter().map(|(name, value)| (*name, value.as_str())))
        .write_inner_content(|xml| {
            let name = Standard::Fmi2.type_name(variable.entry.kind);
            leaf(xml, name, &typed(variable, variable.derivative_of.map(index), is_state))
        })?;
    Ok(())
}

/// Outputs and derivatives with their exact direct dependencies; what is computed at the start as
/// initial unknowns.
fn structure(xml: &mut Xml, table: &Table) -> io::Result<()> {
    let Unknowns { outputs, derivatives, initial } = Unknowns::new(table);
    for (element, unknowns) in [("Outputs", outputs), ("Derivatives", derivatives)] {
        group(xml, element, &unknowns, |xml, unknown| {
            let knowns = list(table.dependencies(unknown).into_iter().map(index));
            leaf(xml, "Unknown", &[("index", index(unknown).to_string()), ("dependencies", knowns)])
        })?;
    }
    group(xml, "InitialUnknowns", &initial, |xml, unknown| {
        leaf(xml, "Unknown", &[("index", index(unknown).to_string())])
    })
}

/// A list of unknowns, left out if there are none.
fn group(
    xml: &mut Xml,
    element: &str,
    unknowns: &[usize],
    write: impl Fn(&mut Xml, usize) -> io::Result<()>,
) -> io::Result<()> {
    if unknowns.is_empty() {
        return Ok(());
    }
    xml.create_element(element)
        .write_inner_content(|xml| unknowns.iter().try_for_each(|unknown| write(xml, *unknown)))?;
    Ok(())
}
