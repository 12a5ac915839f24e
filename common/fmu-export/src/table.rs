//! The variables of an FMU: the model's and the solver's in one list. The value reference of a
//! variable is its place in the list.

use std::marker::PhantomData;
use std::ops::Range;

use model::{Causality, Entry, Group, Kind, Model, Variability, Variables};

use crate::{SolverCounters, SolverParameters};

/// Where each group of variables of the model `M` lies in the list, fixed at compile time.
#[derive(Debug)]
pub(crate) struct Layout<M>(PhantomData<M>);

impl<M: Model> Layout<M> {
    /// Sections: time, parameters, solver parameters, inputs, four output groups, counters.
    const SECTIONS: [&'static [Entry]; 9] = [
        &[TIME],
        M::Parameters::TABLE,
        <SolverParameters as Variables<f64>>::TABLE,
        <M::Inputs<f64> as Variables<f64>>::TABLE,
        <M::Motion<f64> as Variables<f64>>::TABLE,
        <M::Inertia<f64> as Variables<f64>>::TABLE,
        <M::Dynamics<f64> as Variables<f64>>::TABLE,
        <M::Energy<f64> as Variables<f64>>::TABLE,
        <SolverCounters as Variables<f64>>::TABLE,
    ];
    const ENDS: [usize; 9] = {
        let mut ends = [0; 9];
        let (mut at, mut i) = (0, 0);
        while i < 9 {
            at += Self::SECTIONS[i].len();
            ends[i] = at;
            i += 1;
        }
        ends
    };
    pub(crate) const COUNT: usize = Self::ENDS[8];
    pub(crate) const PARAMETERS: Range<usize> = Self::ENDS[0]..Self::ENDS[1];
    pub(crate) const SOLVER: Range<usize> = Self::ENDS[1]..Self::ENDS[2];
    pub(crate) const INPUTS: Range<usize> = Self::ENDS[2]..Self::ENDS[3];
    pub(crate) const COUNTERS: Range<usize> = Self::ENDS[7]..Self::ENDS[8];

    pub(crate) const fn group(group: Group) -> Range<usize> {
        let section = 4 + group as usize;
        Self::ENDS[section - 1]..Self::ENDS[section]
    }
}

/// The independent variable.
pub(crate) const TIME: Entry = {
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
}

/// The list with names, and per variable what Get has to know.
#[derive(Debug, Clone)]
pub struct Table {
    pub(crate) variables: Vec<Variable>,
    /// Bit i: the variable belongs to output group i; [`FLOAT`]: its type is Float64
    pub(crate) access: Vec<u8>,
}

/// Marks Float64 variables in [`Table::access`].
pub(crate) const FLOAT: u8 = 0x80;

impl Table {
    /// The variables of the model `M`.
    #[must_use]
    pub fn new<M: Model>() -> Self {
        let mut variables = Vec::with_capacity(Layout::<M>::COUNT);
        for section in Layout::<M>::SECTIONS {
            variables.extend(section.iter().map(|entry| Variable { name: entry.name(), entry: *entry }));
        }
        let mut access: Vec<u8> =
            variables.iter().map(|v| if v.entry.kind == Kind::Float64 { FLOAT } else { 0 }).collect();
        for group in Group::ALL {
            for a in &mut access[Layout::<M>::group(group)] {
                *a |= 1 << group as u8;
            }
        }
        Self { variables, access }
    }

    /// The variables in the order of their value references.
    #[must_use]
    pub fn variables(&self) -> &[Variable] {
        &self.variables
    }

    /// Start values of all variables.
    pub(crate) fn start_values(&self) -> Vec<f64> {
        self.variables.iter().map(|v| v.entry.start).collect()
    }

    /// Value references of the inputs that an output depends on directly, ascending.
    pub(crate) fn dependencies(&self, output: usize) -> Vec<usize> {
        let depends = self.variables[output].entry.depends;
        let component = self.variables[output].name.rsplit('.').next().unwrap_or_default();
        let covers = |name: &str| {
            depends.iter().any(|d| {
                if let Some(same) = d.strip_suffix('@') {
                    return name.strip_prefix(same) == Some(component);
                }
                name.strip_prefix(d).is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
            })
        };
        let is_input = |v: &Variable| v.entry.causality == Causality::Input;
        (0..self.variables.len())
            .filter(|i| is_input(&self.variables[*i]) && covers(&self.variables[*i].name))
            .collect()
    }

    /// Hash of the variable table, in the form of a GUID: changes when the interface changes.
    pub(crate) fn token(&self, model: &str) -> String {
        let mut hash = Fnv::new();
        hash.write(model.as_bytes());
        for Variable { name, entry } in &self.variables {
            hash.write(name.as_bytes());
            hash.write(entry.unit.as_bytes());
            hash.write(kind_name(entry.kind).as_bytes());
            if let Kind::Enumeration(t) = entry.kind {
                t.items.iter().for_each(|i| hash.write(i.name.as_bytes()));
            }
            hash.write(format!("{:?}{:?}{:?}", entry.causality, entry.variability, entry.initial).as_bytes());
            for value in [entry.start, entry.min, entry.max, entry.nominal] {
                hash.write(&value.to_bits().to_le_bytes());
            }
            entry.depends.iter().for_each(|d| hash.write(d.as_bytes()));
        }
        let h = format!("{:032x}", hash.0);
        format!("{{{}-{}-{}-{}-{}}}", &h[..8], &h[8..12], &h[12..16], &h[16..20], &h[20..])
    }
}

/// FNV-1a with 128 bits: the same on every platform and toolchain.
struct Fnv(u128);

impl Fnv {
    fn new() -> Self {
        Self(0x6c62_272e_07bb_0142_62b8_2175_6295_c58d)
    }
    fn write(&mut self, bytes: &[u8]) {
        for b in bytes.iter().chain(&[0xff]) {
            self.0 = (self.0 ^ u128::from(*b)).wrapping_mul(0x0000_0000_0100_0000_0000_0000_0000_013b);
        }
    }
}

/// Name of a type as FMI 3.0 spells it.
pub(crate) const fn kind_name(kind: Kind) -> &'static str {
    match kind {
        Kind::Float64 => "Float64",
        Kind::Int32 => "Int32",
        Kind::Int64 => "Int64",
        Kind::Boolean => "Boolean",
        Kind::Enumeration(_) => "Enumeration",
    }
}

/// The allowed values of a variable, for a message.
pub(crate) fn allowed(entry: &Entry) -> String {
    if let Kind::Enumeration(t) = entry.kind {
        let items: Vec<_> = t.items.iter().map(|i| format!("{} ({})", i.name, i.value)).collect();
        return items.join(", ");
    }
    let above = entry.min > 0.0 && entry.min <= f64::MIN_POSITIVE;
    match (entry.min.is_finite(), entry.max.is_finite()) {
        (true, false) if above => format!("> 0 {}, finite", entry.unit),
        (true, false) => format!(">= {} {}, finite", entry.min, entry.unit),
        (false, true) => format!("<= {} {}, finite", entry.max, entry.unit),
        (true, true) => format!("{} .. {} {}", entry.min, entry.max, entry.unit),
        (false, false) => "finite".to_string(),
    }
}

/// True if the variable may be changed between steps.
pub(crate) fn changes_in_a_run(entry: &Entry) -> bool {
    entry.causality == Causality::Input || entry.variability == Variability::Tunable
}
