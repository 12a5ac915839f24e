//! `koppel simulate`

use std::fmt::Write as _;
use std::fs::File;
use std::io::{self, Write as _};
use std::path::Path;

use serde_json::json;

use super::arguments::Simulate;
use super::progress::Progress;
use super::{Answer, CommandError};
use crate::methods::{Config, MethodKind, integrator_name};
use crate::record::Recorder;
use crate::run::{Cost, Scene};

pub(super) fn simulate(options: &Simulate) -> Result<Answer, CommandError> {
    let scene = options.run.scene()?;
    let config = Config::new(&scene.system, &options.run.choices())?;
    warn(&scene, &config);
    let mut recorder = scene.recorder(&config);
    let mut progress = Progress::new();
    let length = config.stop - config.start;
    let cost = scene.run(&config, &options.run.overrides()?, &mut recorder, &mut |t| {
        progress.show((t - config.start) / length);
    })?;
    drop(progress);
    if let Some(path) = &options.output {
        write(&recorder, path)?;
    }
    Ok(report(&scene, &config, &recorder, &cost))
}

/// Says on standard error what is probably not meant, before a run that may fail by it.
pub(super) fn warn(scene: &Scene, config: &Config) {
    for warning in scene.warnings(config) {
        let _ = writeln!(io::stderr(), "warning: {warning}"); // nowhere else to say it
    }
}

fn write(recorder: &Recorder, path: &Path) -> Result<(), CommandError> {
    let error = |source| CommandError::Write { path: path.into(), source };
    recorder.write(File::create(path).map_err(error)?).map_err(error)
}

/// Method and step in words.
pub(super) fn described(config: &Config) -> String {
    let mut text = config.method.name().to_owned();
    if config.method == MethodKind::Common {
        let _ = write!(text, " {}", integrator_name(config.integrator));
    } else {
        let _ = write!(text, " order {}", config.order);
    }
    match config.step {
        Some(step) if config.method != MethodKind::Common || !config.integrator.is_adaptive() => {
            let _ = write!(text, ", H = {step} s");
        }
        _ => {
            let _ = write!(text, ", rtol {:e}, atol {:e}", config.rtol, config.atol);
        }
    }
    text
}

fn report(scene: &Scene, config: &Config, recorder: &Recorder, cost: &Cost) -> Answer {
    let last = recorder.rows.last().map_or(&[][..], |row| row);
    let mut text = format!("{}: {} to t = {} s\n", scene.system.name, described(config), config.stop);
    for (name, value) in recorder.names.iter().zip(last) {
        let _ = writeln!(text, "  {name:40} {value:.12e}");
    }
    let Cost { steps, calls, sweeps } = cost;
    let _ = writeln!(
        text,
        "{} components, {} of {} variables exchanged, {} samples",
        scene.network.nodes.len(),
        scene.exchanged(),
        scene.available(),
        recorder.times.len(),
    );
    let _ = writeln!(
        text,
        "{} steps, {} rejected, {} right-hand sides, {} events, {sweeps} sweeps, {} FMI calls, {:.3} ms",
        steps.accepted,
        steps.rejected,
        steps.rhs_evaluations,
        steps.events,
        calls.total(),
        1e3 * steps.seconds,
    );
    if !scene.network.joints.is_empty() {
        let _ = writeln!(text, "largest gap of a joint at a sample: {:.3e} m", steps.gap);
    }
    let values: serde_json::Map<_, _> =
        recorder.names.iter().cloned().zip(last.iter().map(|v| json!(v))).collect();
    let json = json!({
        "scene": scene.system.name,
        "method": config.method.name(),
        "integrator": (config.method == MethodKind::Common).then(|| integrator_name(config.integrator)),
        "H": config.step,
        "rtol": config.rtol,
        "atol": config.atol,
        "order": config.order,
        "stop": config.stop,
        "values": values,
        "components": scene.network.nodes.len(),
        "variables": {"exchanged": scene.exchanged(), "available": scene.available()},
        "cost": cost,
        "warnings": scene.warnings(config),
    });
    Answer { text, json }
}
