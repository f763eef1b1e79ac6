//! Figures as tables.

use super::figures::{Miss, SetFigures};

const COLUMNS: usize = 13;
const HEADS: [&str; COLUMNS] = [
    "set",
    "frames",
    "bias px",
    "RMSE px",
    "bound px",
    "RMSE/bound",
    "free bound px",
    "RMSE/free bound",
    "measured %",
    "silent %",
    "RMS e/σ",
    "in 95 %",
    "limits",
];

fn cells(figures: &SetFigures) -> [String; COLUMNS] {
    let number = |value: Option<f64>, digits: usize| {
        value.map_or("–".to_owned(), |value| format!("{value:.digits$}"))
    };
    let missed: Vec<String> = figures.missed.iter().map(Miss::to_string).collect();
    [
        figures.set.to_owned(),
        figures.frames.to_string(),
        number(figures.bias_px, 4),
        number(figures.rmse_px, 4),
        number(Some(figures.bound_px), 4),
        number(figures.rmse_over_bound, 2),
        number(Some(figures.free_bound_px), 4),
        number(figures.rmse_over_free_bound, 2),
        number(Some(100.0 * figures.measured_fraction), 2),
        number(Some(100.0 * figures.silent_fraction), 3),
        number(figures.rms_over_sigma, 2),
        number(figures.within_interval.map(|share| 100.0 * share), 1),
        match figures.kept {
            None => "–".to_owned(),
            Some(true) => "kept".to_owned(),
            Some(false) => format!("MISSED: {}", missed.join("; ")),
        },
    ]
}

/// The figures as a table for a terminal.
pub fn table(figures: &[SetFigures]) -> String {
    aligned(&HEADS, figures.iter().map(cells))
}

/// The figures as a table in Markdown.
pub fn markdown(figures: &[SetFigures]) -> String {
    marked(&HEADS, figures.iter().map(cells))
}

/// Lines for a terminal: the first and the last cell of each begin in one column, the
/// others end in one.
pub(super) fn aligned<const N: usize>(
    heads: &[&str; N],
    rows: impl Iterator<Item = [String; N]>,
) -> String {
    let mut lines = vec![heads.map(str::to_owned)];
    lines.extend(rows);
    let wide = |column: usize| {
        lines.iter().map(|line| line[column].chars().count()).max().unwrap_or_default()
    };
    let widths: [usize; N] = std::array::from_fn(wide);
    let text = |line: &[String; N]| {
        let cells =
            line.iter().zip(widths).enumerate().map(|(column, (cell, width))| match column {
                0 => format!("{cell:width$}"),
                _ if column + 1 == N => cell.clone(),
                _ => format!("{cell:>width$}"),
            });
        format!("{}\n", cells.collect::<Vec<_>>().join("  "))
    };
    lines.iter().map(text).collect()
}

/// The same in Markdown.
pub(super) fn marked<const N: usize>(
    heads: &[&str; N],
    rows: impl Iterator<Item = [String; N]>,
) -> String {
    let rule = format!("|---|{}---|\n", "---:|".repeat(N - 2));
    let head = format!("| {} |\n{rule}", heads.join(" | "));
    rows.fold(head, |text, cells| text + &format!("| {} |\n", cells.join(" | ")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::studies::accuracy::sets;

    #[test]
    fn tables_have_a_line_a_set_and_all_columns() {
        let set = &sets::all()[0];
        let figures = [SetFigures::of(set, 0.1, &[None]), SetFigures::of(set, 0.1, &[None])];
        let text = table(&figures);
        assert_eq!(text.lines().count(), 3);
        assert!(text.lines().last().unwrap().contains("MISSED: bias px none; "), "{text}");
        let markdown = markdown(&figures);
        let bars = COLUMNS + 1;
        assert!(markdown.lines().all(|line| line.matches('|').count() == bars), "{markdown}");
    }
}
