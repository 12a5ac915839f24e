//! How long a call takes.

use std::time::{Duration, Instant};

/// Blocks of calls that are timed.
const BLOCKS: u32 = 30;
/// Least length of a block.
const BLOCK: Duration = Duration::from_millis(2);

/// Seconds per call of `body`: the smallest mean of all blocks; the clock is read after every `bundle` calls.
pub(crate) fn seconds(bundle: u32, mut body: impl FnMut()) -> f64 {
    let mut smallest = f64::INFINITY;
    for _ in 0..BLOCKS {
        let (begin, mut calls) = (Instant::now(), 0.0);
        while begin.elapsed() < BLOCK {
            for _ in 0..bundle {
                body();
            }
            calls += f64::from(bundle);
        }
        smallest = smallest.min(begin.elapsed().as_secs_f64() / calls);
    }
    smallest
}
