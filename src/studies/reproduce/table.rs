//! Rows of published and simulated numbers as text and as HTML.

use maud::{Markup, html};

use crate::numeric::number::to_count;
use crate::studies::study::TableRow;

const HEADS: [&str; 6] = ["case", "quantity", "unit", "published", "simulated", "ours"];

/// The rows as plain text.
pub fn plain(rows: &[TableRow]) -> String {
    let longest = |of: fn(&TableRow) -> &str, least: usize| {
        rows.iter().map(|row| of(row).chars().count()).max().unwrap_or(0).max(least)
    };
    let case_width = longest(|row| &row.case, 4);
    let quantity_width = longest(|row| row.quantity, 8);
    let unit_width = longest(|row| row.unit, 4);
    let values: Vec<[String; 3]> = rows.iter().map(values).collect();
    let value_width = values.iter().flatten().map(|value| value.chars().count()).max();
    let value_width = value_width.unwrap_or(0).max(9);
    let line = |cells: [&str; 6]| {
        let [case, quantity, unit, published, simulated, ours] = cells;
        format!(
            "{case:case_width$}  {quantity:quantity_width$}  {unit:unit_width$} {published:>9} \
             {simulated:>value_width$} {ours:>value_width$}\n"
        )
    };
    let mut text = line(HEADS);
    for (row, [published, simulated, ours]) in rows.iter().zip(&values) {
        text += &line([&row.case, row.quantity, row.unit, published, simulated, ours]);
    }
    text
}

/// Published, simulated and ours, each with its confidence.
fn values(row: &TableRow) -> [String; 3] {
    let with = |value: Option<f64>, confidence: Option<f64>| match confidence {
        Some(half) => format!("{} ± {}", number(value), two_digits(half)),
        None => number(value),
    };
    [
        number(row.published),
        with(row.simulated, row.simulated_confidence),
        with(row.ours, row.ours_confidence),
    ]
}

/// The rows as HTML.
pub fn markup(rows: &[TableRow]) -> Markup {
    html! {
        table {
            thead { tr {
                @for head in &HEADS[..3] { th { (head) } }
                @for head in &HEADS[3..] { th.number { (head) } }
            } }
            tbody { @for row in rows { tr {
                td { (row.case) }
                td { (row.quantity) }
                td { (row.unit) }
                @for value in values(row) { td.number { (value) } }
            } } }
        }
    }
}

/// A positive number with two digits that count.
fn two_digits(value: f64) -> String {
    let places = to_count((1.0 - value.log10().floor()).clamp(0.0, 9.0));
    format!("{value:.places$}")
}

/// A number with one digit after the point from 20 on, with two from 0.2 on, with four from 0.002
/// on, and below that with two digits and a power of ten; a dash for `None`.
pub fn number(value: Option<f64>) -> String {
    value.map_or("–".to_owned(), |value| {
        let size = value.abs();
        let text = match size {
            _ if size >= 20.0 => format!("{value:.1}"),
            _ if !(1e-12..0.2).contains(&size) => format!("{value:.2}"),
            _ if size >= 0.002 => format!("{value:.4}"),
            _ => format!("{value:.1e}"),
        };
        if text.trim_start_matches('-').chars().all(|c| c == '0' || c == '.') {
            text.trim_start_matches('-').to_owned()
        } else {
            text
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_not_less_than_nothing() {
        assert_eq!(number(Some(-1e-13)), "0.00");
        assert_eq!(number(Some(-0.01)), "-0.0100");
        assert_eq!(number(None), "–");
    }

    #[test]
    fn a_confidence_has_two_digits_that_count() {
        assert_eq!([0.1321, 0.0019, 12.3, 0.5].map(two_digits), ["0.13", "0.0019", "12", "0.50"]);
        assert_eq!(two_digits(0.0), "0.000000000");
    }

    #[test]
    fn small_numbers_keep_digits_that_can_be_compared() {
        assert_eq!(number(Some(0.0153)), "0.0153");
        assert_eq!(number(Some(2e-6)), "2.0e-6");
        assert_eq!(number(Some(96.63)), "96.6");
    }

    #[test]
    fn columns_are_as_wide_as_what_stands_in_them() {
        let quantity = "a quantity with a name of some length";
        let row = |case: &str, quantity| TableRow {
            paper: "ma2026",
            case: case.into(),
            quantity,
            unit: "mm",
            published: Some(1.3),
            simulated: Some(1.46),
            ours: None,
            simulated_confidence: Some(0.02),
            ours_confidence: None,
        };
        let text = plain(&[row("a", quantity), row("a longer case", "short")]);
        let ends: Vec<usize> = text.lines().map(|line| line.chars().count()).collect();
        assert!(ends.iter().all(|end| *end == ends[0]), "{text}");
    }
}
