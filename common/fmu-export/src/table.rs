//! The variables of an FMU: the model's and the solver's in one list. The value reference of a
//! variable is its place in the list.

use std::any::TypeId;
use std::marker::PhantomData;
use std::ops::Range;
use std::sync::{Arc, Mutex, PoisonError};

use model::{Causality, Entry, Group, Kind, Model, Variability, Variables, count_states};

use crate::inputs::{PortParameters, PortReset};
use crate::solver::{AutoCounters, defaults, offers_auto};
use crate::{Fault, SolverCounters, SolverParameters, Standard};

/// Where each group of variables of the model `M` lies in the list, fixed at compile time.
#[derive(Debug)]
pub(crate) struct Layout<M>(PhantomData<M>);

impl<M: Model> Layout<M> {
    /// Inputs may follow polynomials inside a step.
    pub(crate) const TREATED: bool =
        M::PORT_TREATMENT && !<M::Inputs<f64> as Variables<f64>>::TABLE.is_empty();
    /// Number of declared states.
    pub(crate) const STATES: usize = if M::MODEL_EXCHANGE {
        count_states(<M::Motion<f64> as Variables<f64>>::TABLE)
            + count_states(<M::Energy<f64> as Variables<f64>>::TABLE)
    } else {
        0
    };
    /// Sections before the rates: time, parameters, solver and port parameters, inputs, port.reset,
    /// four output groups.
    const SECTIONS: [&'static [Entry]; 10] = [
        &[TIME],
        M::Parameters::TABLE,
        <SolverParameters as Variables<f64>>::TABLE,
        if Self::TREATED { <PortParameters as Variables<f64>>::TABLE } else { &[] },
        <M::Inputs<f64> as Variables<f64>>::TABLE,
        if Self::TREATED { <PortReset as Variables<f64>>::TABLE } else { &[] },
        <M::Motion<f64> as Variables<f64>>::TABLE,
        <M::Inertia<f64> as Variables<f64>>::TABLE,
        <M::Dynamics<f64> as Variables<f64>>::TABLE,
        <M::Energy<f64> as Variables<f64>>::TABLE,
    ];
    /// Counters beside those of every solver.
    const FURTHER_COUNTERS: &'static [Entry] =
        if offers_auto::<M>() { <AutoCounters as Variables<f64>>::TABLE } else { &[] };
    /// Ends of these sections, then of rates, indicators, counters and further counters.
    const ENDS: [usize; 14] = {
        let mut ends = [0; 14];
        let (mut at, mut i) = (0, 0);
        while i < 14 {
            at += match i {
                10 => Self::STATES,
                11 => M::INDICATORS.len(),
                12 => <SolverCounters as Variables<f64>>::TABLE.len(),
                13 => Self::FURTHER_COUNTERS.len(),
                i => Self::SECTIONS[i].len(),
            };
            ends[i] = at;
            i += 1;
        }
        ends
    };
    pub(crate) const PARAMETERS: Range<usize> = Self::section(1);
    pub(crate) const SOLVER: Range<usize> = Self::section(2);
    pub(crate) const PORT: Range<usize> = Self::section(3);
    pub(crate) const INPUTS: Range<usize> = Self::section(4);
    pub(crate) const RESET: Range<usize> = Self::section(5);
    pub(crate) const MOTION: Range<usize> = Self::section(6);
    pub(crate) const RATES: Range<usize> = Self::section(10);
    pub(crate) const COUNTERS: Range<usize> = Self::section(12);
    pub(crate) const AUTO_COUNTERS: Range<usize> = Self::section(13);

    const fn section(i: usize) -> Range<usize> {
        Self::ENDS[i - 1]..Self::ENDS[i]
    }

    pub(crate) const fn part(part: Part) -> Range<usize> {
        Self::section(match part {
            Part::Outputs(group) => 6 + group as usize,
            Part::Rates => 10,
            Part::Indicators => 11,
        })
    }
}

/// What is computed together, on the first Get after a change.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Part {
    /// A group of outputs
    Outputs(Group),
    /// Time derivatives of the states
    Rates,
    /// Event indicators
    Indicators,
}

impl Part {
    /// All parts, in the order of the list.
    pub(crate) const ALL: [Self; 6] = [
        Self::Outputs(Group::Motion),
        Self::Outputs(Group::Inertia),
        Self::Outputs(Group::Dynamics),
        Self::Outputs(Group::Energy),
        Self::Rates,
        Self::Indicators,
    ];

    /// The bit that stands for the part.
    pub(crate) const fn bit(self) -> u8 {
        match self {
            Self::Outputs(group) => 1 << group as u8,
            Self::Rates => 1 << 4,
            Self::Indicators => 1 << 5,
        }
    }
}

/// Bits of all parts.
pub(crate) const ALL_PARTS: u8 = 0x3f;

/// The independent variable.
pub const TIME: Entry = {
    let mut time = Entry::scalar("time", Kind::Float64);
    time.description = "Simulation time";
    time.unit = "s";
    time
};

/// A variable of the FMU.
#[derive(Debug, Clone)]
pub struct Variable {
    /// Full name
    pub name: String,
    /// Everything else
    pub entry: Entry,
    /// Value reference of the state whose time derivative this is
    pub derivative_of: Option<usize>,
}

/// The list with names, and per variable what Get and Set have to know.
#[derive(Debug, Clone)]
pub struct Table {
    pub(crate) variables: Vec<Variable>,
    /// Value references of the continuous states
    pub(crate) states: Vec<usize>,
    /// Bits of the part that the variable belongs to; [`FLOAT`]: its type is Float64
    pub(crate) access: Vec<u8>,
    /// Bits of the parts that depend on the variable
    pub(crate) affects: Vec<u8>,
    /// Changes when the interface changes
    pub(crate) hash: u128,
}

/// Marks Float64 variables in [`Table::access`].
pub(crate) const FLOAT: u8 = 0x80;

/// The tables of all models in the process; an FMU has one.
static TABLES: Mutex<Vec<(TypeId, Arc<Table>)>> = Mutex::new(Vec::new());

impl Table {
    /// The table of the model `M`, made once in a process.
    pub(crate) fn shared<M: Model>() -> Arc<Self> {
        let mut tables = TABLES.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, table)) = tables.iter().find(|(model, _)| *model == TypeId::of::<M>()) {
            return Arc::clone(table);
        }
        let table = Arc::new(Self::new::<M>());
        tables.push((TypeId::of::<M>(), Arc::clone(&table)));
        table
    }

    /// The variables of the model `M`.
    #[must_use]
    pub fn new<M: Model>() -> Self {
        let plain = |name: String, entry: Entry| Variable { name, entry, derivative_of: None };
        let mut variables: Vec<_> =
            Layout::<M>::SECTIONS.into_iter().flatten().map(|entry| plain(entry.name(), *entry)).collect();
        defaults::<M>(&mut variables[Layout::<M>::SOLVER]);
        let mut states = Vec::new();
        if M::MODEL_EXCHANGE {
            states.extend((0..variables.len()).filter(|i| variables[*i].entry.rate.is_some()));
        }
        for state in &states {
            variables.push(derivative(*state, &variables[*state]));
        }
        variables.extend(M::INDICATORS.iter().map(|name| plain((*name).into(), INDICATOR)));
        let counters = <SolverCounters as Variables<f64>>::TABLE.iter().chain(Layout::<M>::FURTHER_COUNTERS);
        variables.extend(counters.map(|entry| plain(entry.name(), *entry)));

        let access =
            variables.iter().map(|v| if v.entry.kind == Kind::Float64 { FLOAT } else { 0 }).collect();
        let mut table = Self {
            affects: vec![0; variables.len()],
            hash: hash(M::NAME, &variables),
            variables,
            states,
            access,
        };
        table.affects[Layout::<M>::PARAMETERS].fill(ALL_PARTS);
        table.affects[Layout::<M>::INPUTS].fill(Part::Indicators.bit());
        for part in Part::ALL {
            for i in Layout::<M>::part(part) {
                table.access[i] |= part.bit();
                for known in table.dependencies(i) {
                    table.affects[known] |= part.bit();
                }
            }
        }
        table
    }

    /// A table of variables without states; `name` and variables make its token.
    #[must_use]
    pub fn of(name: &str, variables: Vec<Variable>) -> Self {
        let float = |v: &Variable| if v.entry.kind == Kind::Float64 { FLOAT } else { 0 };
        Self {
            states: Vec::new(),
            access: variables.iter().map(float).collect(),
            affects: vec![0; variables.len()],
            hash: hash(name, &variables),
            variables,
        }
    }

    /// A variable by its value reference.
    ///
    /// # Errors
    /// [`Fault::UnknownReference`].
    pub fn variable(&self, reference: u32) -> Result<&Variable, Fault> {
        self.variables
            .get(reference as usize)
            .ok_or(Fault::UnknownReference { reference, count: self.variables.len() })
    }

    /// A variable of one of the types for which `is` is true; `called` is the type of the call in the `standard`.
    ///
    /// # Errors
    /// [`Fault::UnknownReference`], [`Fault::WrongType`].
    pub fn typed(
        &self,
        reference: u32,
        standard: Standard,
        called: &'static str,
        is: impl Fn(Kind) -> bool,
    ) -> Result<&Variable, Fault> {
        let variable = self.variable(reference)?;
        let (name, kind) = (&variable.name, variable.entry.kind);
        if is(kind) {
            return Ok(variable);
        }
        Err(Fault::WrongType { variable: name.clone(), reference, is: standard.type_name(kind), called })
    }

    /// The variables in the order of their value references.
    #[must_use]
    pub fn variables(&self) -> &[Variable] {
        &self.variables
    }

    /// Value references of the continuous states.
    #[must_use]
    pub fn states(&self) -> &[usize] {
        &self.states
    }

    /// Start values of all variables.
    #[must_use]
    pub fn start_values(&self) -> Vec<f64> {
        self.variables.iter().map(|v| v.entry.start).collect()
    }

    /// True if the variable is a continuous state.
    pub(crate) fn is_state(&self, reference: usize) -> bool {
        self.states.binary_search(&reference).is_ok()
    }

    /// Value references of the inputs and states that a variable depends on directly, ascending.
    #[must_use]
    pub fn dependencies(&self, unknown: usize) -> Vec<usize> {
        let depends = self.variables[unknown].entry.depends;
        // of a time derivative: that of its state
        let component =
            self.variables[unknown].name.trim_end_matches(')').rsplit('.').next().unwrap_or_default();
        let covers = |name: &str| {
            depends.iter().any(|d| {
                if let Some(alone) = d.strip_prefix('=') {
                    return name == alone;
                }
                if let Some(group) = d.strip_suffix(".*") {
                    return name.strip_prefix(group).is_some_and(|rest| rest.starts_with('.'));
                }
                if let Some(same) = d.strip_suffix('@') {
                    return name.strip_prefix(same) == Some(component);
                }
                name.strip_prefix(d).is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
            })
        };
        (0..self.variables.len())
            .filter(|i| {
                let known = &self.variables[*i];
                let is_state = self.is_state(*i);
                is_state && *i == unknown
                    || (is_state || known.entry.causality == Causality::Input) && covers(&known.name)
            })
            .collect()
    }

    /// Hash of the variables in the form of a GUID: changes when the interface changes.
    #[must_use]
    pub fn token(&self) -> String {
        guid(self.hash)
    }
}

/// Hash of the variable table of a model.
fn hash(model: &str, variables: &[Variable]) -> u128 {
    let mut hash = Fnv::new();
    hash.write(model.as_bytes());
    for Variable { name, entry, .. } in variables {
        hash.write(name.as_bytes());
        hash.write(entry.unit.as_bytes());
        hash.write(Standard::Fmi3.type_name(entry.kind).as_bytes());
        if let Kind::Enumeration(t) = entry.kind {
            t.items.iter().for_each(|i| hash.write(i.name.as_bytes()));
        }
        hash.write(format!("{:?}{:?}{:?}", entry.causality, entry.variability, entry.initial).as_bytes());
        for value in [entry.start, entry.min, entry.max, entry.nominal].into_iter().chain(entry.or) {
            hash.write(&value.to_bits().to_le_bytes());
        }
        entry.depends.iter().for_each(|d| hash.write(d.as_bytes()));
    }
    hash.0
}

/// A hash in the form of a GUID.
pub(crate) fn guid(hash: u128) -> String {
    let h = format!("{hash:032x}");
    format!("{{{}-{}-{}-{}-{}}}", &h[..8], &h[8..12], &h[12..16], &h[16..20], &h[20..])
}

/// The time derivative of a state as a variable.
fn derivative(reference: usize, state: &Variable) -> Variable {
    let mut entry = Entry::scalar("", Kind::Float64);
    entry.description = "Time derivative of the state";
    entry.causality = Causality::Local;
    if let Some(rate) = state.entry.rate {
        (entry.unit, entry.depends) = (rate.unit, rate.depends);
    }
    Variable { name: format!("der({})", state.name), entry, derivative_of: Some(reference) }
}

/// An event indicator.
const INDICATOR: Entry = {
    let mut entry = Entry::scalar("", Kind::Float64);
    entry.description = "Event indicator: a change of sign is an event";
    entry.causality = Causality::Local;
    entry
};

/// FNV-1a with 128 bits: the same on every platform and toolchain.
pub(crate) struct Fnv(pub(crate) u128);

impl Fnv {
    pub(crate) fn new() -> Self {
        Self(0x6c62_272e_07bb_0142_62b8_2175_6295_c58d)
    }
    pub(crate) fn write(&mut self, bytes: &[u8]) {
        for b in bytes.iter().chain(&[0xff]) {
            self.0 = (self.0 ^ u128::from(*b)).wrapping_mul(0x0000_0000_0100_0000_0000_0000_0000_013b);
        }
    }
}

/// The allowed values of a variable, for a message.
#[must_use]
pub fn allowed(entry: &Entry) -> String {
    if let Kind::Enumeration(t) = entry.kind {
        let items: Vec<_> = t.items.iter().map(|i| format!("{} ({})", i.name, i.value)).collect();
        return items.join(", ");
    }
    if entry.switch {
        return "0 or 1".into();
    }
    let above = entry.min > 0.0 && entry.min <= f64::MIN_POSITIVE;
    let range = match (entry.min.is_finite(), entry.max.is_finite()) {
        (true, true) if above => format!("> 0, <= {} {}", entry.max, entry.unit),
        (true, false) if above => format!("> 0 {}, finite", entry.unit),
        (true, false) => format!(">= {} {}, finite", entry.min, entry.unit),
        (false, true) => format!("<= {} {}, finite", entry.max, entry.unit),
        (true, true) => format!("{} .. {} {}", entry.min, entry.max, entry.unit),
        (false, false) => "finite".to_string(),
    };
    entry.or.map_or(range.clone(), |or| format!("{range}, or {or}"))
}

/// True if the variable may be changed between steps.
pub(crate) fn changes_in_a_run(entry: &Entry) -> bool {
    entry.causality == Causality::Input || entry.variability == Variability::Tunable
}
