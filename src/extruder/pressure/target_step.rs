//! A step of the target, and how far the commands may go before the pressure has answered.
//!
//! Until the first answer arrives, the pressure may be about to rise by twice what the model says, or
//! later than it says. The commands therefore take the pressure only part of the way at first, and
//! the rest of it as the answer shows the gain.

/// Overshoot that is accepted before the pressure has answered, as a fraction of the step. Derived:
/// with twice the gain the overshoot stays below 30 %, and without an error of the model the
/// integral of the error of a step in Ma et al. 2026 below 0.39 MPa·s.
const OVERSHOOT_UNSEEN: f64 = 0.2905;
/// The same once it has answered: twice the noise in the step of Ma et al. 2026.
const OVERSHOOT_SEEN: f64 = 0.02;
/// Largest gain over the model's that is expected.
const LARGEST_GAIN: f64 = 2.0;
/// Fraction of the step by which the model must have moved, and half of it the pressure, before their
/// ratio is used. A smaller one takes noise for an answer.
const ANSWERED: f64 = 0.15;
/// Fraction of what the model has moved from which an answer counts at once; a smaller one counts from
/// the next command on, because it may only be late. Derived: one parameter of the model is 20 % off,
/// as in papers.md, "002".
const NEARLY_WHOLE: f64 = 0.8;
/// Smallest change of the measured pressure that counts, in standard deviations of a reading. Derived:
/// four of the difference of a filtered reading, 0.58, and a slow average, 0.2.
const MIN_ANSWER_SIGMAS: f64 = 2.5;
/// Change that the model predicts from which the lack of an answer is a fault, in standard deviations
/// of a reading. Derived: the answer of a plant with a third of the gain would still count.
const MIN_ASKED_SIGMAS: f64 = 8.0;
/// Change of the measured pressure over the predicted one within which it stands still. Derived: half
/// the gain would have answered.
const STANDS_STILL: f64 = 0.5;

/// Pressures of the model and of the sensor \[MPa\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Answer {
    /// Pressure by the commands alone that has arrived by now, if the dead time is the model's.
    pub arrived: f64,
    /// That which has arrived even if the dead time is twice as long.
    pub arrived_late: f64,
    /// The measured pressure.
    pub measured: f64,
    /// Standard deviation of a reading.
    pub sigma: f64,
    /// Whether a dead time has passed since the step: what arrived before was under way already.
    pub is_due: bool,
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
    /// Whether the answer had begun at the last command.
    begun: bool,
    answered: bool,
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
            begun: false,
            answered: false,
            asked_s: None,
            must_answer: false,
        }
    }

    /// How long an answer that the model predicts has been missing \[s\]; none before it is
    /// predicted, and where it would be lost in the noise.
    pub fn unanswered_s(&self, now_s: f64) -> Option<f64> {
        let asked = self.asked_s.filter(|_| self.must_answer && !self.answered)?;
        Some(now_s - asked)
    }

    /// Whether the pressure has answered.
    pub const fn has_answered(&self) -> bool {
        self.answered
    }

    /// Whether a target \[MPa\] is farther on in the direction of the last one.
    pub fn goes_on_to(&self, target: f64, last: f64) -> bool {
        (target - last) * (last - self.from) > 0.0
    }

    /// Direction of the step: 1 up, −1 down.
    pub fn sign(&self, target: f64) -> f64 {
        (target - self.from).signum()
    }

    /// Takes the answer up to a time \[s\]. Returns the farthest pressure that the commands alone may
    /// aim at \[MPa\], in the direction of the step.
    pub fn bound(&mut self, now_s: f64, target: f64, answer: &Answer) -> f64 {
        let (sign, size) = (self.sign(target), (target - self.from).abs());
        let Before { commanded, measured } = self.before;
        let moved = sign * (answer.arrived - commanded);
        let moved_late = sign * (answer.arrived_late - commanded);
        let answered = sign * (answer.measured - measured);
        let to_go = sign * (target - answer.measured);
        let is_asked = answer.is_due && moved > ANSWERED * size;
        if is_asked && self.asked_s.is_none() {
            self.asked_s = Some(now_s);
        }
        // A pressure that moves the other way is no lack of an answer: a load has come besides.
        self.must_answer =
            moved > MIN_ASKED_SIGMAS * answer.sigma && answered.abs() < STANDS_STILL * moved;
        let least = (0.5 * ANSWERED * size).max(MIN_ANSWER_SIGMAS * answer.sigma);
        let begun = is_asked && answered > least;
        let begun_before = std::mem::replace(&mut self.begun, begun);
        self.answered = begun && (begun_before || answered > NEARLY_WHOLE * moved);
        let farthest = if self.answered {
            let gain = (answered / moved).clamp(1.0, LARGEST_GAIN);
            moved + (to_go + OVERSHOOT_SEEN * size) / gain
        } else {
            let confirmed = answered.clamp(moved_late.min(moved), moved.max(moved_late));
            (confirmed + (to_go + OVERSHOOT_UNSEEN * size) / LARGEST_GAIN).min(size)
        };
        commanded + sign * farthest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn answer(arrived: f64, arrived_late: f64, measured: f64) -> Answer {
        Answer { arrived, arrived_late, measured, sigma: 0.007, is_due: true }
    }

    #[test]
    fn what_is_lost_in_the_noise_is_neither_an_answer_nor_the_lack_of_one() {
        let mut step = TargetStep::new(0.0, 0.6, 0.6, 0.6);
        for (at_s, noise) in [(1.0, 0.015), (1.05, 0.012), (1.1, -0.01)] {
            step.bound(at_s, 0.65, &answer(0.65, 0.65, 0.6 + noise));
            assert!(!step.has_answered());
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
        assert!(!step.has_answered());
    }

    #[test]
    fn an_answer_with_the_models_gain_frees_the_rest_of_the_way() {
        for (from, target) in [(0.0, 0.6), (0.6, 0.0)] {
            let mut step = TargetStep::new(0.0, from, from, from);
            let half = 0.5 * (from + target);
            let bound = step.bound(1.0, target, &answer(half, from, half));
            assert!(step.has_answered());
            assert!((bound - target).abs() < 0.03 * 0.6, "{bound}");
        }
    }

    #[test]
    fn an_answer_of_twice_the_models_gain_stops_the_commands_where_the_target_is_reached() {
        let mut step = TargetStep::new(0.0, 0.0, 0.0, 0.0);
        let bound = step.bound(1.0, 0.6, &answer(0.25, 0.0, 0.5));
        assert!((2.0 * bound - 0.6).abs() < 0.02, "{bound}");
    }

    #[test]
    fn half_an_answer_counts_from_the_next_command_on() {
        let mut step = TargetStep::new(0.0, 0.0, 0.0, 0.0);
        step.bound(1.0, 0.6, &answer(0.38, 0.0, 0.19));
        assert!(!step.has_answered());
        let bound = step.bound(1.05, 0.6, &answer(0.38, 0.0, 0.19));
        assert!(step.has_answered() && bound > 0.75, "{bound}");
    }

    #[test]
    fn without_any_answer_the_commands_never_go_farther_than_the_model_needs() {
        let mut step = TargetStep::new(0.0, 0.0, 0.0, 0.0);
        let bound = step.bound(3.0, 0.6, &answer(0.6, 0.6, 0.0));
        assert!((bound - 0.6).abs() < 1e-12, "{bound}");
        assert_eq!(step.unanswered_s(5.0), Some(2.0));
    }
}
