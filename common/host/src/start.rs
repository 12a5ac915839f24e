//! The start: Initialization Mode, joints closed.

use crate::error::RunError;
use crate::methods::Config;
use crate::sweep::Sweeper;

/// Largest gap of a closing joint at the start [m], [m/s].
const GAP: f64 = 1e-9;

/// From instantiation through Initialization Mode; all connected values are in step.
///
/// # Errors
/// What an FMU refuses, an open joint.
pub fn initialise(sweeper: &mut Sweeper, config: &Config) -> Result<(), RunError> {
    sweeper.t = config.start;
    sweeper.each(|_, instance| instance.enter_initialization(config.start, Some(config.stop)))?;
    sweeper.sweep()?;
    check_gap(sweeper)?;
    sweeper.each(|_, instance| instance.exit_initialization())
}

fn check_gap(sweeper: &Sweeper) -> Result<(), RunError> {
    match sweeper.gap() {
        Some((position, velocity, joint)) if position > GAP || velocity > GAP => {
            Err(RunError::Gap { joint: joint.into(), position, velocity })
        }
        _ => Ok(()),
    }
}
