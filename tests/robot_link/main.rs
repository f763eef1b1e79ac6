//! The robot link over real TCP on this machine: the PC's client against the
//! simulated robot, and each against an other side that misbehaves.

#[cfg(test)]
mod client;
#[cfg(test)]
mod command;
#[cfg(test)]
mod robot;
#[cfg(test)]
mod support;
