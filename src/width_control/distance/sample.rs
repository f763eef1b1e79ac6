//! A width with the speed at which that piece of bead was laid.

use std::ops::Range;

use super::width_model::WidthObservation;
use crate::core::Mm;
use crate::width_control::speed_history::SpeedHistory;

/// Smallest relative standard deviation of a width: between two reports the speed is not
/// known exactly.
const MIN_RELATIVE_SIGMA: f64 = 5e-4;
/// Fraction of a change of the flow that a model does not predict. Derived: 1 − 0.8326, what the
/// model of bcs-thesis, § 3.3.2, with an NRMSE fit of 83.26 % leaves of the standard deviation.
const UNMODELLED_RATIO: f64 = 0.17;
/// Largest relative standard deviation by the flow that a model does not predict; a width with
/// more says more about the flow's transient than about the bead.
const MAX_UNMODELLED_SIGMA: f64 = 0.03;

/// The piece of bead over which a width is the mean.
#[derive(Debug, Clone, Copy, PartialEq)]
#[expect(clippy::struct_field_names, reason = "all in millimetres")]
pub struct GaugeInterval {
    /// Its middle along the path \[mm\].
    pub centre_mm: f64,
    /// Its length \[mm\].
    pub length_mm: f64,
    /// Error of its middle that is allowed for \[mm\].
    pub centre_tolerance_mm: f64,
}

/// A measured width.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WidthReading {
    /// Mean width over the gauge.
    pub width: Mm,
    /// Its standard deviation.
    pub sigma: Mm,
}

/// A width with the position, time and speed at which that bead was laid.
#[derive(Debug, Clone, PartialEq)]
pub struct MatchedWidth {
    /// Middle of the gauge along the path \[mm\].
    pub position_mm: f64,
    /// When the nozzle laid the bead in the gauge \[s\].
    pub laid_s: Range<f64>,
    /// The width. Its variance is that of the measurement and of the unmodelled flow.
    pub observation: WidthObservation,
}

impl MatchedWidth {
    /// Matches a width to the speeds of its gauge, for an exponent of the bead. `None` where
    /// the speed history does not reach, and where the flow was in a transient larger than
    /// [`MAX_UNMODELLED_SIGMA`] allows.
    pub fn new(
        history: &SpeedHistory,
        gauge: GaugeInterval,
        reading: WidthReading,
        exponent: f64,
    ) -> Option<Self> {
        let (position_mm, half) = (gauge.centre_mm, 0.5 * gauge.length_mm);
        let (start, end) = (position_mm - half, position_mm + half);
        let over = history.mean_over(start, end)?;
        let differs = |by: f64| Some(history.mean_near(start + by, end + by)?.mean - over.mean);
        let ln_speed_beside =
            [differs(gauge.centre_tolerance_mm)?, differs(-gauge.centre_tolerance_mm)?];
        let unmodelled = UNMODELLED_RATIO * history.flow_change_over(start, end)?;
        if unmodelled > MAX_UNMODELLED_SIGMA {
            return None;
        }
        let (width, sigma) = (reading.width.get(), reading.sigma.get());
        let relative = [sigma / width, MIN_RELATIVE_SIGMA, unmodelled];
        let observation = WidthObservation {
            // The mean of v^−b exceeds v^−b of the mean ln v: Jensen, to second order.
            ln_width: libm::log(width) - 0.5 * exponent * exponent * over.variance,
            ln_speed: over.mean,
            ln_speed_beside,
            variance: relative.iter().map(|sigma| sigma * sigma).sum(),
        };
        Some(Self {
            position_mm,
            laid_s: history.time_at(start)?..history.time_at(end)?,
            observation,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn speed_history() -> SpeedHistory {
        let mut history = SpeedHistory::new(100.0, 1e3);
        for k in 0..60 {
            let at = 0.02 * f64::from(k);
            let (first, second) = (at.min(0.6), (at - 0.6).max(0.0));
            let speed = if second > 0.0 { 60.0 } else { 100.0 };
            history.report(at, 100.0 * first + 60.0 * second, speed, 1.0);
        }
        history
    }

    fn sample_at(position: f64) -> MatchedWidth {
        let gauge =
            GaugeInterval { centre_mm: position, length_mm: 10.0, centre_tolerance_mm: 5.0 };
        let reading = WidthReading { width: Mm::constant(40.0), sigma: Mm::constant(0.4) };
        MatchedWidth::new(&speed_history(), gauge, reading, 0.25).unwrap()
    }

    #[test]
    fn far_from_a_change_of_speed_the_offset_makes_no_difference() {
        let before = sample_at(40.0);
        let WidthObservation { ln_speed, ln_speed_beside, variance, .. } = before.observation;
        assert!(ln_speed_beside == [0.0; 2] && ln_speed.abs() < 1e-9);
        assert!(
            (before.laid_s.start - 0.35).abs() < 1e-9 && (before.laid_s.end - 0.45).abs() < 1e-9
        );
        assert!((variance - (1e-4 + 2.5e-7)).abs() < 1e-12);
    }

    #[test]
    fn at_a_change_of_speed_the_offset_decides_on_which_side_the_gauge_lies() {
        let at = sample_at(60.0);
        let half = 0.5 * 0.6_f64.ln();
        let [ahead, behind] = at.observation.ln_speed_beside;
        assert!((ahead - half).abs() < 1e-9 && (behind + half).abs() < 1e-9, "{at:?}");
    }

    #[test]
    fn the_width_within_the_gauge_is_the_mean_of_the_powers() {
        let at = sample_at(60.0);
        let mean: f64 = 0.5 * (1.0 + 0.6_f64.powf(-0.25));
        let predicted = -0.25 * at.observation.ln_speed;
        let found = mean.ln() - (40.0_f64.ln() - at.observation.ln_width);
        assert!((found - predicted).abs() < 1e-4, "{found} {predicted}");
    }
}
