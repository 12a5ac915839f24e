//! The right-hand side at the states of the reference trajectories, without any integration:
//! accelerations, joint forces, points and energies of an independent program.

use std::collections::HashMap;

use model::{Model, System, Visitor};
use models::suspension::{
    DoubleWishbone, Dynamics, Energy, Inputs, Motion, Parameters, PreloadMode, PulsePhase, SceneMotion,
};

/// A reference trajectory by column name.
struct Reference {
    columns: Vec<String>,
    rows: Vec<Vec<f64>>,
}

impl Reference {
    fn read(name: &str) -> Self {
        let path = format!("{}/../../tests/reference/suspension/{name}.csv", env!("CARGO_MANIFEST_DIR"));
        let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{path}: {e}"));
        let mut lines = text.lines().filter(|l| !l.starts_with('#'));
        let columns = lines.next().expect("header").split(',').map(String::from).collect();
        let rows = lines.map(|l| l.split(',').map(|v| v.parse().expect("number")).collect()).collect();
        Self { columns, rows }
    }

    fn row(&self, i: usize) -> HashMap<&str, f64> {
        self.columns.iter().map(String::as_str).zip(self.rows[i].iter().copied()).collect()
    }
}

fn wishbone(p: &Parameters) -> DoubleWishbone {
    let start: Vec<f64> = <Motion<f64> as model::Variables<f64>>::TABLE.iter().map(|v| v.start).collect();
    DoubleWishbone::new(p, &<Motion<f64> as model::Variables<f64>>::load(&start)).expect("a case of the file")
}

/// All outputs and the rates at a state given by column names in state order.
struct At<'a> {
    t: f64,
    x: &'a [f64],
    pulse: PulsePhase,
}

type Values = (Motion<f64>, Dynamics<f64>, Energy<f64>, Vec<f64>);

impl Visitor<DoubleWishbone> for At<'_> {
    type Output = Values;
    fn visit<const N: usize, const Z: usize, Y: System<N, Z, Model = DoubleWishbone>>(
        self,
        system: &Y,
    ) -> Values {
        let u = <Inputs<f64> as model::Variables<f64>>::load(&[0.0; 21]);
        let mut x = [0.0; N];
        x[..self.x.len()].copy_from_slice(self.x);
        let rates = system.rates(self.t, &x, &u, &self.pulse).expect("regular");
        (
            system.motion(self.t, &x, &u, &self.pulse).expect("regular"),
            system.dynamics(self.t, &x, &u, &self.pulse).expect("regular"),
            system.energy(self.t, &x, &u, &self.pulse).expect("regular"),
            rates.to_vec(),
        )
    }
}

fn vector(row: &HashMap<&str, f64>, name: &str) -> [f64; 3] {
    ["x", "y", "z"].map(|c| row.get(format!("{name}.{c}").as_str()).copied().unwrap_or(0.0))
}

/// Largest difference of points [m] and of forces [N] in a row.
fn differences(row: &HashMap<&str, f64>, (m, d, e, _): &Values) -> (f64, f64, f64) {
    let worst = |pairs: &[(&str, [f64; 3])]| {
        pairs
            .iter()
            .flat_map(|(name, v)| {
                let reference = vector(row, name);
                (0..3).map(move |i| (v[i] - reference[i]).abs())
            })
            .fold(0.0, f64::max)
    };
    let points = worst(&[("B.r", m.B_r.into()), ("C.r", m.C_r.into()), ("P.r", m.P_r.into())]);
    let forces =
        worst(&[("A.F", d.A_F.into()), ("B.F", d.B_F.into()), ("C.F", d.C_F.into()), ("D.F", d.D_F.into())]);
    let energies =
        (e.kinetic - row["energy.kinetic"]).abs().max((e.potential - row["energy.potential"]).abs());
    (points, forces, energies)
}

fn planar_states(row: &HashMap<&str, f64>) -> [f64; 6] {
    ["theta1", "theta1_dot", "psi", "psi_dot", "theta3", "theta3_dot"].map(|c| row[c])
}

/// The file carries 15 digits; forces are about 10 N on stiffnesses of 2e4 N/m: rounding 1e-10 N.
#[test]
fn paper_case_agrees_at_every_reference_state() {
    let reference = Reference::read("wishbone_paper");
    let wishbone = wishbone(&Parameters::default());
    for i in 0..reference.rows.len() {
        let row = reference.row(i);
        let values =
            wishbone.with_system(At { t: row["t"], x: &planar_states(&row), pulse: PulsePhase::After });
        let (points, forces, energies) = differences(&row, &values);
        assert!(points < 1e-14, "points {points:e} at t = {}", row["t"]);
        assert!(forces < 1e-9, "forces {forces:e} at t = {}", row["t"]);
        assert!(energies < 1e-12, "energies {energies:e} at t = {}", row["t"]);
        assert!((values.3[1] - row["theta1_ddot"]).abs() < 1e-9);
        assert!((values.0.strut_length - row["strut.length"]).abs() < 1e-14);
        assert!(values.0.gap < 1e-14);
    }
}

/// Static preload, gravity, bump: forces of thousands of newton, rounding 1e-8 N.
#[test]
fn road_case_agrees_at_every_reference_state() {
    let reference = Reference::read("wishbone_road");
    let mut p = Parameters { preload_mode: PreloadMode::Static, ..Parameters::default() };
    p.gravity.z = -9.80665;
    (p.force.pulse_start, p.force.pulse_duration) = (0.5, 0.08);
    p.static_load.z = 3500.0;
    p.force.offset.z = 3500.0;
    p.force.amplitude.z = 0.0;
    p.force.pulse_amplitude = model::Vector3::new(-300.0, 0.0, 800.0);
    let wishbone = wishbone(&p);
    for i in 0..reference.rows.len() {
        let row = reference.row(i);
        let pulse = if row["t"] >= 0.5 && row["t"] < 0.58 { PulsePhase::During } else { PulsePhase::After };
        let values = wishbone.with_system(At { t: row["t"], x: &planar_states(&row), pulse });
        let (points, forces, energies) = differences(&row, &values);
        assert!(points < 1e-14, "points {points:e} at t = {}", row["t"]);
        assert!(forces < 2e-8, "forces {forces:e} at t = {}", row["t"]);
        // the reference zero of the potential: strut energy from the free length without preload sign
        assert!(energies < 1e-10, "energies {energies:e} at t = {}", row["t"]);
    }
}

/// Revolute arms, ball joint, tie rod, three-axis load.
#[test]
fn spatial_case_agrees_at_every_reference_state() {
    let reference = Reference::read("wishbone_spatial");
    let mut p = Parameters {
        motion: SceneMotion::Spatial,
        use_tie: true,
        preload_mode: PreloadMode::Static,
        ..Parameters::default()
    };
    p.gravity.z = -9.80665;
    p.force.amplitude = model::Vector3::new(0.0, 100.0, 200.0);
    p.force.omega = model::Vector3::new(10.0, 8.0, 13.0);
    let wishbone = wishbone(&p);
    for i in 0..reference.rows.len() {
        let row = reference.row(i);
        let x = ["theta1", "theta1_dot", "q1", "q2", "q3", "q4", "w.x", "w.y", "w.z", "theta3", "theta3_dot"]
            .map(|c| row[c]);
        let values = wishbone.with_system(At { t: row["t"], x: &x, pulse: PulsePhase::After });
        let (points, forces, energies) = differences(&row, &values);
        assert!(points < 1e-14, "points {points:e} at t = {}", row["t"]);
        assert!(forces < 1e-7, "forces {forces:e} at t = {}", row["t"]);
        assert!(energies < 1e-10, "energies {energies:e} at t = {}", row["t"]);
    }
}
