//! What is wrong with a table of separated values, in words.

/// A line of a table that is wrong.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LineProblem {
    /// Counted from 1, with the heading.
    pub line: u64,
    /// What is wrong there.
    pub what: String,
}

/// What the parser says, in words.
pub fn describe(error: &csv::Error) -> LineProblem {
    let line = error.position().map_or(1, csv::Position::line);
    let what = match error.kind() {
        csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
            let fields = if *len == 1 { "field" } else { "fields" };
            format!("found {len} {fields}, expected {expected_len} as in the heading")
        }
        csv::ErrorKind::Utf8 { .. } => "this is no text".to_owned(),
        _ => error.to_string(),
    };
    LineProblem { line, what }
}
