//! Instances of FMI 2.0 and 3.0 behind one interface, with their calls counted.

use std::fmt;
use std::rc::Rc;

use super::binding::{Fault, Identity, Library, Stepped, Update, fmi2, fmi3};
use super::{Capabilities, Fmu, Value, VariableKind};

/// How an instance is used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interface {
    /// The FMU holds its solver; Event Mode is used where there is one
    CoSimulation,
    /// The same without Event Mode, as a plain host does it
    PlainCoSimulation,
    /// The host holds the solver
    ModelExchange,
}

impl fmt::Display for Interface {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::CoSimulation | Self::PlainCoSimulation => "Co-Simulation",
            Self::ModelExchange => "Model Exchange",
        })
    }
}

/// Calls of each kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Counts {
    /// Get of values
    pub get: u64,
    /// Set of values
    pub set: u64,
    /// Set of time and of continuous states, Get of derivatives and of event indicators, completed steps
    pub exchange: u64,
    /// Steps of Co-Simulation
    pub do_step: u64,
    /// Changes of mode and updates of discrete states
    pub mode: u64,
    /// Saved states
    pub save: u64,
    /// Restored states
    pub restore: u64,
    /// Directional derivatives
    pub derivatives: u64,
}

impl Counts {
    /// All calls.
    #[must_use]
    pub fn total(&self) -> u64 {
        let Self { get, set, exchange, do_step, mode, save, restore, derivatives } = self;
        get + set + exchange + do_step + mode + save + restore + derivatives
    }
}

impl std::ops::AddAssign for Counts {
    fn add_assign(&mut self, other: Self) {
        self.get += other.get;
        self.set += other.set;
        self.exchange += other.exchange;
        self.do_step += other.do_step;
        self.mode += other.mode;
        self.save += other.save;
        self.restore += other.restore;
        self.derivatives += other.derivatives;
    }
}

enum Version {
    V2(fmi2::Instance),
    V3(fmi3::Instance),
}

/// A saved state; only for the instance that made it.
pub struct Saved(SavedVersion);

enum SavedVersion {
    V2(fmi2::Saved),
    V3(fmi3::Saved),
}

/// A live instance of an FMU.
pub struct Instance {
    inner: Version,
    fmu: Rc<Fmu>,
    interface: Interface,
    counts: Counts,
}

/// The same call in both versions.
macro_rules! both {
    ($self:ident, $i:ident => $call:expr) => {
        match &mut $self.inner {
            Version::V2($i) => $call,
            Version::V3($i) => $call,
        }
    };
}

impl Instance {
    pub(super) fn new(
        fmu: Rc<Fmu>,
        library: &Library,
        identity: &Identity<'_>,
        interface: Interface,
    ) -> Result<Self, (Fault, Vec<String>)> {
        let events =
            interface == Interface::CoSimulation && fmu.capabilities(interface).is_some_and(|c| c.event_mode);
        let inner = match (library, interface) {
            (Library::V2(l), Interface::ModelExchange) => {
                Version::V2(fmi2::Instance::model_exchange(l, identity)?)
            }
            (Library::V2(l), _) => Version::V2(fmi2::Instance::co_simulation(l, identity)?),
            (Library::V3(l), Interface::ModelExchange) => {
                Version::V3(fmi3::Instance::model_exchange(l, identity)?)
            }
            (Library::V3(l), _) => Version::V3(fmi3::Instance::co_simulation(l, identity, events)?),
        };
        Ok(Self { inner, fmu, interface, counts: Counts::default() })
    }

    /// The FMU it belongs to.
    #[must_use]
    pub fn fmu(&self) -> &Fmu {
        &self.fmu
    }

    /// What it can do.
    ///
    /// # Panics
    /// Never: an instance exists only for an interface that its FMU declares.
    #[must_use]
    pub fn capabilities(&self) -> &Capabilities {
        #[allow(clippy::expect_used, reason = "see above")]
        self.fmu.capabilities(self.interface).expect("declared")
    }

    /// Whether it has an Event Mode as it is used.
    #[must_use]
    pub fn has_event_mode(&self) -> bool {
        match self.interface {
            Interface::CoSimulation => self.capabilities().event_mode,
            Interface::PlainCoSimulation => false,
            Interface::ModelExchange => true,
        }
    }

    /// Calls so far.
    #[must_use]
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// Counts from zero again.
    pub fn reset_counts(&mut self) {
        self.counts = Counts::default();
    }

    /// What the FMU has said since the last time.
    #[must_use]
    pub fn messages(&self) -> Vec<String> {
        match &self.inner {
            Version::V2(i) => i.messages(),
            Version::V3(i) => i.messages(),
        }
    }
}

/// The functions of the C interface; errors are those of the FMU.
#[allow(clippy::missing_errors_doc, reason = "stated once above")]
impl Instance {
    /// Into Initialization Mode.
    pub fn enter_initialization(&mut self, start: f64, stop: Option<f64>) -> Result<(), Fault> {
        self.counts.mode += 1;
        both!(self, i => i.enter_initialization(start, stop))
    }

    /// Out of Initialization Mode.
    pub fn exit_initialization(&mut self) -> Result<(), Fault> {
        self.counts.mode += 1;
        both!(self, i => i.exit_initialization())
    }

    /// Into Event Mode.
    pub fn enter_event_mode(&mut self) -> Result<(), Fault> {
        self.counts.mode += 1;
        both!(self, i => i.enter_event_mode())
    }

    /// Into Step Mode; FMI 2.0 knows no other.
    pub fn enter_step_mode(&mut self) -> Result<(), Fault> {
        self.counts.mode += 1;
        match &mut self.inner {
            Version::V2(_) => Ok(()),
            Version::V3(i) => i.enter_step_mode(),
        }
    }

    /// Into Continuous-Time Mode.
    pub fn enter_continuous_time_mode(&mut self) -> Result<(), Fault> {
        self.counts.mode += 1;
        both!(self, i => i.enter_continuous_time_mode())
    }

    /// Ends the run.
    pub fn terminate(&mut self) -> Result<(), Fault> {
        both!(self, i => i.terminate())
    }

    /// Carries out an event.
    pub fn update_discrete_states(&mut self) -> Result<Update, Fault> {
        self.counts.mode += 1;
        both!(self, i => i.update_discrete_states())
    }

    /// One communication step; `may_restore`: a state saved before may come back.
    pub fn do_step(&mut self, t: f64, h: f64, may_restore: bool) -> Result<Stepped, Fault> {
        self.counts.do_step += 1;
        both!(self, i => i.do_step(t, h, may_restore))
    }

    /// Reads reals.
    #[inline]
    pub fn get(&mut self, references: &[u32], values: &mut [f64]) -> Result<(), Fault> {
        self.counts.get += 1;
        both!(self, i => i.get_real(references, values))
    }

    /// Writes reals.
    #[inline]
    pub fn set(&mut self, references: &[u32], values: &[f64]) -> Result<(), Fault> {
        self.counts.set += 1;
        both!(self, i => i.set_real(references, values))
    }

    /// Reads one value of any kind as a number.
    pub fn get_number(&mut self, kind: VariableKind, reference: u32) -> Result<f64, Fault> {
        self.counts.get += 1;
        both!(self, i => i.get_number(kind, reference))
    }

    /// Writes a start value or parameter.
    pub fn set_value(&mut self, kind: VariableKind, reference: u32, value: &Value) -> Result<(), Fault> {
        self.counts.set += 1;
        both!(self, i => i.set_value(kind, reference, value))
    }

    /// Time of the following evaluations.
    #[inline]
    pub fn set_time(&mut self, t: f64) -> Result<(), Fault> {
        self.counts.exchange += 1;
        both!(self, i => i.set_time(t))
    }

    /// Writes all continuous states.
    #[inline]
    pub fn set_states(&mut self, x: &[f64]) -> Result<(), Fault> {
        self.counts.exchange += 1;
        both!(self, i => i.set_states(x))
    }

    /// Reads all continuous states.
    pub fn get_states(&mut self, x: &mut [f64]) -> Result<(), Fault> {
        self.counts.exchange += 1;
        both!(self, i => i.get_states(x))
    }

    /// Reads the derivatives of all continuous states.
    #[inline]
    pub fn get_derivatives(&mut self, dx: &mut [f64]) -> Result<(), Fault> {
        self.counts.exchange += 1;
        both!(self, i => i.get_derivatives(dx))
    }

    /// Reads the typical magnitudes of all continuous states.
    pub fn get_nominals(&mut self, nominals: &mut [f64]) -> Result<(), Fault> {
        both!(self, i => i.get_nominals(nominals))
    }

    /// Number of event indicators.
    pub fn number_of_indicators(&mut self) -> Result<usize, Fault> {
        match &mut self.inner {
            Version::V2(_) => Ok(self.fmu.description.indicators),
            Version::V3(i) => i.number_of_indicators(),
        }
    }

    /// Reads the event indicators.
    pub fn get_indicators(&mut self, z: &mut [f64]) -> Result<(), Fault> {
        self.counts.exchange += 1;
        both!(self, i => i.get_indicators(z))
    }

    /// A step of the integrator is accepted: whether the FMU wants Event Mode, and whether it wants to end.
    pub fn completed_step(&mut self) -> Result<(bool, bool), Fault> {
        self.counts.exchange += 1;
        both!(self, i => i.completed_step())
    }

    /// Saves the state into `into`, whose room is used again.
    pub fn save(&mut self, into: &mut Option<Saved>) -> Result<(), Fault> {
        self.counts.save += 1;
        match &mut self.inner {
            Version::V2(i) => {
                let mut saved = match into.take() {
                    Some(Saved(SavedVersion::V2(saved))) => Some(saved),
                    _ => None,
                };
                i.save(&mut saved)?;
                *into = saved.map(|s| Saved(SavedVersion::V2(s)));
            }
            Version::V3(i) => {
                let mut saved = match into.take() {
                    Some(Saved(SavedVersion::V3(saved))) => Some(saved),
                    _ => None,
                };
                i.save(&mut saved)?;
                *into = saved.map(|s| Saved(SavedVersion::V3(s)));
            }
        }
        Ok(())
    }

    /// Goes back to a saved state of this instance.
    pub fn restore(&mut self, saved: &Saved) -> Result<(), Fault> {
        self.counts.restore += 1;
        match (&mut self.inner, &saved.0) {
            (Version::V2(i), SavedVersion::V2(s)) => i.restore(s),
            (Version::V3(i), SavedVersion::V3(s)) => i.restore(s),
            _ => Err(Fault { function: "SetFMUState", status: super::Status::Null }),
        }
    }

    /// Gives the room of a saved state back.
    pub fn forget(&mut self, saved: Saved) -> Result<(), Fault> {
        match (&mut self.inner, saved.0) {
            (Version::V2(i), SavedVersion::V2(s)) => i.forget(s),
            (Version::V3(i), SavedVersion::V3(s)) => i.forget(s),
            _ => Err(Fault { function: "FreeFMUState", status: super::Status::Null }),
        }
    }

    /// The present state as bytes, for another instance of the same FMU too.
    pub fn save_bytes(&mut self) -> Result<Vec<u8>, Fault> {
        self.counts.save += 1;
        both!(self, i => {
            let mut saved = None;
            i.save(&mut saved)?;
            let bytes = saved.as_ref().map_or(Ok(Vec::new()), |saved| i.serialise(saved));
            saved.map_or(Ok(()), |saved| i.forget(saved))?;
            bytes
        })
    }

    /// Goes back to a state from bytes.
    pub fn restore_bytes(&mut self, bytes: &[u8]) -> Result<(), Fault> {
        self.counts.restore += 1;
        both!(self, i => {
            let saved = i.deserialise(bytes)?;
            let result = i.restore(&saved);
            i.forget(saved)?;
            result
        })
    }

    /// `d unknowns / d knowns` times `seed`.
    pub fn directional(
        &mut self,
        unknowns: &[u32],
        knowns: &[u32],
        seed: &[f64],
        out: &mut [f64],
    ) -> Result<(), Fault> {
        self.counts.derivatives += 1;
        both!(self, i => i.directional(unknowns, knowns, seed, out))
    }
}
