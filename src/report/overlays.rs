//! `overlays/`: every frame with its gauge and edges drawn in, to check measurements by eye.

use std::fs;
use std::path::{Path, PathBuf};

use super::image::GaugeCutout;
use crate::core::Frame;
use crate::rows::output::{LogError, write_whole};
use crate::vision::{Edges, Gauge, WidthMeasurement};

/// Name of the folder within the output folder.
pub const FOLDER: &str = "overlays";

/// Writes one PNG per frame. Its name has the frame's number, the status and, if it was measured,
/// the width and its standard deviation.
#[derive(Debug)]
pub struct OverlayWriter {
    folder: PathBuf,
    gauge: Gauge,
}

impl OverlayWriter {
    /// Creates the folder in an existing output folder; fails if that is not possible.
    pub fn create(output: &Path, gauge: Gauge) -> Result<Self, LogError> {
        let folder = output.join(FOLDER);
        fs::create_dir_all(&folder)
            .map_err(|source| LogError::Folder { path: folder.clone(), source })?;
        Ok(Self { folder, gauge })
    }

    /// Writes a frame with its edges. A frame that cannot be drawn is left out.
    pub fn frame(
        &self,
        frame: &Frame,
        edges: Edges<'_>,
        outcome: Result<WidthMeasurement, &'static str>,
    ) -> Result<(), LogError> {
        let cutout = GaugeCutout::take(frame, &self.gauge, Some(edges), outcome);
        let Some(png) = cutout.png() else { return Ok(()) };
        write_whole(&self.folder, &name(frame.seq, outcome), &png).map(drop)
    }
}

/// File name, such as `000012_ok_42.131+-0.024mm.png` or `000013_unsure.png`.
fn name(frame: u64, outcome: Result<WidthMeasurement, &'static str>) -> String {
    match outcome {
        Ok(WidthMeasurement { width, sigma, .. }) => {
            format!("{frame:06}_ok_{:.3}+-{:.3}mm.png", width.get(), sigma.get())
        }
        Err(status) => format!("{frame:06}_{status}.png"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::{Pixels, Size, Stamp};
    use crate::report::synthetic;
    use crate::vision::Reject;

    #[test]
    fn every_frame_has_an_overlay_that_is_named_after_what_was_found() {
        let folder = tempfile::tempdir().unwrap();
        let writer = OverlayWriter::create(folder.path(), synthetic::gauge()).unwrap();
        let pixels = Pixels::Grey8(vec![40; 720 * 540]);
        let frame = Frame::new(7, Stamp::START, Size::new(720, 540), pixels).unwrap();
        let none = Edges { left: &[], right: &[] };
        writer.frame(&frame, none, Err(Reject::OffSurface.status())).unwrap();
        let file = folder.path().join("overlays/000007_off_surface.png");
        assert!(fs::read(file).unwrap().starts_with(b"\x89PNG"));
    }
}
