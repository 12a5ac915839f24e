//! Checks that a machine has to pass.

use super::super::linkage::Stroke;
use super::file::{Link, OutriggerBox, Variant};
use super::{JOINTS, Machine, MachineError};

/// Angles at which each linkage is looked at over the range of its joint.
const LOOKS: u32 = 721;

impl Machine {
    pub(super) fn check_ranges(&self) -> Result<(), MachineError> {
        let joint = |i: usize, name: &str| format!("joint.{name}[{i}]");
        for i in 0..JOINTS {
            finite(joint(i, "min"), self.min[i])?;
            finite(joint(i, "max"), self.max[i])?;
            if self.min[i] >= self.max[i] {
                return Err(refused(
                    joint(i, "min"),
                    self.min[i],
                    format!("< joint.max[{i}] = {} rad", self.max[i]),
                ));
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
    pub(super) fn check_feet(&self, index: usize) -> Result<(), MachineError> {
        let name = ["full", "partial"][index];
        let support = &self.supports[index];
        for p in 0..4 {
            let key = |what: &str| format!("support.{name}.{what}[{p}]");
            for c in 0..2 {
                finite(format!("{}[{c}]", key("pivot")), support.pivot[p][c])?;
            }
            finite(key("angle"), support.angle[p])?;
            positive(key("length"), support.length[p])?;
        }
        let feet = support.feet();
        for p in 0..4 {
            let [before, here, after] = [feet[(p + 3) % 4], feet[p], feet[(p + 1) % 4]];
            let turn =
                (here[0] - before[0]) * (after[1] - here[1]) - (here[1] - before[1]) * (after[0] - here[0]);
            if turn.is_nan() || turn <= 0.0 {
                return Err(MachineError::Feet { support: name, foot: p + 1, turn });
            }
        }
        Ok(())
    }

    /// The linkage of cylinder `i` over the range of its joint.
    pub(super) fn check_linkage(&self, i: usize) -> Result<(), MachineError> {
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

pub(super) fn refused(key: String, value: f64, allowed: String) -> MachineError {
    MachineError::Value { key, value, allowed }
}

fn finite(key: String, value: f64) -> Result<(), MachineError> {
    if value.is_finite() { Ok(()) } else { Err(refused(key, value, "finite".into())) }
}

pub(super) fn positive(key: String, value: f64) -> Result<(), MachineError> {
    if value.is_finite() && value > 0.0 { Ok(()) } else { Err(refused(key, value, "> 0, finite".into())) }
}

fn not_negative(key: String, value: f64) -> Result<(), MachineError> {
    if value.is_finite() && value >= 0.0 { Ok(()) } else { Err(refused(key, value, ">= 0, finite".into())) }
}
