//! Data of a machine: the file (`schema` 1, JSON) and the checks that it has to pass.
//!
//! The file that stands beside this one is compiled in: a self-consistent machine of the 56 m class. Its numbers are
//! assumptions, not those of a real machine (see its `provenance`).

use std::f64::consts::TAU;
use std::path::Path;
use std::sync::{Arc, OnceLock};

use mechanics::Scalar;
use model::Vector3;
use serde::Deserialize;

use super::linkage::{Linkage, Stroke};

/// Number of joints.
pub const JOINTS: usize = 6;
/// Number of luffing joints, each with one cylinder; cylinder `i` belongs to joint `i + 1` counted from 0.
pub const CYLINDERS: usize = 5;
/// Angles at which each linkage is looked at over the range of its joint.
const LOOKS: u32 = 721;
/// Largest number of boxes beyond outriggers, cab and rear.
pub const MAX_EXTRA: usize = 26;

const DEFAULT: &str = include_str!("machine_56m.json");

/// What is wrong with a machine file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MachineError {
    /// It cannot be read.
    #[error("it cannot be read: {0}")]
    Unreadable(String),
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
    joint: usize,
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
    fn along(&self, p: usize, at: f64) -> [f64; 2] {
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
struct Base {
    position: [f64; 3],
    yaw: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
struct Range {
    min: [f64; JOINTS],
    max: [f64; JOINTS],
}

#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
struct Pipe {
    inner_area: f64,
    concrete_density: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
struct Chassis {
    mass: f64,
    com: [f64; 3],
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
struct OutriggerBox {
    half_width: f64,
    half_height: f64,
    end_overlap: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
struct Supports {
    full: Support,
    partial: Support,
}

#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
struct Arms {
    #[serde(rename = "2")]
    arm_2: BoxShape,
    #[serde(rename = "3")]
    arm_3: BoxShape,
    #[serde(rename = "4")]
    arm_4: BoxShape,
    #[serde(rename = "5")]
    arm_5: BoxShape,
    #[serde(rename = "6")]
    arm_6: BoxShape,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
struct Boxes {
    arm: Arms,
    cab: BoxShape,
    rear: BoxShape,
    #[serde(default)]
    extra: Vec<BoxShape>,
}

#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
struct Slew {
    displacement: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
struct Variants {
    #[serde(rename = "A")]
    a: Variant,
    #[serde(rename = "B")]
    b: Variant,
    #[serde(rename = "C")]
    c: Variant,
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
struct Schema {
    schema: i64,
}

/// The file, key by key.
#[derive(Debug, Clone, PartialEq, Deserialize)]
struct File {
    gravity: f64,
    base: Base,
    dh: [Link; JOINTS],
    joint: Range,
    arm_mass: [f64; JOINTS],
    arm_com: [[f64; 3]; JOINTS],
    pipe: Pipe,
    chassis: Chassis,
    oil: Oil,
    outrigger_mass: f64,
    outrigger_com_fraction: f64,
    outrigger_com_z: f64,
    outrigger_box: OutriggerBox,
    support: Supports,
    #[serde(rename = "box")]
    boxes: Boxes,
    cylinder: [Option<Cylinder>; JOINTS],
    slew: Slew,
    threshold: Threshold,
    variant: Variants,
    pose: Poses,
}

/// Box in space: its centre, half extents and axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlacedBox {
    /// Centre [m]
    pub center: Vector3<f64>,
    /// Half extents [m]
    pub half: [f64; 3],
    /// Unit vectors along its edges
    pub axes: [Vector3<f64>; 3],
}

/// A machine that has passed all checks.
#[derive(Debug, Clone, PartialEq)]
pub struct Machine {
    /// Gravity, along -z [m/s2]
    pub gravity: f64,
    /// Origin of K_0 [m]
    pub base: Vector3<f64>,
    /// Angle of K_0 about z [rad]
    pub yaw: f64,
    /// Links 1 to 6
    pub links: [Link; JOINTS],
    /// Smallest joint angles [rad]
    pub min: [f64; JOINTS],
    /// Largest joint angles [rad]
    pub max: [f64; JOINTS],
    /// Masses of links 1 to 6, empty pipe included [kg]
    pub arm_mass: [f64; JOINTS],
    /// Their centres in the links' frames [m]
    pub arm_com: [Vector3<f64>; JOINTS],
    /// Mass of concrete in a full pipe per length [kg/m]
    pub concrete: f64,
    /// Oil in tank and cylinders
    pub oil: Oil,
    /// Boxes of arms 2 to 6 in the links' frames
    pub arms: [BoxShape; CYLINDERS],
    /// Cylinders 2 to 6
    pub cylinders: [Cylinder; CYLINDERS],
    /// Oil per angle of the slew motor [m3/rad]
    pub slew_displacement: f64,
    /// When flags warn
    pub threshold: Threshold,
    /// Named poses
    pub pose: Poses,
    /// Supports: full, partial
    supports: [Support; 2],
    /// Limits of variants A, B, C
    variants: [Variant; 3],
    chassis: Chassis,
    outrigger: (f64, f64, f64),
    outrigger_box: OutriggerBox,
    fixed: Vec<BoxShape>,
}

impl Machine {
    /// The machine that is compiled in.
    ///
    /// # Errors
    /// None: the tests read it.
    pub fn compiled_in() -> Result<Arc<Self>, MachineError> {
        static MACHINE: OnceLock<Result<Arc<Machine>, MachineError>> = OnceLock::new();
        MACHINE.get_or_init(|| Self::parse(DEFAULT).map(Arc::new)).clone()
    }

    /// A machine from a file.
    ///
    /// # Errors
    /// [`MachineError`].
    pub fn read(file: &Path) -> Result<Arc<Self>, MachineError> {
        let text = std::fs::read_to_string(file).map_err(|e| MachineError::Unreadable(e.to_string()))?;
        Self::parse(&text).map(Arc::new)
    }

    /// A machine from the text of a file.
    ///
    /// # Errors
    /// [`MachineError`].
    pub fn parse(text: &str) -> Result<Self, MachineError> {
        let syntax = |e: serde_json::Error| MachineError::Syntax(e.to_string());
        let Schema { schema } = serde_json::from_str(text).map_err(syntax)?;
        if schema != 1 {
            return Err(MachineError::Schema { found: schema });
        }
        let file: File = serde_json::from_str(text).map_err(syntax)?;
        let machine = Self::from_file(file)?;
        machine.check_ranges()?;
        for support in [0, 1] {
            machine.check_feet(support)?;
        }
        (0..CYLINDERS).try_for_each(|i| machine.check_linkage(i))?;
        Ok(machine)
    }

    fn from_file(file: File) -> Result<Self, MachineError> {
        let File { boxes, pipe, base, .. } = file;
        let [slewing, cylinders @ ..] = file.cylinder;
        if slewing.is_some() {
            return Err(MachineError::Syntax("cylinder[0] is not null: joint 1 is slewed by a motor".into()));
        }
        let mut found = Vec::with_capacity(CYLINDERS);
        for (i, cylinder) in cylinders.into_iter().enumerate() {
            let missing = || MachineError::Syntax(format!("cylinder[{}] is null", i + 1));
            let cylinder = cylinder.ok_or_else(missing)?;
            if cylinder.joint != i + 2 {
                #[allow(clippy::cast_precision_loss, reason = "a small number, for a message")]
                let value = cylinder.joint as f64;
                return Err(refused(format!("cylinder[{}].joint", i + 1), value, format!("{}", i + 2)));
            }
            found.push(cylinder);
        }
        let Arms { arm_2, arm_3, arm_4, arm_5, arm_6 } = boxes.arm;
        if boxes.extra.len() > MAX_EXTRA {
            return Err(MachineError::Syntax(format!(
                "box.extra has {} boxes; allowed: 0 .. {MAX_EXTRA}",
                boxes.extra.len()
            )));
        }
        Ok(Self {
            gravity: file.gravity,
            base: base.position.into(),
            yaw: base.yaw,
            links: file.dh,
            min: file.joint.min,
            max: file.joint.max,
            arm_mass: file.arm_mass,
            arm_com: file.arm_com.map(Vector3::from),
            concrete: pipe.inner_area * pipe.concrete_density,
            oil: file.oil,
            arms: [arm_2, arm_3, arm_4, arm_5, arm_6],
            cylinders: std::array::from_fn(|i| found[i]),
            slew_displacement: file.slew.displacement,
            threshold: file.threshold,
            pose: file.pose,
            supports: [file.support.full, file.support.partial],
            variants: [file.variant.a, file.variant.b, file.variant.c],
            chassis: file.chassis,
            outrigger: (file.outrigger_mass, file.outrigger_com_fraction, file.outrigger_com_z),
            outrigger_box: file.outrigger_box,
            fixed: [boxes.cab, boxes.rear].into_iter().chain(boxes.extra).collect(),
        })
    }

    /// The support: 0 full, 1 partial.
    #[must_use]
    pub fn support(&self, index: usize) -> &Support {
        &self.supports[index]
    }

    /// The limits: 0 variant A, 1 B, 2 C.
    #[must_use]
    pub fn variant(&self, index: usize) -> &Variant {
        &self.variants[index]
    }

    /// The joint angle inside its range that is next to `q`.
    #[inline]
    #[must_use]
    pub fn within<S: Scalar>(&self, joint: usize, q: S) -> S {
        if q.re() > self.max[joint] {
            S::lift(self.max[joint])
        } else if q.re() < self.min[joint] {
            S::lift(self.min[joint])
        } else {
            q
        }
    }

    /// Mass and first moment of everything that never moves: chassis and legs [kg, kg.m].
    #[must_use]
    pub fn standing(&self, support: &Support) -> (f64, Vector3<f64>) {
        let (mass, fraction, z) = self.outrigger;
        let mut moment = Vector3::from(self.chassis.com) * self.chassis.mass;
        for p in 0..4 {
            let [x, y] = support.along(p, fraction);
            moment += Vector3::new(x, y, z) * mass;
        }
        (self.chassis.mass + 4.0 * mass, moment)
    }

    /// What an arm must not touch: outriggers 1 to 4, cab, rear, further boxes.
    #[must_use]
    pub fn obstacles(&self, support: &Support) -> Vec<PlacedBox> {
        let OutriggerBox { half_width, half_height, end_overlap } = self.outrigger_box;
        let outrigger = |p: usize| {
            let ([x, y], (sin, cos)) = (support.along(p, 0.5), support.angle[p].sin_cos());
            PlacedBox {
                center: Vector3::new(x, y, half_height),
                half: [0.5 * support.length[p] + end_overlap, half_width, half_height],
                axes: [Vector3::new(cos, sin, 0.0), Vector3::new(-sin, cos, 0.0), Vector3::z()],
            }
        };
        let upright = |shape: &BoxShape| PlacedBox {
            center: shape.center.into(),
            half: shape.half,
            axes: [Vector3::x(), Vector3::y(), Vector3::z()],
        };
        (0..4).map(outrigger).chain(self.fixed.iter().map(upright)).collect()
    }

    fn check_ranges(&self) -> Result<(), MachineError> {
        let joint = |i: usize, name: &str| format!("joint.{name}[{i}]");
        for i in 0..JOINTS {
            finite(joint(i, "min"), self.min[i])?;
            finite(joint(i, "max"), self.max[i])?;
            if self.min[i] >= self.max[i] {
                return Err(refused(joint(i, "min"), self.min[i], format!("< joint.max[{i}] = {} rad", self.max[i])));
            }
            let Link { theta_offset, d, a, alpha } = self.links[i];
            for (name, value) in [("theta_offset", theta_offset), ("d", d), ("a", a), ("alpha", alpha)] {
                finite(format!("dh[{i}].{name}"), value)?;
            }
            positive(format!("arm_mass[{i}]"), self.arm_mass[i])?;
            for c in 0..3 {
                finite(format!("arm_com[{i}][{c}]"), self.arm_com[i][c])?;
            }
            finite(format!("threshold.ground[{i}]"), self.threshold.ground[i])?;
            for (name, pose) in [
                ("transport", &self.pose.transport),
                ("partial", &self.pose.partial),
                ("full", &self.pose.full),
            ] {
                finite(format!("pose.{name}[{i}]"), pose[i])?;
            }
        }
        for (i, distance) in self.threshold.collision.iter().enumerate() {
            finite(format!("threshold.collision[{i}]"), *distance)?;
        }
        finite("threshold.tip_over".into(), self.threshold.tip_over)?;
        for (key, value) in [
            ("gravity", self.gravity),
            ("chassis.mass", self.chassis.mass),
            ("outrigger_mass", self.outrigger.0),
            ("oil.density", self.oil.density),
            ("oil.total_mass", self.oil.total_mass),
            ("slew.displacement", self.slew_displacement),
            ("pipe.inner_area * pipe.concrete_density", self.concrete),
        ] {
            positive(key.into(), value)?;
        }
        for (key, value) in [
            ("base.yaw", self.yaw),
            ("outrigger_com_fraction", self.outrigger.1),
            ("outrigger_com_z", self.outrigger.2),
        ] {
            finite(key.into(), value)?;
        }
        for (key, point) in [
            ("base.position", self.base.as_ref()),
            ("chassis.com", &self.chassis.com),
            ("oil.tank_position", &self.oil.tank_position),
        ] {
            point.iter().enumerate().try_for_each(|(c, x)| finite(format!("{key}[{c}]"), *x))?;
        }
        self.check_cylinders()?;
        self.check_boxes()?;
        ["A", "B", "C"].iter().zip(&self.variants).try_for_each(|(name, v)| check_variant(name, v))
    }

    fn check_cylinders(&self) -> Result<(), MachineError> {
        for (i, c) in self.cylinders.iter().enumerate() {
            let key = |name: &str| format!("cylinder[{}].{name}", i + 1);
            for (name, value) in [
                ("bore", c.bore),
                ("rod", c.rod),
                ("length_min", c.length_min),
                ("stroke_max", c.stroke_max),
                ("barrel_mass", c.barrel_mass),
                ("rod_mass", c.rod_mass),
                ("dead_length", c.dead_length),
            ] {
                positive(key(name), value)?;
            }
            if c.rod >= c.bore {
                return Err(refused(key("rod"), c.rod, format!("< bore = {} m", c.bore)));
            }
            for (name, value) in c.linkage.numbers() {
                finite(key(&format!("linkage.{name}")), value)?;
            }
        }
        Ok(())
    }

    fn check_boxes(&self) -> Result<(), MachineError> {
        let named = (2..).map(|i| format!("box.arm.{i}")).zip(&self.arms);
        let fixed = ["box.cab".into(), "box.rear".into()].into_iter();
        let fixed = fixed.chain((0..).map(|i| format!("box.extra[{i}]"))).zip(&self.fixed);
        for (key, shape) in named.chain(fixed) {
            for c in 0..3 {
                finite(format!("{key}.center[{c}]"), shape.center[c])?;
                positive(format!("{key}.half[{c}]"), shape.half[c])?;
            }
        }
        let OutriggerBox { half_width, half_height, end_overlap } = self.outrigger_box;
        positive("outrigger_box.half_width".into(), half_width)?;
        positive("outrigger_box.half_height".into(), half_height)?;
        finite("outrigger_box.end_overlap".into(), end_overlap)
    }

    /// The feet have to go around counter-clockwise.
    fn check_feet(&self, index: usize) -> Result<(), MachineError> {
        let name = ["full", "partial"][index];
        let support = &self.supports[index];
        for p in 0..4 {
            let key = |what: &str| format!("support.{name}.{what}[{p}]");
            finite(key("pivot"), support.pivot[p][0] + support.pivot[p][1])?;
            finite(key("angle"), support.angle[p])?;
            positive(key("length"), support.length[p])?;
        }
        let feet = support.feet();
        for p in 0..4 {
            let [before, here, after] = [feet[(p + 3) % 4], feet[p], feet[(p + 1) % 4]];
            let turn = (here[0] - before[0]) * (after[1] - here[1]) - (here[1] - before[1]) * (after[0] - here[0]);
            if turn.is_nan() || turn <= 0.0 {
                return Err(MachineError::Feet { support: name, foot: p + 1, turn });
            }
        }
        Ok(())
    }

    /// The linkage of cylinder `i` over the range of its joint.
    fn check_linkage(&self, i: usize) -> Result<(), MachineError> {
        let (cylinder, joint) = (&self.cylinders[i], i + 1);
        let mut sign = 0.0;
        for look in 0..LOOKS {
            let part = f64::from(look) / f64::from(LOOKS - 1);
            let angle = self.min[joint] + part * (self.max[joint] - self.min[joint]);
            let h_2 = cylinder.linkage.height_squared(angle);
            let number = joint + 1;
            if h_2.is_nan() || h_2 <= 0.0 {
                return Err(MachineError::Open { cylinder: number, angle, h_2 });
            }
            let Stroke { s, slope, .. } = cylinder.stroke(angle);
            if look == 0 {
                sign = slope.signum();
            }
            if slope.is_nan() || sign * slope <= 0.0 {
                return Err(MachineError::DeadCentre { cylinder: number, angle, slope });
            }
            let max = cylinder.stroke_max;
            if !(0.0..=max).contains(&s) {
                return Err(MachineError::Stroke { cylinder: number, angle, stroke: s, max });
            }
        }
        Ok(())
    }
}

fn check_variant(name: &str, v: &Variant) -> Result<(), MachineError> {
    for i in 0..JOINTS {
        positive(format!("variant.{name}.rate_max[{i}]"), v.rate_max[i])?;
        positive(format!("variant.{name}.tangential_max[{i}]"), v.tangential_max[i])?;
        not_negative(format!("variant.{name}.flow_max_extend[{i}]"), v.flow_max_extend[i])?;
        not_negative(format!("variant.{name}.flow_max_retract[{i}]"), v.flow_max_retract[i])?;
    }
    not_negative(format!("variant.{name}.flow_total_max"), v.flow_total_max)
}

fn refused(key: String, value: f64, allowed: String) -> MachineError {
    MachineError::Value { key, value, allowed }
}

fn finite(key: String, value: f64) -> Result<(), MachineError> {
    if value.is_finite() { Ok(()) } else { Err(refused(key, value, "finite".into())) }
}

fn positive(key: String, value: f64) -> Result<(), MachineError> {
    if value.is_finite() && value > 0.0 { Ok(()) } else { Err(refused(key, value, "> 0, finite".into())) }
}

fn not_negative(key: String, value: f64) -> Result<(), MachineError> {
    if value.is_finite() && value >= 0.0 { Ok(()) } else { Err(refused(key, value, ">= 0, finite".into())) }
}
