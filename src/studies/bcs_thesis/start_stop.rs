//! Starts and stops beside fixed dwell times, as the thesis has them.

pub mod bench;
pub mod dwell;
pub mod experiment;

#[cfg(test)]
mod tests;
