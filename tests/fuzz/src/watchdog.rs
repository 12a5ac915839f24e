//! Ends the program when one call takes too long, and says which.

use std::process;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::thread;
use std::time::{Duration, Instant};

/// Exit code of a hang.
pub(crate) const HANG: i32 = 3;

/// Milliseconds since the program's start at which the present call began; 0: none.
static BEGUN: AtomicU64 = AtomicU64::new(0);
static CALL: AtomicUsize = AtomicUsize::new(0);

fn now() -> u64 {
    static START: OnceLock<Instant> = OnceLock::new();
    let since = START.get_or_init(Instant::now).elapsed().as_millis();
    u64::try_from(since).unwrap_or(u64::MAX).max(1)
}

/// While this lives, a call is under way.
pub(crate) struct UnderWay;

/// A call begins.
pub(crate) fn enter(call: usize) -> UnderWay {
    CALL.store(call, Ordering::Relaxed);
    BEGUN.store(now(), Ordering::Relaxed);
    UnderWay
}

impl Drop for UnderWay {
    fn drop(&mut self) {
        BEGUN.store(0, Ordering::Relaxed);
    }
}

/// Watch from a thread of its own; the program ends with [`HANG`] when a call exceeds `limit`.
pub(crate) fn start(limit: Duration) {
    let limit = u64::try_from(limit.as_millis()).unwrap_or(u64::MAX);
    now();
    thread::spawn(move || {
        loop {
            thread::sleep(Duration::from_millis(100));
            let begun = BEGUN.load(Ordering::Relaxed);
            if begun != 0 && now() - begun > limit {
                crate::say(&format!("call {} takes more than {limit} ms", CALL.load(Ordering::Relaxed)));
                process::exit(HANG);
            }
        }
    });
}
