//! The PC's first and last line to a device, on either link.

use super::fields::{LineError, LineFields};
use super::limits::VERSION;

/// The last line of a connection that ends orderly.
pub const BYE_LINE: &str = "BYE\n";

/// The first line on every connection.
pub fn hello_line() -> String {
    format!("HELLO {VERSION} truebead\n")
}

/// Reads the fields of `HELLO` and returns `line`; the name in it may be any word.
pub fn read_hello<T>(mut fields: LineFields<'_>, line: T) -> Result<T, LineError> {
    fields.version()?;
    fields.word("name")?;
    fields.end(line)
}
