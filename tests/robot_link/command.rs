//! `truebead sim robot` as it is typed.

use std::io::{BufRead, BufReader, Read};
use std::process::{Command, Stdio};

use crate::support::{Talk, listener};

const PROGRAM: &str = env!("CARGO_BIN_EXE_truebead");

#[test]
fn it_says_where_it_listens_what_happens_and_ends_in_order() {
    let mut command = Command::new(PROGRAM);
    command.args(["sim", "robot", "--listen", "127.0.0.1:0", "--pause-s", "0", "--name", "tx"]);
    let mut robot = command.stderr(Stdio::piped()).spawn().unwrap();
    let mut printed = BufReader::new(robot.stderr.take().unwrap());
    let mut line = String::new();
    printed.read_line(&mut line).unwrap();
    let address = line.split_whitespace().find_map(|word| word.trim_end_matches(';').parse().ok());
    let mut pc = Talk::call(address.expect("the first line names the address"));
    pc.say("HELLO 1 me\n");
    assert_eq!(pc.hear().as_deref(), Some("HELLO 1 tx 60 150 60"));
    while !pc.hear_one("STATE").contains(" PRINT ") {}
    // The shell's own kill: a small system has no program of that name.
    let line = format!("kill -TERM {}", robot.id());
    let killed = Command::new("sh").args(["-c", &line]).status().unwrap();
    assert!(killed.success());
    assert_eq!(robot.wait().unwrap().code(), Some(0));
    let mut rest = String::new();
    printed.read_to_string(&mut rest).unwrap();
    for wanted in ["PC connected from 127.0.0.1", "IDLE -> PRINT", "ended"] {
        assert!(rest.contains(wanted), "{rest}");
    }
}

#[test]
fn what_cannot_be_is_refused_with_status_2_and_a_taken_address_with_1() {
    let run = |args: &[&str]| {
        let output = Command::new(PROGRAM).args(["sim", "robot"]).args(args).output().unwrap();
        (output.status.code(), String::from_utf8(output.stderr).unwrap())
    };
    let (status, printed) = run(&["--listen", "127.0.0.1:0", "--start", "200"]);
    assert_eq!(status, Some(2));
    assert!(printed.contains("the start speed must be within 60 mm/s to 150 mm/s, found 200 mm/s"));
    assert_eq!(run(&["--min", "nan"]).0, Some(2));
    assert_eq!(run(&["--state-ms", "5"]).0, Some(2));
    let taken = listener();
    let (status, printed) = run(&["--listen", &taken.local_addr().unwrap().to_string()]);
    assert_eq!(status, Some(1));
    assert!(printed.contains("name a free address with --listen"), "{printed}");
}
