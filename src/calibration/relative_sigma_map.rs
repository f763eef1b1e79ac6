//! Relative standard deviation of a bead's width all over the image, from the calibration file.

use nalgebra::Vector2;

use super::width_map::Cells;
use super::{SurfaceMap, width_map};
use crate::core::{ImagePoint, Roi};
use crate::numeric::number::to_f64;

/// Relative standard deviations of the width of one bead in one direction.
#[derive(Debug, Clone, PartialEq)]
pub struct RelativeSigmaMap {
    /// Width of the bead \[mm\].
    pub bead_mm: f64,
    /// Size of the image \[px\].
    pub image_size_px: [u32; 2],
    /// Cells along the image and across it.
    pub counts: Cells,
    /// For a bead in the middle of each cell, row by row. `None` where the bead is not entirely
    /// in the image.
    pub cells: Vec<Option<f64>>,
}

/// A bead.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapBead {
    /// Its width \[mm\].
    pub width_mm: f64,
    /// Across it, in the image.
    pub across: Vector2<f64>,
}

impl RelativeSigmaMap {
    /// For a bead on a surface. `None` for a calibration without an image size or without a
    /// covariance.
    pub fn of(surface: &SurfaceMap, bead: &MapBead, counts: Cells) -> Option<Self> {
        let image_size_px = surface.image_size_px()?;
        surface.uncertainty()?;
        let cells = width_map::middles(image_size_px.map(f64::from), counts)
            .map(|middle| relative_sigma_at(surface, bead, middle))
            .collect();
        Some(Self { bead_mm: bead.width_mm, image_size_px, counts, cells })
    }

    /// The part of the image that a cell covers: first column and row, last column and row
    /// \[px\].
    pub fn cell_px(&self, cell: u32) -> [f64; 4] {
        let Cells { columns, rows } = self.counts;
        let [width, height] = self.image_size_px.map(f64::from);
        let edge = |at: u32, count: u32, side: f64| f64::from(at) / f64::from(count) * side - 0.5;
        let (column, row) = (cell % columns, cell / columns);
        let [left, right] = [column, column + 1].map(|at| edge(at, columns, width));
        let [top, bottom] = [row, row + 1].map(|at| edge(at, rows, height));
        [left, top, right, bottom]
    }

    /// Whether a gauge contains the middle of a cell, or the cell the middle of the gauge.
    pub fn is_in(&self, gauge: Roi, cell: u32) -> bool {
        let [left, top, right, bottom] = self.cell_px(cell);
        let from = Vector2::new(to_f64(gauge.x), to_f64(gauge.y)) - Vector2::repeat(0.5);
        let to = from + Vector2::new(to_f64(gauge.width), to_f64(gauge.height));
        let is_on = |at: f64, low: f64, high: f64| (low..high).contains(&at);
        let along = |low: f64, high: f64, from: f64, to: f64| {
            is_on(f64::midpoint(low, high), from, to) || is_on(f64::midpoint(from, to), low, high)
        };
        along(left, right, from.x, to.x) && along(top, bottom, from.y, to.y)
    }

    /// Smallest and largest of the cells; `None` without one.
    pub fn range(&self) -> Option<(f64, f64)> {
        let cells = || self.cells.iter().flatten().copied();
        Some((cells().reduce(f64::min)?, cells().reduce(f64::max)?))
    }
}

/// For a bead with its middle at a pixel. `None` where it is not entirely in the image.
pub fn relative_sigma_at(surface: &SurfaceMap, bead: &MapBead, middle: ImagePoint) -> Option<f64> {
    let ends = width_map::ends(surface, middle, bead.across, bead.width_mm)?;
    surface.width_relative_sigma_of(ends)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::covariance::CalibrationCovariance;
    use crate::calibration::plane::OnBed;
    use crate::calibration::synthetic::{self, SIZE, board, poses};
    use crate::calibration::{Calibration, CalibrationQuality, solve};
    use crate::core::Mm;

    /// A calibration from corners with a small error.
    fn surface() -> SurfaceMap {
        let mut turn = 0.0_f64;
        let mut off = || {
            turn += 2.4;
            0.1 * turn.sin()
        };
        let sightings: Vec<_> =
            poses().iter().map(|pose| synthetic::sighting("", pose, &mut off)).collect();
        let solution = solve::solve(&board(), &sightings).unwrap();
        let on_bed =
            OnBed::fit(&solution.model, vec![board().correspondences(&sightings[0].corners)])
                .unwrap();
        let covariance = CalibrationCovariance::of(&board(), &solution, &on_bed, Mm::ZERO).unwrap();
        let quality = CalibrationQuality {
            reprojection_rms_px: solution.rms_px,
            width_relative_sigma: Some(1e-3),
            seen_px: None,
            heights_mm: None,
            uncertainty: Some(covariance.uncertainty()),
        };
        let calibration = Calibration::Full {
            image_size_px: SIZE,
            camera: *solution.camera(),
            bed: on_bed.bed(Mm::ZERO),
            robot_z: Mm::ZERO,
            quality: Some(quality),
        };
        calibration.surface(Mm::ZERO, None)
    }

    #[test]
    fn a_width_is_known_less_well_beyond_where_boards_were_seen() {
        let bead = MapBead { width_mm: 40.0, across: Vector2::x() };
        let map = RelativeSigmaMap::of(&surface(), &bead, Cells { columns: 8, rows: 6 }).unwrap();
        let at = |column: usize, row: usize| map.cells[row * 8 + column];
        let (middle, corner) = (at(3, 3).unwrap(), at(1, 0).unwrap());
        assert!(corner > 2.0 * middle, "{corner} {middle}");
        // The bead does not fit beside the left side of the image.
        assert_eq!(at(0, 3), None);
        let higher = surface().with_height_sigma(Mm::constant(1.0));
        let with_height = RelativeSigmaMap::of(&higher, &bead, Cells { columns: 8, rows: 6 })
            .unwrap()
            .cells[3 * 8 + 3]
            .unwrap();
        assert!(with_height > middle && with_height > 1e-3, "{with_height}");
    }

    #[test]
    fn a_gauge_is_in_the_cells_that_it_covers() {
        let bead = MapBead { width_mm: 40.0, across: Vector2::x() };
        let map = RelativeSigmaMap::of(&surface(), &bead, Cells { columns: 8, rows: 6 }).unwrap();
        let cells = |gauge: Roi| (0..48).filter(|&cell| map.is_in(gauge, cell)).collect::<Vec<_>>();
        // Cells are 90 px wide and high.
        let gauge = Roi { x: 180, y: 190, width: 270, height: 60 };
        assert_eq!(cells(gauge), [18, 19, 20]);
        assert_eq!(cells(Roi { x: 2, y: 2, width: 10, height: 10 }), [0]);
    }

    #[test]
    fn a_single_number_has_no_map() {
        let bead = MapBead { width_mm: 40.0, across: Vector2::x() };
        assert_eq!(
            RelativeSigmaMap::of(
                &SurfaceMap::from_scale(0.1),
                &bead,
                Cells { columns: 8, rows: 6 }
            ),
            None
        );
    }
}
