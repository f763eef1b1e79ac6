//! Summary of a paper's table in a line: how many published numbers the paper's own method
//! reproduces in our simulation, and the one with the largest deviation.

use maud::{Markup, html};

use super::table::number;
use crate::studies::study::{Reproduced, TableRow};

/// Relative deviations within which a published number counts as reproduced.
const NEAR_FRACTIONS: [f64; 2] = [0.02, 0.1];

/// Counts of rows with a published number.
#[derive(Debug)]
pub struct PaperSummary<'a> {
    /// Number of rows with a published number.
    pub published: usize,
    /// Number of those that were simulated to within 2 % and to within 10 %.
    pub near: [usize; 2],
    /// The row with the largest deviation relative to the published number, and that fraction;
    /// `None` if nothing can be compared.
    pub furthest: Option<(&'a TableRow, f64)>,
    /// Number of published numbers that the simulation does not reach at all.
    pub absent: usize,
}

impl<'a> PaperSummary<'a> {
    /// Summary of a paper's rows.
    pub fn of(rows: &'a [TableRow]) -> Self {
        let published = || rows.iter().filter_map(|row| Some((row, row.published?)));
        let off: Vec<(&TableRow, f64)> = published()
            .filter_map(|(row, published_value)| {
                let by = (row.simulated? - published_value).abs();
                // A published zero has no relative deviation, except that an equal value deviates
                // by 0.
                Some((row, if by == 0.0 { 0.0 } else { by / published_value.abs() }))
            })
            .collect();
        Self {
            published: published().count(),
            near: NEAR_FRACTIONS.map(|share| off.iter().filter(|(_, by)| *by <= share).count()),
            furthest: off.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1)),
            absent: published().filter(|(row, _)| row.simulated.is_none()).count(),
        }
    }

    /// The row with the largest deviation, in words.
    fn furthest(&self) -> String {
        self.furthest.map_or_else(
            || "–".to_owned(),
            |(row, _)| {
                let TableRow { case, quantity, unit, .. } = row;
                let unit = if *unit == "1" { String::new() } else { format!(" {unit}") };
                let [published, simulated] = [row.published, row.simulated].map(number);
                format!(
                    "{case}, {quantity}: {published}{unit} published, {simulated}{unit} simulated"
                )
            },
        )
    }

    /// The summary as a sentence.
    pub fn text(&self) -> String {
        let Self { published, near: [close, near], absent, .. } = self;
        if *published == 0 {
            return "The paper gives no number to compare with.".to_owned();
        }
        let absent = match absent {
            0 => String::new(),
            some => format!(", {some} not reached"),
        };
        format!(
            "Of {published} published numbers {close} are simulated to within 2 %, {near} to within \
             10 %{absent}. Furthest off: {}.",
            self.furthest()
        )
    }
}

/// The summaries of all papers, for the top of the page.
pub fn markup(sources: &[Reproduced]) -> Markup {
    html! {
        section {
            h2 { "Summary" }
            p.hint {
                b { "Published" } " is the number in the paper, " b { "simulated" }
                " what the paper's own method gives in this program's simulation, and " b { "ours" }
                " what this program's best method gives on the same plant. In the plots the paper's \
                 method is orange, ours is blue."
            }
            div.wide { table {
                thead { tr {
                    th { "source" } th.number { "published numbers" } th.number { "within 2 %" }
                    th.number { "within 10 %" } th.number { "not reached" } th { "furthest off" }
                } }
                tbody { @for (at, source) in sources.iter().enumerate() {
                    @let summary = PaperSummary::of(&source.rows);
                    tr {
                        td { a href={ "#source-" (at) } { (source.title) } }
                        td.number { (summary.published) }
                        @for near in summary.near { td.number { (near) } }
                        td.number { (summary.absent) }
                        td { (summary.furthest()) }
                    }
                } }
            } }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(published: Option<f64>, simulated: Option<f64>) -> TableRow {
        let (paper, case, quantity) = ("ma2026", "step".to_owned(), "overshoot");
        TableRow {
            paper,
            case,
            quantity,
            unit: "%",
            published,
            simulated,
            ours: None,
            simulated_confidence: None,
            ours_confidence: None,
        }
    }

    #[test]
    fn what_is_met_and_what_is_missed_is_counted() {
        let rows = [
            row(Some(10.0), Some(10.1)),
            row(Some(0.0), Some(0.0)),
            row(Some(-2.0), Some(-2.16)),
            row(Some(4.0), Some(5.0)),
            row(Some(7.0), None),
            row(None, Some(3.0)),
        ];
        let summary = PaperSummary::of(&rows);
        assert_eq!((summary.published, summary.near, summary.absent), (5, [2, 3], 1));
        let said = summary.text();
        assert!(said.starts_with("Of 5 published numbers 2 are simulated to within 2 %"), "{said}");
        assert!(said.contains("1 not reached. Furthest off: step, overshoot: 4.00 %"), "{said}");
        assert!(PaperSummary::of(&rows[5..]).text().contains("no number to compare"));
    }
}
