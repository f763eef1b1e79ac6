//! Figures of drawn frames as tables.

use std::fmt::Write;

use super::figures::{DrawnFigures, SetPart};
use crate::studies::accuracy::drawn::DrawnSet;
use crate::studies::accuracy::table::{self, FigureRow, number, verdict};

impl FigureRow for DrawnFigures {
    const HEADS: &str = "set|part|frames|measured %|bias px|RMSE px|z|silent|refused|worst frames|\
                         limits";

    fn cells(&self) -> Vec<String> {
        let listed = |parts: Vec<String>, separator: &str| {
            if parts.is_empty() { "–".to_owned() } else { parts.join(separator) }
        };
        let rejected = self.rejected.iter().map(|(status, count)| format!("{status} {count}"));
        vec![
            self.set.to_owned(),
            named(&self.part),
            self.frames.to_string(),
            number(100.0 * self.measured_fraction, 2),
            number(self.bias_px, 3),
            number(self.rmse_px, 3),
            number(self.z, 2),
            self.silent.to_string(),
            listed(rejected.collect(), ", "),
            listed(self.worst.iter().map(u64::to_string).collect(), " "),
            verdict(&self.missed),
        ]
    }
}

fn named(part: &SetPart) -> String {
    match part {
        SetPart::All => "all".to_owned(),
        SetPart::Third { parameter, from, to } => format!("{parameter} {from:.3} to {to:.3}"),
        SetPart::Zero { parameter } => format!("{parameter} 0"),
    }
}

/// The figures in Markdown: a table of the sets, and a section of each with its ranges.
pub fn markdown(sets: &[DrawnSet], figures: &[DrawnFigures]) -> String {
    let whole = figures.iter().filter(|figures| figures.part == SetPart::All);
    let mut text = format!("# All sets\n\n{}", table::markdown(whole));
    for set in sets {
        let parts: Vec<&DrawnFigures> =
            figures.iter().filter(|figures| figures.set == set.name).collect();
        let ranges = ranges(&parts);
        // Writing to a string cannot fail.
        let _ = write!(text, "\n# {}\n\n{}: {ranges}.\n\n", set.name, set.about);
        text += &table::markdown(parts);
    }
    text
}

/// The random parameters and their ranges.
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
