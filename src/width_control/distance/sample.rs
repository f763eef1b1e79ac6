//! A width with the speed at which that piece of bead was laid.

use super::speed_history::SpeedHistory;
use super::width_model::WidthInnovation;

/// Relative standard deviation that is left in a width however well it was
/// measured: between two reports nobody knows the speed exactly.
const MIN_RELATIVE_SIGMA: f64 = 5e-4;
/// Share of a change of the flow that no model tells (bead characterisation thesis: 17 %
/// of its standard deviation), and how much of that a width may have and still tell
/// something.
const UNMODELLED_RATIO: f64 = 0.17;
const MAX_UNMODELLED_SIGMA: f64 = 0.03;
/// Variance by a doubtful offset, over that of the width, from which a pairing
/// teaches nothing about the exponent.
const MAX_EXPONENT_OFFSET_VARIANCE: f64 = 0.5;
/// The same from which it tells nothing about changes of the flow.
const MAX_FLOW_OFFSET_VARIANCE: f64 = 4.0;

/// The piece of bead that a width is the mean of.
#[derive(Debug, Clone, Copy, PartialEq)]
#[expect(clippy::struct_field_names, reason = "they share their unit")]
pub struct GaugeInterval {
    /// Its middle along the path \[mm\].
    pub centre_mm: f64,
    /// Its length \[mm\].
    pub length_mm: f64,
    /// How far its middle may be off \[mm\].
    pub centre_tolerance_mm: f64,
}

/// A width as the camera gives it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measured {
    /// The width \[mm\].
    pub width_mm: f64,
    /// Its standard deviation \[mm\].
    pub sigma_mm: f64,
}

/// A width, where and when that bead was laid, and how fast.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WidthSample {
    /// Middle of the gauge along the path \[mm\].
    pub position_mm: f64,
    /// When the nozzle was there \[s\].
    pub laid_s: f64,
    /// Logarithm of the width, brought to that of a bead laid at the mean speed
    /// throughout.
    pub ln_width: f64,
    /// Mean of ln(v/v₀) over the gauge.
    pub ln_speed: f64,
    /// Variance of `ln_width` by the measurement.
    pub noise: f64,
    /// Standard deviation of `ln_width` by an offset that may be wrong.
    pub offset_sigma: f64,
}

impl WidthSample {
    /// Of a width beside the speeds of its gauge, for an exponent of the bead. `None`
    /// where the trail does not reach, and where the flow had been changed so far that the
    /// width says more of that than of the bead.
    pub fn new(
        history: &SpeedHistory,
        gauge: GaugeInterval,
        measured: Measured,
        exponent: f64,
    ) -> Option<Self> {
        let GaugeInterval { centre_mm: position_mm, length_mm, centre_tolerance_mm: off_mm } =
            gauge;
        let Measured { width_mm: width, sigma_mm: sigma } = measured;
        let half = 0.5 * length_mm;
        let over = history.mean_over(position_mm - half, position_mm + half)?;
        let beside = |by: f64| history.mean_near(position_mm - half + by, position_mm + half + by);
        let change = beside(off_mm)?.mean - beside(-off_mm)?.mean;
        let unmodelled =
            UNMODELLED_RATIO * history.flow_change_over(position_mm - half, position_mm + half)?;
        if unmodelled > MAX_UNMODELLED_SIGMA {
            return None;
        }
        let fraction = sigma / width;
        Some(Self {
            position_mm,
            laid_s: history.time_at(position_mm)?,
            // The mean of v^−b is more than that of the mean speed.
            ln_width: libm::log(width) - 0.5 * exponent * exponent * over.variance,
            ln_speed: over.mean,
            noise: fraction * fraction
                + MIN_RELATIVE_SIGMA * MIN_RELATIVE_SIGMA
                + unmodelled * unmodelled,
            offset_sigma: 0.5 * exponent * change,
        })
    }

    /// Variance of `ln_width`.
    pub fn variance(&self) -> f64 {
        self.noise + self.offset_sigma * self.offset_sigma
    }

    /// Whether it should not teach anything about the exponent.
    pub fn is_offset_sensitive(&self) -> bool {
        self.offset_sigma * self.offset_sigma > MAX_EXPONENT_OFFSET_VARIANCE * self.noise
    }

    /// Whether it tells nothing about changes of the flow.
    pub fn is_uninformative(&self) -> bool {
        self.offset_sigma * self.offset_sigma > MAX_FLOW_OFFSET_VARIANCE * self.noise
    }
}

/// Time over which unrest is forgotten \[s\].
const NIS_TIME_CONSTANT_S: f64 = 1.5;
/// Most of a squared surprise that counts: one outlier is no unrest.
const MAX_NIS: f64 = 4.0;
/// Mean of that for a normal number. For min(z², 4) of a standard normal z it is 0.9205;
/// this value is too small by a tenth, and so the limits below are reached earlier.
const EXPECTED_CLIPPED_NIS: f64 = 0.83;
/// Unrest up to which the flow counts as calm.
const MAX_CONSISTENT_NIS: f64 = 1.8;
/// Unrest from which no width is an outlier.
const MIN_INCONSISTENT_NIS: f64 = 3.0;

/// How much more than foretold widths scatter: 1 where they do as the model
/// says, some 5 where something moves the flow that it does not know.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConsistencyMonitor {
    nis: f64,
    last_s: Option<f64>,
}

impl Default for ConsistencyMonitor {
    fn default() -> Self {
        Self { nis: 1.0, last_s: None }
    }
}

impl ConsistencyMonitor {
    /// Takes a surprise at a bead laid at a time \[s\]. `share` is the width's
    /// own part in its variance: what is not known yet surprises nobody.
    pub fn update(&mut self, laid_s: f64, innovation: WidthInnovation, fraction: f64) {
        let passed = self.last_s.map_or(0.0, |last| (laid_s - last).max(0.0));
        self.last_s = Some(laid_s);
        let weight = -libm::expm1(-passed / NIS_TIME_CONSTANT_S) * fraction.min(1.0);
        self.nis += weight
            * (innovation.normalised_squared().min(MAX_NIS) / EXPECTED_CLIPPED_NIS - self.nis);
    }

    /// Whether widths scatter as they should.
    pub fn is_consistent(&self) -> bool {
        self.nis < MAX_CONSISTENT_NIS
    }

    /// Whether most widths are far from what is foretold.
    pub fn is_inconsistent(&self) -> bool {
        self.nis > MIN_INCONSISTENT_NIS
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trail() -> SpeedHistory {
        let mut history = SpeedHistory::new(100.0, 1e3);
        for k in 0..60 {
            let at = 0.02 * f64::from(k);
            let (first, second) = (at.min(0.6), (at - 0.6).max(0.0));
            let speed = if second > 0.0 { 60.0 } else { 100.0 };
            history.report(at, 100.0 * first + 60.0 * second, speed, 1.0);
        }
        history
    }

    fn pair(position: f64) -> WidthSample {
        let gauge =
            GaugeInterval { centre_mm: position, length_mm: 10.0, centre_tolerance_mm: 5.0 };
        let measured = Measured { width_mm: 40.0, sigma_mm: 0.4 };
        WidthSample::new(&trail(), gauge, measured, 0.25).unwrap()
    }

    #[test]
    fn far_from_a_change_there_is_no_doubt() {
        let before = pair(40.0);
        assert!(before.offset_sigma.abs() < 1e-9 && before.ln_speed.abs() < 1e-9);
        assert!((before.laid_s - 0.4).abs() < 1e-9);
        assert!((before.noise - (1e-4 + 2.5e-7)).abs() < 1e-12);
        assert!(!before.is_offset_sensitive());
    }

    #[test]
    fn at_a_change_the_doubt_is_half_of_what_it_makes() {
        let at = pair(60.0);
        assert!((at.offset_sigma - 0.5 * 0.25 * 0.6_f64.ln()).abs() < 1e-9, "{at:?}");
        assert!(at.is_offset_sensitive() && at.is_uninformative());
    }

    #[test]
    fn the_width_within_the_gauge_is_the_mean_of_the_powers() {
        let at = pair(60.0);
        let mean: f64 = 0.5 * (1.0 + 0.6_f64.powf(-0.25));
        let predicted = -0.25 * at.ln_speed;
        let found = mean.ln() - (40.0_f64.ln() - at.ln_width);
        assert!((found - predicted).abs() < 1e-4, "{found} {predicted}");
    }

    #[test]
    fn one_outlier_is_no_unrest_but_many_are() {
        let mut nis = ConsistencyMonitor::default();
        let far = WidthInnovation { by: 1.0, variance: 1e-4 };
        let near = WidthInnovation { by: 0.008, variance: 1e-4 };
        for k in 0..50 {
            nis.update(0.02 * f64::from(k), if k % 10 == 0 { far } else { near }, 1.0);
        }
        assert!(nis.is_consistent());
        for k in 50..200 {
            nis.update(0.02 * f64::from(k), far, 1.0);
        }
        assert!(nis.is_inconsistent());
    }
}
