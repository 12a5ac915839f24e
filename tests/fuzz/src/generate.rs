//! Sequences of calls from a seed: mostly a run that makes sense, with everything else in between.

use crate::api::{Inquiry, Lists, Transition};
use crate::call::{Access, Action, At, Call, Mutation, Spoil};
use crate::description::{Causality, Description, Kind, Range, Variable};
use crate::machine::{SLOTS, STORES};
use crate::random::Random;
use crate::standard::{self, Function, Interface, Phase, Version};

/// Longest sequence.
const MOST_CALLS: usize = 60;

/// Numbers that break things.
const ODD: [f64; 18] = [
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    1e308,
    -1e308,
    1e160,
    -1e160,
    5e-324,
    1e-310,
    0.0,
    -0.0,
    -1.0,
    1.0,
    1e-9,
    1e9,
    -1e9,
    1e16,
    f64::MAX,
];

/// Where an instance stands if everything that makes sense goes well.
#[derive(Clone, Copy)]
struct Place {
    interface: Interface,
    phase: Phase,
}

/// Makes a sequence.
pub(crate) struct Generator<'a> {
    random: Random,
    description: &'a Description,
    places: [Option<Place>; SLOTS],
}

/// The sequence of a seed.
pub(crate) fn sequence(seed: u64, description: &Description) -> Vec<Call> {
    let mut generator = Generator { random: Random::new(seed), description, places: [None; SLOTS] };
    let n = 4 + generator.random.below(MOST_CALLS - 3);
    let calls = (0..n).map(|_| generator.call());
    match description.version {
        Version::Fmi2 => calls.map(in_fmi2).collect(),
        Version::Fmi3 => calls.collect(),
    }
}

/// The call in FMI 2.0: one number counts both arrays, and some functions are not there.
fn in_fmi2(mut call: Call) -> Call {
    let one_number = |spoil: &mut Spoil| {
        if matches!(spoil, Spoil::OneMore | Spoil::OneLess) {
            *spoil = Spoil::Nothing;
        }
    };
    match &mut call.action {
        Action::Get { access: access @ Access::Int64, .. }
        | Action::Set { access: access @ Access::Int64, .. } => *access = Access::Int32,
        _ => {}
    }
    match &mut call.action {
        Action::Get { spoil, .. } | Action::Set { spoil, .. } => one_number(spoil),
        Action::Directional { spoil, adjoint, .. } => {
            one_number(spoil);
            *adjoint = false;
        }
        Action::DoStep { null, .. } => *null = None,
        Action::Transition(
            other @ (Transition::EnterStepMode
            | Transition::EnterConfigurationMode
            | Transition::ExitConfigurationMode),
        ) => *other = Transition::EvaluateDiscreteStates,
        Action::Count { .. } | Action::Dependencies { .. } => call.action = Action::Observe,
        _ => {}
    }
    call
}

impl Generator<'_> {
    fn call(&mut self) -> Call {
        let slot = if self.random.chance(70) { 0 } else { self.random.below(SLOTS) };
        let action = match self.places[slot] {
            _ if self.random.chance(12) => self.any(),
            None => Action::Instantiate(self.interface()),
            Some(place) => self.sensible(place),
        };
        self.follow(slot, &action);
        Call { slot, action }
    }

    fn interface(&mut self) -> Interface {
        let exchange = self.description.model_exchange;
        let offered = |interface: &&Interface| exchange || !interface.is_model_exchange();
        let of_version = Interface::of(self.description.version).iter().filter(offered);
        self.random.pick(&of_version.copied().collect::<Vec<_>>())
    }

    /// Where the instance is after the call.
    fn follow(&mut self, slot: usize, action: &Action) {
        let interface = self.places[slot].map(|place| place.interface);
        let function = match action {
            Action::Instantiate(interface) => {
                self.places[slot] = Some(Place { interface: *interface, phase: Phase::Instantiated });
                return;
            }
            Action::Free => {
                self.places[slot] = None;
                return;
            }
            Action::EnterInitialization { start, .. } if start.is_finite() => Function::EnterInitialization,
            Action::Transition(Transition::ExitInitialization) => Function::ExitInitialization,
            Action::Transition(Transition::EnterEventMode) => Function::EnterEventMode,
            Action::Transition(Transition::EnterStepMode) => Function::EnterStepMode,
            Action::Transition(Transition::EnterContinuousTimeMode) => Function::EnterContinuousTimeMode,
            Action::Transition(Transition::Terminate) => Function::Terminate,
            Action::Transition(Transition::Reset) => Function::Reset,
            _ => return,
        };
        if let (Some(interface), Some(place)) = (interface, &mut self.places[slot])
            && standard::may(function, interface, place.phase) == standard::Verdict::Allowed
            && let Some(phase) = standard::after(function, interface)
        {
            place.phase = phase;
        }
    }

    /// A call that belongs to the state.
    fn sensible(&mut self, place: Place) -> Action {
        let exchange = place.interface.is_model_exchange();
        let events = place.interface == Interface::CoSimulationWithEvents;
        let dice = self.random.below(100);
        match place.phase {
            Phase::Instantiated => match dice {
                0..45 => self.enter_initialization(),
                45..85 => self.set(place, 10),
                _ => self.get(),
            },
            Phase::Initialization => match dice {
                0..50 => Action::Transition(Transition::ExitInitialization),
                50..75 => self.set(place, 10),
                75..80 => self.state_call(),
                80..85 => self.directional(),
                _ => self.get(),
            },
            Phase::Step => match dice {
                0..45 => self.do_step(),
                45..65 => self.set(place, 25),
                65..75 => self.state_call(),
                75..80 => self.directional(),
                80..90 if events => Action::Transition(Transition::EnterEventMode),
                90..92 => Action::Transition(Transition::Terminate),
                _ => self.get(),
            },
            Phase::Event => match dice {
                0..25 => Action::UpdateDiscreteStates { null: None },
                25..55 if exchange => Action::Transition(Transition::EnterContinuousTimeMode),
                25..55 => Action::Transition(Transition::EnterStepMode),
                55..75 => self.set(place, 25),
                75..82 => self.state_call(),
                82..88 => self.directional(),
                88..90 => Action::Transition(Transition::Terminate),
                _ => self.get(),
            },
            Phase::ContinuousTime => match dice {
                0..40 => Action::Euler(self.step_size()),
                40..50 => Action::CompletedIntegratorStep { null: None },
                50..60 => self.get_list(),
                60..70 => self.set(place, 25),
                70..77 => self.state_call(),
                77..82 => self.directional(),
                82..92 => Action::Transition(Transition::EnterEventMode),
                92..94 => self.set_states(),
                _ => self.get(),
            },
            Phase::Terminated => match dice {
                0..40 => self.get(),
                40..70 => Action::Transition(Transition::Reset),
                70..85 => Action::Free,
                _ => self.state_call(),
            },
        }
    }

    /// Any call.
    fn any(&mut self) -> Action {
        let interface = self.interface();
        let place = Place { interface, phase: Phase::Event };
        match self.random.below(28) {
            0 => Action::Instantiate(interface),
            1 => Action::InstantiateWrongly(interface),
            2 => Action::Free,
            3 => self.set_debug_logging(),
            4 => self.enter_initialization(),
            5 | 6 => Action::Transition(self.random.pick(&[
                Transition::ExitInitialization,
                Transition::EnterEventMode,
                Transition::EnterStepMode,
                Transition::EnterContinuousTimeMode,
                Transition::Terminate,
                Transition::Reset,
                Transition::EnterConfigurationMode,
                Transition::ExitConfigurationMode,
                Transition::EvaluateDiscreteStates,
            ])),
            7 => {
                let null = self.null(6);
                Action::UpdateDiscreteStates { null }
            }
            8 => {
                let null = self.null(2);
                Action::CompletedIntegratorStep { null }
            }
            9 | 10 => self.do_step(),
            11 => {
                let at = self.at();
                Action::SetTime(at)
            }
            12 | 13 => self.get(),
            14..=16 => self.set(place, 50),
            17 => self.get_list(),
            18 => self.set_states(),
            19 => Action::Count { states: self.random.chance(50), null: self.random.chance(20) },
            20 => Action::Euler(self.step_size()),
            21 => self.directional(),
            22 => Action::Dependencies {
                reference: self.reference(),
                n: self.random.chance(30).then(|| self.random.below(40)),
            },
            23 | 24 => self.state_call(),
            25 | 26 if self.description.version == Version::Fmi2 => self.inquire(),
            _ => Action::Observe,
        }
    }

    /// Which of `n` pointers is null: mostly none.
    fn null(&mut self, n: usize) -> Option<usize> {
        self.random.chance(30).then(|| self.random.below(n))
    }

    fn spoil(&mut self) -> Spoil {
        match self.random.below(40) {
            0 => Spoil::NullReferences,
            1 => Spoil::NullValues,
            2 => Spoil::OneMore,
            3 => Spoil::OneLess,
            _ => Spoil::Nothing,
        }
    }

    fn set_debug_logging(&mut self) -> Action {
        let n = self.random.below(3);
        let known = self.description.categories.len();
        let categories = (0..n)
            .map(|_| match self.random.below(known + 1) {
                i if i < known => self.description.categories[i].clone(),
                _ => "nonsense".into(),
            })
            .collect();
        Action::SetDebugLogging { on: self.random.chance(70), categories }
    }

    fn enter_initialization(&mut self) -> Action {
        let start = match self.random.below(20) {
            0 => self.random.pick(&ODD),
            1..4 => 10.0 * self.random.unit(),
            _ => 0.0,
        };
        let stop = match self.random.below(10) {
            0 => Some(self.random.pick(&ODD)),
            1..6 => Some(start + self.description.stop),
            _ => None,
        };
        Action::EnterInitialization { start, stop }
    }

    fn at(&mut self) -> At {
        match self.random.below(20) {
            0 => At::Absolute(self.random.pick(&ODD)),
            1 => At::After(1e-12),
            2 => At::After(self.description.step * self.random.unit()),
            _ => At::Now,
        }
    }

    /// Of a host: from a quarter to sixteen times what is declared, odd ones now and then.
    fn step_size(&mut self) -> f64 {
        let declared = self.description.step;
        match self.random.below(40) {
            0 => self.random.pick(&ODD),
            1 => -declared,
            2 => declared * 1e-9,
            3 => f64::from_bits(self.random.bits()),
            _ => declared * self.random.pick(&[0.25, 0.5, 1.0, 1.0, 1.0, 2.0, 3.7, 16.0]),
        }
    }

    fn do_step(&mut self) -> Action {
        let null = if self.random.chance(3) { self.null(4) } else { None };
        Action::DoStep { at: self.at(), step: self.step_size(), null }
    }

    fn reference(&mut self) -> u32 {
        let n = u32::try_from(self.description.variables.len()).unwrap_or(u32::MAX);
        match self.random.below(30) {
            0 => n,
            1 => u32::MAX,
            2 => u32::MAX - u32::try_from(self.random.below(1 << 31)).unwrap_or(0),
            _ => u32::try_from(self.random.below(n as usize)).unwrap_or(0),
        }
    }

    /// Variables of one type, now and then of any, or none.
    fn references(&mut self, access: Access, wanted: impl Fn(&Variable) -> bool) -> Vec<u32> {
        let n = match self.random.below(10) {
            0 => 0,
            1..7 => 1 + self.random.below(3),
            _ => 1 + self.random.below(12),
        };
        let version = self.description.version;
        let right = self.description.references(|v| Access::of(v.kind, version) == access && wanted(v));
        let n = if right.is_empty() { n.min(1) } else { n };
        (0..n)
            .map(|_| {
                if right.is_empty() || self.random.chance(2) {
                    self.reference()
                } else {
                    self.random.pick(&right)
                }
            })
            .collect()
    }

    fn access(&mut self) -> Access {
        let access = if self.random.chance(60) { Access::Float64 } else { self.random.pick(&Access::ALL) };
        let version = self.description.version;
        if access == Access::Int64 && version == Version::Fmi2 { Access::Int32 } else { access }
    }

    fn get(&mut self) -> Action {
        let access = self.access();
        let references = self.references(access, |_| true);
        let spoil = if references.is_empty() { Spoil::NullReferences } else { self.spoil() };
        Action::Get { access, references, spoil }
    }

    /// Set variables that may be set there, with an odd value in `odd` of 100 cases.
    fn set(&mut self, place: Place, odd: usize) -> Action {
        let access = self.access();
        let everything = self.random.chance(8);
        let references = self.references(access, |v| {
            everything || standard::may_set(v, place.interface, place.phase) != standard::Verdict::Forbidden
        });
        let spoil = if references.is_empty() { Spoil::NullValues } else { self.spoil() };
        let values = references.into_iter().map(|reference| (reference, self.value(reference, access, odd)));
        Action::Set { access, values: values.collect(), spoil }
    }

    fn value(&mut self, reference: u32, access: Access, odd: usize) -> u64 {
        let odd = self.random.chance(odd);
        let Some(variable) = self.description.variables.get(reference as usize) else {
            return self.random.bits();
        };
        let start = variable.start.unwrap_or(0.0);
        match (access, variable.kind) {
            (Access::Float64 | Access::Float32, _) => self.float(variable, start, odd).to_bits(),
            (_, Kind::Enumeration) if !odd && !variable.items.is_empty() => {
                let i = self.random.below(variable.items.len());
                variable.items[i].1.cast_unsigned()
            }
            (_, Kind::Boolean) if !odd => self.random.bits() & 1,
            _ => self.whole(start, odd).cast_unsigned(),
        }
    }

    fn float(&mut self, variable: &Variable, start: f64, odd: bool) -> f64 {
        let bounds = [variable.min, variable.max].into_iter().flatten().collect::<Vec<_>>();
        match self.random.below(10) {
            _ if !odd && variable.causality == Causality::Input => 10.0 * self.random.unit(),
            _ if !odd && matches!(variable.range, Range::MinusOneOr { .. }) => {
                let own = 1e-3 + 0.1 * self.random.unit().abs();
                self.random.pick(&[-1.0, own])
            }
            _ if !odd => {
                let value = start * (1.0 + 0.1 * self.random.unit());
                let (min, max) =
                    (variable.min.unwrap_or(f64::NEG_INFINITY), variable.max.unwrap_or(f64::INFINITY));
                value.clamp(min, max)
            }
            0..3 if !bounds.is_empty() => self.random.pick(&bounds),
            3 => f64::from_bits(self.random.bits()),
            _ => self.random.pick(&ODD),
        }
    }

    #[allow(clippy::cast_possible_truncation, reason = "start values are small")]
    fn whole(&mut self, start: f64, odd: bool) -> i64 {
        if odd {
            return self.random.pick(&[i64::MIN, i64::MAX, -1, 0, 99, 255, 2, 1 << 40]);
        }
        start as i64 + self.random.pick(&[-1, 0, 0, 1])
    }

    fn get_list(&mut self) -> Action {
        let list = self.random.pick(&[Lists::States, Lists::Derivatives, Lists::Nominals, Lists::Indicators]);
        Action::GetList { list, spoil: self.spoil() }
    }

    fn set_states(&mut self) -> Action {
        let values = (0..self.description.states)
            .map(|_| if self.random.chance(4) { self.random.pick(&ODD) } else { self.random.unit() })
            .collect();
        Action::SetStates { values, spoil: self.spoil() }
    }

    fn directional(&mut self) -> Action {
        let any = self.random.chance(10);
        let unknowns =
            self.references(Access::Float64, |v| any || v.causality == Causality::Output || v.derivative);
        let knowns = self.references(Access::Float64, |v| any || v.causality == Causality::Input || v.state);
        let knowns = knowns
            .into_iter()
            .map(|r| (r, if self.random.chance(10) { self.random.pick(&ODD) } else { self.random.unit() }))
            .collect();
        Action::Directional { adjoint: self.random.chance(3), unknowns, knowns, spoil: self.spoil() }
    }

    fn inquire(&mut self) -> Action {
        let inquiry = self.random.pick(&[
            Inquiry::Status,
            Inquiry::Real,
            Inquiry::Real,
            Inquiry::Integer,
            Inquiry::Boolean,
            Inquiry::String,
            Inquiry::InputDerivatives,
            Inquiry::OutputDerivatives,
        ]);
        let kind = self.random.pick(&[0, 1, 2, 2, 3, 4, i32::MAX]);
        Action::Inquire { inquiry, kind, null: self.random.chance(10) }
    }

    fn state_call(&mut self) -> Action {
        let store = if self.random.chance(60) { 0 } else { self.random.below(STORES) };
        match self.random.below(20) {
            0..7 => Action::Save(store),
            7..13 => Action::Restore(store),
            13 => Action::FreeState(store),
            _ => {
                let place = self.random.below(1 << 20);
                let mutation = self.random.pick(&[
                    Mutation::None,
                    Mutation::None,
                    Mutation::None,
                    Mutation::Flip(place),
                    Mutation::Flip(place % (1 << 9)),
                    Mutation::Foreign,
                    Mutation::WrongSize(1),
                    Mutation::WrongSize(-1),
                    Mutation::Cut(place),
                    Mutation::Longer(place),
                    Mutation::Noise(place),
                ]);
                Action::Serialize { store, mutation }
            }
        }
    }
}
