//! Declared dependencies of the element and linkage FMUs: exactly what dual numbers see.

use export_tests::{Random, sparsity::Sparsity};
use model::Model;
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
