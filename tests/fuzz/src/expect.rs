//! Which statuses are right, and what a refusal has to say.

use fmi_capi::{DISCARD, ERROR, Message, OK, Status, status_name};

/// A reason to refuse a call, and what the message about it has to contain.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Offence {
    pub(crate) status: Status,
    /// Words of the message
    pub(crate) words: Vec<String>,
    /// Numbers of the message
    pub(crate) numbers: Vec<f64>,
}

impl Offence {
    pub(crate) fn error(words: Vec<String>) -> Self {
        Self { status: ERROR, words, numbers: Vec::new() }
    }

    pub(crate) fn discard(words: Vec<String>, numbers: Vec<f64>) -> Self {
        Self { status: DISCARD, words, numbers }
    }
}

/// The right statuses of a call.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Expected {
    statuses: u8,
    /// What may be complained about; empty: the message is free
    pub(crate) offences: Vec<Offence>,
}

impl Expected {
    pub(crate) fn ok() -> Self {
        Self { statuses: 0, offences: Vec::new() }.or(OK)
    }

    pub(crate) fn error() -> Self {
        Self { statuses: 0, offences: Vec::new() }.or(ERROR)
    }

    pub(crate) fn discard() -> Self {
        Self { statuses: 0, offences: Vec::new() }.or(DISCARD)
    }

    /// This status is right too.
    pub(crate) fn or(mut self, status: Status) -> Self {
        self.statuses |= 1 << status;
        self
    }

    /// Only what the offences ask for is right, if there are any.
    pub(crate) fn unless(self, offences: Vec<Offence>) -> Self {
        if offences.is_empty() {
            return self;
        }
        let none = Self { statuses: 0, offences: Vec::new() };
        let statuses = offences.iter().fold(none, |all, offence| all.or(offence.status)).statuses;
        Self { statuses, offences }
    }

    pub(crate) fn allows(&self, status: Status) -> bool {
        (0..8).contains(&status) && self.statuses & (1 << status) != 0
    }
}

impl std::fmt::Display for Expected {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let names: Vec<_> = (0..8).filter(|s| self.allows(*s)).map(status_name).collect();
        f.write_str(&names.join(" or "))
    }
}

/// All numbers in a text.
fn numbers(text: &str) -> Vec<f64> {
    text.split(|c: char| !(c.is_ascii_alphanumeric() || "+-.".contains(c)))
        .filter_map(|word| word.trim_end_matches('.').parse().ok())
        .collect()
}

fn says(text: &str, offence: &Offence) -> bool {
    let found = numbers(text);
    let same =
        |a: f64, b: f64| a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan() || (a - b).abs() <= 0.0;
    offence.words.iter().all(|word| text.contains(word.as_str()))
        && offence.numbers.iter().all(|n| found.iter().any(|f| same(*f, *n)))
}

/// Every refusal is explained, and names what it is about.
pub(crate) fn check_message(
    status: Status,
    categories: Option<&[String]>,
    messages: &[Message],
    offences: &[Offence],
) -> Result<(), String> {
    if categories.is_some_and(|chosen| !chosen.iter().any(|c| c.contains(status_name(status)))) {
        return Ok(());
    }
    let texts: Vec<_> = messages.iter().filter(|m| m.status == status).map(|m| m.text.as_str()).collect();
    if texts.iter().all(|text| text.is_empty()) {
        return Err(format!("{} without a message", status_name(status)));
    }
    let mut offences = offences.iter().filter(|o| o.status == status).peekable();
    if offences.peek().is_none() || offences.any(|o| texts.iter().any(|text| says(text, o))) {
        return Ok(());
    }
    Err(format!("the message does not name variable, value and allowed range: {texts:?}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_found_in_messages() {
        assert_eq!(numbers("a.b = -1e-3 is refused; allowed: 0 .. 5.")[..2], [-1e-3, 0.0]);
        assert!(numbers("x = NaN is refused")[0].is_nan());
        assert_eq!(numbers("stays -inf."), [f64::NEG_INFINITY]);
    }

    #[test]
    fn a_message_has_to_name_variable_value_and_range() {
        let offence = Offence::discard(vec!["mass".into()], vec![-1.0, 0.0]);
        let message = |text: &str| Message { status: DISCARD, category: String::new(), text: text.into() };
        let check = |text| check_message(DISCARD, None, &[message(text)], std::slice::from_ref(&offence));
        assert_eq!(check("mass = -1 is refused; allowed: > 0 kg"), Ok(()));
        assert!(check("mass = -1 is refused").is_err());
        assert!(check("value -1, allowed: > 0").is_err());
        assert!(check("").is_err());
        let wrong = Message { status: ERROR, ..message("mass -1 0") };
        assert!(check_message(DISCARD, None, &[wrong], &[]).is_err());
    }

    #[test]
    fn offences_decide_the_status() {
        let expected = Expected::ok().unless(vec![Offence::discard(Vec::new(), Vec::new())]);
        assert!(expected.allows(DISCARD) && !expected.allows(OK) && !expected.allows(ERROR));
        assert!(Expected::ok().unless(Vec::new()).allows(OK));
        assert!(!Expected::ok().allows(4) && !Expected::error().allows(-1));
    }
}
