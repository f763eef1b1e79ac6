//! Lines from the PC to the extruder.

use super::numbers::{NUMBERS, switch};
use crate::extruder::ExtruderCommand;
use crate::link::frame::{BYE_LINE, LineError, LineFields, hello_line, read_hello};

const KEYWORDS: [&str; 3] = ["HELLO", "DRIVE", "BYE"];

/// A line from the PC to the extruder.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DriveLine {
    /// First line on every connection.
    Hello,
    /// Command.
    Drive {
        /// Counts up by one from 1 on each connection.
        seq: u64,
        /// Setpoint, pump and valve; the setpoint in the unit of the extruder's `HELLO`.
        command: ExtruderCommand,
        /// Time after `ref_t_ms` at which the command expires \[ms\].
        valid_ms: u64,
        /// `t_ms` of the newest `STATE` that the PC has received.
        ref_t_ms: u64,
    },
    /// Orderly end of the connection.
    Bye,
}

impl DriveLine {
    /// Reads a line without its LF. The name after `HELLO 1` may be any word.
    pub fn parse(text: &str) -> Result<Self, LineError> {
        let fields = LineFields::open(text, &KEYWORDS, "HELLO, DRIVE or BYE")?;
        match fields.keyword() {
            "HELLO" => read_hello(fields, Self::Hello),
            "DRIVE" => parse_drive(fields),
            _ => fields.end(Self::Bye),
        }
    }

    /// The line with its LF, at most [`crate::link::MAX_LINE`] bytes. Commands
    /// keep six decimals.
    pub fn format(&self) -> String {
        match *self {
            Self::Hello => hello_line(),
            Self::Drive { seq, command, valid_ms, ref_t_ms } => {
                let (pump, valve) = (switch(command.pump_on), switch(command.valve_open));
                let value = NUMBERS.write(command.value);
                format!("DRIVE {seq} {value} {pump} {valve} {valid_ms} {ref_t_ms}\n")
            }
            Self::Bye => BYE_LINE.to_owned(),
        }
    }
}

fn parse_drive(mut fields: LineFields<'_>) -> Result<DriveLine, LineError> {
    let seq = fields.whole("seq")?;
    let value = fields.number("value")?;
    let pump_on = fields.switch("pump")?;
    let valve_open = fields.switch("valve")?;
    let valid_ms = fields.whole("valid_ms")?;
    let ref_t_ms = fields.whole("ref_t_ms")?;
    let command = ExtruderCommand { pump_on, valve_open, value };
    fields.end(DriveLine::Drive { seq, command, valid_ms, ref_t_ms })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::link::extruder::on_wire;
    use crate::link::{LineSplitter, MAX_LINE};

    #[test]
    fn the_lines_of_the_document_are_understood() {
        for text in
            ["HELLO 1 truebead", "DRIVE 7 62.5 1 1 300 5040", "DRIVE 8 0 0 0 300 5060", "BYE"]
        {
            assert_eq!(DriveLine::parse(text).unwrap().format(), format!("{text}\n"));
        }
    }

    #[test]
    fn a_line_says_what_is_wrong_with_it() {
        let why = |text: &str| DriveLine::parse(text).unwrap_err().to_string();
        assert_eq!(why(""), "the line is empty");
        assert!(why("SPEED 1 100 300 0").contains("expected HELLO, DRIVE or BYE"));
        assert_eq!(why("DRIVE 1 60 1 1 300"), "DRIVE: field `ref_t_ms` is missing");
        assert!(why("DRIVE 1 60 2 1 300 0").contains("`pump` must be 0 or 1, found `2`"));
        assert!(why("DRIVE 1 60 1 open 300 0").contains("`valve` must be 0 or 1"));
        assert!(why("DRIVE 1 6e1 1 1 300 0").contains("decimal point"));
        assert!(why("DRIVE 1 inf 1 1 300 0").contains("decimal point"));
        assert!(why("DRIVE 1 60 1 1 300 0 9").contains("found `9`"));
        assert!(why("HELLO 2 truebead").contains("version 2"));
    }

    proptest! {
        #[test]
        fn every_formatted_line_parses_back(
            seq in any::<u64>(),
            value in -1e9..1e9,
            pump_on in any::<bool>(),
            valve_open in any::<bool>(),
            valid_ms in any::<u64>(),
            ref_t_ms in any::<u64>(),
        ) {
            let command = ExtruderCommand { pump_on, valve_open, value };
            let text = DriveLine::Drive { seq, command, valid_ms, ref_t_ms }.format();
            prop_assert!(text.len() <= MAX_LINE);
            let command = ExtruderCommand { value: on_wire(value), ..command };
            let sent = DriveLine::Drive { seq, command, valid_ms, ref_t_ms };
            prop_assert_eq!(DriveLine::parse(text.trim_end()), Ok(sent));
        }

        #[test]
        fn no_bytes_panic(
            bytes in prop::collection::vec(any::<u8>(), 0..400),
            words in "(HELLO|DRIVE|BYE)( [0-9.+e-]{0,22}){0,8}",
        ) {
            for text in LineSplitter::new().push(&bytes).into_iter().flatten() {
                let _ = DriveLine::parse(&text);
            }
            let _ = DriveLine::parse(&words);
        }
    }
}
