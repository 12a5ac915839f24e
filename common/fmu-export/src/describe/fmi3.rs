//! What FMI 3.0 writes in its own way.

use std::io;

use super::{
    Unknowns, Xml, default_experiment, enumerations, identity, interface, items, leaf, list, log_categories,
    root, typed, units,
};
use crate::table::{Table, Variable};
use crate::{Profile, Standard};

pub(super) fn document(xml: &mut Xml, profile: &Profile<'_>, table: &Table) -> io::Result<()> {
    let attributes = root(Standard::Fmi3, profile, table, "instantiationToken");
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
            xml.create_element("ModelStructure").write_inner_content(|xml| structure(xml, profile, table))?;
            Ok(())
        })?;
    Ok(())
}

fn interfaces(xml: &mut Xml, profile: &Profile<'_>) -> io::Result<()> {
    let with = |steps: bool| {
        let flags = [
            ("canGetAndSetFMUState", profile.serialised_states),
            ("canSerializeFMUState", profile.serialised_states),
            ("providesDirectionalDerivatives", profile.directional_derivatives),
            ("needsCompletedIntegratorStep", !steps),
            ("canHandleVariableCommunicationStepSize", steps),
            ("hasEventMode", steps),
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
            xml.create_element("EnumerationType")
                .with_attributes([("name", t.name), ("description", t.description)])
                .write_inner_content(|xml| items(xml, t))?;
        }
        Ok(())
    })?;
    Ok(())
}

fn variable(xml: &mut Xml, reference: usize, variable: &Variable, is_state: bool) -> io::Result<()> {
    let attributes =
        [identity(reference, variable), typed(variable, variable.derivative_of, is_state)].concat();
    leaf(xml, Standard::Fmi3.type_name(variable.entry.kind), &attributes)
}

/// Outputs and derivatives with their exact direct dependencies; what is computed at the start as
/// initial unknowns; event indicators.
fn structure(xml: &mut Xml, profile: &Profile<'_>, table: &Table) -> io::Result<()> {
    let Unknowns { outputs, derivatives, initial } = Unknowns::new(table);
    for (element, unknowns) in [("Output", outputs), ("ContinuousStateDerivative", derivatives)] {
        for unknown in unknowns {
            let knowns = list(table.dependencies(unknown));
            leaf(xml, element, &[("valueReference", unknown.to_string()), ("dependencies", knowns)])?;
        }
    }
    let indicators = profile.indicators.clone().collect();
    for (element, unknowns) in [("InitialUnknown", initial), ("EventIndicator", indicators)] {
        for unknown in unknowns {
            leaf(xml, element, &[("valueReference", unknown.to_string())])?;
        }
    }
    Ok(())
}
