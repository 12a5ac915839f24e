//! Explicit methods for systems whose number of states is known only at run time, one step per call.
//!
//! The tables, the error norm and the control of the step size are those of the solvers of fixed size. A host takes a
//! step, looks at it (dense output, repetition with a shorter length), and takes the next one.

mod table;

use crate::dop853;
use crate::error::SettingsError;
use crate::first_step;
use crate::norm::{counted, scaled};
use crate::pace::{LEAST_ERROR, RESOLUTION, SAFETY, SHRINK, Taken, fit};
use crate::solver::Memory;
use crate::{Method, Settings, Statistics, StepError};
use serde::{Deserialize, Serialize};
use table::{Errors, Extension, Row, Table};

/// An initial value problem `x' = f(t, x)` of any size.
pub trait DynamicOde {
    /// Why the right-hand side may fail.
    type Error;

    /// `f(t, x)` into `dx`.
    ///
    /// # Errors
    /// Where the model has no value; see [`Ode::rhs`](crate::Ode::rhs).
    fn rhs(&mut self, t: f64, x: &[f64], dx: &mut [f64]) -> Result<(), Self::Error>;
}

/// Why there is no solver.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum NotExplicit {
    /// The method is not explicit.
    #[error("{0:?} is not an explicit method: heun, rk4, dopri5 and dop853 are")]
    Method(Method),
    /// A setting that no method can work with.
    #[error(transparent)]
    Settings(#[from] SettingsError),
}

/// Takes single steps of an explicit method.
pub struct ExplicitSolver {
    table: Table,
    tolerances: [f64; 2],
    adaptive: bool,
    nominal: Vec<f64>,
    counted: f64,
    memory: Memory,
    before: Option<Taken>,
    /// Counters since the start.
    pub statistics: Statistics,
    step: LastStep,
    /// Stages of steps repeated with another length
    again: Vec<Vec<f64>>,
    scratch: Vec<f64>,
    parts: Vec<f64>,
}

/// What an [`ExplicitSolver`] remembers: with it a run goes on bit by bit as if it had not been interrupted.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ExplicitState {
    memory: Memory,
    before: Option<Taken>,
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

fn all_finite<E>(t: f64, values: &[f64]) -> Result<(), StepError<E>> {
    match values.iter().position(|v| !v.is_finite()) {
        None => Ok(()),
        Some(index) => Err(StepError::NotFinite { t, index, value: values[index] }),
    }
}

impl ExplicitSolver {
    /// A solver without a past for as many states as there are nominal values.
    ///
    /// # Errors
    /// An implicit method, a step size or tolerance that is not finite and positive.
    pub fn new(settings: Settings, nominal: Vec<f64>) -> Result<Self, NotExplicit> {
        let settings = settings.check()?;
        let table = Table::of(settings.method).ok_or(NotExplicit::Method(settings.method))?;
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
        Ok(Self {
            tolerances: [settings.rtol, settings.atol],
            adaptive: settings.method.is_adaptive(),
            counted: counted(&nominal),
            nominal,
            memory: Memory::default(),
            before: None,
            statistics: Statistics::default(),
            step,
            again: vec![vec![0.0; n]; table.stages()],
            scratch: vec![0.0; n],
            parts: vec![0.0; n],
            table,
        })
    }

    /// Whether the method chooses its own step size.
    #[must_use]
    pub fn is_adaptive(&self) -> bool {
        self.adaptive
    }

    /// What the solver remembers.
    #[must_use]
    pub fn save(&self) -> ExplicitState {
        let Self { memory, before, statistics, step, .. } = self;
        ExplicitState { memory: *memory, before: *before, statistics: *statistics, step: step.clone() }
    }

    /// Goes on from what a solver with the same settings has remembered.
    pub fn restore(&mut self, state: &ExplicitState) {
        (self.memory, self.before, self.statistics) = (state.memory, state.before, state.statistics);
        self.step.clone_from(&state.step);
    }

    /// Whether a state has the sizes of this solver.
    #[must_use]
    pub fn fits(&self, state: &ExplicitState) -> bool {
        let n = self.nominal.len();
        let LastStep { x, end, k, slope, .. } = &state.step;
        x.len() == n
            && end.len() == n
            && k.len() == self.step.k.len()
            && k.iter().all(|stage| stage.len() == n)
            && slope.is_none_or(|stage| stage < k.len())
    }

    /// Forgets step size and slope: after a jump of the state or of an input.
    pub fn restart(&mut self) {
        self.memory = Memory::default();
        self.before = None;
        self.step.slope = None;
    }

    /// Forgets the slope at the end: after the state was changed a little.
    pub fn changed(&mut self) {
        self.step.slope = None;
    }

    /// One step from `(t, x)`: a fixed-step method goes to `t_end`, an adaptive one not beyond it. The result is the time
    /// reached, the state there is [`state`](Self::state).
    ///
    /// # Errors
    /// See [`StepError`].
    pub fn step<O: DynamicOde>(
        &mut self,
        ode: &mut O,
        t: f64,
        x: &[f64],
        t_end: f64,
    ) -> Result<f64, StepError<O::Error>> {
        if !(t.is_finite() && t_end.is_finite() && t < t_end) {
            return Err(StepError::Interval { t, t_end });
        }
        self.begin(ode, t, x)?;
        let remaining = t_end - t;
        let reached = if self.adaptive {
            self.adapted(ode, t, t_end, remaining)?
        } else {
            self.trial(ode, remaining)?;
            t_end
        };
        self.statistics.steps += 1;
        self.step.t_end = reached;
        Ok(reached)
    }

    /// State at the end of the last step.
    #[must_use]
    pub fn state(&self) -> &[f64] {
        &self.step.end
    }

    /// Slope at the end of the last step, evaluated if it is not known; the next step begins with it.
    ///
    /// Afterwards the last evaluation was one at the end, unless others came in between.
    ///
    /// # Errors
    /// Those of the right-hand side.
    pub fn slope<O: DynamicOde>(&mut self, ode: &mut O) -> Result<&[f64], StepError<O::Error>> {
        let Self { step, statistics, .. } = self;
        let spare = step.k.len() - 1;
        let stage = match step.slope {
            Some(stage) => stage,
            None => rhs(ode, step.t_end, &step.end, &mut step.k[spare], statistics).map(|()| spare)?,
        };
        step.slope = Some(stage);
        Ok(&step.k[stage])
    }

    /// Start and length of the last step [s].
    #[must_use]
    pub fn interval(&self) -> (f64, f64) {
        (self.step.t, self.step.h)
    }

    /// State inside the last step at the fraction `theta`, see [`Dense`](crate::Dense).
    ///
    /// # Errors
    /// Those of the right-hand side: Dop853 needs further stages.
    pub fn inside<O: DynamicOde>(
        &mut self,
        ode: &mut O,
        theta: f64,
        out: &mut [f64],
    ) -> Result<(), StepError<O::Error>> {
        match &self.table.extension {
            Extension::Powers(dense) => {
                let weights: Row = dense
                    .iter()
                    .map(|d| d.iter().rev().fold(0.0, |sum, d| theta * (sum + d)))
                    .enumerate()
                    .collect();
                moved(&self.step.x, self.step.h, &weights, &self.step.k, out);
            }
            Extension::Dop853 => {
                self.extend(ode)?;
                self.inside_dop853(theta, out);
            }
        }
        Ok(())
    }

    /// State at the end of the last step repeated with the length `theta h`.
    ///
    /// # Errors
    /// As [`step`](Self::step).
    pub fn repeat<O: DynamicOde>(
        &mut self,
        ode: &mut O,
        theta: f64,
        out: &mut [f64],
    ) -> Result<(), StepError<O::Error>> {
        let Self { table, step, again, statistics, scratch, .. } = self;
        let h = theta * step.h;
        again[0].copy_from_slice(&step.k[0]);
        stages(table, ode, (step.t, &step.x, h), again, scratch, statistics)?;
        finish(table, (&step.x, h), again, scratch, out);
        all_finite(step.t + h, out)
    }

    /// Where the step begins, with its slope.
    fn begin<O: DynamicOde>(&mut self, ode: &mut O, t: f64, x: &[f64]) -> Result<(), StepError<O::Error>> {
        let Self { step, statistics, .. } = self;
        match step.slope.take() {
            Some(stage) => step.k.swap(0, stage),
            None => rhs(ode, t, x, &mut step.k[0], statistics)?,
        }
        step.t = t;
        step.x.copy_from_slice(x);
        if self.adaptive { all_finite(t, &self.step.k[0]) } else { Ok(()) }
    }

    /// One step of length `h` from the start.
    fn trial<O: DynamicOde>(&mut self, ode: &mut O, h: f64) -> Result<(), StepError<O::Error>> {
        let Self { table, step, statistics, scratch, .. } = self;
        step.h = h;
        step.extended = false;
        stages(table, ode, (step.t, &step.x, h), &mut step.k, scratch, statistics)?;
        finish(table, (&step.x, h), &step.k, scratch, &mut step.end);
        step.slope = table.first_same_as_last.then(|| table.stages() - 1);
        all_finite(step.t + h, &step.end)
    }

    fn adapted<O: DynamicOde>(
        &mut self,
        ode: &mut O,
        t: f64,
        t_end: f64,
        remaining: f64,
    ) -> Result<f64, StepError<O::Error>> {
        if self.memory.step <= 0.0 {
            self.memory.step = self.first_step(ode, remaining);
        }
        let min = RESOLUTION * t.abs().max(t_end.abs());
        let wanted = self.memory.step.max(min);
        let (now, rejected) = self.accepted(ode, fit(wanted, remaining), (t, min))?;
        let pace = self.table.pace;
        let mut growth = pace.next(SAFETY, now, self.memory.error, self.before);
        if rejected {
            growth = growth.min(1.0);
        }
        let mut next = now.h * growth;
        if !rejected && next >= now.h {
            next = next.max(wanted); // cut short by the end of the call, not by its error
        }
        self.memory = Memory { step: next, error: now.error.max(LEAST_ERROR) };
        self.before = Some(now);
        Ok(if now.h >= remaining { t_end } else { t + now.h })
    }

    /// Tries `h` and shorter steps until one keeps the tolerance.
    fn accepted<O: DynamicOde>(
        &mut self,
        ode: &mut O,
        mut h: f64,
        (t, min): (f64, f64),
    ) -> Result<(Taken, bool), StepError<O::Error>> {
        let mut rejected = false;
        loop {
            let (shorter, reason) = match self.trial(ode, h) {
                Ok(()) => {
                    let error = self.error();
                    if error <= 1.0 {
                        return Ok((Taken { h, error }, rejected));
                    }
                    let pace = self.table.pace;
                    #[allow(
                        clippy::manual_clamp,
                        reason = "clamp would pass on an error that is not a number"
                    )]
                    let shorter = h * pace.factor(SAFETY, error).max(pace.shrink).min(SAFETY);
                    (shorter, StepError::StepTooSmall { t, h: shorter, min, index: self.worst() })
                }
                Err(reason) => (h * SHRINK, reason),
            };
            self.step.slope = None;
            rejected = true;
            self.statistics.rejected += 1;
            if shorter < min {
                return Err(reason);
            }
            h = shorter;
        }
    }

    /// Local error of the trial in units of the tolerance.
    fn error(&mut self) -> f64 {
        let Self { table, step, parts, scratch, .. } = self;
        match &table.errors {
            Errors::None => 0.0,
            Errors::Embedded(weights) => {
                combine(step.h, weights, &step.k, parts);
                self.size(&self.parts)
            }
            Errors::Two(fifth, third) => {
                combine(step.h, third, &step.k, scratch);
                for (i, s) in scratch.iter_mut().enumerate() {
                    *s = step.end[i] - step.x[i] - *s;
                }
                combine(step.h, fifth, &step.k, parts);
                dop853::joined(self.size(&self.parts), self.size(&self.scratch))
            }
        }
    }

    fn magnitude(&self, i: usize) -> f64 {
        self.step.x[i].abs().max(self.step.end[i].abs())
    }

    /// Size of `values` against the larger of the two states of the step.
    fn size(&self, values: &[f64]) -> f64 {
        self.norm(values, |i| self.magnitude(i))
    }

    fn norm(&self, values: &[f64], magnitude: impl Fn(usize) -> f64) -> f64 {
        let square =
            |(i, v): (usize, &f64)| scaled(*v, self.nominal[i], magnitude(i), self.tolerances).powi(2);
        (values.iter().enumerate().map(square).sum::<f64>() / self.counted).sqrt()
    }

    /// The component that asks for the smallest step.
    fn worst(&self) -> usize {
        let size =
            |i: usize| scaled(self.parts[i], self.nominal[i], self.magnitude(i), self.tolerances).abs();
        (0..self.parts.len()).max_by(|&i, &j| size(i).total_cmp(&size(j))).unwrap_or(0)
    }

    fn first_step<O: DynamicOde>(&mut self, ode: &mut O, remaining: f64) -> f64 {
        let at_start = |solver: &Self, values: &[f64]| solver.norm(values, |i| solver.step.x[i].abs());
        let sizes = [at_start(self, &self.step.x), at_start(self, &self.step.k[0])];
        let h_0 = first_step::euler(sizes[0], sizes[1], remaining);
        let Self { step, scratch, parts, statistics, .. } = self;
        for (i, x) in scratch.iter_mut().enumerate() {
            *x = step.x[i] + h_0 * step.k[0][i];
        }
        if rhs(ode, step.t + h_0, scratch, parts, statistics).is_err() {
            return h_0;
        }
        for (turned, slope) in parts.iter_mut().zip(&step.k[0]) {
            *turned -= slope;
        }
        let rate = at_start(self, &self.parts) / h_0;
        first_step::length([sizes[1], rate], h_0, self.table.pace.order, remaining)
    }

    /// Stages 13 to 16 of Dop853.
    fn extend<O: DynamicOde>(&mut self, ode: &mut O) -> Result<(), StepError<O::Error>> {
        let Self { step, scratch, statistics, .. } = self;
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

    fn inside_dop853(&self, theta: f64, out: &mut [f64]) {
        let LastStep { h, x, end, k, .. } = &self.step;
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

fn rhs<O: DynamicOde>(
    ode: &mut O,
    t: f64,
    x: &[f64],
    dx: &mut [f64],
    statistics: &mut Statistics,
) -> Result<(), StepError<O::Error>> {
    statistics.rhs_evaluations += 1;
    ode.rhs(t, x, dx).map_err(|source| StepError::Rhs { t, source })
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
