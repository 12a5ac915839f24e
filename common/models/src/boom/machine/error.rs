//! What is wrong with a machine file.

/// What is wrong with a machine file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MachineError {
    /// It is no JSON, or a key is missing or of another type.
    #[error("{0}")]
    Syntax(String),
    /// Another version.
    #[error("schema = {found}; allowed: 1")]
    Schema {
        /// Version in the file
        found: i64,
    },
    /// A value out of its range.
    #[error("{key} = {value}; allowed: {allowed}")]
    Value {
        /// Where it stands
        key: String,
        /// The value
        value: f64,
        /// What would be accepted
        allowed: String,
    },
    /// Rocker and coupler cannot meet somewhere in the range of the joint.
    #[error(
        "the linkage of cylinder[{cylinder}] does not close at joint[{cylinder}].angle = {angle:.6} rad: h^2 = {h_2:.3e} m2 (B5); \
         allowed: > 0 over joint.min .. joint.max"
    )]
    Open {
        /// Number of cylinder and joint, from 2
        cylinder: usize,
        /// Angle of the joint [rad]
        angle: f64,
        /// Square of the height of the triangle of rocker and coupler [m2]
        h_2: f64,
    },
    /// The cylinder passes a dead centre.
    #[error(
        "ds/dq of cylinder[{cylinder}] changes its sign at joint[{cylinder}].angle = {angle:.6} rad: {slope:.3e} m/rad (B8); \
         allowed: one sign over joint.min .. joint.max"
    )]
    DeadCentre {
        /// Number of cylinder and joint, from 2
        cylinder: usize,
        /// Angle of the joint [rad]
        angle: f64,
        /// Slope there [m/rad]
        slope: f64,
    },
    /// The stroke leaves its range.
    #[error(
        "the stroke of cylinder[{cylinder}] is {stroke:.6} m at joint[{cylinder}].angle = {angle:.6} rad (B6); allowed: 0 .. {max} m \
         over joint.min .. joint.max"
    )]
    Stroke {
        /// Number of cylinder and joint, from 2
        cylinder: usize,
        /// Angle of the joint [rad]
        angle: f64,
        /// Stroke there [m]
        stroke: f64,
        /// Its largest value [m]
        max: f64,
    },
    /// The feet are no convex polygon counter-clockwise from above.
    #[error(
        "support.{support}: the polygon of the feet turns by {turn:.3e} m2 at foot {foot}; allowed: > 0 (convex, \
         counter-clockwise from above)"
    )]
    Feet {
        /// Name of the support
        support: &'static str,
        /// Number of the foot, from 1
        foot: usize,
        /// Cross product of the edges that meet there [m2]
        turn: f64,
    },
}
