//! Declared dependencies of the element and linkage FMUs: exactly what dual numbers see.

use export_tests::{Random, sparsity::Sparsity};
use model::Model;
use models::absorber::{PrimaryOscillator, RvdpAbsorber};
use models::effi::{Arm, Controller, Mechanism, Plant, Wall};
use models::parts::{Bushing, Guide, Load};
use models::suspension::{DoublePendulum, FourBar, Link2, Link3, StrutLink};

fn declared_are_observed<M: Model>(settings: &[&[(&str, f64)]]) {
    let mut random = Random(5);
    let mut sparsity = Sparsity::<M>::default();
    for settings in settings {
        for _ in 0..3 {
            sparsity.look(settings, &mut random);
        }
    }
    let wrong = sparsity.wrong();
    assert!(wrong.is_empty(), "{} of {}:\n{}", wrong.len(), M::NAME, wrong.join("\n"));
}

#[test]
fn link2_dependencies_are_exact() {
    let kind = |k: f64| [("joint.kind", k), ("gravity.x", 1.0), ("gravity.y", 2.0)];
    declared_are_observed::<Link2>(&[&kind(1.0), &kind(2.0), &kind(3.0), &kind(4.0), &kind(5.0)]);
}

#[test]
fn link3_dependencies_are_exact() {
    let kind = |k: f64| {
        [
            ("joint.kind", k),
            ("com.y", 0.02),
            ("point.C.y", 0.03),
            ("point.P.y", -0.05),
            ("gravity.x", 1.0),
            ("gravity.y", 2.0),
        ]
    };
    declared_are_observed::<Link3>(&[&kind(1.0), &kind(2.0), &kind(3.0), &kind(4.0)]);
}

#[test]
fn strut_link_dependencies_are_exact() {
    let kind = |k: f64| [("joint.kind", k), ("gravity.x", 1.0), ("gravity.y", 2.0)];
    declared_are_observed::<StrutLink>(&[&kind(1.0), &kind(2.0), &kind(3.0)]);
}

#[test]
fn linkage_dependencies_are_exact() {
    declared_are_observed::<FourBar>(&[&[], &[("stabilisation.kind", 2.0), ("design.P.x", 0.3)]]);
    declared_are_observed::<DoublePendulum>(&[&[]]);
}

#[test]
fn dependencies_of_small_parts_are_exact() {
    declared_are_observed::<Load>(&[&[("force.offset.x", 3.0), ("force.offset.y", 2.0)]]);
    declared_are_observed::<Bushing>(&[&[]]);
    declared_are_observed::<Guide>(&[&[("kind.x", 2.0), ("kind.y", 2.0), ("kind.z", 2.0), ("kind.s", 2.0)]]);
}

#[test]
fn primary_oscillator_dependencies_are_exact() {
    let kind = |kind: f64, dof: f64, port: f64| {
        [
            ("port.kind", kind),
            ("dof", dof),
            ("port.mass", port),
            ("drive.mass", port),
            ("use.base", 1.0),
            ("root.mass", 2.0),
            ("direction.x", 0.3),
            ("direction.y", -0.4),
        ]
    };
    let gravity = [("gravity.x", 1.0), ("gravity.y", 2.0), ("gravity.z", 3.0)];
    declared_are_observed::<PrimaryOscillator>(&[
        &kind(1.0, 1.0, 1.0),
        &kind(1.0, 2.0, 1.0),
        &kind(1.0, 2.0, 2.0),
        &[&kind(2.0, 2.0, 1.0)[..], &gravity].concat(),
        &[&kind(2.0, 2.0, 2.0)[..], &gravity].concat(),
        &[("dof", 2.0), ("ground.stiffness", 10.0)],
    ]);
}

#[test]
fn rvdp_absorber_dependencies_are_exact() {
    let general =
        [("axis.x", 0.3), ("axis.y", -0.4), ("gravity.x", 1.0), ("gravity.y", 2.0), ("gravity.z", 3.0)];
    let kind = |kind: f64, law: f64| {
        [("port.kind", kind), ("control.law", law), ("control.force", 3.0), ("w.start", 0.2)]
    };
    declared_are_observed::<RvdpAbsorber>(&[
        &[&kind(1.0, 2.0)[..], &general].concat(),
        &[&kind(1.0, 3.0)[..], &general].concat(),
        &[&kind(2.0, 2.0)[..], &general].concat(),
        &[&kind(2.0, 3.0)[..], &general, &[("use.stroke_stop", 1.0), ("stroke.limit", 1e-3)]].concat(),
    ]);
}

#[test]
fn dependencies_of_the_haptic_interface_are_exact() {
    let moving = [
        ("H.start.x", 0.1),
        ("H.start.z", 0.62),
        ("H.start.v.x", 0.2),
        ("H.start.v.z", -0.3),
        ("use.encoder", 0.0),
    ];
    let saturated = [("axis.v_knee", 1e-3), ("axis.F_peak", 1e-3)];
    declared_are_observed::<Plant>(&[
        &moving,
        &[&moving[..], &saturated].concat(),
        &[&moving[..], &saturated].concat(),
        &[&moving[..], &saturated, &[("H.start.v.x", -0.2), ("H.start.v.z", 0.3)]].concat(),
    ]);
    declared_are_observed::<Controller>(&[&[], &[("mode", 2.0)], &[("mode", 1.0)]]);
}

#[test]
fn dependencies_of_what_it_renders_are_exact() {
    let drawer = [
        ("kind", 2.0),
        ("drawer.direction.z", 0.7),
        ("drawer.s.start", 0.05),
        ("drawer.v.start", 0.2),
        ("drawer.detent.energy", 1.0),
    ];
    let in_stop = [("phi.start", 0.82), ("phi_rate.start", 0.5)];
    declared_are_observed::<Mechanism>(&[&[("phi_rate.start", 0.5)], &in_stop, &drawer]);
    let wall = [("normal.x", 0.3), ("normal.y", 0.2), ("point.z", 3.0), ("damping", 10.0), ("friction", 0.3)];
    declared_are_observed::<Wall>(&[&wall]);
    let hand = [("start.v.x", 0.2), ("start.v.z", 0.3)];
    declared_are_observed::<Arm>(&[&hand, &[&hand[..], &[("intent.kind", 2.0)]].concat()]);
}
