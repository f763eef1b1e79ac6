//! The PC's side of a line link over TCP, whoever is at the other end: a robot
//! or an extruder.
//!
//! A thread owns the connection and reads; it connects, says `HELLO`, and
//! reports what the other side says. Lines are written by the caller's own
//! thread ([`Client::send`]), so that no queue stands between a decision and
//! the socket.

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
