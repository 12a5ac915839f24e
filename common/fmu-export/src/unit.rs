//! Unit names as exponents of the SI base units.

/// Exponents of kg, m, s, A, K, rad.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct BaseUnit {
    exponents: [i32; 6],
}

const BASE: [&str; 6] = ["kg", "m", "s", "A", "K", "rad"];

/// Named units and their base exponents.
const NAMED: [(&str, [i32; 6]); 13] = [
    ("kg", [1, 0, 0, 0, 0, 0]),
    ("m", [0, 1, 0, 0, 0, 0]),
    ("s", [0, 0, 1, 0, 0, 0]),
    ("A", [0, 0, 0, 1, 0, 0]),
    ("K", [0, 0, 0, 0, 1, 0]),
    ("rad", [0, 0, 0, 0, 0, 1]),
    ("1", [0; 6]),
    ("Hz", [0, 0, -1, 0, 0, 0]),
    ("N", [1, 1, -2, 0, 0, 0]),
    ("Pa", [1, -1, -2, 0, 0, 0]),
    ("J", [1, 2, -2, 0, 0, 0]),
    ("W", [1, 2, -3, 0, 0, 0]),
    ("V", [1, 2, -3, -1, 0, 0]),
];

impl BaseUnit {
    /// Parse a unit such as `N.s/m` or `kg.m2`: factors joined by dots, one slash, exponents as
    /// digits; `None` if a factor is unknown.
    pub(crate) fn parse(unit: &str) -> Option<Self> {
        let mut sum = Self::default();
        let (above, below) = unit.split_once('/').unwrap_or((unit, ""));
        for (factors, sign) in [(above, 1), (below, -1)] {
            for factor in factors.split('.').filter(|f| !f.is_empty()) {
                let (exponents, power) = factor_of(factor)?;
                for (total, e) in sum.exponents.iter_mut().zip(exponents) {
                    *total += sign * power * e;
                }
            }
        }
        Some(sum)
    }

    /// Attributes of the `BaseUnit` element: the exponents that are not zero.
    pub(crate) fn attributes(&self) -> impl Iterator<Item = (&'static str, String)> {
        BASE.into_iter().zip(self.exponents).filter(|(_, e)| *e != 0).map(|(name, e)| (name, e.to_string()))
    }
}

/// A factor such as `m2`: base exponents and power.
fn factor_of(factor: &str) -> Option<([i32; 6], i32)> {
    let named = |name: &str| NAMED.iter().find(|(n, _)| *n == name).map(|(_, e)| *e);
    if let Some(exponents) = named(factor) {
        return Some((exponents, 1));
    }
    let digits = factor.find(|c: char| c.is_ascii_digit())?;
    let (name, power) = factor.split_at(digits);
    Some((named(name)?, power.parse().ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn exponents(unit: &str) -> Vec<(&'static str, String)> {
        BaseUnit::parse(unit).expect("known unit").attributes().collect()
    }

    #[test]
    fn products_and_quotients_become_base_exponents() {
        let pairs =
            |p: &[(&'static str, i32)]| p.iter().map(|(n, e)| (*n, e.to_string())).collect::<Vec<_>>();
        assert_eq!(exponents("N.s/m"), pairs(&[("kg", 1), ("s", -1)]));
        assert_eq!(exponents("kg.m2"), pairs(&[("kg", 1), ("m", 2)]));
        assert_eq!(exponents("rad/s"), pairs(&[("s", -1), ("rad", 1)]));
        assert_eq!(exponents("1/s"), pairs(&[("s", -1)]));
        assert_eq!(exponents("m/s2"), pairs(&[("m", 1), ("s", -2)]));
        assert!(BaseUnit::parse("furlong").is_none());
    }
}
