//! An instance of an FMU without its C boundary: life cycle and lazy outputs.

use std::sync::Arc;

use integrators::{Method, Solver, Statistics};
use model::{Kind, Model, ParameterError, Variables};
use num_dual::Dual64;

use crate::built::Built;
use crate::inputs::{Channels, Polynomials};
use crate::jobs::{Begin, Evaluate, EventIndicators, LinearCache, PrepareLinear, Rates, Start};
use crate::phase::{Interface, Phase, Rule};
use crate::state::State;
use crate::table::{ALL_PARTS, Layout, Part, Table, Variable};
use crate::{Fault, SolverParameters, times};

/// An instance.
#[derive(Debug)]
pub struct Instance<M: Model> {
    pub(crate) table: Arc<Table>,
    pub(crate) state: State<M>,
    /// Inputs and outputs in dual numbers, kept so that derivatives allocate nothing
    pub(crate) duals: Vec<Dual64>,
    /// States in dual numbers
    pub(crate) dual_states: Vec<Dual64>,
    pub(crate) channels: Channels,
    /// Working memory of a step: the course of the inputs, and their values inside it
    pub(crate) polynomials: Polynomials,
    pub(crate) moving: Vec<f64>,
    /// The same for the method `exact`
    pub(crate) linear: LinearCache,
    pub(crate) warnings: Vec<String>,
}

impl<M: Model> Default for Instance<M> {
    fn default() -> Self {
        Self::new()
    }
}

impl<M: Model> Instance<M> {
    /// A new instance for Co-Simulation without Event Mode, with all start values.
    #[must_use]
    pub fn new() -> Self {
        Self::with_interface(Interface::CoSimulation)
    }

    /// A new instance with all start values.
    #[must_use]
    pub fn with_interface(interface: Interface) -> Self {
        let table = Table::shared::<M>();
        let state = State::new(&table, interface);
        let channels = Channels::of(&table.variables[Layout::<M>::INPUTS]);
        Self {
            duals: vec![Dual64::from_re(0.0); table.variables.len()],
            dual_states: Vec::new(),
            polynomials: Polynomials::new(&channels),
            moving: vec![0.0; channels.count()],
            linear: None,
            channels,
            table,
            state,
            warnings: Vec::new(),
        }
    }

    /// Hash of the variable table.
    #[must_use]
    pub fn token() -> String {
        Table::shared::<M>().token()
    }

    /// True if the last call has left messages.
    #[must_use]
    pub fn has_warnings(&self) -> bool {
        !self.warnings.is_empty()
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
        rule.check(self.state.interface, self.state.phase)
    }

    /// The instance is lost.
    pub fn break_down(&mut self) {
        self.state.phase = Phase::Broken;
    }

    /// A variable by its value reference.
    pub(crate) fn variable(&self, reference: u32) -> Result<&Variable, Fault> {
        self.table.variable(reference)
    }

    /// Name of a type in the standard that the instance speaks.
    #[must_use]
    pub fn type_name(&self, kind: Kind) -> &'static str {
        self.state.interface.standard().type_name(kind)
    }

    /// Times of the run.
    ///
    /// # Errors
    /// Times that make no sense.
    pub fn setup_experiment(&mut self, start: f64, stop: Option<f64>) -> Result<(), Fault> {
        times::experiment(start, stop)?;
        self.state.start_time = start;
        self.state.stop_time = stop;
        Ok(())
    }

    /// Begin initialisation at the time that was set up, otherwise at 0.
    ///
    /// # Errors
    /// None.
    pub fn begin_initialization(&mut self) -> Result<(), Fault> {
        self.state.values[0] = self.state.start_time;
        self.state.phase = Phase::InitializationMode;
        Ok(())
    }

    /// Begin initialisation of a run with these times.
    ///
    /// # Errors
    /// As [`setup_experiment`](Self::setup_experiment).
    pub fn enter_initialization(&mut self, start: f64, stop: Option<f64>) -> Result<(), Fault> {
        self.setup_experiment(start, stop)?;
        self.begin_initialization()
    }

    /// Build the model and its consistent start, if values have changed since.
    fn assemble(&mut self) -> Result<(), Fault> {
        if self.state.model.is_some() {
            return Ok(());
        }
        let given = &self.state.motion_start;
        let exchange = self.state.interface.is_model_exchange();
        let model = Built::<M>::new(&self.state.values[Layout::<M>::PARAMETERS], given, exchange)?;
        let (x, discrete, names) = model.with_system(Start { t: self.state.start_time, given })?;
        if M::MODEL_EXCHANGE {
            let place = |name: String| {
                let of = |state: &usize| self.table.variables[*state].name == name;
                let place = self.table.states.iter().position(of);
                place.ok_or(Fault::UndeclaredState { state: name })
            };
            self.state.places = names.into_iter().map(place).collect::<Result<_, _>>()?;
        }
        self.dual_states.resize(x.len(), Dual64::from_re(0.0));
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
        let solver = if self.state.interface.is_model_exchange() {
            None
        } else {
            let solver = SolverParameters::load(&self.state.values[Layout::<M>::SOLVER]);
            Some(Solver::new(solver.settings(M::METHODS)?)?)
        };
        self.port()?;
        self.assemble()?;
        self.refresh(ALL_PARTS).map_err(|fault| match fault {
            Fault::Evaluation { source, .. } => ParameterError::Start(source).into(),
            Fault::NotFinite { variable, value, .. } => Fault::NotFiniteAtStart { variable, value },
            other => other,
        })?;
        if let Some(model) = &self.state.model {
            self.warnings = model.warnings();
            if solver.is_some_and(|solver| solver.settings().method == Method::Exact) {
                self.linear = model.with_system(PrepareLinear);
            }
        }
        let State { unused, values, .. } = &mut self.state;
        for (unused, state) in unused.iter_mut().zip(&self.table.states) {
            *unused = values[*state];
        }
        self.state.solver = solver;
        self.state.statistics = Statistics::default();
        self.state.guarded = 0.0;
        self.begin_inputs();
        self.state.phase = self.state.interface.after_initialization();
        Ok(())
    }

    /// The model with all tunable parameters taken over.
    pub(crate) fn tuned(&mut self) -> Result<(), Fault> {
        self.assemble()?;
        if self.state.retune
            && let Some(model) = &mut self.state.model
        {
            model.retune(&self.state.values[Layout::<M>::PARAMETERS]);
            self.state.retune = false;
            self.state.guarded = 0.0;
            self.state.fresh = 0;
        }
        Ok(())
    }

    /// Compute the parts of the list that `needed` names and that are out of date.
    #[inline]
    pub(crate) fn refresh(&mut self, needed: u8) -> Result<(), Fault> {
        let known = needed & !self.state.fresh == 0 && self.state.model.is_some() && !self.state.retune;
        if needed == 0 || known {
            return Ok(());
        }
        self.compute(needed)
    }

    fn compute(&mut self, needed: u8) -> Result<(), Fault> {
        self.tuned()?;
        let State { phase, values, model, x, places, discrete: d, fresh, .. } = &mut self.state;
        let Some(model) = model else { return Ok(()) };
        let t = values[0];
        if *phase == Phase::InitializationMode {
            *d = model.with_system(Begin { x, u: &values[Layout::<M>::INPUTS], d });
        }
        for part in Part::ALL {
            if needed & !*fresh & part.bit() == 0 {
                continue;
            }
            let range = Layout::<M>::part(part);
            // inputs come before everything that is computed
            let (before, outputs) = values.split_at_mut(range.start);
            let values = &mut outputs[..range.len()];
            let u = &before[Layout::<M>::INPUTS];
            match part {
                Part::Outputs(group) => model.with_system(Evaluate { group, t, x: &*x, u, d, values }),
                Part::Rates => model.with_system(Rates { t, x: &*x, u, d, places, values }),
                Part::Indicators => {
                    let values = &mut *values;
                    model.with_system(EventIndicators { t, x, u, d, values });
                    Ok(())
                }
            }
            .map_err(|source| Fault::Evaluation { t, source })?;
            let values = &outputs[..range.len()];
            if let Some(i) = values.iter().position(|v| !v.is_finite()) {
                let variable = self.table.variables[range.start + i].name.clone();
                let value = values[i];
                return Err(Fault::NotFinite { variable, value, t });
            }
            *fresh |= part.bit();
        }
        Ok(())
    }

    /// The stored value of a variable, computed or not.
    ///
    /// # Panics
    /// If there is no such variable.
    #[must_use]
    pub fn raw(&self, reference: u32) -> f64 {
        self.state.values[reference as usize]
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
        self.state = State::new(&self.table, self.state.interface);
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
    ///
    /// # Errors
    /// [`Fault::ForeignState`] for the state of an instance that is used in another way.
    pub fn restore(&mut self, saved: &State<M>) -> Result<(), Fault> {
        if saved.interface != self.state.interface {
            return Err(Fault::ForeignState { saved: saved.interface, instance: self.state.interface });
        }
        self.state.clone_from(saved);
        self.dual_states.resize(self.state.x.len(), Dual64::from_re(0.0));
        Ok(())
    }
}
