//! What a model description and an archive say about an FMU besides its variables.

use std::ops::Range;

use model::{Documentation, Experiment, Model};

use crate::solver::{SolverMethod, method_name};
use crate::table::{Layout, Part};

/// What is said about an FMU besides its variables.
#[derive(Debug, Clone)]
pub struct Profile<'a> {
    /// Name, also of the library
    pub name: &'a str,
    /// One sentence
    pub description: &'a str,
    /// Start of the default experiment [s]
    pub start: f64,
    /// The default experiment
    pub experiment: Experiment,
    /// Offered for Model Exchange
    pub model_exchange: bool,
    /// Value references of the event indicators
    pub indicators: Range<usize>,
    /// Saved states can be turned into bytes
    pub serialised_states: bool,
    /// Directional derivatives are offered
    pub directional_derivatives: bool,
    /// Value references of the parameters that are not the solver's and not those of the input treatment
    pub parameters: Range<usize>,
    /// Write-up, icon and reference run
    pub documentation: Documentation,
    /// Method of the reference run
    pub reference_method: &'static str,
}

/// `dop853`, where that is not on offer `dopri5`, otherwise the first one.
fn reference_method(offered: &[i64]) -> &'static str {
    let wanted = [SolverMethod::Dop853 as i64, SolverMethod::Dopri5 as i64];
    let best = wanted.into_iter().find(|method| offered.contains(method));
    best.or(offered.first().copied()).map_or("", method_name)
}

impl Profile<'static> {
    /// What a model says.
    pub(crate) fn of<M: Model>() -> Self {
        Self {
            name: M::NAME,
            description: M::DESCRIPTION,
            start: 0.0,
            experiment: M::EXPERIMENT,
            model_exchange: M::MODEL_EXCHANGE,
            indicators: Layout::<M>::part(Part::Indicators),
            serialised_states: true,
            directional_derivatives: true,
            parameters: Layout::<M>::PARAMETERS,
            documentation: M::DOCUMENTATION,
            reference_method: reference_method(M::METHODS),
        }
    }
}
