//! Limits of both links.

/// Version of the links in this program.
pub const VERSION: u64 = 1;
/// Longest line, with its LF \[bytes\]. A CR before the LF does not count.
pub const MAX_LINE: usize = 128;
/// Shortest validity of a line \[ms\].
pub const MIN_VALID_MS: u64 = 100;
/// Longest validity of a line \[ms\].
pub const MAX_VALID_MS: u64 = 1000;
/// Number of malformed lines in a row after which a connection is ended.
pub const MAX_BAD_LINES: u32 = 3;
