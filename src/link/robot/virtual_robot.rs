//! The robot's side of the link as a state machine. Time is an argument; the same machine serves
//! `sim robot`, the simulated cell and the tests.
//!
//! ```text
//!            begin_bead             setpoint runs out           1 s more
//!   IDLE ───────────────▶ PRINT ───────────────────────▶ HOLD ───────────▶ STOP
//!    ▲                     │  ▲────── valid SPEED ────────┘                  ▲
//!    │   end of the bead   │                                                │
//!    ├─────────────────────┘   STOP line, from PRINT or HOLD ───────────────┘
//!    └─────────────────────── acknowledge, from STOP or FAULT
//! ```
//!
//! The link says that a bead begins at the robot's start speed until the first setpoint, but not
//! what happens without any setpoint. Here the start of a bead counts as a setpoint at the start
//! speed, with the longest validity of a setpoint ([`MAX_VALID_MS`]). So a PC that is connected
//! but silent leads to `HOLD` and `STOP`, like one that falls silent later.

use super::motion::{PathMotion, SpeedLoop, seconds};
use super::params::{ParamError, RobotParams};
use super::robot_line::{RobotLine, RobotStatus};
use crate::core::{Mm, MmPerS, RobotLimits, RobotMode, Span, Stamp};
use crate::link::frame::{DeviceClock, ErrCode, MAX_VALID_MS, Sequence};

mod take;
#[cfg(test)]
mod tests;

/// Time in `HOLD` before it stops.
const HOLD_TO_STOP: Span = Span::from_millis(1000);
/// Validity of the start speed without a setpoint.
const START_VALID: Span = Span::from_millis(MAX_VALID_MS.cast_signed());

/// State of the robot, with the data of each state.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Phase {
    Idle,
    Print { target: MmPerS, until: Stamp },
    Hold { until: Stamp },
    Stop,
    Fault,
}

/// Misbehaviour of a robot, for tests and rehearsals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RobotFaults {
    /// Refuses every setpoint with this code.
    pub refuse: Option<ErrCode>,
    /// Sends no `STATE`.
    pub mute: bool,
    /// Moves at this fraction of its target speed; 1 for no fault.
    pub speed_ratio: f64,
}

impl Default for RobotFaults {
    fn default() -> Self {
        Self { refuse: None, mute: false, speed_ratio: 1.0 }
    }
}

/// A simulated robot on the link.
#[derive(Debug, Clone)]
pub struct VirtualRobot {
    params: RobotParams,
    at: Stamp,
    phase: Phase,
    motion: PathMotion,
    bead_end: Option<f64>,
    z: Mm,
    sequence: Sequence,
    faults: RobotFaults,
}

impl VirtualRobot {
    /// A robot in `IDLE` at `now`; fails if the parameters are not valid.
    pub fn new(params: RobotParams, now: Stamp) -> Result<Self, ParamError> {
        let params = params.checked()?;
        Ok(Self {
            at: now,
            phase: Phase::Idle,
            motion: PathMotion::default(),
            bead_end: None,
            z: params.z,
            sequence: Sequence::new(),
            faults: RobotFaults::default(),
            params,
        })
    }

    /// A new connection, which replaces an older one. Sequence numbers start again; the last
    /// setpoint stays valid.
    pub fn connect(&mut self, now: Stamp) {
        self.disconnect(now);
        self.sequence = Sequence::new();
    }

    /// The connection has ended. The last setpoint stays valid until it expires.
    pub fn disconnect(&mut self, now: Stamp) {
        self.advance(now);
        self.sequence.disconnect();
    }

    /// Whether a PC is connected and has sent `HELLO`.
    pub fn greeted(&self) -> bool {
        self.sequence.greeted()
    }

    /// Its current mode.
    pub fn mode(&self) -> RobotMode {
        match self.phase {
            Phase::Idle => RobotMode::Idle,
            Phase::Print { .. } => RobotMode::Print,
            Phase::Hold { .. } => RobotMode::Hold,
            Phase::Stop => RobotMode::Stop,
            Phase::Fault => RobotMode::Fault,
        }
    }

    /// The limits that it sends in its `HELLO`.
    pub fn limits(&self) -> RobotLimits {
        self.params.limits()
    }

    /// Begins a bead at a height, only from `IDLE`; returns whether it began.
    pub fn begin_bead(&mut self, now: Stamp, z: Mm) -> bool {
        self.advance(now);
        if self.phase != Phase::Idle {
            return false;
        }
        self.z = z;
        self.bead_end = self.params.bead.map(|length| self.motion.path + length.get());
        self.phase = Phase::Print { target: self.params.start, until: self.at + START_VALID };
        true
    }

    /// Leaves `STOP` or `FAULT` for `IDLE`, as an operator does at the robot.
    pub fn acknowledge(&mut self, now: Stamp) {
        self.advance(now);
        if matches!(self.phase, Phase::Stop | Phase::Fault) {
            self.phase = Phase::Idle;
        }
    }

    /// Stops the robot with a fault.
    pub fn fail(&mut self, now: Stamp) {
        self.advance(now);
        self.phase = Phase::Fault;
    }

    /// Sets faults that apply from now on.
    pub fn set_faults(&mut self, now: Stamp, faults: RobotFaults) {
        self.advance(now);
        self.faults = faults;
    }

    /// Advances to `now`; an earlier time changes nothing.
    pub fn advance(&mut self, now: Stamp) {
        while self.at < now || self.due() {
            let to = self.deadline().map_or(now, |deadline| deadline.min(now)).max(self.at);
            if self.move_until(to) {
                self.phase = Phase::Idle;
            } else if self.due() {
                self.phase = match self.phase {
                    Phase::Print { until, .. } => Phase::Hold { until: until + HOLD_TO_STOP },
                    _ => Phase::Stop,
                };
            }
        }
    }

    /// Its true state.
    pub fn state(&mut self, now: Stamp) -> RobotStatus {
        self.advance(now);
        let finite = |value: f64| if value.is_finite() { value } else { 0.0 };
        RobotStatus {
            t_ms: self.clock().ms(self.at),
            seq: self.sequence.applied(),
            mode: self.mode(),
            speed_mm_per_s: MmPerS::new(finite(self.motion.speed)).unwrap_or_default(),
            path_mm: Mm::new(finite(self.motion.path)).unwrap_or_default(),
            z_mm: self.z,
        }
    }

    /// The `STATE` to send; `None` while it is mute.
    pub fn report(&mut self, now: Stamp) -> Option<RobotLine> {
        let state = self.state(now);
        (!self.faults.mute).then_some(RobotLine::State(state))
    }

    /// Runs the motion to `to`, or to the end of the bead if that comes first; returns whether the
    /// bead ended.
    fn move_until(&mut self, to: Stamp) -> bool {
        let speed_loop = self.speed_loop();
        let within_ns = to.ns().saturating_sub(self.at.ns());
        let printing = matches!(self.phase, Phase::Print { .. } | Phase::Hold { .. });
        let end = self.bead_end.filter(|_| printing);
        let end_ns = end.and_then(|end| self.motion.ns_until(speed_loop, end, within_ns));
        let ns = end_ns.unwrap_or(within_ns);
        self.motion = self.motion.after(speed_loop, seconds(ns));
        self.at = Stamp::from_ns(self.at.ns().saturating_add(ns));
        end_ns.is_some()
    }

    fn speed_loop(&self) -> SpeedLoop {
        let target = match self.phase {
            Phase::Print { target, .. } => target.get(),
            Phase::Hold { .. } => self.params.hold.get(),
            Phase::Idle | Phase::Stop | Phase::Fault => 0.0,
        };
        let lag_s = 1.0 / (2.0 * std::f64::consts::PI * self.params.bandwidth_hz);
        SpeedLoop {
            target: target * self.faults.speed_ratio,
            lag_s,
            accel: self.params.accel.get(),
        }
    }

    fn deadline(&self) -> Option<Stamp> {
        match self.phase {
            Phase::Print { until, .. } | Phase::Hold { until } => Some(until),
            Phase::Idle | Phase::Stop | Phase::Fault => None,
        }
    }

    fn due(&self) -> bool {
        self.deadline().is_some_and(|deadline| deadline <= self.at)
    }

    fn clock(&self) -> DeviceClock {
        DeviceClock { device: "robot", start_ms: self.params.clock_start_ms }
    }
}
