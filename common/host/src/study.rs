//! Work-precision studies: error over run time for methods and steps.
//!
//! ```text
//! reference  the scene's file; without one, or with overrides: method common, dop853 and dopri5 at 1e-12, which must
//!            agree to 1e-9 of the scale
//! e_max      max_k |y(t_k) - ref(t_k)| / s,  s = max(max_k |ref|, nominal);  largest of all variables
//! wall, cpu  of the step loop alone, without recording; one run dropped, then the smallest and the median of the others
//! ```
//! Components of Co-Simulation step by RK4 with one inner step per H where they have such a solver, so that the error of the
//! coupling shows.

mod reference;

use std::path::Path;

use integrators::Method as Integrator;
use serde::Serialize;

pub use reference::{Reference, ReferenceError, SignalError};

use crate::audit::{self, Audit};
use crate::error::{Error, RunError};
use crate::methods::{Choices, Config, MethodKind, integrator_name};
use crate::record::Recorder;
use crate::run::{Cost, Scene};
use crate::scene::{Override, SceneError};
use crate::ssp::ParameterValue;

/// Intervals between samples where the scene has none.
const INTERVALS: u32 = 200;
/// Steps per sample interval of the methods with fixed steps.
const STEPS: [u32; 6] = [1, 2, 4, 8, 16, 32];
/// Relative tolerances of the methods with step control.
const TOLERANCES: [f64; 7] = [1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9];
/// Absolute over relative tolerance.
const ABSOLUTE: f64 = 1e-3;
/// Tolerance of a computed reference.
const REFERENCE_TOLERANCE: f64 = 1e-12;
/// Agreement of two computed references, relative to the scale.
const AGREEMENT: f64 = 1e-9;
/// Accuracy of a reference file, relative to the scale.
const FILE_ACCURACY: f64 = 1e-12;
/// Measurements shorter than this are made of several runs [s].
const LEAST_TIME: f64 = 0.05;
/// Variables of the solver inside a component.
const INNER: [&str; 3] = ["solver.method", "solver.step", "solver.rhs_evaluations"];

/// Why there is no study.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// The scene or its settings
    #[error(transparent)]
    Scene(Box<SceneError>),
    /// Nothing to compare
    #[error("the scene records no variables")]
    NothingRecorded,
    /// The scene's reference
    #[error(transparent)]
    Reference(#[from] ReferenceError),
    /// The references differ
    #[error(
        "no reference: dop853 and dopri5 at tolerance 1e-12 differ by {difference:.3e} of the scale in {variable} (limit 1e-9)"
    )]
    NoReference {
        /// Variable with the largest difference
        variable: String,
        /// Difference
        difference: f64,
    },
    /// The reference cannot be made
    #[error("no reference: {0}")]
    Failed(Box<Error>),
}

impl From<SceneError> for StudyError {
    fn from(error: SceneError) -> Self {
        Self::Scene(Box::new(error))
    }
}

/// One line of the table: errors where the run reached its end, else none.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Point {
    /// Method with its order or integrator
    pub method: String,
    /// Step, of methods with fixed steps [s]
    #[serde(rename = "H")]
    pub step: Option<f64>,
    /// Relative tolerance, of methods with step control
    pub rtol: Option<f64>,
    /// Largest error
    pub e_max: Option<f64>,
    /// Root of the mean square error, of the worst variable
    pub e_rms: Option<f64>,
    /// Energy balance over the largest energy
    pub energy: Option<f64>,
    /// Largest gap of closing joints [m]
    pub gap: Option<f64>,
    /// Smallest wall time [s]
    pub wall_min: Option<f64>,
    /// Median wall time [s]
    pub wall_median: Option<f64>,
    /// Smallest CPU time [s]
    pub cpu: Option<f64>,
    /// Simulated time over the smallest wall time
    pub real_time_factor: Option<f64>,
    /// Right-hand sides of single components, in the integrator of method common or inside the components
    pub evaluations: Option<u64>,
    /// Steps and calls of a run without recording
    pub cost: Option<Cost>,
    /// Fitted order of the method
    pub order: Option<f64>,
    /// ok, or why not
    pub status: String,
}

/// A whole study.
#[derive(Clone, Debug, Serialize)]
pub struct Study {
    /// Scene
    pub scene: String,
    /// Where the reference comes from
    pub reference: String,
    /// All points, one method after the other
    pub points: Vec<Point>,
}

/// What a study is made of besides the scene.
pub struct Options<'a> {
    /// Settings of the user
    pub choices: &'a Choices,
    /// Parameters of the user
    pub overrides: &'a [Override],
    /// Folder of reference files that the scene does not hold
    pub references: &'a Path,
    /// Timed runs of each point; 0: no times, and counts include the recording
    pub runs: u32,
}

/// A method with its variation.
struct Family<'a> {
    name: String,
    scene: &'a Scene,
    method: MethodKind,
    integrator: Integrator,
    order: i64,
    adaptive: bool,
}

fn families<'a>(scene: &'a Scene, raw: &'a Scene) -> Vec<Family<'a>> {
    let common = |integrator: Integrator| Family {
        name: format!("common {}", integrator_name(integrator)),
        scene,
        method: MethodKind::Common,
        integrator,
        order: 1,
        adaptive: integrator.is_adaptive(),
    };
    let coupled = |method: MethodKind, order: i64| Family {
        name: format!("{} order {order}", method.name()),
        scene,
        method,
        integrator: Integrator::Dopri5,
        order,
        adaptive: false,
    };
    let mut families: Vec<Family> =
        [Integrator::Heun, Integrator::Rk4, Integrator::Dopri5, Integrator::Dop853].map(common).into();
    families.extend([1, 2].map(|order| coupled(MethodKind::CsPredict, order)));
    families.extend([1, 2].map(|order| coupled(MethodKind::CsPece, order)));
    families.extend([0, 1, 2].map(|order| coupled(MethodKind::Jacobi, order)));
    families.push(coupled(MethodKind::Seidel, 1));
    families.push(Family { name: "raw jacobi".into(), scene: raw, ..coupled(MethodKind::Jacobi, 1) });
    families
}

/// Carries out a study; `raw` is the scene with true forces in place of bias force and inertia.
///
/// # Errors
/// No reference; single points that fail are lines of the table.
pub fn study(
    scene: &Scene,
    raw: &Scene,
    options: &Options,
    progress: &mut dyn FnMut(f64),
) -> Result<Study, StudyError> {
    if scene.network.recorded.is_empty() {
        return Err(StudyError::NothingRecorded);
    }
    let choices = Choices {
        method: Some("common".into()),
        integrator: Some("dopri5".into()),
        ..options.choices.clone()
    };
    let base = Config::new(&scene.system, &choices)?;
    let interval = base.interval.unwrap_or((base.stop - base.start) / f64::from(INTERVALS));
    let base = Config { interval: Some(interval), ..base };
    let bench = Bench { base, interval, options, reference: reference_of(scene, &base, options)? };
    let families = families(scene, raw);
    let mut points = Vec::new();
    for (i, family) in families.iter().enumerate() {
        points.extend(bench.line(family));
        #[allow(clippy::cast_precision_loss, reason = "a dozen")]
        progress((i + 1) as f64 / families.len() as f64);
    }
    Ok(Study { scene: scene.system.name.clone(), reference: bench.reference.source, points })
}

/// The scene's file where it holds for the run, otherwise two runs that agree.
fn reference_of(scene: &Scene, base: &Config, options: &Options) -> Result<Reference, StudyError> {
    match &scene.system.settings.reference {
        // other parameters make another motion
        Some(file) if options.overrides.is_empty() => {
            Ok(Reference::file(&scene.package, file, options.references, FILE_ACCURACY)?)
        }
        _ => computed(scene, base, options.overrides),
    }
}

fn computed(scene: &Scene, base: &Config, overrides: &[Override]) -> Result<Reference, StudyError> {
    let run = |integrator: Integrator| {
        let tolerance = REFERENCE_TOLERANCE;
        let config = Config { integrator, rtol: tolerance, atol: tolerance, ..*base };
        let mut recorder = scene.recorder(&config);
        scene
            .run(&config, overrides, &mut recorder, &mut |_| ())
            .map_err(|e| StudyError::Failed(Box::new(e)))?;
        Ok::<_, StudyError>(recorder)
    };
    let (first, second) = (run(Integrator::Dop853)?, run(Integrator::Dopri5)?);
    let mut reference = Reference::recorded(&first, String::new(), AGREEMENT);
    let errors = reference.errors(&second, |name| nominal(scene, name))?;
    let worst = errors.into_iter().max_by(|a, b| a.largest.total_cmp(&b.largest));
    let (variable, difference) = worst.map_or((String::new(), 0.0), |e| (e.name, e.largest));
    if difference > AGREEMENT {
        return Err(StudyError::NoReference { variable, difference });
    }
    reference.source = format!("common dop853 and dopri5 at 1e-12, apart by {difference:.1e}");
    Ok(reference)
}

/// Typical magnitude of a recorded variable: the scene's, else the FMU's.
pub(crate) fn nominal(scene: &Scene, name: &str) -> f64 {
    let norm = scene.system.settings.norms.iter().find(|(variable, _)| variable == name);
    let of_fmu = || scene.network.find(name, "record").map_or(1.0, |(_, variable)| variable.nominal);
    norm.map_or_else(of_fmu, |(_, value)| *value)
}

/// What all points of a study share.
struct Bench<'a> {
    base: Config,
    interval: f64,
    options: &'a Options<'a>,
    reference: Reference,
}

impl Bench<'_> {
    /// All points of a method; one where the method cannot be applied at all.
    fn line(&self, family: &Family) -> Vec<Point> {
        let settings = if family.adaptive {
            TOLERANCES.to_vec()
        } else {
            STEPS.iter().map(|n| self.interval / f64::from(*n)).collect()
        };
        let mut points = Vec::new();
        for setting in settings {
            let mut point = Point { method: family.name.clone(), status: "ok".into(), ..Point::default() };
            let own = if family.adaptive { &mut point.rtol } else { &mut point.step };
            *own = Some(setting);
            let failed = self.measure(family, setting, &mut point).err();
            if let Some(error) = &failed {
                point.status = status(error);
            }
            points.push(point);
            if let Some(Error::Scene(_)) = failed {
                break;
            }
        }
        let order = fitted(&points, self.reference.accuracy);
        for point in &mut points {
            point.order = order;
        }
        points
    }

    fn configured(&self, family: &Family, setting: f64) -> Config {
        let Family { method, integrator, order, adaptive, .. } = *family;
        let base = self.base;
        let (step, rtol, atol) = if adaptive {
            (None, setting, setting * ABSOLUTE)
        } else {
            (Some(setting), base.rtol, base.atol)
        };
        Config { method, integrator, step, rtol, atol, order, ..base }
    }

    /// Parameters of the run: the user's stand last and win.
    fn overrides(&self, family: &Family, setting: f64) -> Vec<Override> {
        let has = |name: &str| {
            family.scene.network.nodes.iter().any(|n| n.fmu.description.variable(name).is_some())
        };
        let mut overrides = Vec::new();
        if family.method != MethodKind::Common && has(INNER[0]) && has(INNER[1]) {
            overrides.push((format!("*.{}", INNER[0]), ParameterValue::Item("rk4".into())));
            overrides.push((format!("*.{}", INNER[1]), ParameterValue::Real(setting)));
        }
        overrides.extend_from_slice(self.options.overrides);
        overrides
    }

    /// Errors from a run that records, times and counts from runs that do not.
    fn measure(&self, family: &Family, setting: f64, point: &mut Point) -> Result<(), Error> {
        let (scene, config) = (family.scene, self.configured(family, setting));
        let overrides = self.overrides(family, setting);
        let (audit, energies) = Audit::of(&scene.network);
        let counters = audit::offered(&scene.network, &INNER[2..]);
        let further: Vec<_> = energies.iter().chain(&counters).cloned().collect();
        let mut recorder = Recorder::new(&scene.network, &further, config.interval);
        let cost = scene.run(&config, &overrides, &mut recorder, &mut |_| ())?;
        let errors = self.reference.errors(&recorder, |name| nominal(scene, name));
        let errors = match errors {
            Ok(errors) => errors,
            Err(error) => {
                point.status = error.to_string();
                return Ok(());
            }
        };
        let first = scene.network.recorded.len();
        point.e_max = errors.iter().map(|e| e.largest).reduce(f64::max);
        point.e_rms = errors.iter().map(|e| e.rms).reduce(f64::max);
        point.energy = audit.balance(&recorder.rows, first);
        point.gap = (!scene.network.joints.is_empty()).then(|| recorder.gap());
        point.evaluations = Some(evaluations(&recorder, first + energies.len(), scene, &config, &cost));
        if self.options.runs == 0 {
            point.cost = Some(cost);
            return Ok(());
        }
        let times = timed(scene, &config, &overrides, self.options.runs)?;
        point.wall_min = Some(times.wall[0]);
        point.wall_median = Some(times.wall[times.wall.len() / 2]);
        point.cpu = Some(times.cpu[0]);
        point.real_time_factor = Some((config.stop - config.start) / times.wall[0]);
        point.cost = Some(times.cost);
        Ok(())
    }
}

fn status(error: &Error) -> String {
    let text = error.to_string();
    let line = text.split_whitespace().collect::<Vec<_>>().join(" ");
    match error {
        Error::Scene(_) => format!("not applicable: {line}"),
        Error::Run(RunError::NotFinite { t, .. }) => format!("diverged at t = {t:.4} s: {line}"),
        Error::Run(RunError::Diverged { .. }) => line,
        _ => format!("failed: {line}"),
    }
}

/// Right-hand sides of single components; `first` is the column of the first counter inside one.
fn evaluations(recorder: &Recorder, first: usize, scene: &Scene, config: &Config, cost: &Cost) -> u64 {
    if config.method == MethodKind::Common {
        return cost.steps.rhs_evaluations * scene.network.nodes.len() as u64;
    }
    // a restored component has forgotten the evaluations of the pass that was discarded
    let passes = if config.method == MethodKind::CsPece { 2 } else { 1 };
    let inside: f64 = recorder.rows.last().map_or(0.0, |row| row[first..].iter().sum());
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count")]
    let inside = inside as u64;
    passes * inside
}

/// Times in ascending order [s].
struct Times {
    wall: Vec<f64>,
    cpu: Vec<f64>,
    cost: Cost,
}

fn timed(scene: &Scene, config: &Config, overrides: &[Override], runs: u32) -> Result<Times, Error> {
    let once = || scene.run(config, overrides, &mut Recorder::off(), &mut |_| ());
    let cost = once()?;
    let (mut wall, mut cpu) = (Vec::new(), Vec::new());
    for _ in 0..runs {
        let (mut sum, mut busy, mut n) = (0.0, 0.0, 0.0);
        while n < 1.0 || (sum < LEAST_TIME && n < 1000.0) {
            let steps = once()?.steps;
            (sum, busy, n) = (sum + steps.seconds, busy + steps.cpu, n + 1.0);
        }
        wall.push(sum / n);
        cpu.push(busy / n);
    }
    wall.sort_by(f64::total_cmp);
    cpu.sort_by(f64::total_cmp);
    Ok(Times { wall, cpu, cost })
}

/// Slope of log error over log step, of the three smallest steps with errors above the reference's own; a step of a method
/// with step control is the mean one.
fn fitted(points: &[Point], accuracy: f64) -> Option<f64> {
    #[allow(clippy::cast_precision_loss, reason = "a count")]
    let size = |p: &Point| p.step.or_else(|| p.cost.as_ref().map(|c| 1.0 / c.steps.accepted as f64));
    let good = |p: &Point| Some((size(p)?, p.e_max.filter(|e| *e > accuracy && *e < 1.0)?));
    let mut usable: Vec<(f64, f64)> = points.iter().filter_map(good).collect();
    usable.sort_by(|a, b| a.0.total_cmp(&b.0));
    let last: Vec<(f64, f64)> = usable.get(..3)?.iter().map(|(h, e)| (h.log10(), e.log10())).collect();
    let (x, y) = last.iter().fold((0.0, 0.0), |(x, y), p| (x + p.0 / 3.0, y + p.1 / 3.0));
    let (xy, xx) =
        last.iter().fold((0.0, 0.0), |(xy, xx), p| (xy + (p.0 - x) * (p.1 - y), xx + (p.0 - x).powi(2)));
    Some(xy / xx)
}
