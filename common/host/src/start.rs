//! The start: Initialization Mode, joints closed.

use nalgebra::{DMatrix, DVector};

use crate::error::RunError;
use crate::methods::Config;
use crate::sweep::Sweeper;

/// Largest gap of a closing joint at the start [m], [m/s].
const GAP: f64 = 1e-9;
/// Gap at which Newton's method ends.
const CLOSED: f64 = 1e-13;
/// Step of its differences.
const DIFFERENCE: f64 = 1e-7;
/// Smallest singular value relative to the largest.
const RANK: f64 = 1e-10;
/// Its passes.
const MAX_PASSES: u32 = 25;

/// From instantiation through Initialization Mode; all connected values are in step.
///
/// # Errors
/// What an FMU refuses, an open joint.
pub fn initialise(sweeper: &mut Sweeper, config: &Config) -> Result<(), RunError> {
    enter(sweeper, config.start, Some(config.stop))?;
    close(sweeper)?;
    sweeper.each(|_, instance| instance.exit_initialization())
}

/// Into Initialization Mode.
///
/// # Errors
/// What an FMU refuses.
pub fn enter(sweeper: &mut Sweeper, start: f64, stop: Option<f64>) -> Result<(), RunError> {
    sweeper.t = start;
    sweeper.each(|_, instance| instance.enter_initialization(start, stop))
}

/// In Initialization Mode: closes the joints and brings all connected values in step.
///
/// # Errors
/// What an FMU refuses, an open joint.
pub fn close(sweeper: &mut Sweeper) -> Result<(), RunError> {
    if !sweeper.assemble.is_empty() {
        assemble(sweeper)?;
    }
    if sweeper.gap().is_some() {
        sweeper.sweep_open()?;
        check_gap(sweeper)?;
    }
    sweeper.sweep()
}

/// Newton's method on the start parameters; the smallest change that closes the joints.
fn assemble(sweeper: &mut Sweeper) -> Result<(), RunError> {
    let mut values = read(sweeper)?;
    let mut gaps = evaluate(sweeper, &values)?;
    for _ in 0..MAX_PASSES {
        if gaps.amax() <= CLOSED {
            return Ok(());
        }
        let mut jacobian = DMatrix::zeros(gaps.len(), values.len());
        for column in 0..values.len() {
            let mut moved = values.clone();
            moved[column] += DIFFERENCE;
            let change = (evaluate(sweeper, &moved)? - &gaps) / (moved[column] - values[column]);
            jacobian.set_column(column, &change);
        }
        let svd = jacobian.svd(true, true);
        let rank = RANK * svd.singular_values.amax();
        let Ok(step) = svd.solve(&gaps, rank) else { break };
        for (value, step) in values.iter_mut().zip(step.iter()) {
            *value -= step;
        }
        gaps = evaluate(sweeper, &values)?;
    }
    if gaps.amax() <= GAP { Ok(()) } else { Err(RunError::Assemble { gap: gaps.amax(), passes: MAX_PASSES }) }
}

fn read(sweeper: &mut Sweeper) -> Result<Vec<f64>, RunError> {
    let mut values = vec![0.0; sweeper.assemble.len()];
    for (i, value) in values.iter_mut().enumerate() {
        let (node, reference) = sweeper.assemble[i];
        let result = sweeper.instances[node].get(&[reference], std::slice::from_mut(value));
        result.map_err(|fault| sweeper.failed(node, fault))?;
    }
    Ok(values)
}

/// Gaps of position and velocity with given start parameters.
fn evaluate(sweeper: &mut Sweeper, values: &[f64]) -> Result<DVector<f64>, RunError> {
    for (i, value) in values.iter().enumerate() {
        let (node, reference) = sweeper.assemble[i];
        let result = sweeper.instances[node].set(&[reference], &[*value]);
        result.map_err(|fault| sweeper.failed(node, fault))?;
    }
    sweeper.sweep_open()?;
    Ok(DVector::from_vec(sweeper.gaps()))
}

fn check_gap(sweeper: &Sweeper) -> Result<(), RunError> {
    match sweeper.gap() {
        Some((position, velocity, joint)) if position > GAP || velocity > GAP => {
            Err(RunError::Gap { joint: joint.into(), position, velocity })
        }
        _ => Ok(()),
    }
}
