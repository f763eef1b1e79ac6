//! What a command prints: results on standard output, all else on standard error.

use std::io::Write as _;

/// Writes a line to standard output. One that nobody reads any more is no reason to
/// end: a run goes on when the pipe behind it is closed.
macro_rules! say {
    () => { say!("") };
    ($($text:tt)*) => {{
        use std::io::Write;
        _ = writeln!(std::io::stdout(), $($text)*);
    }};
}

/// Writes a line to standard error. Where nobody can be told, the work still goes on.
macro_rules! tell {
    ($($text:tt)*) => {{
        use std::io::Write;
        _ = writeln!(std::io::stderr(), $($text)*);
    }};
}

/// Adds a line to a text, which cannot fail.
macro_rules! line {
    ($out:ident $(, $($part:tt)*)?) => {{
        let _ = writeln!($out $(, $($part)*)?);
    }};
}

/// Writes to standard output. A reader that has gone away, such as `head`, is no
/// reason to stop.
pub fn print(text: &str) {
    let _ = std::io::stdout().write_all(text.as_bytes());
}

/// How much a command says on standard error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Verbosity {
    /// Nothing but errors.
    pub quiet: bool,
}

/// Prints warnings about a cell; nothing of them keeps it from running.
pub fn warn(warnings: &[String]) {
    for warning in warnings {
        tell!("warning: {warning}");
    }
}
