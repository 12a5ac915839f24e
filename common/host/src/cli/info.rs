//! `koppel info`

use std::fmt::Write as _;

use serde_json::json;

use super::arguments::Place;
use super::{Answer, CommandError};
use crate::import::{Capabilities, Causality, Description, Fmu, Version};
use crate::run::Scene;
use crate::scene::SceneError;

pub(super) fn info(place: &Place) -> Result<Answer, CommandError> {
    if place.path.extension().is_some_and(|e| e == "fmu") {
        let fmu = Fmu::open(&place.path).map_err(SceneError::from)?;
        return Ok(of_fmu(&fmu.description));
    }
    Ok(of_scene(&Scene::load(&place.path, &place.fmus, place.structure.as_deref())?))
}

/// Names of ports, from variables like `P.r.x` and `P.F.x`.
fn ports(description: &Description, causality: Causality) -> Vec<&str> {
    let mut ports: Vec<&str> = Vec::new();
    for variable in &description.variables {
        let port = variable.name.split_once('.').filter(|(_, rest)| rest.starts_with("r.") || *rest == "s");
        if let Some((port, _)) = port
            && variable.causality == causality
            && !ports.contains(&port)
        {
            ports.push(port);
        }
    }
    ports
}

fn of_fmu(description: &Description) -> Answer {
    let count = |causality| description.variables.iter().filter(|v| v.causality == causality).count();
    let version = match description.version {
        Version::V2 => "2.0",
        Version::V3 => "3.0",
    };
    let (leads, follows) = (ports(description, Causality::Output), ports(description, Causality::Input));
    let mut text = format!("{} (FMI {version}): {}\n", description.name, description.text);
    for (name, capabilities) in
        [("Co-Simulation", &description.co_simulation), ("Model Exchange", &description.model_exchange)]
    {
        if let Some(capabilities) = capabilities {
            let _ = writeln!(text, "  {name}: {}", abilities(capabilities).join(", "));
        }
    }
    let _ = writeln!(
        text,
        "  {} inputs, {} outputs, {} parameters, {} states",
        count(Causality::Input),
        count(Causality::Output),
        count(Causality::Parameter),
        description.states.len(),
    );
    let _ = writeln!(text, "  leads at: {}; follows at: {}", listed(&leads), listed(&follows));
    let json = json!({
        "name": description.name,
        "fmiVersion": version,
        "description": description.text,
        "coSimulation": description.co_simulation.as_ref().map(abilities),
        "modelExchange": description.model_exchange.as_ref().map(abilities),
        "inputs": count(Causality::Input),
        "outputs": count(Causality::Output),
        "parameters": count(Causality::Parameter),
        "states": description.states.len(),
        "leads": leads,
        "follows": follows,
    });
    Answer { text, json }
}

fn abilities(capabilities: &Capabilities) -> Vec<&'static str> {
    [
        (capabilities.event_mode, "Event Mode"),
        (capabilities.state_saving, "state saving"),
        (capabilities.directional_derivatives, "directional derivatives"),
        (capabilities.variable_steps, "variable steps"),
    ]
    .into_iter()
    .filter_map(|(has, name)| has.then_some(name))
    .collect()
}

fn listed(names: &[&str]) -> String {
    if names.is_empty() { "-".into() } else { names.join(" ") }
}

fn of_scene(scene: &Scene) -> Answer {
    let mut text = format!("{}\n", scene.system.name);
    for (node, component) in scene.network.nodes.iter().zip(&scene.system.components) {
        let _ = writeln!(text, "  {:20} {} ({})", node.name, node.fmu.description.name, component.source);
    }
    for closure in scene.closures() {
        let _ = writeln!(text, "  {closure}");
    }
    let _ = writeln!(
        text,
        "  {} connections, {} of {} variables exchanged",
        scene.system.connections.len(),
        scene.exchanged(),
        scene.available(),
    );
    let components: Vec<_> =
        scene.network.nodes.iter().map(|n| json!({"name": n.name, "fmu": n.fmu.description.name})).collect();
    let json = json!({
        "scene": scene.system.name,
        "components": components,
        "closures": scene.closures(),
        "connections": scene.system.connections.len(),
        "variables": {"exchanged": scene.exchanged(), "available": scene.available()},
        "recorded": scene.system.settings.record,
    });
    Answer { text, json }
}
