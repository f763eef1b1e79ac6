//! Lines from the extruder to the PC.

use super::numbers::{NUMBERS, switch};
use crate::core::{MPa, Mm, Mm3PerS, Rpm};
use crate::extruder::{CommandQuantity, ExtruderLimits, ExtruderReport, PumpMode};
use crate::link::frame::{DeviceLine, LineBody, LineError, LineFields, one_word};

/// A line from the extruder to the PC; a `STATE` comes every 5 to 200 ms.
pub type ExtruderLine = DeviceLine<ExtruderLimits, ExtruderStatus>;

/// State of an extruder.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExtruderStatus {
    /// Reading of its own clock \[ms\].
    pub t_ms: u64,
    /// Number of the last line that it applied on this connection.
    pub seq: u64,
    /// Pump, valve and readings.
    pub report: ExtruderReport,
}

impl From<ExtruderStatus> for ExtruderReport {
    fn from(status: ExtruderStatus) -> Self {
        status.report
    }
}

impl LineBody for ExtruderLimits {
    fn read(fields: &mut LineFields<'_>) -> Result<Self, LineError> {
        let name = fields.word("name")?.to_owned();
        let word = fields.word("unit")?;
        let expected = "rpm, v, mpa, mm3_per_s, kg_per_s or filling";
        let quantity = CommandQuantity::of_unit_word(word)
            .ok_or_else(|| fields.field_error("unit", expected, word))?;
        let min = fields.number("min")?;
        let max = fields.number("max")?;
        if min > max {
            return Err(LineError::Range { min, max });
        }
        Ok(Self { name, quantity, min, max })
    }

    fn write(&self) -> String {
        let (unit, name) = (self.quantity.unit_word(), one_word(&self.name, "extruder"));
        let (min, max) = (NUMBERS.write(self.min), NUMBERS.write(self.max));
        format!("{name} {unit} {min} {max}")
    }
}

impl LineBody for ExtruderStatus {
    fn read(fields: &mut LineFields<'_>) -> Result<Self, LineError> {
        let t_ms = fields.whole("t_ms")?;
        let seq = fields.whole("seq")?;
        let word = fields.word("pump")?;
        let expected = "OFF, STARTING, ON, STOPPING or FAULT";
        let pump = pump_of(word).ok_or_else(|| fields.field_error("pump", expected, word))?;
        let report = ExtruderReport {
            pump,
            valve_open: fields.switch("valve")?,
            screw_rpm: fields.reading("rpm", Rpm::new)?,
            pressure_mpa: fields.reading("mpa", MPa::new)?,
            flow_mm3_per_s: fields.reading("mm3_per_s", Mm3PerS::new)?,
            filled_mm: fields.reading("filled_mm", Mm::new)?,
        };
        Ok(Self { t_ms, seq, report })
    }

    fn write(&self) -> String {
        let Self { t_ms, seq, report } = self;
        let (pump, valve) = (pump_word(report.pump), switch(report.valve_open));
        let rpm = reading(report.screw_rpm.map(Rpm::get));
        let mpa = reading(report.pressure_mpa.map(MPa::get));
        let flow = reading(report.flow_mm3_per_s.map(Mm3PerS::get));
        let filled = reading(report.filled_mm.map(Mm::get));
        format!("{t_ms} {seq} {pump} {valve} {rpm} {mpa} {flow} {filled}")
    }
}

/// A reading in its form on a line; `-` without a sensor.
fn reading(value: Option<f64>) -> String {
    value.map_or_else(|| "-".to_owned(), |value| NUMBERS.write(value))
}

/// The word for a pump's mode on the link.
pub const fn pump_word(pump: PumpMode) -> &'static str {
    match pump {
        PumpMode::Off => "OFF",
        PumpMode::Starting => "STARTING",
        PumpMode::On => "ON",
        PumpMode::Stopping => "STOPPING",
        PumpMode::Fault => "FAULT",
    }
}

fn pump_of(word: &str) -> Option<PumpMode> {
    use PumpMode::{Fault, Off, On, Starting, Stopping};
    [Off, Starting, On, Stopping, Fault].into_iter().find(|&pump| pump_word(pump) == word)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::link::extruder::on_wire;
    use crate::link::{LineSplitter, MAX_LINE};

    #[test]
    fn the_lines_of_the_document_are_understood() {
        for text in [
            "HELLO 1 pump-3 rpm 0 90",
            "HELLO 1 x kg_per_s 0 0.5",
            "STATE 5040 17 ON 1 62.5 1.25 - -",
            "STATE 5040 0 OFF 0 - - 12.5 -",
            "STATE 5040 0 STOPPING 0 - - - 102.5",
            "ERR 4 RANGE 200 rpm is too fast",
        ] {
            assert_eq!(ExtruderLine::parse(text).unwrap().format(), format!("{text}\n"));
        }
        let state = ExtruderLine::parse("STATE 5040 17 ON 1 62.5 1.25 - -").unwrap();
        let ExtruderLine::State(status) = state else { panic!("a STATE was expected") };
        assert_eq!(status.report.pressure_mpa, Some(MPa::constant(1.25)));
        assert_eq!(status.report.flow_mm3_per_s, None);
    }

    #[test]
    fn a_line_says_what_is_wrong_with_it() {
        let why = |text: &str| ExtruderLine::parse(text).unwrap_err().to_string();
        assert!(why("STATE 1 0 RUN 0 - - - -").contains("OFF, STARTING, ON, STOPPING or FAULT"));
        assert!(why("STATE 1 0 ON 1 - - -").contains("`filled_mm` is missing"));
        assert!(why("STATE 1 0 ON 1 -- - - -").contains("`rpm` must be a number"));
        assert!(why("STATE 1 0 ON 1 nan - - -").contains("`rpm` must be a number"));
        assert!(why("HELLO 1 x bar 0 90").contains("kg_per_s or filling, found `bar`"));
        assert!(why("HELLO 1 x rpm 90 0").contains("90 lies above the largest 0"));
        assert!(why("HELLO 2 x rpm 0 90").contains("version 2"));
        assert!(why("ERR 1 OOPS x").contains("found `OOPS`"));
    }

    fn reading() -> impl Strategy<Value = Option<f64>> {
        prop::option::of((-1e9..1e9).prop_map(on_wire))
    }

    proptest! {
        #[test]
        fn every_formatted_state_parses_back(
            t_ms in any::<u64>(),
            seq in any::<u64>(),
            mode in 0..5_usize,
            valve_open in any::<bool>(),
            readings in (reading(), reading(), reading(), reading()),
        ) {
            use PumpMode::{Fault, Off, On, Starting, Stopping};
            let report = ExtruderReport {
                pump: [Off, Starting, On, Stopping, Fault][mode],
                valve_open,
                screw_rpm: readings.0.map(Rpm::constant),
                pressure_mpa: readings.1.map(MPa::constant),
                flow_mm3_per_s: readings.2.map(Mm3PerS::constant),
                filled_mm: readings.3.map(Mm::constant),
            };
            let line = ExtruderLine::State(ExtruderStatus { t_ms, seq, report });
            let text = line.format();
            prop_assert!(text.len() <= MAX_LINE, "{text}");
            prop_assert_eq!(ExtruderLine::parse(text.trim_end()), Ok(line));
        }

        #[test]
        fn no_bytes_panic(
            bytes in prop::collection::vec(any::<u8>(), 0..400),
            words in "(HELLO|STATE|ERR)( [0-9.A-Z+-]{0,22}){0,10}",
        ) {
            for text in LineSplitter::new().push(&bytes).into_iter().flatten() {
                let _ = ExtruderLine::parse(&text);
            }
            let _ = ExtruderLine::parse(&words);
        }
    }
}
