//! The boom: against an independent program (`reference`), its laws (`laws`), extreme cases (`extremes`), dependencies.

mod dependencies;
mod extremes;
mod laws;
mod reference;

use export_tests::Named;
use models::boom::Boom;

fn set(fmu: &mut Named<Boom>, name: &str, value: f64) {
    fmu.set(name, value).unwrap_or_else(|e| panic!("{name} = {value}: {e}"));
}

fn get(fmu: &mut Named<Boom>, name: &str) -> f64 {
    fmu.get(name).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// A counter.
fn count(fmu: &mut Named<Boom>, name: &str) -> u64 {
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "counters are whole")]
    let count = fmu.count(name) as u64;
    count
}

/// A boom with settings, not initialised yet.
fn boom(settings: &[(&str, f64)]) -> Named<Boom> {
    let mut fmu = Named::<Boom>::default();
    for (name, value) in settings {
        set(&mut fmu, name, *value);
    }
    fmu
}

/// Start angles.
fn set_angles(fmu: &mut Named<Boom>, angles: [f64; 6]) {
    (1..=6).zip(angles).for_each(|(i, q)| set(fmu, &format!("joint[{i}].angle_start"), q));
}

fn command_all(fmu: &mut Named<Boom>, values: [f64; 6]) {
    (1..=6).zip(values).for_each(|(i, u)| set(fmu, &format!("joint[{i}].velocity_command"), u));
}
