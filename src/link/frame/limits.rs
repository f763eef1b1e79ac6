//! Numbers that both links keep to.

/// Version of the links that is spoken here.
pub const VERSION: u64 = 1;
/// Longest line, with its LF \[bytes\]. A CR before the LF does not count.
pub const MAX_LINE: usize = 128;
/// Shortest time for which a line may be valid \[ms\].
pub const MIN_VALID_MS: u64 = 100;
/// Longest time for which a line may be valid \[ms\].
pub const MAX_VALID_MS: u64 = 1000;
/// Lines in a row that make no sense after which a connection is ended.
pub const MAX_BAD_LINES: u32 = 3;
