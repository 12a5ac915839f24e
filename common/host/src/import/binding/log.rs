//! What FMUs say.

use std::ffi::{CStr, c_char, c_void};
use std::sync::{Mutex, PoisonError};

use super::status;

/// Messages kept of one instance; more are dropped and counted.
const MOST_MESSAGES: usize = 100;

/// Messages of one instance, in order.
#[derive(Default)]
pub(super) struct Log {
    kept: Mutex<Kept>,
}

#[derive(Default)]
struct Kept {
    messages: Vec<String>,
    dropped: usize,
}

impl Log {
    /// The pointer that the FMU hands back with every message; valid while the log stays in its place.
    pub(super) fn environment(&self) -> *mut c_void {
        std::ptr::from_ref(self).cast_mut().cast()
    }

    /// All messages so far; they are forgotten here.
    pub(super) fn take(&self) -> Vec<String> {
        let Kept { mut messages, dropped } =
            std::mem::take(&mut *self.kept.lock().unwrap_or_else(PoisonError::into_inner));
        if dropped > 0 {
            messages.push(format!("{dropped} further messages"));
        }
        messages
    }

    fn push(&self, message: String) {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if kept.messages.len() < MOST_MESSAGES {
            kept.messages.push(message);
        } else {
            kept.dropped += 1;
        }
    }
}

/// Text of a C string that may be null.
fn text(pointer: *const c_char) -> String {
    if pointer.is_null() {
        return String::new();
    }
    // SAFETY: not null; FMI strings end with a zero byte and live during the call.
    unsafe { CStr::from_ptr(pointer) }.to_string_lossy().into_owned()
}

/// Receives the messages of FMI 3.0.
pub(super) unsafe extern "C" fn message(
    environment: *mut c_void,
    code: u32,
    category: *const c_char,
    message: *const c_char,
) {
    // SAFETY: the environment is `Log::environment`, given at instantiation; the log outlives the instance.
    let Some(log) = (unsafe { environment.cast::<Log>().as_ref() }) else {
        return;
    };
    log.push(format!("{} [{}] {}", status::name(code), text(category), text(message)));
}

/// Receives the messages of FMI 2.0; placeholders of the text stay unfilled.
pub(super) unsafe extern "C" fn message_2(
    environment: *mut c_void,
    _instance: *const c_char,
    code: u32,
    category: *const c_char,
    text: *const c_char,
) {
    // SAFETY: as in `message`.
    unsafe { message(environment, code, category, text) }
}
