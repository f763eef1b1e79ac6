//! Predicted starts and stops beside the thesis' fixed dwell times.

pub mod bench;
pub mod dwell;
pub mod experiment;

#[cfg(test)]
mod tests;
