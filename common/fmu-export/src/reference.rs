//! Reference results inside the archive, after the layered standard FMI-LS-REF 1.0.0-alpha.1: the folder, its
//! manifest, and the words about them. The standard gives no names to the files; they follow the FMI Cross-Check.

use std::io;

use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesText, Event};

use crate::Profile;
use crate::describe::number;

/// Name of the layered standard.
const STANDARD: &str = "org.fmi-standard.fmi-ls-ref";
/// Folder of its files in the archive.
pub(crate) const FOLDER: &str = "extra/org.fmi-standard.fmi-ls-ref";

/// File of the results.
pub(crate) fn results_name(profile: &Profile<'_>) -> String {
    format!("{}_ref.csv", profile.name)
}

/// File of the inputs.
pub(crate) fn inputs_name(profile: &Profile<'_>) -> String {
    format!("{}_in.csv", profile.name)
}

/// How the results were computed.
pub(crate) fn description(profile: &Profile<'_>) -> String {
    let inputs = match profile.documentation.reference_inputs {
        Some(_) => format!("inputs from {}", inputs_name(profile)),
        None => "inputs at their start values".into(),
    };
    format!(
        "Default experiment ({} to {} s, step {} s) with all parameters at their defaults and {inputs}, computed with \
         solver.method = {}, solver.rtol = 1e-12, solver.atol = 1e-15, written with 12 digits.",
        number(profile.start),
        number(profile.experiment.stop),
        number(profile.experiment.step),
        profile.reference_method,
    )
}

/// `fmi-ls-manifest.xml`: the files and their roles.
///
/// # Errors
/// None that are known: writing goes to memory.
pub(crate) fn manifest(profile: &Profile<'_>) -> io::Result<Vec<u8>> {
    let mut xml = Writer::new_with_indent(Vec::new(), b' ', 2);
    xml.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
    xml.create_element("fmiReferences")
        .with_attributes([
            ("xmlns:fmi-ls", "http://fmi-standard.org/fmi-ls-manifest"),
            ("fmi-ls:fmi-ls-name", STANDARD),
            ("fmi-ls:fmi-ls-version", "1.0.0-alpha.1"),
            (
                "fmi-ls:fmi-ls-description",
                "Layered Standard providing information on related files included in an FMU.",
            ),
        ])
        .write_inner_content(|xml| {
            let mut related = |kind: &str, source: &str, role: &str, what: &str| {
                xml.create_element("Related")
                    .with_attributes([
                        ("type", kind),
                        ("source", source),
                        ("role", role),
                        ("description", what),
                    ])
                    .write_empty()
                    .map(|_| ())
            };
            related("text/csv", &results_name(profile), "result", &description(profile))?;
            if profile.documentation.reference_inputs.is_some() {
                related("text/csv", &inputs_name(profile), "other", "Inputs of the reference run")?;
            }
            related("text/html", "../../documentation/index.html", "document", "Documentation of the model")
        })?;
    xml.write_event(Event::Text(BytesText::new("\n")))?;
    Ok(xml.into_inner())
}

/// `fmi-ls-ref.txt`: what a user of the results should know.
pub(crate) fn notes(profile: &Profile<'_>) -> String {
    format!(
        "Reference results of {}\n\n{}\n\nThe file holds every output. At the default solver settings a run differs from \
         it by the error of that method; how the results themselves were checked is told in index.html.\n",
        profile.name,
        description(profile),
    )
}
