//! The haptic interface against reference files that were computed by a separate program, and against closed forms.

#![allow(non_snake_case, reason = "symbols of the write-ups")]

mod csv;
mod device;
mod loops;
mod plant;
mod sampled_wall;
