//! The bed plane from images of boards that lie on the bed.

use std::fmt::Write as _;
use std::path::Path;

use anyhow::{Context, bail};
use nalgebra::{Point3, Vector3};

use super::board_image::{check_size, find_board};
use crate::calibration::board::{Board, CornerObservation};
use crate::calibration::board_observation::is_same_position;
use crate::calibration::equations::{CameraModel, Correspondence};
use crate::calibration::plane::OnBed;
use crate::core::Mm;

/// The bed plane and the images from which it was fitted.
pub struct BedPlane {
    /// The images of boards on the bed.
    pub images: Vec<String>,
    /// Whether these images are assumed, because none were named.
    pub assumed: bool,
    /// Later images that show a board but were rejected.
    pub passed_over: Vec<String>,
    /// The boards on the bed.
    pub on_bed: OnBed,
    /// Height of their printed faces above the bed.
    pub thickness: Mm,
    /// The robot's z when the images were taken.
    pub robot_z: Mm,
}

impl BedPlane {
    /// The bed plane and the assumptions about it, as text.
    pub fn text(&self) -> String {
        let mut out = String::new();
        let how = if self.assumed {
            "assumed: the last that shows the board; --plane names another"
        } else {
            "as named"
        };
        let bed = self.on_bed.bed(self.thickness);
        let height = bed.apply_inverse(Point3::origin()).z;
        let up = bed.rotation() * Vector3::z();
        let tilt_deg = (-up.z).clamp(-1.0, 1.0).acos().to_degrees();
        line!(out, "\nbed plane\n  image       {} ({how})", self.images.join(", "));
        line!(out, "  corners     {:.3} px off (RMS)", self.on_bed.rms_px);
        if !self.passed_over.is_empty() {
            let images = self.passed_over.join(", ");
            line!(
                out,
                "  WARNING     {images} after it cannot be used: if the board lay on the bed there, take\n              \
                 that image again, or name another with --plane"
            );
        }
        let count = self.images.len();
        if count > 1 {
            line!(out, "  boards      {count} on one plane, to {:.2} mm", self.on_bed.off_mm);
        }
        line!(
            out,
            "  board       its printed face lies {} above the bed (--board-thickness-mm)\n  \
             robot       z = {} when that image was taken (--robot-z-mm)\n  \
             camera      {height:.1} mm above the bed, its view {tilt_deg:.1}° off straight down",
            self.thickness,
            self.robot_z
        );
        out
    }
}

/// Boards of one kind on the bed, with the names of their images.
pub struct BoardsOnBed<'a> {
    board: &'a Board,
    corners: Vec<(String, Vec<CornerObservation>)>,
}

impl<'a> BoardsOnBed<'a> {
    /// A collection without boards.
    pub fn of(board: &'a Board) -> Self {
        Self { board, corners: Vec::new() }
    }

    /// Adds a board. Fails if it has the position of an earlier board.
    pub fn add(&mut self, image: String, corners: Vec<CornerObservation>) -> anyhow::Result<()> {
        let is_twin = |(_, other): &&(String, Vec<CornerObservation>)| {
            is_same_position(self.board, other, &corners)
        };
        if let Some((twin, _)) = self.corners.iter().find(is_twin) {
            bail!(
                "--plane {image}: the board is where it is in {twin}, which says nothing new; leave \
                 one of them out, or move the board on the bed"
            );
        }
        self.corners.push((image, corners));
        Ok(())
    }

    /// Fits one plane to all boards; returns it with the images' names. Fails if the corners'
    /// reprojection error exceeds `max_px` (RMS); `other` names the limit in the message.
    pub fn fit(
        self,
        model: &CameraModel,
        max_px: f64,
        other: &str,
    ) -> anyhow::Result<(Vec<String>, OnBed)> {
        let all = self.corners.into_iter();
        let (images, boards): (Vec<String>, Vec<Vec<Correspondence>>) =
            all.map(|(image, corners)| (image, self.board.correspondences(&corners))).unzip();
        let names = images.join(", ");
        let on_bed = OnBed::fit(model, boards)
            .with_context(|| format!("the corners in {names} fit no plane"))?;
        if on_bed.rms_px <= max_px {
            return Ok((images, on_bed));
        }
        let OnBed { rms_px, off_mm, .. } = on_bed;
        if images.len() > 1 {
            bail!(
                "the boards in {names} do not lie on one plane: corners are {rms_px:.2} px off (RMS), \
                 the board that is furthest off by {off_mm:.1} mm; name images of boards that all lie \
                 flat on the bed"
            );
        }
        bail!(
            "{names}: corners are {rms_px:.2} px off (RMS) where {other}; was it taken with the same \
             camera, focus and zoom?"
        );
    }
}

/// The board's corners in an image that was not used for the camera's calibration. Fails if the
/// size of the image \[px\] is not that of the calibration.
pub fn find_corners(
    path: &Path,
    board: &Board,
    image_size_px: [u32; 2],
) -> anyhow::Result<(String, Vec<CornerObservation>)> {
    let name = path.display().to_string();
    let found = find_board(board, &name, path)
        .with_context(|| format!("--plane {name} does not show the bed plane"))?;
    check_size(&found, image_size_px)?;
    Ok((name, found.corners))
}
