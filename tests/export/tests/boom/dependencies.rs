//! Declared dependencies of the boom: exactly what dual numbers see.

use export_tests::{Named, Random, sparsity::Sparsity};
use fmu_export::Interface;
use models::boom::Boom;
use models::boom::machine::Machine;

use crate::{command_all, set, set_angles};

/// Part of the largest derivative by an input that counts as zero: moments of 1e6 N.m cancel to 1e-16 of them.
const ROUNDING: f64 = 1e-13;

#[test]
fn declared_dependencies_are_exact() {
    let mut random = Random(5);
    let mut sparsity = Sparsity::<Boom>::default();
    let machine = Machine::compiled_in();
    let include = ("stability.include_tip_force", 1.0);
    let settings: [&[(&str, f64)]; 5] = [
        &[include],
        &[include, ("machine.variant", 2.0)],
        &[include, ("actuator.time_constant", 0.5)],
        &[include, ("actuator.time_constant", 0.5), ("machine.variant", 2.0)],
        &[include, ("actuator.time_constant", 0.5), ("machine.variant", 3.0), ("use.limiter", 0.0)],
    ];
    for settings in settings {
        for _ in 0..20 {
            let mut fmu = Named::<Boom>::with_interface(Interface::CoSimulationWithEvents);
            for (name, value) in settings {
                set(&mut fmu, name, *value);
            }
            set_angles(&mut fmu, std::array::from_fn(|i| random.between(machine.min[i], machine.max[i])));
            // from rates that pass every stage to rates that all stages cut
            let mut command =
                |_| 10.0_f64.powf(random.between(-3.0, -1.0)) * random.between(-1.0, 1.0).signum();
            command_all(&mut fmu, [0; 6].map(&mut command));
            for (name, low, high) in [
                ("F.x", -1e3, 1e3),
                ("F.y", -1e3, 1e3),
                ("F.z", -1e3, 1e3),
                ("M.xx", 2.0, 4.0),
                ("M.yy", 2.0, 4.0),
                ("M.zz", 2.0, 4.0),
                ("M.xy", -1.0, 1.0),
                ("M.xz", -1.0, 1.0),
                ("M.yz", -1.0, 1.0),
            ] {
                set(&mut fmu, &format!("TIP.{name}"), random.between(low, high));
            }
            fmu.initialize().expect("a start");
            fmu.pass_event_mode(Interface::CoSimulationWithEvents).expect("Step Mode");
            fmu.step(1.0).expect("a step");
            fmu.instance.enter_event_mode().expect("Event Mode");
            sparsity.observe(&mut fmu, ROUNDING);
        }
    }
    let wrong = sparsity.wrong();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
