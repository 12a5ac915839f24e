//! Packing: the scene, its unpacked elements and the library in one archive.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use fmu_export::{Profile, Standard, Table, interned};
use model::{Causality, Documentation, Experiment, Plot};

use super::AssemblyError;
use super::instance::{Loaded, experiment_step, load};
use super::layout::Place;
use crate::import::{Archive, ArchiveError, ImportError, VariableKind};
use crate::methods::{Choices, Config};
use crate::record::Recorder;
use crate::run::Scene;
use crate::scene::Recorded;
use crate::ssp::{self, Package};

/// Tolerances of the reference results, as their description says.
const REFERENCE: (f64, f64) = (1e-12, 1e-15);

/// What is packed, and where to.
#[derive(Clone, Copy, Debug)]
pub struct Packing<'a> {
    /// Scene: folder, `.ssd` file or `.ssp` archive
    pub scene: &'a Path,
    /// Folder of FMUs that the scene does not hold
    pub fmus: &'a Path,
    /// The shared library `assembly`
    pub library: &'a Path,
    /// Version of FMI
    pub standard: Standard,
    /// The archive
    pub output: &'a Path,
}

/// What was packed.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Packed {
    /// Elements
    pub elements: Vec<String>,
    /// Number of variables
    pub variables: usize,
    /// Inputs
    pub inputs: Vec<String>,
    /// Outputs
    pub outputs: Vec<String>,
}

fn io_error(path: &Path) -> impl FnOnce(io::Error) -> AssemblyError {
    let path = path.to_owned();
    move |source| AssemblyError::Io { path, source }
}

fn archive_error(error: ArchiveError) -> AssemblyError {
    ImportError::from(error).into()
}

/// A name that a library and a variable may have.
fn identifier(name: &str) -> Result<(), AssemblyError> {
    let letters = name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    let first = name.starts_with(|c: char| c.is_ascii_alphabetic());
    if letters && first { Ok(()) } else { Err(AssemblyError::Name(name.into())) }
}

/// Packs a scene into one Co-Simulation FMU.
///
/// # Errors
/// A scene or element that cannot be loaded, names that do not fit, files that cannot be read or written.
pub fn pack(packing: &Packing<'_>) -> Result<Packed, AssemblyError> {
    let stage = tempfile::Builder::new().prefix("koppel-assembly-").tempdir().map_err(ImportError::Folder)?;
    let resources = stage.path().join("resources");
    collect(packing, stage.path(), &resources)?;
    let mut loaded = load(&resources)?;
    identifier(&loaded.scene.system.name)?;
    loaded.scene.network.nodes.iter().try_for_each(|node| identifier(&node.name))?;
    let library = fs::read(packing.library).map_err(io_error(packing.library))?;
    let extension = packing.library.extension().and_then(|e| e.to_str()).unwrap_or("so");
    let mut files = BTreeMap::new();
    ssp::files(&resources, "resources/", &mut files)?;
    let mut further = Vec::new();
    for (name, path) in files {
        further.push((name, fs::read(&path).map_err(io_error(&path))?));
    }
    let reference = reference(&loaded)?;
    let profile = profile(&mut loaded, &reference);
    let table = &loaded.layout.table;
    let archive = fmu_export::pack(&profile, table, packing.standard, (&library, extension), further)?;
    if let Some(folder) = packing.output.parent() {
        fs::create_dir_all(folder).map_err(io_error(folder))?;
    }
    fs::write(packing.output, archive).map_err(io_error(packing.output))?;
    Ok(Packed {
        elements: loaded.scene.network.nodes.iter().map(|node| node.name.clone()).collect(),
        variables: table.variables().len(),
        inputs: names(table, Causality::Input),
        outputs: names(table, Causality::Output),
    })
}

fn names(table: &Table, causality: Causality) -> Vec<String> {
    let of = table.variables().iter().filter(|v| v.entry.causality == causality);
    of.map(|v| v.name.clone()).collect()
}

/// The content of the folder `resources`.
fn collect(packing: &Packing<'_>, stage: &Path, resources: &Path) -> Result<(), AssemblyError> {
    let mut scene = packing.scene.to_owned();
    if scene.is_file() && scene.extension().is_none_or(|e| e != "ssd") {
        let unpacked = stage.join("scene");
        Archive::open(&scene)
            .and_then(|mut archive| archive.unpack(&unpacked, |_| true))
            .map_err(archive_error)?;
        scene = unpacked;
    }
    let package = Package::open(&scene)?;
    let system = package.system()?;
    let folder = if scene.is_dir() { &scene } else { scene.parent().unwrap_or(Path::new(".")) };
    let mut files = BTreeMap::new();
    ssp::files(folder, "", &mut files)?;
    files.retain(|name, _| Path::new(name).extension().is_some_and(|e| e == "ssv"));
    for (name, path) in files {
        write(&resources.join(name), &fs::read(&path).map_err(io_error(&path))?)?;
    }
    write(&resources.join("SystemStructure.ssd"), &package.structure()?)?;
    let mut seen: BTreeMap<String, PathBuf> = BTreeMap::new();
    for component in &system.components {
        let fmu = package.fmu(&component.source, packing.fmus)?;
        let path = fmu.path().to_owned();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        match seen.get(&name) {
            Some(known) if *known == path => continue,
            Some(known) => {
                let [known, other] = [known, &path].map(|p| p.display().to_string());
                return Err(AssemblyError::SameFile(known, other));
            }
            None => {}
        }
        let wanted = |entry: &str| {
            let folders = ["binaries/", "resources/", "documentation/licenses/"];
            entry == "modelDescription.xml" || folders.iter().any(|folder| entry.starts_with(folder))
        };
        Archive::open(&path)
            .and_then(|mut archive| archive.unpack(&resources.join("fmus").join(&name), wanted))
            .map_err(archive_error)?;
        seen.insert(name, path);
    }
    Ok(())
}

fn write(path: &Path, content: &[u8]) -> Result<(), AssemblyError> {
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder).map_err(io_error(folder))?;
    }
    fs::write(path, content).map_err(io_error(path))
}

/// Results of the default experiment by the native host: a table of all outputs.
fn reference(loaded: &Loaded) -> Result<String, AssemblyError> {
    let Loaded { scene, config, layout, .. } = loaded;
    let mut outputs = Vec::new();
    for (v, place) in layout.table.variables().iter().zip(&layout.places) {
        if let (Causality::Output, Place::Element { node, reference, kind }) = (v.entry.causality, *place) {
            outputs.push(Recorded { node, reference, kind, name: v.name.clone() });
        }
    }
    let interval = Some(experiment_step(config));
    let choices = Choices {
        method: Some("common".into()),
        integrator: Some("dop853".into()),
        rtol: Some(REFERENCE.0),
        atol: Some(REFERENCE.1),
        interval,
        ..Choices::default()
    };
    let config = Config::new(&scene.system, &choices)?;
    let first = scene.network.recorded.len();
    let mut recorder = Recorder::new(&scene.network, &outputs, interval);
    scene.run(&config, &[], &mut recorder, &mut |_| ())?;
    let mut text = String::from("time");
    text.extend(outputs.iter().flat_map(|o| [",", o.name.as_str()]));
    text.push('\n');
    for (t, row) in recorder.times.iter().zip(&recorder.rows) {
        let _ = write!(text, "{t}"); // a string takes everything
        for value in &row[first..] {
            let _ = write!(text, ",{value:.11e}");
        }
        text.push('\n');
    }
    Ok(text)
}

/// What is said about the assembly besides its variables.
fn profile(loaded: &mut Loaded, reference: &str) -> Profile<'static> {
    let serialised = |instance: &crate::import::Instance| instance.capabilities().serialised_states;
    let serialised_states = loaded.sweeper.instances.iter().all(serialised);
    let Loaded { scene, config, layout, .. } = loaded;
    let nodes = &scene.network.nodes;
    let parts: Vec<_> = nodes.iter().map(|n| format!("{} ({})", n.name, n.fmu.description.name)).collect();
    Profile {
        name: interned::text(&scene.system.name),
        description: interned::text(&format!("Assembly of {}", parts.join(", "))),
        start: config.start,
        experiment: Experiment { stop: config.stop, step: experiment_step(config) },
        model_exchange: false,
        indicators: 0..0,
        serialised_states,
        directional_derivatives: false,
        parameters: layout.parameters.clone(),
        documentation: Documentation {
            text: interned::text(&write_up(scene, config)),
            icon_svg: include_str!("icon.svg"),
            icon_png: include_bytes!("icon.png"),
            reference: interned::text(reference),
            reference_inputs: None,
            plots: plots(scene, &layout.table).leak(),
        },
        reference_method: "dop853",
    }
}

/// One diagram per unit of the recorded variables.
fn plots(scene: &Scene, table: &Table) -> Vec<Plot> {
    let mut by_unit: Vec<(&'static str, Vec<String>)> = Vec::new();
    for recorded in scene.network.recorded.iter().filter(|r| r.kind == VariableKind::Real) {
        let Some(v) = table.variables().iter().find(|v| v.name == recorded.name) else { continue };
        match by_unit.iter_mut().find(|(unit, _)| *unit == v.entry.unit) {
            Some((_, names)) => names.push(v.name.clone()),
            None => by_unit.push((v.entry.unit, vec![v.name.clone()])),
        }
    }
    let plot = |(unit, names): (&str, Vec<String>)| Plot {
        title: interned::text(&format!("Recorded variables in {}", if unit.is_empty() { "1" } else { unit })),
        signals: interned::list(&names),
    };
    by_unit.into_iter().map(plot).collect()
}

/// The write-up of an assembly.
fn write_up(scene: &Scene, config: &Config) -> String {
    let mut text = format!(
        "The scene `{}` as one FMU. All states of its elements are integrated together (method `common`): motion goes \
         forward through the elements, force and inertia go backward, joints that close loops are solved exactly, once \
         for each stage of the integrator.\n\n## Elements\n\n| Element | FMU | What it is |\n| --- | --- | --- |\n",
        scene.system.name
    );
    // writing to a string does not fail
    for node in &scene.network.nodes {
        let description = &node.fmu.description;
        let _ = writeln!(text, "| `{}` | `{}` | {} |", node.name, description.name, description.text);
    }
    text.push_str("\nThe variables of an element have its name before theirs.\n\n## Connections\n\n");
    let mut connections: Vec<String> = Vec::new();
    for connection in &scene.system.connections {
        let port = |(component, name): &(String, String)| {
            let port = fmu_export::port_parts(name).map_or(name.as_str(), |(port, ..)| port);
            format!("`{component}.{port}`")
        };
        let [from, to] = [port(&connection.from), port(&connection.to)];
        let (one, other) = (format!("- {from} and {to}\n"), format!("- {to} and {from}\n"));
        if !connections.contains(&one) && !connections.contains(&other) {
            connections.push(one);
        }
    }
    text.extend(connections);
    for joint in &scene.network.joints {
        let _ = writeln!(
            text,
            "- joint `{}` - `{}`, held by stabilisation with alpha = {} 1/s",
            joint.ports[0], joint.ports[1], config.alpha
        );
    }
    text.push_str(concat!(
        "\n## Limits\n\nThe integrator keeps its own steps: it goes beyond a communication point and the values there come \
         from its dense output, so that the numbers do not depend on the communication step while no input changes. \
         Methods are ",
        "`heun`, `rk4` (steps of `solver.step` counted from the start), `dopri5` and `dop853`. Directional derivatives \
         are not offered. Events of the elements are located and carried out inside a step. Ports that nothing in the \
         scene reaches lead outwards; their inputs go on inside a step as `port.inputs` says.\n",
    ));
    text
}
