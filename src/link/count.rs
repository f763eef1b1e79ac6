//! What every controller at the other end of a link checks of a line before it
//! looks at what it says: that the connection was greeted, that no line was
//! lost, and that the line is not void.

use super::{ErrCode, MAX_VALID_MS, MIN_VALID_MS};

/// Why a line is refused: the code and a text for the operator.
pub type Refusal = (ErrCode, String);

/// The lines of a connection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Count {
    greeted: bool,
    expected: u64,
    applied: u64,
}

impl Count {
    /// Of a connection that nothing has come over.
    pub const fn new() -> Self {
        Self { greeted: false, expected: 1, applied: 0 }
    }

    /// `HELLO` came.
    pub const fn greet(&mut self) {
        self.greeted = true;
    }

    /// The connection is gone.
    pub const fn leave(&mut self) {
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
    pub fn check(&mut self, seq: u64) -> Result<(), Refusal> {
        if !self.greeted {
            return Err((ErrCode::Form, "HELLO must come first".to_owned()));
        }
        let expected = self.expected;
        self.expected = expected.max(seq.saturating_add(1));
        if seq == expected {
            return Ok(());
        }
        Err((ErrCode::Sequence, format!("expected {expected}")))
    }
}

/// A controller's clock, and what messages call the controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Clock {
    /// `robot` or `extruder`.
    pub of: &'static str,
    /// What it shows \[ms\].
    pub t_ms: u64,
}

impl Clock {
    /// When a line is void that holds for `valid_ms` after `ref_t_ms`, if it is
    /// not already \[ms\].
    pub fn void_ms(self, valid_ms: u64, ref_t_ms: u64) -> Result<u64, Refusal> {
        let Self { of, t_ms } = self;
        if !(MIN_VALID_MS..=MAX_VALID_MS).contains(&valid_ms) {
            let text =
                format!("valid_ms {valid_ms} is not within {MIN_VALID_MS} to {MAX_VALID_MS}");
            return Err((ErrCode::Range, text));
        }
        if ref_t_ms > t_ms {
            let text = format!("ref_t_ms {ref_t_ms} lies ahead of the {of}'s {t_ms}");
            return Err((ErrCode::Range, text));
        }
        let void_ms = ref_t_ms.saturating_add(valid_ms);
        if void_ms <= t_ms {
            return Err((ErrCode::Stale, format!("void since {} ms", t_ms - void_ms)));
        }
        Ok(void_ms)
    }
}
