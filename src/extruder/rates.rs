//! Several independent rates in one loop.

use crate::core::{Span, Stamp};

/// A task at a fixed rate. Missed times are skipped.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rate {
    period: Span,
    next: Option<Stamp>,
}

impl Rate {
    /// Every `period`; a period that is not positive is due at every call.
    pub const fn every(period: Span) -> Self {
        Self { period, next: None }
    }

    /// Begins its grid anew: it is due at the next call.
    pub const fn restart(&mut self) {
        self.next = None;
    }

    /// Whether it is due at `now`; the first call is, and sets the grid.
    pub fn due(&mut self, now: Stamp) -> bool {
        let Some(next) = self.next else {
            self.next = Some(now + self.period);
            return true;
        };
        if now < next {
            return false;
        }
        let period = self.period.ns().max(1);
        let missed = (now - next).ns() / period;
        self.next = Some(next + Span::from_ns(period.saturating_mul(missed.saturating_add(1))));
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hz(hz: f64) -> Rate {
        Rate::every(Span::from_secs(1.0 / hz))
    }

    #[test]
    fn rates_keep_their_own_grids() {
        let (mut fast, mut slow) = (hz(200.0), hz(20.0));
        let (mut many, mut few) = (0, 0);
        for tick in 0..1000_u32 {
            let now = Stamp::from_secs(f64::from(tick) * 0.001);
            many += u32::from(fast.due(now));
            few += u32::from(slow.due(now));
        }
        assert_eq!((many, few), (200, 20));
    }

    #[test]
    fn missed_times_are_skipped() {
        let mut rate = hz(10.0);
        assert!(rate.due(Stamp::START));
        assert!(!rate.due(Stamp::from_secs(0.09)));
        assert!(rate.due(Stamp::from_secs(0.55)));
        assert!(!rate.due(Stamp::from_secs(0.56)));
        assert!(rate.due(Stamp::from_secs(0.60)));
    }
}
