//! The summary of the distance controller.

use serde::Serialize;

use crate::control::Step;
use crate::rows::names;
use crate::width_control::distance::WidthUse;
use crate::width_control::{DistanceTrace, FallbackReason};

/// Number of widths by their use, and the last estimates.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct DistanceSummary {
    /// Widths that were used.
    pub samples_used: u64,
    /// Widths that were rejected as outliers.
    pub outliers: u64,
    /// Detected changes of the flow.
    pub changes: u64,
    /// Widths without a known speed at which their bead was laid.
    pub without_speed_history: u64,
    /// Width at the start speed \[mm\].
    pub level_mm: f64,
    /// Standard deviation of that width \[mm\].
    pub level_sigma_mm: f64,
    /// Exponent b.
    pub exponent: f64,
    /// Period of a detected pulsation \[s\]; `None` if there is none.
    pub pulsation_s: Option<f64>,
    /// Why the PI controller took over; `None` if it did not.
    pub fallback_reason: Option<FallbackReason>,
}

impl DistanceSummary {
    /// The figures in a sentence or two.
    pub fn words(&self) -> String {
        let Self { samples_used, outliers, changes, level_mm, exponent, .. } = self;
        let pulsation = self.pulsation_s.map_or(String::new(), |period| {
            format!(" The flow pulsates with a period of {period:.2} s.")
        });
        let fallback = self.fallback_reason.map_or(String::new(), |why| {
            format!(" The PI controller took over: {}.", names::fallback(why))
        });
        format!(
            "Widths used {samples_used}, outliers {outliers}, changes of the flow {changes}. Last estimates: \
             {level_mm:.2} mm wide at the start speed, b = \
             {exponent:.3}.{pulsation}{fallback}"
        )
    }
}

/// Counts the uses of widths.
#[derive(Debug, Clone, Copy, Default)]
pub struct DistanceTally {
    counts: [u64; 4],
    last: Option<DistanceTrace>,
    fallback: Option<FallbackReason>,
}

impl DistanceTally {
    /// Adds a step of the controller.
    pub fn step(&mut self, step: &Step) {
        self.fallback = self.fallback.or(step.trace.fallback);
        let Some(trace) = step.trace.distance else { return };
        let which = match trace.use_of_width {
            WidthUse::Taken => 0,
            WidthUse::Outlier => 1,
            WidthUse::Change => 2,
            WidthUse::NotMatched => 3,
        };
        self.counts[which] += 1;
        self.last = Some(trace);
    }

    /// The summary; `None` where no width has reached a distance controller.
    pub fn finish(&self) -> Option<DistanceSummary> {
        let last = self.last?;
        let [taken, outliers, changes, not_matched] = self.counts;
        Some(DistanceSummary {
            samples_used: taken,
            outliers,
            changes,
            without_speed_history: not_matched,
            level_mm: last.level_mm.get(),
            level_sigma_mm: last.level_sigma_mm.get(),
            exponent: last.exponent,
            pulsation_s: last.pulsation_s,
            fallback_reason: self.fallback,
        })
    }
}
