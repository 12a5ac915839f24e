//! Runs scenes of FMUs: import, sweep, closures, methods, studies.
//!
//! | module | what it does |
//! | --- | --- |
//! | [`assembly`] | a scene as one Co-Simulation FMU |
//! | [`import`] | FMUs of FMI 2.0 and 3.0: archive, description, instances (the only unsafe code, `import::binding`) |
//! | [`ssp`] | scene files |
//! | [`xml`] | XML as a tree |

#![allow(rustdoc::broken_intra_doc_links, reason = "units stand in brackets")]

pub mod assembly;
pub mod audit;
pub mod check;
pub mod cli;
pub mod closure;
pub mod error;
pub mod import;
pub mod methods;
pub mod record;
pub mod run;
pub mod scene;
pub mod ssp;
pub mod start;
pub mod study;
pub mod sweep;
pub mod xml;
