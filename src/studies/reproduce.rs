//! The experiments of the source papers compared with the published numbers: a table,
//! `reproduce.json` and a page with plots. Each paper has its own folder in `studies`.

use maud::html;

use super::error::ReproduceError;
use super::publication::Publication;
use super::study::{Effort, Reproduced};
use super::{barjuei2022, bcs_thesis, diagne2015, looey2026, ma2026};
use crate::io::progress::Progress;
use crate::report::html::whole_page;
use summary::PaperSummary;

pub mod summary;
pub mod table;

type Run = fn(Effort, &mut Progress) -> Result<Reproduced, ReproduceError>;

impl Publication {
    /// The number of experiments that [`Self::run`] reports to its progress.
    pub const fn experiments(self) -> u64 {
        self.study().0
    }

    /// Runs the paper's experiments.
    pub fn run(
        self,
        effort: Effort,
        progress: &mut Progress,
    ) -> Result<Reproduced, ReproduceError> {
        (self.study().1)(effort, progress)
    }

    const fn study(self) -> (u64, Run) {
        match self {
            Self::Barjuei2022 => (barjuei2022::table::EXPERIMENTS, barjuei2022::table::run),
            Self::BcsThesis => (bcs_thesis::table::EXPERIMENTS, bcs_thesis::table::run),
            Self::Diagne2015 => (diagne2015::table::EXPERIMENTS, diagne2015::table::run),
            Self::Ma2026 => (ma2026::table::EXPERIMENTS, ma2026::table::run),
            Self::Looey2026 => (looey2026::table::EXPERIMENTS, looey2026::table::run),
        }
    }
}

/// The page of one paper or of several.
pub fn page(sources: &[Reproduced]) -> String {
    let title = match sources {
        [only] => format!("{}, reproduced", only.title),
        _ => "The sources, reproduced".to_owned(),
    };
    let body = html! {
        h1 { (title) }
        (summary::markup(sources))
        @for (at, source) in sources.iter().enumerate() {
            h1 id={ "source-" (at) } { (source.title) }
            p { (PaperSummary::of(&source.rows).text()) }
            p.hint { (source.about) }
            @for part in &source.sections {
                section {
                    h2 { (part.heading) }
                    @if !part.hint.is_empty() { p.hint { (part.hint) } }
                    (part.drawing)
                }
            }
            section {
                h2 { "All numbers" }
                div.wide { (table::markup(&source.rows)) }
            }
        }
        footer { "Written by truebead " (env!("CARGO_PKG_VERSION"))
            ". The numbers are in reproduce.json." }
    };
    whole_page(&title, &body).into_string()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::studies::study::TableRows;

    #[test]
    fn a_row_has_the_keys_that_others_rely_on() {
        let mut rows = TableRows::of(Publication::Barjuei2022);
        rows.push("44 mm", ("mean error", "mm"), [Some(1.3), Some(1.46), None]);
        let rows = rows.into_vec();
        assert_eq!(
            serde_json::to_string(&rows[0]).unwrap(),
            r#"{"seed":"barjuei2022","case":"44 mm","quantity":"mean error","unit":"mm","published":1.3,"simulated":1.46,"ours":null}"#
        );
        assert!(table::plain(&rows).contains("1.46"));
    }

    #[test]
    fn every_source_has_a_name_of_its_own() {
        let names: std::collections::BTreeSet<_> =
            Publication::ALL.iter().map(|s| s.name()).collect();
        assert_eq!(names.len(), Publication::ALL.len());
    }
}
