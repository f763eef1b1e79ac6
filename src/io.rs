//! Files, recordings, the clock and signals.

pub mod atomic_file;
pub mod bead_columns;
pub mod calibration_file;
pub mod clock;
pub mod foxglove;
pub mod image_file;
pub mod model_file;
pub mod progress;
pub mod recorder;
pub mod recording;
pub mod replay;
pub mod stop;
