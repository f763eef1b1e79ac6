//! The predictor as Diagne et al. 2015 compute it, eqs. (50) and (51): a grid of time steps, the
//! delay truncated to whole steps, left endpoints. It reproduces the paper; [`super::exact`] is
//! more accurate.

use std::collections::VecDeque;

use super::exact::{FeedOvertaken, MAX_DELAY_GROWTH, PlugPrediction};
use super::model::Screw;

/// The predictor with the feed of the last steps.
#[derive(Debug, Clone, PartialEq)]
pub struct EulerPredictor {
    screw: Screw,
    step_s: f64,
    /// Fill ratios of the last steps, the newest last.
    fed: VecDeque<f64>,
}

impl EulerPredictor {
    /// Steps of a fixed length, after a feed that has been constant for longer than the delay.
    /// `steps` is the number of steps in the longest delay.
    pub fn new(screw: Screw, step_s: f64, steps: usize, before: f64) -> Self {
        Self { screw, step_s, fed: vec![before; steps.max(1)].into() }
    }

    /// The fill ratio over the step that begins now.
    pub fn push(&mut self, fill: f64) {
        self.fed.pop_front();
        self.fed.push_back(fill);
    }

    /// The fill ratio that was applied instead of the last one.
    pub fn amend(&mut self, fill: f64) {
        self.fed.pop_back();
        self.fed.push_back(fill);
    }

    /// The fill ratio now.
    pub fn last(&self) -> f64 {
        self.fed.back().copied().unwrap_or_default()
    }

    /// Predicts from a plug that is measured now, before the feed of the step that begins is
    /// pushed.
    pub fn predict(&self, now_s: f64, plug_m: f64) -> Result<PlugPrediction, FeedOvertaken> {
        let screw = &self.screw;
        let delay_s = screw.delay(now_s, plug_m);
        let (mut plug, mut arrival) = (plug_m, now_s);
        let steps = whole(delay_s / self.step_s).min(self.fed.len());
        for &fill in self.fed.range(self.fed.len() - steps..) {
            let (speed, slowing) = speed_and_delay_rate(screw, arrival);
            let growth = slowing * (screw.length_m - plug) - screw.growth(plug, fill);
            if growth.is_nan() || growth >= MAX_DELAY_GROWTH {
                return Err(FeedOvertaken { growth, plug_m: plug });
            }
            let scaled_s = self.step_s / (1.0 - growth);
            plug = (plug + scaled_s * speed * screw.growth(plug, fill)).clamp(0.0, screw.length_m);
            arrival += scaled_s;
        }
        Ok(PlugPrediction { plug_m: plug, arrival_s: arrival, delay_s })
    }
}

/// Conveying speed \[m/s\], and ∂D/∂t per metre conveyed, θ1·ε·ω·sin(ωt)/c², eq. (82).
fn speed_and_delay_rate(screw: &Screw, at_s: f64) -> (f64, f64) {
    let pulsation = screw.pulsation;
    let (sin, cos) = libm::sincos(pulsation.rad_per_s * at_s + pulsation.phase_rad);
    let speed = screw.theta1_m_per_s * (1.0 + pulsation.relative_amplitude * cos);
    let turns = screw.theta1_m_per_s * pulsation.relative_amplitude * pulsation.rad_per_s * sin;
    (speed, turns / (speed * speed))
}

/// Whole steps in a delay, truncated as in eq. (50).
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
pub(super) fn whole(steps: f64) -> usize {
    steps.floor() as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::extruder::screw::exact::ExactPredictor;
    use crate::extruder::screw::feed_history::FeedHistory;
    use crate::extruder::screw::{ScrewDesign, SpeedPulsation};

    #[test]
    fn finer_steps_converge_to_the_exact_prediction() {
        let pulsation = SpeedPulsation { relative_amplitude: 0.1, rad_per_s: 3.5, phase_rad: 0.0 };
        let screw = ScrewDesign::DIAGNE_2015.screw(pulsation).unwrap();
        let feed = |at_s: f64| if at_s < 0.7 { 0.2 } else { 0.6 };
        let mut history = FeedHistory::new(8, 0.2);
        history.push(0.7, 0.6);
        let truth = ExactPredictor::new(screw).predict(&history, 1.2, 0.12).unwrap();
        let missed = |step_s: f64| {
            let mut euler = EulerPredictor::new(screw, step_s, 1 << 15, 0.2);
            for step in 0..whole(1.2 / step_s + 0.5) {
                euler.push(feed(step_s * (f64::from(u32::try_from(step).unwrap()) + 0.5)));
            }
            (euler.predict(1.2, 0.12).unwrap().plug_m - truth.plug_m).abs()
        };
        let (coarse, fine) = (missed(1e-3), missed(1e-4));
        assert!(coarse > 1e-6 && coarse < 5e-4, "{coarse}");
        assert!(fine < 0.2 * coarse, "{fine} {coarse}");
    }
}
