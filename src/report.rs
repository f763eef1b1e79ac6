//! Results for people: pages, plots, overlays, boards to print.

pub mod calibration;
pub mod chart;
pub mod compare;
pub mod html;
pub mod identify;
pub mod image;
pub mod offset;
pub mod overlays;
pub mod picker;
pub mod planned;
pub mod run;
pub mod sheet;
#[cfg(test)]
pub(crate) mod synthetic;
pub mod tuned;
