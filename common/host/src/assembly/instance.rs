//! The instance: life cycle.

use std::path::Path;
use std::rc::Rc;

use fmu_export::inputs::{Channels, History, Polynomials, PortParameters};
use fmu_export::{
    CreationError, Event, Exported, Fault, Interface, Phase, Rule, SolverCounters, SolverParameters, Status,
    times,
};
use model::{Kind, Variables};

use super::layout::Layout;
use super::state::{Backup, Flags};
use super::{AssemblyError, AssemblyState, refused};
use crate::methods::{Choices, Config, MethodKind, Run};
use crate::run::Scene;
use crate::start;
use crate::sweep::{Driven, Sweeper};

/// A scene as an instance of an FMU.
pub struct Assembly {
    pub(super) scene: Rc<Scene>,
    pub(super) layout: Rc<Layout>,
    /// How it runs; method and times as the host has set them
    pub(super) config: Config,
    pub(super) sweeper: Sweeper,
    /// From the end of initialisation on
    pub(super) run: Option<Run>,
    pub(super) interface: Interface,
    pub(super) phase: Phase,
    pub(super) start_time: f64,
    pub(super) stop_time: Option<f64>,
    /// Values that no element holds, and those that were set, by value reference
    pub(super) values: Vec<f64>,
    pub(super) channels: Channels,
    pub(super) polynomials: Polynomials,
    pub(super) history: History,
    /// Continuous inputs as the host has set them, and as they read now: where their polynomials ended
    pub(super) given: Vec<f64>,
    pub(super) inputs: Vec<f64>,
    /// Value of `port.reset` at which the history was last emptied
    pub(super) reset_seen: f64,
    pub(super) flags: Flags,
    pub(super) backup: Backup,
    warnings: Vec<String>,
}

/// Scene, layout and settings of an assembly, and instances of its elements.
pub(super) struct Loaded {
    pub(super) scene: Scene,
    pub(super) config: Config,
    pub(super) layout: Layout,
    pub(super) sweeper: Sweeper,
}

/// Numbers of the methods in `solver.method` that the host integrates with: heun, rk4, dopri5, dop853, rodas4, radau5.
const OFFERED: &[i64] = &[1, 2, 3, 4, 5, 6];

/// Communication step of the default experiment: the interval of recording, at most 1000 of them.
pub(super) fn experiment_step(config: &Config) -> f64 {
    let length = config.stop - config.start;
    config.interval.unwrap_or(length / 200.0).max(length / 1000.0)
}

/// Loads the folder `resources` of an assembly.
pub(super) fn load(resources: &Path) -> Result<Loaded, AssemblyError> {
    let scene = Scene::load(resources, &resources.join("fmus"), None)?;
    let settings = Choices { method: Some(MethodKind::Common.name().into()), ..Choices::default() };
    let config = Config::new(&scene.system, &settings)?;
    let mut sweeper = scene.instantiate(&config, &[])?;
    let layout = Layout::of(&scene, &mut sweeper, &config, experiment_step(&config))?;
    Ok(Loaded { scene, config, layout, sweeper })
}

impl Assembly {
    fn of(loaded: Loaded, interface: Interface) -> Self {
        let Loaded { scene, config, layout, sweeper } = loaded;
        let channels = Channels::of(&layout.table.variables()[layout.inputs.clone()]);
        let mut assembly = Self {
            polynomials: Polynomials::new(&channels),
            channels,
            backup: Backup::default(),
            scene: Rc::new(scene),
            layout: Rc::new(layout),
            config,
            sweeper,
            run: None,
            interface,
            phase: Phase::Instantiated,
            start_time: 0.0,
            stop_time: None,
            values: Vec::new(),
            history: History::new(0),
            given: Vec::new(),
            inputs: Vec::new(),
            reset_seen: 0.0,
            flags: Flags::START,
            warnings: Vec::new(),
        };
        assembly.start_over();
        assembly
    }

    /// All start values.
    fn start_over(&mut self) {
        self.values = self.layout.table.start_values();
        self.given = self.values[self.layout.inputs.clone()].to_vec();
        self.inputs.clone_from(&self.given);
        self.history = History::new(self.given.len());
        self.sweeper.driven = Driven::new(&Layout::targets(&self.scene), self.given.clone());
        self.run = None;
        self.phase = Phase::Instantiated;
        (self.start_time, self.stop_time, self.reset_seen) = (0.0, None, 0.0);
        self.flags = Flags::START;
        self.warnings.clear();
    }

    /// Settings of the integrator as the host has set them.
    pub(super) fn configured(&self) -> Result<Config, Fault> {
        let settings = SolverParameters::load(&self.values[self.layout.solver.clone()]).settings(OFFERED)?;
        Ok(Config {
            integrator: settings.method,
            step: Some(settings.step),
            rtol: settings.rtol,
            atol: settings.atol,
            start: self.start_time,
            stop: self.stop_time.unwrap_or(f64::INFINITY),
            ..self.config
        })
    }

    /// Treatment of the inputs, if its parameters fit together.
    pub(super) fn port(&self) -> Result<PortParameters, Fault> {
        if self.layout.port.is_empty() {
            return Ok(PortParameters::HOLD);
        }
        Ok(PortParameters::load(&self.values[self.layout.port.clone()]).checked()?)
    }

    /// Value of the signal that announces jumps of inputs.
    pub(super) fn reset_signal(&self) -> f64 {
        self.values[self.layout.reset.clone()].first().copied().unwrap_or(0.0)
    }

    /// Forgets the samples if `port.reset` has changed.
    pub(super) fn see_reset(&mut self) {
        if self.reset_signal().to_bits() != self.reset_seen.to_bits() {
            self.reset_seen = self.reset_signal();
            self.history.clear();
        }
    }

    /// The counters of the integrator become values.
    pub(super) fn count(&mut self) {
        if let Some(run) = &self.run {
            let counters = SolverCounters::from(run.statistics());
            counters.store(&mut self.values[self.layout.counters.clone()]);
        }
    }

    /// In Initialization Mode: closes the joints and brings all values in step.
    pub(super) fn close(&mut self) -> Result<(), Fault> {
        if self.flags.stale {
            self.sweeper.driven.values.clone_from(&self.inputs);
            self.sweeper.drive_all().and_then(|()| start::close(&mut self.sweeper)).map_err(refused)?;
            self.flags.stale = false;
        }
        Ok(())
    }
}

impl Drop for Assembly {
    fn drop(&mut self) {
        self.backup.forget(&mut self.sweeper);
    }
}

/// A parameter that is refused at the end of initialisation is an error, whatever the element has called it.
fn not_started(fault: Fault) -> Fault {
    match fault {
        Fault::Part { message, status: Status::Discard } => Fault::Part { message, status: Status::Error },
        other => other,
    }
}

impl Exported for Assembly {
    type State = AssemblyState;

    fn create(interface: Interface, token: &str, resources: Option<&Path>) -> Result<Self, CreationError> {
        if interface.is_model_exchange() {
            return Err(CreationError::NoModelExchange);
        }
        let Some(resources) = resources else {
            return Err(CreationError::Resources { reason: "the host gives no path to the folder".into() });
        };
        let loaded =
            load(resources).map_err(|error| CreationError::Resources { reason: error.to_string() })?;
        let expected = loaded.layout.table.token();
        if token != expected {
            return Err(CreationError::Token { expected });
        }
        Ok(Self::of(loaded, interface))
    }

    fn enter(&self, rule: &Rule) -> Result<(), Fault> {
        rule.check(self.interface, self.phase)
    }

    fn break_down(&mut self) {
        self.phase = Phase::Broken;
    }

    fn type_name(&self, kind: Kind) -> &'static str {
        self.interface.standard().type_name(kind)
    }

    fn has_warnings(&self) -> bool {
        !self.warnings.is_empty()
    }

    fn take_warnings(&mut self) -> Vec<String> {
        std::mem::take(&mut self.warnings)
    }

    fn time(&self) -> f64 {
        self.values[0]
    }

    fn setup_experiment(&mut self, start: f64, stop: Option<f64>) -> Result<(), Fault> {
        times::experiment(start, stop)?;
        (self.start_time, self.stop_time) = (start, stop);
        Ok(())
    }

    fn begin_initialization(&mut self) -> Result<(), Fault> {
        start::enter(&mut self.sweeper, self.start_time, self.stop_time)
            .map_err(|error| not_started(refused(error)))?;
        self.values[0] = self.start_time;
        self.phase = Phase::InitializationMode;
        Ok(())
    }

    fn exit_initialization(&mut self) -> Result<(), Fault> {
        let config = self.configured()?;
        self.port()?;
        self.close().map_err(not_started)?;
        // from here on the elements cannot go back
        self.phase = Phase::Terminated;
        self.sweeper
            .each(|_, instance| instance.exit_initialization())
            .map_err(|e| not_started(refused(e)))?;
        self.run = Some(Run::start(&mut self.sweeper, &config).map_err(|e| not_started(refused(e)))?);
        self.warnings = self.scene.warnings(&config);
        for (name, instance) in self.sweeper.names.iter().zip(&self.sweeper.instances) {
            self.warnings.extend(instance.messages().into_iter().map(|message| format!("{name}: {message}")));
        }
        self.config = config;
        self.flags.shown = true;
        self.reset_seen = self.reset_signal();
        self.history.clear();
        self.history.push(self.start_time, &self.given);
        self.count();
        self.phase = self.interface.after_initialization();
        Ok(())
    }

    fn terminate(&mut self) {
        // what can be read afterwards is what belongs to this time; where it has no value the elements stay as they are
        let _ = self.show();
        self.phase = Phase::Terminated;
    }

    fn reset(&mut self) -> Result<(), Fault> {
        self.backup.forget(&mut self.sweeper);
        self.sweeper = self.scene.instantiate(&self.config, &[]).map_err(refused)?;
        self.start_over();
        Ok(())
    }

    fn get_float64(&mut self, references: &[u32], values: &mut [f64]) -> Result<(), Fault> {
        self.read(references, values)
    }

    fn get_whole(
        &mut self,
        references: &[u32],
        called: &'static str,
        is: impl Fn(Kind) -> bool,
        put: impl FnMut(usize, f64) -> bool,
    ) -> Result<(), Fault> {
        self.read_whole(references, called, is, put)
    }

    fn set(
        &mut self,
        references: &[u32],
        called: &'static str,
        is: impl Fn(Kind) -> bool,
        value: impl Fn(usize) -> f64,
    ) -> Result<(), Fault> {
        self.write(references, called, is, value)
    }

    fn dependencies(&self, reference: u32) -> Result<Vec<usize>, Fault> {
        self.layout.table.variable(reference)?;
        Ok(self.layout.table.dependencies(reference as usize))
    }

    fn directional_derivative(
        &mut self,
        _unknowns: &[u32],
        _knowns: &[u32],
        _seed: &[f64],
        _sensitivity: &mut [f64],
    ) -> Result<(), Fault> {
        Err(Fault::Unsupported { reason: "directional derivatives are not declared" })
    }

    fn save(&mut self) -> Result<Box<AssemblyState>, Fault> {
        Ok(Box::new(self.saved()?))
    }

    fn save_into(&mut self, copy: &mut AssemblyState) -> Result<(), Fault> {
        *copy = self.saved()?;
        Ok(())
    }

    fn restore(&mut self, saved: &AssemblyState) -> Result<(), Fault> {
        self.restored(saved)
    }

    fn serialise(&self, saved: &AssemblyState) -> Result<Vec<u8>, Fault> {
        Ok(self.layout.table.framed(saved)?)
    }

    fn deserialise(&self, bytes: &[u8]) -> Result<Box<AssemblyState>, Fault> {
        self.unpacked(bytes)
    }

    fn enter_event_mode(&mut self) -> Result<(), Fault> {
        self.phase = Phase::EventMode;
        Ok(())
    }

    fn update_discrete_states(&mut self) -> Result<Event, Fault> {
        self.show()?;
        self.see_reset();
        let next = self.run.as_ref().and_then(|run| run.next_event);
        Ok(Event { again: false, states_changed: false, next })
    }

    fn enter_step_mode(&mut self) -> Result<(), Fault> {
        self.port()?;
        self.inputs.clone_from(&self.given);
        self.history.push(self.values[0], &self.given);
        self.phase = Phase::StepMode;
        Ok(())
    }

    fn do_step(&mut self, t: f64, step: f64) -> Result<bool, Fault> {
        let to = times::end_of_step(self.values[0], self.stop_time, t, step)?;
        self.step_to(to)?;
        Ok(false) // events are carried out inside
    }
}
