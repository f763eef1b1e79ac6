//! The result of a calibration: camera, bed plane, and their uncertainty.

use anyhow::Context;

use super::arguments::CalibrateArgs;
use super::images::CalibrationImages;
use super::{plane, report};
use crate::calibration::board::Board;
use crate::calibration::board_observation::BoardObservation;
use crate::calibration::covariance::CalibrationCovariance;
use crate::calibration::next_view::{self, NextView};
use crate::calibration::solve::{self, Solution};
use crate::calibration::width_map::{self, WidthMap};
use crate::calibration::{Calibration, CalibrationQuality, file, relative_sigma, warnings};
use crate::cli::bed_plane::BedPlane;
use crate::core::{GridSize, Mm};
use crate::io::atomic_file::write_atomic;
use crate::report::calibration::CalibrationPage;

/// A calibrated camera with its uncertainty.
pub struct CalibrationResult<'a> {
    args: &'a CalibrateArgs,
    board: &'a Board,
    images: &'a CalibrationImages,
    /// The camera with its residuals.
    pub solution: Solution,
    plane: BedPlane,
    covariance: Option<CalibrationCovariance>,
    maps: Vec<WidthMap>,
    /// The additional image that would reduce the uncertainty most.
    pub next: Option<NextView>,
}

impl<'a> CalibrationResult<'a> {
    /// Fails if no camera or no bed plane can be computed, or if the camera does not look down on
    /// the measured surface.
    pub fn of(
        args: &'a CalibrateArgs,
        board: &'a Board,
        images: &'a CalibrationImages,
    ) -> anyhow::Result<Self> {
        let all = images.found.iter();
        let seen: Vec<BoardObservation> = all.filter_map(|(_, board)| board.clone().ok()).collect();
        let solution = solve::solve(board, &seen)?;
        let plane = plane::find(args, board, &solution, images)?;
        // If the focal length is not determined, the corners' noise is not the largest error.
        let covariance = warnings::settles_camera(&solution)
            .then(|| CalibrationCovariance::of(board, &solution, &plane.on_bed, plane.thickness))
            .flatten();
        let (maps, next) = (Vec::new(), None);
        let mut result = Self { args, board, images, solution, plane, covariance, maps, next };
        result.find_width_sigma()?;
        Ok(result)
    }

    /// Computes the standard deviation of the bead's width at each height.
    fn find_width_sigma(&mut self) -> anyhow::Result<()> {
        let Some(known) = &self.covariance else { return Ok(()) };
        let camera_mm = known.camera_height_mm();
        let given = self.args.surface_height_mm.as_slice();
        if let Some(height) = given.iter().find(|height| height.get() >= camera_mm) {
            anyhow::bail!(
                "--surface-height-mm: found {height}, but the camera is only {camera_mm:.1} mm above \
                 the bed"
            );
        }
        let usual = [Mm::ZERO, Mm::new((camera_mm / 20.0).round()).unwrap_or(Mm::ZERO)];
        let heights = if given.is_empty() { &usual[..] } else { given };
        let Some(bead) =
            self.args.bead_mm.map(Mm::get).or_else(|| width_map::typical_bead_mm(known))
        else {
            return Ok(());
        };
        self.maps = heights.iter().map(|&height| WidthMap::of(known, bead, height)).collect();
        self.next = next_view::best(self.board, &self.solution, known, bead, heights);
        Ok(())
    }

    /// The largest standard deviation of the bead's width in the area where boards were seen, over
    /// all heights \[mm\]; `None` if it cannot be determined.
    pub fn worst_mm(&self) -> Option<f64> {
        width_map::worst_mm(&self.maps)
    }

    /// Whether the standard deviation of a width exceeds its limit.
    pub fn fails(&self) -> bool {
        let limit = self.args.max_width_sigma_mm;
        limit.is_some_and(|limit| self.worst_mm().is_none_or(|worst| worst > limit.get()))
    }

    /// Relative standard deviation of a width in the area where boards were seen: of the given or
    /// a typical bead, at the worst height.
    fn width_sigma_fraction(&self) -> Option<f64> {
        let bead = self.maps.first().map(|map| map.bead_mm);
        let given = self.worst_mm().zip(bead).map(|(worst, bead)| worst / bead);
        given.or_else(|| relative_sigma::where_seen(self.covariance.as_ref()?))
    }

    /// The result as text, without the list of images.
    pub fn text(&self, calibration: &Calibration) -> String {
        let covariance = self.covariance.as_ref();
        [
            report::lens(&self.solution),
            report::camera(&self.solution),
            self.plane.text(),
            report::width(calibration, covariance, &self.maps),
            report::maps(&self.maps, self.args.max_width_sigma_mm),
            report::next_view(covariance, self.next.as_ref()),
            report::scale(calibration, covariance, self.plane.thickness),
            report::warnings(&self.solution),
        ]
        .concat()
    }

    /// The report; it reloads itself every `reload_s` seconds, or not at all for `None`.
    pub fn page(&self, text: &str, reload_s: Option<u32>) -> String {
        CalibrationPage {
            board: self.board,
            images: &self.images.found,
            solution: &self.solution,
            maps: &self.maps,
            limit_mm: self.args.max_width_sigma_mm.map(Mm::get),
            next: self.next.as_ref(),
            text,
            calibration_file: &self.args.out.display().to_string(),
            reload_s,
        }
        .page()
    }

    /// Writes the file after a check that it can be read back.
    pub fn write(&self) -> anyhow::Result<Calibration> {
        let text = self.file();
        let calibration = self.read_back(&text)?;
        write_atomic(&self.args.out, text.as_bytes())?;
        Ok(calibration)
    }

    /// The calibration as it is read from the file.
    pub fn calibration(&self) -> anyhow::Result<Calibration> {
        self.read_back(&self.file())
    }

    fn read_back(&self, text: &str) -> anyhow::Result<Calibration> {
        file::parse(&self.args.out.display().to_string(), text)
            .context("the solution is not a camera that can measure; nothing was written")
    }

    /// The text of the calibration file.
    fn file(&self) -> String {
        let (solution, plane) = (&self.solution, &self.plane);
        let GridSize { columns, rows } = self.board.corners();
        let kind = if self.board.is_plain() { "board" } else { "ChArUco board" };
        let note = format!(
            "From {} images of a {kind} with {columns}x{rows} inner corners and squares of {}.\n\
             Bed plane: {} below the board's face in {}.",
            solution.views.len(),
            self.board.square(),
            plane.thickness,
            plane.images.join(", "),
        );
        let bed = plane.on_bed.bed(plane.thickness);
        let covariance = self.covariance.as_ref();
        let quality = CalibrationQuality {
            reprojection_rms_px: solution.rms_px,
            width_relative_sigma: self.width_sigma_fraction(),
            seen_px: covariance.map(|covariance| {
                let [from, to] = covariance.seen_px();
                [from.x, from.y, to.x, to.y].map(|px| (px * 10.0).round() / 10.0)
            }),
            heights_mm: covariance.and_then(|_| solution.heights_mm(self.board, &bed)),
            uncertainty: covariance.map(CalibrationCovariance::uncertainty),
        };
        let camera = solution.camera();
        file::to_toml(camera, &bed, solution.image_size_px, plane.robot_z, Some(quality), &[note])
    }
}
