//! The rendered camera: images of a simulated bead that follows the path and speed of the robot's
//! reports.

use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, bounded};

use super::fault;
use crate::cell::{CameraSettings, Mount};
use crate::core::{RobotState, Span, Stamp};
use crate::io::clock::RunClock;
use crate::run::ports::{FrameSource, Grab, SourceError};
use crate::scenario::table::Simulation;
use crate::sim::bead_follower::{BeadFollower, BeadRecipe};
use crate::sim::render::Renderer;

/// Reports that may wait for the camera: about 20 s of a robot that reports every 20 ms.
const WAITING_REPORTS: usize = 1024;

/// Passes the robot's reports to the camera. Copies pass them to the same camera.
#[derive(Debug, Clone)]
pub struct RobotView(Sender<(Stamp, RobotState)>);

impl RobotView {
    /// Passes on a report with its time of arrival; never waits. If the queue is full because no
    /// frames are taken, the report is lost; the next one replaces it.
    pub fn observe(&self, at: Stamp, state: &RobotState) {
        let _ = self.0.try_send((at, *state));
    }
}

/// Renders the bead under the camera at a fixed rate.
pub struct RenderedCamera {
    renderer: Renderer,
    follower: BeadFollower,
    reports: Receiver<(Stamp, RobotState)>,
    stop: Receiver<()>,
    clock: RunClock,
    period: Span,
    offset_mm: f64,
    stamp_delay: Span,
    rides: bool,
    seq: u64,
    due: Option<Stamp>,
    first: Option<Stamp>,
}

impl RenderedCamera {
    /// A camera as the cell describes it. It ends, within a frame's period, on a message to `stop`
    /// or when its sender is dropped.
    pub fn new(
        renderer: Renderer,
        simulation: &Simulation,
        camera: &CameraSettings,
        clock: RunClock,
        stop: Receiver<()>,
    ) -> (Self, RobotView) {
        let recipe = BeadRecipe {
            model: simulation.bead,
            roughness: simulation.roughness,
            flow: simulation.flow,
            seed: simulation.seed,
        };
        let (robot_states, reports) = bounded(WAITING_REPORTS);
        let source = Self {
            renderer,
            follower: BeadFollower::new(recipe),
            reports,
            stop,
            clock,
            period: Span::from_secs(1.0 / camera.rate_hz),
            offset_mm: camera.offset.get(),
            stamp_delay: simulation.stamp_delay,
            rides: camera.mount == Mount::Flange,
            seq: 0,
            due: None,
            first: None,
        };
        (source, RobotView(robot_states))
    }

    /// Waits until the next frame is due; returns false when the camera was stopped. Missed frames
    /// are skipped.
    fn wait(&mut self) -> bool {
        let now = self.clock.now();
        let due = self.due.map_or(now, |due| (due + self.period).max(now));
        self.due = Some(due);
        loop {
            match self.stop.recv_timeout((due - self.clock.now()).wait()) {
                Err(RecvTimeoutError::Timeout) if self.clock.now() >= due => return true,
                Err(RecvTimeoutError::Timeout) => {}
                Ok(()) | Err(RecvTimeoutError::Disconnected) => return false,
            }
        }
    }
}

impl FrameSource for RenderedCamera {
    fn next_frame(&mut self) -> Result<Option<Grab>, SourceError> {
        if !self.wait() {
            return Ok(None);
        }
        let captured_at = self.clock.now();
        for (at, state) in self.reports.try_iter() {
            self.follower.observe(at, &state);
        }
        let nozzle = self.follower.path_at(captured_at - self.stamp_delay);
        let under = nozzle.map(|nozzle| nozzle - self.offset_mm);
        let bead = self.follower.bead();
        let robot_z = self.follower.z().filter(|_| self.rides);
        let rendered = self
            .renderer
            .render(self.seq, captured_at, robot_z, &|along| bead.edges_at(under? + along))
            .map_err(|error| fault("rendered", error.to_string()))?;
        self.seq += 1;
        let first = *self.first.get_or_insert(captured_at);
        let time_s = Some((captured_at - first).secs());
        Ok(Some(Grab::Frame { frame: rendered.frame, time_s }))
    }
}

#[cfg(test)]
mod tests;
