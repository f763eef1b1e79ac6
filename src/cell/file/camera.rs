//! `[camera]`: where frames come from, and how the camera is mounted.

use std::path::{Path, PathBuf};

use crate::core::{Mm, Span};
use crate::document::Table;

/// Where frames come from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ImageSource {
    /// A folder of images, a video file or an MCAP.
    Path(PathBuf),
    /// A live camera by its index.
    Index(i32),
    /// A `GStreamer` pipeline.
    Pipeline(String),
    /// A network camera's snapshot address.
    Url(String),
    /// The simulated bead.
    Rendered,
}

impl ImageSource {
    /// The source that a name means; paths are relative to a folder. `None` for a camera
    /// without a whole number.
    pub fn parse(name: &str, folder: &Path) -> Option<Self> {
        if name == "rendered" {
            Some(Self::Rendered)
        } else if let Some(index) = name.strip_prefix("camera:") {
            index.trim().parse().ok().filter(|index| *index >= 0).map(Self::Index)
        } else if let Some(pipeline) = name.strip_prefix("gst:") {
            Some(Self::Pipeline(pipeline.trim().to_string()))
        } else if name.starts_with("http://") || name.starts_with("https://") {
            Some(Self::Url(name.to_string()))
        } else {
            Some(Self::Path(folder.join(name)))
        }
    }
}

/// How a camera is mounted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mount {
    /// On the flange: it moves with the nozzle and rises with the layers.
    Flange,
    /// At a fixed position.
    Fixed,
}

/// The camera of a cell.
#[derive(Debug, Clone, PartialEq)]
pub struct CameraSettings {
    /// Where frames come from.
    pub source: ImageSource,
    /// The source as the file names it.
    pub source_name: String,
    /// Frames a second.
    pub rate_hz: f64,
    /// How it is mounted.
    pub mount: Mount,
    /// Path length from the nozzle back to the middle of the gauge.
    pub offset: Mm,
    /// Standard deviation of that distance.
    pub offset_sigma: Mm,
    /// How much later than its capture a frame has its time stamp: of a camera whose frames carry
    /// no time of capture.
    pub latency: Span,
    /// Longest wait for a frame before the camera counts as lost.
    pub deadline: Span,
}

/// Standard deviation of the offset where the file has none, as a fraction of the offset.
const OFFSET_SIGMA_FRACTION: f64 = 0.1;

pub(super) fn read_mount(table: &Table<'_>) -> Option<Mount> {
    table.required_choice("mount", &[("flange", Mount::Flange), ("fixed", Mount::Fixed)])
}

pub(super) fn read_camera(
    table: &Table<'_>,
    folder: &Path,
    mount: Option<Mount>,
    rate_hz: Option<f64>,
) -> Option<CameraSettings> {
    let name = table.text("source");
    let source = name.and_then(|name| {
        let source = ImageSource::parse(name, folder);
        if source.is_none() {
            table.report("source", format!("\"{name}\""), "camera: and a whole number");
        }
        source
    });
    let offset = table.number("offset_mm", 0.0..=1e5);
    let sigma = table.optional_number("offset_sigma_mm", 0.0..=1e4);
    let latency_ms = table.number_or("latency_ms", 0.0..=2000.0, 0.0);
    let deadline = table.number_or("deadline_s", 0.05..=600.0, 2.0);
    Some(CameraSettings {
        source: source?,
        source_name: name?.to_string(),
        rate_hz: rate_hz?,
        mount: mount?,
        offset: Mm::new(offset?).ok()?,
        offset_sigma: Mm::new(sigma.unwrap_or(OFFSET_SIGMA_FRACTION * offset?)).ok()?,
        latency: Span::from_secs(latency_ms? / 1e3),
        deadline: Span::from_secs(deadline?),
    })
}
