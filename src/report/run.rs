//! `report.html` of a run: one page that refers to no other file.

mod charts;
mod contents;
mod distance;
mod extruder;
mod headline;
mod page;
mod remedies;
mod sections;

pub use page::RunPage;

#[cfg(test)]
mod tests;
