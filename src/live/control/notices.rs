//! What an operator hears while a run goes on: a new state with its reason, a speed limit that
//! keeps the width from its target, a width controller that falls back, and a camera offset that is
//! wrong.

use crate::control::{Command, State, Step};
use crate::core::{MmPerS, Span, Stamp};
use crate::rows::names;
use crate::width_control::distance::FallbackReason;
use crate::width_control::limiter::SpeedLimit;
use crate::width_control::watch::WrongOffset;

/// How long a speed limit must act, or not act, before it is reported
/// (`docs/src/how-to/run-a-cell.md`, § What the controller does, and when it stops). A shorter time
/// repeats itself where the speed only touches a limit.
const LIMIT_DELAY: Span = Span::from_millis(500);

/// What has been reported.
#[derive(Debug, Default)]
pub struct Notices {
    state: Option<State>,
    fallback: Option<FallbackReason>,
    wrong_offset: Option<WrongOffset>,
    limit: LimitNotice,
}

/// A limit that acts, and the one that was reported.
#[derive(Debug, Default)]
struct LimitNotice {
    acts: Option<SpeedLimit>,
    since: Stamp,
    reported: Option<SpeedLimit>,
}

impl Notices {
    /// The state that was reported last.
    pub fn state(&self) -> Option<&State> {
        self.state.as_ref()
    }

    /// The sentences for a step; none where it brings nothing new.
    pub fn of(&mut self, now: Stamp, step: &Step) -> Vec<String> {
        let words = [
            self.of_state(step),
            self.of_fallback(step),
            self.of_offset(step),
            self.limit.of(now, step),
        ];
        words.into_iter().flatten().map(|words| format!("{:8.2} s  {words}", now.secs())).collect()
    }

    fn of_state(&mut self, step: &Step) -> Option<String> {
        if self.state.as_ref() == Some(&step.state) {
            return None;
        }
        self.state = Some(step.state.clone());
        Some(match &step.state {
            State::Holding(why) => format!("holding: {}", names::hold_in_words(why)),
            State::Fault(why) => format!("fault: {}", names::fault_in_words(why)),
            state => state.name().to_owned(),
        })
    }

    fn of_fallback(&mut self, step: &Step) -> Option<String> {
        let before = std::mem::replace(&mut self.fallback, step.trace.fallback);
        let why = step.trace.fallback.filter(|why| before != Some(*why))?;
        Some(format!("PI control takes over for the rest of the bead: {}", names::fallback(why)))
    }

    fn of_offset(&mut self, step: &Step) -> Option<String> {
        let wrong = step.trace.wrong_offset.filter(|_| self.wrong_offset.is_none())?;
        self.wrong_offset = Some(wrong);
        Some(format!("warning: {}", names::wrong_offset_in_words(wrong)))
    }
}

impl LimitNotice {
    fn of(&mut self, now: Stamp, step: &Step) -> Option<String> {
        let tracking = step.state == State::Tracking;
        if let Some(Command::Speed(_)) = step.command {
            let limit = step.trace.limit;
            let is_range = matches!(limit, SpeedLimit::MinSpeed | SpeedLimit::MaxSpeed);
            let acts = (tracking && is_range).then_some(limit);
            if acts != self.acts {
                (self.acts, self.since) = (acts, now);
            }
        }
        if self.acts == self.reported || now - self.since < LIMIT_DELAY {
            return None;
        }
        let Some(limit) = self.acts else {
            self.reported = None;
            return Some("no longer at a speed limit".to_owned());
        };
        let (Some(Command::Speed(speed)), Some(demand)) =
            (step.command, step.trace.demand_mm_per_s)
        else {
            return None;
        };
        self.reported = Some(limit);
        Some(at_limit(limit, speed, demand))
    }
}

/// A bead is as wide at a multiple of the speed with the same multiple of the flow.
fn at_limit(limit: SpeedLimit, speed: MmPerS, demand: MmPerS) -> String {
    let percent = 100.0 * (speed / demand - 1.0).abs();
    let (which, wants) =
        if limit == SpeedLimit::MinSpeed { ("slowest", "more") } else { ("fastest", "less") };
    format!(
        "at the {which} speed of [limits], {:.1} mm/s, where the target width needs {:.1}: \
         {percent:.0} % {wants} flow would be needed",
        speed.get(),
        demand.get()
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::Trace;
    use crate::core::Mm;

    fn at(s: f64) -> Stamp {
        Stamp::from_secs(s)
    }

    fn step(speed: f64, demand: f64, limit: SpeedLimit) -> Step {
        let trace =
            Trace { demand_mm_per_s: Some(MmPerS::constant(demand)), limit, ..Trace::default() };
        let command = Some(Command::Speed(MmPerS::constant(speed)));
        Step { command, state: State::Tracking, trace, extruder: None }
    }

    #[test]
    fn a_limit_that_stays_is_reported_once_with_the_flow_that_is_missing() {
        let mut notices = Notices::default();
        assert_eq!(notices.of(at(0.0), &step(80.0, 80.0, SpeedLimit::None)).len(), 1);
        let mut words = Vec::new();
        for tenth in 1..30 {
            let now = at(0.1 * f64::from(tenth));
            words.extend(notices.of(now, &step(60.0, 56.0, SpeedLimit::MinSpeed)));
        }
        assert_eq!(words.len(), 1, "{words:?}");
        assert!(words[0].contains("60.0 mm/s") && words[0].contains("7 % more flow"), "{words:?}");
        for tenth in 30..60 {
            let now = at(0.1 * f64::from(tenth));
            words.extend(notices.of(now, &step(70.0, 70.0, SpeedLimit::None)));
        }
        assert_eq!(words.len(), 2, "{words:?}");
    }

    #[test]
    fn a_speed_that_touches_its_limit_now_and_then_is_not_reported() {
        let mut notices = Notices::default();
        let mut words = Vec::new();
        for tenth in 0..60 {
            let limit = if tenth % 4 == 0 { SpeedLimit::MaxSpeed } else { SpeedLimit::None };
            let now = at(0.1 * f64::from(tenth));
            words.extend(notices.of(now, &step(150.0, 151.0, limit)));
        }
        assert_eq!(words.len(), 1, "{words:?}");
        assert!(words[0].ends_with("tracking"));
    }

    #[test]
    fn a_fallback_is_reported_when_it_begins() {
        let mut notices = Notices::default();
        let mut fallen = step(80.0, 80.0, SpeedLimit::None);
        fallen.trace.fallback = Some(FallbackReason::NoPath);
        assert_eq!(notices.of(at(0.0), &step(80.0, 80.0, SpeedLimit::None)).len(), 1);
        let words = notices.of(at(0.1), &fallen);
        assert!(words[0].contains("the robot reports no path"), "{words:?}");
        assert!(notices.of(at(0.2), &fallen).is_empty());
    }

    #[test]
    fn a_wrong_offset_is_reported_once() {
        let mut notices = Notices::default();
        let mut warned = step(80.0, 80.0, SpeedLimit::None);
        assert_eq!(notices.of(at(0.0), &warned).len(), 1);
        let (found_mm, stated_mm) = (Mm::constant(73.7), Mm::constant(88.4));
        warned.trace.wrong_offset = Some(WrongOffset { found_mm, stated_mm });
        let words = notices.of(at(0.1), &warned);
        assert!(words[0].contains("about 74 mm") && words[0].contains("is 88.4"), "{words:?}");
        assert!(notices.of(at(0.2), &warned).is_empty());
    }
}
