//! The PC's side of a line link over TCP, for a robot or an extruder.
//!
//! A thread owns the connection: it connects, sends `HELLO`, reads, and reports the other side's
//! lines. The caller's own thread writes lines ([`Client::send`]), so that there is no queue
//! between a decision and the socket.

mod address;
mod client;
mod connection;
mod dialect;
mod incoming;
mod outgoing;
mod timing;
mod written;

pub use address::read_address;
pub use client::Client;
pub use dialect::{Dialect, EventOf, Heard, LinkEvent};
pub use outgoing::Open;
pub use timing::LinkTiming;
pub use written::Written;
