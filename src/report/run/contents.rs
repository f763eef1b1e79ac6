//! What the page of a run is made of.

use super::charts::Charts;
use crate::extruder::Drive;
use crate::numeric::statistics::Distribution;
use crate::report::picker::Chosen;
use crate::rows::summary::Summary;
use crate::width_control::limiter::Limits;

/// Everything that a page is made of.
#[derive(Debug)]
pub struct Report<'a> {
    /// The page's title.
    pub title: &'a str,
    /// Names and values under the title.
    pub about: &'a [(String, String)],
    /// Share of refused frames that the cell bears.
    pub max_rejected_share: f64,
    /// What it came to.
    pub summary: &'a Summary,
    /// What the plots show.
    pub charts: &'a Charts,
    /// What setpoints may be; none without a controller.
    pub limits: Option<Limits>,
    /// What the extruder is told; none where it goes its own way.
    pub extruder: Option<Drive>,
    /// Latencies \[ms\]; none without a controller.
    pub latencies: Option<&'a Distribution>,
    /// Frames with their edges.
    pub pictures: &'a [Chosen],
    /// What else the reader should know.
    pub remarks: &'a [String],
}
