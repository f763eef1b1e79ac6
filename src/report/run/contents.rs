//! What the page of a run is made of.

use super::charts::Charts;
use crate::extruder::CommandQuantity;
use crate::numeric::statistics::Distribution;
use crate::report::picker::ChosenFrame;
use crate::rows::summary::Summary;
use crate::width_control::limiter::SpeedLimits;

/// Everything that a page is made of.
#[derive(Debug)]
pub struct RunReport<'a> {
    /// The page's title.
    pub title: &'a str,
    /// Names and values under the title.
    pub header: &'a [(String, String)],
    /// Share of refused frames that the cell bears.
    pub max_rejected_fraction: f64,
    /// What it came to.
    pub summary: &'a Summary,
    /// What the plots show.
    pub charts: &'a Charts,
    /// What setpoints may be; none without a controller.
    pub limits: Option<SpeedLimits>,
    /// What the extruder is told; none where it goes its own way.
    pub extruder: Option<CommandQuantity>,
    /// Latencies \[ms\]; none without a controller.
    pub latencies: Option<&'a Distribution>,
    /// Frames with their edges.
    pub images: &'a [ChosenFrame],
    /// What else the reader should know.
    pub remarks: &'a [String],
}
