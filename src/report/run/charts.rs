//! The data of the plots, collected step by step in bounded memory.

use super::distance::DistanceCharts;
use super::extruder::ExtruderCharts;
use crate::control::{Event, State, Step};
use crate::core::{MmPerS, Stamp};
use crate::numeric::number::to_f64;
use crate::report::chart::{Mark, PlotCurve, Strip};
use crate::rows::frame_row::FrameRow;
use crate::rows::names;
use crate::rows::summary::StateFollower;

/// A quantity over time (or frames) and over path.
#[derive(Debug, Default)]
pub struct TimeAndPath {
    /// Over time, or over frame numbers if the time is unknown.
    pub time: PlotCurve,
    /// Over the distance along the path.
    pub path: PlotCurve,
}

impl TimeAndPath {
    fn push(&mut self, time: f64, path: Option<f64>, value: f64) {
        self.time.push(time, value);
        if let Some(path) = path {
            self.path.push(path, value);
        }
    }
}

/// Data of all plots.
#[derive(Debug, Default)]
pub struct Charts {
    /// Whether x is time or the number of the frame; the first frame decides.
    pub timed: Option<bool>,
    /// Measured width.
    pub width: TimeAndPath,
    /// Width less two standard deviations.
    pub width_low: TimeAndPath,
    /// Width plus two standard deviations.
    pub width_high: TimeAndPath,
    /// Target width at the measured bead.
    pub target: TimeAndPath,
    /// Last reported speed of the robot.
    pub speed: TimeAndPath,
    /// Setpoints.
    pub setpoint: TimeAndPath,
    /// Demand of the controller before the limiter.
    pub demand: TimeAndPath,
    /// Contrast of the images \[grey levels\].
    pub contrast: PlotCurve,
    /// Blur of the edges \[px\].
    pub blur: PlotCurve,
    /// Noise of a pixel \[grey levels\].
    pub noise: PlotCurve,
    /// Saturated pixels \[%\].
    pub saturated: PlotCurve,
    /// Rows in use for the width \[%\].
    pub used: PlotCurve,
    /// Standard deviation of the width \[mm\].
    pub sigma: PlotCurve,
    /// Rejected frames.
    pub rejected: Strip,
    /// States of the controller.
    pub states: Strip,
    /// Limits that acted.
    pub limits: Strip,
    /// Estimates of the distance controller.
    pub distance: DistanceCharts,
    /// The extruder side.
    pub extruder: ExtruderCharts,
    follower: StateFollower,
}

impl Charts {
    /// Adds a measured or rejected frame.
    pub fn frame(&mut self, row: &FrameRow) {
        let timed = *self.timed.get_or_insert(row.time_s.is_some());
        let x = if timed { row.time_s } else { Some(to_f64(row.frame)) };
        let Some(x) = x else { return };
        let measured = match &row.outcome {
            Err(status) => return self.rejected.push(x, Mark { severity: 1, name: status }),
            Ok(measured) => measured,
        };
        self.rejected.push(x, Mark { severity: 0, name: "ok" });
        let path = row.control.and_then(|control| control.measured_path).map(f64::from);
        let (width, sigma) = (measured.width.get(), measured.sigma.get());
        self.width.push(x, path, width);
        self.width_low.push(x, path, width - 2.0 * sigma);
        self.width_high.push(x, path, width + 2.0 * sigma);
        if let Some(target) = row.control.and_then(|control| control.target) {
            self.target.push(x, path, target.get());
        }
        self.contrast.push(x, measured.hints.contrast_grey);
        self.blur.push(x, measured.hints.blur_px);
        self.noise.push(x, measured.hints.noise_grey);
        self.saturated.push(x, measured.hints.saturated_fraction * 100.0);
        self.used.push(x, measured.hints.used_fraction * 100.0);
        self.sigma.push(x, sigma);
    }

    /// Adds a step of the controller.
    pub fn step(&mut self, now: Stamp, event: &Event, step: &Step) {
        self.timed.get_or_insert(true);
        self.extruder.step(now, event, step);
        self.distance.step(step);
        let time = now.secs();
        let before = self.follower.setpoint();
        let _ = self.follower.step(now, event, step);
        let path = self.follower.path().map(f64::from);
        if let Event::Robot(robot) = event {
            self.speed.push(time, path, robot.speed_mm_per_s.get());
        }
        if let Some(setpoint) = self.follower.setpoint()
            && (step.command.is_some() || before != Some(setpoint))
        {
            self.setpoint.push(time, path, setpoint.get());
        }
        if let Some(demand) = step.trace.demand_mm_per_s {
            self.demand.push(time, path, MmPerS::get(demand));
        }
        self.states.push(time, state_mark(self.follower.state()));
        let limit = names::of(self.follower.limit());
        self.limits.push(time, Mark { severity: u8::from(limit != "none"), name: limit });
    }
}

fn state_mark(state: &State) -> Mark {
    let severity = match state {
        State::Idle => 0,
        State::Tracking => 1,
        State::Priming => 2,
        State::Holding(_) => 3,
        State::Fault(_) => 4,
    };
    Mark { severity, name: state.name() }
}
