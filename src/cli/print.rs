//! Output of commands: results on standard output, all other messages on standard error.

use std::io::Write as _;

/// Writes a line to standard output. A closed pipe does not stop the program: a run continues.
macro_rules! say {
    () => { say!("") };
    ($($text:tt)*) => {{
        use std::io::Write;
        _ = writeln!(std::io::stdout(), $($text)*);
    }};
}

/// Writes a line to standard error. A closed standard error does not stop the program.
macro_rules! tell {
    ($($text:tt)*) => {{
        use std::io::Write;
        _ = writeln!(std::io::stderr(), $($text)*);
    }};
}

/// An error for wrong arguments, with a message as for `format!`.
macro_rules! wrong {
    ($($text:tt)*) => { $crate::cli::arguments::WrongArguments::new(format_args!($($text)*)) };
}

/// Returns an error for wrong arguments.
macro_rules! refuse {
    ($($text:tt)*) => { return Err(wrong!($($text)*).into()) };
}

/// Adds a line to a text, which cannot fail.
macro_rules! line {
    ($out:ident $(, $($part:tt)*)?) => {{
        let _ = writeln!($out $(, $($part)*)?);
    }};
}

/// Writes to standard output. A reader that has ended, such as `head`, does not stop the program.
pub fn print(text: &str) {
    let _ = std::io::stdout().write_all(text.as_bytes());
}

/// How much a command prints on standard error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Verbosity {
    /// Whether only errors are printed.
    pub quiet: bool,
}

/// Prints warnings about a cell.
pub fn warn(warnings: &[String]) {
    for warning in warnings {
        tell!("warning: {warning}");
    }
}
