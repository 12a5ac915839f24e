//! Events of all FMUs together.

use crate::error::RunError;
use crate::import::Status;
use crate::sweep::Sweeper;

/// Most passes of one event.
const MAX_PASSES: u32 = 100;

/// What an event did.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Happened {
    /// Continuous states have new values
    pub(super) states_changed: bool,
    /// First time event to come [s]
    pub(super) next: Option<f64>,
}

/// In Event Mode: sweep and update discrete states until no FMU asks for more; `swept`: the first sweep has been done.
pub(super) fn update(sweeper: &mut Sweeper, swept: bool) -> Result<Happened, RunError> {
    let mut happened = Happened::default();
    for pass in 0..MAX_PASSES {
        if pass > 0 || !swept {
            sweeper.sweep()?;
        }
        let mut again = false;
        happened.next = None;
        for node in 0..sweeper.instances.len() {
            if !sweeper.instances[node].has_event_mode() {
                continue;
            }
            let update = sweeper.instances[node].update_discrete_states();
            let update = update.map_err(|fault| sweeper.failed(node, fault))?;
            if update.terminate {
                let function = "UpdateDiscreteStates";
                let fault = crate::import::Fault { function, status: Status::Terminate };
                return Err(sweeper.failed(node, fault));
            }
            again |= update.again;
            happened.states_changed |= update.states_changed;
            happened.next = match (happened.next, update.next_event) {
                (Some(a), Some(b)) => Some(f64::min(a, b)),
                (a, b) => a.or(b),
            };
        }
        if !again {
            return Ok(happened);
        }
    }
    Err(RunError::EventLoop { t: sweeper.t, passes: MAX_PASSES })
}
