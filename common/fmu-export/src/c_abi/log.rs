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

/// Where messages go: all of them, until the host switches categories off or asks for some only.
pub(super) struct Log {
    environment: *mut c_void,
    callback: Callback,
    /// Switched on; `None`: all
    categories: Option<Vec<&'static CStr>>,
}

impl Log {
    /// All messages to `callback`.
    pub(super) fn new(environment: *mut c_void, callback: Callback) -> Self {
        Self { environment, callback, categories: None }
    }

    /// Switch categories on or off, all without names (FMI 3.0, 2.3.1: only those are sent that are switched on).
    ///
    /// # Errors
    /// A category that is not declared; then nothing is switched.
    pub(super) fn choose(&mut self, on: bool, names: &[String]) -> Result<(), Fault> {
        let named = names.iter().map(|name| known(name)).collect::<Result<Vec<_>, _>>()?;
        let all = || LOG_CATEGORIES.map(|(name, _)| name).to_vec();
        self.categories = match (on, named.is_empty()) {
            (true, true) => None,
            (false, true) => Some(Vec::new()),
            (true, false) => Some([self.categories.take().unwrap_or_default(), named].concat()),
            (false, false) => {
                let mut left = self.categories.take().unwrap_or_else(all);
                left.retain(|category| !named.contains(category));
                Some(left)
            }
        };
        Ok(())
    }

    pub(super) fn send(&self, status: Status, category: &CStr, message: &str) {
        if let Some(chosen) = &self.categories
            && !chosen.contains(&category)
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
        self.send(status, category, &format!("{function}: {fault}"));
    }

    /// There is no instance: null with a message.
    pub(super) fn refusal(&self, function: &str, message: &str) -> *mut c_void {
        self.send(Status::Error, ERROR_CATEGORY, &format!("{function}: {message}"));
        std::ptr::null_mut()
    }
}

/// The declared category of this name.
fn known(name: &str) -> Result<&'static CStr, Fault> {
    let names = LOG_CATEGORIES.map(|(name, _)| name);
    names.into_iter().find(|known| known.to_bytes() == name.as_bytes()).ok_or_else(|| Fault::LogCategory {
        name: name.into(),
        declared: names.map(CStr::to_string_lossy).join(", "),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The example of FMI 3.0, 2.3.1, and its other cases.
    #[test]
    fn categories_are_switched_on_and_off() {
        let mut log = Log::new(std::ptr::null_mut(), Callback::Fmi3(None));
        let mut after = |on, names: &[&str]| {
            let names: Vec<_> = names.iter().map(ToString::to_string).collect();
            log.choose(on, &names).map(|()| log.categories.as_ref().map(Vec::len))
        };
        assert_eq!(after(false, &[]), Ok(Some(0)));
        assert_eq!(after(true, &["logStatusFatal"]), Ok(Some(1)));
        assert_eq!(after(true, &["logStatusError"]), Ok(Some(2)));
        assert_eq!(after(false, &["logStatusFatal"]), Ok(Some(1)));
        assert_eq!(after(true, &[]), Ok(None));
        assert_eq!(after(false, &["logStatusFatal"]), Ok(Some(LOG_CATEGORIES.len() - 1)));
        let message = after(true, &["logAll"]).map_err(|fault| fault.to_string());
        assert!(
            message.is_err_and(|text| text.starts_with("\"logAll\" is no log category; declared: logStatus"))
        );
    }
}
