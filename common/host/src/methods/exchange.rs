//! x
use super::{Config, Progress, Steps};
use crate::error::Error;
use crate::record::Recorder;
use crate::sweep::Sweeper;
pub(super) fn run(
    _s: &mut Sweeper,
    _c: &Config,
    _r: &mut Recorder,
    _p: Progress<'_>,
) -> Result<Steps, Error> {
    todo!()
}
