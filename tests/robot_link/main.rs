//! The robot link over real TCP on this machine: the PC's client against the
//! simulated robot, and each against an other side that misbehaves.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test may fail")]

#[cfg(test)]
mod client;
#[cfg(test)]
mod command;
#[cfg(test)]
mod robot;
#[cfg(test)]
mod support;
