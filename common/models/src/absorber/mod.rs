//! Vibration absorbers and what they calm.
//!
//! Source: the absorber specification, section 6 for [`primary_oscillator`], the others for [`rvdp_absorber`].

pub mod control_law;
pub mod primary_oscillator;
mod primary_variables;
pub mod rvdp_absorber;
mod rvdp_variables;
pub mod synchronisation;

pub use primary_oscillator::PrimaryOscillator;
pub use rvdp_absorber::RvdpAbsorber;
