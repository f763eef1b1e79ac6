//! The rows of the study.

use serde::Serialize;

use crate::numeric::number::to_f64;
use crate::numeric::rank;

/// Seconds in a thousand hours. By definition.
const THOUSAND_HOURS_S: f64 = 3.6e6;

/// One figure of one case in one cell. The names of the fields are the keys of `control.json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CaseRow {
    /// The case.
    pub case: String,
    /// Gauge, and rates of camera and robot; or the loop.
    pub cell: String,
    /// The figure.
    pub quantity: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Number of beads, or of runs.
    pub beads: usize,
    /// The value; `None` where it was not reached.
    pub value: Option<f64>,
    /// Half of its confidence interval of 95 %, where it is a mean over the beads.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub confidence: Option<f64>,
    /// Largest value that is required; infinite, `null` in the file, where none is.
    pub required: f64,
}

/// What a figure is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quantity {
    name: &'static str,
    unit: &'static str,
}

impl Quantity {
    /// A length.
    pub const fn mm(name: &'static str) -> Self {
        Self { name, unit: "mm" }
    }

    /// A quantity with its unit.
    pub const fn new(name: &'static str, unit: &'static str) -> Self {
        Self { name, unit }
    }

    /// A percentage.
    pub const fn percent(name: &'static str) -> Self {
        Self { name, unit: "%" }
    }

    /// A ratio.
    pub const fn ratio(name: &'static str) -> Self {
        Self { name, unit: "" }
    }
}

impl CaseRow {
    /// A figure of some beads of a case; one that is not finite was not reached.
    pub fn new(
        cell: impl Into<String>,
        case: &str,
        quantity: Quantity,
        beads: usize,
        value: f64,
        required: f64,
    ) -> Self {
        Self {
            case: case.to_owned(),
            cell: cell.into(),
            quantity: quantity.name,
            unit: quantity.unit,
            beads,
            value: value.is_finite().then_some(value),
            confidence: None,
            required,
        }
    }

    /// After which time or path a fault was noticed in each of some trials, infinite where it was not:
    /// how many were late, and the median.
    pub fn noticed(
        cell: impl Into<String>,
        case: &str,
        after: &[f64],
        within: f64,
        unit: &'static str,
    ) -> [Self; 2] {
        let cell = cell.into();
        let late = after.iter().filter(|after| **after > within).count();
        let fraction = to_f64(late) / to_f64(after.len());
        let row = |quantity, value, required| {
            Self::new(cell.clone(), case, quantity, after.len(), value, required)
        };
        [
            row(Quantity::ratio("fraction not noticed in time"), fraction, 0.01),
            row(Quantity::new("noticed after, median", unit), quantile(after, 0.5), within),
        ]
    }

    /// Number of alarms in runs without a fault that have lasted some time together \[s\].
    pub fn false_alarms(
        cell: impl Into<String>,
        case: &str,
        runs: usize,
        alarms: usize,
        lasted_s: f64,
    ) -> Self {
        let value = THOUSAND_HOURS_S * to_f64(alarms) / lasted_s;
        Self::new(cell, case, Quantity::ratio("false alarms in 1,000 h"), runs, value, 10.0)
    }

    /// With half of the confidence interval of its value.
    pub fn with_confidence(self, confidence: Option<f64>) -> Self {
        Self { confidence, ..self }
    }

    /// Whether the value is within what is required; always where nothing is.
    pub fn is_met(&self) -> bool {
        self.required.is_infinite() || self.value.is_some_and(|value| value <= self.required)
    }
}

/// The value at a fraction of the way from the smallest to the largest; infinite values count, and
/// what is not a number counts as infinite.
pub fn quantile(values: &[f64], fraction: f64) -> f64 {
    let known = |value: &f64| if value.is_nan() { f64::INFINITY } else { *value };
    let mut values: Vec<f64> = values.iter().map(known).collect();
    rank::quantile(&mut values, fraction).unwrap_or(f64::NAN)
}

/// A figure over that of another bead; infinite where the other one was not reached.
pub const fn ratio(figure: f64, other: f64) -> f64 {
    if other.is_finite() { figure / other } else { f64::INFINITY }
}

/// The rows as plain text.
pub fn plain(rows: &[CaseRow]) -> String {
    let case_width = rows.iter().map(|row| row.case.chars().count()).max().unwrap_or(0);
    let quantity_width = rows.iter().map(|row| row.quantity.chars().count()).max().unwrap_or(0);
    let line = |row: &CaseRow| {
        let value = row.value.map_or("never".to_owned(), |value| format!("{value:.4}"));
        let confidence = row.confidence.map_or(String::new(), |half| format!("±{half:.4}"));
        let required = if row.required.is_finite() {
            format!("at most {:.4}", row.required)
        } else {
            String::new()
        };
        let met = if row.is_met() { "" } else { "  MISSED" };
        format!(
            "{:case_width$}  {:18}  {:quantity_width$}  {value:>10} {confidence:8} {:5}  {required}{met}\n",
            row.case, row.cell, row.quantity, row.unit
        )
    };
    rows.iter().map(line).collect()
}
