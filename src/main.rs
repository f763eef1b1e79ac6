//! The program.

use std::process::ExitCode;

fn main() -> ExitCode {
    truebead::cli::main()
}
