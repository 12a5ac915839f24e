//! Explicit methods.

use super::control::{Attempt, Norm, Sizes, Start};
use super::table::{Errors, Extension, Row, Table};
use super::{DynamicOde, all_finite, rhs};
use crate::dop853;
use crate::pace::SAFETY;
use crate::{Settings, Statistics, StepError};
use serde::{Deserialize, Serialize};

/// Takes single steps of an explicit method.
pub(super) struct ExplicitSolver {
    adaptive: bool,
    norm: Norm,
    sizes: Sizes,
    pub(super) statistics: Statistics,
    trials: Trials,
    /// Stages of steps repeated with another length
    again: Vec<Vec<f64>>,
}

/// What is changed by a trial.
struct Trials {
    table: Table,
    step: LastStep,
    scratch: Vec<f64>,
    parts: Vec<f64>,
}

/// What an [`ExplicitSolver`] remembers.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct ExplicitState {
    sizes: Sizes,
    statistics: Statistics,
    step: LastStep,
}

/// The step taken last.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct LastStep {
    t: f64,
    h: f64,
    t_end: f64,
    x: Vec<f64>,
    end: Vec<f64>,
    /// Stages, and in the last row room for the slope at the end
    k: Vec<Vec<f64>>,
    /// The slope at the end is in this stage
    slope: Option<usize>,
    extended: bool,
}

/// `h sum_j weights_j k_j` into `out`
fn combine(h: f64, weights: &[(usize, f64)], k: &[Vec<f64>], out: &mut [f64]) {
    for (i, out) in out.iter_mut().enumerate() {
        *out = h * weights.iter().fold(0.0, |sum, &(j, w)| sum + w * k[j][i]);
    }
}

/// `x + h sum_j weights_j k_j` into `out`
fn moved(x: &[f64], h: f64, weights: &[(usize, f64)], k: &[Vec<f64>], out: &mut [f64]) {
    combine(h, weights, k, out);
    for (out, x) in out.iter_mut().zip(x) {
        *out += x;
    }
}

impl ExplicitSolver {
    /// A solver without a past; None for other methods.
    pub(super) fn new(settings: &Settings, nominal: &[f64]) -> Option<Self> {
        let table = Table::of(settings.method)?;
        let n = nominal.len();
        let step = LastStep {
            t: 0.0,
            h: 0.0,
            t_end: 0.0,
            x: vec![0.0; n],
            end: vec![0.0; n],
            k: vec![vec![0.0; n]; table.all_stages() + 1],
            slope: None,
            extended: false,
        };
        Some(Self {
            adaptive: settings.method.is_adaptive(),
            norm: Norm::new(settings, settings.rtol, nominal.to_vec()),
            sizes: Sizes::default(),
            statistics: Statistics::default(),
            again: vec![vec![0.0; n]; table.stages()],
            trials: Trials { table, step, scratch: vec![0.0; n], parts: vec![0.0; n] },
        })
    }

    pub(super) fn is_adaptive(&self) -> bool {
        self.adaptive
    }

    pub(super) fn save(&self) -> ExplicitState {
        ExplicitState { sizes: self.sizes, statistics: self.statistics, step: self.trials.step.clone() }
    }

    pub(super) fn restore(&mut self, state: &ExplicitState) {
        (self.sizes, self.statistics) = (state.sizes, state.statistics);
        self.trials.step.clone_from(&state.step);
    }

    pub(super) fn fits(&self, state: &ExplicitState) -> bool {
        let n = self.norm.nominal.len();
        let LastStep { x, end, k, slope, .. } = &state.step;
        x.len() == n
            && end.len() == n
            && k.len() == self.trials.step.k.len()
            && k.iter().all(|stage| stage.len() == n)
            && slope.is_none_or(|stage| stage < k.len())
    }

    pub(super) fn restart(&mut self) {
        self.sizes = Sizes::default();
        self.changed();
    }

    pub(super) fn changed(&mut self) {
        self.trials.step.slope = None;
    }

    pub(super) fn step<O: DynamicOde>(
        &mut self,
        ode: &mut O,
        t: f64,
        x: &[f64],
        t_end: f64,
    ) -> Result<f64, StepError<O::Error>> {
        self.begin(ode, t, x)?;
        let Self { norm, sizes, statistics, trials, .. } = self;
        let reached = if self.adaptive {
            let pace = trials.table.pace;
            let from = Start { t, x, slope: &trials.step.k[0] };
            sizes.guess(ode, from, t_end - t, (norm, pace), statistics);
            let trial = |statistics: &mut Statistics, h: f64, _fresh: bool| {
                trials.trial(ode, h, statistics)?;
                Ok(trials.judged(norm))
            };
            let accepted = sizes.accepted([t, t_end], pace, statistics, trial)?;
            sizes.note(&accepted, pace, |_| false);
            let h = accepted.now.h;
            if h >= t_end - t { t_end } else { t + h }
        } else {
            trials.trial(ode, t_end - t, statistics)?;
            t_end
        };
        self.statistics.steps += 1;
        self.trials.step.t_end = reached;
        Ok(reached)
    }

    pub(super) fn state(&self) -> &[f64] {
        &self.trials.step.end
    }

    pub(super) fn slope<O: DynamicOde>(&mut self, ode: &mut O) -> Result<&[f64], StepError<O::Error>> {
        let Self { trials: Trials { step, .. }, statistics, .. } = self;
        let spare = step.k.len() - 1;
        let stage = match step.slope {
            Some(stage) => stage,
            None => rhs(ode, step.t_end, &step.end, &mut step.k[spare], statistics).map(|()| spare)?,
        };
        step.slope = Some(stage);
        Ok(&step.k[stage])
    }

    pub(super) fn interval(&self) -> (f64, f64) {
        (self.trials.step.t, self.trials.step.h)
    }

    pub(super) fn inside<O: DynamicOde>(
        &mut self,
        ode: &mut O,
        theta: f64,
        out: &mut [f64],
    ) -> Result<(), StepError<O::Error>> {
        let Self { trials, statistics, .. } = self;
        match &trials.table.extension {
            Extension::Powers(dense) => {
                let weights: Row = dense
                    .iter()
                    .map(|d| d.iter().rev().fold(0.0, |sum, d| theta * (sum + d)))
                    .enumerate()
                    .collect();
                moved(&trials.step.x, trials.step.h, &weights, &trials.step.k, out);
            }
            Extension::Dop853 => {
                trials.extend(ode, statistics)?;
                trials.step.inside_dop853(theta, out);
            }
        }
        Ok(())
    }

    pub(super) fn repeat<O: DynamicOde>(
        &mut self,
        ode: &mut O,
        theta: f64,
        out: &mut [f64],
    ) -> Result<(), StepError<O::Error>> {
        let Self { trials: Trials { table, step, scratch, .. }, again, statistics, .. } = self;
        let h = theta * step.h;
        again[0].copy_from_slice(&step.k[0]);
        stages(table, ode, (step.t, &step.x, h), again, scratch, statistics)?;
        finish(table, (&step.x, h), again, scratch, out);
        all_finite(step.t + h, out)
    }

    /// Where the step begins, with its slope.
    fn begin<O: DynamicOde>(&mut self, ode: &mut O, t: f64, x: &[f64]) -> Result<(), StepError<O::Error>> {
        let Self { trials: Trials { step, .. }, statistics, .. } = self;
        match step.slope.take() {
            Some(stage) => step.k.swap(0, stage),
            None => rhs(ode, t, x, &mut step.k[0], statistics)?,
        }
        step.t = t;
        step.x.copy_from_slice(x);
        if self.adaptive { all_finite(t, &step.k[0]) } else { Ok(()) }
    }
}

impl Trials {
    /// One step of length `h` from the start.
    fn trial<O: DynamicOde>(
        &mut self,
        ode: &mut O,
        h: f64,
        statistics: &mut Statistics,
    ) -> Result<(), StepError<O::Error>> {
        let Self { table, step, scratch, .. } = self;
        step.h = h;
        step.extended = false;
        step.slope = None;
        stages(table, ode, (step.t, &step.x, h), &mut step.k, scratch, statistics)?;
        finish(table, (&step.x, h), &step.k, scratch, &mut step.end);
        all_finite(step.t + h, &step.end)?;
        step.slope = table.first_same_as_last.then(|| table.stages() - 1);
        Ok(())
    }

    /// Error of the trial; a slope at an end that does not count is forgotten.
    fn judged(&mut self, norm: &Norm) -> Attempt {
        let error = self.error(norm);
        let LastStep { x, end, slope, .. } = &mut self.step;
        if error <= 1.0 {
            return Attempt { error, safety: SAFETY, worst: 0 };
        }
        *slope = None;
        Attempt { error, safety: SAFETY, worst: norm.worst(&self.parts, x, end) }
    }

    /// Local error of the trial in units of the tolerance.
    fn error(&mut self, norm: &Norm) -> f64 {
        let Self { table, step, parts, scratch } = self;
        match &table.errors {
            Errors::None => 0.0,
            Errors::Embedded(weights) => {
                combine(step.h, weights, &step.k, parts);
                norm.of(parts, &step.x, &step.end)
            }
            Errors::Two(fifth, third) => {
                combine(step.h, third, &step.k, scratch);
                for (i, s) in scratch.iter_mut().enumerate() {
                    *s = step.end[i] - step.x[i] - *s;
                }
                combine(step.h, fifth, &step.k, parts);
                dop853::joined(norm.of(parts, &step.x, &step.end), norm.of(scratch, &step.x, &step.end))
            }
        }
    }

    /// Stages 13 to 16 of Dop853.
    fn extend<O: DynamicOde>(
        &mut self,
        ode: &mut O,
        statistics: &mut Statistics,
    ) -> Result<(), StepError<O::Error>> {
        let Self { step, scratch, .. } = self;
        if step.extended {
            return Ok(());
        }
        let first = dop853::STAGES;
        match step.slope {
            Some(stage) => step.k[first] = step.k[stage].clone(),
            None => rhs(ode, step.t_end, &step.end, &mut step.k[first], statistics)?,
        }
        for (i, (row, c)) in dop853::A_DENSE.iter().zip(dop853::C_DENSE).enumerate() {
            moved(&step.x, step.h, row, &step.k, scratch);
            rhs(ode, step.t + c * step.h, scratch, &mut step.k[first + 1 + i], statistics)?;
        }
        step.extended = true;
        Ok(())
    }
}

impl LastStep {
    fn inside_dop853(&self, theta: f64, out: &mut [f64]) {
        let Self { h, x, end, k, .. } = self;
        for (i, out) in out.iter_mut().enumerate() {
            let term = |row: dop853::Row| [h * row.iter().fold(0.0, |sum, &(j, w)| sum + w * k[j][i])];
            let change = end[i] - x[i];
            let f_2 = h * k[0][i] - change;
            let f_3 = 2.0 * change - h * (k[0][i] + k[dop853::STAGES][i]);
            let [f_4, f_5, f_6, f_7] = dop853::D.map(term);
            let powers = dop853::powers_of_theta(&[[change], [f_2], [f_3], f_4, f_5, f_6, f_7]);
            *out = x[i] + powers.iter().rev().fold(0.0, |sum, p| theta * (sum + p[0]));
        }
    }
}

/// All stages after the first; `scratch` ends with the state of the last one.
fn stages<O: DynamicOde>(
    table: &Table,
    ode: &mut O,
    (t, x, h): (f64, &[f64], f64),
    k: &mut [Vec<f64>],
    scratch: &mut [f64],
    statistics: &mut Statistics,
) -> Result<(), StepError<O::Error>> {
    for (i, row) in table.a.iter().enumerate() {
        moved(x, h, row, k, scratch);
        rhs(ode, t + table.c[i + 1] * h, scratch, &mut k[i + 1], statistics)?;
    }
    Ok(())
}

fn finish(table: &Table, (x, h): (&[f64], f64), k: &[Vec<f64>], scratch: &[f64], out: &mut [f64]) {
    if table.first_same_as_last {
        out.copy_from_slice(scratch);
    } else {
        moved(x, h, &table.b, k, out);
    }
}
