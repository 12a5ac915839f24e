//! A model together with what it was built from, so that a serialised state can build it again.

use std::ops::Deref;

use model::{Model, ParameterError, Variables};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::table::Layout;
use crate::values::possible;

/// What a model is built from.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Recipe {
    /// Parameters at the start
    parameters: Vec<f64>,
    /// Start values of the motion group
    start: Vec<f64>,
    /// Parameters that were taken over last
    tuned: Vec<f64>,
    /// A host integrates the states
    exchange: bool,
}

/// A model that knows what it was built from.
#[derive(Debug, Clone)]
pub(crate) struct Built<M> {
    model: M,
    recipe: Recipe,
}

impl<M: Model> Built<M> {
    /// A model from its parameters and the start values of its motion group.
    ///
    /// # Errors
    /// Values that do not fit together.
    pub(crate) fn new(parameters: &[f64], start: &[f64], exchange: bool) -> Result<Self, ParameterError> {
        let mut model = M::new(&M::Parameters::load(parameters), &M::Motion::load(start))?;
        if exchange {
            model.for_model_exchange();
        }
        let [parameters, start, tuned] = [parameters, start, parameters].map(<[f64]>::to_vec);
        Ok(Self { model, recipe: Recipe { parameters, start, tuned, exchange } })
    }

    /// Take over tunable parameters.
    pub(crate) fn retune(&mut self, parameters: &[f64]) {
        self.model.retune(&M::Parameters::load(parameters));
        if self.recipe.exchange {
            self.model.for_model_exchange();
        }
        self.recipe.tuned.copy_from_slice(parameters);
    }
}

impl<M> Deref for Built<M> {
    type Target = M;
    fn deref(&self) -> &M {
        &self.model
    }
}

impl<M> Serialize for Built<M> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.recipe.serialize(serializer)
    }
}

impl<'de, M: Model> Deserialize<'de> for Built<M> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let Recipe { parameters, start, tuned, exchange } = Recipe::deserialize(deserializer)?;
        let count = Layout::<M>::PARAMETERS.len();
        if parameters.len() != count || tuned.len() != count || start.len() != Layout::<M>::MOTION.len() {
            return Err(D::Error::custom("number of parameters"));
        }
        let fit = |values: &[f64]| possible(M::Parameters::TABLE.iter(), values);
        if !fit(&parameters) || !fit(&tuned) {
            return Err(D::Error::custom("parameter out of its range"));
        }
        let mut built = Self::new(&parameters, &start, exchange).map_err(D::Error::custom)?;
        if tuned.iter().zip(&parameters).any(|(a, b)| a.to_bits() != b.to_bits()) {
            built.retune(&tuned);
        }
        Ok(built)
    }
}
