//! What leaves the PC: numbered, checked, and written by the caller's thread.

use std::io::{ErrorKind, Write};
use std::net::{Shutdown, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::{LinkConfig, NotSent, Sent, Written};
use crate::control::{Command, RobotLimits, RobotMode, RobotState};
use crate::io::clock::RunClock;
use crate::link::{PcLine, on_wire};
use crate::units::MmPerS;

/// The writing half of the link, shared with the thread that reads.
#[derive(Debug)]
pub(super) struct Outgoing {
    pub(super) config: LinkConfig,
    pub(super) clock: RunClock,
    closing: AtomicBool,
    state: Mutex<State>,
}

#[derive(Debug, Default)]
struct State {
    open: Option<Open>,
    /// Why writing ended the connection.
    broken: Option<NotSent>,
}

/// A connection on which the robot has answered `HELLO`.
#[derive(Debug)]
struct Open {
    stream: TcpStream,
    robot: RobotLimits,
    next_seq: u64,
    newest: Option<RobotState>,
}

impl Outgoing {
    pub(super) fn new(config: LinkConfig, clock: RunClock) -> Self {
        Self { config, clock, closing: AtomicBool::new(false), state: Mutex::default() }
    }

    /// Whether the link is being closed in order.
    pub(super) fn closing(&self) -> bool {
        self.closing.load(Ordering::Acquire)
    }

    pub(super) fn connected(&self) -> bool {
        self.lock().open.is_some()
    }

    /// Setpoints may be written to this connection from now on, counted from 1.
    pub(super) fn opened(&self, stream: TcpStream, robot: RobotLimits) {
        let open = Some(Open { stream, robot, next_seq: 1, newest: None });
        *self.lock() = State { open, broken: None };
    }

    /// The newest `STATE`.
    pub(super) fn seen(&self, state: RobotState) {
        if let Some(open) = self.lock().open.as_mut() {
            open.newest = Some(state);
        }
    }

    /// The connection is of no use any more; says why, where it was writing
    /// that failed.
    pub(super) fn lost(&self) -> Option<NotSent> {
        std::mem::take(&mut *self.lock()).broken
    }

    /// Says `BYE` and makes the reading thread wake up.
    pub(super) fn close(&self) {
        self.closing.store(true, Ordering::Release);
        if let Some(mut open) = self.lock().open.take() {
            if let Err(error) = open.write(PcLine::Bye) {
                tracing::debug!(%error, "BYE could not be written");
            }
            open.shut();
        }
    }

    pub(super) fn send(&self, command: Command) -> Sent {
        let mut guard = self.lock();
        let open = guard.open.as_mut().ok_or(NotSent::NotConnected)?;
        let seq = open.next_seq;
        let line = match command {
            Command::Stop => PcLine::Stop { seq },
            Command::Speed(speed) => open.setpoint(&self.config, speed)?,
        };
        match open.write(line) {
            Ok(()) => {
                open.next_seq += 1;
                Ok(Written { seq, at: self.clock.now() })
            }
            Err(error) => {
                open.shut();
                let failed = NotSent::Write { reason: reason(&error) };
                *guard = State { open: None, broken: Some(failed.clone()) };
                Err(failed)
            }
        }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Open {
    fn setpoint(&self, config: &LinkConfig, speed: MmPerS) -> Result<PcLine, NotSent> {
        let state = self.newest.ok_or(NotSent::NoState)?;
        if !matches!(state.mode, RobotMode::Print | RobotMode::Hold) {
            return Err(NotSent::NotPrinting { mode: state.mode });
        }
        let speed = on_wire(speed);
        let min = config.min.max(self.robot.min_mm_per_s);
        let max = config.max.min(self.robot.max_mm_per_s);
        if speed < min || speed > max {
            return Err(NotSent::OutsideLimits { speed, min, max });
        }
        let (seq, valid_ms) = (self.next_seq, config.valid_ms);
        Ok(PcLine::Speed { seq, speed, valid_ms, ref_t_ms: state.t_ms })
    }

    fn write(&mut self, line: PcLine) -> std::io::Result<()> {
        write_line(&mut self.stream, line)
    }

    fn shut(&self) {
        // A connection that is gone already cannot be shut; that is as good.
        let _ = self.stream.shutdown(Shutdown::Both);
    }
}

/// Writes a line whole, in one go: half a line would be worse than none.
pub(super) fn write_line(stream: &mut TcpStream, line: PcLine) -> std::io::Result<()> {
    let text = line.format();
    let written = stream.write(text.as_bytes())?;
    if written < text.len() {
        return Err(ErrorKind::TimedOut.into());
    }
    Ok(())
}

fn reason(error: &std::io::Error) -> String {
    match error.kind() {
        ErrorKind::WouldBlock | ErrorKind::TimedOut => {
            "the robot does not take any bytes".to_owned()
        }
        _ => error.to_string(),
    }
}
