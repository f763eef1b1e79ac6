//! Data of a run: reports, widths, setpoints, and the progress of the speed steps.

use crate::control::{Command, Event, Step};
use crate::core::{MmPerS, RobotState, Stamp};
use crate::identify::camera_offset::TimedWidth;
use crate::width_control::steps::{StepSettings, StepsProgress, StepsTrace};

/// A recorded run, in the order of time.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Log {
    /// The robot's reports with their arrival times.
    pub states: Vec<(Stamp, RobotState)>,
    /// Measured widths, by time of capture.
    pub widths: Vec<TimedWidth>,
    /// Time from capture to arrival at the controller of each width, in the order of arrival
    /// \[s\].
    pub latencies_s: Vec<f64>,
    /// Speed setpoints with the times at which they were sent.
    pub setpoints: Vec<(Stamp, MmPerS)>,
    /// Number of rejected frames.
    pub refused: u64,
    /// Latest progress of the speed steps.
    pub steps: Option<StepsTrace>,
}

impl Log {
    /// Adds an event.
    pub fn event(&mut self, now: Stamp, event: &Event) {
        match event {
            Event::Robot(state) => self.states.push((now, *state)),
            Event::Measured { captured_at, width_mm, sigma_mm, .. } => {
                self.latencies_s.push((now - *captured_at).secs());
                let (at, width, sigma) = (*captured_at, *width_mm, *sigma_mm);
                self.widths.push(TimedWidth { at, width, sigma });
            }
            Event::Rejected { .. } => self.refused += 1,
            _ => {}
        }
    }

    /// Adds a step of the controller.
    pub fn step(&mut self, now: Stamp, step: &Step) {
        if let Some(Command::Speed(speed)) = step.command {
            self.setpoints.push((now, speed));
        }
        self.steps = step.trace.steps.or(self.steps);
    }

    /// Why the speed steps were not completed; `None` if they were, or if there were none.
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

    /// Sorts the widths by time of capture.
    pub fn finish(&mut self) {
        self.widths.sort_by_key(|width| width.at);
    }
}
