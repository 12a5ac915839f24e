//! A whole sequence: every answer is judged, then the sequence is repeated without some of its calls.
//!
//! - Without the calls that were refused: every other answer must be the same to the bit. So a refusal changed nothing,
//!   neither what can be read nor what happens later.
//! - Without the calls that only read: the others must answer the same. So nothing depends on what was read before; only
//!   the sign of a zero may (`0 u` is -0 for u < 0, and an input without influence makes nothing stale).

use crate::call::Call;
use crate::machine::{Fmu, Machine, Record, Violation};

/// The first violation of a sequence.
pub(crate) fn check(fmu: &Fmu, calls: &[Call], observe: bool) -> Result<Counts, Violation> {
    let records = Machine::run(fmu, calls, observe, |_| true)?;
    let refused = |i: usize| records[i].as_ref().is_some_and(Record::refused);
    let repeated = Machine::run(fmu, calls, observe, |i| !refused(i))?;
    compare(&records, &repeated, "without the refused calls", |a, b| a == b)?;
    let silent = Machine::run(fmu, calls, false, |i| !calls[i].action.reads())?;
    let alike = |a: u64, b: u64| a == b || (a | b) << 1 == 0;
    compare(&records, &silent, "without the calls that only read", alike)?;
    let refusals = (0..calls.len()).filter(|i| refused(*i)).count();
    Ok(Counts { calls: calls.len(), refused: refusals })
}

/// Numbers of calls.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Counts {
    pub(crate) calls: usize,
    pub(crate) refused: usize,
}

/// Calls that were made in both runs must have the same status and give `alike` values.
fn compare(
    first: &[Option<Record>],
    second: &[Option<Record>],
    how: &str,
    alike: impl Fn(u64, u64) -> bool,
) -> Result<(), Violation> {
    for (call, pair) in first.iter().zip(second).enumerate() {
        if let (Some(a), Some(b)) = pair
            && !(a.status == b.status
                && a.data.len() == b.data.len()
                && a.data.iter().zip(&b.data).all(|(a, b)| alike(*a, *b)))
        {
            let items = a.data.iter().zip(&b.data).enumerate().filter(|(_, (a, b))| a != b);
            let items: Vec<_> = items
                .map(|(i, (a, b))| format!("item {i}: {:?} and {:?}", f64::from_bits(*a), f64::from_bits(*b)))
                .take(4)
                .collect();
            let text =
                format!("another answer {how}: status {} and {}, {}", a.status, b.status, items.join(", "));
            return Err(Violation { call, text });
        }
    }
    Ok(())
}

/// The calls that a failure needs: whatever can be left out is left out, larger parts first.
pub(crate) fn minimise(n: usize, mut fails: impl FnMut(&[usize]) -> bool) -> Vec<usize> {
    let mut kept: Vec<usize> = (0..n).collect();
    let mut part = n.div_ceil(2);
    while part > 0 {
        let mut at = 0;
        while at < kept.len() {
            let fewer: Vec<_> = kept
                .iter()
                .enumerate()
                .filter(|(i, _)| !(at..at + part).contains(i))
                .map(|(_, c)| *c)
                .collect();
            if fails(&fewer) {
                kept = fewer;
            } else {
                at += part;
            }
        }
        part /= 2;
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_failure_does_not_need_is_left_out() {
        let needed = [3, 11, 12];
        let fails = |kept: &[usize]| needed.iter().all(|n| kept.contains(n));
        assert_eq!(minimise(40, fails), needed);
        assert!(minimise(5, |_| true).is_empty());
    }

    #[test]
    fn other_answers_are_noticed() {
        let record = |status, data| Some(Record { status, data });
        let first = [record(0, vec![1]), record(0, vec![2])];
        let same = |second: [Option<Record>; 2]| compare(&first, &second, "", |a, b| a == b).is_ok();
        assert!(same([None, record(0, vec![2])]));
        assert!(!same([None, record(0, vec![3])]));
        assert!(!same([record(2, vec![1]), None]));
        assert!(!same([record(0, vec![1, 1]), None]));
    }
}
