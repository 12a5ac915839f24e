//! A call as data: it can be left out of a sequence without changing the others.

use crate::api::{Inquiry, Lists, Transition};
use crate::standard::Interface;

/// One call on one of the places for instances.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Call {
    pub(crate) slot: usize,
    pub(crate) action: Action,
}

/// Type whose Get or Set is called.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Access {
    Float64,
    Int32,
    /// Enumerations too
    Int64,
    Boolean,
    /// There are no such variables; strings in FMI 2.0
    Float32,
}

/// What is wrong with the arrays of a call.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Spoil {
    Nothing,
    NullReferences,
    NullValues,
    OneMore,
    OneLess,
}

/// A time, told from where the instance stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum At {
    Now,
    After(f64),
    Absolute(f64),
}

/// What becomes of a serialised state before it is read again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Mutation {
    None,
    /// One bit of the byte at this place (modulo the length)
    Flip(usize),
    /// Only as many bytes (modulo the length)
    Cut(usize),
    /// Bytes behind the end
    Longer(usize),
    /// Random bytes of this number
    Noise(usize),
    /// The state of another FMU
    Foreign,
    /// The bytes are asked for with another size
    WrongSize(isize),
}

/// What is called.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Action {
    /// A new instance in the place; one that is there is freed before
    Instantiate(Interface),
    /// With a wrong token: there must be none
    InstantiateWrongly(Interface),
    Free,
    SetDebugLogging {
        on: bool,
        categories: Vec<String>,
    },
    EnterInitialization {
        start: f64,
        stop: Option<f64>,
    },
    Transition(Transition),
    UpdateDiscreteStates {
        null: Option<usize>,
    },
    CompletedIntegratorStep {
        null: Option<usize>,
    },
    DoStep {
        at: At,
        step: f64,
        null: Option<usize>,
    },
    SetTime(At),
    Get {
        access: Access,
        references: Vec<u32>,
        spoil: Spoil,
    },
    Set {
        access: Access,
        /// Whole numbers go through as they are, Float64 as its bits
        values: Vec<(u32, u64)>,
        spoil: Spoil,
    },
    GetList {
        list: Lists,
        spoil: Spoil,
    },
    SetStates {
        values: Vec<f64>,
        spoil: Spoil,
    },
    Count {
        states: bool,
        null: bool,
    },
    /// A step of Euler's method by a foreign integrator, left out where it leads to infinity
    Euler(f64),
    Directional {
        adjoint: bool,
        unknowns: Vec<u32>,
        knowns: Vec<(u32, f64)>,
        spoil: Spoil,
    },
    Dependencies {
        reference: u32,
        n: Option<usize>,
    },
    Save(usize),
    Restore(usize),
    FreeState(usize),
    /// Serialise the state, spoil the bytes, put what comes back into its place
    Serialize {
        store: usize,
        mutation: Mutation,
    },
    /// What FMI 2.0 answers about the last step
    Inquire {
        inquiry: Inquiry,
        kind: i32,
        null: bool,
    },
    /// Read everything that may be read
    Observe,
}

impl Action {
    /// True if the call only reads; a state that comes back from its bytes is the same.
    pub(crate) fn reads(&self) -> bool {
        matches!(
            self,
            Self::Get { .. }
                | Self::GetList { .. }
                | Self::Count { .. }
                | Self::Directional { .. }
                | Self::Dependencies { .. }
                | Self::Inquire { .. }
                | Self::Serialize { .. }
                | Self::Observe
        )
    }
}

impl std::fmt::Display for Call {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "instance {}: ", self.slot)?;
        let Action::Set { access, values, spoil } = &self.action else {
            return write!(f, "{:?}", self.action);
        };
        write!(f, "Set {access:?} {spoil:?}")?;
        for (reference, bits) in values {
            match access {
                Access::Float64 => write!(f, " #{reference} = {:?}", f64::from_bits(*bits))?,
                _ => write!(f, " #{reference} = {}", bits.cast_signed())?,
            }
        }
        Ok(())
    }
}
