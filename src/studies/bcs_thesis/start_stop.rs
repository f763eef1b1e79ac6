//! Predicted starts and stops compared with the thesis' fixed dwell times.

pub mod bench;
pub mod dwell;
pub mod experiment;

#[cfg(test)]
mod tests;
