//! A scene as a whole: loaded once, run as often as wanted.

use std::path::Path;

use crate::error::Error;
use crate::import::Counts;
use crate::methods::{self, Config, Progress, Steps};
use crate::record::Recorder;
use crate::scene::{Network, Override, Plan, SceneError};
use crate::ssp::{Package, System};
use crate::sweep::Sweeper;

/// A scene with its FMUs and its plan.
pub struct Scene {
    /// Where it lies
    pub package: Package,
    /// What it says
    pub system: System,
    /// Components and connections
    pub network: Network,
    plan: Plan,
}

/// What a run cost.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Cost {
    /// Steps
    pub steps: Steps,
    /// FMI calls after initialisation
    pub calls: Counts,
    /// Sweeps
    pub sweeps: u64,
}

impl Scene {
    /// Reads a scene and the FMUs it names.
    ///
    /// # Errors
    /// What is wrong with the files or with each other.
    pub fn load(path: &Path, fmus: &Path, structure: Option<&str>) -> Result<Self, SceneError> {
        let mut package = Package::open(path)?;
        if let Some(structure) = structure {
            package.choose(structure);
        }
        let system = package.system()?;
        Self::build(package, system, fmus)
    }

    /// A scene from a system that was changed after reading.
    ///
    /// # Errors
    /// As [`load`](Self::load).
    pub fn build(package: Package, system: System, fmus: &Path) -> Result<Self, SceneError> {
        let mut network = Network::build(&system, &package, fmus)?;
        let plan = Plan::of(&mut network);
        Ok(Self { package, system, network, plan })
    }

    /// Variables exchanged: signals and inputs in use.
    #[must_use]
    pub fn exchanged(&self) -> usize {
        self.network.signals.len() + self.network.sinks.len()
    }

    /// Variables of all components.
    #[must_use]
    pub fn available(&self) -> usize {
        self.network.nodes.iter().map(|n| n.fmu.description.variables.len()).sum()
    }

    /// Fresh instances with their parameters.
    ///
    /// # Errors
    /// An FMU that lacks the interface, a parameter that is refused.
    pub fn instantiate(&self, config: &Config, overrides: &[Override]) -> Result<Sweeper, SceneError> {
        let interface = config.method.interface();
        let mut instances = Vec::new();
        for node in &self.network.nodes {
            instances.push(node.fmu.instantiate(&node.name, interface)?);
        }
        self.network.set_parameters(&self.system, overrides, &mut instances)?;
        let mut sweeper = Sweeper::new(&self.network, &self.plan, instances, config.alpha);
        for name in &self.system.settings.assemble {
            let (node, variable) = self.network.find(name, "assemble")?;
            sweeper.assemble.push((node, variable.reference));
        }
        Ok(sweeper)
    }

    /// Runs the scene once.
    ///
    /// # Errors
    /// What the scene, the FMUs or the numerics refuse.
    pub fn run(
        &self,
        config: &Config,
        overrides: &[Override],
        recorder: &mut Recorder,
        progress: Progress<'_>,
    ) -> Result<Cost, Error> {
        let mut sweeper = self.instantiate(config, overrides)?;
        sweeper.reset_counts();
        let steps = methods::run(&mut sweeper, config, recorder, progress)?;
        let calls = sweeper.counts();
        let sweeps = sweeper.sweeps;
        Ok(Cost { steps, calls, sweeps })
    }

    /// Closing joints and inputs of affine loops, by their ports and variables.
    #[must_use]
    pub fn closures(&self) -> Vec<String> {
        let joints = self.network.joints.iter().map(|j| format!("joint {}", j.ports.join(" - ")));
        let cuts = self.plan.cuts.iter().map(|&sink| {
            let sink = &self.network.sinks[sink];
            format!("loop through {}.{}", self.network.nodes[sink.node].name, sink.name)
        });
        joints.chain(cuts).collect()
    }

    /// A recorder for the scene's variables.
    #[must_use]
    pub fn recorder(&self, config: &Config) -> Recorder {
        Recorder::new(&self.network, &[], config.interval)
    }

    /// What a run may be made with but probably is not meant to be.
    #[must_use]
    pub fn warnings(&self, config: &Config) -> Vec<String> {
        let Some(step) = config.step.filter(|_| config.is_fixed_step() && !self.network.joints.is_empty())
        else {
            return Vec::new();
        };
        let product = config.alpha * step;
        // a step that is 1/alpha by its digits may be a last bit above
        if product <= 1.0 + 1e-9 {
            return Vec::new();
        }
        vec![format!(
            "alpha H = {product} is above 1: the closing joints are stabilised faster than the steps can follow"
        )]
    }
}
