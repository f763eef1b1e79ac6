//! A width with the speed at which that piece of bead was laid.

use super::speed_history::Trail;
use super::width_model::Surprise;

/// Relative standard deviation that is left in a width however well it was
/// measured: between two reports nobody knows the speed exactly.
const FLOOR: f64 = 5e-4;
/// Share of a change of the flow that no model tells (bead characterisation thesis: 17 %
/// of its standard deviation), and how much of that a width may have and still tell
/// something.
const UNTOLD: f64 = 0.17;
const MOST_UNTOLD: f64 = 0.03;
/// Variance by a doubtful offset, over that of the width, from which a pairing
/// teaches nothing about the exponent.
const DOUBTFUL: f64 = 0.5;
/// The same from which it tells nothing about changes of the flow.
const BLIND: f64 = 4.0;

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
pub struct Pairing {
    /// Middle of the gauge along the path \[mm\].
    pub place_mm: f64,
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
    pub doubt: f64,
}

impl Pairing {
    /// Of a width beside the speeds of its gauge, for an exponent of the bead. `None`
    /// where the trail does not reach, and where the flow had been changed so far that the
    /// width says more of that than of the bead.
    pub fn of(
        trail: &Trail,
        gauge: GaugeInterval,
        measured: Measured,
        exponent: f64,
    ) -> Option<Self> {
        let GaugeInterval { centre_mm: place_mm, length_mm, centre_tolerance_mm: off_mm } = gauge;
        let Measured { width_mm: width, sigma_mm: sigma } = measured;
        let half = 0.5 * length_mm;
        let over = trail.over(place_mm - half, place_mm + half)?;
        let beside = |by: f64| trail.near(place_mm - half + by, place_mm + half + by);
        let change = beside(off_mm)?.mean - beside(-off_mm)?.mean;
        let untold = UNTOLD * trail.changed_over(place_mm - half, place_mm + half)?;
        if untold > MOST_UNTOLD {
            return None;
        }
        let share = sigma / width;
        Some(Self {
            place_mm,
            laid_s: trail.time_at(place_mm)?,
            // The mean of v^−b is more than that of the mean speed.
            ln_width: libm::log(width) - 0.5 * exponent * exponent * over.variance,
            ln_speed: over.mean,
            noise: share * share + FLOOR * FLOOR + untold * untold,
            doubt: 0.5 * exponent * change,
        })
    }

    /// Variance of `ln_width`.
    pub fn variance(&self) -> f64 {
        self.noise + self.doubt * self.doubt
    }

    /// Whether it should not teach anything about the exponent.
    pub fn is_doubtful(&self) -> bool {
        self.doubt * self.doubt > DOUBTFUL * self.noise
    }

    /// Whether it tells nothing about changes of the flow.
    pub fn is_blind(&self) -> bool {
        self.doubt * self.doubt > BLIND * self.noise
    }
}

/// Time over which unrest is forgotten \[s\].
const MEMORY_S: f64 = 1.5;
/// Most of a squared surprise that counts: one outlier is no unrest.
const MOST: f64 = 4.0;
/// Mean of that for a normal number. For min(z², 4) of a standard normal z it is 0.9205;
/// this value is too small by a tenth, and so the limits below are reached earlier.
const USUAL: f64 = 0.83;
/// Unrest up to which the flow counts as calm.
const CALM: f64 = 1.8;
/// Unrest from which no width is an outlier.
const GREAT: f64 = 3.0;

/// How much more than foretold widths scatter: 1 where they do as the model
/// says, some 5 where something moves the flow that it does not know.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unrest {
    value: f64,
    last_s: Option<f64>,
}

impl Default for Unrest {
    fn default() -> Self {
        Self { value: 1.0, last_s: None }
    }
}

impl Unrest {
    /// Takes a surprise at a bead laid at a time \[s\]. `share` is the width's
    /// own part in its variance: what is not known yet surprises nobody.
    pub fn note(&mut self, laid_s: f64, surprise: Surprise, share: f64) {
        let passed = self.last_s.map_or(0.0, |last| (laid_s - last).max(0.0));
        self.last_s = Some(laid_s);
        let weight = -libm::expm1(-passed / MEMORY_S) * share.min(1.0);
        self.value += weight * (surprise.squared().min(MOST) / USUAL - self.value);
    }

    /// Whether widths scatter as they should.
    pub fn is_calm(&self) -> bool {
        self.value < CALM
    }

    /// Whether most widths are far from what is foretold.
    pub fn is_great(&self) -> bool {
        self.value > GREAT
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trail() -> Trail {
        let mut trail = Trail::new(100.0, 1e3);
        for k in 0..60 {
            let at = 0.02 * f64::from(k);
            let (first, second) = (at.min(0.6), (at - 0.6).max(0.0));
            let speed = if second > 0.0 { 60.0 } else { 100.0 };
            trail.report(at, 100.0 * first + 60.0 * second, speed, 1.0);
        }
        trail
    }

    fn pair(place: f64) -> Pairing {
        let gauge = GaugeInterval { centre_mm: place, length_mm: 10.0, centre_tolerance_mm: 5.0 };
        let measured = Measured { width_mm: 40.0, sigma_mm: 0.4 };
        Pairing::of(&trail(), gauge, measured, 0.25).unwrap()
    }

    #[test]
    fn far_from_a_change_there_is_no_doubt() {
        let before = pair(40.0);
        assert!(before.doubt.abs() < 1e-9 && before.ln_speed.abs() < 1e-9);
        assert!((before.laid_s - 0.4).abs() < 1e-9);
        assert!((before.noise - (1e-4 + 2.5e-7)).abs() < 1e-12);
        assert!(!before.is_doubtful());
    }

    #[test]
    fn at_a_change_the_doubt_is_half_of_what_it_makes() {
        let at = pair(60.0);
        assert!((at.doubt - 0.5 * 0.25 * 0.6_f64.ln()).abs() < 1e-9, "{at:?}");
        assert!(at.is_doubtful() && at.is_blind());
    }

    #[test]
    fn the_width_within_the_gauge_is_the_mean_of_the_powers() {
        let at = pair(60.0);
        let mean: f64 = 0.5 * (1.0 + 0.6_f64.powf(-0.25));
        let foretold = -0.25 * at.ln_speed;
        let found = mean.ln() - (40.0_f64.ln() - at.ln_width);
        assert!((found - foretold).abs() < 1e-4, "{found} {foretold}");
    }

    #[test]
    fn one_outlier_is_no_unrest_but_many_are() {
        let mut unrest = Unrest::default();
        let far = Surprise { by: 1.0, variance: 1e-4 };
        let near = Surprise { by: 0.008, variance: 1e-4 };
        for k in 0..50 {
            unrest.note(0.02 * f64::from(k), if k % 10 == 0 { far } else { near }, 1.0);
        }
        assert!(unrest.is_calm());
        for k in 50..200 {
            unrest.note(0.02 * f64::from(k), far, 1.0);
        }
        assert!(unrest.is_great());
    }
}
