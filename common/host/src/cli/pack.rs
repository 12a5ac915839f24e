//! `koppel pack`

use serde_json::json;

use super::arguments::Pack;
use super::{Answer, CommandError};
use crate::scene::SceneError;
use crate::ssp;

pub(super) fn pack(options: &Pack) -> Result<Answer, CommandError> {
    let entries = ssp::pack(&options.folder, &options.fmus, &options.references, &options.output)
        .map_err(SceneError::from)?;
    let text = format!("{}: {} entries\n", options.output.display(), entries.len());
    Ok(Answer { text, json: json!({"output": options.output, "entries": entries}) })
}
