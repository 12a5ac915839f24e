//! Carries out calls and judges every single answer.

#![allow(clippy::unnecessary_wraps, reason = "one type of answer for all calls")]

use std::ffi::CString;

use fmi_capi::{DISCARD, ERROR, OK, Status, WARNING, status_name};

use crate::api::{Api, Array, Handle, Inquiry, SavedState, Transition};
use crate::call::{Action, At, Call};
use crate::description::{Causality, Description, Variable};
use crate::expect::{Expected, Offence, check_message};
use crate::standard::{self, Function, Interface, Phase, Verdict, Version};
use crate::watchdog;

/// Places for instances and for saved states.
pub(crate) const SLOTS: usize = 3;
pub(crate) const STORES: usize = 3;

/// An FMU to be tested.
pub(crate) struct Fmu {
    pub(crate) api: Api,
    pub(crate) description: Description,
    pub(crate) token: CString,
    /// The serialised state of another FMU; may be empty
    pub(crate) foreign: Vec<u8>,
}

/// What is known about an instance; a saved state carries it too.
#[derive(Debug, Clone)]
pub(crate) struct Known {
    pub(crate) interface: Interface,
    pub(crate) phase: Phase,
    pub(crate) time: f64,
    pub(crate) stop: Option<f64>,
    /// Start values and what was set; for parameters always, for inputs until the first step
    pub(crate) values: Vec<f64>,
    pub(crate) stepped: bool,
}

impl Known {
    fn new(interface: Interface, description: &Description) -> Self {
        Self {
            interface,
            phase: Phase::Instantiated,
            time: 0.0,
            stop: None,
            values: description.variables.iter().map(|v| v.start.unwrap_or(0.0)).collect(),
            stepped: false,
        }
    }

    /// True if Get must give the value in `values`.
    pub(crate) fn knows(&self, variable: &Variable) -> bool {
        match variable.causality {
            Causality::Parameter => true,
            Causality::Input => !self.stepped,
            _ => self.phase == Phase::Instantiated && variable.start.is_some(),
        }
    }
}

pub(crate) struct Slot {
    pub(crate) handle: Handle,
    pub(crate) known: Known,
    /// Log categories asked for
    pub(crate) categories: Option<Vec<String>>,
}

/// A saved state, what is known about it and what could be read when it was saved.
pub(crate) struct Store {
    pub(crate) state: SavedState,
    pub(crate) known: Option<Known>,
    pub(crate) observed: Option<Vec<u64>>,
}

/// What a call gave: its status and everything it wrote.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Record {
    pub(crate) status: Status,
    pub(crate) data: Vec<u64>,
}

impl Record {
    pub(crate) fn refused(&self) -> bool {
        self.status == DISCARD || self.status == ERROR
    }
}

/// An answer that is wrong.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Violation {
    /// Place of the call in the sequence
    pub(crate) call: usize,
    pub(crate) text: String,
}

/// A run of a sequence: instances, saved states, what was seen.
pub(crate) struct Machine<'a> {
    pub(crate) fmu: &'a Fmu,
    pub(crate) slots: [Option<Slot>; SLOTS],
    pub(crate) stores: [Store; STORES],
    /// Read everything at Save and after Restore, and compare
    pub(crate) observe: bool,
}

/// A call's status, what it wrote, and what was expected; an error is a violation.
pub(crate) type Answer = Result<(Record, Expected), String>;

impl<'a> Machine<'a> {
    pub(crate) fn new(fmu: &'a Fmu, observe: bool) -> Self {
        let store = || Store { state: SavedState::NONE, known: None, observed: None };
        Self { fmu, slots: [const { None }; SLOTS], stores: std::array::from_fn(|_| store()), observe }
    }

    /// Carry out the calls that `keep` names; at the end everything is read once more.
    pub(crate) fn run(
        fmu: &'a Fmu,
        calls: &[Call],
        observe: bool,
        keep: impl Fn(usize) -> bool,
    ) -> Result<Vec<Option<Record>>, Violation> {
        let mut machine = Self::new(fmu, observe);
        let mut records = Vec::with_capacity(calls.len() + SLOTS);
        for (i, call) in calls.iter().enumerate() {
            let record = if keep(i) { Some(machine.step(i, call)?) } else { None };
            records.push(record);
        }
        for slot in 0..SLOTS {
            let last = Call { slot, action: Action::Observe };
            records.push(Some(machine.step(calls.len() + slot, &last)?));
        }
        Ok(records)
    }

    fn step(&mut self, i: usize, call: &Call) -> Result<Record, Violation> {
        let violation = |text| Violation { call: i, text };
        let _guard = watchdog::enter(i);
        let (record, expected) = self.carry_out(call).map_err(violation)?;
        let status = record.status;
        if !expected.allows(status) {
            return Err(violation(format!(
                "{} where {expected} is right; said: {:?}",
                status_name(status),
                self.messages(call.slot).iter().map(ToString::to_string).collect::<Vec<_>>()
            )));
        }
        let messages = self.messages(call.slot);
        if (record.refused() || status == WARNING)
            && let Some(slot) = &self.slots[call.slot]
        {
            check_message(status, slot.categories.as_deref(), &messages, &expected.offences)
                .map_err(violation)?;
        }
        Ok(record)
    }

    fn messages(&self, slot: usize) -> Vec<fmi_capi::Message> {
        self.slots[slot].as_ref().map_or_else(Vec::new, |slot| slot.handle.log().take())
    }

    pub(crate) fn handle(&self, slot: usize) -> Option<&Handle> {
        self.slots[slot].as_ref().map(|slot| &slot.handle)
    }

    pub(crate) fn known(&self, slot: usize) -> Option<&Known> {
        self.slots[slot].as_ref().map(|slot| &slot.known)
    }

    pub(crate) fn known_mut(&mut self, slot: usize) -> Option<&mut Known> {
        self.slots[slot].as_mut().map(|slot| &mut slot.known)
    }

    /// What the state machine says about a function; calls without an instance are wrong.
    pub(crate) fn rule(&self, slot: usize, function: Function) -> Expected {
        let Some(known) = self.known(slot) else { return Expected::error() };
        match standard::may(function, known.interface, known.phase) {
            Verdict::Allowed => Expected::ok(),
            Verdict::Forbidden => Expected::error(),
            Verdict::Open => Expected::ok().or(ERROR),
        }
    }

    fn carry_out(&mut self, call: &Call) -> Answer {
        let Call { slot, action } = call;
        let slot = *slot;
        match action {
            Action::Instantiate(interface) => self.instantiate(slot, *interface),
            Action::InstantiateWrongly(interface) => self.instantiate_wrongly(*interface),
            Action::Free => {
                let handle = self.slots[slot].take().map(|slot| slot.handle);
                self.fmu.api.free(handle);
                Ok((Record::default(), Expected::ok()))
            }
            Action::SetDebugLogging { on, categories } => self.set_debug_logging(slot, *on, categories),
            Action::EnterInitialization { start, stop } => self.enter_initialization(slot, *start, *stop),
            Action::Transition(transition) => self.transition(slot, *transition),
            Action::UpdateDiscreteStates { null } => self.update(slot, *null),
            Action::CompletedIntegratorStep { null } => self.completed_step(slot, *null),
            Action::DoStep { at, step, null } => self.do_step(slot, *at, *step, *null),
            Action::SetTime(at) => self.set_time(slot, *at),
            Action::Get { access, references, spoil } => self.get(slot, *access, references, *spoil),
            Action::Set { access, values, spoil } => self.set(slot, *access, values, *spoil),
            Action::GetList { list, spoil } => self.get_list(slot, *list, *spoil),
            Action::SetStates { values, spoil } => self.set_states(slot, values, *spoil),
            Action::Count { states, null } => self.count(slot, *states, *null),
            Action::Euler(h) => self.euler(slot, *h),
            Action::Directional { adjoint, unknowns, knowns, spoil } => {
                self.directional(slot, *adjoint, unknowns, knowns, *spoil)
            }
            Action::Dependencies { reference, n } => self.dependencies(slot, *reference, *n),
            Action::Save(store) => self.save(slot, *store),
            Action::Restore(store) => self.restore(slot, *store),
            Action::FreeState(store) => self.free_state(slot, *store),
            Action::Serialize { store, mutation } => self.serialize(slot, *store, *mutation),
            Action::Inquire { inquiry, kind, null } => self.inquire(slot, *inquiry, *kind, *null),
            Action::Observe => Ok((Record { status: OK, data: self.observe(slot)? }, Expected::ok())),
        }
    }

    fn instantiate(&mut self, slot: usize, interface: Interface) -> Answer {
        self.fmu.api.free(self.slots[slot].take().map(|slot| slot.handle));
        let possible = !interface.is_model_exchange() || self.fmu.description.model_exchange;
        match self.fmu.api.instantiate(interface, &self.fmu.token) {
            Ok(handle) => {
                let known = Known::new(interface, &self.fmu.description);
                self.slots[slot] = Some(Slot { handle, known, categories: None });
                let expected = if possible { Expected::ok() } else { Expected::error() };
                Ok((Record::default(), expected))
            }
            Err(log) if log.take().is_empty() => Err("no instance, and nothing was said about it".into()),
            Err(_) if possible => Err("no instance".into()),
            Err(_) => Ok((Record { status: ERROR, data: Vec::new() }, Expected::error())),
        }
    }

    fn instantiate_wrongly(&self, interface: Interface) -> Answer {
        match self.fmu.api.instantiate(interface, c"{00000000-0000-0000-0000-000000000000}") {
            Ok(handle) => {
                self.fmu.api.free(Some(handle));
                Err("an instance in spite of a wrong token".into())
            }
            Err(log) if log.take().is_empty() => Err("a wrong token was refused without a word".into()),
            Err(_) => Ok((Record::default(), Expected::ok())), // the instance in the place is not concerned
        }
    }

    fn set_debug_logging(&mut self, slot: usize, on: bool, categories: &[String]) -> Answer {
        let mut expected = self.rule(slot, Function::SetDebugLogging);
        let declared = &self.fmu.description.categories;
        if categories.iter().any(|c| !declared.contains(c)) {
            expected = Expected::error();
        }
        let status = self.fmu.api.set_debug_logging(self.handle(slot), on, categories);
        if status == OK
            && let Some(slot) = &mut self.slots[slot]
        {
            slot.categories = match (on, categories.is_empty()) {
                (true, true) => None,
                (true, false) => {
                    let before = slot.categories.take().unwrap_or_default();
                    Some([before, categories.to_vec()].concat())
                }
                (false, true) => Some(Vec::new()),
                (false, false) => {
                    let mut left = slot.categories.take().unwrap_or_else(|| declared.clone());
                    left.retain(|c| !categories.contains(c));
                    Some(left)
                }
            };
        }
        Ok((Record { status, data: Vec::new() }, expected))
    }

    fn enter_initialization(&mut self, slot: usize, start: f64, stop: Option<f64>) -> Answer {
        let mut expected = self.rule(slot, Function::EnterInitialization);
        if !start.is_finite() || stop.is_some_and(|stop| !(stop.is_finite() && stop > start)) {
            expected = Expected::error();
        }
        let status = self.fmu.api.enter_initialization(self.handle(slot), start, stop);
        if let (OK, Some(known)) = (status, self.known_mut(slot)) {
            (known.phase, known.time, known.stop) = (Phase::Initialization, start, stop);
        }
        Ok((Record { status, data: Vec::new() }, expected))
    }

    fn transition(&mut self, slot: usize, transition: Transition) -> Answer {
        let function = match transition {
            Transition::ExitInitialization => Function::ExitInitialization,
            Transition::EnterEventMode => Function::EnterEventMode,
            Transition::EnterStepMode => Function::EnterStepMode,
            Transition::EnterContinuousTimeMode => Function::EnterContinuousTimeMode,
            Transition::Terminate => Function::Terminate,
            Transition::Reset => Function::Reset,
            _ => Function::Undeclared,
        };
        let mut expected = self.rule(slot, function);
        if expected.allows(OK) {
            expected = match function {
                // parameters that do not fit together, or no start: Error; warnings are possible
                Function::ExitInitialization => expected.or(WARNING).or(ERROR),
                // the tunable parameters of the inputs' treatment may have become unfit
                Function::EnterStepMode => expected.or(ERROR),
                // equations may have no value there
                Function::EnterEventMode | Function::EnterContinuousTimeMode => expected.or(DISCARD),
                _ => expected,
            };
        }
        let status = self.fmu.api.transition(self.handle(slot), transition);
        let description = &self.fmu.description;
        if (status == OK || status == WARNING)
            && let Some(slot) = &mut self.slots[slot]
            && let Some(phase) = standard::after(function, slot.known.interface)
        {
            slot.known.phase = phase;
            if function == Function::Reset {
                slot.known = Known::new(slot.known.interface, description);
            }
        }
        Ok((Record { status, data: Vec::new() }, expected))
    }

    fn update(&mut self, slot: usize, null: Option<usize>) -> Answer {
        let mut expected = self.rule(slot, Function::UpdateDiscreteStates);
        if null.is_some() {
            expected = Expected::error();
        } else if expected.allows(OK) {
            // a sample of a command that makes no sense may be worth a warning
            expected = expected.or(DISCARD).or(WARNING);
        }
        let (status, updated) = self.fmu.api.update(self.handle(slot), null);
        if status != OK && status != WARNING {
            return Ok((Record { status, data: Vec::new() }, expected));
        }
        if updated.flags.iter().any(|flag| *flag > 1) || !updated.next.is_finite() {
            return Err(format!("fmi3UpdateDiscreteStates left arguments out: {updated:?}"));
        }
        let mut data = updated.flags.map(u64::from).to_vec();
        data.push(updated.next.to_bits());
        Ok((Record { status, data }, expected))
    }

    fn completed_step(&mut self, slot: usize, null: Option<usize>) -> Answer {
        let mut expected = self.rule(slot, Function::CompletedIntegratorStep);
        if null.is_some() {
            expected = Expected::error();
        } else if expected.allows(OK) {
            expected = expected.or(DISCARD);
        }
        let (status, flags) = self.fmu.api.completed_step(self.handle(slot), null);
        if status == OK && flags.iter().any(|flag| *flag > 1) {
            return Err("fmi3CompletedIntegratorStep left arguments out".into());
        }
        let data = if status == OK { flags.map(u64::from).to_vec() } else { Vec::new() };
        Ok((Record { status, data }, expected))
    }

    /// The time that a call means.
    pub(crate) fn time(&self, slot: usize, at: At) -> f64 {
        let now = self.known(slot).map_or(0.0, |known| known.time);
        match at {
            At::Now => now,
            At::After(h) => now + h,
            At::Absolute(t) => t,
        }
    }

    /// Step arguments: right, wrong, or within the rounding that a product may tolerate.
    fn step_arguments(known: &Known, t: f64, step: f64) -> Verdict {
        let (now, to) = (known.time, t + step);
        let near = |a: f64, b: f64| (a - b).abs() <= 1e-6 * b.abs().max(1.0);
        if !(step > 0.0 && to.is_finite() && to > now && near(t, now)) {
            return Verdict::Forbidden;
        }
        match known.stop {
            Some(stop) if to > stop && !near(to, stop) => Verdict::Forbidden,
            Some(stop) if to > stop => Verdict::Open,
            _ if t.to_bits() == now.to_bits() => Verdict::Allowed,
            _ => Verdict::Open,
        }
    }

    fn do_step(&mut self, slot: usize, at: At, step: f64, null: Option<usize>) -> Answer {
        let t = self.time(slot, at);
        let mut expected = self.rule(slot, Function::DoStep);
        if let Some(known) = self.known(slot)
            && expected.allows(OK)
        {
            expected = match Self::step_arguments(known, t, step) {
                Verdict::Forbidden => Expected::error(),
                Verdict::Open => expected.or(DISCARD).or(ERROR),
                Verdict::Allowed if self.treatment_is_unfit(known) => Expected::error(),
                Verdict::Allowed => expected.or(DISCARD),
            };
            // a command that makes no sense may be worth a warning
            if expected.allows(OK) {
                expected = expected.or(WARNING);
            }
        }
        if null.is_some() {
            expected = Expected::error();
        }
        let (status, stepped) = self.fmu.api.do_step(self.handle(slot), (t, step), null);
        let Some(known) = self.known_mut(slot) else {
            return Ok((Record { status, data: Vec::new() }, expected));
        };
        if status == DISCARD && stepped.last.to_bits() != known.time.to_bits() {
            return Err(format!(
                "a discarded step from {} ends at lastSuccessfulTime {}",
                known.time, stepped.last
            ));
        }
        if status != OK && status != WARNING {
            return Ok((Record { status, data: Vec::new() }, expected));
        }
        let events = known.interface == Interface::CoSimulationWithEvents;
        let flags = stepped.event <= u8::from(events) && stepped.terminate == 0 && stepped.early == 0;
        if !flags || stepped.last.to_bits() != (t + step).to_bits() {
            return Err(format!("a step from {t} by {step} answers {stepped:?}"));
        }
        (known.time, known.stepped) = (stepped.last, true);
        Ok((Record { status, data: vec![u64::from(stepped.event), stepped.last.to_bits()] }, expected))
    }

    /// True if `port.order` is none of those that `port.inputs` allows (coupling.md section 2).
    #[allow(clippy::cast_possible_truncation, reason = "small whole numbers")]
    fn treatment_is_unfit(&self, known: &Known) -> bool {
        let value = |name: &str| {
            let place = self.fmu.description.variables.iter().position(|v| v.name == name)?;
            Some(known.values[place] as i64)
        };
        match (value("port.inputs"), value("port.order")) {
            (Some(2), Some(order)) => !(0..=2).contains(&order),
            (Some(3), Some(order)) => !(1..=3).contains(&order),
            _ => false,
        }
    }

    fn set_time(&mut self, slot: usize, at: At) -> Answer {
        let t = self.time(slot, at);
        let mut expected = self.rule(slot, Function::SetTime);
        if !t.is_finite() {
            expected = Expected::error();
        }
        let status = self.fmu.api.set_time(self.handle(slot), t);
        if let (OK, Some(known)) = (status, self.known_mut(slot)) {
            known.time = t;
        }
        Ok((Record { status, data: Vec::new() }, expected))
    }

    /// States and derivatives are read, one step is set.
    fn euler(&mut self, slot: usize, h: f64) -> Answer {
        use crate::api::Lists;
        let n = self.fmu.description.states;
        let (mut x, mut rates) = (vec![0.0; n], vec![0.0; n]);
        let mut expected = self.rule(slot, Function::SetContinuousStates);
        if expected.allows(OK) {
            expected = expected.or(DISCARD);
        } else {
            // outside of Continuous-Time Mode the last call decides
            let status = self.fmu.api.set_states(self.handle(slot), Array::new(&mut x, false));
            return Ok((Record { status, data: Vec::new() }, expected));
        }
        for (list, values) in [(Lists::States, &mut x), (Lists::Derivatives, &mut rates)] {
            let status = self.fmu.api.list(self.handle(slot), list, Array::new(values, false));
            if status != OK {
                return Ok((Record { status, data: Vec::new() }, expected));
            }
        }
        let t = self.time(slot, At::After(h));
        for (x, rate) in x.iter_mut().zip(&rates) {
            *x += h * rate;
        }
        if !t.is_finite() || x.iter().any(|x| !x.is_finite()) {
            return Ok((Record::default(), expected));
        }
        let status = self.fmu.api.set_time(self.handle(slot), t);
        let status = status.max(self.fmu.api.set_states(self.handle(slot), Array::new(&mut x, false)));
        if let (OK, Some(known)) = (status, self.known_mut(slot)) {
            known.time = t;
        }
        Ok((Record { status, data: x.into_iter().map(f64::to_bits).collect() }, Expected::ok()))
    }

    /// Questions about the last step: steps are done when they return, so only two have an answer.
    fn inquire(&mut self, slot: usize, inquiry: Inquiry, kind: i32, null: bool) -> Answer {
        let (rule, known) = (self.rule(slot, Function::Inquiry), self.known(slot));
        let expected = match (inquiry, kind) {
            (Inquiry::InputDerivatives | Inquiry::OutputDerivatives, _) => Expected::error(),
            (Inquiry::Real, 2) | (Inquiry::Boolean, 3) if null => Expected::error(),
            (Inquiry::Real, 2) | (Inquiry::Boolean, 3) => rule,
            _ if rule.allows(OK) => Expected::discard(),
            _ => rule,
        };
        let answer = if inquiry == Inquiry::Real { known.map_or(0, |known| known.time.to_bits()) } else { 0 };
        let (status, bits) = self.fmu.api.inquire(self.handle(slot), inquiry, kind, null);
        if status == OK && bits != answer {
            return Err(format!("the answer is {bits:x}, {answer:x} is right"));
        }
        Ok((Record { status, data: Vec::new() }, expected))
    }

    /// An offence of a reference that does not exist.
    pub(crate) fn unknown(reference: u32) -> Offence {
        Offence::error(vec![reference.to_string()])
    }
}

impl Drop for Machine<'_> {
    fn drop(&mut self) {
        let spare =
            if self.stores.iter().any(|s| !s.state.is_null()) && self.slots.iter().all(Option::is_none) {
                {
                    let interface = match self.fmu.description.version {
                        Version::Fmi2 => Interface::CoSimulation2,
                        Version::Fmi3 => Interface::CoSimulation,
                    };
                    self.fmu.api.instantiate(interface, &self.fmu.token).ok()
                }
            } else {
                None
            };
        let live = self.slots.iter().flatten().map(|slot| &slot.handle).next().or(spare.as_ref());
        for store in &mut self.stores {
            if !store.state.is_null() {
                self.fmu.api.free_state(live, &mut store.state);
            }
        }
        for slot in &mut self.slots {
            if let Some(slot) = slot.take() {
                self.fmu.api.free(Some(slot.handle));
            }
        }
        if spare.is_some() {
            self.fmu.api.free(spare);
        }
    }
}
