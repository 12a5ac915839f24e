//! What the tests share: an instance addressed by names, and two small models.

#![allow(non_snake_case, reason = "port letters")]

pub mod ball;
pub mod rod;
pub mod sparsity;

use fmu_export::{Fault, Instance, Interface, Table};
use model::{Documentation, Kind, Model};

/// For models that are never packed.
pub(crate) const UNDOCUMENTED: Documentation = Documentation {
    text: "",
    icon_svg: "",
    icon_png: &[],
    reference: "",
    reference_inputs: None,
    plots: &[],
};

/// An instance whose variables are addressed by name.
#[derive(Debug)]
pub struct Named<M: Model> {
    /// The instance
    pub instance: Instance<M>,
    table: Table,
}

impl<M: Model> Default for Named<M> {
    fn default() -> Self {
        Self::with_interface(Interface::CoSimulation)
    }
}

impl<M: Model> Named<M> {
    /// An instance used in one of the ways of FMI.
    #[must_use]
    pub fn with_interface(interface: Interface) -> Self {
        Self { instance: Instance::with_interface(interface), table: Table::new::<M>() }
    }

    /// The variables in the order of their value references.
    #[must_use]
    pub fn table(&self) -> &Table {
        &self.table
    }

    /// Value reference of a variable.
    ///
    /// # Panics
    /// If there is no such variable.
    #[must_use]
    pub fn reference(&self, name: &str) -> u32 {
        let found = self.table.variables().iter().position(|v| v.name == name);
        u32::try_from(found.unwrap_or_else(|| panic!("no variable {name}"))).expect("few variables")
    }

    /// Set a variable of any type.
    ///
    /// # Errors
    /// As [`Instance::set`].
    pub fn set(&mut self, name: &str, value: f64) -> Result<(), Fault> {
        self.instance.set(&[self.reference(name)], "test", |_: Kind| true, |_| value)
    }

    /// Start value in the table as set so far, before initialisation.
    #[must_use]
    pub fn start(&self, name: &str) -> f64 {
        self.instance.raw(self.reference(name))
    }

    /// Read a Float64 variable.
    ///
    /// # Errors
    /// As [`Instance::get_float64`].
    pub fn get(&mut self, name: &str) -> Result<f64, Fault> {
        let mut value = [0.0];
        self.instance.get_float64(&[self.reference(name)], &mut value)?;
        Ok(value[0])
    }

    /// Read a counter.
    ///
    /// # Panics
    /// If it cannot be read.
    #[must_use]
    pub fn count(&mut self, name: &str) -> f64 {
        let mut count = f64::NAN;
        let references = [self.reference(name)];
        let mut put = |_, value| {
            count = value;
            true
        };
        self.instance.get_whole(&references, "test", |_| true, &mut put).expect("a counter");
        count
    }

    /// Through initialisation.
    ///
    /// # Errors
    /// As [`Instance::exit_initialization`].
    pub fn initialize(&mut self) -> Result<(), Fault> {
        self.instance.enter_initialization(0.0, None)?;
        self.instance.exit_initialization()
    }

    /// One step from where the instance stands.
    ///
    /// # Errors
    /// As [`Instance::do_step`].
    pub fn step(&mut self, h: f64) -> Result<bool, Fault> {
        self.instance.do_step(self.instance.time(), h)
    }

    /// Through Event Mode, with whatever updates it asks for, to where steps are done.
    ///
    /// # Errors
    /// As the functions of Event Mode.
    pub fn pass_event_mode(&mut self, interface: Interface) -> Result<(), Fault> {
        while self.instance.update_discrete_states()?.again {}
        match interface {
            Interface::ModelExchange => self.instance.enter_continuous_time_mode(),
            _ => self.instance.enter_step_mode(),
        }
    }

    /// All values of the list that are Float64.
    ///
    /// # Errors
    /// As [`Instance::get_float64`].
    pub fn everything(&mut self) -> Result<Vec<f64>, Fault> {
        let references: Vec<_> = (0_u32..)
            .zip(self.table.variables())
            .filter(|(_, v)| v.entry.kind == Kind::Float64)
            .map(|(i, _)| i)
            .collect();
        let mut values = vec![0.0; references.len()];
        self.instance.get_float64(&references, &mut values)?;
        Ok(values)
    }
}

/// A small generator of reproducible numbers (splitmix64).
#[derive(Debug, Clone)]
pub struct Random(pub u64);

impl Random {
    /// Uniform between `low` and `high`.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
        #[allow(clippy::cast_precision_loss, reason = "53 bits")]
        let unit = (z >> 11) as f64 / (1_u64 << 53) as f64;
        low + (high - low) * unit
    }
}
