//! A saved state as bytes, for another process with the same build.
//!
//! ```text
//! version: u32 | length of all: u64 | model token: u128 | content (postcard) | checksum: u128      little-endian
//! ```
//! The token is the hash of the variable table, the checksum the same hash of all bytes before it.
//! Numbers keep their bits. The model itself is not written but built again from its parameters.

use std::ops::Range;

use model::Model;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::jobs::Size;
use crate::state::State;
use crate::table::{Fnv, Layout, Table, guid};
use crate::values::possible;
use crate::{Fault, Instance};

/// Changes whenever the content does: another field of the state, another order.
const VERSION: u32 = 1;

/// Where version, length and token end.
const HEAD: [usize; 3] = [4, 12, 28];

/// Bytes of the checksum.
const CHECKSUM: usize = 16;

/// Why bytes are no state of this FMU.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SerialisedStateError {
    /// Other bytes, or not all of them.
    #[error("length is {found} bytes, expected {expected}")]
    Length {
        /// Number of bytes
        found: usize,
        /// What they should be
        expected: String,
    },
    /// Written by another version of this code.
    #[error("version is {found}, expected {VERSION}")]
    Version {
        /// Version in the bytes
        found: u32,
    },
    /// State of another model.
    #[error("token is {found}, this binary belongs to {expected}")]
    Token {
        /// Token in the bytes
        found: String,
        /// Token of this FMU
        expected: String,
    },
    /// Changed bytes.
    #[error("checksum does not fit: the bytes were changed")]
    Checksum,
    /// Bytes that this code has not written, although everything above fits.
    #[error("content is not a state of this model")]
    Content,
}

impl SerialisedStateError {
    /// A number of bytes that is not the one expected.
    pub(crate) fn length(found: usize, expected: usize) -> Self {
        Length { found, expected: expected.to_string() }
    }
}

use SerialisedStateError::{Checksum, Content, Length, Token, Version};

impl<M: Model> Instance<M> {
    /// A saved state as bytes.
    ///
    /// # Errors
    /// None in practice: writing goes to memory.
    pub fn serialise(&self, saved: &State<M>) -> Result<Vec<u8>, Fault> {
        Ok(self.table.framed(saved)?)
    }

    /// A saved state from bytes.
    ///
    /// # Errors
    /// [`SerialisedStateError`].
    pub fn deserialise(&self, bytes: &[u8]) -> Result<Box<State<M>>, Fault> {
        let state: State<M> = self.table.unframed(bytes)?;
        if !state.fits(&self.table) {
            return Err(Content.into());
        }
        Ok(Box::new(state))
    }
}

impl Table {
    /// A state of the FMU with this table as bytes.
    ///
    /// # Errors
    /// None in practice: writing goes to memory.
    pub fn framed<T: Serialize>(&self, state: &T) -> Result<Vec<u8>, SerialisedStateError> {
        let mut bytes = vec![0; HEAD[2]];
        bytes = postcard::to_extend(state, bytes).map_err(|_| Content)?;
        let length = (bytes.len() + CHECKSUM) as u64;
        bytes[..HEAD[0]].copy_from_slice(&VERSION.to_le_bytes());
        bytes[HEAD[0]..HEAD[1]].copy_from_slice(&length.to_le_bytes());
        bytes[HEAD[1]..HEAD[2]].copy_from_slice(&self.hash.to_le_bytes());
        bytes.extend(checksum(&bytes).to_le_bytes());
        Ok(bytes)
    }

    /// A state of the FMU with this table from bytes.
    ///
    /// # Errors
    /// [`SerialisedStateError`].
    pub fn unframed<T: DeserializeOwned>(&self, bytes: &[u8]) -> Result<T, SerialisedStateError> {
        let content = checked(bytes, self.hash)?;
        let (state, rest) = postcard::take_from_bytes(content).map_err(|_| Content)?;
        if rest.is_empty() { Ok(state) } else { Err(Content) }
    }
}

/// The content, if everything around it is right.
fn checked(bytes: &[u8], token: u128) -> Result<&[u8], SerialisedStateError> {
    let least = HEAD[2] + CHECKSUM;
    if bytes.len() < least {
        return Err(Length { found: bytes.len(), expected: format!("{least} or more") });
    }
    let version = u32::from_le_bytes(part(bytes, 0));
    if version != VERSION {
        return Err(Version { found: version });
    }
    let length = u64::from_le_bytes(part(bytes, HEAD[0]));
    if length != bytes.len() as u64 {
        return Err(Length { found: bytes.len(), expected: length.to_string() });
    }
    let found = u128::from_le_bytes(part(bytes, HEAD[1]));
    if found != token {
        return Err(Token { found: guid(found), expected: guid(token) });
    }
    let (content, sum) = bytes.split_at(bytes.len() - CHECKSUM);
    if checksum(content) != u128::from_le_bytes(part(sum, 0)) {
        return Err(Checksum);
    }
    Ok(&content[HEAD[2]..])
}

/// The `N` bytes from `at` on.
fn part<const N: usize>(bytes: &[u8], at: usize) -> [u8; N] {
    std::array::from_fn(|i| bytes[at + i])
}

fn checksum(bytes: &[u8]) -> u128 {
    let mut hash = Fnv::new();
    hash.write(bytes);
    hash.0
}

impl<M: Model> State<M> {
    /// True if all lists have the lengths that belong to the model, and parameters are in their ranges.
    fn fits(&self, table: &Table) -> bool {
        let inputs = Layout::<M>::INPUTS.len();
        let states = self.model.as_ref().map(|model| model.with_system(Size));
        let parameters = Layout::<M>::PARAMETERS.start..Layout::<M>::PORT.end; // the solver's and the port's, too
        let entries = |range: Range<usize>| table.variables[range].iter().map(|v| &v.entry);
        self.values.len() == table.variables.len()
            && possible(entries(parameters.clone()), &self.values[parameters])
            && self.motion_start.len() == Layout::<M>::MOTION.len()
            && states.is_none_or(|n| self.x.len() == n)
            && self.places.len() == if M::MODEL_EXCHANGE { self.x.len() } else { 0 }
            && self.places.iter().all(|place| *place < table.states.len())
            && self.unused.len() == table.states.len()
            && self.given.len() == inputs
            && self.history.fits(if Layout::<M>::TREATED { inputs } else { 0 })
            && self.sides.len() == M::INDICATORS.len()
    }
}
