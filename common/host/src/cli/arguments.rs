//! The command line.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};

use super::CommandError;
use crate::methods::Choices;
use crate::run::Scene;
use crate::scene::{Override, SceneError};
use crate::ssp::{Package, ParameterValue};

/// Scenes of FMUs that pass motion forward and force backward.
#[derive(Parser)]
#[command(name = "koppel", version, about)]
pub(super) struct Arguments {
    #[command(subcommand)]
    pub(super) command: Command,
    /// Print one JSON object instead of text
    #[arg(long, global = true)]
    pub(super) json: bool,
}

#[derive(Subcommand)]
pub(super) enum Command {
    /// Run a scene
    Simulate(Simulate),
    /// Say what is in an FMU or a scene
    Info(Place),
    /// Check a scene up to the end of its initialisation
    Validate(Run),
    /// Measure error against run time over methods and steps
    Study(Study),
    /// Run a scene over a grid of parameters
    Sweep(Sweep),
    /// Run FMUs and scenes through their stiff and extreme cases
    Check(Check),
    /// Pack a scene's folder with its FMUs into an .ssp archive, or into one FMU
    Pack(Pack),
}

/// Where things lie.
#[derive(Args, Clone)]
pub(super) struct Place {
    /// Scene (.ssp, folder or .ssd file) or FMU
    pub(super) path: PathBuf,
    /// Folder of FMUs that the scene does not hold
    #[arg(long, default_value = "dist/fmi3")]
    pub(super) fmus: PathBuf,
    /// Another root structure of the scene, e.g. foreign.ssd
    #[arg(long)]
    pub(super) structure: Option<String>,
}

/// How a scene is run.
#[derive(Args, Clone)]
pub(super) struct Run {
    #[command(flatten)]
    pub(super) place: Place,
    /// common, cs-predict, cs-pece, jacobi or seidel
    #[arg(long)]
    method: Option<String>,
    /// heun, rk4, dopri5, dop853, rodas4 or radau5 (method common)
    #[arg(long)]
    integrator: Option<String>,
    /// Communication step, and step of heun and rk4 [s]
    #[arg(long = "H", value_name = "STEP")]
    step: Option<f64>,
    /// Relative tolerance
    #[arg(long)]
    rtol: Option<f64>,
    /// Absolute tolerance
    #[arg(long)]
    atol: Option<f64>,
    /// Degree of the input polynomials, 0 to 2
    #[arg(long)]
    order: Option<i64>,
    /// Stabilisation of closing joints [1/s]
    #[arg(long)]
    alpha: Option<f64>,
    /// End of the run [s]
    #[arg(long)]
    stop: Option<f64>,
    /// Interval of recording [s]
    #[arg(long)]
    interval: Option<f64>,
    /// Followers give their true force instead of bias force and inertia
    #[arg(long)]
    raw: bool,
    /// A parameter or start value, may be repeated; component * means all that have it
    #[arg(long = "set", value_name = "COMPONENT.VARIABLE=VALUE")]
    set: Vec<String>,
}

impl Run {
    pub(super) fn choices(&self) -> Choices {
        Choices {
            method: self.method.clone(),
            integrator: self.integrator.clone(),
            step: self.step,
            rtol: self.rtol,
            atol: self.atol,
            order: self.order,
            alpha: self.alpha,
            stop: self.stop,
            interval: self.interval,
        }
    }

    /// The scene as the options want it.
    pub(super) fn scene(&self) -> Result<Scene, SceneError> {
        self.read(self.raw)
    }

    /// The scene with true forces instead of bias force and inertia.
    pub(super) fn raw_scene(&self) -> Result<Scene, SceneError> {
        self.read(true)
    }

    fn read(&self, raw: bool) -> Result<Scene, SceneError> {
        let mut package = Package::open(&self.place.path)?;
        if let Some(structure) = &self.place.structure {
            package.choose(structure);
        }
        let system = package.system()?;
        let system = if raw { system.raw() } else { system };
        Scene::build(package, system, &self.place.fmus)
    }

    pub(super) fn overrides(&self) -> Result<Vec<Override>, CommandError> {
        let assignment = |text: &String| match text.split_once('=') {
            Some((name, value)) => Ok((name.to_owned(), ParameterValue::Text(value.to_owned()))),
            None => Err(CommandError::Assignment(text.clone())),
        };
        self.set.iter().map(assignment).collect()
    }
}

#[derive(Args)]
pub(super) struct Simulate {
    #[command(flatten)]
    pub(super) run: Run,
    /// CSV file of the recorded variables
    #[arg(long, short)]
    pub(super) output: Option<PathBuf>,
}

#[derive(Args)]
pub(super) struct Study {
    #[command(flatten)]
    pub(super) run: Run,
    /// CSV file of the table
    #[arg(long, short)]
    pub(super) output: Option<PathBuf>,
    /// Folder of reference files that the scene does not hold
    #[arg(long, default_value = "tests/reference")]
    pub(super) references: PathBuf,
    /// Timed runs of each point, after one that does not count; 0: no times, and counts include the recording
    #[arg(long, default_value_t = 7)]
    pub(super) runs: u32,
}

#[derive(Args)]
pub(super) struct Sweep {
    /// Plan: TOML, or JSON by the file's name
    pub(super) plan: PathBuf,
    /// CSV file, one row per run; rows that are there already are not run again
    #[arg(long, short, default_value = "sweep.csv")]
    pub(super) output: PathBuf,
    /// Folder of FMUs that the scene does not hold
    #[arg(long, default_value = "dist/fmi3")]
    pub(super) fmus: PathBuf,
}

#[derive(Args)]
pub(super) struct Check {
    /// Folders with a check.toml; all below fmus and scenes unless given
    pub(super) folders: Vec<PathBuf>,
    /// Folder of FMUs
    #[arg(long, default_value = "dist/fmi3")]
    pub(super) fmus: PathBuf,
    /// Table as a file: one row per run (.csv), or Markdown with one line per case
    #[arg(long, short)]
    pub(super) output: Option<PathBuf>,
}

#[derive(Args)]
pub(super) struct Pack {
    /// The scene's folder
    pub(super) folder: PathBuf,
    /// One Co-Simulation FMU with method common inside, instead of an .ssp archive
    #[arg(long)]
    pub(super) assembly: bool,
    /// Version of FMI of the assembly
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u8).range(2..=3), requires = "assembly")]
    pub(super) fmi: u8,
    /// The shared library of assemblies
    #[arg(long, default_value = "dist/lib/libassembly.so", requires = "assembly")]
    pub(super) library: PathBuf,
    /// The archive
    #[arg(long, short)]
    pub(super) output: PathBuf,
    /// Folder of FMUs that the scene does not hold
    #[arg(long, default_value = "dist/fmi3")]
    pub(super) fmus: PathBuf,
    /// Folder of reference files that the scene does not hold
    #[arg(long, default_value = "tests/reference")]
    pub(super) references: PathBuf,
}
