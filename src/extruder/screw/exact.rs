//! Where the plug will be when what is fed now arrives, and when: the predictor
//! (47), (48) with (74) to (77) of Diagne et al. 2015, over the exact delay
//! interval and the feed as it was held.
//!
//! Where the conveying speed is steady, or the delay adds up on the way, metres
//! conveyed in place of seconds make the predictor linear: what was fed as dq
//! becomes plug as dP = (U − θ2·(1 − U)·P)·dq, which has a closed form while U is
//! held. Otherwise it is integrated by Runge–Kutta steps of fourth order that
//! end where the feed changes.

use super::history::{History, Piece};
use super::model::{Conveying, Screw};

/// What is foretold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prediction {
    /// Length of the plug when what is fed now arrives, P \[m\].
    pub plug_m: f64,
    /// When it arrives, σ \[s\].
    pub arrival_s: f64,
    /// Delay of what arrives now, D \[s\].
    pub delay_s: f64,
}

/// The delay grows as fast as time passes: what was fed does not arrive.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error(
    "the feed does not reach the plug: at a plug of {:.1} mm the delay grows by {growth:.3} s a \
     second, which must be below 1; the pulsation is too strong or too fast for this screw",
    plug_m * 1000.0
)]
pub struct Overtaken {
    /// Growth of the delay F, eq. (77).
    pub growth: f64,
    /// Foretold length of the plug where it grows so \[m\].
    pub plug_m: f64,
}

/// Largest growth of the delay that a prediction goes through: beyond, a second
/// of feed is stretched a hundredfold.
pub(super) const MOST_GROWTH: f64 = 0.99;
/// Largest turn of the pulsation in one Runge–Kutta step \[rad\].
const STEP_RAD: f64 = 0.2;
/// Longest Runge–Kutta step \[s\].
const STEP_S: f64 = 0.1;

/// The predictor with the model that it knows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Exact {
    screw: Screw,
}

impl Exact {
    /// A predictor that knows this screw.
    pub fn new(screw: Screw) -> Self {
        Self { screw }
    }

    /// The screw that it knows.
    pub fn screw(&self) -> &Screw {
        &self.screw
    }

    /// Where a moment lies in the history's coordinate: seconds, or metres
    /// conveyed where the closed form holds.
    pub fn place(&self, now_s: f64) -> f64 {
        if self.is_linear() { self.screw.way(now_s) } else { now_s }
    }

    fn is_linear(&self) -> bool {
        !self.screw.pulsates() || self.screw.conveying == Conveying::AtSpeedOnTheWay
    }

    /// Foretells from a plug that was measured now.
    pub fn predict(
        &self,
        history: &History,
        now_s: f64,
        plug_m: f64,
    ) -> Result<Prediction, Overtaken> {
        let delay_s = self.screw.delay(now_s, plug_m);
        if self.is_linear() {
            let now = self.screw.way(now_s);
            let from = now - (self.screw.length_m - plug_m);
            let grown =
                history.pieces(from, now).fold(plug_m, |plug, piece| self.grow(plug, piece));
            let way = now + self.screw.length_m - grown;
            let arrival_s = self.screw.moment(way, now_s);
            return Ok(Prediction { plug_m: grown, arrival_s, delay_s });
        }
        let mut ahead = Ahead::new(&self.screw, now_s, plug_m);
        for piece in history.pieces(now_s - delay_s, now_s) {
            ahead.follow(piece)?;
        }
        Ok(Prediction { plug_m: ahead.plug, arrival_s: now_s + ahead.past_s, delay_s })
    }

    /// The plug after a stretch of feed has joined it.
    fn grow(&self, plug: f64, piece: Piece) -> f64 {
        let fade = self.screw.theta2_per_m * (1.0 - piece.fill);
        let joined = -libm::expm1(-fade * piece.length);
        (plug + joined * (piece.fill / fade - plug)).min(self.screw.length_m)
    }
}

/// A prediction under way: the plug, the time since now and the pulsation's
/// phase then.
struct Ahead<'a> {
    screw: &'a Screw,
    plug: f64,
    past_s: f64,
    cos: f64,
    sin: f64,
}

/// Rates of the plug and of the time of arrival for each second of feeding.
#[derive(Clone, Copy)]
struct Rates {
    plug: f64,
    time: f64,
}

impl<'a> Ahead<'a> {
    fn new(screw: &'a Screw, now_s: f64, plug: f64) -> Self {
        let pulsation = screw.pulsation;
        let (sin, cos) = libm::sincos(pulsation.rad_per_s * now_s + pulsation.phase_rad);
        Self { screw, plug, past_s: 0.0, cos, sin }
    }

    /// Over a stretch of held feed.
    fn follow(&mut self, piece: Piece) -> Result<(), Overtaken> {
        let mut left = piece.length;
        while left > 0.0 {
            let first = self.rates(piece.fill, 0.0, self.plug)?;
            let turn = self.screw.pulsation.rad_per_s * first.time;
            let step = left.min(STEP_S).min(STEP_RAD / turn);
            // What would be left by rounding is taken along.
            let step = if left - step < 1e-12 { left } else { step };
            self.step(piece.fill, step, first)?;
            left -= step;
        }
        Ok(())
    }

    fn step(&mut self, fill: f64, step: f64, first: Rates) -> Result<(), Overtaken> {
        let half = 0.5 * step;
        let at = |k: Rates, h: f64| (k.time * h, self.plug + k.plug * h);
        let (time, plug) = at(first, half);
        let second = self.rates(fill, time, plug)?;
        let (time, plug) = at(second, half);
        let third = self.rates(fill, time, plug)?;
        let (time, plug) = at(third, step);
        let fourth = self.rates(fill, time, plug)?;
        let mean = |of: fn(&Rates) -> f64| {
            (of(&first) + 2.0 * (of(&second) + of(&third)) + of(&fourth)) / 6.0
        };
        let past = step * mean(|k| k.time);
        self.plug = (self.plug + step * mean(|k| k.plug)).min(self.screw.length_m);
        self.past_s += past;
        (self.sin, self.cos) = self.turned(past);
        Ok(())
    }

    /// f/(1 − F) and 1/(1 − F) of (47), (48), with F at the time of arrival
    /// (77). Both sides of the fractions are multiplied with (1 + θ2·P)(1 − U),
    /// which is 1/(1 − Γ).
    fn rates(&self, fill: f64, past_s: f64, plug: f64) -> Result<Rates, Overtaken> {
        let screw = self.screw;
        let (sin, cos) = self.turned(past_s);
        let share = screw.pulsation.share;
        let scale = 1.0 + share * cos;
        let lead = screw.theta2_per_m * plug;
        let stretch = (1.0 + lead) * (1.0 - fill);
        let slows = share * screw.pulsation.rad_per_s * sin * (screw.length_m - plug)
            / (screw.theta1_m_per_s * scale * scale);
        let time = stretch / (1.0 - stretch * slows);
        if !(time > 0.0 && time * (1.0 - MOST_GROWTH) < 1.0) {
            let growth = slows + 1.0 - 1.0 / stretch;
            return Err(Overtaken { growth, plug_m: plug });
        }
        let joins = fill - lead * (1.0 - fill);
        Ok(Rates { plug: screw.theta1_m_per_s * scale * joins * time / stretch, time })
    }

    /// Sine and cosine of the pulsation's phase a while later: turned on from
    /// those that are known, by series that are exact to 10⁻¹² up to 0.4 rad.
    fn turned(&self, past_s: f64) -> (f64, f64) {
        let a = self.screw.pulsation.rad_per_s * past_s;
        if a.abs() > 2.0 * STEP_RAD {
            let (sin, cos) = libm::sincos(a);
            return (self.sin * cos + self.cos * sin, self.cos * cos - self.sin * sin);
        }
        let q = a * a;
        let sin = a * (1.0 - q / 6.0 * (1.0 - q / 20.0 * (1.0 - q / 42.0 * (1.0 - q / 72.0))));
        let cos = 1.0
            - q / 2.0 * (1.0 - q / 12.0 * (1.0 - q / 30.0 * (1.0 - q / 56.0 * (1.0 - q / 90.0))));
        (self.sin * cos + self.cos * sin, self.cos * cos - self.sin * sin)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::extruder::screw::{Pulsation, ScrewDesign};

    const A: Pulsation = Pulsation { share: 0.1, rad_per_s: 3.5, phase_rad: 0.0 };

    fn screw(pulsation: Pulsation) -> Screw {
        ScrewDesign::DIAGNE_2015.screw(pulsation).unwrap()
    }

    /// A feed that changes every 20 ms from `from_s` on for a second and a half.
    fn fed(predictor: &Exact, from_s: f64) -> History {
        let mut history = History::new(100, 0.2);
        for k in 0..75 {
            let at = f64::from(k);
            history.push(predictor.place(from_s + 0.02 * at), 0.45 + 0.4 * (0.3 * at).sin());
        }
        history
    }

    #[test]
    fn the_closed_form_is_where_the_steps_lead_as_the_pulsation_fades() {
        let steady = Exact::new(screw(Pulsation::default()));
        let faint = Exact::new(screw(Pulsation { share: 1e-11, ..A }));
        let closed = steady.predict(&fed(&steady, 0.0), 1.5, 0.12).unwrap();
        let stepped = faint.predict(&fed(&faint, 0.0), 1.5, 0.12).unwrap();
        assert!((closed.plug_m - stepped.plug_m).abs() < 1e-9);
        assert!((closed.arrival_s - stepped.arrival_s).abs() < 1e-9);
        assert!((closed.delay_s - 0.08 / 0.094_247_779_6).abs() < 1e-9);
    }

    #[test]
    fn what_is_fed_arrives_when_its_delay_is_over() {
        // Eq. (53): σ = t + D(σ, P), with either kind of conveying.
        for conveying in [Conveying::AtPresentSpeed, Conveying::AtSpeedOnTheWay] {
            let screw = Screw { conveying, ..screw(A) };
            let predictor = Exact::new(screw);
            let found = predictor.predict(&fed(&predictor, 3.0), 4.5, 0.12).unwrap();
            let due = 4.5 + screw.delay(found.arrival_s, found.plug_m);
            assert!((found.arrival_s - due).abs() < 2e-6, "{conveying:?}");
        }
    }

    #[test]
    fn a_phase_that_is_turned_on_is_that_of_the_moment() {
        let ahead = Ahead::new(&screw(A), 7.0, 0.1).turned(0.4 / 3.5);
        let (sin, cos) = libm::sincos(3.5 * 7.0 + 0.4);
        assert!((ahead.0 - sin).abs() < 1e-12 && (ahead.1 - cos).abs() < 1e-12);
    }

    #[test]
    fn a_feed_that_does_not_arrive_is_said_to_be_overtaken() {
        let fast = Exact::new(screw(Pulsation { share: 0.5, rad_per_s: 6.0, phase_rad: 0.0 }));
        let history = History::new(4, 0.0);
        let mut found = (0..20).map(|k| fast.predict(&history, 0.1 * f64::from(k), 0.02));
        let fault = found.find_map(Result::err).unwrap();
        assert!(fault.growth > 0.98 && fault.plug_m >= 0.0);
        assert!(fault.to_string().starts_with("the feed does not reach the plug: at a plug of "));
    }
}
