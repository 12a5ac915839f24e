//! `koppel pack`

use fmu_export::Standard;
use serde_json::json;

use super::arguments::Pack;
use super::{Answer, CommandError};
use crate::assembly::{self, AssemblyError, Packing};
use crate::scene::SceneError;
use crate::ssp;

pub(super) fn pack(options: &Pack) -> Result<Answer, CommandError> {
    if options.assembly {
        return assembly(options);
    }
    let entries = ssp::pack(&options.folder, &options.fmus, &options.references, &options.output)
        .map_err(SceneError::from)?;
    let text = format!("{}: {} entries\n", options.output.display(), entries.len());
    Ok(Answer { text, json: json!({"output": options.output, "entries": entries}) })
}

/// The scene as one Co-Simulation FMU.
fn assembly(options: &Pack) -> Result<Answer, CommandError> {
    let packing = Packing {
        scene: &options.folder,
        fmus: &options.fmus,
        library: &options.library,
        standard: if options.fmi == 2 { Standard::Fmi2 } else { Standard::Fmi3 },
        output: &options.output,
    };
    let packed = assembly::pack(&packing).map_err(|error| match error {
        AssemblyError::Scene(error) => (*error).into(),
        AssemblyError::Run(error) => crate::error::Error::Run(*error).into(),
        other => CommandError::Assembly(Box::new(other)),
    })?;
    let text = format!(
        "{}: {} elements, {} variables, {} inputs, {} outputs\n",
        options.output.display(),
        packed.elements.len(),
        packed.variables,
        packed.inputs.len(),
        packed.outputs.len()
    );
    Ok(Answer { text, json: json!({"output": options.output, "assembly": packed}) })
}
