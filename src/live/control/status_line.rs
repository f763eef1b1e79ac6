//! One line about a run that goes on, for an operator who looks now and then.

use crate::control::{Event, State, Step};
use crate::core::{Mm, MmPerS, Stamp};
use crate::rows::names;
use crate::rows::summary::StateFollower;
use crate::width_control::limiter::SpeedLimit;

/// What the line is made of.
#[derive(Debug, Default)]
pub struct StatusLine {
    width: Option<ShownWidth>,
    captured_at: Option<Stamp>,
    follower: StateFollower,
    speed: Option<MmPerS>,
    robot_up: bool,
    /// None without an extruder that is commanded.
    extruder_up: Option<bool>,
}

/// The newest width.
#[derive(Debug, Clone, Copy)]
struct ShownWidth {
    width: Mm,
    sigma: Mm,
    target: Option<Mm>,
}

impl StatusLine {
    /// For a cell whose extruder is commanded, or is not.
    pub fn new(with_extruder: bool) -> Self {
        Self { extruder_up: with_extruder.then_some(false), ..Self::default() }
    }

    /// Takes an event with the controller's step, and returns the line when a setpoint is due.
    pub fn of(&mut self, now: Stamp, event: &Event, step: &Step) -> Option<String> {
        let _ = self.follower.step(now, event, step);
        self.take(event, step);
        matches!(event, Event::Tick).then(|| self.words(now))
    }

    fn take(&mut self, event: &Event, step: &Step) {
        match event {
            Event::Measured { captured_at, width_mm, sigma_mm, .. } => {
                let target = step.trace.error_mm.map(|error| *width_mm - error);
                self.width = Some(ShownWidth { width: *width_mm, sigma: *sigma_mm, target });
                self.captured_at = Some(*captured_at);
            }
            Event::Repeated { first_at, .. } => self.captured_at = Some(*first_at),
            Event::Rejected { captured_at, .. } => self.captured_at = Some(*captured_at),
            Event::Robot(robot) => self.speed = Some(robot.speed_mm_per_s),
            Event::LinkUp { .. } => self.robot_up = true,
            Event::LinkDown { .. } => self.robot_up = false,
            Event::ExtruderUp => self.extruder_up = Some(true),
            Event::ExtruderDown { .. } => self.extruder_up = Some(false),
            _ => {}
        }
    }

    fn words(&self, now: Stamp) -> String {
        let parts = [
            Some(self.width.map_or("no width yet".to_owned(), ShownWidth::words)),
            Some(self.state_words()),
            self.speed.map(|speed| self.speed_words(speed)),
            Some(self.captured_at.map_or("no frame yet".to_owned(), |at| {
                format!("frame {:.1} s old", (now - at).secs())
            })),
            Some(link_words("robot", self.robot_up)),
            self.extruder_up.map(|up| link_words("extruder", up)),
        ];
        parts.into_iter().flatten().collect::<Vec<_>>().join(" | ")
    }

    fn state_words(&self) -> String {
        match self.follower.state() {
            State::Holding(why) => format!("holding, {}", names::in_words(names::of(why))),
            State::Fault(why) => format!("fault, {}", names::in_words(&names::fault(why))),
            state => state.name().to_owned(),
        }
    }

    fn speed_words(&self, speed: MmPerS) -> String {
        let limit = match self.follower.limit() {
            SpeedLimit::None => String::new(),
            limit => format!(" ({})", names::in_words(names::of(limit))),
        };
        format!("{:.1} mm/s{limit}", speed.get())
    }
}

impl ShownWidth {
    fn words(self) -> String {
        let target = self.target.map_or(String::new(), |target| format!(" of {:.2}", target.get()));
        format!("{:.2} ± {:.3}{target} mm", self.width.get(), self.sigma.get())
    }
}

fn link_words(name: &str, is_up: bool) -> String {
    format!("{name} {}", if is_up { "up" } else { "down" })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use super::*;
    use crate::control::{Command, Hold, Trace};

    fn at(s: f64) -> Stamp {
        Stamp::from_secs(s)
    }

    fn step(state: State) -> Step {
        let trace = Trace {
            error_mm: Some(Mm::constant(0.1)),
            limit: SpeedLimit::MinSpeed,
            ..Trace::default()
        };
        let command = Some(Command::Speed(MmPerS::constant(60.0)));
        Step { command, state, trace, extruder: None }
    }

    fn measured(s: f64) -> Event {
        let (width_mm, sigma_mm) = (Mm::constant(42.1), Mm::constant(0.02));
        Event::Measured { frame: 0, captured_at: at(s), width_mm, sigma_mm }
    }

    #[test]
    fn it_says_width_state_speed_age_and_connections() {
        let mut line = StatusLine::new(true);
        assert_eq!(line.of(at(0.0), &Event::ExtruderUp, &Step::default()), None);
        let first = line.of(at(0.0), &Event::Tick, &Step::default()).unwrap();
        assert_eq!(first, "no width yet | idle | no frame yet | robot down | extruder up");
        assert_eq!(line.of(at(0.1), &measured(0.05), &step(State::Tracking)), None);
        let held = State::Holding(Hold::NoWidth);
        let words = line.of(at(1.05), &Event::Tick, &step(held)).unwrap();
        assert!(words.starts_with("42.10 ± 0.020 of 42.00 mm | holding, no width | "), "{words}");
        assert!(words.contains("| frame 1.0 s old |"), "{words}");
    }

    #[test]
    fn a_frozen_camera_has_frames_of_an_age() {
        let mut line = StatusLine::new(false);
        let (width_mm, sigma_mm) = (Mm::constant(42.0), Mm::constant(0.02));
        let repeated = Event::Repeated {
            frame: 9,
            captured_at: at(2.0),
            first_at: at(0.5),
            width_mm,
            sigma_mm,
        };
        let tracking = step(State::Tracking);
        assert_eq!(line.of(at(2.0), &repeated, &tracking), None);
        let words = line.of(at(2.0), &Event::Tick, &tracking).unwrap();
        assert!(words.contains("frame 1.5 s old"), "{words}");
    }
}
