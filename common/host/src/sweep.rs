//! The sweep: one Set and one Get per component and pass, closing joints and affine loops solved in between.

mod driven;
mod ports;
mod response;

pub use driven::Driven;
pub(crate) use driven::SweepState;
pub use ports::Port;

use nalgebra::{DMatrix, DVector};

use crate::closure::Closure;
use crate::error::RunError;
use crate::import::{Counts, Fault, Instance};
use crate::scene::{Axis, Network, Plan, Step};
use response::Response;

/// No index.
const NONE: usize = usize::MAX;
/// Newton passes of an affine loop.
const MAX_PASSES: u32 = 3;
/// Largest residual of an affine loop relative to its values.
const LOOP_TOLERANCE: f64 = 1e-10;

/// What an input takes.
#[derive(Clone, Copy)]
struct Input {
    reference: u32,
    signal: usize,
    factor: f64,
    offset: f64,
    unknown: usize,
    sign: f64,
}

/// A step with its value references.
struct Call {
    node: usize,
    sinks: Box<[usize]>,
    signals: Box<[usize]>,
    references: Box<[u32]>,
}

/// Columns that use the same calls.
struct Probe {
    unknowns: Vec<usize>,
    calls: Vec<Call>,
    rows: Vec<usize>,
}

/// What a row of the linear system compares.
#[derive(Clone, Copy)]
enum Row {
    /// Two sides of a joint
    Joint(Axis),
    /// An input with its source
    Cut(Input),
}

/// How the unknowns are solved for.
enum Solver {
    None,
    Joints(Closure),
    /// With affine loops: not symmetric
    General(DMatrix<f64>),
}

/// Instances with the plan of their calls.
pub struct Sweeper {
    /// Live instances, in the order of the components
    pub instances: Vec<Instance>,
    /// Component names
    pub names: Vec<String>,
    /// Values of all signals after a sweep
    pub values: Vec<f64>,
    /// What each component gives and takes
    pub ports: Vec<Port>,
    /// Components, leaders before followers
    pub order: Vec<usize>,
    /// Signals of position and velocity, whose error controls the step
    pub motion: Vec<usize>,
    /// A component has discrete outputs that others take
    pub sampled: bool,
    signal_names: Vec<String>,
    /// Magnitudes beyond which a signal has run away
    bounds: Vec<f64>,
    joint_of: Vec<String>,
    inputs: Vec<Input>,
    /// What the FMUs hold; NaN: not known
    held: Vec<f64>,
    /// Of components without Event Mode, between steps
    responses: Vec<Option<Response>>,
    base: Vec<Call>,
    probes: Vec<Probe>,
    last: Vec<Call>,
    rows: Vec<Row>,
    alpha: f64,
    solver: Solver,
    unknowns: Vec<f64>,
    residuals: Vec<f64>,
    before: Vec<f64>,
    references: Vec<u32>,
    scratch: Vec<f64>,
    /// Start parameters that may change to close the joints: component and value reference
    pub assemble: Vec<(usize, u32)>,
    /// Inputs from outside the scene
    pub driven: Driven,
    /// Time of messages [s]
    pub t: f64,
    /// Sweeps so far
    pub sweeps: u64,
}

fn compile(network: &Network, steps: &[Step]) -> Vec<Call> {
    let call = |step: &Step| Call {
        node: step.node,
        sinks: step.sinks.clone().into(),
        signals: step.signals.clone().into(),
        references: step.signals.iter().map(|&s| network.signals[s].reference).collect(),
    };
    steps.iter().map(call).collect()
}

impl Sweeper {
    /// Joins instances, in the order of the components, and plan.
    #[must_use]
    pub fn new(network: &Network, plan: &Plan, instances: Vec<Instance>, alpha: f64) -> Self {
        let input = |(i, sink): (usize, &crate::scene::Sink)| {
            let cut = plan.cuts.contains(&i);
            let source = sink.source.filter(|_| !cut);
            Input {
                reference: sink.reference,
                signal: source.map_or(NONE, |s| s.signal),
                factor: source.map_or(1.0, |s| s.factor),
                offset: source.map_or(0.0, |s| s.offset),
                unknown: sink.unknown.map_or(NONE, |(u, _)| u),
                sign: sink.unknown.map_or(0.0, |(_, sign)| sign),
            }
        };
        let inputs: Vec<Input> = network.sinks.iter().enumerate().map(input).collect();
        let joints = network.joints.iter().flat_map(|j| &j.axes).map(|axis| Row::Joint(*axis));
        let cuts = plan.cuts.iter().filter_map(|&sink| {
            let source = network.sinks[sink].source?;
            Some(Row::Cut(Input {
                signal: source.signal,
                factor: source.factor,
                offset: source.offset,
                ..inputs[sink]
            }))
        });
        let rows: Vec<Row> = joints.chain(cuts).collect();
        let probe = |probe: &crate::scene::Probe| Probe {
            unknowns: probe.unknowns.clone(),
            calls: compile(network, &probe.steps),
            rows: probe.rows.clone(),
        };
        let n = rows.len();
        let solver = match (n, plan.cuts.is_empty()) {
            (0, _) => Solver::None,
            (_, true) => Solver::Joints(Closure::new(pattern(plan, n))),
            (_, false) => Solver::General(DMatrix::zeros(n, n)),
        };
        let joint_name = |j: &crate::scene::Joint| vec![j.ports.join(" - "); j.axes.len()];
        Self {
            names: network.nodes.iter().map(|n| n.name.clone()).collect(),
            values: vec![0.0; network.signals.len()],
            ports: ports::of(network),
            order: network.leaders_first(),
            motion: (0..network.signals.len()).filter(|&s| network.is_motion(s)).collect(),
            sampled: (0..network.signals.len()).any(|s| network.is_discrete(s)),
            signal_names: (0..network.signals.len()).map(|s| network.signal_name(s)).collect(),
            bounds: network.signals.iter().map(|s| ports::RUN_AWAY * s.nominal).collect(),
            joint_of: network.joints.iter().flat_map(joint_name).collect(),
            held: vec![f64::NAN; inputs.len()],
            responses: instances.iter().map(|_| None).collect(),
            inputs,
            base: compile(network, &plan.base),
            probes: plan.probes.iter().map(probe).collect(),
            last: compile(network, &plan.last),
            alpha,
            solver,
            unknowns: vec![0.0; n],
            residuals: vec![0.0; n],
            before: vec![0.0; network.signals.len()],
            references: Vec::with_capacity(network.sinks.len()),
            scratch: Vec::with_capacity(network.sinks.len().max(network.signals.len())),
            assemble: Vec::new(),
            driven: Driven::default(),
            rows,
            instances,
            t: 0.0,
            sweeps: 0,
        }
    }

    /// The FMUs may hold other inputs than those set last: after a step or a restored state.
    pub fn invalidate(&mut self) {
        self.held.fill(f64::NAN);
    }

    /// The error of a call of a component.
    #[must_use]
    pub fn failed(&self, node: usize, fault: Fault) -> RunError {
        RunError::Call {
            t: self.t,
            component: self.names[node].clone(),
            fault,
            messages: self.instances[node].messages(),
        }
    }

    /// Calls `f` for every instance.
    ///
    /// # Errors
    /// The first call that fails.
    pub fn each(
        &mut self,
        mut f: impl FnMut(usize, &mut Instance) -> Result<(), Fault>,
    ) -> Result<(), RunError> {
        for node in 0..self.instances.len() {
            f(node, &mut self.instances[node]).map_err(|fault| self.failed(node, fault))?;
        }
        Ok(())
    }

    /// Calls of all instances.
    #[must_use]
    pub fn counts(&self) -> Counts {
        self.instances.iter().fold(Counts::default(), |mut sum, i| {
            sum += i.counts();
            sum
        })
    }

    /// Counts from zero again.
    pub fn reset_counts(&mut self) {
        self.sweeps = 0;
        self.instances.iter_mut().for_each(Instance::reset_counts);
    }

    /// Name of a signal.
    #[must_use]
    pub fn signal_name(&self, signal: usize) -> &str {
        &self.signal_names[signal]
    }

    #[inline]
    fn wanted(&self, input: &Input) -> f64 {
        let mut value = input.offset;
        if input.signal != NONE {
            value += input.factor * self.values[input.signal];
        }
        if input.unknown != NONE {
            value += input.sign * self.unknowns[input.unknown];
        }
        value
    }

    /// Sets what has changed, then reads.
    #[inline]
    fn call(&mut self, call: &Call) -> Result<(), RunError> {
        if self.answered(call) {
            return Ok(());
        }
        self.references.clear();
        self.scratch.clear();
        for &sink in &call.sinks {
            let value = self.wanted(&self.inputs[sink]);
            if value.to_bits() != self.held[sink].to_bits() {
                self.held[sink] = value;
                self.references.push(self.inputs[sink].reference);
                self.scratch.push(value);
            }
        }
        let instance = &mut self.instances[call.node];
        let mut result = Ok(());
        if !self.references.is_empty() {
            result = instance.set(&self.references, &self.scratch);
        }
        if result.is_ok() && !call.signals.is_empty() {
            self.scratch.resize(call.signals.len(), 0.0);
            result = instance.get(&call.references, &mut self.scratch);
            for (&signal, &value) in call.signals.iter().zip(&self.scratch) {
                self.values[signal] = value;
            }
        }
        result.map_err(|fault| {
            self.invalidate();
            self.failed(call.node, fault)
        })
    }

    /// Brings all connected inputs and signals in step.
    ///
    /// # Errors
    /// A call that fails, a closure or loop without solution.
    pub fn sweep(&mut self) -> Result<(), RunError> {
        self.sweeps += 1;
        self.sweep_open()?;
        let mut solver = std::mem::replace(&mut self.solver, Solver::None);
        let result = self.close(&mut solver);
        self.solver = solver;
        result
    }

    /// Solves for the unknowns and carries the solution to the FMUs.
    fn close(&mut self, solver: &mut Solver) -> Result<(), RunError> {
        if !matches!(solver, Solver::None) {
            self.probe(solver)?;
            for row in 0..self.rows.len() {
                self.residuals[row] = -self.target(row);
            }
            self.solve(solver)?;
        }
        self.finish()?;
        if let Solver::General(matrix) = solver {
            self.refine(matrix)?;
        }
        Ok(())
    }

    fn finish(&mut self) -> Result<(), RunError> {
        let last = std::mem::take(&mut self.last);
        let result = last.iter().try_for_each(|call| self.call(call));
        self.last = last;
        result
    }

    /// Right-hand side of a row: relative acceleration with stabilisation, or the loop's difference.
    fn target(&self, row: usize) -> f64 {
        match &self.rows[row] {
            Row::Joint(axis) => {
                let d = |[first, second]: [usize; 2]| self.values[first] - self.values[second];
                d(axis.a) + 2.0 * self.alpha * d(axis.v) + self.alpha * self.alpha * d(axis.r)
            }
            Row::Cut(_) => self.difference(row),
        }
    }

    /// The part of a row that the unknowns change.
    fn difference(&self, row: usize) -> f64 {
        match &self.rows[row] {
            Row::Joint(axis) => self.values[axis.a[0]] - self.values[axis.a[1]],
            Row::Cut(input) => {
                input.factor * self.values[input.signal] + input.offset - self.unknowns[input.unknown]
            }
        }
    }

    /// The matrix by unit unknowns.
    fn probe(&mut self, solver: &mut Solver) -> Result<(), RunError> {
        self.before.copy_from_slice(&self.values);
        for row in 0..self.rows.len() {
            self.residuals[row] = self.difference(row);
        }
        let probes = std::mem::take(&mut self.probes);
        let result = probes.iter().try_for_each(|probe| self.columns(probe, solver));
        self.probes = probes;
        result
    }

    fn columns(&mut self, probe: &Probe, solver: &mut Solver) -> Result<(), RunError> {
        for &unknown in &probe.unknowns {
            self.unknowns[unknown] = 1.0;
            for call in &probe.calls {
                self.call(call)?;
            }
            for &row in &probe.rows {
                let change = self.difference(row) - self.residuals[row];
                match solver {
                    Solver::None => {}
                    Solver::Joints(closure) => closure.put(row, unknown, change),
                    Solver::General(matrix) => matrix[(row, unknown)] = change,
                }
            }
            self.unknowns[unknown] = 0.0;
            for &signal in probe.calls.iter().flat_map(|c| &c.signals) {
                self.values[signal] = self.before[signal];
            }
        }
        Ok(())
    }

    /// From residuals to unknowns.
    fn solve(&mut self, solver: &mut Solver) -> Result<(), RunError> {
        match solver {
            Solver::None => {}
            Solver::Joints(closure) => {
                closure.solve(&mut self.residuals).map_err(|inconsistent| RunError::Closure {
                    t: self.t,
                    joint: self.joint_of[inconsistent.unknown].clone(),
                    acceleration: inconsistent.value,
                })?;
                self.unknowns.copy_from_slice(&self.residuals);
            }
            Solver::General(matrix) => {
                let change = self.general(matrix)?;
                for (unknown, change) in self.unknowns.iter_mut().zip(&change) {
                    *unknown += change;
                }
            }
        }
        Ok(())
    }

    fn general(&self, matrix: &DMatrix<f64>) -> Result<DVector<f64>, RunError> {
        let solution = matrix.clone().full_piv_lu().solve(&DVector::from_column_slice(&self.residuals));
        solution.filter(|x| x.iter().all(|v| v.is_finite())).ok_or_else(|| self.no_solution())
    }

    fn no_solution(&self) -> RunError {
        let input = self.rows.iter().find_map(|row| match row {
            Row::Cut(input) => Some(self.signal_names[input.signal].clone()),
            Row::Joint(_) => None,
        });
        RunError::Loop { t: self.t, input: input.unwrap_or_default() }
    }

    /// Further Newton passes where the loop is not affine.
    fn refine(&mut self, matrix: &DMatrix<f64>) -> Result<(), RunError> {
        for _ in 1..MAX_PASSES {
            let mut worst = 0.0_f64;
            for row in 0..self.rows.len() {
                let residual = if matches!(self.rows[row], Row::Cut(_)) { self.difference(row) } else { 0.0 };
                self.residuals[row] = -residual;
                worst = worst.max(residual.abs());
            }
            let scale = self.unknowns.iter().fold(1.0_f64, |m, u| m.max(u.abs()));
            if worst <= LOOP_TOLERANCE * scale {
                return Ok(());
            }
            let change = self.general(matrix)?;
            for (unknown, change) in self.unknowns.iter_mut().zip(&change) {
                *unknown += change;
            }
            self.finish()?;
        }
        Err(self.no_solution())
    }

    /// Brings positions and velocities in step, with the joints open.
    ///
    /// # Errors
    /// A call that fails.
    pub fn sweep_open(&mut self) -> Result<(), RunError> {
        self.unknowns.fill(0.0);
        let base = std::mem::take(&mut self.base);
        let result = base.iter().try_for_each(|call| self.call(call));
        self.base = base;
        result
    }

    /// Distance at a closing joint [m], over the directions in which it is closed.
    #[must_use]
    pub fn distance(&self, joint: &crate::scene::Joint) -> f64 {
        let square = |axis: &Axis| (self.values[axis.r[0]] - self.values[axis.r[1]]).powi(2);
        joint.axes.iter().map(square).sum::<f64>().sqrt()
    }

    /// Largest distance and relative velocity of the closing joints, and where [m, m/s].
    #[must_use]
    pub fn gap(&self) -> Option<(f64, f64, &str)> {
        let mut worst: Option<(f64, f64, &str)> = None;
        for (row, name) in self.rows.iter().zip(&self.joint_of) {
            if let Row::Joint(axis) = row {
                let d = |[first, second]: [usize; 2]| (self.values[first] - self.values[second]).abs();
                let (r, v) = (d(axis.r), d(axis.v));
                let larger = worst.is_none_or(|(r_max, v_max, _)| r.max(v) > r_max.max(v_max));
                if larger {
                    worst = Some((r, v, name));
                }
            }
        }
        worst
    }

    /// Differences of position and of velocity of all joint directions [m], [m/s].
    #[must_use]
    pub fn gaps(&self) -> Vec<f64> {
        let d = |[first, second]: [usize; 2]| self.values[first] - self.values[second];
        let of = |row: &Row| match row {
            Row::Joint(axis) => vec![d(axis.r), d(axis.v)],
            Row::Cut(_) => vec![],
        };
        self.rows.iter().flat_map(of).collect()
    }
}

/// First nonzero column of each row.
fn pattern(plan: &Plan, n: usize) -> Vec<usize> {
    let mut first: Vec<usize> = (0..n).collect();
    for probe in &plan.probes {
        for &row in &probe.rows {
            for &unknown in &probe.unknowns {
                first[row] = first[row].min(unknown);
            }
        }
    }
    first
}
