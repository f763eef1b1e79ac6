//! Sources of frames, each behind [`crate::run::ports::FrameSource`].

pub mod folder;
pub mod live;
pub mod mcap;
pub mod open;
pub mod rendered;
pub mod snapshot;
pub mod video;

use crate::core::Stamp;
use crate::run::ports::SourceError;

/// Rate of an offline source without times \[Hz\]: frame `n` then counts as captured `n / 30` s
/// after the start. That keeps the order of the frames; their `time_s` stays unknown.
const RATE_WITHOUT_TIMES_HZ: f64 = 30.0;

fn fault(source_name: &str, what: impl Into<String>) -> SourceError {
    SourceError { source_name: source_name.to_owned(), what: what.into() }
}

#[expect(clippy::cast_precision_loss, reason = "no source gives 2^53 frames")]
fn seconds_at(seq: u64, rate_hz: f64) -> f64 {
    seq as f64 / rate_hz
}

/// Capture time of an offline frame: its time since the first frame's, otherwise its number at the
/// rate without times.
fn offline_stamp(seq: u64, time_s: Option<f64>, first_s: f64) -> Stamp {
    let seconds = time_s.map(|time| time - first_s);
    Stamp::from_secs(seconds.unwrap_or_else(|| seconds_at(seq, RATE_WITHOUT_TIMES_HZ)))
}

/// Rejects a frame rate that is not positive and finite.
fn check_rate(source_name: &str, rate_hz: Option<f64>) -> Result<(), SourceError> {
    match rate_hz {
        Some(rate) if !(rate.is_finite() && rate > 0.0) => {
            let what = format!("{rate} frames a second is no rate; give a number above 0");
            Err(fault(source_name, what))
        }
        _ => Ok(()),
    }
}
