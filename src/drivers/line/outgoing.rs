//! Lines to the device: numbered and written by the caller's thread.

use std::io::{ErrorKind, Write};
use std::net::{Shutdown, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::dialect::Dialect;
use super::timing::LinkTiming;
use super::written::Written;
use crate::io::clock::RunClock;
use crate::link::PcLine;
use crate::run::ports::SendError;

/// The writing half of the link, shared with the reading thread.
#[derive(Debug)]
pub(super) struct Outgoing<D: Dialect> {
    pub(super) address: String,
    pub(super) timing: LinkTiming,
    pub(super) clock: RunClock,
    closing: AtomicBool,
    state: Mutex<State<D>>,
}

#[derive(Debug)]
struct State<D: Dialect> {
    open: Option<Open<D>>,
    /// Why a write ended the connection; `None` if none did.
    broken: Option<String>,
}

/// A connection on which the other side has answered `HELLO`.
#[derive(Debug)]
pub struct Open<D: Dialect> {
    /// Fields of the other side's `HELLO`.
    pub hello: D::Hello,
    /// Number of the next line.
    pub next_seq: u64,
    /// Its newest `STATE`; `None` before the first one.
    pub newest: Option<D::State>,
    stream: TcpStream,
}

impl<D: Dialect> Outgoing<D> {
    pub(super) const fn new(address: String, timing: LinkTiming, clock: RunClock) -> Self {
        let state = Mutex::new(State { open: None, broken: None });
        Self { address, timing, clock, closing: AtomicBool::new(false), state }
    }

    /// Whether the link is being closed.
    pub(super) fn closing(&self) -> bool {
        self.closing.load(Ordering::Acquire)
    }

    /// Lines may be written to this connection from now on, numbered from 1.
    pub(super) fn opened(&self, stream: TcpStream, hello: D::Hello) {
        let open = Some(Open { stream, hello, next_seq: 1, newest: None });
        *self.lock() = State { open, broken: None };
    }

    /// Stores the newest `STATE`.
    pub(super) fn seen(&self, state: D::State) {
        if let Some(open) = self.lock().open.as_mut() {
            open.newest = Some(state);
        }
    }

    /// The connection is lost. Returns the reason if a failed write was the cause.
    pub(super) fn lost(&self) -> Option<String> {
        let state = std::mem::replace(&mut *self.lock(), State { open: None, broken: None });
        state.broken
    }

    /// Sends `BYE` and wakes the reading thread.
    pub(super) fn close(&self) {
        self.closing.store(true, Ordering::Release);
        if let Some(mut open) = self.lock().open.take() {
            if let Err(error) = write_line(&mut open.stream, &PcLine::Bye.format()) {
                tracing::debug!(%error, "BYE could not be written");
            }
            open.shut();
        }
    }

    pub(super) fn send(
        &self,
        line: impl FnOnce(&Open<D>) -> Result<String, SendError>,
    ) -> Result<Written, SendError> {
        let mut guard = self.lock();
        let open = guard.open.as_mut().ok_or(SendError::NotConnected { device: D::NAME })?;
        let line = line(open)?;
        match write_line(&mut open.stream, &line) {
            Ok(()) => {
                let seq = open.next_seq;
                open.next_seq += 1;
                Ok(Written { seq, at: self.clock.now() })
            }
            Err(error) => {
                open.shut();
                let reason = reason::<D>(&error);
                let broken = Some(format!("writing to the {} failed: {reason}", D::NAME));
                *guard = State { open: None, broken };
                Err(SendError::Write { device: D::NAME, reason })
            }
        }
    }

    fn lock(&self) -> MutexGuard<'_, State<D>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<D: Dialect> Open<D> {
    fn shut(&self) {
        // Shutting down a connection that is already gone fails, which does no harm.
        let _ = self.stream.shutdown(Shutdown::Both);
    }
}

/// Writes a whole line in one call; fails if only a part was written.
pub(super) fn write_line(stream: &mut TcpStream, line: &str) -> std::io::Result<()> {
    let written = stream.write(line.as_bytes())?;
    if written < line.len() {
        return Err(ErrorKind::TimedOut.into());
    }
    Ok(())
}

fn reason<D: Dialect>(error: &std::io::Error) -> String {
    match error.kind() {
        ErrorKind::WouldBlock | ErrorKind::TimedOut => {
            format!("the {} does not take any bytes", D::NAME)
        }
        _ => error.to_string(),
    }
}
