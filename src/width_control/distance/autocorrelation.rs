//! Autocorrelation of widths that should be independent. A rough bead and an unsteady flow show
//! in every width of the same piece, so that ten frames of it carry the information of one.
//!
//! For every width its normalised innovation is multiplied by itself and by those of the widths
//! within one and a half gauges before it. The mean of the first, less one, and twice the mean sum
//! of the others give the excess of the variance of long means over that of independent widths.
//! The correlation with widths farther back is subtracted: that is a drift of the flow, which is to
//! be followed.

use std::collections::VecDeque;

use super::width_model::WidthInnovation;

/// Distance within which two widths count as correlated, in gauges. Two gauges overlap up to
/// a distance of 1; the rest is for the correlation length of the bead's roughness.
const SAME_PIECE_GAUGES: f64 = 1.5;
/// Distances at which the correlation is attributed to drift of the flow, in gauges: beyond
/// the correlated ones, and near enough that a drift is still the same.
const DRIFT_GAUGES: (f64, f64) = (2.0, 3.5);
/// Innovations that are kept.
const MAX_INNOVATIONS: usize = 64;
/// Path over which the averages decay, in gauges. Longer ones follow a bead that becomes
/// rough later; shorter ones are noisier.
const MEMORY_GAUGES: f64 = 30.0;
/// Weight of the prior that widths are independent, in gauges of path.
const PRIOR_GAUGES: f64 = 15.0;
/// Excess that independent widths reach by chance, which is subtracted. A smaller value
/// inflates the noise of independent widths, a larger one ignores weak correlation.
const CHANCE_CORRELATION: f64 = 0.75;
/// Largest inflation of the variance. It bounds how slow control becomes on a rough bead.
const MAX_INFLATION: f64 = 60.0;
/// Normalised innovations are clipped here, so that one outlier is no correlation.
const MAX_INNOVATION_SIGMAS: f64 = 3.0;

/// The last innovations and their autocorrelation.
#[derive(Debug, Clone, PartialEq)]
pub struct NoiseAutocorrelation {
    gauge_mm: f64,
    innovations: VecDeque<(f64, f64)>,
    /// Mean square of a normalised innovation, less 1.
    excess_variance: f64,
    /// Twice the sum of the autocorrelations at distances within the same piece of bead.
    correlated_variance: f64,
    /// Path over which the averages were taken, in gauges.
    gauges: f64,
}

impl NoiseAutocorrelation {
    /// For a gauge \[mm\]; widths count as independent at first.
    pub fn new(gauge_mm: f64) -> Self {
        let innovations = VecDeque::with_capacity(MAX_INNOVATIONS);
        let (excess_variance, correlated_variance, gauges) = (0.0, 0.0, 0.0);
        Self { gauge_mm, innovations, excess_variance, correlated_variance, gauges }
    }

    /// A new bead, or a flow that has changed: earlier innovations say nothing about later
    /// ones.
    pub fn reset(&mut self) {
        self.innovations.clear();
    }

    /// Factor by which the variance of a width is inflated, so that an average of widths has
    /// its true variance: 1 + Σρ over all lags, with the excess variance of one width.
    pub fn inflation(&self) -> f64 {
        1.0 + (self.excess_variance + self.correlated_variance - CHANCE_CORRELATION)
            .clamp(0.0, MAX_INFLATION)
    }

    /// [`Self::inflation`] without the excess variance of one width, which may be a pulsation that
    /// is not yet known.
    pub fn correlated_inflation(&self) -> f64 {
        1.0 + (self.correlated_variance - CHANCE_CORRELATION).clamp(0.0, MAX_INFLATION)
    }

    /// Adds the innovation at a position \[mm\], with the variance that it would have if
    /// widths were independent.
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
            let excess = here * (here - drift) - 1.0;
            let correlated = 2.0 * here * (near - count * drift);
            self.gauges += step / gauge;
            let weight = (step / gauge / MEMORY_GAUGES.min(PRIOR_GAUGES + self.gauges)).min(1.0);
            self.excess_variance += weight * (excess - self.excess_variance);
            self.correlated_variance += weight * (correlated - self.correlated_variance);
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

    /// After four metres of widths with noise of 1, with a roughness over that noise and its
    /// correlation length, and with a wave of the width.
    fn after(rough: f64, length_mm: f64, wave: impl Fn(f64) -> f64) -> NoiseAutocorrelation {
        let mut autocorrelation = NoiseAutocorrelation::new(GAUGE_MM);
        let kept = (-STEP_MM / length_mm).exp();
        let mut roughness = 0.0;
        for k in 0..2000_u32 {
            let position = STEP_MM * f64::from(k);
            let [noise, fresh] = hash::normal_pair(hash::mix(&[11, u64::from(k)]));
            roughness = kept * roughness + (1.0 - kept * kept).sqrt() * fresh;
            let by = noise + rough * roughness + wave(position);
            autocorrelation.update(position, WidthInnovation { by, variance: 1.0 });
        }
        autocorrelation
    }

    #[test]
    fn independent_widths_are_not_inflated() {
        assert!(after(0.0, 8.0, |_| 0.0).inflation() < 1.6);
        assert!(NoiseAutocorrelation::new(GAUGE_MM).inflation() == 1.0);
    }

    #[test]
    fn inflation_on_a_rough_bead_is_that_of_the_variance_of_long_means() {
        // Noise of long means: 1 + (1 + κ)/(1 − κ), with κ the lag-one autocorrelation.
        let kept = (-STEP_MM / 8.0_f64).exp();
        let expected = 1.0 + (1.0 + kept) / (1.0 - kept);
        let found = after(1.0, 8.0, |_| 0.0).inflation();
        assert!((0.6..1.4).contains(&(found / expected)), "{found} {expected}");
    }

    #[test]
    fn slow_drift_of_the_flow_is_no_roughness() {
        let slow = |position: f64| 2.0 * (position / 300.0).sin();
        assert!(after(0.0, 8.0, slow).inflation() < 2.5);
    }

    #[test]
    fn a_reset_discards_earlier_innovations() {
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
