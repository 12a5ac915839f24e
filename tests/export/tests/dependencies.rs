//! Declared dependencies and directional derivatives, seen from below the C boundary.

use export_tests::{Named, Random, sparsity::Sparsity};
use fmu_export::Interface;
use model::Causality;
use models::suspension::DoubleWishbone;

/// Parameter settings that together use every part of the model.
const SETTINGS: &[&[(&str, f64)]] = &[
    &[],
    &[("closure.kind", 2.0), ("closure.k", 1e5), ("closure.c", 100.0)],
    &[("scene.motion", 2.0), ("use.tie", 1.0)],
    &[("scene.motion", 2.0), ("carrier.joint", 2.0)],
    &[("scene.motion", 2.0), ("arm.joint", 2.0), ("use.tie", 1.0)],
    &[("scene.motion", 2.0), ("arm.joint", 2.0), ("carrier.joint", 2.0), ("stabilisation.kind", 2.0)],
    &[
        ("scene.motion", 2.0),
        ("arm.joint", 2.0),
        ("closure.kind", 2.0),
        ("closure.k", 1e5),
        ("closure.c", 100.0),
    ],
    &[
        ("scene.motion", 2.0),
        ("stabilisation.kind", 2.0),
        ("use.tie", 1.0),
        ("design.B.y", 0.05),
        ("design.D.y", -0.03),
        ("design.P.y", 0.04),
    ],
    &[
        ("scene.motion", 2.0),
        ("closure.kind", 2.0),
        ("closure.k", 1e5),
        ("closure.c", 100.0),
        ("design.B.y", 0.05),
        ("design.D.y", -0.03),
        ("design.P.y", 0.04),
    ],
    &[
        ("scene.motion", 2.0),
        ("arm.joint", 2.0),
        ("carrier.joint", 2.0),
        ("closure.kind", 2.0),
        ("closure.k", 1e5),
        ("closure.c", 100.0),
        ("design.B.y", 0.05),
        ("design.D.y", -0.03),
        ("design.P.y", 0.04),
    ],
];

/// An instance somewhere in its state space, with random inputs.
fn somewhere(settings: &[(&str, f64)], random: &mut Random) -> Named<DoubleWishbone> {
    let mut fmu = Named::<DoubleWishbone>::with_interface(Interface::CoSimulationWithEvents);
    for (name, value) in settings {
        fmu.set(name, *value).expect("a setting of the model");
    }
    let rigid = !settings.iter().any(|(name, _)| *name == "closure.kind");
    if rigid {
        fmu.set("start.override", 1.0).expect("start");
        fmu.set("lower.angle.theta", random.between(-0.3, 0.2)).expect("angle");
        fmu.set("lower.angle_rate.theta", random.between(-2.0, 2.0)).expect("rate");
    }
    fmu.set("gravity.z", -9.81).expect("gravity");
    let inputs: Vec<_> = fmu
        .table()
        .variables()
        .iter()
        .filter(|v| v.entry.causality == Causality::Input)
        .map(|v| v.name.clone())
        .collect();
    for name in inputs {
        let diagonal = [".xx", ".yy", ".zz"].iter().any(|d| name.ends_with(d));
        let value = if diagonal { random.between(2.0, 4.0) } else { random.between(-1.0, 1.0) };
        fmu.set(&name, value).expect("input");
    }
    fmu.initialize().expect("a consistent start");
    // leave the design position also where only the loads can do it
    fmu.pass_event_mode(Interface::CoSimulationWithEvents).expect("Step Mode");
    for _ in 0..20 {
        fmu.step(1e-3).expect("a step");
    }
    fmu.instance.enter_event_mode().expect("Event Mode");
    fmu
}

fn references(fmu: &Named<DoubleWishbone>, causality: Causality) -> Vec<u32> {
    let variables = fmu.table().variables().iter().enumerate();
    variables
        .filter(|(_, v)| v.entry.causality == causality)
        .map(|(i, _)| u32::try_from(i).expect("few"))
        .collect()
}

/// What dual numbers see over all settings and random points, united, is what is declared: nothing
/// missing, nothing too much.
#[test]
fn declared_dependencies_are_exact() {
    let mut random = Random(7);
    let mut sparsity = Sparsity::<DoubleWishbone>::default();
    for settings in SETTINGS {
        for _ in 0..3 {
            sparsity.observe(&mut somewhere(settings, &mut random), 0.0);
        }
    }
    let wrong = sparsity.wrong();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Accelerations and forces are affine in F and in the chassis acceleration: the derivative is the
/// difference quotient of any step, up to the rounding of the two values.
#[test]
fn derivatives_are_the_differences_of_affine_outputs() {
    let mut random = Random(11);
    for settings in SETTINGS {
        let mut fmu = somewhere(settings, &mut random);
        let outputs = references(&fmu, Causality::Output);
        for input in ["P.F.x", "P.F.z", "P.slot[2].F.y", "chassis.a.z"] {
            let reference = fmu.reference(input);
            let (mut derivative, mut before, mut after) =
                (vec![0.0; outputs.len()], vec![0.0; outputs.len()], vec![0.0; outputs.len()]);
            fmu.instance
                .directional_derivative(&outputs, &[reference], &[1.0], &mut derivative)
                .expect("derivative");
            fmu.instance.get_float64(&outputs, &mut before).expect("values");
            let step = 8.0;
            let value = fmu.get(input).expect("input");
            fmu.set(input, value + step).expect("input");
            fmu.instance.get_float64(&outputs, &mut after).expect("values");
            fmu.set(input, value).expect("input");
            for ((d, a), b) in derivative.iter().zip(&after).zip(&before) {
                let scale = 1.0 + a.abs().max(b.abs());
                assert!(
                    ((a - b) / step - d).abs() < 1e-11 * scale,
                    "{input}: {d} against {}",
                    (a - b) / step
                );
            }
        }
    }
}

/// In P.M the outputs are rational: central differences, error h^2 plus rounding/h.
#[test]
fn derivatives_with_respect_to_inertia_agree_with_differences() {
    let mut random = Random(13);
    for settings in SETTINGS {
        let mut fmu = somewhere(settings, &mut random);
        let outputs = references(&fmu, Causality::Output);
        for input in ["P.M.xx", "P.M.xz", "P.slot[2].M.zz"] {
            let reference = fmu.reference(input);
            let mut derivative = vec![0.0; outputs.len()];
            fmu.instance
                .directional_derivative(&outputs, &[reference], &[1.0], &mut derivative)
                .expect("derivative");
            let value = fmu.get(input).expect("input");
            let h = 1e-4;
            let mut at = |v: f64| {
                fmu.set(input, v).expect("input");
                let mut values = vec![0.0; outputs.len()];
                fmu.instance.get_float64(&outputs, &mut values).expect("values");
                values
            };
            let (up, down) = (at(value + h), at(value - h));
            for (i, d) in derivative.iter().enumerate() {
                let quotient = (up[i] - down[i]) / (2.0 * h);
                let scale = 1.0 + up[i].abs() + d.abs();
                assert!((quotient - d).abs() < 2e-7 * scale, "{input}: {d} against {quotient}");
            }
        }
    }
}
