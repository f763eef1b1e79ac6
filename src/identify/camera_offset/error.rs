//! Why a bead does not determine the offset.

use super::estimate::SpeedRange;
use crate::core::Mm;

/// Smallest number of widths. A choice.
pub const MIN_WIDTHS: usize = 50;
/// Smallest number of gauge lengths of path, from which the noise can be distinguished from the
/// bead. A choice.
pub const MIN_PIECES: usize = 10;

/// Why a bead does not determine the offset.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum CameraOffsetError {
    /// No report has a position of the nozzle.
    #[error(
        "no robot state with a path that grew in PRINT or HOLD: the offset shows only while bead \
         is laid"
    )]
    NoPath,
    /// Too few widths.
    #[error(
        "{found} widths are of bead that was laid while the speed is known, and {MIN_WIDTHS} are needed: \
         record longer, or see why frames were refused (`truebead process`)"
    )]
    TooFew {
        /// Widths that could be used.
        found: usize,
    },
    /// Too little path.
    #[error(
        "the widths cover only {pieces} gauges side by side, of {:.1} mm each, and {MIN_PIECES} are \
         needed: record a longer bead", gauge.get()
    )]
    TooShort {
        /// Length of the gauge.
        gauge: Mm,
        /// How many gauges of path were measured.
        pieces: usize,
    },
    /// The speed hardly changed.
    #[error(
        "the speed changed by {:.1} % only ({:.1} to {:.1} mm/s), which shows in no width: run once \
         with steps of the target width, or of the speed, by 20 % or more",
        speeds.change_percent(), speeds.min.get(), speeds.max.get()
    )]
    ConstantSpeed {
        /// Slowest and fastest speed.
        speeds: SpeedRange,
    },
    /// The widths do not respond.
    #[error(
        "the speed changed by {:.1} % ({:.1} to {:.1} mm/s), but the widths do not follow it \
         clearly, at no offset up to {max_offset}: run once with larger or more abrupt steps of the \
         target width or of the speed",
        speeds.change_percent(), speeds.min.get(), speeds.max.get()
    )]
    NoResponse {
        /// Slowest and fastest speed.
        speeds: SpeedRange,
        /// Largest offset that was tried.
        max_offset: Mm,
    },
    /// The best offset is at an end of the search range.
    #[error(
        "the widths fit best at the end of what was tried, {at:.1} of 0 to {max_offset}: give more with \
         --max-mm if the camera is further away; otherwise the widths follow something else than \
         the speed",
        at = .at.get()
    )]
    AtEnd {
        /// The best that was tried.
        at: Mm,
        /// Largest offset that was tried.
        max_offset: Mm,
    },
    /// Two offsets are equally good.
    #[error(
        "{:.1} mm and {:.1} mm fit about as well, as with a speed that repeats itself: run once \
         with steps at uneven distances, or give a --max-mm between the two",
        first.get(), second.get()
    )]
    Ambiguous {
        /// The best.
        first: Mm,
        /// Another one.
        second: Mm,
    },
    /// The latency cannot be told from the offset.
    #[error(
        "latency and offset cannot be told apart: that needs frames at clearly different speeds, and a \
         gauge that is known; run once with larger steps of the speed, as with \
         `truebead tune CELL --step-fraction 0.2`"
    )]
    UncertainLatency,
    /// The standard error is as large as the offset.
    #[error(
        "{:.1} ± {:.1} mm is no answer: run once with larger or more abrupt steps of the target \
         width or of the speed",
        offset.get(), sigma.get()
    )]
    Uncertain {
        /// The best.
        offset: Mm,
        /// Its standard deviation.
        sigma: Mm,
    },
}
