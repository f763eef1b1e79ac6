//! The experiments of the papers and the accuracy of the measurement.

pub mod accuracy;
pub mod barjuei2022;
pub mod bcs_thesis;
pub mod control;
pub mod diagne2015;
pub mod error;
pub mod looey2026;
pub mod ma2026;
mod plot;
pub mod publication;
pub mod reproduce;
pub mod study;
