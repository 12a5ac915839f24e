//! What the host costs: its own share of a run, and growth with the number of components.
//!
//! ```text
//! cargo run --profile fmu -p host --example cost
//! ```
#![allow(clippy::unwrap_used, clippy::print_stdout, clippy::cast_precision_loss, reason = "a measurement")]

use std::path::{Path, PathBuf};
use std::time::Instant;

use host::import::Instance;
use host::methods::{Choices, Config};
use host::record::Recorder;
use host::run::Scene;
use host::ssp::{Component, Connection, Package, ParameterValue, Settings, System};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn build(system: System) -> Scene {
    let package = Package::open(&root().join("scenes/double_pendulum")).unwrap();
    Scene::build(package, system, &root().join("dist/fmi3")).unwrap()
}

fn link(name: &str, theta: f64, x: f64) -> Component {
    let values = [("mass", 1.0), ("length", 1.0), ("gravity.z", -9.81), ("angle.theta", theta), ("A.r.x", x)];
    let mut parameters: Vec<_> =
        values.map(|(name, value)| (name.to_owned(), ParameterValue::Real(value))).into();
    parameters.push(("use.energy".into(), ParameterValue::Boolean(false)));
    Component { name: name.into(), source: "resources/link2.fmu".into(), connectors: vec![], parameters }
}

/// All variables of two ports in the plane.
fn connect(system: &mut System, leader: &str, follower: &str) {
    let mut one = |from: (&str, &str), to: (&str, &str), variable: (String, String)| {
        let end = |(component, port): (&str, &str), v: &str| (component.to_owned(), format!("{port}.{v}"));
        let (from, to) = (end(from, &variable.0), end(to, &variable.1));
        system.connections.push(Connection { from, to, factor: 1.0, offset: 0.0 });
    };
    for quantity in ["r", "v", "a"] {
        for axis in ["x", "z"] {
            let name = format!("{quantity}.{axis}");
            one((leader, "B"), (follower, "A"), (name.clone(), name));
        }
    }
    for axis in ["x", "z"] {
        one((follower, "A"), (leader, "B"), (format!("F0.{axis}"), format!("F.{axis}")));
    }
    for part in ["xx", "xz", "zz"] {
        one((follower, "A"), (leader, "B"), (format!("M.{part}"), format!("M.{part}")));
    }
}

fn chain(n: usize) -> System {
    let mut system = System { name: format!("chain {n}"), stop: Some(1.0), ..System::default() };
    for i in 0..n {
        system.components.push(link(&format!("link{i}"), 0.1, 0.0));
        if i > 0 {
            connect(&mut system, &format!("link{}", i - 1), &format!("link{i}"));
        }
    }
    system
}

/// N parallelograms side by side: N + 1 rods on the ground, N couplers, N closing joints.
fn four_bars(n: usize) -> System {
    let mut system = System { name: format!("four-bars {n}"), stop: Some(1.0), ..System::default() };
    let mut joints = Vec::new();
    for i in 0..=n {
        system.components.push(link(&format!("rod{i}"), 1.2, i as f64));
        if i > 0 {
            system.components.push(link(&format!("coupler{i}"), 0.0, 0.0));
            connect(&mut system, &format!("rod{}", i - 1), &format!("coupler{i}"));
            joints.push((format!("coupler{i}.B"), format!("rod{i}.B")));
        }
    }
    system.settings = Settings { joints, ..Settings::default() };
    system
}

fn rk4(step: f64, stop: f64) -> Choices {
    let (integrator, step, stop) = (Some("rk4".into()), Some(step), Some(stop));
    Choices { method: Some("common".into()), integrator, step, stop, ..Choices::default() }
}

/// Smallest time of the step loop over some runs [s], and right-hand sides.
fn least(scene: &Scene, config: &Config, runs: usize) -> (f64, u64) {
    let once = |_| scene.run(config, &[], &mut Recorder::off(), &mut |_| ()).unwrap().steps;
    let steps: Vec<_> = (0..runs).map(once).collect();
    (steps.iter().map(|s| s.seconds).fold(f64::INFINITY, f64::min), steps[0].rhs_evaluations)
}

/// The calls of one right-hand side of the double pendulum, straight on two instances.
struct Direct {
    links: [Instance; 2],
    references: Vec<Vec<u32>>,
    x: Vec<f64>,
    dx: Vec<f64>,
    buffer: [f64; 8],
}

impl Direct {
    fn new(scene: &Scene, config: &Config) -> Self {
        let mut sweeper = scene.instantiate(config, &[]).unwrap();
        host::start::initialise(&mut sweeper, config).unwrap();
        let mut links: Vec<Instance> = sweeper.instances.drain(..).collect();
        for link in &mut links {
            link.update_discrete_states().unwrap();
            link.enter_continuous_time_mode().unwrap();
        }
        let description = &links[0].fmu().description;
        let reference = |name: &&str| description.variable(name).unwrap().reference;
        let names: [&[&str]; 6] = [
            &["B.r.x", "B.r.z", "B.v.x", "B.v.z"],
            &["A.r.x", "A.r.z", "A.v.x", "A.v.z"],
            &["A.F0.x", "A.F0.z", "A.M.xx", "A.M.xz", "A.M.zz"],
            &["B.F.x", "B.F.z", "B.M.xx", "B.M.xz", "B.M.zz"],
            &["B.a.x", "B.a.z"],
            &["A.a.x", "A.a.z"],
        ];
        let references = names.iter().map(|names| names.iter().map(reference).collect()).collect();
        let n = description.states.len();
        let mut x = vec![0.0; n];
        links[0].get_states(&mut x).unwrap();
        let links = links.try_into().unwrap_or_else(|_| panic!("two links"));
        Self { links, references, x, dx: vec![0.0; n], buffer: [0.0; 8] }
    }

    /// `new_time`: two of the four stages of RK4 stand at a new time.
    fn rhs(&mut self, t: f64, new_time: bool) {
        let Self { links: [upper, lower], references, x, dx, buffer } = self;
        x[0] += 1e-9; // new values, as in a run
        for link in [&mut *upper, &mut *lower] {
            if new_time {
                link.set_time(t).unwrap();
            }
            link.set_states(x).unwrap();
        }
        upper.get(&references[0], &mut buffer[..4]).unwrap();
        lower.set(&references[1], &buffer[..4]).unwrap();
        lower.get(&references[2], &mut buffer[..5]).unwrap();
        upper.set(&references[3], &buffer[..5]).unwrap();
        upper.get(&references[4], &mut buffer[..2]).unwrap();
        lower.set(&references[5], &buffer[..2]).unwrap();
        upper.get_derivatives(dx).unwrap();
        lower.get_derivatives(dx).unwrap();
    }
}

fn double_pendulum() {
    let path = root().join("scenes/double_pendulum");
    let scene = Scene::load(&path, &root().join("dist/fmi3"), None).unwrap();
    let config = Config::new(&scene.system, &rk4(0.005, 2.0)).unwrap();
    let (whole, rhs) = least(&scene, &config, 50);
    let mut direct = Direct::new(&scene, &config);
    let mut calls = f64::INFINITY;
    for _ in 0..50 {
        let begin = Instant::now();
        for i in 0..rhs {
            direct.rhs(0.00125 * i as f64, i % 2 == 0);
        }
        calls = calls.min(begin.elapsed().as_secs_f64());
    }
    let steps = 2.0 * 400.0;
    println!(
        "double_pendulum, common rk4, 5 ms, 2 s: {:.3} ms (limit 2), {rhs} right-hand sides",
        1e3 * whole
    );
    println!("  the FMI calls alone: {:.3} ms", 1e3 * calls);
    println!("  host per FMU and communication step: {:.3} us (limit 0.3)", 1e6 * (whole - calls) / steps);
}

/// Slope of log time over log N.
fn exponent(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let (x, y) = points.iter().fold((0.0, 0.0), |(x, y), p| (x + p.0.ln() / n, y + p.1.ln() / n));
    let fold = |(xy, xx): (f64, f64), p: &(f64, f64)| {
        (xy + (p.0.ln() - x) * (p.1.ln() - y), xx + (p.0.ln() - x).powi(2))
    };
    let (xy, xx) = points.iter().fold((0.0, 0.0), fold);
    xy / xx
}

fn growth(name: &str, sizes: &[usize], system: impl Fn(usize) -> System) {
    let mut points = Vec::new();
    for &n in sizes {
        let begin = Instant::now();
        let scene = build(system(n));
        let loaded = begin.elapsed().as_secs_f64();
        let config = Config::new(&scene.system, &rk4(1e-3, 0.02)).unwrap();
        let (seconds, rhs) = least(&scene, &config, 10);
        let each = seconds / rhs as f64;
        println!(
            "{name} N = {n}: {:.2} us per right-hand side, scene built in {:.0} ms",
            1e6 * each,
            1e3 * loaded
        );
        points.push((n as f64, each));
    }
    println!("  exponent {:.3}", exponent(&points));
}

fn main() {
    double_pendulum();
    growth("chain of link2", &[10, 25, 50, 100, 200], chain);
    growth("N-four-bar", &[2, 5, 10, 20, 40], four_bars);
}
