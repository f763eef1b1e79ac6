//! What is wrong with a table of separated values, in words.

/// The line, counted from 1 with the heading, and what is wrong there.
pub fn in_words(error: &csv::Error) -> (u64, String) {
    let line = error.position().map_or(1, csv::Position::line);
    let what = match error.kind() {
        csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
            let fields = if *len == 1 { "field" } else { "fields" };
            format!("found {len} {fields}, expected {expected_len} as in the heading")
        }
        csv::ErrorKind::Utf8 { .. } => "this is no text".to_owned(),
        _ => error.to_string(),
    };
    (line, what)
}
