//! `report.html` of a run: one page that needs nothing but itself.

mod charts;
mod contents;
mod distance;
mod extruder;
mod headline;
mod layout;
mod page;
mod remedies;
mod sections;

pub use page::RunPage;

#[cfg(test)]
mod tests;
