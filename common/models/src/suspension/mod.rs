//! Wheel suspension: rods, carrier and strut, and the double wishbone made of them.
//!
//! Source: F. E. Kracht, A. Dandekar, T. Bruckmann, D. Schramm (2017), *Echtzeitfähige
//! objektorientierte Modellbildung am Beispiel einer Fahrzeug-Radaufhängung*, 3rd D-A-CH IFToMM
//! conference, Chemnitz. The equations were re-derived: the printed ones hold in the plane only
//! (they ignore the moment of the universal joint).
//!
//! World frame E right-handed, z up; plane scenes live in x-z. Equation numbers (1)-(12c) are those
//! of [`mechanics::joint`] and [`mechanics::element`], (15)-(16) of [`mechanics::spring`], (17), (20) of
//! [`mechanics::assembly`] and [`mechanics::drift`], (18) of [`mechanics::closure`].

mod coordinates;
pub mod double_pendulum;
mod double_wishbone;
mod element;
pub mod four_bar;
mod inertia;
pub mod link2;
pub mod link3;
mod linkage;
mod parameters;
mod rod;
mod start;
pub mod strut_link;
mod variables;
mod wishbone;

pub use crate::force_law::{LoadParameters, PulsePhase};
pub use double_pendulum::DoublePendulum;
pub use double_wishbone::DoubleWishbone;
pub use four_bar::FourBar;
pub use link2::Link2;
pub use link3::Link3;
pub use linkage::PlanarRod;
pub use parameters::{
    ArmJoint, CarrierJoint, ClosureKind, ForceKind, Parameters, PreloadMode, SceneMotion, StabilisationKind,
    StabilisationParameters,
};
pub use rod::RodParameters;
pub use strut_link::StrutLink;
pub use variables::{Dynamics, Energy, Inputs, Motion};
