//! The job of a robot without an operator: layer upon layer, while a PC is connected.

use super::virtual_robot::VirtualRobot;
use crate::core::{Mm, RobotMode, Span, Stamp};

/// Begins the beads of a [`VirtualRobot`]. A new connection replaces the operator's key: it
/// restarts a finished job, and acknowledges a `STOP` or `FAULT` that it finds, after the pause.
#[derive(Debug, Clone)]
pub struct PrintJob {
    layers: u32,
    layer_height: Mm,
    first_z: Mm,
    pause: Span,
    begun: u32,
    acknowledges: bool,
    waiting_since: Option<Stamp>,
}

impl PrintJob {
    /// `layers` beads, each `layer_height` above the previous one, with a pause before each.
    pub fn new(layers: u32, layer_height: Mm, first_z: Mm, pause: Span) -> Self {
        let (begun, acknowledges, waiting_since) = (0, false, None);
        Self { layers, layer_height, first_z, pause, begun, acknowledges, waiting_since }
    }

    /// A PC has connected while the robot is in this mode.
    pub fn connected(&mut self, mode: RobotMode) {
        self.acknowledges = matches!(mode, RobotMode::Stop | RobotMode::Fault);
        self.waiting_since = None;
        if self.begun >= self.layers && (self.acknowledges || mode == RobotMode::Idle) {
            self.begun = 0;
        }
    }

    /// Advances the robot to `now` and begins a bead when it is due.
    pub fn advance(&mut self, now: Stamp, cell: &mut VirtualRobot) {
        cell.advance(now);
        let waits = match cell.mode() {
            RobotMode::Idle => self.begun < self.layers,
            RobotMode::Stop | RobotMode::Fault => self.acknowledges,
            RobotMode::Print | RobotMode::Hold => false,
        };
        if !waits || !cell.greeted() {
            self.waiting_since = None;
            return;
        }
        let since = *self.waiting_since.get_or_insert(now);
        if now - since < self.pause {
            return;
        }
        self.waiting_since = None;
        if cell.mode() == RobotMode::Idle {
            let z = self.first_z + self.layer_height * f64::from(self.begun);
            cell.begin_bead(now, z);
            self.begun += 1;
        } else {
            cell.acknowledge(now);
            self.acknowledges = false;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::{PcLine, RobotParams};

    fn secs(t: f64) -> Stamp {
        Stamp::from_secs(t)
    }

    fn cell() -> VirtualRobot {
        let bead = Some(Mm::constant(10.0));
        VirtualRobot::new(RobotParams { bead, ..RobotParams::default() }, Stamp::START).unwrap()
    }

    fn run(job: &mut PrintJob, cell: &mut VirtualRobot, from_s: f64, to_s: f64) {
        let mut t = from_s;
        while t < to_s {
            job.advance(secs(t), cell);
            t += 0.01;
        }
    }

    #[test]
    fn nothing_is_printed_before_a_pc_is_there() {
        let (mut job, mut cell) = (PrintJob::new(2, Mm::ZERO, Mm::ZERO, Span::ZERO), cell());
        run(&mut job, &mut cell, 0.0, 5.0);
        assert_eq!((job.begun, cell.mode()), (0, RobotMode::Idle));
    }

    #[test]
    fn layers_rise_and_end() {
        let height = Mm::constant(5.0);
        let mut job = PrintJob::new(2, height, Mm::constant(1.0), Span::from_millis(100));
        let mut cell = cell();
        cell.connect(secs(0.0));
        job.connected(cell.mode());
        cell.take(secs(0.0), PcLine::Hello);
        run(&mut job, &mut cell, 0.0, 0.15);
        assert_eq!(cell.state(secs(0.15)).z_mm, Mm::constant(1.0));
        run(&mut job, &mut cell, 0.15, 5.0);
        assert_eq!((job.begun, cell.mode()), (2, RobotMode::Idle));
        assert_eq!(cell.state(secs(5.0)).z_mm, Mm::constant(6.0));
    }

    #[test]
    fn a_connection_after_a_stop_begins_the_finished_job_anew() {
        let mut job = PrintJob::new(1, Mm::ZERO, Mm::ZERO, Span::from_millis(100));
        let mut cell = VirtualRobot::new(RobotParams::default(), Stamp::START).unwrap();
        for connection in 0..3 {
            let from_s = 5.0 * f64::from(connection);
            cell.connect(secs(from_s));
            job.connected(cell.mode());
            cell.take(secs(from_s), PcLine::Hello);
            run(&mut job, &mut cell, from_s, from_s + 1.0);
            assert_eq!(cell.mode(), RobotMode::Print, "{connection}");
            cell.take(secs(from_s + 1.0), PcLine::Stop { seq: 1 });
        }
    }

    #[test]
    fn a_stop_is_acknowledged_by_the_next_connection_only() {
        let mut job = PrintJob::new(9, Mm::ZERO, Mm::ZERO, Span::from_millis(100));
        let mut cell = cell();
        cell.connect(secs(0.0));
        cell.take(secs(0.0), PcLine::Hello);
        cell.fail(secs(0.0));
        run(&mut job, &mut cell, 0.0, 2.0);
        assert_eq!(cell.mode(), RobotMode::Fault);
        cell.connect(secs(2.0));
        job.connected(cell.mode());
        cell.take(secs(2.0), PcLine::Hello);
        run(&mut job, &mut cell, 2.0, 2.15);
        assert_eq!(cell.mode(), RobotMode::Idle);
    }
}
