//! Judging Get, Set and the lists of Model Exchange.

#![allow(clippy::unnecessary_wraps, reason = "one type of answer for all calls")]

use fmi_capi::{DISCARD, ERROR, OK};

use crate::api::{Array, Lists};
use crate::call::{Access, Mutation, Spoil};
use crate::description::{Causality, Kind, Range, Variable};
use crate::expect::{Expected, Offence};
use crate::machine::{Answer, Machine, Record};
use crate::random::Random;
use crate::standard::{self, Function, Phase, Verdict, Version};

impl Access {
    pub(crate) const ALL: [Self; 5] = [Self::Float64, Self::Int32, Self::Int64, Self::Boolean, Self::Float32];

    /// How values of a type go through the interface.
    pub(crate) fn of(kind: Kind, version: Version) -> Self {
        match kind {
            Kind::Float64 => Self::Float64,
            Kind::Int32 => Self::Int32,
            Kind::Enumeration if version == Version::Fmi2 => Self::Int32,
            Kind::Int64 | Kind::Enumeration => Self::Int64,
            Kind::Boolean => Self::Boolean,
        }
    }

    /// A value as it goes through the interface, as a number.
    #[allow(
        clippy::cast_precision_loss,
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "as C does it"
    )]
    pub(crate) fn number(self, bits: u64) -> f64 {
        let whole = bits.cast_signed();
        match self {
            Self::Float64 => f64::from_bits(bits),
            Self::Float32 => f64::from(f64::from_bits(bits) as f32),
            Self::Int32 => f64::from(whole as i32),
            Self::Int64 => whole as f64,
            Self::Boolean => f64::from(u8::from(whole as u8 != 0)),
        }
    }
}

impl Mutation {
    pub(crate) fn apply(self, bytes: &mut Vec<u8>, foreign: &[u8]) {
        let length = bytes.len().max(1);
        match self {
            Self::None | Self::WrongSize(_) => {}
            Self::Flip(place) => {
                if let Some(byte) = bytes.get_mut(place % length) {
                    *byte ^= 1 << (place / length % 8);
                }
            }
            Self::Cut(n) => bytes.truncate(n % length),
            Self::Longer(n) => bytes.extend(std::iter::repeat_n(0, n % 64 + 1)),
            Self::Foreign => *bytes = foreign.to_vec(),
            Self::Noise(n) => {
                let mut random = Random::new(n as u64);
                *bytes = (0..n % 4096).map(|_| random.bits().to_le_bytes()[0]).collect();
            }
        }
    }
}

/// Number of values that belong to `n` references.
fn spoilt_length(n: usize, spoil: Spoil) -> usize {
    match spoil {
        Spoil::OneMore => n + 1,
        Spoil::OneLess => n.saturating_sub(1),
        _ => n,
    }
}

/// True if the arrays themselves are wrong.
fn arrays_are_wrong(n: usize, spoil: Spoil) -> bool {
    match spoil {
        Spoil::Nothing => false,
        Spoil::OneMore => true,
        Spoil::NullReferences | Spoil::NullValues | Spoil::OneLess => n > 0,
    }
}

fn all_finite(what: &str, values: &[f64]) -> Result<Vec<u64>, String> {
    match values.iter().position(|v| !v.is_finite()) {
        Some(i) => Err(format!("{what}: item {i} is {} after OK", values[i])),
        None => Ok(values.iter().map(|v| v.to_bits()).collect()),
    }
}

impl Machine<'_> {
    fn access(&self, variable: &Variable) -> Access {
        Access::of(variable.kind, self.fmu.description.version)
    }

    fn variable(&self, reference: u32) -> Option<&Variable> {
        self.fmu.description.variables.get(reference as usize)
    }

    /// Call the Get function; what it wrote as bits (whole numbers as they are).
    fn call_get(&self, slot: usize, access: Access, references: &[u32], spoil: Spoil) -> (i32, Vec<u64>) {
        let (handle, n) = (self.handle(slot), spoilt_length(references.len(), spoil));
        let mut references = references.to_vec();
        let references = Array::new(&mut references, spoil == Spoil::NullReferences);
        let null = spoil == Spoil::NullValues;
        /// One type.
        macro_rules! read {
            ($get:ident, $empty:expr, $bits:expr) => {{
                let mut values = vec![$empty; n];
                let status = self.fmu.api.$get(handle, references, Array::new(&mut values, null));
                (status, values.into_iter().map($bits).collect())
            }};
        }
        match access {
            Access::Float64 => read!(get_float64, f64::NAN, f64::to_bits),
            Access::Float32 => read!(get_float32, f32::NAN, |v| u64::from(v.to_bits())),
            Access::Int32 => read!(get_int32, i32::MIN, |v| i64::from(v).cast_unsigned()),
            Access::Int64 => read!(get_int64, i64::MIN, i64::cast_unsigned),
            Access::Boolean => read!(get_boolean, 77, u64::from),
        }
    }

    /// Reasons to refuse access to variables at all: none there, another type.
    fn access_offences(&self, references: impl Iterator<Item = u32>, access: Access) -> Vec<Offence> {
        references
            .filter_map(|reference| match self.variable(reference) {
                None => Some(Self::unknown(reference)),
                Some(v) if self.access(v) != access => Some(Offence::error(vec![v.name.clone()])),
                Some(_) => None,
            })
            .collect()
    }

    pub(crate) fn get(&mut self, slot: usize, access: Access, references: &[u32], spoil: Spoil) -> Answer {
        let mut expected = self.rule(slot, Function::Get);
        let wrong_arrays = arrays_are_wrong(references.len(), spoil);
        if expected.allows(OK) {
            expected = if wrong_arrays {
                Expected::error()
            } else {
                let computes = references.iter().any(|r| self.variable(*r).is_some_and(computed));
                let offences = self.access_offences(references.iter().copied(), access);
                self.reading(slot, computes).unless(offences)
            };
        }
        let (status, data) = self.call_get(slot, access, references, spoil);
        if status != OK {
            return Ok((Record { status, data: Vec::new() }, expected));
        }
        for (reference, bits) in references.iter().zip(&data) {
            self.check_value(slot, access, *reference, *bits)?;
        }
        Ok((Record { status, data }, expected))
    }

    /// Statuses of reading values that may have to be computed first.
    fn reading(&self, slot: usize, computes: bool) -> Expected {
        let phase = self.known(slot).map(|known| known.phase);
        if !self.rule(slot, Function::Get).allows(OK) {
            return Expected::error();
        }
        match phase {
            _ if !computes => Expected::ok(),
            Some(Phase::Instantiated) => Expected::ok().or(ERROR), // there is no value yet
            Some(Phase::Initialization) => Expected::ok().or(DISCARD).or(ERROR),
            _ => Expected::ok().or(DISCARD),
        }
    }

    fn check_value(&self, slot: usize, access: Access, reference: u32, bits: u64) -> Result<(), String> {
        let (Some(variable), Some(known)) = (self.variable(reference), self.known(slot)) else {
            return Ok(());
        };
        let (name, value) = (&variable.name, access.number(bits));
        if !value.is_finite() && variable.range != Range::Any {
            return Err(format!("{name} is {value} after OK"));
        }
        if access == Access::Boolean && bits > 1 {
            return Err(format!("{name} is the Boolean {bits}"));
        }
        let expected = if variable.causality == Causality::Independent {
            known.time
        } else if known.knows(variable) {
            known.values[reference as usize]
        } else {
            return Ok(());
        };
        if (value - expected).abs() > 0.0 || value.is_finite() != expected.is_finite() {
            return Err(format!("{name} is {value}, but {expected} was set"));
        }
        Ok(())
    }

    pub(crate) fn set(&mut self, slot: usize, access: Access, values: &[(u32, u64)], spoil: Spoil) -> Answer {
        let mut expected = self.rule(slot, Function::Set);
        if expected.allows(OK) {
            expected = if arrays_are_wrong(values.len(), spoil) {
                Expected::error()
            } else {
                self.setting(slot, access, values)
            };
        }
        let status = self.call_set(slot, access, values, spoil);
        if status == OK
            && let Some(known) = self.known_mut(slot)
        {
            for (reference, bits) in values {
                if let Some(value) = known.values.get_mut(*reference as usize) {
                    *value = access.number(*bits);
                }
            }
        }
        Ok((Record { status, data: Vec::new() }, expected))
    }

    /// Statuses of setting values.
    fn setting(&self, slot: usize, access: Access, values: &[(u32, u64)]) -> Expected {
        let mut offences = self.access_offences(values.iter().map(|(r, _)| *r), access);
        let mut open = false;
        for (reference, bits) in values {
            let (Some(variable), Some(known)) = (self.variable(*reference), self.known(slot)) else {
                continue;
            };
            if self.access(variable) != access {
                continue;
            }
            match standard::may_set(variable, known.interface, known.phase) {
                Verdict::Forbidden => offences.push(Offence::error(vec![variable.name.clone()])),
                Verdict::Open => open = true,
                Verdict::Allowed => {}
            }
            let value = access.number(*bits);
            if !variable.in_range(value) {
                offences.push(out_of_range(variable, value));
            }
        }
        if open { Expected::ok().or(ERROR).or(DISCARD) } else { Expected::ok().unless(offences) }
    }

    #[allow(clippy::cast_possible_truncation, reason = "as the generator means it")]
    fn call_set(&self, slot: usize, access: Access, values: &[(u32, u64)], spoil: Spoil) -> i32 {
        let (handle, n) = (self.handle(slot), spoilt_length(values.len(), spoil));
        let mut references: Vec<u32> = values.iter().map(|(reference, _)| *reference).collect();
        let references = Array::new(&mut references, spoil == Spoil::NullReferences);
        let null = spoil == Spoil::NullValues;
        let bits = values.iter().map(|(_, bits)| *bits).chain(std::iter::once(0)).take(n);
        /// One type.
        macro_rules! write {
            ($set:ident, $value:expr) => {{
                let mut values: Vec<_> = bits.map($value).collect();
                self.fmu.api.$set(handle, references, Array::new(&mut values, null))
            }};
        }
        match access {
            Access::Float64 => write!(set_float64, f64::from_bits),
            Access::Float32 => write!(set_float32, |v| f64::from_bits(v) as f32),
            Access::Int32 => write!(set_int32, |v| v as i32),
            Access::Int64 => write!(set_int64, u64::cast_signed),
            Access::Boolean => write!(set_boolean, |v| v as u8),
        }
    }

    fn list_length(&self, list: Lists) -> usize {
        match list {
            Lists::Indicators => self.fmu.description.indicators,
            _ => self.fmu.description.states,
        }
    }

    pub(crate) fn get_list(&mut self, slot: usize, list: Lists, spoil: Spoil) -> Answer {
        let function = if list == Lists::Nominals { Function::Nominals } else { Function::ContinuousLists };
        let mut expected = self.rule(slot, function);
        let length = self.list_length(list);
        let n = spoilt_length(length, spoil);
        if expected.allows(OK) {
            let null = matches!(spoil, Spoil::NullReferences | Spoil::NullValues) && n > 0;
            expected = match (n != length || null, list) {
                (true, _) => Expected::error(),
                (false, Lists::Nominals) => expected.or(DISCARD).or(ERROR),
                (false, _) => self.reading(slot, true),
            };
        }
        let mut values = vec![f64::NAN; n];
        let null = matches!(spoil, Spoil::NullReferences | Spoil::NullValues);
        let status = self.fmu.api.list(self.handle(slot), list, Array::new(&mut values, null));
        if status != OK {
            return Ok((Record { status, data: Vec::new() }, expected));
        }
        if list == Lists::Nominals && values.iter().any(|v| *v <= 0.0) {
            return Err(format!("nominal values {values:?}"));
        }
        Ok((Record { status, data: all_finite(&format!("{list:?}"), &values)? }, expected))
    }

    pub(crate) fn set_states(&mut self, slot: usize, values: &[f64], spoil: Spoil) -> Answer {
        let mut expected = self.rule(slot, Function::SetContinuousStates);
        let length = self.fmu.description.states;
        let mut values: Vec<f64> =
            values.iter().copied().cycle().take(spoilt_length(length, spoil)).collect();
        values.resize(spoilt_length(length, spoil), 0.0);
        let null = matches!(spoil, Spoil::NullReferences | Spoil::NullValues);
        if expected.allows(OK) {
            if values.len() != length || null && length > 0 {
                expected = Expected::error();
            } else if let Some(x) = values.iter().find(|x| !x.is_finite()) {
                expected = expected.unless(vec![Offence::discard(Vec::new(), vec![*x])]);
            }
        }
        let status = self.fmu.api.set_states(self.handle(slot), Array::new(&mut values, null));
        Ok((Record { status, data: Vec::new() }, expected))
    }

    pub(crate) fn count(&mut self, slot: usize, states: bool, null: bool) -> Answer {
        let mut expected = self.rule(slot, Function::ContinuousCounts);
        if null {
            expected = Expected::error();
        }
        let (status, n) = self.fmu.api.count(self.handle(slot), states, null);
        let declared = if states { self.fmu.description.states } else { self.fmu.description.indicators };
        if status == OK && n != declared {
            return Err(format!("{n} states or indicators, {declared} are declared"));
        }
        Ok((Record { status, data: Vec::new() }, expected))
    }

    pub(crate) fn directional(
        &mut self,
        slot: usize,
        adjoint: bool,
        unknowns: &[u32],
        knowns: &[(u32, f64)],
        spoil: Spoil,
    ) -> Answer {
        let declared = !adjoint && self.fmu.description.derives;
        let rule =
            self.rule(slot, if declared { Function::DirectionalDerivative } else { Function::Undeclared });
        let expected = if rule.allows(OK) { self.deriving(slot, unknowns, knowns, spoil) } else { rule };
        let (mut unknowns, n) = (unknowns.to_vec(), spoilt_length(unknowns.len(), spoil));
        let mut sensitivity = vec![f64::NAN; if adjoint { knowns.len() } else { n }];
        let (mut knowns, mut seed): (Vec<_>, Vec<_>) = knowns.iter().copied().unzip();
        if adjoint {
            seed.resize(unknowns.len(), 1.0);
        }
        let status = self.fmu.api.directional(
            self.handle(slot),
            adjoint,
            (Array::new(&mut unknowns, spoil == Spoil::NullReferences), Array::new(&mut knowns, false)),
            (Array::new(&mut seed, false), Array::new(&mut sensitivity, spoil == Spoil::NullValues)),
        );
        if status != OK {
            return Ok((Record { status, data: Vec::new() }, expected));
        }
        Ok((Record { status, data: all_finite("sensitivity", &sensitivity)? }, expected))
    }

    /// Statuses of a directional derivative.
    fn deriving(&self, slot: usize, unknowns: &[u32], knowns: &[(u32, f64)], spoil: Spoil) -> Expected {
        let unknown_is_right =
            |r: &u32| self.variable(*r).is_some_and(|v| v.causality == Causality::Output || v.derivative);
        let input = |v: &Variable| v.causality == Causality::Input && v.continuous;
        let exists = |r: u32| self.variable(r).is_some();
        if arrays_are_wrong(unknowns.len(), spoil)
            || unknowns.iter().any(|r| !exists(*r))
            || knowns.iter().any(|(r, _)| !exists(*r))
        {
            return Expected::error().or(DISCARD);
        }
        let right = unknowns.iter().all(unknown_is_right)
            && knowns.iter().all(|(r, seed)| self.variable(*r).is_some_and(input) && seed.is_finite());
        if right { self.reading(slot, true) } else { Expected::ok().or(DISCARD).or(ERROR) }
    }

    pub(crate) fn dependencies(&mut self, slot: usize, reference: u32, n: Option<usize>) -> Answer {
        let mut expected = self.rule(slot, Function::Dependencies);
        if self.variable(reference).is_none() {
            expected = Expected::error().unless(vec![Self::unknown(reference)]);
        } else if n.is_some() {
            expected = expected.or(ERROR); // right for one length only
        }
        let (status, independents) = self.fmu.api.dependencies(self.handle(slot), reference, n);
        if status != OK {
            return Ok((Record { status, data: Vec::new() }, expected));
        }
        if let Some(stranger) = independents.iter().find(|r| self.variable(**r).is_none()) {
            return Err(format!("a dependency on {stranger}, which does not exist"));
        }
        Ok((Record { status, data: independents.into_iter().map(u64::from).collect() }, expected))
    }

    /// Everything that may be read, variable by variable: status and value.
    pub(crate) fn observe(&self, slot: usize) -> Result<Vec<u64>, String> {
        let mut seen = Vec::new();
        let Some(known) = self.known(slot) else { return Ok(seen) };
        for (variable, reference) in self.fmu.description.variables.iter().zip(0_u32..) {
            let access = self.access(variable);
            let (status, data) = self.call_get(slot, access, &[reference], Spoil::Nothing);
            if !self.reading(slot, computed(variable)).allows(status) {
                return Err(format!("reading {} is {}", variable.name, fmi_capi::status_name(status)));
            }
            seen.push(u64::from(status.cast_unsigned()));
            if status == OK {
                self.check_value(slot, access, reference, data[0])?;
                seen.extend(data);
            }
        }
        let lists = [Lists::States, Lists::Derivatives, Lists::Nominals, Lists::Indicators];
        if standard::may(Function::ContinuousLists, known.interface, known.phase) == Verdict::Allowed {
            for list in lists {
                let mut values = vec![f64::NAN; self.list_length(list)];
                let status = self.fmu.api.list(self.handle(slot), list, Array::new(&mut values, false));
                seen.push(u64::from(status.cast_unsigned()));
                if status == OK {
                    seen.extend(all_finite(&format!("{list:?}"), &values)?);
                }
            }
        }
        Ok(seen)
    }
}

/// True if a value is the result of equations.
fn computed(variable: &Variable) -> bool {
    !matches!(variable.causality, Causality::Independent | Causality::Parameter | Causality::Input)
}

/// The message has to name the variable, the value and the allowed values.
fn out_of_range(variable: &Variable, value: f64) -> Offence {
    let mut words = vec![variable.name.clone()];
    words.extend(variable.items.iter().map(|(item, _)| item.clone()));
    let bound = |b: f64| if b <= f64::MIN_POSITIVE && b > 0.0 { 0.0 } else { b };
    let mut numbers = vec![value];
    numbers.extend(variable.min.into_iter().chain(variable.max).map(bound));
    Offence::discard(words, numbers)
}
