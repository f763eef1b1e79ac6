//! Rows of a paper's table.

use serde::Serialize;

use super::publication::Publication;

/// One quantity of one experiment.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TableRow {
    /// The source.
    pub seed: &'static str,
    /// The experiment.
    pub case: String,
    /// What was measured.
    pub quantity: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// The published number; none where the paper gives none.
    pub published: Option<f64>,
    /// What the paper's own method gives in our simulation; none where it
    /// never gets there.
    pub simulated: Option<f64>,
    /// What this program's best method gives on the same plant; none where
    /// there is none yet.
    pub ours: Option<f64>,
}

/// Rows of one source as they come.
#[derive(Debug)]
pub struct TableRows {
    seed: &'static str,
    rows: Vec<TableRow>,
}

impl TableRows {
    /// No rows yet.
    pub const fn of(source: Publication) -> Self {
        Self { seed: source.name(), rows: Vec::new() }
    }

    /// Adds a row: the case, then quantity and unit, then what is published,
    /// what the paper's method gives, and ours.
    pub fn push(
        &mut self,
        case: impl Into<String>,
        (quantity, unit): (&'static str, &'static str),
        [published, simulated, ours]: [Option<f64>; 3],
    ) {
        let (seed, case) = (self.seed, case.into());
        self.rows.push(TableRow { seed, case, quantity, unit, published, simulated, ours });
    }

    /// The rows.
    pub fn into_vec(self) -> Vec<TableRow> {
        self.rows
    }
}
