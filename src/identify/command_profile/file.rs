//! A profile as a table of `time_s` and the quantity. The last line gives the end and repeats
//! the last value.

use std::fmt::Write;

use super::{CommandProfile, CommandProfileError, ProfilePoint};
use crate::core::Quantity;
use crate::identify::table::{DataTable, DataTableError};

/// The column of time.
const TIME: &str = "time_s";

/// A file without a valid profile.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ProfileFileError {
    /// It is no table.
    #[error(transparent)]
    Table(#[from] DataTableError),
    /// Its columns are others.
    #[error("the columns are {}; expected time_s and one quantity whose name ends with its unit, such as screw_rpm", .found.join(", "))]
    Columns {
        /// Those that are there.
        found: Vec<String>,
    },
    /// Time that does not run on.
    #[error("line {line}: time_s is {time_s}, and {before_s} the line before: time runs on")]
    Order {
        /// Line of the file, counted from 1.
        line: u64,
        /// Its time \[s\].
        time_s: f64,
        /// That of the one before it \[s\].
        before_s: f64,
    },
    /// It has too few lines.
    #[error("a profile has two lines or more: each value with its time, and the end")]
    Short,
    /// Its values form no profile.
    #[error(transparent)]
    Profile(#[from] CommandProfileError),
}

/// Reads a profile, and what it commands.
pub fn parse(text: &str) -> Result<(CommandProfile, Quantity), ProfileFileError> {
    let table = DataTable::parse(text)?;
    let other = || ProfileFileError::Columns { found: table.names().to_vec() };
    let [time, column] = table.names() else { return Err(other()) };
    let quantity = Quantity::of_column(column, None).filter(|_| time == TIME).ok_or_else(other)?;
    let times = table.column(time)?;
    let values = table.column(column)?;
    if let Some(at) = times.windows(2).position(|pair| pair[1] <= pair[0]) {
        let [before_s, time_s] = [times[at], times[at + 1]];
        return Err(ProfileFileError::Order { line: table.line(at + 1), time_s, before_s });
    }
    let (Some((end_s, begins)), true) = (times.split_last(), times.len() > 1) else {
        return Err(ProfileFileError::Short);
    };
    let points = begins.iter().zip(values).map(|(&from_s, value)| ProfilePoint { from_s, value });
    Ok((CommandProfile::new(points.collect(), *end_s)?, quantity))
}

/// The text of a profile's file; `column` ends with the unit.
pub fn to_csv(profile: &CommandProfile, column: &str) -> String {
    let mut text = format!("{TIME},{column}\n");
    let end = profile.points().last().map(|last| (profile.end_s(), last.value));
    let points = profile.points().iter().map(|point| (point.from_s, point.value));
    for (time_s, value) in points.chain(end) {
        // Rounded to the nanosecond, without the rounding errors of a sum of steps. Writing to
        // a string cannot fail.
        let _ = writeln!(text, "{},{value}", (time_s * 1e9).round() / 1e9);
    }
    text
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use super::*;
    use crate::core::Unit;

    #[test]
    fn what_is_written_is_read_again() {
        let value = |k: u32| 20.0 + f64::from(k * k % 7) / 3.0;
        let points = (0..50).map(|k| ProfilePoint { from_s: f64::from(k) * 0.5, value: value(k) });
        let profile = CommandProfile::new(points.collect(), 24.9).unwrap();
        let text = to_csv(&profile, "screw_rpm");
        assert!(text.starts_with("time_s,screw_rpm\n0,20\n0.5,20.333333333333332\n"), "{text}");
        let (read, quantity) = parse(&text).unwrap();
        assert_eq!((read, quantity.unit), (profile, Unit::Rpm));
    }

    #[test]
    fn what_is_no_profile_is_refused() {
        let said = |text: &str| parse(text).unwrap_err().to_string();
        assert!(said("time_s,speed\n0,1\n1,1\n").contains("the columns are time_s, speed"));
        assert!(said("time_ms,rpm\n0,1\n1,1\n").contains("expected time_s"));
        assert!(said("time_s,rpm\n0,1\n").contains("two lines or more"));
        assert!(said("time_s,rpm\n0,1\n2,3\n2,3\n").contains("line 4: time_s is 2, and 2"));
        assert!(said("time_s,rpm\n0,1\n1,fast\n2,1\n").contains("line 3, column rpm"));
    }
}
