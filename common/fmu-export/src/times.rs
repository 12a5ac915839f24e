//! Times that a host may give.

use crate::Fault;

/// A host may miss the instance's time by this much (relative to max(1, |t|)).
const SAME_TIME: f64 = 1e-9;

/// Check start and stop of a run.
///
/// # Errors
/// Times that make no sense.
pub fn experiment(start: f64, stop: Option<f64>) -> Result<(), Fault> {
    if !start.is_finite() {
        return Err(Fault::Argument { argument: "startTime", value: start, allowed: "finite".into() });
    }
    if let Some(stop) = stop
        && !(stop.is_finite() && stop > start)
    {
        return Err(Fault::Argument {
            argument: "stopTime",
            value: stop,
            allowed: format!("> {start} s, finite"),
        });
    }
    Ok(())
}

/// The end of a step that the host asks for, of an instance that stands at `now` and runs to `stop`.
///
/// # Errors
/// Another start than `now`; a step that is not above 0, is lost in rounding, or leads beyond `stop`.
#[inline]
pub fn end_of_step(now: f64, stop: Option<f64>, t: f64, step: f64) -> Result<f64, Fault> {
    let same_time = (t - now).abs() <= SAME_TIME * now.abs().max(1.0);
    if !same_time {
        return Err(Fault::Argument {
            argument: "currentCommunicationPoint",
            value: t,
            allowed: format!("{now} s, where the instance stands"),
        });
    }
    let to = t + step;
    if !(step > 0.0 && to.is_finite() && to > now) {
        return Err(Fault::Argument {
            argument: "communicationStepSize",
            value: step,
            allowed: "> 0 s, finite".into(),
        });
    }
    if let Some(stop) = stop
        && to > stop + SAME_TIME * stop.abs().max(1.0)
    {
        return Err(Fault::Argument {
            argument: "communicationStepSize",
            value: step,
            allowed: format!("<= {} s, up to the stop time {stop} s", stop - t),
        });
    }
    Ok(to)
}
