//! Implicit methods: a Jacobian by differences of the whole right-hand side, dense matrices.

use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

use super::control::{Attempt, Norm, Sizes, Start};
use super::newton::{Newton, NewtonState};
use super::rosenbrock::Rosenbrock;
use super::{DynamicOde, all_finite, rhs};
use crate::pace::{Pace, SAFETY};
use crate::{Method, Settings, Statistics, StepError, radau5, rodas4};

/// Takes single steps of an implicit method.
pub(super) struct ImplicitSolver {
    norm: Norm,
    sizes: Sizes,
    pub(super) statistics: Statistics,
    step: LastStep,
    method: Stiff,
}

enum Stiff {
    Rodas4(Rosenbrock),
    Radau5(Newton),
}

/// What an [`ImplicitSolver`] remembers.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct ImplicitState {
    sizes: Sizes,
    statistics: Statistics,
    step: LastStep,
    /// Of Radau5
    newton: Option<NewtonState>,
}

/// The step taken last.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct LastStep {
    t: f64,
    h: f64,
    t_end: f64,
    x: Vec<f64>,
    /// Slope at the start
    slope: Vec<f64>,
    end: Vec<f64>,
    /// `u` of Rodas4, `z` of Radau5
    stages: Vec<Vec<f64>>,
    /// Slope at the end, where it is known
    next: Option<Vec<f64>>,
}

impl ImplicitSolver {
    /// A solver without a past; None for other methods.
    pub(super) fn new(settings: &Settings, nominal: Vec<f64>) -> Option<Self> {
        let n = nominal.len();
        let (method, stages, rtol) = match settings.method {
            Method::Rodas4 => (Stiff::Rodas4(Rosenbrock::new(n)), rodas4::STAGES, settings.rtol),
            Method::Radau5 => {
                (Stiff::Radau5(Newton::new()), radau5::system::C.len(), radau5::tolerance(settings.rtol))
            }
            _ => return None,
        };
        let zero = vec![0.0; n];
        let step = LastStep {
            t: 0.0,
            h: 0.0,
            t_end: 0.0,
            x: zero.clone(),
            slope: zero.clone(),
            end: zero.clone(),
            stages: vec![zero; stages],
            next: None,
        };
        Some(Self {
            norm: Norm::new(settings, rtol, nominal),
            sizes: Sizes::default(),
            statistics: Statistics::default(),
            step,
            method,
        })
    }

    pub(super) fn save(&self) -> ImplicitState {
        let newton = match &self.method {
            Stiff::Rodas4(_) => None,
            Stiff::Radau5(newton) => Some(newton.save()),
        };
        ImplicitState { sizes: self.sizes, statistics: self.statistics, step: self.step.clone(), newton }
    }

    pub(super) fn restore(&mut self, state: &ImplicitState) {
        (self.sizes, self.statistics) = (state.sizes, state.statistics);
        self.step.clone_from(&state.step);
        if let (Stiff::Radau5(newton), Some(state)) = (&mut self.method, &state.newton) {
            newton.restore(state, self.norm.nominal.len());
        }
    }

    pub(super) fn fits(&self, state: &ImplicitState) -> bool {
        let n = self.norm.nominal.len();
        let LastStep { x, slope, end, stages, next, .. } = &state.step;
        let fits = match (&self.method, &state.newton) {
            (Stiff::Rodas4(_), None) => true,
            (Stiff::Radau5(_), Some(newton)) => newton.fits(n),
            _ => false,
        };
        fits && [x, slope, end].iter().all(|v| v.len() == n)
            && stages.len() == self.step.stages.len()
            && stages.iter().chain(next).all(|v| v.len() == n)
    }

    pub(super) fn restart(&mut self) {
        self.sizes = Sizes::default();
        self.step.next = None;
        if let Stiff::Radau5(newton) = &mut self.method {
            *newton = Newton::new();
        }
    }

    pub(super) fn changed(&mut self) {
        self.step.next = None;
    }

    pub(super) fn step<O: DynamicOde>(
        &mut self,
        ode: &mut O,
        t: f64,
        x: &[f64],
        t_end: f64,
    ) -> Result<f64, StepError<O::Error>> {
        let Self { norm, sizes, statistics, step, method } = self;
        let LastStep { x: start, slope, end, stages, next, .. } = step;
        match next.take() {
            Some(known) => *slope = known,
            None => rhs(ode, t, x, slope, statistics)?,
        }
        all_finite(t, slope)?;
        start.copy_from_slice(x);
        let from = Start { t, x: start, slope };
        let pace = method.pace();
        sizes.guess(ode, from, t_end - t, (norm, pace), statistics);
        method.begin(ode, from, norm, statistics)?;
        let attempt = |statistics: &mut Statistics, h: f64, fresh: bool| {
            method.attempt(ode, from, (h, fresh), norm, (stages, end), statistics)
        };
        let accepted = sizes.accepted([t, t_end], pace, statistics, attempt)?;
        let h = accepted.now.h;
        if let Stiff::Radau5(newton) = method {
            newton.accepted(h, stages);
        }
        sizes.note(&accepted, pace, |growth| method.keeps(growth));
        statistics.steps += 1;
        (step.t, step.h) = (t, h);
        step.t_end = if h >= t_end - t { t_end } else { t + h };
        Ok(step.t_end)
    }

    pub(super) fn state(&self) -> &[f64] {
        &self.step.end
    }

    pub(super) fn slope<O: DynamicOde>(&mut self, ode: &mut O) -> Result<&[f64], StepError<O::Error>> {
        let Self { step: LastStep { t_end, end, next, .. }, statistics, .. } = self;
        let known = if let Some(known) = next.take() {
            known
        } else {
            let mut slope = vec![0.0; end.len()];
            rhs(ode, *t_end, end, &mut slope, statistics)?;
            slope
        };
        Ok(next.insert(known))
    }

    pub(super) fn interval(&self) -> (f64, f64) {
        (self.step.t, self.step.h)
    }

    pub(super) fn inside(&self, theta: f64, out: &mut [f64]) {
        let LastStep { x, end, stages, .. } = &self.step;
        if theta >= 1.0 {
            out.copy_from_slice(end); // not x + rounding
            return;
        }
        match &self.method {
            Stiff::Rodas4(_) => super::rosenbrock::inside((x, end), stages, theta, out),
            Stiff::Radau5(_) => super::newton::inside(x, stages, theta, out),
        }
    }

    pub(super) fn repeat<O: DynamicOde>(
        &mut self,
        ode: &mut O,
        theta: f64,
        out: &mut [f64],
    ) -> Result<(), StepError<O::Error>> {
        let Self { norm, statistics, step, method, .. } = self;
        let from = Start { t: step.t, x: &step.x, slope: &step.slope };
        let h = theta * step.h;
        let mut stages = step.stages.clone();
        match method {
            Stiff::Rodas4(rosenbrock) => rosenbrock.trial(ode, from, h, (&mut stages, out), statistics)?,
            Stiff::Radau5(newton) => {
                super::newton::shortened(&step.stages, theta, &mut stages);
                newton.trial(ode, from, h, norm, (&mut stages, out), statistics).map(|_| ())?;
            }
        }
        all_finite(step.t + h, out)
    }
}

impl Stiff {
    fn pace(&self) -> Pace {
        match self {
            Self::Rodas4(_) => rodas4::PACE,
            Self::Radau5(_) => radau5::PACE,
        }
    }

    fn keeps(&self, growth: f64) -> bool {
        match self {
            Self::Rodas4(_) => false,
            Self::Radau5(newton) => newton.keeps(growth),
        }
    }

    /// Before the trials of a step.
    fn begin<O: DynamicOde>(
        &mut self,
        ode: &mut O,
        from: Start<'_>,
        norm: &Norm,
        statistics: &mut Statistics,
    ) -> Result<(), StepError<O::Error>> {
        match self {
            Self::Rodas4(rosenbrock) => rosenbrock.begin(ode, from, norm, statistics),
            Self::Radau5(newton) => {
                newton.begin();
                Ok(())
            }
        }
    }

    /// One step of length `h` and its error.
    fn attempt<O: DynamicOde>(
        &mut self,
        ode: &mut O,
        from: Start<'_>,
        (h, fresh): (f64, bool),
        norm: &Norm,
        (stages, end): (&mut [Vec<f64>], &mut [f64]),
        statistics: &mut Statistics,
    ) -> Result<Attempt, StepError<O::Error>> {
        let (parts, safety) = match self {
            Self::Rodas4(rosenbrock) => {
                rosenbrock.trial(ode, from, h, (stages, end), statistics)?;
                all_finite(from.t + h, end)?;
                (stages[rodas4::STAGES - 1].clone(), SAFETY)
            }
            Self::Radau5(newton) => {
                newton.guess(h, stages);
                let iterations = newton.trial(ode, from, h, norm, (stages, end), statistics)?;
                all_finite(from.t + h, end)?;
                let parts = newton.error(ode, from, fresh, norm, (stages, end), statistics);
                (parts, radau5::safety(iterations))
            }
        };
        let error = norm.of(&parts, from.x, end);
        Ok(Attempt { error, safety, worst: norm.worst(&parts, from.x, end) })
    }
}

/// `df/dx` by forward differences, or backward ones where the model has no value ahead; every evaluation counts.
pub(super) fn jacobian<O: DynamicOde>(
    ode: &mut O,
    from: Start<'_>,
    nominal: &[f64],
    statistics: &mut Statistics,
) -> Result<DMatrix<f64>, StepError<O::Error>> {
    statistics.jacobians += 1;
    let Start { t, x, slope } = from;
    let n = x.len();
    let mut jacobian = DMatrix::zeros(n, n);
    let (mut moved, mut shifted) = (x.to_vec(), vec![0.0; n]);
    for column in 0..n {
        let size = if nominal[column].is_finite() { nominal[column] } else { 1.0 };
        let delta = f64::EPSILON.sqrt() * x[column].abs().max(size);
        moved[column] = x[column] + delta;
        if rhs(ode, t, &moved, &mut shifted, statistics).is_err() {
            moved[column] = x[column] - delta;
            rhs(ode, t, &moved, &mut shifted, statistics)?;
        }
        let delta = moved[column] - x[column]; // as rounded
        for row in 0..n {
            jacobian[(row, column)] = (shifted[row] - slope[row]) / delta;
        }
        moved[column] = x[column];
    }
    all_finite(t, jacobian.as_slice())?;
    Ok(jacobian)
}

/// `df/dt` by a forward difference.
pub(super) fn rate<O: DynamicOde>(
    ode: &mut O,
    from: Start<'_>,
    statistics: &mut Statistics,
) -> Result<Vec<f64>, StepError<O::Error>> {
    let Start { t, x, slope } = from;
    let delta = (t + f64::EPSILON.sqrt() * t.abs().max(1.0)) - t;
    let mut shifted = vec![0.0; x.len()];
    rhs(ode, t + delta, x, &mut shifted, statistics)?;
    for (shifted, slope) in shifted.iter_mut().zip(slope) {
        *shifted = (*shifted - slope) / delta;
    }
    all_finite(t, &shifted)?;
    Ok(shifted)
}
