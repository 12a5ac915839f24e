//! Messages of an instance.

use std::cell::RefCell;
use std::ffi::{CStr, c_char, c_void};

use crate::{Status, status_name};

/// Messages kept of one instance; more are dropped and counted.
const MOST_MESSAGES: usize = 200;

/// One message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Message {
    /// Its status
    pub status: Status,
    /// Its category
    pub category: String,
    /// The text
    pub text: String,
}

impl std::fmt::Display for Message {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} [{}] {}", status_name(self.status), self.category, self.text)
    }
}

/// What an instance said, in order; its address is the instance's environment.
#[derive(Debug, Default)]
pub struct Log {
    messages: RefCell<Vec<Message>>,
    dropped: RefCell<usize>,
}

impl Log {
    /// The messages so far, as text.
    #[must_use]
    pub fn texts(&self) -> Vec<String> {
        let mut texts: Vec<_> = self.messages.borrow().iter().map(Message::to_string).collect();
        if *self.dropped.borrow() > 0 {
            texts.push("further messages are left out".into());
        }
        texts
    }

    /// Take the messages out.
    #[must_use]
    pub fn take(&self) -> Vec<Message> {
        *self.dropped.borrow_mut() = 0;
        self.messages.take()
    }

    fn add(&self, message: Message) {
        let Ok(mut messages) = self.messages.try_borrow_mut() else { return };
        if messages.len() < MOST_MESSAGES {
            messages.push(message);
        } else if let Ok(mut dropped) = self.dropped.try_borrow_mut() {
            *dropped += 1;
        }
    }
}

/// Receives messages: `fmi3LogMessageCallback` with a [`Log`] as environment.
///
/// # Safety
/// `environment` is null or points to a [`Log`] that lives and belongs to this thread; the texts are null or end with a
/// zero byte.
pub unsafe extern "C" fn log_message(
    environment: *mut c_void,
    status: Status,
    category: *const c_char,
    message: *const c_char,
) {
    // SAFETY: by the contract of this function.
    let Some(log) = (unsafe { environment.cast::<Log>().as_ref() }) else {
        return;
    };
    let text = |pointer: *const c_char| {
        if pointer.is_null() {
            return String::new();
        }
        // SAFETY: not null, and FMI strings end with a zero byte and live during the call.
        unsafe { CStr::from_ptr(pointer) }.to_string_lossy().into_owned()
    };
    log.add(Message { status, category: text(category), text: text(message) });
}

/// Receives messages of FMI 2.0 with one text each: `fmi2CallbackLogger` with a [`Log`] as environment.
///
/// The callback of the standard has a variable number of arguments, which stable Rust cannot receive; where C passes the
/// first of them as any other (System V on x86-64), this function gets it.
///
/// # Safety
/// As [`log_message`]; if `format` is `%s`, `text` is a string.
pub unsafe extern "C" fn log_format(
    environment: *mut c_void,
    _instance: *const c_char,
    status: Status,
    category: *const c_char,
    format: *const c_char,
    text: *const c_char,
) {
    // SAFETY: null or a string, by the contract of this function.
    let plain = format.is_null() || unsafe { CStr::from_ptr(format) } != c"%s";
    // SAFETY: as above; without `%s` the format itself is the text.
    unsafe { log_message(environment, status, category, if plain { format } else { text }) }
}
