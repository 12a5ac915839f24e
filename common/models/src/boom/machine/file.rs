//! The machine file, key by key.

use std::f64::consts::TAU;

use mechanics::Scalar;
use serde::Deserialize;

use super::super::linkage::{Linkage, Stroke};
use super::{CYLINDERS, JOINTS};

/// Denavit-Hartenberg parameters of a link (standard form).
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct Link {
    /// Offset of the angle [rad]
    pub theta_offset: f64,
    /// Offset along the joint's axis [m]
    pub d: f64,
    /// Length [m]
    pub a: f64,
    /// Twist [rad]
    pub alpha: f64,
}

/// Box with its centre and half extents in the frame it belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct BoxShape {
    /// Centre [m]
    pub center: [f64; 3],
    /// Half extents [m]
    pub half: [f64; 3],
}

/// Cylinder with its linkage.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct Cylinder {
    /// Number of the joint that it moves, from 1
    pub(super) joint: usize,
    /// How it acts on the joint
    pub linkage: Linkage,
    /// Diameter of the piston [m]
    pub bore: f64,
    /// Diameter of the rod [m]
    pub rod: f64,
    /// Pin to pin, retracted [m]
    pub length_min: f64,
    /// Largest stroke [m]
    pub stroke_max: f64,
    /// Mass of the barrel [kg]
    pub barrel_mass: f64,
    /// Mass of rod and piston [kg]
    pub rod_mass: f64,
    /// From the pin to the piston, retracted [m]
    pub dead_length: f64,
}

impl Cylinder {
    /// Area of the piston side [m2].
    #[must_use]
    pub fn piston_area(&self) -> f64 {
        TAU / 8.0 * self.bore * self.bore
    }

    /// Area of the rod side [m2].
    #[must_use]
    pub fn rod_area(&self) -> f64 {
        TAU / 8.0 * (self.bore * self.bore - self.rod * self.rod)
    }

    /// Stroke and its derivatives at the joint angle `q`.
    #[inline]
    pub fn stroke<S: Scalar>(&self, q: S) -> Stroke<S> {
        self.linkage.stroke(q, self.length_min)
    }
}

/// What stands on the ground: outriggers 1 front left, 2 rear left, 3 rear right, 4 front right.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct Support {
    /// Pivot of each leg [m]
    pub pivot: [[f64; 2]; 4],
    /// Swing angle of each leg from +x [rad]
    pub angle: [f64; 4],
    /// Length of each leg [m]
    pub length: [f64; 4],
}

impl Support {
    /// A point of leg `p`, at the fraction `at` of its length.
    pub(super) fn along(&self, p: usize, at: f64) -> [f64; 2] {
        let (sin, cos) = self.angle[p].sin_cos();
        [self.pivot[p][0] + at * self.length[p] * cos, self.pivot[p][1] + at * self.length[p] * sin]
    }

    /// The feet on the ground [m].
    #[must_use]
    pub fn feet(&self) -> [[f64; 2]; 4] {
        std::array::from_fn(|p| self.along(p, 1.0))
    }
}

/// Limits of one variant of the control; index 0: slewing, 1 to 5: cylinders 2 to 6.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct Variant {
    /// Largest rates [rad/s]
    pub rate_max: [f64; JOINTS],
    /// The tangential limit acts
    pub tangential_active: bool,
    /// Largest tangential speeds [m/s]
    pub tangential_max: [f64; JOINTS],
    /// Largest flows of extending cylinders, of counter-clockwise slewing [m3/s]
    pub flow_max_extend: [f64; JOINTS],
    /// Largest flows of retracting cylinders, of clockwise slewing [m3/s]
    pub flow_max_retract: [f64; JOINTS],
    /// Largest total flow [m3/s]
    pub flow_total_max: f64,
}

/// Distances below which a flag warns.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct Threshold {
    /// Of the boxes of arms 2 to 6 [m]
    pub collision: [f64; CYLINDERS],
    /// Heights of the link ends above the ground [m]
    pub ground: [f64; JOINTS],
    /// Tip-over angle [rad]
    pub tip_over: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub(super) struct Base {
    pub(super) position: [f64; 3],
    pub(super) yaw: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub(super) struct Range {
    pub(super) min: [f64; JOINTS],
    pub(super) max: [f64; JOINTS],
}

#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub(super) struct Pipe {
    pub(super) inner_area: f64,
    pub(super) concrete_density: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub(super) struct Chassis {
    pub(super) mass: f64,
    pub(super) com: [f64; 3],
}

/// Oil in tank and cylinders.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct Oil {
    /// Density [kg/m3]
    pub density: f64,
    /// Where the tank is [m]
    pub tank_position: [f64; 3],
    /// Mass in tank and cylinders together [kg]
    pub total_mass: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub(super) struct OutriggerBox {
    pub(super) half_width: f64,
    pub(super) half_height: f64,
    pub(super) end_overlap: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub(super) struct Supports {
    pub(super) full: Support,
    pub(super) partial: Support,
}

#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub(super) struct Arms {
    #[serde(rename = "2")]
    pub(super) second: BoxShape,
    #[serde(rename = "3")]
    pub(super) third: BoxShape,
    #[serde(rename = "4")]
    pub(super) fourth: BoxShape,
    #[serde(rename = "5")]
    pub(super) fifth: BoxShape,
    #[serde(rename = "6")]
    pub(super) sixth: BoxShape,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
pub(super) struct Boxes {
    pub(super) arm: Arms,
    pub(super) cab: BoxShape,
    pub(super) rear: BoxShape,
    #[serde(default)]
    pub(super) extra: Vec<BoxShape>,
}

#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub(super) struct Slew {
    pub(super) displacement: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub(super) struct Variants {
    #[serde(rename = "A")]
    pub(super) a: Variant,
    #[serde(rename = "B")]
    pub(super) b: Variant,
    #[serde(rename = "C")]
    pub(super) c: Variant,
}

/// Joint angles that have names.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct Poses {
    /// Folded on the vehicle [rad]
    pub transport: [f64; JOINTS],
    /// Partly unfolded [rad]
    pub partial: [f64; JOINTS],
    /// Unfolded [rad]
    pub full: [f64; JOINTS],
}

/// The version alone, so that another version is named before its missing keys are.
#[derive(Deserialize)]
pub(super) struct Schema {
    pub(super) schema: i64,
}

/// The file, key by key.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub(super) struct File {
    pub(super) gravity: f64,
    pub(super) base: Base,
    pub(super) dh: [Link; JOINTS],
    pub(super) joint: Range,
    pub(super) arm_mass: [f64; JOINTS],
    pub(super) arm_com: [[f64; 3]; JOINTS],
    pub(super) pipe: Pipe,
    pub(super) chassis: Chassis,
    pub(super) oil: Oil,
    pub(super) outrigger_mass: f64,
    pub(super) outrigger_com_fraction: f64,
    pub(super) outrigger_com_z: f64,
    pub(super) outrigger_box: OutriggerBox,
    pub(super) support: Supports,
    #[serde(rename = "box")]
    pub(super) boxes: Boxes,
    pub(super) cylinder: [Option<Cylinder>; JOINTS],
    pub(super) slew: Slew,
    pub(super) threshold: Threshold,
    pub(super) variant: Variants,
    pub(super) pose: Poses,
}
