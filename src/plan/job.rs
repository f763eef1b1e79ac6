//! The path of a job from a table: path length, position and nominal speed.

use csv::StringRecord;

use super::position::{Position, distance};
use super::profile::{SpeedPoint, SpeedProfile, SpeedProfileError};
use crate::document::csv::{LineProblem, describe};

/// Columns that are read; others are ignored.
const PATH: &str = "path_mm";
const SPEED: &str = "speed_mm_per_s";
const POSITION: [&str; 3] = ["x_mm", "y_mm", "z_mm"];

/// A job's path and its nominal speed.
#[derive(Debug, Clone, PartialEq)]
pub struct PathJob {
    /// Nominal speed over path.
    pub speed: SpeedProfile,
    /// Path and position of the nozzle \[mm\], in order; linear in between.
    pub position: Vec<(f64, [f64; 3])>,
}

/// Errors of a job table. Lines are counted from 1, the heading included.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum JobError {
    /// A column is missing.
    #[error("the heading has no column {0}: a job has {PATH}, x_mm, y_mm, z_mm and {SPEED}")]
    Column(&'static str),
    /// A row that is not as long as the heading, or not text.
    #[error("line {line}: {what}")]
    Row {
        /// Line.
        line: u64,
        /// What is wrong.
        what: String,
    },
    /// A field that is not a number.
    #[error("line {line}: {column} is \"{found}\"; a number is expected")]
    Number {
        /// Line.
        line: u64,
        /// Column.
        column: &'static str,
        /// The field.
        found: String,
    },
    /// Path that is shorter than the distance of two positions.
    #[error(
        "line {line}: {path_mm} mm of path for {way_mm:.3} mm of way since the line before; \
         path length is counted along the way"
    )]
    Way {
        /// Line.
        line: u64,
        /// Path since the line before \[mm\].
        path_mm: f64,
        /// Distance of the positions \[mm\].
        way_mm: f64,
    },
    /// The speeds give no profile; points are the rows below the heading.
    #[error("{}the speeds: {error}", line.map_or(String::new(), |line| format!("line {line}: ")))]
    Profile {
        /// The line of the wrong point, if there is one.
        line: Option<u64>,
        /// What is wrong.
        error: SpeedProfileError,
    },
}

/// Tolerance of a distance that exceeds its path by rounding: relative and absolute \[mm\].
const PATH_TOLERANCE: (f64, f64) = (1e-3, 0.01);

/// Reads a job from the text of a table with a heading.
pub fn read(text: &str) -> Result<PathJob, JobError> {
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(text.as_bytes());
    let heading = reader.headers().map_err(|error| of_row(&error))?.clone();
    let column = |name: &'static str| {
        let at = heading.iter().position(|found| found == name);
        at.map(|at| (name, at)).ok_or(JobError::Column(name))
    };
    let (path, speed) = (column(PATH)?, column(SPEED)?);
    let [x, y, z] = POSITION.map(column);
    let axes = [x?, y?, z?];
    let (mut points, mut position, mut lines) = (Vec::new(), Vec::new(), Vec::new());
    for record in reader.records() {
        let record = record.map_err(|error| of_row(&error))?;
        let line = record.position().map_or(0, csv::Position::line);
        let number = |(column, at)| number(&record, line, column, at);
        let path_mm = number(path)?;
        let here = (path_mm, [number(axes[0])?, number(axes[1])?, number(axes[2])?]);
        if let Some(before) = position.last() {
            check_distance(line, *before, here)?;
        }
        lines.push(line);
        points.push(SpeedPoint { path_mm, speed_mm_per_s: number(speed)? });
        position.push(here);
    }
    let speed = SpeedProfile::new(&points).map_err(|error| {
        let at = error.point().and_then(|point| point.checked_sub(1));
        JobError::Profile { line: at.and_then(|at| lines.get(at).copied()), error }
    })?;
    Ok(PathJob { speed, position })
}

fn number(row: &StringRecord, line: u64, column: &'static str, at: usize) -> Result<f64, JobError> {
    let found = row.get(at).unwrap_or_default();
    let value = found.parse().ok().filter(|value: &f64| value.is_finite());
    value.ok_or_else(|| JobError::Number { line, column, found: found.to_owned() })
}

fn check_distance(line: u64, from: (f64, Position), to: (f64, Position)) -> Result<(), JobError> {
    let way_mm = distance(from.1, to.1);
    let path_mm = to.0 - from.0;
    // A path that does not grow is an error of the profile.
    if path_mm > 0.0 && way_mm > path_mm * (1.0 + PATH_TOLERANCE.0) + PATH_TOLERANCE.1 {
        return Err(JobError::Way { line, path_mm, way_mm });
    }
    Ok(())
}

fn of_row(error: &csv::Error) -> JobError {
    let LineProblem { line, what } = describe(error);
    JobError::Row { line, what }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use super::*;

    const TABLE: &str = "path_mm,x_mm,y_mm,z_mm,speed_mm_per_s,note
0,0,0,5,100,start
50, 50, 0, 5, 2, corner
100,50,50,5,100,end
";

    #[test]
    fn a_table_is_a_profile_with_positions() {
        let job = read(TABLE).unwrap();
        assert_eq!(job.speed.path(), [0.0, 50.0, 100.0]);
        assert!((job.speed.speed_at(50.0) - 2.0).abs() < 1e-12);
        assert_eq!(job.position[1], (50.0, [50.0, 0.0, 5.0]));
    }

    #[test]
    fn errors_name_their_line() {
        let word = |from: &str, to: &str| read(&TABLE.replace(from, to)).unwrap_err().to_string();
        assert!(word("z_mm", "height").contains("no column z_mm"));
        let words = word("50, 50, 0, 5, 2,", "50, 50, 0, 5, slow,");
        assert!(words.contains("line 3") && words.contains("\"slow\""), "{words}");
        let words = word("100,50,50,5,100,end", "100,50,50,5");
        assert!(words.contains("line 4") && words.contains("4 fields"), "{words}");
        let words = word("100,50,50,", "80,50,50,");
        assert!(words.contains("line 4") && words.contains("30 mm of path"), "{words}");
        let words = word("50, 50, 0, 5, 2,", "0, 0, 0, 5, 2,");
        assert!(words.contains("line 3") && words.contains("point 2"), "{words}");
    }
}
