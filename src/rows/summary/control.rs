//! The summary of a run with a controller.

use std::collections::BTreeMap;

use serde::Serialize;

use super::follow::{Interval, StateFollower};
use super::note::RunNote;
use super::times::Times;
use super::tolerance::{ToleranceRule, ToleranceSummary, ToleranceTally};
use crate::control::{Event, State, Step};
use crate::core::{Mm, Stamp};
use crate::numeric::statistics::{Distribution, Moments};
use crate::rows::frame_row::FrameRow;
use crate::rows::names;
use crate::width_control::limiter::SpeedLimit;
use crate::width_control::watch::WrongOffset;

/// Path length after the start of control from which the bead counts as settled, by the contract
/// of `summary.json` for `width_error_rms_settled_mm`.
const SETTLED_AFTER: Mm = Mm::constant(500.0);

/// The figures of the controller.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ControlSummary {
    /// Mean of |measured − target| over the bead laid after control began.
    pub width_error_mean_mm: Option<f64>,
    /// Root mean square of the error over the same bead.
    pub width_error_rms_mm: Option<f64>,
    /// Root mean square of the error over bead laid more than 500 mm after control began.
    pub width_error_rms_settled_mm: Option<f64>,
    /// The largest error of the bead laid after control began, with its sign, and the robot's path
    /// at which that bead was laid.
    pub width_error_worst: Option<LargestError>,
    /// How much of the bead was out of tolerance; absent where the width is not controlled.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<ToleranceSummary>,
    /// Setpoints that were written to the robot.
    pub setpoints_sent: u64,
    /// Time during which a limit acted on the speed.
    pub limited_s: f64,
    /// Time for each limit.
    pub limited_by_s: BTreeMap<&'static str, f64>,
    /// Time during which the controller held.
    pub held_s: f64,
    /// Time for each reason of a hold.
    pub held_for_s: BTreeMap<&'static str, f64>,
    /// Number of faults.
    pub faults: u64,
    /// Number of faults for each reason.
    pub fault_reasons: BTreeMap<String, u64>,
    /// The camera offset that fits the widths better than the stated one, where one does.
    pub wrong_offset: Option<WrongOffset>,
    /// Time in each state.
    pub states_s: BTreeMap<&'static str, f64>,
    /// Latency: time from receiving a frame until the first setpoint that uses it is written, less
    /// the wait below. Quantiles have an error of 0.14 %, the maximum is exact.
    pub latency_ms: Quantiles,
    /// Wait for the scheduled time of the setpoint.
    pub send_wait_ms: Quantiles,
    /// Frames that were not measured, because a newer one was there.
    pub frames_superseded: u64,
    /// Frames that were not recorded because the recorder was too slow.
    pub frames_dropped_by_recorder: u64,
    /// Events or steps that could not be recorded.
    pub records_lost: u64,
    /// Whether the link to the robot was ever up.
    pub was_connected: bool,
    /// Number of times the link came up again.
    pub link_reconnects: u64,
    /// Reports of the robot that were not used, because the robot's clock had not risen.
    pub robot_reports_ignored: u64,
}

/// The largest error of a width.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LargestError {
    /// Measured width less target \[mm\].
    pub error_mm: f64,
    /// Robot's path at which the measured bead was laid \[mm\].
    pub bead_path_mm: f64,
}

/// Median, 99 % quantile and maximum; null without values.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Quantiles {
    /// Median.
    pub p50: Option<f64>,
    /// Quantile of 99 %.
    pub p99: Option<f64>,
    /// Largest.
    pub max: Option<f64>,
}

impl Quantiles {
    fn of(distribution: &Distribution) -> Self {
        Self {
            p50: distribution.quantile(0.5),
            p99: distribution.quantile(0.99),
            max: distribution.max(),
        }
    }
}

/// Accumulates times, errors and counts of the controller.
#[derive(Debug, Default)]
pub struct ControlTally {
    follower: StateFollower,
    began: ControlBegan,
    error: Moments,
    error_size: Moments,
    error_settled: Moments,
    worst: Option<LargestError>,
    tolerance: Option<ToleranceTally>,
    limited_by: Times,
    held_for: Times,
    states: Times,
    fault_reasons: BTreeMap<String, u64>,
    latency: Distribution,
    send_wait: Distribution,
    setpoints: u64,
    superseded: u64,
    dropped: u64,
    records_lost: u64,
    links: u64,
    reports_ignored: u64,
    wrong_offset: Option<WrongOffset>,
}

/// Path of the current bead at which control began.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
enum ControlBegan {
    #[default]
    NotYet,
    At(Mm),
    /// The bead has ended; its last part may still be measured, and the next bead starts again.
    Over(Mm),
}

impl ControlTally {
    pub fn set_tolerance(&mut self, rule: Option<ToleranceRule>) {
        self.tolerance = rule.map(ToleranceTally::new);
    }

    pub fn frame(&mut self, row: &FrameRow) {
        if *self.follower.state() != State::Idle
            && let Some(tolerance) = &mut self.tolerance
        {
            tolerance.frame(row);
        }
        let (Ok(measured), Some(control)) = (&row.outcome, row.control) else { return };
        let Some(target) = control.target else { return };
        let (ControlBegan::At(began) | ControlBegan::Over(began)) = self.began else { return };
        let Some(bead) = control.measured_path.filter(|bead| *bead >= began) else { return };
        // While the robot does not print, the camera sees the same bead again and again.
        if control.state == State::Idle.name() {
            return;
        }
        let error = measured.width - target;
        self.error.add(error.get());
        self.error_size.add(error.get().abs());
        if self.worst.is_none_or(|worst| error.get().abs() > worst.error_mm.abs()) {
            self.worst = Some(LargestError { error_mm: error.get(), bead_path_mm: bead.get() });
        }
        if bead > began + SETTLED_AFTER {
            self.error_settled.add(error.get());
        }
    }

    pub fn step(&mut self, now: Stamp, event: &Event, step: &Step) {
        if matches!(event, Event::LinkUp { .. }) {
            self.links += 1;
        }
        self.reports_ignored += u64::from(step.trace.report_ignored);
        self.wrong_offset = self.wrong_offset.or(step.trace.wrong_offset);
        let before = self.follower.state().clone();
        if let Some(lapse) = self.follower.step(now, event, step) {
            self.add_time(&lapse);
        }
        if let State::Fault(why) = &step.state
            && !matches!(before, State::Fault(_))
        {
            *self.fault_reasons.entry(names::fault(why)).or_default() += 1;
        }
        self.follow_bead(now, &before);
        self.began = match (&step.state, self.began) {
            (State::Priming, _) => ControlBegan::NotYet,
            (State::Idle, ControlBegan::At(path)) => ControlBegan::Over(path),
            (State::Tracking, ControlBegan::NotYet | ControlBegan::Over(_)) => {
                let path = self.follower.path().or(step.trace.nozzle_path_mm);
                path.map_or(ControlBegan::NotYet, ControlBegan::At)
            }
            (_, began) => began,
        };
    }

    /// Follows the bead that is being laid.
    fn follow_bead(&mut self, now: Stamp, before: &State) {
        let Some(tolerance) = &mut self.tolerance else { return };
        match (self.follower.state(), self.follower.path()) {
            (State::Idle, _) => tolerance.end_bead(now),
            (state, Some(path)) => {
                let is_new = *state == State::Priming && *before != State::Priming;
                tolerance.laid_to(now, path, is_new);
            }
            (_, None) => {}
        }
    }

    pub fn latency(&mut self, latency_ms: f64, send_wait_ms: f64) {
        self.latency.add(latency_ms);
        self.send_wait.add(send_wait_ms);
    }

    pub fn note(&mut self, note: &RunNote) {
        match note {
            RunNote::SetpointSent => self.setpoints += 1,
            RunNote::FramesSuperseded(more) => self.superseded += more,
            RunNote::FramesDroppedByRecorder(more) => self.dropped += more,
            RunNote::RecordsLost(more) => self.records_lost += more,
            RunNote::Remark(_) | RunNote::FrameRepeated => {}
        }
    }

    pub fn latencies(&self) -> &Distribution {
        &self.latency
    }

    pub fn finish(&self) -> ControlSummary {
        ControlSummary {
            width_error_mean_mm: self.error_size.mean(),
            width_error_rms_mm: self.error.rms(),
            width_error_rms_settled_mm: self.error_settled.rms(),
            width_error_worst: self.worst,
            tolerance: self.tolerance.as_ref().map(ToleranceTally::finish),
            setpoints_sent: self.setpoints,
            limited_s: self.limited_by.total_s(),
            limited_by_s: self.limited_by.seconds(),
            held_s: self.held_for.total_s(),
            held_for_s: self.held_for.seconds(),
            faults: self.fault_reasons.values().sum(),
            fault_reasons: self.fault_reasons.clone(),
            wrong_offset: self.wrong_offset,
            states_s: self.states.seconds(),
            latency_ms: Quantiles::of(&self.latency),
            send_wait_ms: Quantiles::of(&self.send_wait),
            frames_superseded: self.superseded,
            frames_dropped_by_recorder: self.dropped,
            records_lost: self.records_lost,
            was_connected: self.links > 0,
            link_reconnects: self.links.saturating_sub(1),
            robot_reports_ignored: self.reports_ignored,
        }
    }

    fn add_time(&mut self, lapse: &Interval) {
        self.states.add(lapse.state.name(), lapse.span);
        if let State::Holding(why) = &lapse.state {
            self.held_for.add(names::of(why), lapse.span);
        }
        if lapse.limit != SpeedLimit::None {
            self.limited_by.add(names::of(lapse.limit), lapse.span);
        }
    }
}
