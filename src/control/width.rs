//! Measured widths: where the bead in a frame was laid, and the sample for the width
//! controller.

use super::controller::{Controller, FirstEqual};
use super::extruder_control::NO_OVERRIDE;
use super::phase::{Arrival, Bead, Mode, Phase};
use super::step::{Hold, Trace};
use crate::core::{Mm, ROBOT_LAG, SpeedMatch, Stamp};
use crate::width_control::controller::{Outlook, SpeedRequest, WidthSample, WidthTrace};
use crate::width_control::distance::WidthReading;
use crate::width_control::limiter::SpeedLimit;
use crate::width_control::pi::Saturation;
use crate::width_control::target::BeadSegment;

/// Smallest speed override by which the robot's speed is divided to get the width
/// controller's own. Below it the robot is at its own limits, and the quotient is not what
/// the width controller requested.
const MIN_OVERRIDE: f64 = 0.5;

/// Path over which equal frames cannot show a moving bead (`docs/src/reference/output-files.md`,
/// § Statuses of a frame). A smaller value takes the jitter of a robot that stands for motion;
/// bead moves as far within a frame or two.
const MIN_MOVED: Mm = Mm::constant(1.0);

impl Controller {
    /// Whether the nozzle has moved since the first of several equal frames, or since the first
    /// of them for which its path was known.
    pub(super) fn has_moved(&mut self, first_at: Stamp, captured_at: Stamp) -> bool {
        let Some(path) = self.robot.path.path_at(captured_at) else { return false };
        let known = self.first_equal.filter(|first| first.captured_at == first_at);
        let first = known.unwrap_or_else(|| FirstEqual {
            captured_at: first_at,
            path: self.robot.path.path_at(first_at).unwrap_or(path),
        });
        // Kept, because the history of the path may not reach back as far later.
        self.first_equal = Some(first);
        (path - first.path).abs() > MIN_MOVED
    }

    /// A frame that shows what the first of several equal ones has shown counts as not captured.
    pub(super) fn repeated(&mut self, first_at: Stamp, captured_at: Stamp, trace: &mut Trace) {
        trace.frame_repeated = true;
        self.locate(captured_at, trace);
        if let Some(bead) = self.phase.bead_mut() {
            bead.known_until(first_at);
        }
    }

    pub(super) fn measured(
        &mut self,
        now: Stamp,
        captured_at: Stamp,
        reading: WidthReading,
        trace: &mut Trace,
    ) {
        self.locate(captured_at, trace);
        let error = reading.width - self.target_of(trace);
        trace.error_mm = Some(error);
        let start = &self.setup.cell;
        let primed =
            trace.nozzle_path_mm.is_some_and(|path| path - self.bead.start >= start.start_length);
        let driven = self.robot.state.map_or(start.start_speed, |robot| robot.speed_mm_per_s);
        let factor = self.speed_override(now).unwrap_or(NO_OVERRIDE);
        let is_own_bead = trace.bead_expected;
        if is_own_bead && self.robot.odometer.reports_no_path() {
            self.width.path_is_estimated();
        }
        let arrival = Arrival { at: now, captured_at, max_gap: self.setup.control.max_gap };
        let may_begin = primed
            && is_own_bead
            && self.phase.bead_mut().is_some_and(|bead| bead.may_track(&arrival));
        let sample = WidthSample {
            captured_at,
            reading,
            error,
            nozzle_path: trace.nozzle_path_mm,
            is_own_bead,
            tracked: self.phase.bead().and_then(Bead::tracked),
            may_begin,
            driven: driven * (1.0 / factor.max(MIN_OVERRIDE)),
            saturation: self.saturation(),
        };
        let mut of_width = WidthTrace::default();
        let tracking = self.width.measured(&sample, &mut of_width);
        trace.proportional_mm_per_s = of_width.proportional;
        trace.integral_mm_per_s = of_width.integral;
        trace.demand_mm_per_s = of_width.demand;
        trace.distance = of_width.distance;
        trace.steps = of_width.steps;
        if let (Some(tracking), Some(bead)) = (tracking, self.phase.bead_mut()) {
            bead.mode = Mode::Tracking { seen_at: tracking.seen_at };
            if let Some(last) = &mut bead.setpoint
                && tracking.is_new
            {
                last.speed = driven;
            }
        }
        self.check_watch(now, &sample, trace);
    }

    /// Holds if the width of the bead that is being laid does not answer the speed, and records an
    /// offset that is wrong.
    fn check_watch(&mut self, now: Stamp, sample: &WidthSample, trace: &mut Trace) {
        let Some(watch) = &mut self.watch else { return };
        let Some(path) = sample.nozzle_path.filter(|_| sample.is_own_bead) else { return };
        let target = sample.reading.width - sample.error;
        let found = watch.measured(path, sample.reading, target);
        trace.wrong_offset = found.wrong_offset;
        let factor = self.speed_override(now).unwrap_or(NO_OVERRIDE).max(MIN_OVERRIDE);
        if let Some(found) = found.no_response
            && let Some(bead) = self.phase.bead_mut()
            && bead.tracked().is_some()
        {
            // Control may have changed the speed once more since, for nothing.
            if let Some(setpoint) = &mut bead.setpoint {
                setpoint.requested = found.speed_before * (1.0 / factor);
            }
            self.phase.hold(now, Hold::NoResponse(found));
        }
    }

    /// The target width where the bead in a frame was laid.
    fn target_of(&self, trace: &Trace) -> Mm {
        let captured_at = trace.captured_at.unwrap_or_default();
        let z = self.robot.path.z_at(captured_at).unwrap_or_default();
        let path = trace.bead_path_mm.map_or(Mm::ZERO, |path| path - self.bead.start);
        self.setup.control.target.at(z, path)
    }

    /// Records where the nozzle was when a frame was captured, and where the bead in the
    /// frame was laid.
    pub(super) fn locate(&mut self, captured_at: Stamp, trace: &mut Trace) {
        self.camera_lost = false;
        trace.captured_at = Some(captured_at);
        trace.nozzle_path_mm = self.robot.path.path_at(captured_at);
        trace.bead_path_mm = trace.nozzle_path_mm.map(|path| path - self.setup.cell.camera_offset);
        trace.bead_expected = self.phase != Phase::Idle
            && trace.bead_path_mm.is_some_and(|path| path >= self.bead.known_from);
    }

    /// The state of a bead before a setpoint; none unless it is priming or tracking.
    pub(super) fn outlook(&self, now: Stamp) -> Option<Outlook> {
        let tracked = match self.phase.bead()?.mode {
            Mode::Priming => None,
            Mode::Tracking { seen_at } => Some(seen_at),
            Mode::Holding { .. } | Mode::Fault { .. } => return None,
        };
        let path = self.robot.path.path_at(now);
        Some(Outlook { now, path, laid: self.laid_at(now), tracked })
    }

    /// What the next setpoint is for: the piece of bead that is laid at it.
    pub(super) fn speed_request(&self, now: Stamp) -> SpeedRequest {
        let lasts = self.setup.cell.setpoint_period;
        let target = self.robot.state.zip(self.laid_at(now)).map(|(state, laid)| {
            let from = laid + state.speed_mm_per_s * ROBOT_LAG;
            let piece = BeadSegment { from, to: from + state.speed_mm_per_s * lasts };
            self.setup.control.target.over(state.z_mm, piece)
        });
        let path = self.robot.path.path_at(now);
        SpeedRequest { path, from: now + ROBOT_LAG, lasts, target }
    }

    /// The direction in which the robot cannot follow, from the limit that acted on the
    /// last setpoint and from the speed that is read back.
    fn saturation(&self) -> Saturation {
        match (self.phase.limit(), self.robot.speed_match) {
            (SpeedLimit::MaxSpeed | SpeedLimit::Acceleration, _) | (_, SpeedMatch::Slower) => {
                Saturation::Above
            }
            (SpeedLimit::MinSpeed | SpeedLimit::Deceleration, _) | (_, SpeedMatch::Faster) => {
                Saturation::Below
            }
            _ => Saturation::None,
        }
    }
}
