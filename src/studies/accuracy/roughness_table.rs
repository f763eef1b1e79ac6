//! Figures of roughness over successive frames.

use std::ops::Range;

use serde::Serialize;

use super::fraction;
use super::table::{FigureRow, number, verdict};
use crate::numeric::statistics::Moments;

/// Largest relative median error of the roughness.
const MAX_ROUGHNESS_ERROR: f64 = 0.20;
/// Largest relative median error of the correlation length.
const MAX_LENGTH_ERROR: f64 = 0.30;
/// Limits of the root mean square of a width's error against the bead's own mean width, over sigma
/// with roughness.
const Z_RANGE: (f64, f64) = (0.85, 1.15);
/// Parts of the range of correlation lengths.
const LENGTH_PARTS: [&str; 3] = ["short waves", "middle waves", "long waves"];

/// The outcome of one bead.
#[derive(Debug, Clone, PartialEq)]
pub struct BeadOutcome {
    /// True correlation length \[px\].
    pub length_px: f64,
    /// The estimate from its frames; `None` if they do not determine it.
    pub estimate: Option<RoughnessEstimate>,
    /// Error of each measured frame against the bead's own mean width \[px\].
    pub widths: Vec<OwnMeanError>,
}

/// Estimate from successive frames over the true value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RoughnessEstimate {
    /// Roughness.
    pub roughness: Ratio,
    /// Correlation length.
    pub length: Ratio,
    /// Standard deviation of the mean width over a gauge about the bead's own mean \[px\].
    pub gauge_mean_sigma_px: f64,
}

/// An estimate over its true value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ratio {
    /// Estimated over true.
    pub value: f64,
    /// Standard deviation of the estimate over the estimate.
    pub sigma: f64,
}

/// Error of a frame's width against the bead's own mean width \[px\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OwnMeanError {
    /// Measured less own mean.
    pub error_px: f64,
    /// Standard deviation that the measurement reports, without roughness.
    pub sigma_px: f64,
}

/// Figures of some beads.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RoughnessFigures {
    /// Motion of the bead from frame to frame \[px\].
    pub advance_px: usize,
    /// Name of the part of the beads, by correlation length.
    pub part: &'static str,
    /// Number of beads.
    pub beads: usize,
    /// Fraction whose roughness was determined.
    pub determined_fraction: f64,
    /// Median of estimated over true roughness.
    pub roughness_median: Option<f64>,
    /// Median of |estimated/true − 1|; a bead without an estimate counts as 1.
    pub roughness_error: Option<f64>,
    /// Root mean square of the error of the roughness' logarithm over its sigma.
    pub roughness_z: Option<f64>,
    /// Median of estimated over true correlation length.
    pub length_median: Option<f64>,
    /// As [`Self::roughness_error`], for the correlation length.
    pub length_error: Option<f64>,
    /// As [`Self::roughness_z`], for the correlation length.
    pub length_z: Option<f64>,
    /// Measured frames of the beads with an estimate.
    pub frames: u64,
    /// Root mean square of a width's error against the bead's own mean width, over sigma with
    /// roughness.
    pub width_z: Option<f64>,
    /// As [`Self::width_z`], over sigma without roughness.
    pub width_z_alone: Option<f64>,
    /// The limits that are missed.
    pub missed: Vec<String>,
}

/// Figures over all beads and within each third of the range of correlation lengths \[px\], equal
/// in the logarithm. The limits apply to all beads.
pub fn figures(
    advance_px: usize,
    outcomes: &[BeadOutcome],
    lengths_px: Range<f64>,
) -> Vec<RoughnessFigures> {
    let Range { start: from, end: to } = lengths_px;
    let every: Vec<&BeadOutcome> = outcomes.iter().collect();
    let mut all = RoughnessFigures::of(advance_px, "all", &every);
    all.missed = all.misses();
    let mut parts = vec![all];
    for (number, part) in (0u32..).zip(LENGTH_PARTS) {
        let end = |number: u32| from * libm::pow(to / from, f64::from(number) / 3.0);
        let within = end(number)..end(number + 1);
        let some: Vec<&BeadOutcome> =
            outcomes.iter().filter(|outcome| within.contains(&outcome.length_px)).collect();
        parts.push(RoughnessFigures::of(advance_px, part, &some));
    }
    parts
}

impl RoughnessFigures {
    fn of(advance_px: usize, part: &'static str, outcomes: &[&BeadOutcome]) -> Self {
        let (mut widths, mut alone) = (Moments::default(), Moments::default());
        for outcome in outcomes {
            let Some(found) = outcome.estimate else { continue };
            for width in &outcome.widths {
                widths.add(width.error_px / width.sigma_px.hypot(found.gauge_mean_sigma_px));
                alone.add(width.error_px / width.sigma_px);
            }
        }
        let of = |ratio: fn(&RoughnessEstimate) -> Ratio| {
            let found = |outcome: &&BeadOutcome| outcome.estimate.as_ref().map(ratio);
            let errors = outcomes
                .iter()
                .map(|outcome| found(outcome).map_or(1.0, |ratio| (ratio.value - 1.0).abs()));
            let found: Vec<Ratio> = outcomes.iter().filter_map(found).collect();
            let mut z = Moments::default();
            for ratio in &found {
                z.add(ratio.value.ln() / ratio.sigma);
            }
            (median(found.iter().map(|ratio| ratio.value)), median(errors), z.rms())
        };
        let (roughness_median, roughness_error, roughness_z) = of(|found| found.roughness);
        let (length_median, length_error, length_z) = of(|found| found.length);
        let determined = outcomes.iter().filter(|outcome| outcome.estimate.is_some()).count();
        Self {
            advance_px,
            part,
            beads: outcomes.len(),
            determined_fraction: fraction(determined, outcomes.len()),
            roughness_median,
            roughness_error,
            roughness_z,
            length_median,
            length_error,
            length_z,
            frames: widths.count(),
            width_z: widths.rms(),
            width_z_alone: alone.rms(),
            missed: Vec::new(),
        }
    }

    fn misses(&self) -> Vec<String> {
        let errors = [
            ("roughness", self.roughness_error, MAX_ROUGHNESS_ERROR),
            ("length", self.length_error, MAX_LENGTH_ERROR),
        ];
        let missed = errors.into_iter().filter_map(|(name, error, most)| {
            let error = error.filter(|error| *error > most)?;
            Some(format!("median error of {name} {error:.2} > {most}"))
        });
        let of_width = self.width_z.filter(|z| !(Z_RANGE.0..=Z_RANGE.1).contains(z));
        let of_width = of_width.map(|z| format!("z {z:.2}, not {} to {}", Z_RANGE.0, Z_RANGE.1));
        missed.chain(of_width).collect()
    }
}

fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

impl FigureRow for RoughnessFigures {
    const HEADS: &str = "part|moves on px|beads|determined %|roughness found/true|median error %|z|\
                         length found/true|median error %|z|frames|z of widths|without roughness|\
                         limits";

    fn cells(&self) -> Vec<String> {
        let percent = |value: Option<f64>| number(value.map(|value| 100.0 * value), 1);
        let judged = self.part == "all" || !self.missed.is_empty();
        vec![
            self.part.to_owned(),
            self.advance_px.to_string(),
            self.beads.to_string(),
            percent(Some(self.determined_fraction)),
            number(self.roughness_median, 2),
            percent(self.roughness_error),
            number(self.roughness_z, 2),
            number(self.length_median, 2),
            percent(self.length_error),
            number(self.length_z, 2),
            self.frames.to_string(),
            number(self.width_z, 2),
            number(self.width_z_alone, 1),
            if judged { verdict(&self.missed) } else { "–".to_owned() },
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_those_of_medians_and_of_widths_against_the_own_mean() {
        let ratio = |value: f64| Ratio { value, sigma: 0.1 };
        let bead = |value: f64, error_px: f64| BeadOutcome {
            length_px: 10.0,
            estimate: Some(RoughnessEstimate {
                roughness: ratio(value),
                length: ratio(1.0),
                gauge_mean_sigma_px: 0.4,
            }),
            widths: vec![OwnMeanError { error_px, sigma_px: 0.3 }; 2],
        };
        let of = |beads: &[BeadOutcome]| figures(10, beads, 3.0..40.0)[0].missed.join(";");
        let good = [bead(0.9, 0.5), bead(1.1, -0.5), bead(1.0, 0.5)];
        assert_eq!(of(&good), "");
        let rough = [bead(1.3, 0.5), bead(1.4, -0.5), bead(1.0, 0.5)];
        assert_eq!(of(&rough), "median error of roughness 0.30 > 0.2");
        let far = [bead(1.0, 0.6), bead(1.0, -0.6), bead(1.0, 0.6)];
        assert_eq!(of(&far), "z 1.20, not 0.85 to 1.15");
        let open = BeadOutcome { estimate: None, ..bead(1.0, 0.5) };
        assert!(of(&[open.clone(), open, bead(1.0, 0.5)]).contains("length 1.00 > 0.3"));
    }
}
