//! The functions that `export!` exports have the types that the headers of FMI 2.0 and 3.0 declare.
//!
//! The headers come as types of the crate `fmi-sys`. Everything is checked while compiling: arguments and results are
//! of the same type, or of two types that are passed in the same way (see [`same`]). The test checks that no exported
//! function is left out. Needs libclang, see `scripts/setup`.

mod functions;
mod same;

fmu_export::export!(export_tests::rod::Rod);
