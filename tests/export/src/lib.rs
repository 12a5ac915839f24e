//! What the tests share: an instance addressed by names.

use fmu_export::{Fault, Instance, Table};
use model::{Kind, Model};

/// An instance whose variables are addressed by name.
#[derive(Debug)]
pub struct Named<M: Model> {
    /// The instance
    pub instance: Instance<M>,
    table: Table,
}

impl<M: Model> Default for Named<M> {
    fn default() -> Self {
        Self { instance: Instance::new(), table: Table::new::<M>() }
    }
}

impl<M: Model> Named<M> {
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

    /// Read a Float64 variable.
    ///
    /// # Errors
    /// As [`Instance::get_float64`].
    pub fn get(&mut self, name: &str) -> Result<f64, Fault> {
        let mut value = [0.0];
        self.instance.get_float64(&[self.reference(name)], &mut value)?;
        Ok(value[0])
    }

    /// Through initialisation.
    ///
    /// # Errors
    /// As [`Instance::exit_initialization`].
    pub fn initialize(&mut self) -> Result<(), Fault> {
        self.instance.enter_initialization(0.0, None)?;
        self.instance.exit_initialization()
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
