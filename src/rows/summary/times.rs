//! Time for each state, limit or reason.

use std::collections::BTreeMap;

use crate::core::Span;

/// Times by name, summed exactly.
#[derive(Debug, Clone, Default)]
pub struct Times(BTreeMap<&'static str, Span>);

impl Times {
    /// Adds a time to a name.
    pub fn add(&mut self, name: &'static str, span: Span) {
        let sum = self.0.entry(name).or_default();
        *sum = *sum + span;
    }

    /// All times \[s\].
    pub fn seconds(&self) -> BTreeMap<&'static str, f64> {
        self.0.iter().map(|(name, span)| (*name, span.secs())).collect()
    }

    /// The sum of all times \[s\].
    pub fn total_s(&self) -> f64 {
        self.0.values().fold(Span::ZERO, |sum, span| sum + *span).secs()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_a_name_are_summed_without_rounding() {
        let mut times = Times::default();
        for _ in 0..10 {
            times.add("a", Span::from_secs(0.1));
        }
        times.add("b", Span::from_secs(2.0));
        assert_eq!(times.seconds(), BTreeMap::from([("a", 1.0), ("b", 2.0)]));
        assert_eq!(times.total_s(), 3.0);
    }
}
