//! `koppel validate`

use serde_json::json;

use super::arguments::Run;
use super::simulate::warn;
use super::{Answer, CommandError};
use crate::error::Error;
use crate::methods::Config;
use crate::start;

pub(super) fn validate(options: &Run) -> Result<Answer, CommandError> {
    let scene = options.scene()?;
    let config = Config::new(&scene.system, &options.choices())?;
    warn(&scene, &config);
    let mut sweeper = scene.instantiate(&config, &options.overrides()?)?;
    start::initialise(&mut sweeper, &config).map_err(Error::from)?;
    let gap = sweeper.gap().map(|(position, _, _)| position);
    let text = format!(
        "{} is valid: {} components, {} connections, method {}\n",
        scene.system.name,
        scene.network.nodes.len(),
        scene.system.connections.len(),
        config.method.name(),
    );
    let json = json!({"scene": scene.system.name, "valid": true, "gap": gap});
    Ok(Answer { text, json })
}
