//! Plans of extreme cases: a file `check.toml` beside an FMU's crate or in a scene's folder.
//!
//! ```toml
//! fmu = "bushing"                      # without it: the scene in this folder
//! stop = 0.1                           # end of each run [s]
//! H = [0.001, 0.01]                    # communication steps [s]
//! methods = { rk4 = 1e-3, radau5 = 1e-5 }    # solver.method of the FMU, or method of the host, with its bound
//! reference = ["radau5", "dop853"]     # tight runs that must agree
//! watch = ["A.F.x"]                    # variables compared; without it all outputs, or what the scene records
//! [[case]]
//! name = "1e8 N/m"
//! set = { stiffness = 1e8 }            # parameters, start values, inputs; of a scene: component.variable
//! values = { "A.F.x" = -1.0 }          # known values at the end
//! expect = "refused"                   # or "right"; without it either will do
//! ```

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::CheckError;
use crate::import::{Causality, Fmu, VariableKind};
use crate::run::Scene;
use crate::scene::Override;
use crate::ssp::{Component, Package, ParameterValue, System};

/// What a case must end in.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub enum Expected {
    /// Within the bound
    Right,
    /// Refused with a message
    Refused,
}

/// One extreme case; what it does not give is the plan's.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Case {
    /// In words
    pub name: String,
    #[serde(default)]
    set: BTreeMap<String, toml::Value>,
    /// Known values at the end
    #[serde(default)]
    pub values: BTreeMap<String, f64>,
    /// What it must end in; none: right or refused
    pub expect: Option<Expected>,
    stop: Option<f64>,
    #[serde(rename = "H")]
    steps: Option<Vec<f64>>,
    methods: Option<BTreeMap<String, f64>>,
    reference: Option<Vec<String>>,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    fmu: Option<String>,
    stop: f64,
    #[serde(rename = "H")]
    steps: Vec<f64>,
    methods: BTreeMap<String, f64>,
    #[serde(default)]
    reference: Vec<String>,
    #[serde(default)]
    watch: Vec<String>,
    #[serde(rename = "case", default)]
    cases: Vec<Case>,
}

/// The plan of one FMU or scene.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The FMU or scene
    pub name: String,
    /// Cases
    pub cases: Vec<Case>,
    file: File,
    folder: PathBuf,
}

/// One method of a case.
#[derive(Clone, Debug)]
pub struct Trial {
    /// `solver.method` of the FMU, or method of the host
    pub method: String,
    /// Communication step [s]
    pub step: f64,
    /// Largest error, relative to the scale
    pub bound: f64,
}

impl Plan {
    /// Reads `check.toml` in a folder.
    ///
    /// # Errors
    /// A file that is missing or is no plan.
    pub fn read(folder: &Path) -> Result<Self, CheckError> {
        let path = folder.join(super::FILE);
        let text =
            fs::read_to_string(&path).map_err(|source| CheckError::Read { path: path.clone(), source })?;
        let file: File = toml::from_str(&text)
            .map_err(|source| CheckError::Plan { path: path.clone(), problem: source.to_string() })?;
        let name = file
            .fmu
            .clone()
            .unwrap_or_else(|| format!("scene {}", folder.file_name().unwrap_or_default().to_string_lossy()));
        let plan = Self { name, cases: file.cases.clone(), file, folder: folder.into() };
        plan.verify().map_err(|problem| CheckError::Plan { path, problem })?;
        Ok(plan)
    }

    fn verify(&self) -> Result<(), String> {
        let positive = |value: f64| value.is_finite() && value > 0.0;
        for case in &self.cases {
            if !positive(self.stop(case)) {
                return Err(format!("case {:?}: stop = {}: must be above 0 s", case.name, self.stop(case)));
            }
            for trial in self.trials(case) {
                if !(positive(trial.step) && trial.step <= self.stop(case) && positive(trial.bound)) {
                    let Trial { method, step, bound } = trial;
                    let name = &case.name;
                    return Err(format!(
                        "case {name:?}, method {method}: H = {step} must be above 0 and at most stop, bound {bound} above 0"
                    ));
                }
            }
        }
        Ok(())
    }

    /// Whether it is the plan of an FMU, not of a scene.
    #[must_use]
    pub fn is_of_fmu(&self) -> bool {
        self.file.fmu.is_some()
    }

    /// End of a case [s].
    #[must_use]
    pub fn stop(&self, case: &Case) -> f64 {
        case.stop.unwrap_or(self.file.stop)
    }

    /// Methods and steps of a case.
    #[must_use]
    pub fn trials(&self, case: &Case) -> Vec<Trial> {
        let methods = case.methods.as_ref().unwrap_or(&self.file.methods);
        let steps = case.steps.as_ref().unwrap_or(&self.file.steps);
        let of_method = |(method, bound): (&String, &f64)| {
            let (method, bound) = (method.clone(), *bound);
            steps.iter().map(move |step| Trial { method: method.clone(), step: *step, bound })
        };
        methods.iter().flat_map(of_method).collect()
    }

    /// Methods of the runs that the others are compared with.
    #[must_use]
    pub fn references(&self, case: &Case) -> Vec<String> {
        let given = case.reference.as_ref().unwrap_or(&self.file.reference).clone();
        let usual = if self.is_of_fmu() { ["dop853", "radau5"] } else { ["common dop853", "common dopri5"] };
        if given.is_empty() { usual.map(String::from).into() } else { given }
    }

    /// What a case sets.
    ///
    /// # Errors
    /// A value that is no number, text or Boolean.
    pub fn overrides(&self, case: &Case) -> Result<Vec<Override>, CheckError> {
        let value = |name: &String, value: &toml::Value| match value {
            toml::Value::Float(v) => Ok(ParameterValue::Real(*v)),
            toml::Value::Integer(v) => Ok(ParameterValue::Integer(*v)),
            toml::Value::Boolean(v) => Ok(ParameterValue::Boolean(*v)),
            toml::Value::String(v) => Ok(ParameterValue::Text(v.clone())),
            other => Err(CheckError::Plan {
                path: self.folder.join(super::FILE),
                problem: format!("case {:?}: {name} = {other:?} is no number, text or Boolean", case.name),
            }),
        };
        case.set.iter().map(|(name, v)| Ok((self.qualified(name), value(name, v)?))).collect()
    }

    /// Name in the scene: an FMU is its own component.
    #[must_use]
    pub fn qualified(&self, name: &str) -> String {
        if self.is_of_fmu() { format!("{}.{name}", self.name) } else { name.into() }
    }

    /// The scene, or one with the FMU alone.
    ///
    /// # Errors
    /// What is wrong with the scene or the FMU.
    pub fn scene(&self, fmus: &Path) -> Result<Scene, CheckError> {
        let package = Package::open(&self.folder)?;
        let mut system = match &self.file.fmu {
            None => package.system()?,
            Some(name) => alone(name, &*package.fmu(&format!("resources/{name}.fmu"), fmus)?),
        };
        if !self.file.watch.is_empty() {
            system.settings.record = self.file.watch.iter().map(|name| self.qualified(name)).collect();
        }
        Ok(Scene::build(package, system, fmus)?)
    }
}

/// A system of one FMU that records its real outputs.
fn alone(name: &str, fmu: &Fmu) -> System {
    let component = Component {
        name: name.into(),
        source: format!("resources/{name}.fmu"),
        connectors: Vec::new(),
        parameters: Vec::new(),
    };
    let mut system = System { name: name.into(), components: vec![component], ..System::default() };
    let outputs = fmu.description.variables.iter();
    let outputs = outputs.filter(|v| v.causality == Causality::Output && v.kind == VariableKind::Real);
    system.settings.record = outputs.map(|v| format!("{name}.{}", v.name)).collect();
    system
}
