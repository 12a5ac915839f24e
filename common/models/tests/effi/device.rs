//! Pointwise: kinematics, inertia, bias of the device and of the four-bar.

use model::{Model, System, Variables, Vector2};
use models::effi::device::{determinant, jacobian};
use models::effi::fourbar::Fourbar;
use models::effi::plant_variables::{Inputs, Parameters};
use models::effi::{Mechanism, Plant, mechanism_variables};
use num_dual::Dual64;

use crate::csv::{Reference, close};
use crate::plant::{plain, start, still};

/// l, l', J, det, weight and potential; and with the reference's M and h, M a + h = F.
#[test]
fn kinematics_inertia_and_bias_agree() {
    let reference = Reference::read("kinematics");
    let p = plain();
    let (plant, u) = (Plant::new(&p, &start()).expect("defaults"), still());
    for row in &reference.rows {
        let [x, z, v_x, v_z] = reference.all(row, ["x", "z", "vx", "vz"]);
        let (H, v) = (Vector2::new(x, z), Vector2::new(v_x, v_z));
        let legs = p.device.legs(&H).expect("off the pivots");
        let J = jacobian(&legs);
        let l_dot = J * v;
        let own = [
            ("l1", legs[0].l),
            ("l2", legs[1].l),
            ("l1dot", l_dot.x),
            ("l2dot", l_dot.y),
            ("J11", J.m11),
            ("J12", J.m12),
            ("J21", J.m21),
            ("J22", J.m22),
            ("detJ", determinant(&legs)),
        ];
        for (name, value) in own {
            close(name, value, reference.at(row, name), 1.0, 1e-12);
        }
        let weight = p.device.weight(&legs);
        let [h_x, h_z, hg_x, hg_z, V] = reference.all(row, ["h_x", "h_z", "hg_x", "hg_z", "V"]);
        let scale = Vector2::new(hg_x, hg_z).norm();
        close("weight.x", weight.x, hg_x, scale, 1e-12);
        close("weight.z", weight.y, hg_z, scale, 1e-12);
        let state = [x, z, v_x, v_z, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        let d = plant.start(0.0, &start()).expect("defaults").1;
        let energy = plant.energy(0.0, &state, &u, &d).expect("regular");
        close("potential", energy.potential, V, V.abs(), 1e-12);
        let loaded = Inputs { H: models::port::PlanarSlot { F: Vector2::new(31.0, -17.0), ..u.H }, ..u };
        let a = plant.dynamics(0.0, &state, &loaded, &d).expect("regular").a;
        let [m_11, m_12, m_22] = reference.all(row, ["M11", "M12", "M22"]);
        close("x balance", m_11 * a.x + m_12 * a.y + h_x, 31.0, scale, 1e-12);
        close("z balance", m_12 * a.x + m_22 * a.y + h_z, -17.0, scale, 1e-12);
        let kinetic = 0.5 * (m_11 * v_x * v_x + 2.0 * m_12 * v_x * v_z + m_22 * v_z * v_z);
        close("kinetic", energy.kinetic, kinetic, kinetic, 1e-12);
        let back = p.device.pose([legs[0].l, legs[1].l]).expect("a pose");
        close("pose", (back - H).norm(), 0.0, 1.0, 1e-13);
    }
}

/// Towards the aligned rods: the determinant keeps its digits, the motion stays finite, the flag rises below its tolerance.
#[test]
fn aligned_rods_are_reached_with_full_digits() {
    let reference = Reference::read("singular");
    let mut p = Parameters { use_stop: false, ..plain() };
    (p.device.A.x, p.device.B.x) = (-0.5, 0.5);
    for row in &reference.rows {
        let [x, z, l_1, l_2, det, cond] = reference.all(row, ["x", "z", "l1", "l2", "detJ", "cond"]);
        let H = Vector2::new(x, z);
        let legs = p.device.legs(&H).expect("off the pivots");
        let own = determinant(&legs);
        close("det", own, det, det.abs(), 1e-10);
        close("l1", legs[0].l, l_1, l_1, 1e-15);
        close("l2", legs[1].l, l_2, l_2, 1e-15);
        // unit rows with cosine c: the condition number is (1 + |c|)/|det|
        close("cond", (1.0 + legs[0].u.dot(&legs[1].u).abs()) / own.abs(), cond, cond, 1e-7);
        let plant = Plant::new(&Parameters { start: H, ..p }, &start()).expect("a pose");
        let (state, d) = plant.start(0.0, &start()).expect("a pose");
        let rates = plant.rates(0.0, &state, &still(), &d).expect("regular");
        assert!(rates.iter().all(|r| r.is_finite()), "z = {z}: {rates:?}");
        let singular = plant.motion(0.0, &state, &still(), &d).expect("regular").singular;
        assert_eq!(singular > 0.5, det.abs() < 1e-3, "det = {det}");
    }
}

/// The stated default figures: lengths, determinant, inertia and static force at (0, 0.6).
#[test]
fn default_pose_has_the_figures_of_the_specification() {
    let p = Parameters::default();
    let legs = p.device.legs(&Vector2::new(0.0, 0.6)).expect("a pose");
    close("l", legs[0].l, 0.69462, 1.0, 5e-6);
    close("det", determinant(&legs), 0.87047, 1.0, 5e-6);
    close("static force", p.device.balance(&legs).expect("regular").x, 47.3, 1.0, 0.05);
}

fn mechanism() -> (Mechanism, mechanism_variables::Parameters) {
    let p = mechanism_variables::Parameters::default();
    (Mechanism::new(&p, &rest()).expect("defaults"), p)
}

fn rest() -> mechanism_variables::Motion<f64> {
    let start: Vec<f64> =
        <mechanism_variables::Motion<f64> as Variables<f64>>::TABLE.iter().map(|v| v.start).collect();
    mechanism_variables::Motion::load(&start)
}

/// Closing, kinematic coefficients, inertia, potential and acceleration of the four-bar.
#[test]
fn fourbar_agrees() {
    let reference = Reference::read("fourbar");
    let (mechanism, p) = mechanism();
    let bar = Fourbar::new(&p.fourbar, p.parts, Vector2::new(0.0, -9.81)).expect("defaults");
    let d = mechanism.start(0.0, &rest()).expect("defaults").1;
    // the file's potential has no stops
    let mut unstopped = p;
    (unstopped.fourbar.stop.lo, unstopped.fourbar.stop.hi) = (-9.0, 9.0);
    let unstopped = Mechanism::new(&unstopped, &rest()).expect("stops out of reach");
    for row in &reference.rows {
        let [phi, rate, F_x, F_z] = reference.all(row, ["phi", "phidot", "F_x", "F_z"]);
        let closed = bar.close(phi).expect("closes");
        for (name, value) in [("psi", closed.psi), ("psi1", closed.psi_1), ("psi2", closed.psi_2)] {
            let expected = reference.at(row, name);
            close(name, value, expected, expected.abs().max(1.0), 1e-11);
        }
        let mut u = mechanism_variables::Inputs::load(&[0.0; 10]);
        u.H.F = Vector2::new(F_x, F_z);
        let at = |rate: f64| {
            let x = [phi, rate, 0.0, 0.0];
            let motion = mechanism.motion(0.0, &x, &u, &d).expect("closes");
            (motion, mechanism.dynamics(0.0, &x, &u, &d).expect("closes").a)
        };
        let (unit, moving, resting) = (at(1.0).0, at(rate), at(0.0));
        let phi_2 = mechanism.rates(0.0, &[phi, rate, 0.0, 0.0], &u, &d).expect("closes")[1];
        let rest_2 = mechanism.rates(0.0, &[phi, 0.0, 0.0, 0.0], &u, &d).expect("closes")[1];
        let [H_2x, H_2z, expected] = reference.all(row, ["H2_x", "H2_z", "phiddot"]);
        close("phi''", phi_2, expected, expected.abs().max(1.0), 1e-11);
        let [H_1x, H_1z] = reference.all(row, ["H1_x", "H1_z"]);
        close("H.x", unit.r.x, reference.at(row, "H_x"), 1.0, 1e-11);
        close("H.z", unit.r.y, reference.at(row, "H_z"), 1.0, 1e-11);
        close("H'.x", unit.v.x, H_1x, 1.0, 1e-11);
        close("H'.z", unit.v.y, H_1z, 1.0, 1e-11);
        close("a.x", moving.1.x, H_1x * phi_2 + H_2x * rate * rate, 100.0, 1e-11);
        close("a.z", moving.1.y, H_1z * phi_2 + H_2z * rate * rate, 100.0, 1e-11);
        close("a.x at rest", resting.1.x, H_1x * rest_2, 100.0, 1e-11);
        // M, M', V, V' as values and exact derivatives of the energies at unit rate
        let x = [Dual64::new(phi, 1.0), Dual64::from_re(1.0), Dual64::from_re(0.0), Dual64::from_re(0.0)];
        let still = mechanism_variables::Inputs::load(&[Dual64::from_re(0.0); 10]);
        let energy = unstopped.energy(Dual64::from_re(0.0), &x, &still, &d).expect("closes");
        let own = [
            ("M", 2.0 * energy.kinetic.re),
            ("dM", 2.0 * energy.kinetic.eps),
            ("V", energy.potential.re),
            ("dV", energy.potential.eps),
        ];
        for (name, value) in own {
            let expected = reference.at(row, name);
            close(name, value, expected, expected.abs().max(1.0), 1e-11);
        }
    }
}
