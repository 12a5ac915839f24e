//! Rigid-body mechanics of the suite: scalars, joints, elements with ports, loop closure.
//!
//! ```text
//! motion goes forward    r, v, a   leader -> follower
//! force goes backward    F0, M     follower -> leader,   F = F0 - M a
//! ```
//!
//! Everything is a pure function of its arguments and generic over [`Scalar`], so that the same text
//! gives values, directional derivatives and Jacobians. Dimensions are static: `D` is the dimension
//! of the space (2: the plane x-z, 3: space), `N` the number of degrees of freedom of a joint.
//!
//! Source: F. E. Kracht, A. Dandekar, T. Bruckmann, D. Schramm (2017), *Echtzeitfähige
//! objektorientierte Modellbildung am Beispiel einer Fahrzeug-Radaufhängung*, re-derived; equation
//! numbers are those of the models' documentation ([`element`]).

#![forbid(unsafe_code)]
#![allow(non_snake_case, reason = "fields and locals carry the paper's symbols: F, M, G, Y, R")]

pub mod assembly;
pub mod closure;
pub mod drift;
pub mod element;
pub mod joint;
pub mod scalar;
pub mod space;
pub mod spatial;
pub mod spring;

pub use assembly::{
    Accelerations, Assembly, AssemblyError, Baumgarte, ClosingJoint, Gap, Kinematics, KinematicsOf, Member,
    Parent, Place, Tree,
};
pub use closure::{Band, Conditioning, InconsistentClosure, close, conditioning};
pub use drift::NotClosed;
pub use element::{Answer, Body, Hinged, Load, Loaded, NotPositiveDefinite, Point};
pub use joint::{Joint, Planar, Pose, Rigid};
pub use scalar::{Scalar, tanh};
pub use space::{Dim, Space, magnitude};
pub use spatial::{Spatial, SpatialPose};
pub use spring::{SpringDamper, SpringState};

/// Vector of the space of dimension `D`.
pub type Vector<S, const D: usize> = nalgebra::SVector<S, D>;
/// Matrix with `R` rows and `C` columns.
pub type Matrix<S, const R: usize, const C: usize> = nalgebra::SMatrix<S, R, C>;
