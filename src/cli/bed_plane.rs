//! The bed plane from images of boards that lie on the bed.

use std::fmt::Write as _;
use std::path::Path;

use anyhow::{Context, bail};
use nalgebra::{Point3, Vector3};

use super::board_image::{check_size, look_at};
use crate::calibration::board::{Board, Seen};
use crate::calibration::equations::{Corner, Model};
use crate::calibration::plane::OnBed;
use crate::calibration::sighting::is_same_place;
use crate::core::units::Mm;

/// The bed plane and where it comes from.
pub struct Plane {
    /// The images whose boards lay on the bed.
    pub images: Vec<String>,
    /// Whether nobody has named them.
    pub assumed: bool,
    /// Images that come later, and were refused though they show a board.
    pub passed_over: Vec<String>,
    /// The boards on the bed.
    pub on_bed: OnBed,
    /// Height of their printed faces above the bed.
    pub thickness: Mm,
    /// The robot's z when they were taken.
    pub robot_z: Mm,
}

impl Plane {
    /// Where the bed is, and what was assumed about it.
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
        line!(out, "\nbed plane");
        line!(out, "  image       {} ({how})", self.images.join(", "));
        line!(out, "  corners     {:.3} px off (RMS)", self.on_bed.rms_px);
        if !self.passed_over.is_empty() {
            line!(
                out,
                "  WARNING     {} after it cannot be used: if the board lay on the bed there, take",
                self.passed_over.join(", ")
            );
            line!(out, "              that picture again, or name another with --plane");
        }
        if self.images.len() > 1 {
            line!(
                out,
                "  boards      {} on one plane, to {:.2} mm",
                self.images.len(),
                self.on_bed.off_mm
            );
        }
        line!(
            out,
            "  board       its printed face lies {} above the bed (--board-thickness-mm)",
            self.thickness
        );
        line!(out, "  robot       z = {} when that image was taken (--robot-z-mm)", self.robot_z);
        line!(
            out,
            "  camera      {height:.1} mm above the bed, its view {tilt_deg:.1}° off straight down"
        );
        out
    }
}

/// Boards of one kind that are said to lie on the bed, each with its image.
pub struct Boards<'a> {
    board: &'a Board,
    seen: Vec<(String, Vec<Seen>)>,
}

impl<'a> Boards<'a> {
    /// None yet.
    pub fn of(board: &'a Board) -> Self {
        Self { board, seen: Vec::new() }
    }

    /// Fails for one that is where another is.
    pub fn add(&mut self, image: String, corners: Vec<Seen>) -> anyhow::Result<()> {
        let is_twin =
            |(_, other): &&(String, Vec<Seen>)| is_same_place(self.board, other, &corners);
        if let Some((twin, _)) = self.seen.iter().find(is_twin) {
            bail!(
                "--plane {image}: the board is where it is in {twin}, which says nothing new; leave \
                 one of them out, or move the board on the bed"
            );
        }
        self.seen.push((image, corners));
        Ok(())
    }

    /// One plane through all of them, with the images' names. Fails where corners are
    /// further off it than `most_px` (RMS); `other` says what they are held against.
    pub fn fit(
        self,
        model: &Model,
        most_px: f64,
        other: &str,
    ) -> anyhow::Result<(Vec<String>, OnBed)> {
        let placed = self.seen.into_iter().map(|(image, seen)| (image, self.board.place(&seen)));
        let (images, boards): (Vec<String>, Vec<Vec<Corner>>) = placed.unzip();
        let names = images.join(", ");
        let on_bed = OnBed::fit(model, boards)
            .with_context(|| format!("the corners in {names} fit no plane"))?;
        if on_bed.rms_px <= most_px {
            return Ok((images, on_bed));
        }
        if images.len() > 1 {
            bail!(
                "the boards in {names} do not lie on one plane: corners are {:.2} px off (RMS), the \
                 board that is furthest off by {:.1} mm; name pictures of boards that all lie flat on \
                 the bed",
                on_bed.rms_px,
                on_bed.off_mm
            );
        }
        bail!(
            "{names}: corners are {:.2} px off (RMS) where {other}; was it taken with the same camera, \
             focus and zoom?",
            on_bed.rms_px
        );
    }
}

/// The board's corners in an image that took no part in finding the camera, which must
/// be of the size \[px\] that the camera is for.
pub fn looked_for(
    path: &Path,
    board: &Board,
    image_size_px: [u32; 2],
) -> anyhow::Result<(String, Vec<Seen>)> {
    let name = path.display().to_string();
    let sighting = look_at(board, &name, path)
        .with_context(|| format!("--plane {name} does not show the bed plane"))?;
    check_size(&sighting, image_size_px)?;
    Ok((name, sighting.corners))
}
