//! Checks that a robot or an extruder makes before it uses a line from the PC: that `HELLO` came
//! before it, that no line was lost, and that the line has not expired.

use super::limits::{MAX_VALID_MS, MIN_VALID_MS};
use super::refusal::{ErrCode, LineRefusal};
use crate::core::Stamp;

const NS_PER_MS: u64 = 1_000_000;

/// Sequence numbers of the lines on a connection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sequence {
    greeted: bool,
    expected: u64,
    applied: u64,
}

impl Default for Sequence {
    fn default() -> Self {
        Self::new()
    }
}

impl Sequence {
    /// A new connection without a line.
    pub const fn new() -> Self {
        Self { greeted: false, expected: 1, applied: 0 }
    }

    /// `HELLO` has arrived.
    pub const fn greet(&mut self) {
        self.greeted = true;
    }

    /// The connection has ended.
    pub const fn disconnect(&mut self) {
        self.greeted = false;
    }

    /// Whether `HELLO` has arrived.
    pub const fn greeted(&self) -> bool {
        self.greeted
    }

    /// The line with this number was applied.
    pub const fn apply(&mut self, seq: u64) {
        self.applied = seq;
    }

    /// Number of the last applied line; 0 for none.
    pub const fn applied(&self) -> u64 {
        self.applied
    }

    /// Counts a line. It is refused before `HELLO`, and if its number is not the expected one;
    /// the count continues from it even then, so that after a lost line one more is refused and
    /// not all that follow.
    pub fn count(&mut self, seq: u64) -> Result<(), LineRefusal> {
        if !self.greeted {
            return Err(LineRefusal::new(ErrCode::Form, "HELLO must come first"));
        }
        let expected = self.expected;
        self.expected = expected.max(seq.saturating_add(1));
        if seq == expected {
            return Ok(());
        }
        Err(LineRefusal::new(ErrCode::Sequence, format!("expected {expected}")))
    }
}

/// Time for which a line is valid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Validity {
    /// Time after `ref_t_ms` at which the line expires \[ms\].
    pub valid_ms: u64,
    /// `t_ms` of the newest `STATE` that the PC has received.
    pub ref_t_ms: u64,
}

/// A device's own clock; it is independent of the PC's clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DeviceClock {
    /// Name of the device in messages: `robot` or `extruder`.
    pub device: &'static str,
    /// Its reading at stamp 0 \[ms\].
    pub start_ms: u64,
}

impl DeviceClock {
    /// Its reading at a stamp \[ms\].
    pub const fn ms(self, at: Stamp) -> u64 {
        self.start_ms.saturating_add(at.ns() / NS_PER_MS)
    }

    /// Time at which a line that arrives now expires; fails if it already has, or if its times are
    /// not valid.
    pub fn void_at(self, now: Stamp, validity: Validity) -> Result<Stamp, LineRefusal> {
        let Self { device: of, start_ms } = self;
        let Validity { valid_ms, ref_t_ms } = validity;
        let t_ms = self.ms(now);
        if !(MIN_VALID_MS..=MAX_VALID_MS).contains(&valid_ms) {
            let text =
                format!("valid_ms {valid_ms} is not within {MIN_VALID_MS} to {MAX_VALID_MS}");
            return Err(LineRefusal::new(ErrCode::Range, text));
        }
        if ref_t_ms > t_ms {
            let text = format!("ref_t_ms {ref_t_ms} lies ahead of the {of}'s {t_ms}");
            return Err(LineRefusal::new(ErrCode::Range, text));
        }
        let void_ms = ref_t_ms.saturating_add(valid_ms);
        if void_ms <= t_ms {
            return Err(LineRefusal::new(
                ErrCode::Stale,
                format!("void since {} ms", t_ms - void_ms),
            ));
        }
        let since_start_ms = void_ms.saturating_sub(start_ms);
        Ok(Stamp::from_ns(since_start_ms.saturating_mul(NS_PER_MS)))
    }
}
