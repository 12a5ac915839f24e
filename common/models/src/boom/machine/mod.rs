//! Data of a machine: the file (`schema` 1, JSON) and the checks that it has to pass.
//!
//! The file that stands beside this folder is compiled in: a self-consistent machine of the 56 m class. Its numbers are
//! assumptions, not those of a real machine (see its `provenance`).

mod check;
mod error;
mod file;

use std::sync::{Arc, OnceLock};

use mechanics::Scalar;
use model::Vector3;

use check::{positive, refused};
use file::{Arms, Chassis, File, OutriggerBox, Schema};

pub use error::MachineError;
pub use file::{BoxShape, Cylinder, Link, Oil, Poses, Support, Threshold, Variant};

/// Number of joints.
pub const JOINTS: usize = 6;
/// Number of luffing joints, each with one cylinder; cylinder `i` belongs to joint `i + 1` counted from 0.
pub const CYLINDERS: usize = 5;
/// Largest number of boxes beyond outriggers, cab and rear.
pub const MAX_EXTRA: usize = 26;

const DEFAULT: &str = include_str!("../machine_56m.json");

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
    /// # Panics
    /// Never: its file does not change after compilation, and every test reads it.
    #[must_use]
    pub fn compiled_in() -> Arc<Self> {
        static MACHINE: OnceLock<Arc<Machine>> = OnceLock::new();
        MACHINE
            .get_or_init(|| Arc::new(Self::parse(DEFAULT).expect("a machine that passes its checks")))
            .clone()
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
        positive("pipe.inner_area".into(), pipe.inner_area)?;
        positive("pipe.concrete_density".into(), pipe.concrete_density)?;
        let Arms { second, third, fourth, fifth, sixth } = boxes.arm;
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
            arms: [second, third, fourth, fifth, sixth],
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
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::*;

    /// What is said about the compiled-in machine after a change.
    fn refusal(change: impl FnOnce(&mut Value)) -> String {
        let mut file: Value = serde_json::from_str(DEFAULT).expect("JSON");
        change(&mut file);
        Machine::parse(&file.to_string()).expect_err("a machine that is refused").to_string()
    }

    fn says(message: &str, parts: &[&str]) {
        assert!(parts.iter().all(|part| message.contains(part)), "{message}");
    }

    #[test]
    fn files_that_are_no_machine_are_refused() {
        says(&refusal(|m| m["schema"] = json!(2)), &["schema = 2", "allowed: 1"]);
        says(
            &refusal(|m| drop(m["cylinder"][2].as_object_mut().map(|c| c.remove("bore")))),
            &["missing field `bore`"],
        );
        says(
            &refusal(|m| drop(m.as_object_mut().map(|m| m.remove("support")))),
            &["missing field `support`"],
        );
        says(&refusal(|m| m["cylinder"][0] = m["cylinder"][1].clone()), &["cylinder[0] is not null"]);
        says(&refusal(|m| m["cylinder"][3] = Value::Null), &["cylinder[3] is null"]);
        says(&refusal(|m| m["cylinder"][3]["joint"] = json!(5)), &["cylinder[3].joint = 5", "allowed: 4"]);
        let branch = |m: &mut Value| m["cylinder"][2]["linkage"]["branch"] = json!(0);
        says(&refusal(branch), &["branch = 0", "allowed: 1, -1"]);
        says(&Machine::parse("{").expect_err("no JSON").to_string(), &["line 1"]);
    }

    #[test]
    fn values_out_of_range_are_named() {
        says(&refusal(|m| m["gravity"] = json!(0.0)), &["gravity = 0", "> 0"]);
        says(&refusal(|m| m["arm_mass"][3] = json!(-5.0)), &["arm_mass[3] = -5", "> 0"]);
        says(&refusal(|m| m["cylinder"][1]["rod"] = json!(0.9)), &["cylinder[1].rod = 0.9", "< bore"]);
        says(&refusal(|m| m["joint"]["min"][4] = json!(3.0)), &["joint.min[4] = 3", "< joint.max[4]"]);
        says(&refusal(|m| m["box"]["cab"]["half"][1] = json!(0.0)), &["box.cab.half[1] = 0", "> 0"]);
        says(
            &refusal(|m| m["variant"]["B"]["rate_max"][0] = json!(0.0)),
            &["variant.B.rate_max[0] = 0", "> 0"],
        );
        says(&refusal(|m| m["pipe"]["inner_area"] = json!(-1.0)), &["pipe.inner_area = -1", "> 0"]);
    }

    #[test]
    fn linkages_that_do_not_work_over_the_range_are_refused() {
        let cylinder =
            |i: usize, key: &'static str, value: f64| refusal(move |m| m["cylinder"][i][key] = json!(value));
        let open = refusal(|m| m["cylinder"][2]["linkage"]["coupler"] = json!(0.3));
        says(&open, &["linkage of cylinder[3] does not close", "joint[3].angle", "(B5)"]);
        says(&cylinder(1, "stroke_max", 0.5), &["stroke of cylinder[2]", "allowed: 0 .. 0.5 m", "(B6)"]);
        says(&cylinder(1, "length_min", 9.0), &["stroke of cylinder[2] is -"]);
        let dead = refusal(|m| {
            m["joint"]["max"][1] = json!(3.0);
            m["cylinder"][1]["stroke_max"] = json!(3.0);
        });
        says(&dead, &["ds/dq of cylinder[2] changes its sign", "(B8)"]);
    }

    #[test]
    fn feet_have_to_go_around_counter_clockwise() {
        let clockwise = refusal(|m| {
            for key in ["pivot", "angle", "length"] {
                m["support"]["partial"][key].as_array_mut().expect("legs").reverse();
            }
        });
        says(&clockwise, &["support.partial", "foot 1", "counter-clockwise"]);
    }

    #[test]
    fn further_boxes_are_obstacles() {
        let mut file: Value = serde_json::from_str(DEFAULT).expect("JSON");
        file["box"]["extra"] = json!([{"center": [1.0, 2.0, 3.0], "half": [0.5, 0.5, 0.5]}]);
        let machine = Machine::parse(&file.to_string()).expect("a machine");
        let obstacles = machine.obstacles(machine.support(0));
        assert_eq!(obstacles.len(), 7);
        assert!((obstacles[6].center - Vector3::new(1.0, 2.0, 3.0)).norm() < 1e-15);
    }
}
