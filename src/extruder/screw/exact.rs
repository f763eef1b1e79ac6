//! Predicts the length of the plug when the present feed arrives, and when: the predictor (47),
//! (48) with (74) to (77) of Diagne et al. 2015, over the exact delay interval and the piecewise
//! constant feed.
//!
//! Where the conveying speed is constant, or the delay integrates it, the predictor is linear in
//! metres conveyed: dP = (U − θ2·(1 − U)·P)·dq, in closed form for constant U. Otherwise it is
//! integrated by Runge–Kutta steps that end where the feed changes: of fourth order, or of second
//! where the feed changes so often that the steps are short enough.

use super::feed_history::{FeedHistory, FeedSegment};
use super::model::{Conveying, Screw};

/// A prediction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlugPrediction {
    /// Length of the plug when the present feed arrives, P \[m\].
    pub plug_m: f64,
    /// When it arrives, σ \[s\].
    pub arrival_s: f64,
    /// Delay of the feed that arrives now, D \[s\].
    pub delay_s: f64,
}

/// The delay grows as fast as time passes: the feed does not arrive.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error(
    "the feed does not reach the plug: at a plug of {:.1} mm the delay grows by {growth:.3} s a \
     second, which must be below 1; the pulsation is too strong or too fast for this screw",
    plug_m * 1000.0
)]
pub struct FeedOvertaken {
    /// Growth of the delay F, eq. (77).
    pub growth: f64,
    /// Predicted length of the plug there \[m\].
    pub plug_m: f64,
}

/// Largest growth of the delay in a prediction. Derived: at a growth F a second of feed arrives
/// over 1/(1 − F) seconds, a hundred for 0.99.
pub(super) const MAX_DELAY_GROWTH: f64 = 0.99;
/// Largest phase of the pulsation in one Runge–Kutta step \[rad\]. A larger one is faster and less
/// accurate; a test bounds the error.
const MAX_STEP_RAD: f64 = 0.2;
/// Longest Runge–Kutta step \[s\], for the growth of the plug.
const MAX_STEP_S: f64 = 0.1;
/// Up to this phase of the pulsation in a step \[rad\] second order leaves less than a micrometre
/// over the delay, as a test shows.
const SECOND_ORDER_RAD: f64 = 0.05;
/// Up to this length of a step \[s\], too, second order leaves less than a micrometre.
const SECOND_ORDER_S: f64 = 0.006;

/// The predictor with its model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExactPredictor {
    screw: Screw,
}

impl ExactPredictor {
    /// For a model of the screw.
    pub fn new(screw: Screw) -> Self {
        Self { screw }
    }

    /// The history's coordinate of a moment: seconds, or metres conveyed for the closed form.
    pub fn coordinate(&self, now_s: f64) -> f64 {
        if self.is_linear() { self.screw.conveyed_m(now_s) } else { now_s }
    }

    fn is_linear(&self) -> bool {
        !self.screw.pulsates() || self.screw.conveying == Conveying::AtSpeedOnTheWay
    }

    /// Predicts from a plug that is measured now.
    pub fn predict(
        &self,
        history: &FeedHistory,
        now_s: f64,
        plug_m: f64,
    ) -> Result<PlugPrediction, FeedOvertaken> {
        let delay_s = self.screw.delay(now_s, plug_m);
        if self.is_linear() {
            let now = self.screw.conveyed_m(now_s);
            let from = now - (self.screw.length_m - plug_m);
            let grown =
                history.segments(from, now).fold(plug_m, |plug, piece| self.grow(plug, piece));
            let way = now + self.screw.length_m - grown;
            let arrival_s = self.screw.moment_of(way, now_s);
            return Ok(PlugPrediction { plug_m: grown, arrival_s, delay_s });
        }
        let mut ahead = PredictionState::new(&self.screw, now_s, plug_m);
        for piece in history.segments(now_s - delay_s, now_s) {
            ahead.follow(piece)?;
        }
        Ok(PlugPrediction { plug_m: ahead.plug, arrival_s: now_s + ahead.elapsed_s, delay_s })
    }

    /// The plug after a segment of feed has joined it.
    fn grow(&self, plug: f64, piece: FeedSegment) -> f64 {
        let fade = self.screw.theta2_per_m * (1.0 - piece.fill);
        let joined = -libm::expm1(-fade * piece.length);
        (plug + joined * (piece.fill / fade - plug)).min(self.screw.length_m)
    }
}

/// State of a prediction: the plug, the time since now and the pulsation's phase.
struct PredictionState<'a> {
    screw: &'a Screw,
    plug: f64,
    elapsed_s: f64,
    phase: Phase,
}

/// Sine and cosine of the pulsation's phase.
#[derive(Clone, Copy)]
struct Phase {
    sin: f64,
    cos: f64,
}

/// Rates of the plug and of the time of arrival per second of feed.
#[derive(Clone, Copy)]
struct Rates {
    plug: f64,
    time: f64,
}

impl<'a> PredictionState<'a> {
    fn new(screw: &'a Screw, now_s: f64, plug: f64) -> Self {
        let pulsation = screw.pulsation;
        let (sin, cos) = libm::sincos(pulsation.rad_per_s * now_s + pulsation.phase_rad);
        Self { screw, plug, elapsed_s: 0.0, phase: Phase { sin, cos } }
    }

    /// Integrates over a segment of constant feed.
    fn follow(&mut self, piece: FeedSegment) -> Result<(), FeedOvertaken> {
        let mut left = piece.length;
        while left > 0.0 {
            let first = self.rates(piece.fill, self.phase, self.plug)?;
            let turn = self.screw.pulsation.rad_per_s * first.time;
            let step = left.min(MAX_STEP_S).min(MAX_STEP_RAD / turn);
            // A remainder by rounding is included.
            let step = if left - step < 1e-12 { left } else { step };
            let mean = if step <= SECOND_ORDER_S && step * turn <= SECOND_ORDER_RAD {
                self.after(piece.fill, first, 0.5 * step)?
            } else {
                self.fourth_order(piece.fill, first, step)?
            };
            let past_s = step * mean.time;
            self.plug = (self.plug + step * mean.plug).min(self.screw.length_m);
            self.elapsed_s += past_s;
            self.phase = self.rotated(past_s);
            left -= step;
        }
        Ok(())
    }

    /// Mean rates of a step, of fourth order.
    fn fourth_order(&self, fill: f64, first: Rates, step: f64) -> Result<Rates, FeedOvertaken> {
        let second = self.after(fill, first, 0.5 * step)?;
        let third = self.after(fill, second, 0.5 * step)?;
        let fourth = self.after(fill, third, step)?;
        let mean = |of: fn(&Rates) -> f64| {
            (of(&first) + 2.0 * (of(&second) + of(&third)) + of(&fourth)) / 6.0
        };
        Ok(Rates { plug: mean(|rates| rates.plug), time: mean(|rates| rates.time) })
    }

    /// Rates after a part of a step at given rates.
    #[inline]
    fn after(&self, fill: f64, rates: Rates, part: f64) -> Result<Rates, FeedOvertaken> {
        self.rates(fill, self.rotated(rates.time * part), self.plug + rates.plug * part)
    }

    /// f/(1 − F) and 1/(1 − F) of (47), (48), with F at the time of arrival (77), from sine and
    /// cosine of the phase then. Numerators and denominators are multiplied by (1 + θ2·P)(1 − U), which is 1/(1 − Γ), and by
    /// θ1·(1 + ε·cos)².
    #[inline]
    fn rates(&self, fill: f64, phase: Phase, plug: f64) -> Result<Rates, FeedOvertaken> {
        let Phase { sin, cos } = phase;
        let screw = self.screw;
        let amplitude = screw.pulsation.relative_amplitude;
        let scale = 1.0 + amplitude * cos;
        let lead = screw.theta2_per_m * plug;
        let dilation = (1.0 + lead) * (1.0 - fill);
        let square = screw.theta1_m_per_s * scale * scale;
        let slows = amplitude * screw.pulsation.rad_per_s * sin * (screw.length_m - plug);
        let over = square / (square - dilation * slows);
        let time = dilation * over;
        if !(time > 0.0 && time * (1.0 - MAX_DELAY_GROWTH) < 1.0) {
            let growth = slows / square + 1.0 - 1.0 / dilation;
            return Err(FeedOvertaken { growth, plug_m: plug });
        }
        let joins = fill - lead * (1.0 - fill);
        Ok(Rates { plug: screw.theta1_m_per_s * scale * joins * over, time })
    }

    /// Sine and cosine of the pulsation's phase after a time, rotated from the present ones: by a
    /// series, exact to 10⁻¹³, for a small phase.
    #[inline]
    fn rotated(&self, past_s: f64) -> Phase {
        let a = self.screw.pulsation.rad_per_s * past_s;
        let (sin, cos) = if a.abs() <= SECOND_ORDER_RAD {
            let q = a * a;
            let sin = a * (1.0 + q * (-1.0 / 6.0 + q * (1.0 / 120.0)));
            (sin, 1.0 + q * (-0.5 + q * (1.0 / 24.0 - q * (1.0 / 720.0))))
        } else {
            libm::sincos(a)
        };
        let now = self.phase;
        Phase { sin: now.sin * cos + now.cos * sin, cos: now.cos * cos - now.sin * sin }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::extruder::screw::{ScrewDesign, SpeedPulsation};

    const A: SpeedPulsation =
        SpeedPulsation { relative_amplitude: 0.1, rad_per_s: 3.5, phase_rad: 0.0 };

    fn screw(pulsation: SpeedPulsation) -> Screw {
        ScrewDesign::DIAGNE_2015.screw(pulsation).unwrap()
    }

    /// A feed that changes every 20 ms from `from_s` on for a second and a half.
    fn fed(predictor: &ExactPredictor, from_s: f64) -> FeedHistory {
        let mut history = FeedHistory::new(100, 0.2);
        for k in 0..75 {
            let at = f64::from(k);
            history.push(predictor.coordinate(from_s + 0.02 * at), 0.45 + 0.4 * (0.3 * at).sin());
        }
        history
    }

    #[test]
    fn the_closed_form_is_the_limit_of_a_vanishing_pulsation() {
        let steady = ExactPredictor::new(screw(SpeedPulsation::default()));
        let faint = ExactPredictor::new(screw(SpeedPulsation { relative_amplitude: 1e-11, ..A }));
        let closed = steady.predict(&fed(&steady, 0.0), 1.5, 0.12).unwrap();
        let stepped = faint.predict(&fed(&faint, 0.0), 1.5, 0.12).unwrap();
        assert!((closed.plug_m - stepped.plug_m).abs() < 1e-9);
        assert!((closed.arrival_s - stepped.arrival_s).abs() < 1e-9);
        assert!((closed.delay_s - 0.08 / 0.094_247_779_6).abs() < 1e-9);
    }

    #[test]
    fn the_feed_arrives_after_its_delay() {
        // Eq. (53): σ = t + D(σ, P), with either kind of conveying.
        for conveying in [Conveying::AtPresentSpeed, Conveying::AtSpeedOnTheWay] {
            let screw = Screw { conveying, ..screw(A) };
            let predictor = ExactPredictor::new(screw);
            let found = predictor.predict(&fed(&predictor, 3.0), 4.5, 0.12).unwrap();
            let due = 4.5 + screw.delay(found.arrival_s, found.plug_m);
            assert!((found.arrival_s - due).abs() < 2e-6, "{conveying:?}");
        }
    }

    #[test]
    fn a_rotated_phase_is_that_of_the_moment() {
        for turn in [SECOND_ORDER_RAD, 0.4] {
            let ahead = PredictionState::new(&screw(A), 7.0, 0.1).rotated(turn / 3.5);
            let (sin, cos) = libm::sincos(3.5 * 7.0 + turn);
            assert!((ahead.sin - sin).abs() < 1e-12 && (ahead.cos - cos).abs() < 1e-12);
        }
    }

    #[test]
    fn a_feed_that_changes_often_leaves_less_than_a_micrometre() {
        for pulsation in
            [A, SpeedPulsation { relative_amplitude: 0.4, rad_per_s: 0.4, phase_rad: 2.0 }]
        {
            let predictor = ExactPredictor::new(screw(pulsation));
            let fill = |k: i32| 0.45 + 0.4 * (1.7 * f64::from(k)).sin();
            let (mut coarse, mut fine) =
                (FeedHistory::new(500, 0.2), FeedHistory::new(40_000, 0.2));
            for k in 0..400 {
                coarse.push(0.005 * f64::from(k), fill(k));
                for part in 0..100 {
                    // Differences that do not matter make steps a hundredth as long.
                    let twitch = 1e-15 * f64::from(part % 2);
                    fine.push(0.005 * f64::from(k) + 5e-5 * f64::from(part), fill(k) + twitch);
                }
            }
            let coarse = predictor.predict(&coarse, 2.0, 0.06).unwrap();
            let fine = predictor.predict(&fine, 2.0, 0.06).unwrap();
            assert!((coarse.plug_m - fine.plug_m).abs() < 1e-6);
            assert!((coarse.arrival_s - fine.arrival_s).abs() < 1e-5);
        }
    }

    #[test]
    fn a_feed_that_does_not_arrive_is_an_error() {
        let fast = ExactPredictor::new(screw(SpeedPulsation {
            relative_amplitude: 0.5,
            rad_per_s: 6.0,
            phase_rad: 0.0,
        }));
        let history = FeedHistory::new(4, 0.0);
        let mut found = (0..20).map(|k| fast.predict(&history, 0.1 * f64::from(k), 0.02));
        let fault = found.find_map(Result::err).unwrap();
        assert!(fault.growth > 0.98 && fault.plug_m >= 0.0);
        assert!(fault.to_string().starts_with("the feed does not reach the plug: at a plug of "));
    }
}
