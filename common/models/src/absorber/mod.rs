//! Vibration absorbers and what they calm.
//!
//! Source: the absorber specification, section 6 for [`primary_oscillator`].

pub mod primary_oscillator;
mod primary_variables;

pub use primary_oscillator::PrimaryOscillator;
