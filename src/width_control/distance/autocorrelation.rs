//! Autocorrelation of widths that should be independent. A rough bead and an unsteady flow
//! show in every width that covers the same piece, so that ten frames of it say no more than
//! one.
//!
//! For every width its normalised innovation is multiplied with itself and with those of the
//! widths within one and a half gauges before it. The mean of the first, less one, and twice
//! that of the others say by how much the noise of long means exceeds that of independent
//! widths. What widths further back show of the same kind is subtracted: that is a drift of
//! the flow, which is to be followed.

use std::collections::VecDeque;

use super::width_model::WidthInnovation;

/// Within this many gauges lie the widths that show the same piece of bead ...
const SAME_PIECE_GAUGES: f64 = 1.5;
/// ... and within these those that tell how a wandering flow would look.
const DRIFT_GAUGES: (f64, f64) = (2.0, 3.5);
/// Surprises that are kept.
const MAX_INNOVATIONS: usize = 64;
/// Gauges of way over which is forgotten what was found, and as many as count for
/// independent widths before anything was seen.
const MEMORY_GAUGES: f64 = 30.0;
const PRIOR_GAUGES: f64 = 15.0;
/// What independent widths reach by chance.
const CHANCE_CORRELATION: f64 = 0.75;
/// Most by which the noise is taken for larger, as a variance.
const MAX_INFLATION: f64 = 60.0;
/// Most of a surprise that counts, in standard deviations.
const MAX_INNOVATION_SIGMAS: f64 = 3.0;

/// The last surprises, and how far they hang together.
#[derive(Debug, Clone, PartialEq)]
pub struct NoiseAutocorrelation {
    gauge_mm: f64,
    innovations: VecDeque<(f64, f64)>,
    /// By how much the variance of one width is larger than foretold.
    excess_variance: f64,
    /// By how much that of many is, besides.
    correlated_variance: f64,
    /// Gauges of way over which that was seen.
    gauges: f64,
}

impl NoiseAutocorrelation {
    /// Independent until it shows otherwise, for a gauge \[mm\].
    pub fn new(gauge_mm: f64) -> Self {
        Self {
            gauge_mm,
            innovations: VecDeque::with_capacity(MAX_INNOVATIONS),
            excess_variance: 0.0,
            correlated_variance: 0.0,
            gauges: 0.0,
        }
    }

    /// A new bead, or a flow that has changed: what comes does not belong to what was.
    pub fn reset(&mut self) {
        self.innovations.clear();
    }

    /// How many times larger the variance of a width is to be taken, so that many of them
    /// together say what they do.
    pub fn inflation(&self) -> f64 {
        1.0 + (self.excess_variance + self.correlated_variance - CHANCE_CORRELATION)
            .clamp(0.0, MAX_INFLATION)
    }

    /// The same without that by which one width alone scatters more than foretold, which
    /// may be a pulsation that is not yet known.
    pub fn correlated_inflation(&self) -> f64 {
        1.0 + (self.correlated_variance - CHANCE_CORRELATION).clamp(0.0, MAX_INFLATION)
    }

    /// Takes the surprise at a place \[mm\], in the variance that it would have if widths
    /// were independent.
    pub fn update(&mut self, position_mm: f64, innovation: WidthInnovation) {
        let here = (innovation.by / innovation.variance.sqrt())
            .clamp(-MAX_INNOVATION_SIGMAS, MAX_INNOVATION_SIGMAS);
        let gauge = self.gauge_mm.max(1e-6);
        let (mut near, mut count, mut far, mut others) = (0.0, 0.0, 0.0, 0.0);
        for (position, there) in &self.innovations {
            let gauges = (position_mm - position) / gauge;
            if gauges <= SAME_PIECE_GAUGES {
                near += there;
                count += 1.0;
            } else if (DRIFT_GAUGES.0..DRIFT_GAUGES.1).contains(&gauges) {
                far += there;
                others += 1.0;
            }
        }
        let step = self.innovations.back().map_or(0.0, |(last, _)| (position_mm - last).max(0.0));
        if others > 0.0 {
            let drift = far / others;
            let alone = here * (here - drift) - 1.0;
            let together = 2.0 * here * (near - count * drift);
            self.gauges += step / gauge;
            let weight = (step / gauge / MEMORY_GAUGES.min(PRIOR_GAUGES + self.gauges)).min(1.0);
            self.excess_variance += weight * (alone - self.excess_variance);
            self.correlated_variance += weight * (together - self.correlated_variance);
        }
        if self.innovations.len() == MAX_INNOVATIONS {
            self.innovations.pop_front();
        }
        self.innovations.push_back((position_mm, here));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::hash;

    const GAUGE_MM: f64 = 12.0;
    const STEP_MM: f64 = 2.0;

    /// After four metres of widths with noise and with a bead that is rough by a share of
    /// it, within a length.
    fn after(rough: f64, length_mm: f64, wave: impl Fn(f64) -> f64) -> NoiseAutocorrelation {
        let mut autocorrelation = NoiseAutocorrelation::new(GAUGE_MM);
        let kept = (-STEP_MM / length_mm).exp();
        let mut course = 0.0;
        for k in 0..2000_u32 {
            let position = STEP_MM * f64::from(k);
            let [noise, fresh] = hash::normal_pair(hash::mix(&[11, u64::from(k)]));
            course = kept * course + (1.0 - kept * kept).sqrt() * fresh;
            let by = noise + rough * course + wave(position);
            autocorrelation.update(position, WidthInnovation { by, variance: 1.0 });
        }
        autocorrelation
    }

    #[test]
    fn widths_that_are_independent_count_as_they_are() {
        assert!(after(0.0, 8.0, |_| 0.0).inflation() < 1.6);
        assert!(NoiseAutocorrelation::new(GAUGE_MM).inflation() == 1.0);
    }

    #[test]
    fn a_rough_bead_counts_as_much_less_as_its_long_means_scatter_more() {
        // Noise of long means: 1 + (1 + κ)/(1 − κ), with κ from one width to the next.
        let kept = (-STEP_MM / 8.0_f64).exp();
        let expected = 1.0 + (1.0 + kept) / (1.0 - kept);
        let found = after(1.0, 8.0, |_| 0.0).inflation();
        assert!((0.6..1.4).contains(&(found / expected)), "{found} {expected}");
    }

    #[test]
    fn a_flow_that_wanders_slowly_is_no_rough_bead() {
        let slow = |position: f64| 2.0 * (position / 300.0).sin();
        assert!(after(0.0, 8.0, slow).inflation() < 2.5);
    }

    #[test]
    fn a_change_of_the_flow_takes_what_was_before_with_it() {
        let mut autocorrelation = after(0.0, 8.0, |_| 0.0);
        let before = autocorrelation.inflation();
        autocorrelation.reset();
        for k in 0..6 {
            autocorrelation.update(
                4000.0 + STEP_MM * f64::from(k),
                WidthInnovation { by: 9.0, variance: 1.0 },
            );
        }
        assert_eq!(autocorrelation.inflation(), before);
    }
}
