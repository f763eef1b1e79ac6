//! The robot link over real TCP on this machine: the PC's client against the
//! simulated robot, and each against an other side that misbehaves.

mod client;
mod robot;
mod support;
