//! Methods `jacobi` and `seidel`: what a plain host does, without Event Mode.
//!
//! ```text
//! jacobi   get all, set all, step all
//! seidel   leaders before followers: set, step, get; followers take their inputs as those of the end of the step
//! ```

use super::inputs::{Inputs, Treatment};
use super::{Clock, Config, MethodKind, Progress, Steps};
use crate::error::{Error, RunError};
use crate::import::{Fault, Status};
use crate::record::Recorder;
use crate::scene::SceneError;
use crate::start;
use crate::sweep::Sweeper;

/// Runs from start to stop.
pub(super) fn run(
    sweeper: &mut Sweeper,
    config: &Config,
    recorder: &mut Recorder,
    progress: Progress<'_>,
) -> Result<Steps, Error> {
    let step = config.step.ok_or(SceneError::MissingSetting { name: "the step", option: "--H" })?;
    if sweeper.gap().is_some() {
        let wanted = "closing joints need common, cs-predict or cs-pece".into();
        return Err(SceneError::Setting { name: "method", value: config.method.name().into(), wanted }.into());
    }
    treat_inputs(sweeper, config)?;
    start::initialise(sweeper, config)?;
    recorder.offer(sweeper, config, config.start)?;
    let mut steps = Steps::default();
    let mut t = config.start;
    let begin = Clock::start();
    while t < config.stop {
        steps.accepted += 1;
        let next = config.point(steps.accepted, step);
        match config.method {
            MethodKind::Seidel => seidel(sweeper, t, next - t)?,
            _ => jacobi(sweeper, t, next - t, steps.accepted > 1)?,
        }
        t = next;
        sweeper.t = t;
        recorder.offer(sweeper, config, t)?;
        progress(t);
    }
    (steps.seconds, steps.cpu) = begin.read();
    Ok(steps)
}

fn treat_inputs(sweeper: &mut Sweeper, config: &Config) -> Result<(), RunError> {
    let inputs = Inputs::of(sweeper);
    for node in 0..sweeper.instances.len() {
        let (treatment, order) = if config.method == MethodKind::Seidel && sweeper.ports[node].follows {
            (Treatment::Endpoint, config.order.max(1))
        } else {
            (Treatment::Extrapolate, config.order)
        };
        inputs.set(sweeper, node, treatment, order)?;
    }
    Ok(())
}

/// One step of one component; whether it wants Event Mode.
pub(super) fn do_step(
    sweeper: &mut Sweeper,
    node: usize,
    t: f64,
    h: f64,
    may_restore: bool,
) -> Result<bool, RunError> {
    let stepped = sweeper.instances[node].do_step(t, h, may_restore);
    let stepped = stepped.map_err(|fault| sweeper.failed(node, fault))?;
    if stepped.terminate {
        return Err(sweeper.failed(node, Fault { function: "DoStep", status: Status::Terminate }));
    }
    Ok(stepped.event)
}

fn jacobi(sweeper: &mut Sweeper, t: f64, h: f64, exchange: bool) -> Result<(), RunError> {
    let nodes = 0..sweeper.instances.len();
    if exchange {
        nodes.clone().try_for_each(|node| sweeper.take(node))?;
        sweeper.check_bounds(t)?;
        nodes.clone().try_for_each(|node| sweeper.give(node))?;
    }
    nodes.clone().try_for_each(|node| do_step(sweeper, node, t, h, false).map(|_| ()))
}

fn seidel(sweeper: &mut Sweeper, t: f64, h: f64) -> Result<(), RunError> {
    for i in 0..sweeper.order.len() {
        let node = sweeper.order[i];
        sweeper.give(node)?;
        do_step(sweeper, node, t, h, false)?;
        sweeper.take(node)?;
    }
    sweeper.check_bounds(t + h)
}
