//! `driver = "log"`: no robot. Every command is written to a table, and the reports are those of a
//! robot that prints without end and follows each setpoint immediately. It shows what a cell would
//! send, and is the shortest robot driver.

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

use crossbeam_channel::{RecvTimeoutError, Sender, unbounded};

use super::{Capabilities, RobotDriver, RobotRegistration, RobotStart};
use crate::control::Command;
use crate::core::{Mm, MmPerS, RobotLimits, RobotMode, RobotState, Stamp};
use crate::document::Table;
use crate::drivers::StartError;
use crate::run::ports::{RobotEvent, RobotPort, SendError, Sent};

/// The registration of this driver.
pub const REGISTRATION: RobotRegistration = RobotRegistration {
    name: "log",
    capabilities: Capabilities {
        reports_limits: true,
        setpoints_expire: false,
        reports_path: true,
        reports_position: false,
        reports_heading: false,
        reads_speed_back: true,
        resolution: MmPerS::ZERO,
    },
    read,
};

/// Time between two reports.
const REPORT_PERIOD: Duration = Duration::from_millis(20);

/// A table instead of a robot.
#[derive(Debug)]
struct LogRobot {
    file: PathBuf,
}

fn read(table: &Table<'_>, folder: &Path) -> Option<Arc<dyn RobotDriver>> {
    Some(Arc::new(LogRobot { file: folder.join(table.text("file")?) }))
}

impl RobotDriver for LogRobot {
    fn address(&self) -> String {
        self.file.display().to_string()
    }

    fn start(&self, start: RobotStart) -> Result<Box<dyn RobotPort>, StartError> {
        let failed = |error: std::io::Error| StartError::File {
            file: self.file.clone(),
            reason: error.to_string(),
        };
        let mut table = File::create(&self.file).map_err(failed)?;
        writeln!(table, "time_s,command,speed_mm_per_s").map_err(failed)?;
        let (commands, taken) = unbounded();
        let clock = start.clock;
        let reports = move || {
            let mut robot = Follower::new(&start);
            while robot.report(&start) {
                match taken.recv_timeout(REPORT_PERIOD) {
                    Ok(command) => robot.take(start.clock.now(), command),
                    Err(RecvTimeoutError::Timeout) => {}
                    Err(RecvTimeoutError::Disconnected) => return,
                }
            }
        };
        let thread = Builder::new()
            .name("robot-log".to_owned())
            .spawn(reports)
            .map_err(|error| StartError::Thread { device: "robot", reason: error.to_string() })?;
        Ok(Box::new(LogPort { table, clock, follower: Some((commands, thread)) }))
    }
}

/// The table, and the thread that sends reports.
struct LogPort {
    table: File,
    clock: crate::io::clock::RunClock,
    follower: Option<(Sender<Command>, JoinHandle<()>)>,
}

impl RobotPort for LogPort {
    fn send(&mut self, now: Stamp, command: Command) -> Result<Sent, SendError> {
        let Some((follower, _)) = &self.follower else {
            return Err(SendError::NotConnected { device: "robot" });
        };
        let (word, speed) = match command {
            Command::Speed(speed) => ("speed", speed.get()),
            Command::Stop => ("stop", 0.0),
        };
        writeln!(self.table, "{:.6},{word},{speed}", now.secs())
            .map_err(|error| SendError::Write { device: "robot", reason: error.to_string() })?;
        follower.send(command).map_err(|_| SendError::NotConnected { device: "robot" })?;
        Ok(Sent { at: self.clock.now() })
    }

    fn close(&mut self) {
        let Some((commands, thread)) = self.follower.take() else { return };
        drop(commands);
        if thread.join().is_err() {
            tracing::error!("the thread that reports for the log had failed");
        }
    }
}

/// A robot that moves at the last commanded speed.
struct Follower {
    state: RobotState,
    at: Stamp,
}

impl Follower {
    fn new(start: &RobotStart) -> Self {
        let robot = RobotLimits {
            name: "log".to_owned(),
            min_mm_per_s: start.min,
            max_mm_per_s: start.max,
            hold_mm_per_s: start.start_speed,
        };
        let at = start.clock.now();
        // If the run has already ended, nobody needs the report.
        let _ = start.events.send(RobotEvent::Up { at, limits: robot });
        let state = RobotState {
            robot_time_ms: None,
            has_setpoint: false,
            mode: RobotMode::Print,
            speed_mm_per_s: start.start_speed,
            path_mm: Mm::ZERO,
            z_mm: Mm::ZERO,
        };
        Self { state, at }
    }

    fn advance(&mut self, now: Stamp) {
        self.state.path_mm = self.state.path_mm + self.state.speed_mm_per_s * (now - self.at);
        self.at = now;
    }

    fn take(&mut self, now: Stamp, command: Command) {
        self.advance(now);
        let (mode, speed) = match command {
            Command::Speed(speed) => (self.state.mode, speed),
            Command::Stop => (RobotMode::Stop, MmPerS::ZERO),
        };
        self.state = RobotState { mode, speed_mm_per_s: speed, has_setpoint: true, ..self.state };
    }

    /// Reports its state; returns false if the receiver is gone.
    fn report(&mut self, start: &RobotStart) -> bool {
        let now = start.clock.now();
        self.advance(now);
        start.events.send(RobotEvent::State { at: now, state: self.state }).is_ok()
    }
}
