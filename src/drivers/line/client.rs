//! The PC's end of a TCP connection that reconnects after a loss.

use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, bounded};

use super::connection;
use super::dialect::{Dialect, EventOf};
use super::outgoing::{Open, Outgoing};
use super::timing::LinkTiming;
use super::written::Written;
use crate::drivers::StartError;
use crate::io::clock::RunClock;
use crate::run::ports::SendError;

/// Longest wait for the connection's thread when closing. Only a name server or a host that does
/// not answer takes that long.
const LONGEST_JOIN: Duration = Duration::from_secs(2);

/// The PC's end of a TCP connection that reconnects after a loss.
#[derive(Debug)]
pub struct Client<D: Dialect> {
    outgoing: Arc<Outgoing<D>>,
    thread: Option<Running>,
}

#[derive(Debug)]
struct Running {
    handle: JoinHandle<()>,
    /// Dropped to end the wait before the next attempt to connect.
    quit: Sender<()>,
    /// Closed by the thread when it ends.
    ended: Receiver<()>,
}

impl<D: Dialect> Client<D> {
    /// Starts to connect to `address`, `host:port`. `report` is called in the link's thread with
    /// each report of the other side; if it returns false, the thread ends. Fails if the system
    /// gives no thread.
    pub fn start(
        address: String,
        timing: LinkTiming,
        clock: RunClock,
        report: impl Fn(EventOf<D>) -> bool + Send + 'static,
    ) -> Result<Self, StartError> {
        let outgoing = Arc::new(Outgoing::new(address, timing, clock));
        let (quit, quitting) = bounded(0);
        let (ending, ended) = bounded::<()>(0);
        let shared = Arc::clone(&outgoing);
        let body = move || {
            connection::keep_up(&shared, &report, &quitting);
            drop(ending);
        };
        let handle = std::thread::Builder::new()
            .name(format!("{}-link", D::NAME))
            .spawn(body)
            .map_err(|error| StartError::Thread { device: D::NAME, reason: error.to_string() })?;
        Ok(Self { outgoing, thread: Some(Running { handle, quit, ended }) })
    }

    /// Writes the line that `line` makes from the state of the current connection, and numbers it.
    /// Blocks for [`LinkTiming::write`] at most; a write that takes longer closes the connection.
    pub fn send(
        &self,
        line: impl FnOnce(&Open<D>) -> Result<String, SendError>,
    ) -> Result<Written, SendError> {
        self.outgoing.send(line)
    }

    /// Sends `BYE` and ends the thread. The last command stays valid at the device until it
    /// expires.
    pub fn close(&mut self) {
        let Some(Running { handle, quit, ended }) = self.thread.take() else { return };
        self.outgoing.close();
        drop(quit);
        // No message is ever sent on it: the wait times out or the channel is closed.
        if ended.recv_timeout(LONGEST_JOIN) == Err(RecvTimeoutError::Timeout) {
            tracing::warn!("the {} link is still trying to connect; left to itself", D::NAME);
        } else if handle.join().is_err() {
            tracing::error!("the thread of the {} link had failed", D::NAME);
        }
    }
}

impl<D: Dialect> Drop for Client<D> {
    fn drop(&mut self) {
        self.close();
    }
}
