#![doc = include_str!("boom.md")]

use std::sync::Arc;

use model::{Documentation, Experiment, Model, ParameterError, Visitor};
use serde::{Deserialize, Serialize};

use super::kinematics::Chain;
use super::limiter::Limits;
use super::machine::{JOINTS, Machine, PlacedBox};
use super::masses::Masses;
use super::system::Plant;
use super::variables::outputs::{Dynamics, Energy, Motion, Safety};
use super::variables::{Inputs, Parameters, Use};

/// A start angle may lie outside the range of its joint by this much [rad].
const RANGE: f64 = 1e-12;

/// The boom with everything that is constant in a run or changes with tunable parameters only.
#[derive(Debug, Clone)]
pub struct Boom {
    pub(super) machine: Arc<Machine>,
    pub(super) chain: Chain,
    pub(super) uses: Use,
    pub(super) limits: Limits,
    pub(super) masses: Masses,
    pub(super) obstacles: Arc<[PlacedBox]>,
    pub(super) feet: [[f64; 2]; 4],
    pub(super) angle_start: [f64; JOINTS],
    /// Lag of the actuators; 0: none [s]
    pub(super) time_constant: f64,
    pub(super) include_tip_force: bool,
}

/// What changes at events and at the start of steps.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Rest {
    /// Joints that stay at an end of their range
    pub(super) resting: [bool; JOINTS],
    /// A command of the last step was not finite
    pub(super) bad_command: bool,
    /// Arrivals at the end of a range so far
    pub(super) events: u64,
}

fn limits(p: &Parameters, machine: &Machine) -> Limits {
    let variant = machine.variant(p.variant as usize - 1);
    let or = |own: f64, of_variant: f64| if own < 0.0 { of_variant } else { own };
    let flow_max = std::array::from_fn(|i| {
        let own = |cylinders: &[f64; 5]| if i == 0 { p.slew_flow_max } else { cylinders[i - 1] };
        [
            or(own(&p.flow_max_retract.0), variant.flow_max_retract[i]),
            or(own(&p.flow_max_extend.0), variant.flow_max_extend[i]),
        ]
    });
    Limits {
        active: p.uses.limiter,
        rate_max: std::array::from_fn(|i| or(p.rate_max.0[i], variant.rate_max[i])),
        tangential_active: variant.tangential_active,
        tangential_max: std::array::from_fn(|i| or(p.tangential_max.0[i], variant.tangential_max[i])),
        flows_active: p.uses.hydraulics,
        flow_max,
        flow_total_max: or(p.flow_total_max, variant.flow_total_max),
    }
}

impl Boom {
    /// The boom of a machine.
    ///
    /// # Errors
    /// A start angle outside the range of its joint.
    pub fn of(machine: Arc<Machine>, p: &Parameters) -> Result<Self, ParameterError> {
        const NAMES: [&str; JOINTS] = [
            "joint[1].angle_start",
            "joint[2].angle_start",
            "joint[3].angle_start",
            "joint[4].angle_start",
            "joint[5].angle_start",
            "joint[6].angle_start",
        ];
        for (i, name) in NAMES.into_iter().enumerate() {
            let (angle, min, max) = (p.angle_start.0[i], machine.min[i], machine.max[i]);
            if angle < min - RANGE || angle > max + RANGE {
                let reason = "it is outside the range of the joint";
                return Err(ParameterError::refused(name, angle, reason, format!("{min} .. {max} rad")));
            }
        }
        let support = *machine.support(p.support as usize - 1);
        Ok(Self {
            chain: Chain::new(&machine),
            uses: p.uses,
            limits: limits(p, &machine),
            masses: Masses::new(&machine, &support, p.concrete_fill, p.tip_mass),
            obstacles: machine.obstacles(&support).into(),
            feet: support.feet(),
            angle_start: std::array::from_fn(|i| machine.within(i, p.angle_start.0[i])),
            time_constant: p.time_constant,
            include_tip_force: p.include_tip_force,
            machine,
        })
    }
}

impl Model for Boom {
    const NAME: &'static str = "boom";
    const DESCRIPTION: &'static str = "Boom of a truck-mounted concrete pump: kinematics, limited rates, flows, torques, stability, distances";
    const EXPERIMENT: Experiment = Experiment { stop: 200.0, step: 1.0 };
    const DOCUMENTATION: Documentation = model::documentation!(
        "boom",
        inputs,
        plots = [
            ("Joint angles", ["joint[1].angle", "joint[2].angle", "joint[3].angle"]),
            ("Height of the tip", ["TIP.r.z"]),
            ("Total flow", ["hydraulics.flow_total"]),
        ]
    );
    const MODEL_EXCHANGE: bool = false;
    const PORT_TREATMENT: bool = false;
    const METHODS: &'static [i64] = &[2, 3];
    const METHOD: i64 = 3;
    const STEP: f64 = 0.05;
    const TOLERANCES: [f64; 2] = [1e-8, 1e-10];
    type Parameters = Parameters;
    type Inputs<S: model::Scalar> = Inputs<S>;
    type Motion<S: model::Scalar> = Motion<S>;
    type Inertia<S: model::Scalar> = Safety<S>;
    type Dynamics<S: model::Scalar> = Dynamics<S>;
    type Energy<S: model::Scalar> = Energy<S>;
    type Discrete = Rest;

    fn new(p: &Parameters, _start: &Motion<f64>) -> Result<Self, ParameterError> {
        Self::of(Machine::compiled_in(), p)
    }

    fn retune(&mut self, p: &Parameters) {
        self.limits = limits(p, &self.machine);
        let support = self.machine.support(p.support as usize - 1);
        self.masses = Masses::new(&self.machine, support, p.concrete_fill, p.tip_mass);
    }

    fn notice(before: &Rest, after: &Rest) -> Option<String> {
        (after.bad_command && !before.bad_command)
            .then(|| "a velocity_command is not finite and acts as 0 rad/s; allowed: finite".into())
    }

    fn with_system<V: Visitor<Self>>(&self, visitor: V) -> V::Output {
        if self.time_constant > 0.0 {
            visitor.visit(&Plant::<14>(self))
        } else {
            visitor.visit(&Plant::<8>(self))
        }
    }
}
