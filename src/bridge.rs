//! The only module that uses OpenCV. Its types do not leave this module.

mod board;
mod lines;
mod quads;
mod video;

pub use board::{find_any_board, find_board};
pub use lines::{EdgeSegment, EdgeSettings, LineFinder, canny_hough};
pub use quads::find_quads;
pub use video::{VideoInput, VideoReader};

use std::sync::Once;

use opencv::core::{LogLevel, Mat, MatTraitConst, set_log_level, set_num_threads};

use crate::core::{Frame, Pixels};

/// OpenCV failed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{task} failed in OpenCV: {what}")]
pub struct BridgeError {
    /// The failed task.
    pub task: &'static str,
    /// OpenCV's message.
    pub what: String,
}

/// Names the task in an error of OpenCV's.
fn during(task: &'static str) -> impl Fn(opencv::Error) -> BridgeError {
    move |error| BridgeError { task, what: error.message.trim().to_owned() }
}

/// Makes OpenCV work in the caller's thread, so that the time of a measurement does not depend
/// on other threads, and suppresses its output on standard error: errors are returned.
fn prepare() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        // A failure is harmless: OpenCV would use more threads or print more.
        let _ = set_num_threads(1);
        let _ = set_log_level(LogLevel::LOG_LEVEL_SILENT);
    });
}

/// The grey values with 8 bits as OpenCV's matrix. 16 bits are scaled from their minimum and
/// maximum, because cameras often use 10 or 12 of 16 bits.
fn grey8_mat(frame: &Frame) -> Result<Mat, BridgeError> {
    match frame.pixels() {
        Pixels::Grey8(values) => mat_of(frame, values),
        Pixels::Grey16(values) => {
            let (low, high) = range(values);
            let span = u32::from(high - low).max(1);
            let scaled: Vec<u8> = values
                .iter()
                .map(|&v| ((u32::from(v - low) * 255 + span / 2) / span).to_le_bytes()[0])
                .collect();
            mat_of(frame, &scaled)
        }
    }
}

fn range(values: &[u16]) -> (u16, u16) {
    values.iter().fold((u16::MAX, 0), |(low, high), &v| (low.min(v), high.max(v)))
}

fn mat_of<T: opencv::core::DataType>(frame: &Frame, values: &[T]) -> Result<Mat, BridgeError> {
    let task = "taking over a frame";
    let side = |px: usize| {
        i32::try_from(px)
            .map_err(|_| BridgeError { task, what: format!("a side of {px} px is too long") })
    };
    Mat::new_rows_cols_with_data(side(frame.height())?, side(frame.width())?, values)
        .and_then(|borrowed| borrowed.try_clone())
        .map_err(during(task))
}
