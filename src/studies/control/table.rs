//! The rows of the study.

use serde::Serialize;

use crate::numeric::number::{to_count, to_f64};

/// One figure of one case in one cell. The names of the fields are the keys of `control.json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CaseRow {
    /// The case.
    pub case: String,
    /// Gauge, and rates of camera and robot.
    pub cell: String,
    /// The figure.
    pub quantity: String,
    /// Its unit.
    pub unit: &'static str,
    /// Number of beads.
    pub beads: usize,
    /// The value; `None` where it was not reached.
    pub value: Option<f64>,
    /// Largest value that is required.
    pub required: f64,
}

impl CaseRow {
    /// Whether the value is within what is required.
    pub fn is_met(&self) -> bool {
        self.value.is_some_and(|value| value <= self.required)
    }
}

/// The value that a fraction of all values does not exceed: the smallest one with at least that
/// many at or below it. Infinite values count.
pub fn reached_by(values: &[f64], fraction: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let number = to_count((fraction * to_f64(sorted.len())).ceil()).max(1) - 1;
    sorted.get(number).copied().unwrap_or(f64::NAN)
}

/// The rows as plain text.
pub fn plain(rows: &[CaseRow]) -> String {
    let case_width = rows.iter().map(|row| row.case.chars().count()).max().unwrap_or(0);
    let quantity_width = rows.iter().map(|row| row.quantity.chars().count()).max().unwrap_or(0);
    let line = |row: &CaseRow| {
        let value = row.value.map_or("never".to_owned(), |value| format!("{value:.4}"));
        let met = if row.is_met() { "" } else { "  MISSED" };
        format!(
            "{:case_width$}  {:18}  {:quantity_width$}  {value:>10} {:2}  at most {:.4}{met}\n",
            row.case, row.cell, row.quantity, row.unit, row.required
        )
    };
    rows.iter().map(line).collect()
}
