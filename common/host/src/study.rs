//! Work-precision studies: error over run time for methods and steps.
//!
//! ```text
//! reference  method common, dop853 and dopri5 at rtol = atol = 1e-12, which must agree to 1e-9 of the scale
//! e_max      max_k |y(t_k) - ref(t_k)| / s,  s = max(max_k |ref|, nominal);  201 equal samples; largest of all variables
//! seconds    of the step loop alone, without recording; one run dropped, then the smallest and the median of the others
//! ```

use integrators::Method as Integrator;
use serde::Serialize;

use crate::error::Error;
use crate::methods::{Choices, Config, MethodKind, Steps, integrator_name};
use crate::record::Recorder;
use crate::run::{Cost, Scene};
use crate::scene::{Override, SceneError};

/// Intervals between samples.
const INTERVALS: u32 = 200;
/// Steps per sample interval of the methods with fixed steps.
const STEPS: [u32; 6] = [1, 2, 4, 8, 16, 32];
/// Tolerances of the methods with step control.
const TOLERANCES: [f64; 7] = [1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9];
/// Tolerance of the reference.
const REFERENCE_TOLERANCE: f64 = 1e-12;
/// Agreement of the two references, relative to the scale.
const AGREEMENT: f64 = 1e-9;
/// Errors below do not count for the order: rounding and the reference.
const SATURATED: f64 = 1e-9;
/// Runs shorter than this are repeated inside one measurement [s].
const LEAST_TIME: f64 = 0.05;

/// Why there is no study.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// The scene or its settings
    #[error(transparent)]
    Scene(Box<SceneError>),
    /// Nothing to compare
    #[error("the scene records no variables")]
    NothingRecorded,
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

/// One line of the table.
#[derive(Clone, Debug, Serialize)]
pub struct Point {
    /// Method with its order or integrator
    pub method: String,
    /// Step [s], or tolerance
    pub setting: f64,
    /// Largest error
    pub e_max: Option<f64>,
    /// Root of the mean square error, of the worst variable
    pub e_rms: Option<f64>,
    /// Largest gap of closing joints [m]
    pub gap: f64,
    /// Smallest time [s]
    pub seconds_min: Option<f64>,
    /// Median time [s]
    pub seconds_median: Option<f64>,
    /// Simulated time over the smallest run time
    pub real_time_factor: Option<f64>,
    /// Right-hand sides
    pub rhs_evaluations: u64,
    /// Communication steps of all FMUs
    pub do_steps: u64,
    /// FMI calls
    pub calls: u64,
    /// Steps rejected
    pub rejected: u64,
    /// ok, or why not
    pub status: String,
}

/// Fitted order of one method.
#[derive(Clone, Debug, Serialize)]
pub struct Order {
    /// Method
    pub method: String,
    /// Slope of log error over log step
    pub order: f64,
}

/// A whole study.
#[derive(Clone, Debug, Serialize)]
pub struct Study {
    /// Scene
    pub scene: String,
    /// Agreement of the two references relative to the scale
    pub reference_agreement: f64,
    /// All points
    pub points: Vec<Point>,
    /// Orders of the methods with fixed steps
    pub orders: Vec<Order>,
}

/// A method with its variation.
struct Family {
    name: String,
    method: MethodKind,
    integrator: Integrator,
    order: i64,
    adaptive: bool,
}

fn families(scene: &Scene) -> Vec<Family> {
    let common = |integrator: Integrator| Family {
        name: format!("common {}", integrator_name(integrator)),
        method: MethodKind::Common,
        integrator,
        order: 1,
        adaptive: integrator.is_adaptive(),
    };
    let coupled = |method: MethodKind, order: i64| Family {
        name: format!("{} order {order}", method.name()),
        method,
        integrator: Integrator::Dopri5,
        order,
        adaptive: false,
    };
    let mut families = vec![common(Integrator::Heun), common(Integrator::Rk4), common(Integrator::Dopri5)];
    families.push(common(Integrator::Dop853));
    families.extend([1, 2].map(|order| coupled(MethodKind::CsPredict, order)));
    families.extend([1, 2].map(|order| coupled(MethodKind::CsPece, order)));
    if scene.network.joints.is_empty() {
        families.extend([0, 1, 2].map(|order| coupled(MethodKind::Jacobi, order)));
    }
    families
}

struct Reference {
    rows: Vec<Vec<f64>>,
    scale: Vec<f64>,
    agreement: f64,
}

/// Carries out a study.
///
/// # Errors
/// No reference; single points that fail are lines of the table.
pub fn study(
    scene: &Scene,
    choices: &Choices,
    overrides: &[Override],
    runs: u32,
    progress: &mut dyn FnMut(f64),
) -> Result<Study, StudyError> {
    let base = Config::new(
        &scene.system,
        &Choices { method: Some("common".into()), integrator: Some("dopri5".into()), ..choices.clone() },
    )?;
    let base = Config { interval: Some((base.stop - base.start) / f64::from(INTERVALS)), ..base };
    let reference = reference(scene, &base, overrides)?;
    let families = families(scene);
    let mut points = Vec::new();
    let mut orders = Vec::new();
    for (i, family) in families.iter().enumerate() {
        let mut line = Vec::new();
        for setting in settings(family, &base) {
            line.push(point(scene, family, setting, &base, overrides, &reference, runs));
        }
        if let (false, Some(order)) = (family.adaptive, fitted(&line)) {
            orders.push(Order { method: family.name.clone(), order });
        }
        points.extend(line);
        #[allow(clippy::cast_precision_loss, reason = "a dozen")]
        progress((i + 1) as f64 / families.len() as f64);
    }
    Ok(Study { scene: scene.system.name.clone(), reference_agreement: reference.agreement, points, orders })
}

fn settings(family: &Family, base: &Config) -> Vec<f64> {
    if family.adaptive {
        return TOLERANCES.to_vec();
    }
    let interval = (base.stop - base.start) / f64::from(INTERVALS);
    STEPS.iter().map(|n| interval / f64::from(*n)).collect()
}

fn configured(family: &Family, setting: f64, base: &Config) -> Config {
    let Family { method, integrator, order, adaptive, .. } = *family;
    let (step, rtol, atol) =
        if adaptive { (None, setting, setting) } else { (Some(setting), base.rtol, base.atol) };
    Config { method, integrator, step, rtol, atol, order, ..*base }
}

fn reference(scene: &Scene, base: &Config, overrides: &[Override]) -> Result<Reference, StudyError> {
    if scene.network.recorded.is_empty() {
        return Err(StudyError::NothingRecorded);
    }
    let run = |integrator: Integrator| {
        let tolerance = REFERENCE_TOLERANCE;
        let config = Config { integrator, rtol: tolerance, atol: tolerance, ..*base };
        let mut recorder = scene.recorder(&config);
        scene
            .run(&config, overrides, &mut recorder, &mut |_| ())
            .map_err(|e| StudyError::Failed(Box::new(e)))?;
        Ok::<_, StudyError>(recorder.rows)
    };
    let (rows, second) = (run(Integrator::Dop853)?, run(Integrator::Dopri5)?);
    let nominal = scene
        .network
        .recorded
        .iter()
        .map(|r| scene.network.find(&r.name, "").map_or(1.0, |(_, variable)| variable.nominal));
    let largest = |column: usize| rows.iter().fold(0.0_f64, |m, row| m.max(row[column].abs()));
    let scale: Vec<f64> = nominal.enumerate().map(|(column, n)| largest(column).max(n)).collect();
    let mut reference = Reference { rows, scale, agreement: 0.0 };
    let (differences, _) = errors(&second, &reference);
    let worst =
        (0..differences.len()).max_by(|&i, &j| differences[i].total_cmp(&differences[j])).unwrap_or(0);
    reference.agreement = differences[worst];
    if differences[worst] > AGREEMENT {
        let variable = scene.network.recorded[worst].name.clone();
        return Err(StudyError::NoReference { variable, difference: differences[worst] });
    }
    Ok(reference)
}

/// Largest and root mean square error of each variable.
fn errors(rows: &[Vec<f64>], reference: &Reference) -> (Vec<f64>, Vec<f64>) {
    let column = |column: usize| {
        let difference = |(row, exact): (&Vec<f64>, &Vec<f64>)| {
            (row[column] - exact[column]).abs() / reference.scale[column]
        };
        let all: Vec<f64> = rows.iter().zip(&reference.rows).map(difference).collect();
        let largest = all.iter().fold(0.0_f64, |m, e| m.max(*e));
        #[allow(clippy::cast_precision_loss, reason = "201 samples")]
        let mean = all.iter().map(|e| e * e).sum::<f64>() / all.len() as f64;
        (largest, mean.sqrt())
    };
    (0..reference.scale.len()).map(column).unzip()
}

fn point(
    scene: &Scene,
    family: &Family,
    setting: f64,
    base: &Config,
    overrides: &[Override],
    reference: &Reference,
    runs: u32,
) -> Point {
    let config = configured(family, setting, base);
    let mut recorder = scene.recorder(&config);
    let result = scene.run(&config, overrides, &mut recorder, &mut |_| ());
    let mut point = Point {
        method: family.name.clone(),
        setting,
        e_max: None,
        e_rms: None,
        gap: recorder.gap(),
        seconds_min: None,
        seconds_median: None,
        real_time_factor: None,
        rhs_evaluations: 0,
        do_steps: 0,
        calls: 0,
        rejected: 0,
        status: "ok".into(),
    };
    let cost = match result {
        Ok(cost) => cost,
        Err(error) => {
            let last = recorder.times.last().copied().unwrap_or(config.start);
            point.status = format!("diverged after t = {last}: {}", first_line(&error));
            return point;
        }
    };
    let worst = |errors: &[f64]| errors.iter().fold(0.0_f64, |m, e| m.max(*e));
    let (largest, rms) = errors(&recorder.rows, reference);
    (point.e_max, point.e_rms) = (Some(worst(&largest)), Some(worst(&rms)));
    (point.rhs_evaluations, point.rejected) = (cost.steps.rhs_evaluations, cost.steps.rejected);
    (point.do_steps, point.calls) = (cost.calls.do_step, cost.calls.total());
    match timed(scene, &config, overrides, runs) {
        Ok((least, median)) => {
            (point.seconds_min, point.seconds_median) = (Some(least), Some(median));
            point.real_time_factor = Some((config.stop - config.start) / least);
        }
        Err(error) => point.status = first_line(&error),
    }
    point
}

fn first_line(error: &Error) -> String {
    error.to_string().lines().next().unwrap_or_default().to_owned()
}

/// Smallest and median time of the step loop [s].
fn timed(scene: &Scene, config: &Config, overrides: &[Override], runs: u32) -> Result<(f64, f64), Error> {
    let once = || -> Result<f64, Error> {
        let Cost { steps: Steps { seconds, .. }, .. } =
            scene.run(config, overrides, &mut Recorder::off(), &mut |_| ())?;
        Ok(seconds)
    };
    let warm = once()?;
    let repeats = (LEAST_TIME / f64::from(runs.max(1)) / warm.max(1e-9)).ceil().clamp(1.0, 1000.0);
    let mut times = Vec::new();
    for _ in 0..runs.max(1) {
        let mut sum = 0.0;
        let mut n = 0.0;
        while n < repeats {
            sum += once()?;
            n += 1.0;
        }
        times.push(sum / n);
    }
    times.sort_by(f64::total_cmp);
    Ok((times[0], times[times.len() / 2]))
}

/// Slope of the last three points above the level of rounding.
fn fitted(points: &[Point]) -> Option<f64> {
    let good: Vec<(f64, f64)> = points
        .iter()
        .filter_map(|p| p.e_max.filter(|e| *e > SATURATED).map(|e| (p.setting.log10(), e.log10())))
        .collect();
    let last = good.get(good.len().checked_sub(3)?..)?;
    let (x, y) = last.iter().fold((0.0, 0.0), |(x, y), p| (x + p.0 / 3.0, y + p.1 / 3.0));
    let (xy, xx) =
        last.iter().fold((0.0, 0.0), |(xy, xx), p| (xy + (p.0 - x) * (p.1 - y), xx + (p.0 - x).powi(2)));
    Some(xy / xx)
}
