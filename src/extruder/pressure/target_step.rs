//! A step of the target, and how far the commands may go before the pressure has answered.
//!
//! Until the first answer arrives, the pressure may be about to rise by twice what the model says, or
//! later than it says. The commands therefore take the pressure only part of the way at first. What
//! the answer shows is that of [`super::plant_model`].

/// Overshoot that is accepted before the pressure has answered, as a fraction of the step. Derived:
/// with twice the gain the overshoot stays below 30 %, and without an error of the model the
/// integral of the error of a step in Ma et al. 2026 below 0.39 MPa·s.
const OVERSHOOT_UNSEEN: f64 = 0.292;
/// Largest gain over the given one that is expected, of a plant with the model's dead time.
const LARGEST_GAIN: f64 = 2.0;
/// How much less it is for a longer dead time, as a power of it. Derived: at least the gain with which
/// PI control keeps 30° of phase margin, of 1.2 to 1.5 times the dead time 1.31 to 1.07.
const LATE_POWER: f64 = 1.5;
/// Farthest that the commands go before an answer, over the step. Derived: a plant that is only late
/// overshoots by two thirds of what twice the gain does; less leaves a late one with half the gain
/// waiting.
const FARTHEST: f64 = 1.2;
/// Fraction of the step by which the model must have moved before the pressure is expected to.
const ASKED: f64 = 0.15;
/// Change that the model predicts from which the lack of an answer is a fault, in standard deviations
/// of a reading. Derived: the answer of a plant with a third of the gain would still count.
const MIN_ASKED_SIGMAS: f64 = 9.0;
/// Change of the measured pressure over the predicted one within which it stands still. Derived: a
/// fifth of the answer of half the gain; more takes that answer and a load against it for none.
const STANDS_STILL: f64 = 0.1;
/// The same in standard deviations of a reading, where that is more. Derived: a sensor may be stuck at
/// any reading; one in 370 is farther off. Of a filtered reading, 0.58, they are five.
const STANDS_STILL_SIGMAS: f64 = 3.0;

/// Pressures of the model and of the sensor \[MPa\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Answer {
    /// Pressure by the commands alone that has arrived by now, if the dead time is the model's.
    pub arrived: f64,
    /// That which had arrived a reading earlier: a reading may be as old.
    pub arrived_before: f64,
    /// That which has arrived even if the dead time is twice as long.
    pub arrived_late: f64,
    /// The measured pressure.
    pub measured: f64,
    /// Standard deviation of a reading.
    pub sigma: f64,
    /// Time since the step over the dead time. What arrives before 1 was under way already.
    pub lateness: f64,
    /// The given gain over that of the model, where an earlier answer has shown less; else 1.
    pub given_gain: f64,
}

/// The step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TargetStep {
    /// When it began \[s\].
    pub began_s: f64,
    /// The pressure that was expected without it \[MPa\].
    from: f64,
    /// Pressures without it, once all commands before it have arrived.
    before: Before,
    /// When the pressure answered \[s\].
    pub answered_s: Option<f64>,
    /// Since when the model predicts an answer \[s\]; none before.
    asked_s: Option<f64>,
    /// Whether the predicted answer is so large that the lack of one is a fault, and is lacking.
    must_answer: bool,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Before {
    commanded: f64,
    measured: f64,
}

impl TargetStep {
    /// A step that begins at a time \[s\], from the expected pressure, with the pressure by the
    /// commands alone and the measured pressure that were expected without it \[MPa\].
    pub const fn new(began_s: f64, from: f64, commanded: f64, measured: f64) -> Self {
        Self {
            began_s,
            from,
            before: Before { commanded, measured },
            answered_s: None,
            asked_s: None,
            must_answer: false,
        }
    }

    /// How long an answer that the model predicts has been missing \[s\]; none before it is
    /// predicted, and where it would be lost in the noise.
    pub fn unanswered_s(&self, now_s: f64) -> Option<f64> {
        let asked = self.asked_s.filter(|_| self.must_answer && self.answered_s.is_none())?;
        Some(now_s - asked)
    }

    /// The measured pressure that was expected without the step \[MPa\].
    pub const fn measured_before(&self) -> f64 {
        self.before.measured
    }

    /// Size of the step to a target \[MPa\].
    pub fn size(&self, target: f64) -> f64 {
        (target - self.from).abs()
    }

    /// Whether a target \[MPa\] is farther on in the direction of the last one.
    pub fn goes_on_to(&self, target: f64, last: f64) -> bool {
        (target - last) * (last - self.from) > 0.0
    }

    /// Direction of the step: 1 up, −1 down.
    pub fn sign(&self, target: f64) -> f64 {
        (target - self.from).signum()
    }

    /// Takes what has arrived up to a time \[s\], before it is an answer. Returns the farthest
    /// pressure that the commands alone may aim at \[MPa\], in the direction of the step.
    pub fn bound(&mut self, now_s: f64, target: f64, answer: &Answer) -> f64 {
        let (sign, size) = (self.sign(target), self.size(target));
        let Before { commanded, measured } = self.before;
        let moved = sign * (answer.arrived - commanded);
        let moved_late = sign * (answer.arrived_late - commanded);
        let answered = sign * (answer.measured - measured);
        let to_go = sign * (target - answer.measured);
        if answer.lateness >= 1.0 && moved > ASKED * size && self.asked_s.is_none() {
            self.asked_s = Some(now_s);
        }
        // A pressure that moves the other way is no lack of an answer: a load has come besides.
        let stands_still = (STANDS_STILL * moved).max(STANDS_STILL_SIGMAS * answer.sigma);
        self.must_answer = moved > MIN_ASKED_SIGMAS * answer.sigma && answered.abs() < stands_still;
        // A pressure that moves already may do so with twice the gain, and a reading may be late.
        let moved_before = sign * (answer.arrived_before - commanded);
        let most = moved_late.max(moved_before).max(answered / LARGEST_GAIN);
        let confirmed = answered.clamp(moved_late.min(moved), most);
        let lateness = if self.must_answer { answer.lateness } else { 1.0 };
        let late = libm::pow(lateness.max(1.0), LATE_POWER).min(LARGEST_GAIN);
        let largest_gain = answer.given_gain * LARGEST_GAIN / late;
        let farthest = confirmed + (to_go + OVERSHOOT_UNSEEN * size) / largest_gain;
        let farthest = farthest.min(FARTHEST * size);
        commanded + sign * farthest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn answer(arrived: f64, arrived_late: f64, measured: f64) -> Answer {
        let (arrived_before, sigma, lateness, given_gain) = (arrived, 0.007, 1.0, 1.0);
        Answer { arrived, arrived_before, arrived_late, measured, sigma, lateness, given_gain }
    }

    #[test]
    fn what_is_lost_in_the_noise_is_not_the_lack_of_an_answer() {
        let mut step = TargetStep::new(0.0, 0.6, 0.6, 0.6);
        for (at_s, noise) in [(1.0, 0.015), (1.05, 0.012), (1.1, -0.01)] {
            step.bound(at_s, 0.65, &answer(0.65, 0.65, 0.6 + noise));
        }
        assert_eq!(step.unanswered_s(9.0), None);
    }

    #[test]
    fn a_model_that_a_limit_keeps_from_moving_asks_for_no_answer() {
        let mut step = TargetStep::new(0.0, 0.6, 0.6, 0.6);
        step.bound(3.0, 1.2, &answer(0.65, 0.65, 0.6));
        assert_eq!(step.unanswered_s(9.0), None);
    }

    #[test]
    fn before_an_answer_twice_the_gain_overshoots_by_less_than_30_percent() {
        let mut step = TargetStep::new(0.0, 0.2, 0.2, 0.2);
        let bound = step.bound(0.1, 0.8, &answer(0.2, 0.2, 0.2));
        let overshoot = (0.2 + 2.0 * (bound - 0.2) - 0.8) / 0.6;
        assert!((0.25..0.30).contains(&overshoot), "{overshoot}");
    }

    #[test]
    fn twice_the_gain_overshoots_no_more_where_readings_are_late() {
        let bound = |arrived_before: f64, measured: f64| {
            let answer = Answer { arrived_before, ..answer(0.25, 0.0, measured) };
            TargetStep::new(0.0, 0.0, 0.0, 0.0).bound(0.5, 0.6, &answer)
        };
        // The pressure of a reading before, and of half of one.
        let at_rest = TargetStep::new(0.0, 0.0, 0.0, 0.0).bound(0.1, 0.6, &answer(0.0, 0.0, 0.0));
        for measured in [2.0 * 0.18, 2.0 * 0.215] {
            assert!(bound(0.18, measured) <= at_rest + 1e-9, "{measured}");
        }
        // Half the gain needs more.
        assert!(bound(0.18, 0.5 * 0.25) > at_rest + 0.05);
    }

    #[test]
    fn the_later_an_answer_the_farther_the_commands_go() {
        let mut step = TargetStep::new(0.0, 0.0, 0.0, 0.0);
        let mut last = 0.0;
        for lateness in [1.0, 1.2, 1.4, 1.6] {
            let bound = step.bound(1.0, 0.6, &Answer { lateness, ..answer(0.3, 0.0, 0.0) });
            assert!(bound > last && bound <= FARTHEST * 0.6, "{lateness}: {bound}");
            last = bound;
        }
        assert!((last - FARTHEST * 0.6).abs() < 1e-12, "{last}");
    }

    #[test]
    fn without_any_answer_the_commands_go_little_farther_than_the_model_needs_at_most() {
        let mut step = TargetStep::new(0.0, 0.0, 0.0, 0.0);
        let bound = step.bound(3.0, 0.6, &answer(0.6, 0.6, 0.0));
        assert!(bound <= 1.2 * 0.6, "{bound}");
        assert_eq!(step.unanswered_s(5.0), Some(2.0));
    }

    #[test]
    fn a_gain_that_an_earlier_answer_has_shown_is_not_relied_on() {
        let mut step = TargetStep::new(0.0, 0.0, 0.0, 0.0);
        let shown = Answer { given_gain: 2.5, ..answer(0.0, 0.0, 0.0) };
        let bound = step.bound(0.1, 0.6, &shown);
        // With the given gain the pressure goes as far as it does in a first step.
        let first = TargetStep::new(0.0, 0.0, 0.0, 0.0).bound(0.1, 0.6, &answer(0.0, 0.0, 0.0));
        assert!((2.5 * bound - first).abs() < 1e-9, "{bound} {first}");
    }
}
