//! Predictor feedback of the screw: the plug is measured, predicted to when the feed arrives, and
//! fed back from there (Diagne et al. 2015, eq. (74)).

use super::error::{ScrewError, positive};
use super::euler::{EulerPredictor, whole};
use super::exact::{ExactPredictor, FeedOvertaken, PlugPrediction};
use super::feed_history::FeedHistory;
use super::feedback::FillFeedback;
use super::model::{Conveying, MM_PER_M, Screw};
use crate::core::{Mm, Span, Stamp};

/// Largest number of changes of the feed that are kept, as a bound on memory.
const MAX_STEPS: usize = 1 << 16;

/// How the prediction is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scheme {
    /// Over the exact delay interval, of high order, at any times.
    Exact,
    /// Euler steps on a fixed grid, as in the paper.
    Paper,
}

/// Settings of the control of a screw.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScrewSettings {
    /// The model. [`Screw::steady`] of it gives the predictor without pulsation, eqs. (105) to
    /// (112).
    pub screw: Screw,
    /// The feedback.
    pub feedback: FillFeedback,
    /// How the prediction is computed.
    pub scheme: Scheme,
    /// Time between steps. The exact scheme accepts steps from half of it, the paper's only
    /// whole multiples.
    pub period: Span,
    /// Fill ratio of the feed up to the first step, from 0 to below 1.
    pub initial_fill: f64,
}

/// The control with its history of the feed.
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
    /// Fill ratio of the feed from now on, U.
    pub fill: f64,
    /// Predicted length of the plug when that arrives, P.
    pub plug: Mm,
    /// When it arrives, σ.
    pub arrival: Stamp,
    /// Delay of the feed that arrives now, D.
    pub delay: Span,
}

/// Why there is no decision. The last feed stays in force unless [`ScrewControl::applied`] sets
/// another.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum ScrewFault {
    /// A plug outside the screw.
    #[error(
        "a plug of {} was measured in a screw of {}; check the sensor's zero and unit",
        plug,
        length
    )]
    PlugOutsideScrew {
        /// The measured length.
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
        /// The period.
        period: Span,
    },
    /// A step off the grid of the paper's scheme.
    #[error("{} s after the last step is not on the grid of {} s that the paper's scheme steps on", since.secs(), period.secs())]
    OffGrid {
        /// Time since the last step.
        since: Span,
        /// The period.
        period: Span,
    },
    /// A fill ratio out of range.
    #[error("a fill ratio of {0} cannot have been fed; it must be from 0 to below 1")]
    FillOutOfRange(f64),
}

impl ScrewControl {
    /// Before the first step. [`super::feasible::Feasibility::judge`] checks feasibility.
    pub fn new(settings: &ScrewSettings) -> Result<Self, ScrewError> {
        let screw = Screw::new(settings.screw)?;
        let period_s = positive("period", settings.period.secs())?;
        if !(0.0..1.0).contains(&settings.initial_fill) {
            return Err(ScrewError::InitialFill(settings.initial_fill));
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

    /// The feed from now on, for the plug measured now.
    pub fn step(&mut self, now: Stamp, plug: Mm) -> Result<ScrewStep, ScrewFault> {
        self.advance(now)?;
        self.last = Some(now);
        let decided = self.decide(now, plug);
        let fill = decided.as_ref().map_or(self.fed(), |step| step.fill);
        self.predictor.push(now, fill);
        decided
    }

    /// The feed from a moment on, where it differs from the last decision (a limit or an operator
    /// acted).
    pub fn applied(&mut self, from: Stamp, fill: f64) -> Result<(), ScrewFault> {
        if !(0.0..1.0).contains(&fill) {
            return Err(ScrewFault::FillOutOfRange(fill));
        }
        match &mut self.predictor {
            Predictor::Exact { exact, history } => {
                history.push(exact.coordinate(from.secs()), fill);
            }
            Predictor::Paper(euler) => euler.amend(fill),
        }
        Ok(())
    }

    /// The known fill ratio of the feed now.
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

    /// Advances by the time since the last step, if a step is due.
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
