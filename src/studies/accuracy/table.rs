//! Figures as tables for a terminal and in Markdown.

use super::figures::{Miss, SetFigures};

/// A row of a table of figures.
pub trait FigureRow {
    /// Heads of the columns, separated by `|`.
    const HEADS: &str;

    /// The cells of the row, one for each head.
    fn cells(&self) -> Vec<String>;
}

impl FigureRow for SetFigures {
    const HEADS: &str = "set|frames|bias px|RMSE px|bound px|RMSE/bound|free bound px|\
                         RMSE/free bound|measured %|silent %|RMS e/σ|in 95 %|limits";

    fn cells(&self) -> Vec<String> {
        let missed: Vec<String> = self.missed.iter().map(Miss::to_string).collect();
        vec![
            self.set.to_owned(),
            self.frames.to_string(),
            number(self.bias_px, 4),
            number(self.rmse_px, 4),
            number(self.bound_px, 4),
            number(self.rmse_over_bound, 2),
            number(self.free_bound_px, 4),
            number(self.rmse_over_free_bound, 2),
            number(100.0 * self.measured_fraction, 2),
            number(100.0 * self.silent_fraction, 3),
            number(self.rms_over_sigma, 2),
            number(self.within_interval.map(|fraction| 100.0 * fraction), 1),
            self.kept.map_or("–".to_owned(), |_| verdict(&missed)),
        ]
    }
}

/// A number with `digits` decimals; a dash for `None`.
pub fn number(value: impl Into<Option<f64>>, digits: usize) -> String {
    value.into().map_or("–".to_owned(), |value| format!("{value:.digits$}"))
}

/// Whether limits are kept, and the ones that are missed.
pub fn verdict(missed: &[String]) -> String {
    if missed.is_empty() { "kept".to_owned() } else { format!("MISSED: {}", missed.join("; ")) }
}

/// Lines for a terminal: the first and the last column are aligned to the left, the others to
/// the right.
pub fn table<T: FigureRow>(rows: &[T]) -> String {
    let mut lines: Vec<Vec<String>> = vec![T::HEADS.split('|').map(str::to_owned).collect()];
    lines.extend(rows.iter().map(T::cells));
    let last = lines[0].len() - 1;
    let wide = |column: usize| lines.iter().map(|line| line[column].chars().count()).max();
    let widths: Vec<usize> = (0..=last).map(|column| wide(column).unwrap_or_default()).collect();
    let text = |line: &Vec<String>| {
        let cells =
            line.iter().zip(&widths).enumerate().map(|(column, (cell, &width))| match column {
                0 => format!("{cell:width$}"),
                _ if column == last => cell.clone(),
                _ => format!("{cell:>width$}"),
            });
        format!("{}\n", cells.collect::<Vec<_>>().join("  "))
    };
    lines.iter().map(text).collect()
}

/// The table in Markdown.
pub fn markdown<'a, T: FigureRow + 'a>(rows: impl IntoIterator<Item = &'a T>) -> String {
    let rule = "---:|".repeat(T::HEADS.split('|').count() - 2);
    let mut text = format!("| {} |\n|---|{rule}---|\n", T::HEADS.replace('|', " | "));
    for row in rows {
        text.extend(["| ", &row.cells().join(" | "), " |\n"]);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::studies::accuracy::sets;

    #[test]
    fn tables_have_a_line_for_each_set_and_all_columns() {
        let set = &sets::all()[0];
        let figures = [SetFigures::of(set, 0.1, &[None]), SetFigures::of(set, 0.1, &[None])];
        let text = table(&figures);
        assert_eq!(text.lines().count(), 3);
        assert!(text.lines().last().unwrap().contains("MISSED: bias px none; "), "{text}");
        let markdown = markdown(&figures);
        let bars = SetFigures::HEADS.split('|').count() + 1;
        assert!(markdown.lines().all(|line| line.matches('|').count() == bars), "{markdown}");
    }
}
