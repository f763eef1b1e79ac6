//! `driver = "line"`: a robot that speaks the line link over TCP (`docs/src/reference/robot-link.md`).

use std::sync::Arc;

use super::{Capabilities, RobotDriver, RobotRegistration, RobotStart};
use crate::control::Command;
use crate::core::{MmPerS, RobotLimits, RobotMode, Stamp};
use crate::document::Table;
use crate::drivers::StartError;
use crate::drivers::line::{
    Client, Dialect, Heard, LinkEvent, LinkTiming, Open, Written, read_address,
};
use crate::io::clock::RunClock;
use crate::link::{LineError, MAX_VALID_MS, MIN_VALID_MS, PcLine, RobotLine, RobotStatus, on_wire};
use crate::run::ports::{RobotPort, SendError, Sent};

/// The registration of this driver.
pub const REGISTRATION: RobotRegistration = RobotRegistration {
    name: "line",
    capabilities: Capabilities {
        reports_limits: true,
        setpoints_expire: true,
        reports_path: true,
        reports_position: false,
        reports_heading: false,
        reads_speed_back: true,
        // A line has six decimals.
        resolution: MmPerS::constant(1e-6),
    },
    read: |table, _| read(table),
};

/// A robot at an address.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LineRobot {
    /// `host:port`.
    pub address: String,
}

fn read(table: &Table<'_>) -> Option<Arc<dyn RobotDriver>> {
    Some(Arc::new(LineRobot { address: read_address(table)? }))
}

impl RobotDriver for LineRobot {
    fn address(&self) -> String {
        self.address.clone()
    }

    fn start(&self, start: RobotStart) -> Result<Box<dyn RobotPort>, StartError> {
        let RobotStart { clock, min, max, valid_ms, events, .. } = start;
        let (address, timing) = (self.address.clone(), LinkTiming::default());
        let config = LinkConfig { address, min, max, valid_ms, timing };
        let report = move |event: RobotLineEvent| events.send(event.into()).is_ok();
        Ok(Box::new(LinkClient::start(config, clock, report)?))
    }
}

/// Address of a robot, and the setpoints that may be sent to it.
#[derive(Debug, Clone, PartialEq)]
pub struct LinkConfig {
    /// `host:port`.
    pub address: String,
    /// Slowest setpoint of the cell.
    pub min: MmPerS,
    /// Fastest setpoint of the cell.
    pub max: MmPerS,
    /// Time for which a setpoint is valid after the `STATE` that it refers to \[ms\], 100 to 1000.
    /// It should cover a few periods of the setpoints.
    pub valid_ms: u64,
    /// Timeouts and delays.
    pub timing: LinkTiming,
}

/// The robot's lines.
#[derive(Debug, Clone, Copy)]
pub struct RobotDialect;

impl Dialect for RobotDialect {
    type Hello = RobotLimits;
    type State = RobotStatus;
    const NAME: &'static str = "robot";

    fn understand(text: &str) -> Result<Heard<RobotLimits, RobotStatus>, LineError> {
        Ok(match RobotLine::parse(text)? {
            RobotLine::Hello(robot) => Heard::Hello(robot),
            RobotLine::State(state) => Heard::State(state),
            RobotLine::Err { seq, code, text } => Heard::Err { seq, code, text },
        })
    }
}

/// A report of the link to a robot, with the time of arrival.
pub type RobotLineEvent = LinkEvent<RobotLimits, RobotStatus>;

/// A robot at the other end of a TCP connection that reconnects after a loss.
#[derive(Debug)]
pub struct LinkClient {
    config: LinkConfig,
    client: Client<RobotDialect>,
}

impl LinkClient {
    /// Starts to connect. `report` is called in the link's thread with each report; if it returns
    /// false, the thread ends.
    pub fn start(
        config: LinkConfig,
        clock: RunClock,
        report: impl Fn(RobotLineEvent) -> bool + Send + 'static,
    ) -> Result<Self, StartError> {
        if !(MIN_VALID_MS..=MAX_VALID_MS).contains(&config.valid_ms) {
            return Err(StartError::Valid { found: config.valid_ms });
        }
        if config.min > config.max {
            return Err(StartError::Limits { min: config.min, max: config.max });
        }
        let client = Client::start(config.address.clone(), config.timing, clock, report)?;
        Ok(Self { config, client })
    }

    /// Writes a command. A speed is sent only if the newest `STATE` has the mode `PRINT` or
    /// `HOLD`, and only within the limits of cell and robot; a stop is sent in any mode. Blocks
    /// for [`LinkTiming::write`] at most; a write that takes longer closes the connection.
    pub fn send(&self, command: Command) -> Result<Written, SendError> {
        self.client.send(|open| {
            let line = match command {
                Command::Stop => PcLine::Stop { seq: open.next_seq },
                Command::Speed(speed) => self.config.setpoint(open, speed)?,
            };
            Ok(line.format())
        })
    }
}

impl LinkConfig {
    fn setpoint(&self, open: &Open<RobotDialect>, speed: MmPerS) -> Result<PcLine, SendError> {
        let state = open.newest.ok_or(SendError::NoState { device: RobotDialect::NAME })?;
        if !matches!(state.mode, RobotMode::Print | RobotMode::Hold) {
            return Err(SendError::NotPrinting { mode: state.mode });
        }
        let speed = on_wire(speed);
        let min = self.min.max(open.hello.min_mm_per_s);
        let max = self.max.min(open.hello.max_mm_per_s);
        if speed < min || speed > max {
            let [value, min, max] = [speed, min, max].map(MmPerS::get);
            return Err(SendError::OutsideLimits { value, unit: "mm/s", min, max });
        }
        let (seq, valid_ms) = (open.next_seq, self.valid_ms);
        Ok(PcLine::Speed { seq, speed, valid_ms, ref_t_ms: state.t_ms })
    }
}

impl RobotPort for LinkClient {
    fn send(&mut self, _now: Stamp, command: Command) -> Result<Sent, SendError> {
        LinkClient::send(self, command).map(|written| Sent { at: written.at })
    }

    fn close(&mut self) {
        self.client.close();
    }
}
