//! The other end of a TCP connection that is kept up.

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

/// Longest wait for the connection's thread when closing. Only a name server
/// or a host that does not answer takes that long.
const LONGEST_JOIN: Duration = Duration::from_secs(2);

/// The other end of a TCP connection that is kept up.
#[derive(Debug)]
pub struct Client<D: Dialect> {
    outgoing: Arc<Outgoing<D>>,
    thread: Option<Running>,
}

#[derive(Debug)]
struct Running {
    handle: JoinHandle<()>,
    /// Dropped to end the wait between two connections.
    quit: Sender<()>,
    /// Closed by the thread when it ends.
    ended: Receiver<()>,
}

impl<D: Dialect> Client<D> {
    /// Starts to connect to `address`, `host:port`. `report` is called in the link's
    /// thread with what the other side reports; where it returns false, nobody listens
    /// any more and the thread ends. Fails where the system gives no thread.
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

    /// Writes the line that `line` makes of what is known of the present
    /// connection, and counts it. Blocks for [`LinkTiming::write`] at most; a
    /// write that takes longer closes the connection.
    pub fn send(
        &self,
        line: impl FnOnce(&Open<D>) -> Result<String, SendError>,
    ) -> Result<Written, SendError> {
        self.outgoing.send(line)
    }

    /// Says `BYE` and ends the thread. What was commanded last runs out.
    pub fn close(&mut self) {
        let Some(Running { handle, quit, ended }) = self.thread.take() else { return };
        self.outgoing.close();
        drop(quit);
        // Nothing is ever sent on it: it either times out or is closed.
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
