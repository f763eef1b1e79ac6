//! What every controller at the other end of a link checks of a line before it
//! looks at what it says: that the connection was greeted, that no line was
//! lost, and that the line is not void.

use super::limits::{MAX_VALID_MS, MIN_VALID_MS};
use super::refusal::{ErrCode, LineRefusal};
use crate::core::Stamp;

const NS_PER_MS: u64 = 1_000_000;

/// The lines of a connection.
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
    /// Of a connection that nothing has come over.
    pub const fn new() -> Self {
        Self { greeted: false, expected: 1, applied: 0 }
    }

    /// `HELLO` came.
    pub const fn greet(&mut self) {
        self.greeted = true;
    }

    /// The connection is gone.
    pub const fn disconnect(&mut self) {
        self.greeted = false;
    }

    /// Whether `HELLO` came.
    pub const fn greeted(&self) -> bool {
        self.greeted
    }

    /// A line was applied.
    pub const fn apply(&mut self, seq: u64) {
        self.applied = seq;
    }

    /// Number of the last line that was applied; 0 where there is none.
    pub const fn applied(&self) -> u64 {
        self.applied
    }

    /// Takes a line's number. After a gap the count goes on from what came, so
    /// that one lost line costs one refusal and not the connection.
    pub fn check(&mut self, seq: u64) -> Result<(), LineRefusal> {
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

/// For how long a line holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Validity {
    /// How long after `ref_t_ms` the line is void \[ms\].
    pub valid_ms: u64,
    /// `t_ms` of the newest `STATE` that the PC has seen.
    pub ref_t_ms: u64,
}

/// A device's own clock, which has nothing to do with the PC's.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DeviceClock {
    /// What messages call the device: `robot` or `extruder`.
    pub device: &'static str,
    /// What it shows at stamp 0 \[ms\].
    pub start_ms: u64,
}

impl DeviceClock {
    /// What it shows \[ms\].
    pub const fn ms(self, at: Stamp) -> u64 {
        self.start_ms.saturating_add(at.ns() / NS_PER_MS)
    }

    /// When a line is void that arrives now, if it is not already.
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
