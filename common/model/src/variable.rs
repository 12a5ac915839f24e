//! Variables as data: the table that the derive writes at compile time.

/// Type of a variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Real number
    Float64,
    /// Integer parameter
    Int32,
    /// Counter
    Int64,
    /// 0 or 1
    Boolean,
    /// One of a list of items
    Enumeration(&'static EnumType),
}

/// An enumeration type.
#[derive(Debug, PartialEq, Eq)]
pub struct EnumType {
    /// Type name
    pub name: &'static str,
    /// Meaning
    pub description: &'static str,
    /// The items in order
    pub items: &'static [Item],
}

/// An item of an enumeration.
#[derive(Debug, PartialEq, Eq)]
pub struct Item {
    /// Name as in the documentation
    pub name: &'static str,
    /// Number, counting from 1
    pub value: i64,
    /// Meaning
    pub description: &'static str,
}

/// Who gives the value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Causality {
    /// Taken from the enclosing group
    Inherit,
    /// Constant of a run, given by the user
    Parameter,
    /// Constant of a run, computed from parameters
    CalculatedParameter,
    /// Given by other systems
    Input,
    /// Computed, meant for others
    Output,
    /// Computed, for information
    Local,
}

/// When the value may change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Variability {
    /// Never after initialisation
    Fixed,
    /// By the user, between steps
    Tunable,
    /// At events
    Discrete,
    /// Any time
    Continuous,
}

/// What the start value of a computed variable means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Initial {
    /// Given by the user and kept
    Exact,
    /// Given as a guess
    Approx,
    /// Computed
    Calculated,
}

/// What a port does that the inertial connection does not expect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PortLaw {
    /// Nothing: the force is affine in the acceleration, the motion continuous
    Regular,
    /// A follower whose force is not affine in the acceleration: F0 and M are tangent values
    NotAffine,
    /// A leader whose motion is known at samples only
    Sampled,
}

/// One scalar variable.
#[derive(Debug, Clone, Copy)]
pub struct Entry {
    name: [&'static str; Self::PARTS],
    /// Meaning, from the field's documentation
    pub description: &'static str,
    /// Unit, "" = 1
    pub unit: &'static str,
    /// Type
    pub kind: Kind,
    /// Who gives the value
    pub causality: Causality,
    /// When it may change
    pub variability: Variability,
    /// What the start value means
    pub initial: Initial,
    /// Start value
    pub start: f64,
    /// Smallest allowed value
    pub min: f64,
    /// Largest allowed value
    pub max: f64,
    /// A value out of the range that is allowed too: it stands for another source of the value
    pub or: Option<f64>,
    /// Any value may be set, also one that is not finite
    pub any: bool,
    /// Typical magnitude
    pub nominal: f64,
    /// Takes 0 and 1 only
    pub switch: bool,
    /// Inputs and states that the value depends on directly: names, groups by prefix (`P.F`), or the
    /// same component of a group (`A.r.@`); a state depends on itself without being named
    pub depends: &'static [&'static str],
    /// Present for a state
    pub rate: Option<Rate>,
    /// Of the port that the variable belongs to
    pub port: PortLaw,
}

/// What belongs to the time derivative of a state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rate {
    /// Unit of the derivative
    pub unit: &'static str,
    /// Inputs and states that the derivative depends on directly, in the same notation
    pub depends: &'static [&'static str],
}

/// What a field's attributes say about its variables; `None` and empty leave things as they are.
#[derive(Debug, Clone, Copy)]
#[allow(clippy::struct_excessive_bools, reason = "marks that have nothing to do with each other")]
pub struct Attributes {
    /// Comes before the names of the field's own variables
    pub prefix: &'static str,
    /// Meaning
    pub description: &'static str,
    /// Unit
    pub unit: &'static str,
    /// Who gives the value
    pub causality: Causality,
    /// May be changed between steps
    pub tunable: bool,
    /// Changes at events only
    pub discrete: bool,
    /// Takes 0 and 1 only
    pub switch: bool,
    /// What the port does whose variables these are
    pub port: PortLaw,
    /// What the start value means
    pub initial: Initial,
    /// Start values: none, one for all, or one per component
    pub start: &'static [f64],
    /// Smallest allowed value
    pub min: Option<f64>,
    /// Largest allowed value
    pub max: Option<f64>,
    /// A value out of the range that is allowed too
    pub or: Option<f64>,
    /// Any value may be set, also one that is not finite
    pub any: bool,
    /// Typical magnitude
    pub nominal: Option<f64>,
    /// Inputs and states that the value depends on directly: none, one list for all, or one per component
    pub depends: &'static [&'static [&'static str]],
    /// For a state: unit of its time derivative
    pub rate_unit: Option<&'static str>,
    /// The same lists for the time derivative
    pub rate_depends: &'static [&'static [&'static str]],
}

/// The list of a component.
const fn of_component(
    lists: &'static [&'static [&'static str]],
    component: usize,
) -> &'static [&'static str] {
    match lists.len() {
        0 => &[],
        1 => lists[0],
        _ => lists[component],
    }
}

impl Entry {
    const PARTS: usize = 6;

    /// The nameless variable of one value, from which tables are built.
    #[must_use]
    pub const fn scalar(suffix: &'static str, kind: Kind) -> Self {
        let mut name = [""; Self::PARTS];
        name[0] = suffix;
        Self {
            name,
            description: "",
            unit: "",
            kind,
            causality: Causality::Inherit,
            variability: Variability::Continuous,
            initial: Initial::Calculated,
            start: 0.0,
            min: f64::NEG_INFINITY,
            max: f64::INFINITY,
            or: None,
            any: false,
            nominal: 1.0,
            switch: false,
            depends: &[],
            rate: None,
            port: PortLaw::Regular,
        }
    }

    /// Full name, parts joined.
    #[must_use]
    pub fn name(&self) -> String {
        self.name.concat()
    }

    /// This entry as a component of a field with the given attributes.
    ///
    /// # Panics
    /// At compile time, if groups are nested more deeply than names have parts.
    #[must_use]
    pub const fn within(mut self, a: &Attributes, component: usize) -> Self {
        let mut i = Self::PARTS - 1;
        assert!(self.name[i].is_empty(), "variable groups are nested too deeply");
        while i > 0 {
            self.name[i] = self.name[i - 1];
            i -= 1;
        }
        self.name[0] = a.prefix;
        if self.description.is_empty() {
            self.description = a.description;
        }
        if self.unit.is_empty() {
            self.unit = a.unit;
        }
        if matches!(self.causality, Causality::Inherit) {
            self.causality = a.causality;
        }
        if a.tunable {
            self.variability = Variability::Tunable;
        } else if a.discrete
            || !matches!(self.kind, Kind::Float64) && matches!(self.causality, Causality::Local)
        {
            self.variability = Variability::Discrete;
        } else if matches!(self.causality, Causality::Parameter | Causality::CalculatedParameter)
            && matches!(self.variability, Variability::Continuous)
        {
            self.variability = Variability::Fixed;
        }
        if !matches!(a.port, PortLaw::Regular) {
            self.port = a.port;
        }
        if !matches!(a.initial, Initial::Calculated) {
            self.initial = a.initial;
        }
        if a.start.len() == 1 {
            self.start = a.start[0];
        } else if a.start.len() > 1 {
            self.start = a.start[component];
        }
        if a.switch {
            (self.switch, self.min, self.max) = (true, 0.0, 1.0);
        }
        if let Some(min) = a.min {
            self.min = min;
        }
        if let Some(max) = a.max {
            self.max = max;
        }
        if a.or.is_some() {
            self.or = a.or;
        }
        self.any |= a.any;
        if let Some(nominal) = a.nominal {
            self.nominal = nominal;
        }
        if self.depends.is_empty() {
            self.depends = of_component(a.depends, component);
        }
        if let Some(unit) = a.rate_unit {
            self.rate = Some(Rate { unit, depends: of_component(a.rate_depends, component) });
        }
        self
    }

    /// True if a host may set the value before or during initialisation.
    #[must_use]
    pub const fn has_start(&self) -> bool {
        matches!(self.causality, Causality::Parameter | Causality::Input)
            || matches!(self.initial, Initial::Exact | Initial::Approx)
    }
}

/// Number of states among the variables of a table.
#[must_use]
pub const fn count_states(table: &[Entry]) -> usize {
    let (mut count, mut i) = (0, 0);
    while i < table.len() {
        if table[i].rate.is_some() {
            count += 1;
        }
        i += 1;
    }
    count
}

/// Write the entries of a field into a table under construction.
#[must_use]
pub const fn fill<const N: usize>(
    mut table: [Entry; N],
    at: usize,
    field: &'static [Entry],
    attributes: &Attributes,
) -> [Entry; N] {
    let mut i = 0;
    while i < field.len() {
        table[at + i] = field[i].within(attributes, i);
        i += 1;
    }
    table
}

/// A group of variables as a struct: table at compile time, values from and to a flat slice.
///
/// Derived: `#[derive(Variables)]`. Fields are scalars, vectors, tensors, Booleans, enumerations or
/// other groups.
pub trait Variables<S>: Sized {
    /// The variables in field order.
    const TABLE: &'static [Entry];
    /// From values in table order.
    fn load(values: &[S]) -> Self;
    /// Into values in table order.
    fn store(&self, values: &mut [S]);
}
