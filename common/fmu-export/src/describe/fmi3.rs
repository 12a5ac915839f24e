//! What FMI 3.0 writes in its own way.

use std::io;

use model::Model;

use super::{
    Unknowns, Xml, default_experiment, enumerations, identity, items, leaf, list, log_categories, root,
    typed, units,
};
use crate::Standard;
use crate::table::{Layout, Part, Table, Variable};

pub(super) fn document<M: Model>(xml: &mut Xml, table: &Table) -> io::Result<()> {
    let attributes = root::<M>(Standard::Fmi3, table, "instantiationToken");
    xml.create_element("fmiModelDescription")
        .with_attributes(attributes.iter().map(|(name, value)| (*name, value.as_str())))
        .write_inner_content(|xml| {
            interfaces::<M>(xml)?;
            units(xml, table)?;
            types(xml, table)?;
            log_categories(xml)?;
            default_experiment::<M>(xml)?;
            xml.create_element("ModelVariables").write_inner_content(|xml| {
                table
                    .variables
                    .iter()
                    .enumerate()
                    .try_for_each(|(i, v)| variable(xml, i, v, table.is_state(i)))
            })?;
            xml.create_element("ModelStructure").write_inner_content(|xml| structure::<M>(xml, table))?;
            Ok(())
        })?;
    Ok(())
}

fn interfaces<M: Model>(xml: &mut Xml) -> io::Result<()> {
    let with = |more: &[&'static str]| {
        let yes = ["canGetAndSetFMUState", "canSerializeFMUState", "providesDirectionalDerivatives"];
        let flags = yes.iter().chain(more).map(|flag| (*flag, "true".to_string()));
        [("modelIdentifier", M::NAME.to_string())].into_iter().chain(flags).collect::<Vec<_>>()
    };
    if M::MODEL_EXCHANGE {
        leaf(xml, "ModelExchange", &with(&["needsCompletedIntegratorStep"]))?;
    }
    leaf(xml, "CoSimulation", &with(&["canHandleVariableCommunicationStepSize", "hasEventMode"]))
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
fn structure<M: Model>(xml: &mut Xml, table: &Table) -> io::Result<()> {
    let Unknowns { outputs, derivatives, initial } = Unknowns::new(table);
    for (element, unknowns) in [("Output", outputs), ("ContinuousStateDerivative", derivatives)] {
        for unknown in unknowns {
            let knowns = list(table.dependencies(unknown));
            leaf(xml, element, &[("valueReference", unknown.to_string()), ("dependencies", knowns)])?;
        }
    }
    let indicators = Layout::<M>::part(Part::Indicators).collect();
    for (element, unknowns) in [("InitialUnknown", initial), ("EventIndicator", indicators)] {
        for unknown in unknowns {
            leaf(xml, element, &[("valueReference", unknown.to_string())])?;
        }
    }
    Ok(())
}
