//! The extruder link: the PC's client and the simulated extruder over real
//! sockets, and the program as an operator runs it.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a test may fail and look at the clock"
)]

mod client;
mod run;
