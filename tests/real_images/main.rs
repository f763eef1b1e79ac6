//! What is measured in real images. They lie beside the project; where they are
//! missing the tests are skipped and print so.
//! `cargo test --release --test real_images -- --nocapture` prints the figures.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may fail")]

mod concrete_beads;
mod concrete_labels;
mod concrete_layers;
mod printed_lines;
mod statistics;
mod whole_image;

use std::path::{Path, PathBuf};

use truebead::calibration::SurfaceMap;
use truebead::core::{Channel, Frame, Stamp};
use truebead::drivers::camera::video::VideoFile;
use truebead::io::image_file;
use truebead::run::ports::{FrameSource, Grab};
use truebead::vision::{Gauge, Measurer, Reject, WidthMeasurement};

/// A file or folder of the real images, if it is there.
fn data(name: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data").join(name);
    if !path.exists() {
        println!("SKIPPED: there is nothing at {}", path.display());
        return None;
    }
    Some(path)
}

/// An image file's grey levels.
fn image(path: &Path) -> Frame {
    image_file::read(path, Channel::Grey, 0, Stamp::START).unwrap()
}

/// The frames of a clip.
fn clip(path: &Path) -> Vec<Frame> {
    let mut video = VideoFile::open(path, Channel::Grey, None).unwrap();
    let mut frames = Vec::new();
    while let Some(grab) = video.next_frame().unwrap() {
        match grab {
            Grab::Frame { frame, .. } => frames.push(frame),
            Grab::Unreadable { reason, .. } | Grab::Waiting { reason } => panic!("{reason}"),
        }
    }
    frames
}

/// Measures one image as if it were the first of its camera: one millimetre to
/// the pixel.
fn measure(gauge: Gauge, frame: &Frame) -> Result<WidthMeasurement, Reject> {
    Measurer::new(gauge, None).measure(frame, &SurfaceMap::from_scale(1.0))
}
