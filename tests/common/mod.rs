//! The program as a user calls it.

use assert_cmd::Command;

/// The program with arguments.
pub fn truebead(args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_truebead"));
    command.args(args);
    command
}

/// What it says where it ends with this status: its answer, or why there is none.
pub fn said(command: &mut Command, code: i32) -> String {
    let run = command.assert().code(code);
    let output = run.get_output();
    let text = if code == 0 { &output.stdout } else { &output.stderr };
    String::from_utf8_lossy(text).into_owned()
}
