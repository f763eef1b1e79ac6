//! Figures of frames with random parameters: over a whole set, and within each third of each
//! range.

mod figures;
mod limits;
mod parts;
mod tables;

pub use figures::{Deviation, DrawnFigures, DrawnOutcome, FrameRejection, SetPart};
pub use parts::figures;
pub use tables::markdown;

#[cfg(test)]
mod tests;
