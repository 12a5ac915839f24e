//! Everything that a run changes: what `GetFMUState` saves.

use integrators::{Solver, Statistics};
use model::Model;
use serde::{Deserialize, Serialize};

use crate::built::Built;
use crate::inputs::History;
use crate::phase::{Interface, Phase};
use crate::table::{Layout, Table};

/// Everything that a run changes.
#[derive(Debug, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct State<M: Model> {
    pub(crate) interface: Interface,
    pub(crate) phase: Phase,
    pub(crate) values: Vec<f64>,
    /// Start values of the motion group as set; in `values` the computed ones replace them
    pub(crate) motion_start: Vec<f64>,
    pub(crate) model: Option<Built<M>>,
    /// States of the system that the model has chosen
    pub(crate) x: Vec<f64>,
    /// Place of each of them among the declared states
    pub(crate) places: Vec<usize>,
    /// Values of the declared states at the start, kept by those that the system does not use
    pub(crate) unused: Vec<f64>,
    pub(crate) discrete: M::Discrete,
    pub(crate) start_time: f64,
    pub(crate) stop_time: Option<f64>,
    pub(crate) solver: Option<Solver>,
    pub(crate) statistics: Statistics,
    /// Bit per part: the values in the list belong to the present states and inputs
    pub(crate) fresh: u8,
    /// Tunable parameters were set and not yet taken over
    pub(crate) retune: bool,
    /// Inner step for which the stability guard was passed; 0: look again
    pub(crate) guarded: f64,
    /// Inputs as the host has set them; in `values` they are where their polynomials ended
    pub(crate) given: Vec<f64>,
    pub(crate) history: History,
    /// Value of `port.reset` at which the history was last emptied
    pub(crate) reset_seen: f64,
    /// Sides of the event indicators when Continuous-Time Mode began: -1, 0 (at zero), 1
    pub(crate) sides: Vec<f64>,
    /// An indicator has crossed zero
    pub(crate) crossed: bool,
}

impl<M: Model> Clone for State<M> {
    fn clone(&self) -> Self {
        Self {
            values: self.values.clone(),
            motion_start: self.motion_start.clone(),
            model: self.model.clone(),
            x: self.x.clone(),
            places: self.places.clone(),
            unused: self.unused.clone(),
            given: self.given.clone(),
            history: self.history.clone(),
            sides: self.sides.clone(),
            ..*self
        }
    }
    fn clone_from(&mut self, other: &Self) {
        let taken = |mut mine: Vec<f64>, theirs: &Vec<f64>| {
            mine.clone_from(theirs);
            mine
        };
        self.places.clone_from(&other.places);
        self.history.copy_from(&other.history);
        let no_history = History::new(0);
        *self = Self {
            values: taken(std::mem::take(&mut self.values), &other.values),
            motion_start: taken(std::mem::take(&mut self.motion_start), &other.motion_start),
            model: other.model.clone(),
            x: taken(std::mem::take(&mut self.x), &other.x),
            places: std::mem::take(&mut self.places),
            unused: taken(std::mem::take(&mut self.unused), &other.unused),
            given: taken(std::mem::take(&mut self.given), &other.given),
            history: std::mem::replace(&mut self.history, no_history),
            sides: taken(std::mem::take(&mut self.sides), &other.sides),
            ..*other
        };
    }
}

impl<M: Model> State<M> {
    /// All start values, for an instance used through `interface`.
    pub(crate) fn new(table: &Table, interface: Interface) -> Self {
        let values = table.start_values();
        let given = values[Layout::<M>::INPUTS].to_vec();
        Self {
            interface,
            phase: Phase::Instantiated,
            motion_start: values[Layout::<M>::MOTION].to_vec(),
            model: None,
            x: Vec::new(),
            places: Vec::new(),
            unused: table.states.iter().map(|i| values[*i]).collect(),
            discrete: M::Discrete::default(),
            start_time: 0.0,
            stop_time: None,
            solver: None,
            statistics: Statistics::default(),
            fresh: 0,
            retune: false,
            guarded: 0.0,
            history: History::new(if Layout::<M>::TREATED { given.len() } else { 0 }),
            given,
            reset_seen: 0.0,
            sides: vec![0.0; M::INDICATORS.len()],
            crossed: false,
            values,
        }
    }
}
