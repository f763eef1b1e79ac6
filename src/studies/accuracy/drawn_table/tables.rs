//! Figures of drawn frames as tables.

use std::fmt::Write;

use super::figures::{DrawnFigures, SetPart};
use crate::studies::accuracy::drawn::DrawnSet;
use crate::studies::accuracy::table::{aligned, marked};

const COLUMNS: usize = 11;
const HEADS: [&str; COLUMNS] = [
    "set",
    "part",
    "frames",
    "measured %",
    "bias px",
    "RMSE px",
    "z",
    "silent",
    "refused",
    "worst frames",
    "limits",
];

fn cells(figures: &DrawnFigures) -> [String; COLUMNS] {
    let number = |value: Option<f64>, digits: usize| {
        value.map_or("–".to_owned(), |value| format!("{value:.digits$}"))
    };
    let listed = |parts: Vec<String>, apart: &str| {
        if parts.is_empty() { "–".to_owned() } else { parts.join(apart) }
    };
    let refused = figures.rejected.iter().map(|(status, count)| format!("{status} {count}"));
    [
        figures.set.to_owned(),
        named(&figures.part),
        figures.frames.to_string(),
        number(Some(100.0 * figures.measured_fraction), 2),
        number(figures.bias_px, 3),
        number(figures.rmse_px, 3),
        number(figures.z, 2),
        figures.silent.to_string(),
        listed(refused.collect(), ", "),
        listed(figures.worst.iter().map(u64::to_string).collect(), " "),
        match figures.missed.as_slice() {
            [] => "kept".to_owned(),
            missed => format!("MISSED: {}", missed.join("; ")),
        },
    ]
}

fn named(part: &SetPart) -> String {
    match part {
        SetPart::All => "all".to_owned(),
        SetPart::Third { parameter, from, to } => format!("{parameter} {from:.3} to {to:.3}"),
        SetPart::Zero { parameter } => format!("{parameter} 0"),
    }
}

/// The figures as a table for a terminal.
pub fn table(figures: &[DrawnFigures]) -> String {
    aligned(&HEADS, figures.iter().map(cells))
}

/// The figures in Markdown: a table of the sets, and a section of each with its ranges.
pub fn markdown(sets: &[DrawnSet], figures: &[DrawnFigures]) -> String {
    let whole = figures.iter().filter(|figures| figures.part == SetPart::All);
    let mut text = format!("# All sets\n\n{}", marked(&HEADS, whole.map(cells)));
    for set in sets {
        let parts: Vec<&DrawnFigures> =
            figures.iter().filter(|figures| figures.set == set.name).collect();
        let ranges = ranges(&parts);
        // Writing to a string cannot fail.
        let _ = write!(text, "\n# {}\n\n{}: {ranges}.\n\n", set.name, set.about);
        text += &marked(&HEADS, parts.into_iter().map(cells));
    }
    text
}

/// What was drawn from where.
fn ranges(parts: &[&DrawnFigures]) -> String {
    let mut ranges: Vec<(&str, f64, f64)> = Vec::new();
    for part in parts {
        let SetPart::Third { parameter, from, to } = part.part else { continue };
        match ranges.last_mut() {
            Some(last) if last.0 == parameter => last.2 = to,
            _ => ranges.push((parameter, from, to)),
        }
    }
    let named = ranges.iter().map(|(name, from, to)| format!("{name} {from:.3} to {to:.3}"));
    named.collect::<Vec<_>>().join(", ")
}
