//! Results of a paper's experiments: rows of a table and sections of a page.

use maud::Markup;
use serde::Serialize;

use super::publication::Publication;
use crate::numeric::estimate::Estimate;

/// Seeds of the experiments; `None` stands for the study's own number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Effort {
    /// Seeds of every experiment with noise.
    pub seeds: Option<u64>,
    /// Seeds of every experiment whose frames are rendered.
    pub frame_seeds: Option<u64>,
}

/// The results of a study.
#[derive(Debug)]
pub struct Reproduced {
    /// Authors and year.
    pub title: &'static str,
    /// Plant, seeds and definitions that the table relies on.
    pub about: String,
    /// The table.
    pub rows: Vec<TableRow>,
    /// Plots, in reading order.
    pub sections: Vec<Section>,
}

/// A section of the page.
#[derive(Debug)]
pub struct Section {
    /// Its heading.
    pub heading: String,
    /// A paragraph below the heading; may be empty.
    pub hint: String,
    /// The plots.
    pub drawing: Markup,
}

impl Section {
    /// A section from its heading, hint and plots.
    pub fn new(heading: impl Into<String>, hint: impl Into<String>, drawing: Markup) -> Self {
        Self { heading: heading.into(), hint: hint.into(), drawing }
    }
}

/// One quantity of one experiment. The names of the fields are the keys of
/// `reproduce.json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TableRow {
    /// The paper, as [`Publication::name`].
    #[serde(rename = "seed")]
    pub paper: &'static str,
    /// The experiment.
    pub case: String,
    /// The measured quantity.
    pub quantity: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// The published number; `None` if the paper gives none.
    pub published: Option<f64>,
    /// The result of the paper's own method in our simulation; `None` if it does not reach the
    /// quantity.
    pub simulated: Option<f64>,
    /// The result of this program's best method on the same plant; `None` if there is none.
    pub ours: Option<f64>,
    /// Half of the 95 % confidence interval of `simulated`, where it is a mean over seeds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub simulated_confidence: Option<f64>,
    /// Half of the 95 % confidence interval of `ours`, where it is a mean over seeds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ours_confidence: Option<f64>,
}

/// The rows of one paper, collected.
#[derive(Debug)]
pub struct TableRows {
    paper: &'static str,
    rows: Vec<TableRow>,
}

/// A quantity and its unit.
type Quantity = (&'static str, &'static str);

impl TableRows {
    /// An empty table.
    pub const fn of(paper: Publication) -> Self {
        Self { paper: paper.name(), rows: Vec::new() }
    }

    /// Adds a row: the published number, the result of the paper's method, and ours.
    pub fn push(
        &mut self,
        case: impl Into<String>,
        (quantity, unit): Quantity,
        [published, simulated, ours]: [Option<f64>; 3],
    ) {
        let (paper, case) = (self.paper, case.into());
        self.rows.push(TableRow {
            paper,
            case,
            quantity,
            unit,
            published,
            simulated,
            ours,
            simulated_confidence: None,
            ours_confidence: None,
        });
    }

    /// As [`Self::push`], for means over seeds.
    pub fn means(
        &mut self,
        case: impl Into<String>,
        quantity: Quantity,
        published: Option<f64>,
        [simulated, ours]: [Option<Estimate>; 2],
    ) {
        let mean = |found: Option<Estimate>| found.map(|found| found.mean);
        self.push(case, quantity, [published, mean(simulated), mean(ours)]);
        if let Some(row) = self.rows.last_mut() {
            row.simulated_confidence = simulated.and_then(|found| found.confidence);
            row.ours_confidence = ours.and_then(|found| found.confidence);
        }
    }

    /// Adds a row without a published number.
    pub fn compare(
        &mut self,
        case: impl Into<String>,
        quantity: Quantity,
        simulated: impl Into<Option<f64>>,
        ours: impl Into<Option<f64>>,
    ) {
        self.push(case, quantity, [None, simulated.into(), ours.into()]);
    }

    /// Adds a row with our result alone.
    pub fn ours(&mut self, case: impl Into<String>, quantity: Quantity, ours: f64) {
        self.push(case, quantity, [None, None, Some(ours)]);
    }

    /// The rows.
    pub fn into_vec(self) -> Vec<TableRow> {
        self.rows
    }
}
