//! The C boundary of FMI 2.0 and 3.0: the only module with unsafe code on the export side.
//!
//! Every function of the standards is exported by [`export!`](crate::export); each one checks its
//! pointers, catches panics and turns faults into a status with a log message. Nothing else happens
//! here. What both standards have in common is in [`shared`]; [`fmi2`] and [`fmi3`] have the signatures.

#![allow(unsafe_code, reason = "C interface; every block states why it is sound")]
#![allow(non_snake_case, reason = "names of the standard")]
#![allow(clippy::missing_safety_doc, reason = "one contract for all: the pointers follow FMI")]
#![allow(clippy::too_many_arguments, reason = "signatures of the standard")]

mod export;
#[doc(hidden)]
pub mod fmi2;
#[doc(hidden)]
pub mod fmi3;
mod log;
mod shared;

use std::ffi::{CStr, c_char, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

pub use log::{LOG_CATEGORIES, LogMessage, Logger};
use log::{Log, WARNING_CATEGORY};

use crate::phase::{Interface, Rule};
use crate::{CreationError, Exported, Fault, Status};

/// What an instance pointer of FMI points to.
struct Component<I: Exported> {
    instance: I,
    log: Log,
}

/// Run `body` on the instance: null check, phase rule, panic barrier, message, status.
///
/// # Safety
/// `instance` is null or came from [`instantiate`] and was not freed.
unsafe fn call<I: Exported>(
    instance: *mut c_void,
    rule: &Rule,
    body: impl FnOnce(&mut Component<I>) -> Result<(), Fault>,
) -> Status {
    // SAFETY: by the contract of this function; FMI forbids concurrent calls on one instance.
    let Some(component) = (unsafe { instance.cast::<Component<I>>().as_mut() }) else {
        return Status::Error;
    };
    let result = catch_unwind(AssertUnwindSafe(|| {
        component.instance.enter(rule)?;
        body(component)
    }));
    let fault = match result {
        Ok(Ok(())) => return warned(component),
        Ok(Err(fault)) => fault,
        Err(panic) => {
            component.instance.break_down();
            let message = panic
                .downcast_ref::<&str>()
                .map(ToString::to_string)
                .or_else(|| panic.downcast_ref::<String>().cloned())
                .unwrap_or_else(|| "panic".into());
            Fault::Panic { message }
        }
    };
    component.log.fault(rule.function, &fault);
    fault.status()
}

/// Status of a call that was carried out: with a warning if the instance has something to say.
#[inline]
fn warned<I: Exported>(component: &mut Component<I>) -> Status {
    if !component.instance.has_warnings() {
        return Status::Ok;
    }
    for warning in component.instance.take_warnings() {
        component.log.send(Status::Warning, WARNING_CATEGORY, &warning);
    }
    Status::Warning
}

/// The data behind a C array; null is an empty array if `n` is 0.
///
/// # Safety
/// `pointer` is null or points to `n` values that live and do not change during the call.
unsafe fn array<'a, T>(argument: &'static str, pointer: *const T, n: usize) -> Result<&'a [T], Fault> {
    if n == 0 {
        return Ok(&[]);
    }
    if pointer.is_null() {
        return Err(Fault::Null { argument });
    }
    // SAFETY: not null; the rest by the contract of this function.
    Ok(unsafe { std::slice::from_raw_parts(pointer, n) })
}

/// The same, to be written.
///
/// # Safety
/// As [`array`], and nothing else refers to the values.
unsafe fn array_mut<'a, T>(argument: &'static str, pointer: *mut T, n: usize) -> Result<&'a mut [T], Fault> {
    if n == 0 {
        return Ok(&mut []);
    }
    if pointer.is_null() {
        return Err(Fault::Null { argument });
    }
    // SAFETY: not null; the rest by the contract of this function.
    Ok(unsafe { std::slice::from_raw_parts_mut(pointer, n) })
}

/// One value to be written.
///
/// # Safety
/// As [`array_mut`] with one value.
unsafe fn put<T>(argument: &'static str, pointer: *mut T, value: T) -> Result<(), Fault> {
    // SAFETY: by the contract of this function.
    unsafe { array_mut(argument, pointer, 1) }?[0] = value;
    Ok(())
}

/// Text of a C string; null gives none, invalid UTF-8 replacement text.
///
/// # Safety
/// `pointer` is null or points to a null-terminated string.
unsafe fn text(pointer: *const c_char) -> String {
    if pointer.is_null() {
        return String::new();
    }
    // SAFETY: not null; the rest by the contract of this function.
    unsafe { CStr::from_ptr(pointer) }.to_string_lossy().into_owned()
}

/// A new instance, or null with a message.
///
/// # Safety
/// The token is null or a null-terminated string; the log's callback and environment are the host's.
unsafe fn instantiate<I: Exported>(
    function: &str,
    interface: Interface,
    (token_name, token): (&str, *const c_char),
    resources: Option<&Path>,
    log: Log,
) -> *mut c_void {
    let created = catch_unwind(|| {
        // SAFETY: by the contract of this function.
        let given = unsafe { text(token) };
        I::create(interface, &given, resources).map_err(|error| match error {
            CreationError::Token { .. } => format!("{token_name} is \"{given}\"; {error}"),
            other => other.to_string(),
        })
    });
    match created {
        Ok(Ok(instance)) => Box::into_raw(Box::new(Component { instance, log })).cast(),
        Ok(Err(message)) => log.refusal(function, &message),
        Err(_) => log.refusal(function, "internal error"),
    }
}

/// End of an instance.
///
/// # Safety
/// `instance` is null or came from [`instantiate`] and was not freed.
unsafe fn free_instance<I: Exported>(instance: *mut c_void) {
    if !instance.is_null() {
        // SAFETY: not null, created by `Box::into_raw` above, freed once (FMI).
        let component = unsafe { Box::from_raw(instance.cast::<Component<I>>()) };
        let _ = catch_unwind(AssertUnwindSafe(|| drop(component)));
    }
}
