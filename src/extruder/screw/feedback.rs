//! The feed for a length of the plug. Both characteristics give a fill ratio from 0 to a largest
//! one, and at the setpoint the ratio that holds it.

use super::error::{ScrewError, positive};
use super::model::{MM_PER_M, Screw};
use crate::core::Mm;

/// Setpoint and limit of the feed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlugSetpoint {
    /// Target length of the plug x*.
    pub plug: Mm,
    /// Largest fill ratio of the feed, `v_max`, below 1.
    pub max_fill: f64,
}

/// A setpoint that is valid for a screw, in metres.
#[derive(Debug, Clone, Copy, PartialEq)]
struct CheckedSetpoint {
    plug_m: f64,
    length_m: f64,
    max_fill: f64,
    /// Fill ratio that holds the setpoint.
    holding_fill: f64,
}

impl PlugSetpoint {
    fn check(&self, screw: &Screw) -> Result<CheckedSetpoint, ScrewError> {
        let (plug_m, length_m) = (self.plug.get() / MM_PER_M, screw.length_m);
        if !(plug_m > 0.0 && plug_m < length_m) {
            let (setpoint_mm, length_mm) = (self.plug.get(), length_m * MM_PER_M);
            return Err(ScrewError::Setpoint { setpoint_mm, length_mm });
        }
        let hold = screw.holding_fill(plug_m);
        if !(self.max_fill > hold && self.max_fill < 1.0) {
            return Err(ScrewError::MaxFill { most: self.max_fill, needed: hold });
        }
        Ok(CheckedSetpoint { plug_m, length_m, max_fill: self.max_fill, holding_fill: hold })
    }

    /// Smallest slope at the setpoint, `S_min` \[1/m\]: eq. (31) without its leading x*, a misprint.
    pub fn min_slope(&self, screw: &Screw) -> Result<f64, ScrewError> {
        self.check(screw).map(|held| held.min_slope())
    }
}

impl CheckedSetpoint {
    fn min_slope(&self) -> f64 {
        let left = (self.max_fill - self.holding_fill) / self.plug_m;
        left.max(self.holding_fill / (self.length_m - self.plug_m))
    }
}

/// The positive solution a of a·height = slope·(1 − e^(−a·width)), eqs. (32)
/// and (33), for a slope above height/width. The difference of both sides is
/// convex and positive at slope/height, so that Newton's method converges monotonically from
/// there.
fn gain(slope: f64, height: f64, width: f64) -> f64 {
    let mut a = slope / height;
    for _ in 0..60 {
        let fade = libm::exp(-a * width);
        let miss = a * height - slope * (1.0 - fade);
        let next = a - miss / (height - slope * width * fade);
        if next.is_nan() || next <= 0.0 || next >= a {
            break;
        }
        a = next;
    }
    a
}

/// The paper's characteristic: two exponentials that meet at the setpoint with one slope,
/// eqs. (20) to (22).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PiecewiseExponential {
    setpoint: CheckedSetpoint,
    slope_per_m: f64,
    left_per_m: f64,
    right_per_m: f64,
    left_scale: f64,
    right_scale: f64,
}

impl PiecewiseExponential {
    /// Solves the gains for a slope at the setpoint S \[1/m\], which must be above
    /// [`PlugSetpoint::min_slope`].
    pub fn new(screw: &Screw, target: PlugSetpoint, slope_per_m: f64) -> Result<Self, ScrewError> {
        let held = target.check(screw)?;
        let least_per_m = held.min_slope();
        if !(slope_per_m > least_per_m && slope_per_m.is_finite()) {
            return Err(ScrewError::Slope { slope_per_m, least_per_m });
        }
        let rise = held.max_fill - held.holding_fill;
        let beyond = held.length_m - held.plug_m;
        let left_per_m = gain(slope_per_m, rise, held.plug_m);
        let right_per_m = gain(slope_per_m, held.holding_fill, beyond);
        Ok(Self {
            setpoint: held,
            slope_per_m,
            left_per_m,
            right_per_m,
            left_scale: rise / (1.0 - libm::exp(-left_per_m * held.plug_m)),
            right_scale: held.holding_fill / (1.0 - libm::exp(-right_per_m * beyond)),
        })
    }

    /// Gains below and above the setpoint, `a_l` and `a_r` \[1/m\].
    pub fn gains_per_m(&self) -> (f64, f64) {
        (self.left_per_m, self.right_per_m)
    }

    /// Slope at the setpoint S \[1/m\].
    pub fn slope_per_m(&self) -> f64 {
        self.slope_per_m
    }

    fn fill(&self, plug_m: f64) -> f64 {
        let off = plug_m - self.setpoint.plug_m;
        if off <= 0.0 {
            self.setpoint.holding_fill + self.left_scale * (1.0 - libm::exp(self.left_per_m * off))
        } else {
            self.setpoint.holding_fill
                - self.right_scale * (1.0 - libm::exp(-self.right_per_m * off))
        }
    }
}

/// A linear characteristic through the ratio that holds the setpoint, saturated at the limits. It
/// settles as fast as the limits allow; a steeper one is more sensitive to errors of the model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SaturatedLinear {
    setpoint: CheckedSetpoint,
    slope_per_m: f64,
}

impl SaturatedLinear {
    /// With a slope at the setpoint \[1/m\].
    pub fn new(screw: &Screw, target: PlugSetpoint, slope_per_m: f64) -> Result<Self, ScrewError> {
        let held = target.check(screw)?;
        positive("slope_per_m", slope_per_m)?;
        Ok(Self { setpoint: held, slope_per_m })
    }
}

/// A characteristic.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FillFeedback {
    /// Piecewise exponential, as in the paper.
    Exponential(PiecewiseExponential),
    /// Saturated linear.
    Saturated(SaturatedLinear),
}

impl FillFeedback {
    /// Fill ratio of the feed at a length of the plug \[m\], from 0 to the largest. A length
    /// outside the screw counts as its nearer end.
    pub fn fill(&self, plug_m: f64) -> f64 {
        let held = self.setpoint();
        let plug_m = plug_m.clamp(0.0, held.length_m);
        let fill = match self {
            Self::Exponential(feedback) => feedback.fill(plug_m),
            Self::Saturated(feedback) => {
                held.holding_fill - feedback.slope_per_m * (plug_m - held.plug_m)
            }
        };
        fill.clamp(0.0, held.max_fill)
    }

    /// Fill ratio that holds the setpoint.
    pub fn holding_fill(&self) -> f64 {
        self.setpoint().holding_fill
    }

    fn setpoint(&self) -> &CheckedSetpoint {
        match self {
            Self::Exponential(feedback) => &feedback.setpoint,
            Self::Saturated(feedback) => &feedback.setpoint,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::extruder::screw::{ScrewDesign, SpeedPulsation};
    use proptest::prelude::*;

    const SETPOINT: PlugSetpoint = PlugSetpoint { plug: Mm::constant(160.0), max_fill: 0.9 };

    fn screw() -> Screw {
        ScrewDesign::DIAGNE_2015.screw(SpeedPulsation::default()).unwrap()
    }

    #[test]
    fn the_paper_s_gains_solve_their_equations() {
        let screw = screw();
        let least = SETPOINT.min_slope(&screw).unwrap();
        assert!((least - 6.319_40).abs() < 1e-5, "{least}");
        let feedback = PiecewiseExponential::new(&screw, SETPOINT, least + 30.0).unwrap();
        let (left, right) = feedback.gains_per_m();
        assert!((right - 143.214_9).abs() < 1e-4, "{right}");
        assert!((left - 56.108_6).abs() < 1e-4, "{left}");
        let (slope, hold) = (feedback.slope_per_m(), screw.holding_fill(0.16));
        assert!((left * (0.9 - hold) - slope * (1.0 - (-left * 0.16).exp())).abs() < 1e-12);
        assert!((right * hold - slope * (1.0 - (-right * 0.04).exp())).abs() < 1e-12);
    }

    #[test]
    fn the_feed_is_largest_when_empty_zero_when_full_and_has_one_slope_at_the_setpoint() {
        let screw = screw();
        let feedback = PiecewiseExponential::new(&screw, SETPOINT, 36.3194).unwrap();
        let feedback = FillFeedback::Exponential(feedback);
        assert!((feedback.fill(0.0) - 0.9).abs() < 1e-15);
        assert!(feedback.fill(0.2).abs() < 1e-15);
        assert!((feedback.fill(0.16) - feedback.holding_fill()).abs() < 1e-15);
        let h = 1e-7;
        for side in [-h, h] {
            let slope = (feedback.fill(0.16) - feedback.fill(0.16 + side)) / side;
            assert!((slope - 36.3194).abs() < 1e-3, "{slope}");
        }
    }

    #[test]
    fn settings_without_a_solution_are_refused() {
        let screw = screw();
        let flat = PiecewiseExponential::new(&screw, SETPOINT, 6.3).unwrap_err();
        let said = flat.to_string();
        assert_eq!(said, "a slope of 6.3/m at the setpoint is too flat: it must be above 6.3194/m");
        assert!(PiecewiseExponential::new(&screw, SETPOINT, f64::NAN).is_err());
        let weak = PlugSetpoint { max_fill: 0.2, ..SETPOINT };
        assert!(matches!(weak.min_slope(&screw), Err(ScrewError::MaxFill { .. })));
        let full = PlugSetpoint { max_fill: 1.0, ..SETPOINT };
        assert!(matches!(full.min_slope(&screw), Err(ScrewError::MaxFill { .. })));
        for plug in [0.0, 200.0, -3.0] {
            let outside = PlugSetpoint { plug: Mm::constant(plug), ..SETPOINT };
            let found = SaturatedLinear::new(&screw, outside, 100.0);
            assert!(matches!(found, Err(ScrewError::Setpoint { .. })), "{plug}");
        }
    }

    proptest! {
        #[test]
        fn both_characteristics_are_monotonic_within_their_limits(
            setpoint in 1.0..199.0_f64,
            spare in 0.01..0.99_f64,
            steeper in 1.001..200.0_f64,
            one in -0.05..0.25_f64,
            more in 0.0..0.2_f64,
        ) {
            let screw = screw();
            let hold = screw.holding_fill(setpoint / 1000.0);
            let setpoint = PlugSetpoint { plug: Mm::constant(setpoint), max_fill: hold + spare * (0.999 - hold) };
            let slope = steeper * setpoint.min_slope(&screw).unwrap();
            let exponential = PiecewiseExponential::new(&screw, setpoint, slope).unwrap();
            let (left, right) = exponential.gains_per_m();
            prop_assert!(left > 0.0 && right > 0.0);
            let saturated = SaturatedLinear::new(&screw, setpoint, slope).unwrap();
            for feedback in [FillFeedback::Exponential(exponential), FillFeedback::Saturated(saturated)] {
                let (before, after) = (feedback.fill(one), feedback.fill(one + more));
                prop_assert!((0.0..=setpoint.max_fill).contains(&before));
                prop_assert!(after <= before);
            }
        }
    }
}
