//! The way of messages to the host.

use std::ffi::{CStr, CString, c_char, c_void};

use crate::{Fault, Status};

/// `fmi3LogMessageCallback`
pub type LogMessage = unsafe extern "C" fn(*mut c_void, Status, *const c_char, *const c_char);

/// `fmi2CallbackLogger`: environment, instance name, status, category, format and its arguments.
pub type Logger = unsafe extern "C" fn(*mut c_void, *const c_char, Status, *const c_char, *const c_char, ...);

const ERROR_CATEGORY: &CStr = c"logStatusError";
const DISCARD_CATEGORY: &CStr = c"logStatusDiscard";
pub(super) const WARNING_CATEGORY: &CStr = c"logStatusWarning";
const FATAL_CATEGORY: &CStr = c"logStatusFatal";

/// The log categories with their meaning, as declared in the model description.
pub const LOG_CATEGORIES: [(&CStr, &str); 4] = [
    (WARNING_CATEGORY, "Allowed, but probably not meant"),
    (DISCARD_CATEGORY, "A step or value is refused; nothing has changed and the run may go on"),
    (ERROR_CATEGORY, "A wrong call, or parameters that do not fit together"),
    (FATAL_CATEGORY, "Internal error; the instance is lost"),
];

/// The host's function for messages, if it has given one.
pub(super) enum Callback {
    Fmi2(Option<Logger>, CString),
    Fmi3(Option<LogMessage>),
}

/// Where messages go. Messages about refusals are always sent; a list of categories filters them.
pub(super) struct Log {
    environment: *mut c_void,
    callback: Callback,
    categories: Option<Vec<CString>>,
}

impl Log {
    /// All messages to `callback`.
    pub(super) fn new(environment: *mut c_void, callback: Callback) -> Self {
        Self { environment, callback, categories: None }
    }

    /// Only messages of these categories; `None`: all.
    ///
    /// # Errors
    /// A category that is not declared.
    pub(super) fn choose(&mut self, names: Option<Vec<String>>) -> Result<(), Fault> {
        let known = |name: String| {
            let mut names = LOG_CATEGORIES.iter().map(|(name, _)| *name);
            names.find(|known| known.to_bytes() == name.as_bytes()).map(CStr::to_owned).ok_or(
                Fault::Unsupported {
                    function: "this log category",
                    reason: "see LogCategories in the model description",
                },
            )
        };
        self.categories = names.map(|names| names.into_iter().map(known).collect()).transpose()?;
        Ok(())
    }

    pub(super) fn send(&self, status: Status, category: &CStr, message: &str) {
        if let Some(chosen) = &self.categories
            && !chosen.iter().any(|c| c.as_c_str() == category)
        {
            return;
        }
        let text = CString::new(message.replace('\0', " ")).unwrap_or_default();
        let (category, text) = (category.as_ptr(), text.as_ptr());
        match &self.callback {
            // SAFETY: the host gave this callback together with its environment pointer; the strings
            // are null-terminated and live until the call returns; the format takes one string.
            Callback::Fmi2(Some(callback), name) => unsafe {
                callback(self.environment, name.as_ptr(), status, category, c"%s".as_ptr(), text);
            },
            // SAFETY: as above, without a format.
            Callback::Fmi3(Some(callback)) => unsafe { callback(self.environment, status, category, text) },
            Callback::Fmi2(None, _) | Callback::Fmi3(None) => {}
        }
    }

    pub(super) fn fault(&self, function: &str, fault: &Fault) {
        let status = fault.status();
        let category = match status {
            Status::Discard => DISCARD_CATEGORY,
            Status::Fatal => FATAL_CATEGORY,
            _ => ERROR_CATEGORY,
        };
        let separator = if function.is_empty() { "" } else { ": " };
        self.send(status, category, &format!("{function}{separator}{fault}"));
    }

    /// There is no instance: null with a message.
    pub(super) fn refusal(&self, function: &str, message: &str) -> *mut c_void {
        self.send(Status::Error, ERROR_CATEGORY, &format!("{function}: {message}"));
        std::ptr::null_mut()
    }
}
