//! Splits a stream of bytes into lines.

use super::limits::{MAX_BAD_LINES, MAX_LINE};

/// Bytes that cannot be a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum LineFault {
    /// No LF within the longest line.
    #[error("a line is longer than {MAX_LINE} bytes")]
    TooLong,
    /// A byte above 127.
    #[error("a line holds bytes that are not ASCII")]
    NotAscii,
}

/// Splits a stream of bytes into lines. It buffers at most one line, and after a fault drops
/// everything up to the next LF. A fault is reported immediately, once per line.
#[derive(Debug, Clone, Default)]
pub struct LineSplitter {
    line: String,
    skipping: bool,
}

impl LineSplitter {
    /// A splitter with an empty buffer.
    pub fn new() -> Self {
        Self::default()
    }

    /// Takes bytes and returns the lines that they complete, in order. Lines come without LF, and
    /// without a CR before it.
    pub fn push(&mut self, bytes: &[u8]) -> Vec<Result<String, LineFault>> {
        bytes.iter().filter_map(|&byte| self.byte(byte)).collect()
    }

    fn byte(&mut self, byte: u8) -> Option<Result<String, LineFault>> {
        if byte == b'\n' {
            let mut line = std::mem::take(&mut self.line);
            if std::mem::take(&mut self.skipping) {
                return None;
            }
            if line.ends_with('\r') {
                line.pop();
            }
            return Some(Ok(line));
        }
        if self.skipping {
            return None;
        }
        if !byte.is_ascii() {
            return Some(Err(self.skip(LineFault::NotAscii)));
        }
        // One byte beyond the longest line may still be the CR before its LF.
        let full = self.line.len() + 1 >= MAX_LINE;
        if full && (byte != b'\r' || self.line.ends_with('\r')) {
            return Some(Err(self.skip(LineFault::TooLong)));
        }
        self.line.push(char::from(byte));
        None
    }

    fn skip(&mut self, fault: LineFault) -> LineFault {
        self.line.clear();
        self.skipping = true;
        fault
    }
}

/// Counts malformed lines in a row.
#[derive(Debug, Clone, Copy, Default)]
pub struct BadLines {
    in_a_row: u32,
}

impl BadLines {
    /// A line had the right form, even if it is then refused.
    pub fn good(&mut self) {
        self.in_a_row = 0;
    }

    /// A line was malformed. Returns `true` if the connection must be ended.
    #[must_use]
    pub fn bad(&mut self) -> bool {
        self.in_a_row = self.in_a_row.saturating_add(1);
        self.in_a_row >= MAX_BAD_LINES
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    type Piece = Result<String, LineFault>;

    #[expect(clippy::unnecessary_wraps, reason = "it stands beside faults")]
    fn text(line: &str) -> Piece {
        Piece::Ok(line.to_owned())
    }

    #[test]
    fn a_cr_before_the_lf_is_ignored_and_no_other() {
        let mut splitter = LineSplitter::new();
        assert_eq!(
            splitter.push(b"BYE\r\nSTOP\r 1\nx\r\r\n"),
            [text("BYE"), text("STOP\r 1"), text("x\r")]
        );
    }

    #[test]
    fn the_longest_line_passes_and_one_byte_more_does_not() {
        let longest = "x".repeat(MAX_LINE - 1);
        let mut splitter = LineSplitter::new();
        assert_eq!(splitter.push(format!("{longest}\n").as_bytes()), [text(&longest)]);
        assert_eq!(splitter.push(format!("{longest}\r\n").as_bytes()), [text(&longest)]);
        let over = splitter.push(format!("{longest}x\nBYE\n").as_bytes());
        assert_eq!(over, [Err(LineFault::TooLong), text("BYE")]);
        let over = splitter.push(format!("{longest}\rx\nBYE\n").as_bytes());
        assert_eq!(over, [Err(LineFault::TooLong), text("BYE")]);
    }

    #[test]
    fn after_a_fault_the_next_lf_brings_order() {
        let mut splitter = LineSplitter::new();
        let found = splitter.push(b"SP\xc3\xa9ED\xff 1\nBYE\n");
        assert_eq!(found, [Err(LineFault::NotAscii), text("BYE")]);
    }

    #[test]
    fn an_endless_line_takes_no_memory() {
        let mut splitter = LineSplitter::new();
        assert_eq!(splitter.push("a".repeat(100_000).as_bytes()), [Err(LineFault::TooLong)]);
        assert!(splitter.line.capacity() <= 2 * MAX_LINE);
    }

    #[test]
    fn the_third_bad_line_in_a_row_is_one_too_many() {
        let mut lines = BadLines::default();
        assert!(!lines.bad() && !lines.bad());
        lines.good();
        assert!(!lines.bad() && !lines.bad() && lines.bad());
    }

    proptest! {
        #[test]
        fn it_does_not_matter_how_bytes_are_cut(
            bytes in prop::collection::vec(prop_oneof![
                5 => 32_u8..127, 1 => Just(b'\n'), 1 => Just(b'\r'), 1 => any::<u8>(),
            ], 0..600),
            cuts in prop::collection::vec(1_usize..40, 1..60),
        ) {
            let whole = LineSplitter::new().push(&bytes);
            let mut splitter = LineSplitter::new();
            let mut pieces = Vec::new();
            let (mut rest, mut cuts) = (&bytes[..], cuts.iter().cycle());
            while !rest.is_empty() {
                let (piece, after) = rest.split_at(rest.len().min(*cuts.next().unwrap()));
                pieces.extend(splitter.push(piece));
                rest = after;
            }
            prop_assert_eq!(&whole, &pieces);
            for line in whole.into_iter().flatten() {
                prop_assert!(line.len() < MAX_LINE && line.is_ascii());
            }
        }
    }
}
