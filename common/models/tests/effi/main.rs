//! The haptic interface against reference files that were computed by a separate program, and against closed forms.

#![allow(clippy::unreadable_literal, reason = "numbers as the reference files have them")]
#![allow(clippy::default_trait_access, reason = "the type is that of the model")]
#![allow(non_snake_case, reason = "symbols of the write-ups")]

mod csv;
mod device;
mod loops;
mod plant;
mod sampled_wall;
