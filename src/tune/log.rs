//! What is taken of a run: reports, widths, setpoints, and how far a course of steps
//! came.

use crate::control::event::Event;
use crate::control::step::{Command, Step};
use crate::core::robot::RobotState;
use crate::core::time::Stamp;
use crate::core::units::MmPerS;
use crate::identify::camera_offset::TimedWidth;
use crate::width_control::steps::{StepSettings, StepsProgress, StepsTrace};

/// A run as it was recorded, in order.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Log {
    /// What the robot reported, when it arrived.
    pub states: Vec<(Stamp, RobotState)>,
    /// Widths that were measured, by capture.
    pub widths: Vec<TimedWidth>,
    /// From capture to arrival at the controller of each, in the order of arrival \[s\].
    pub latencies_s: Vec<f64>,
    /// Speeds that were sent, and when.
    pub setpoints: Vec<(Stamp, MmPerS)>,
    /// Frames that gave no width.
    pub refused: u64,
    /// The newest that was said of a course of steps.
    pub steps: Option<StepsTrace>,
}

impl Log {
    /// Takes an event.
    pub fn event(&mut self, now: Stamp, event: &Event) {
        match event {
            Event::Robot(state) => self.states.push((now, *state)),
            Event::Measured { captured_at, width_mm, sigma_mm, .. } => {
                self.latencies_s.push((now - *captured_at).secs());
                self.widths.push(TimedWidth {
                    at: *captured_at,
                    width: *width_mm,
                    sigma: *sigma_mm,
                });
            }
            Event::Rejected { .. } => self.refused += 1,
            _ => {}
        }
    }

    /// Takes an answer.
    pub fn step(&mut self, now: Stamp, step: &Step) {
        if let Some(Command::Speed(speed)) = step.command {
            self.setpoints.push((now, speed));
        }
        self.steps = step.trace.steps.or(self.steps);
    }

    /// Why a course of steps was not seen to its end, if it was not; none where there was
    /// none.
    pub fn cut_short(&self) -> Option<String> {
        let steps = self.steps?;
        if let Some(width) = steps.near_end_mm {
            return Some(format!(
                "the steps ended early: a width of {:.2} mm came near an end of \
                 gauge.width_range_mm",
                width.get()
            ));
        }
        match steps.progress {
            StepsProgress::Piece(number) => {
                Some(format!("the run ended in piece {} of {}", number + 1, StepSettings::count()))
            }
            StepsProgress::Seeing => {
                Some("the run ended before the camera had seen the last piece".to_owned())
            }
            StepsProgress::Over => None,
        }
    }

    /// Puts widths into the order of their frames, whatever came in between.
    pub fn finish(&mut self) {
        self.widths.sort_by_key(|width| width.at);
    }
}
