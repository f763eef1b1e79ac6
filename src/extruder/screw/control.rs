//! What to feed now: the plug is measured, foretold to when the feed arrives,
//! and the law is asked there, eq. (74) of Diagne et al. 2015.

use super::error::{ScrewError, positive};
use super::euler::{EulerPredictor, whole};
use super::exact::{ExactPredictor, FeedOvertaken, PlugPrediction};
use super::feed_history::FeedHistory;
use super::feedback::FillFeedback;
use super::model::{Conveying, MM_PER_M, Screw};
use crate::core::time::{Span, Stamp};
use crate::core::units::Mm;

/// Most changes of the feed that are remembered.
const MAX_STEPS: usize = 1 << 16;

/// How the prediction is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scheme {
    /// Over the exact delay interval, to high order, at any moments.
    Exact,
    /// The paper's Euler steps on a fixed grid.
    Paper,
}

/// What a control of the screw is made of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScrewSettings {
    /// The screw as it is known. [`Screw::steady`] of it makes the predictor
    /// that knows of no pulsation, eqs. (105) to (112).
    pub screw: Screw,
    /// The law.
    pub feedback: FillFeedback,
    /// How the prediction is computed.
    pub scheme: Scheme,
    /// Time between steps. The exact scheme takes steps at half that distance
    /// and more, the paper's only whole multiples of it.
    pub period: Span,
    /// Share of full that has been fed up to the first step, from 0 to below 1.
    pub initial_fill: f64,
}

/// The control with its memory of the feed.
#[derive(Debug, Clone, PartialEq)]
pub struct ScrewControl {
    feedback: FillFeedback,
    predictor: Predictor,
    length: Mm,
    period: Span,
    last: Option<Stamp>,
}

#[derive(Debug, Clone, PartialEq)]
enum Predictor {
    Exact { exact: ExactPredictor, history: FeedHistory },
    Paper(EulerPredictor),
}

/// A decision.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScrewStep {
    /// Share of full to feed from now on, U.
    pub fill: f64,
    /// Length of the plug when that arrives, P.
    pub plug: Mm,
    /// When it arrives, σ.
    pub arrival: Stamp,
    /// Delay of what arrives now, D.
    pub delay: Span,
}

/// Why there is no decision. What was fed last stays in force, and the control
/// counts on that unless it is told with [`ScrewControl::applied`].
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum ScrewFault {
    /// A plug that no screw has.
    #[error(
        "a plug of {} was measured in a screw of {}; check the sensor's zero and unit",
        plug,
        length
    )]
    PlugOutsideScrew {
        /// What was measured.
        plug: Mm,
        /// The screw's length.
        length: Mm,
    },
    /// The feed would not arrive.
    #[error(transparent)]
    Overtaken(#[from] FeedOvertaken),
    /// A step that is not after the last one, or too soon after it.
    #[error("{} s after the last step is too soon: steps are {} s apart", since.secs(), period.secs())]
    TooSoon {
        /// Time since the last step.
        since: Span,
        /// What was set.
        period: Span,
    },
    /// A step that is not on the paper's grid.
    #[error("{} s after the last step is not on the grid of {} s that the paper's scheme steps on", since.secs(), period.secs())]
    OffGrid {
        /// Time since the last step.
        since: Span,
        /// What was set.
        period: Span,
    },
    /// A share that cannot have been fed.
    #[error("a fill ratio of {fill} cannot have been fed; it must be from 0 to below 1")]
    FillOutOfRange {
        /// What was told.
        fill: f64,
    },
}

impl ScrewControl {
    /// A control before its first step. Whether the screw is feasible at all is
    /// a question for [`super::feasible::Feasibility::judge`].
    pub fn new(settings: &ScrewSettings) -> Result<Self, ScrewError> {
        let screw = Screw::new(settings.screw)?;
        let period_s = positive("period", settings.period.secs())?;
        if !(0.0..1.0).contains(&settings.initial_fill) {
            return Err(ScrewError::InitialFill { fill: settings.initial_fill });
        }
        let delay_s = screw.longest_delay();
        // Steps may come at half the period.
        let steps = (2.0 * delay_s / period_s).ceil() + 2.0;
        let room = whole(steps);
        if room > MAX_STEPS {
            return Err(ScrewError::TooManySteps { period_s, delay_s, steps, most: MAX_STEPS });
        }
        let predictor = match settings.scheme {
            Scheme::Exact => Predictor::Exact {
                exact: ExactPredictor::new(screw),
                history: FeedHistory::new(room, settings.initial_fill),
            },
            Scheme::Paper if screw.conveying == Conveying::AtSpeedOnTheWay => {
                return Err(ScrewError::SchemeOnTheWay);
            }
            Scheme::Paper => {
                Predictor::Paper(EulerPredictor::new(screw, period_s, room, settings.initial_fill))
            }
        };
        Ok(Self {
            feedback: settings.feedback,
            predictor,
            length: Mm::new(screw.length_m * MM_PER_M).unwrap_or_default(),
            period: settings.period,
            last: None,
        })
    }

    /// Decides what to feed from now on, from the plug measured now.
    pub fn step(&mut self, now: Stamp, plug: Mm) -> Result<ScrewStep, ScrewFault> {
        self.advance(now)?;
        self.last = Some(now);
        let decided = self.decide(now, plug);
        let fill = decided.as_ref().map_or(self.fed(), |step| step.fill);
        self.predictor.push(now, fill);
        decided
    }

    /// Tells what is fed from a moment on, where that is not what the last step
    /// decided: a limit acted, or an operator.
    pub fn applied(&mut self, from: Stamp, fill: f64) -> Result<(), ScrewFault> {
        if !(0.0..1.0).contains(&fill) {
            return Err(ScrewFault::FillOutOfRange { fill });
        }
        match &mut self.predictor {
            Predictor::Exact { exact, history } => {
                history.push(exact.coordinate(from.secs()), fill)
            }
            Predictor::Paper(euler) => euler.amend(fill),
        }
        Ok(())
    }

    /// The share that is fed now, as far as is known.
    pub fn fed(&self) -> f64 {
        match &self.predictor {
            Predictor::Exact { history, .. } => history.last(),
            Predictor::Paper(euler) => euler.last(),
        }
    }

    fn decide(&self, now: Stamp, plug: Mm) -> Result<ScrewStep, ScrewFault> {
        if !(plug >= Mm::ZERO && plug < self.length) {
            return Err(ScrewFault::PlugOutsideScrew { plug, length: self.length });
        }
        let prediction = self.predictor.predict(now, plug.get() / MM_PER_M)?;
        Ok(ScrewStep {
            fill: self.feedback.fill(prediction.plug_m),
            plug: Mm::new(prediction.plug_m * MM_PER_M).unwrap_or_default(),
            arrival: Stamp::from_secs(prediction.arrival_s),
            delay: Span::from_secs(prediction.delay_s),
        })
    }

    /// Lets the time pass since the last step, if a step may be made now.
    fn advance(&mut self, now: Stamp) -> Result<(), ScrewFault> {
        let Some(last) = self.last else { return Ok(()) };
        let (since, period) = (now - last, self.period);
        let steps = since.secs() / period.secs();
        if steps < 0.5 {
            return Err(ScrewFault::TooSoon { since, period });
        }
        if let Predictor::Paper(euler) = &mut self.predictor {
            if (steps - steps.round()).abs() > 0.01 {
                return Err(ScrewFault::OffGrid { since, period });
            }
            for _ in 1..whole(steps.round()).min(MAX_STEPS) {
                euler.push(euler.last());
            }
        }
        Ok(())
    }
}

impl Predictor {
    fn predict(&self, now: Stamp, plug_m: f64) -> Result<PlugPrediction, FeedOvertaken> {
        match self {
            Self::Exact { exact, history } => exact.predict(history, now.secs(), plug_m),
            Self::Paper(euler) => euler.predict(now.secs(), plug_m),
        }
    }

    fn push(&mut self, now: Stamp, fill: f64) {
        match self {
            Self::Exact { exact, history } => history.push(exact.coordinate(now.secs()), fill),
            Self::Paper(euler) => euler.push(fill),
        }
    }
}

#[cfg(test)]
mod tests;
