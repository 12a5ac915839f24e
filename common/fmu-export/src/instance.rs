//! An instance of an FMU without its C boundary: values, phases, lazy outputs, steps.

use integrators::{Solver, Statistics};
use model::{Causality, Entry, Group, Kind, Model, ParameterError, Variables};
use num_dual::Dual64;

use crate::jobs::{Evaluate, Start, Step};
use crate::phase::{Phase, Rule};
use crate::table::{FLOAT, Layout, Table, Variable, allowed, changes_in_a_run, kind_name};
use crate::{Fault, SolverCounters, SolverParameters};

/// Relative change of the inner step from which the stability guard looks again.
const SAME_STEP: f64 = 1e-6;
/// A host may miss the instance's time by this much (relative to max(1, |t|)).
const SAME_TIME: f64 = 1e-9;
/// Every group up to date.
const ALL_FRESH: u8 = 0x0f;

/// Everything that a run changes; what `GetFMUState` saves.
#[derive(Debug)]
pub struct State<M: Model> {
    phase: Phase,
    values: Vec<f64>,
    model: Option<M>,
    x: Vec<f64>,
    discrete: M::Discrete,
    start_time: f64,
    stop_time: Option<f64>,
    solver: Option<Solver>,
    statistics: Statistics,
    /// Bit per group: the values in the list belong to the present states and inputs
    fresh: u8,
    /// Tunable parameters were set and not yet taken over
    retune: bool,
    /// Inner step for which the stability guard was passed; 0: look again
    guarded: f64,
}

impl<M: Model> Clone for State<M> {
    fn clone(&self) -> Self {
        Self { values: self.values.clone(), model: self.model.clone(), x: self.x.clone(), ..*self }
    }
    fn clone_from(&mut self, other: &Self) {
        let (mut values, mut x) = (std::mem::take(&mut self.values), std::mem::take(&mut self.x));
        values.clone_from(&other.values);
        x.clone_from(&other.x);
        *self = Self { values, x, model: other.model.clone(), ..*other };
    }
}

impl<M: Model> State<M> {
    fn new(table: &Table) -> Self {
        Self {
            phase: Phase::Instantiated,
            values: table.start_values(),
            model: None,
            x: Vec::new(),
            discrete: M::Discrete::default(),
            start_time: 0.0,
            stop_time: None,
            solver: None,
            statistics: Statistics::default(),
            fresh: 0,
            retune: false,
            guarded: 0.0,
        }
    }
}

/// An instance.
#[derive(Debug)]
pub struct Instance<M: Model> {
    table: Table,
    state: State<M>,
    /// Inputs and outputs in dual numbers, kept so that derivatives allocate nothing
    duals: Vec<Dual64>,
    warnings: Vec<String>,
}

impl<M: Model> Default for Instance<M> {
    fn default() -> Self {
        Self::new()
    }
}

impl<M: Model> Instance<M> {
    /// A new instance with all start values.
    #[must_use]
    pub fn new() -> Self {
        let table = Table::new::<M>();
        let state = State::new(&table);
        Self { duals: vec![Dual64::from_re(0.0); table.variables.len()], table, state, warnings: Vec::new() }
    }

    /// Hash of the variable table.
    #[must_use]
    pub fn token() -> String {
        Table::new::<M>().token(M::NAME)
    }

    /// Messages of the last call about things that are allowed but probably not meant.
    pub fn take_warnings(&mut self) -> Vec<String> {
        std::mem::take(&mut self.warnings)
    }

    /// Check that a function may be called now.
    ///
    /// # Errors
    /// [`Fault::WrongPhase`].
    #[inline]
    pub fn enter(&self, rule: &Rule) -> Result<(), Fault> {
        if rule.allows(self.state.phase) {
            return Ok(());
        }
        Err(Fault::WrongPhase {
            function: rule.function,
            phase: format!("{:?}", self.state.phase),
            allowed: rule.allowed(),
        })
    }

    /// The instance is lost.
    pub fn break_down(&mut self) {
        self.state.phase = Phase::Broken;
    }

    fn variable(&self, reference: u32) -> Result<&Variable, Fault> {
        self.table
            .variables
            .get(reference as usize)
            .ok_or(Fault::UnknownReference { reference, count: self.table.variables.len() })
    }

    /// Read Float64 variables.
    ///
    /// # Errors
    /// Unknown references, other types, outputs that have no value now.
    pub fn get_float64(&mut self, references: &[u32], values: &mut [f64]) -> Result<(), Fault> {
        same_length(references.len(), values.len())?;
        let mut needed = 0;
        for reference in references {
            match self.table.access.get(*reference as usize) {
                Some(access) if access & FLOAT != 0 => needed |= access,
                _ => return Err(self.wrong_type(*reference, "Float64")),
            }
        }
        self.refresh(needed & ALL_FRESH)?;
        for (value, reference) in values.iter_mut().zip(references) {
            *value = self.state.values[*reference as usize];
        }
        Ok(())
    }

    fn wrong_type(&self, reference: u32, called: &'static str) -> Fault {
        match self.variable(reference) {
            Ok(v) => {
                Fault::WrongType { variable: v.name.clone(), reference, is: kind_name(v.entry.kind), called }
            }
            Err(fault) => fault,
        }
    }

    /// Read variables of another type; all of them are stored as whole numbers.
    ///
    /// # Errors
    /// Unknown references and other types.
    pub fn get_whole(
        &mut self,
        references: &[u32],
        called: &'static str,
        is: impl Fn(Kind) -> bool,
        mut put: impl FnMut(usize, f64),
    ) -> Result<(), Fault> {
        for reference in references {
            if !is(self.variable(*reference)?.entry.kind) {
                return Err(self.wrong_type(*reference, called));
            }
        }
        for (i, reference) in references.iter().enumerate() {
            put(i, self.state.values[*reference as usize]);
        }
        Ok(())
    }

    /// Set variables; all of them or, on a fault, none.
    ///
    /// # Errors
    /// Unknown references, other types, values out of range, variables that cannot be set now.
    pub fn set(
        &mut self,
        references: &[u32],
        called: &'static str,
        is: impl Fn(Kind) -> bool,
        value: impl Fn(usize) -> f64,
    ) -> Result<(), Fault> {
        for (i, reference) in references.iter().enumerate() {
            let Variable { name, entry } = self.variable(*reference)?;
            if !is(entry.kind) {
                return Err(self.wrong_type(*reference, called));
            }
            if let Some(reason) = self.not_settable(entry) {
                let phase = format!("{:?}", self.state.phase);
                return Err(Fault::NotSettable { variable: name.clone(), phase, reason });
            }
            if !in_range(entry, value(i)) {
                let kept = self.state.values[*reference as usize];
                return Err(Fault::Value {
                    variable: name.clone(),
                    value: value(i),
                    kept,
                    allowed: allowed(entry),
                });
            }
        }
        for (i, reference) in references.iter().enumerate() {
            self.state.values[*reference as usize] = value(i);
        }
        if !references.is_empty() {
            self.state.fresh = 0;
            let inputs = Layout::<M>::INPUTS;
            if !references.iter().all(|r| inputs.contains(&(*r as usize))) {
                if self.state.phase == Phase::StepMode {
                    self.state.retune = true;
                } else {
                    self.state.model = None; // start values or parameters changed: assemble again
                }
            }
        }
        Ok(())
    }

    fn not_settable(&self, entry: &Entry) -> Option<&'static str> {
        match self.state.phase {
            Phase::StepMode if !changes_in_a_run(entry) => {
                Some("only inputs and tunable parameters change in a run")
            }
            Phase::Instantiated | Phase::InitializationMode if !entry.has_start() => {
                Some("it is computed and has no start value")
            }
            _ => None,
        }
    }

    /// Begin initialisation.
    ///
    /// # Errors
    /// Times that make no sense.
    pub fn enter_initialization(&mut self, start: f64, stop: Option<f64>) -> Result<(), Fault> {
        if !start.is_finite() {
            return Err(Fault::Argument { argument: "startTime", value: start, allowed: "finite".into() });
        }
        if let Some(stop) = stop
            && !(stop.is_finite() && stop > start)
        {
            return Err(Fault::Argument {
                argument: "stopTime",
                value: stop,
                allowed: format!("> {start} s, finite"),
            });
        }
        self.state.start_time = start;
        self.state.stop_time = stop;
        self.state.values[0] = start;
        self.state.phase = Phase::InitializationMode;
        Ok(())
    }

    /// Build the model and its consistent start, if values have changed since.
    fn assemble(&mut self) -> Result<(), Fault> {
        if self.state.model.is_some() {
            return Ok(());
        }
        let values = &self.state.values;
        let given = &values[Layout::<M>::group(Group::Motion)];
        let parameters = M::Parameters::load(&values[Layout::<M>::PARAMETERS]);
        let model = M::new(&parameters, &M::Motion::load(given))?;
        let (x, discrete) = model.with_system(Start { t: self.state.start_time, given })?;
        self.state.x = x;
        self.state.discrete = discrete;
        self.state.model = Some(model);
        self.state.fresh = 0;
        Ok(())
    }

    /// End initialisation: parameters that do not fit together are refused here.
    ///
    /// # Errors
    /// [`Fault::Parameter`], [`Fault::MethodNotOffered`], start states without accelerations.
    pub fn exit_initialization(&mut self) -> Result<(), Fault> {
        let solver = SolverParameters::load(&self.state.values[Layout::<M>::SOLVER]);
        let solver = Solver::new(solver.settings()?)?;
        self.assemble()?;
        self.refresh(ALL_FRESH).map_err(|fault| match fault {
            Fault::Evaluation { source, .. } => ParameterError::Start(source).into(),
            other => other,
        })?;
        if let Some(model) = &self.state.model {
            self.warnings = model.warnings();
        }
        self.state.solver = Some(solver);
        self.state.statistics = Statistics::default();
        self.state.guarded = 0.0;
        self.state.phase = Phase::StepMode;
        Ok(())
    }

    /// The model with all tunable parameters taken over.
    fn tuned(&mut self) -> Result<(), Fault> {
        self.assemble()?;
        if self.state.retune
            && let Some(model) = &mut self.state.model
        {
            model.retune(&M::Parameters::load(&self.state.values[Layout::<M>::PARAMETERS]));
            self.state.retune = false;
            self.state.guarded = 0.0;
            self.state.fresh = 0;
        }
        Ok(())
    }

    /// Compute the groups of outputs that `needed` names and that are out of date.
    fn refresh(&mut self, needed: u8) -> Result<(), Fault> {
        if needed & !self.state.fresh == 0 && self.state.model.is_some() {
            return Ok(());
        }
        self.tuned()?;
        let State { values, model, x, discrete, fresh, .. } = &mut self.state;
        let Some(model) = model else { return Ok(()) };
        let t = values[0];
        for group in Group::ALL {
            let bit = 1 << group as u8;
            if needed & !*fresh & bit == 0 {
                continue;
            }
            let range = Layout::<M>::group(group);
            // inputs come before outputs in the list
            let (before, outputs) = values.split_at_mut(range.start);
            let outputs = &mut outputs[..range.len()];
            let u = &before[Layout::<M>::INPUTS];
            model
                .with_system(Evaluate { group, t, x, u, d: discrete, values: outputs })
                .map_err(|source| Fault::Evaluation { t, source })?;
            if let Some(i) = outputs.iter().position(|v| !v.is_finite()) {
                let variable = self.table.variables[range.start + i].name.clone();
                return Err(Fault::NotFinite { variable, value: outputs[i], t });
            }
            *fresh |= bit;
        }
        Ok(())
    }

    /// Advance by one communication step.
    ///
    /// # Errors
    /// Arguments that make no sense; a step that cannot be done (then nothing has changed).
    pub fn do_step(&mut self, t: f64, step: f64) -> Result<(), Fault> {
        let now = self.state.values[0];
        let same_time = (t - now).abs() <= SAME_TIME * now.abs().max(1.0);
        if !same_time {
            return Err(Fault::Argument {
                argument: "currentCommunicationPoint",
                value: t,
                allowed: format!("{now} s, where the instance stands"),
            });
        }
        let to = t + step;
        if !(step > 0.0 && to.is_finite() && to > now) {
            return Err(Fault::Argument {
                argument: "communicationStepSize",
                value: step,
                allowed: "> 0 s, finite".into(),
            });
        }
        if let Some(stop) = self.state.stop_time
            && to > stop + SAME_TIME * stop.abs().max(1.0)
        {
            return Err(Fault::Argument {
                argument: "communicationStepSize",
                value: step,
                allowed: format!("<= {} s, up to the stop time {stop} s", stop - t),
            });
        }
        self.tuned()?;
        let State { values, model, x, discrete, solver, statistics, guarded, fresh, .. } = &mut self.state;
        let (Some(model), Some(solver)) = (model, solver) else {
            return Ok(());
        };
        let h = solver.settings().inner_step(step);
        let fixed = !solver.settings().method.is_adaptive();
        let guard = fixed && (h - *guarded).abs() > SAME_STEP * h;
        let inputs = Layout::<M>::INPUTS;
        let u = &values[inputs.clone()];
        let duals = &mut self.duals[inputs];
        model.with_system(Step { from: now, to, u, guard, duals, x, d: discrete, solver, statistics })?;
        *guarded = h;
        *fresh = 0;
        values[0] = to;
        SolverCounters::from(*statistics).store(&mut values[Layout::<M>::COUNTERS]);
        Ok(())
    }

    /// Where the instance stands [s].
    #[must_use]
    pub fn time(&self) -> f64 {
        self.state.values[0]
    }

    /// End the run.
    pub fn terminate(&mut self) {
        self.state.phase = Phase::Terminated;
    }

    /// As a fresh instance.
    pub fn reset(&mut self) {
        self.state = State::new(&self.table);
    }

    /// Copy of the state.
    #[must_use]
    pub fn save(&self) -> Box<State<M>> {
        Box::new(self.state.clone())
    }

    /// Overwrite a copy with the present state.
    pub fn save_into(&self, copy: &mut State<M>) {
        copy.clone_from(&self.state);
    }

    /// Go back to a saved state.
    pub fn restore(&mut self, saved: &State<M>) {
        self.state.clone_from(saved);
    }

    /// d(unknowns) / d(knowns) in the direction `seed`, exact.
    ///
    /// # Errors
    /// Knowns that are not inputs, unknowns that are not outputs.
    pub fn directional_derivative(
        &mut self,
        unknowns: &[u32],
        knowns: &[u32],
        seed: &[f64],
        sensitivity: &mut [f64],
    ) -> Result<(), Fault> {
        same_length(knowns.len(), seed.len())?;
        same_length(unknowns.len(), sensitivity.len())?;
        let not = |variable: &Variable, reason| Fault::NotSettable {
            variable: variable.name.clone(),
            phase: "directional derivatives".into(),
            reason,
        };
        let mut needed = 0;
        for known in knowns {
            let v = self.variable(*known)?;
            if v.entry.causality != Causality::Input {
                return Err(not(v, "knowns are inputs"));
            }
        }
        for unknown in unknowns {
            let v = self.variable(*unknown)?;
            if v.entry.causality != Causality::Output {
                return Err(not(v, "unknowns are outputs"));
            }
            needed |= self.table.access[*unknown as usize] & ALL_FRESH;
        }
        if let Some(s) = seed.iter().find(|s| !s.is_finite()) {
            return Err(Fault::Argument { argument: "seed", value: *s, allowed: "finite".into() });
        }
        self.tuned()?;
        let State { values, model, x, discrete, .. } = &mut self.state;
        let Some(model) = model else { return Ok(()) };
        let inputs = Layout::<M>::INPUTS;
        for i in inputs.clone() {
            self.duals[i] = Dual64::from_re(values[i]);
        }
        for (known, s) in knowns.iter().zip(seed) {
            self.duals[*known as usize].eps += s;
        }
        let t = values[0];
        for group in Group::ALL {
            if needed & (1 << group as u8) != 0 {
                let range = Layout::<M>::group(group);
                let (before, outputs) = self.duals.split_at_mut(range.start);
                let (u, outputs) = (&before[inputs.clone()], &mut outputs[..range.len()]);
                model
                    .with_system(Evaluate { group, t, x, u, d: discrete, values: outputs })
                    .map_err(|source| Fault::Evaluation { t, source })?;
            }
        }
        for (s, unknown) in sensitivity.iter_mut().zip(unknowns) {
            *s = self.duals[*unknown as usize].eps;
        }
        Ok(())
    }

    /// Inputs that a variable depends on directly.
    ///
    /// # Errors
    /// [`Fault::UnknownReference`].
    pub fn dependencies(&self, reference: u32) -> Result<Vec<usize>, Fault> {
        self.variable(reference)?;
        Ok(self.table.dependencies(reference as usize))
    }
}

/// Number of references and number of values must agree.
pub(crate) fn same_length(references: usize, values: usize) -> Result<(), Fault> {
    if references == values { Ok(()) } else { Err(Fault::Length { references, values }) }
}

/// True if `value` may be set.
#[allow(clippy::float_cmp, reason = "items are whole numbers")]
fn in_range(entry: &Entry, value: f64) -> bool {
    if let Kind::Enumeration(t) = entry.kind {
        #[allow(clippy::cast_precision_loss, reason = "items are small")]
        return t.items.iter().any(|i| i.value as f64 == value);
    }
    value.is_finite() && value >= entry.min && value <= entry.max
}
