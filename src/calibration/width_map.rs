//! Standard deviation of a width due to a calibration, in millimetres, all over the image.

use nalgebra::Vector2;

use super::SurfaceMap;
use super::covariance::CalibrationCovariance;
use crate::core::{ImagePoint, Mm};

/// Numbers of cells of an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cells {
    /// Number of columns.
    pub columns: u32,
    /// Number of rows.
    pub rows: u32,
}

/// Cells of a map of widths.
pub const MAP_CELLS: Cells = Cells { columns: 16, rows: 12 };

/// Standard deviation of a bead's width on one surface.
#[derive(Debug, Clone, PartialEq)]
pub struct WidthMap {
    /// Width of the bead \[mm\].
    pub bead_mm: f64,
    /// Height of the surface above the bed.
    pub surface_height: Mm,
    /// Standard deviation for a bead in the middle of a cell \[mm\], the larger one of both
    /// directions; row by row, [`MAP_CELLS`]. `None` where such a bead is not entirely in the
    /// image.
    pub cells: Vec<Option<f64>>,
    /// The largest, of beads where boards were seen; `None` without one.
    pub worst_where_seen_mm: Option<f64>,
    /// Change of the width for a height error of 1 mm \[mm\].
    pub mm_per_mm_height: f64,
}

impl WidthMap {
    /// For beads of a width on a surface.
    pub fn of(covariance: &CalibrationCovariance, bead_mm: f64, surface_height: Mm) -> Self {
        let mut worst_where_seen_mm: Option<f64> = None;
        let cells = beads(covariance, bead_mm, surface_height)
            .map(|beads| {
                let sigmas = beads.iter().flatten().filter_map(|&ends| {
                    let (_, sigma_mm) = covariance.width_mm(ends, surface_height)?;
                    if is_where_seen(covariance, &ends) {
                        let worst = worst_where_seen_mm.map_or(sigma_mm, |mm| mm.max(sigma_mm));
                        worst_where_seen_mm = Some(worst);
                    }
                    Some(sigma_mm)
                });
                sigmas.reduce(f64::max)
            })
            .collect();
        let mm_per_mm_height = bead_mm / (covariance.camera_height_mm() - surface_height.get());
        Self { bead_mm, surface_height, cells, worst_where_seen_mm, mm_per_mm_height }
    }

    /// Smallest and largest of the cells \[mm\]; `None` without one.
    pub fn range_mm(&self) -> Option<(f64, f64)> {
        let cells = || self.cells.iter().flatten().copied();
        Some((cells().reduce(f64::min)?, cells().reduce(f64::max)?))
    }
}

/// The largest of several maps where boards were seen \[mm\]; `None` where one of them has
/// none.
pub fn worst_mm(maps: &[WidthMap]) -> Option<f64> {
    let worst = maps.iter().map(|map| map.worst_where_seen_mm);
    worst.reduce(|a, b| Some(a?.max(b?))).flatten()
}

/// Ends of beads of a width where boards were seen: those of [`WidthMap::worst_where_seen_mm`].
pub fn where_seen(
    covariance: &CalibrationCovariance,
    bead_mm: f64,
    surface_height: Mm,
) -> Vec<[ImagePoint; 2]> {
    let all = beads(covariance, bead_mm, surface_height).flatten().flatten();
    all.filter(|ends| is_where_seen(covariance, ends)).collect()
}

fn is_where_seen(covariance: &CalibrationCovariance, ends: &[ImagePoint; 2]) -> bool {
    let [from, to] = covariance.seen_px();
    ends.iter().all(|px| (from.x..=to.x).contains(&px.x) && (from.y..=to.y).contains(&px.y))
}

/// Ends of a bead in either direction about the middle of each cell.
fn beads(
    covariance: &CalibrationCovariance,
    bead_mm: f64,
    surface_height: Mm,
) -> impl Iterator<Item = [Option<[ImagePoint; 2]>; 2]> {
    let map = covariance.surface(surface_height);
    middles(covariance.image_size_px().map(f64::from), MAP_CELLS).map(move |middle| {
        [Vector2::x(), Vector2::y()].map(|along| ends(&map, middle, along, bead_mm))
    })
}

/// Middles of the cells of an image of this size \[px\], row by row.
pub(super) fn middles(size_px: [f64; 2], cells: Cells) -> impl Iterator<Item = ImagePoint> {
    let Cells { columns, rows } = cells;
    let part = |at: u32, count: u32| (f64::from(at) + 0.5) / f64::from(count);
    (0..columns * rows).map(move |i| {
        let (x, y) = (part(i % columns, columns), part(i / columns, rows));
        ImagePoint::new(x * size_px[0] - 0.5, y * size_px[1] - 0.5)
    })
}

/// Ends of a bead of this width about a point, along one axis of the image. `None` where it is
/// not entirely in the image, or the map has no image size.
pub(super) fn ends(
    map: &SurfaceMap,
    middle: ImagePoint,
    along: Vector2<f64>,
    bead_mm: f64,
) -> Option<[ImagePoint; 2]> {
    let [right, bottom] = map.image_size_px()?.map(|px| f64::from(px) - 1.0);
    let at = map.to_mm(middle)?;
    let way = (map.to_mm(middle + along)? - at).normalize() * (bead_mm / 2.0);
    let ends = [map.to_px(at - way)?, map.to_px(at + way)?];
    let inside = |px: &ImagePoint| (0.0..=right).contains(&px.x) && (0.0..=bottom).contains(&px.y);
    ends.iter().all(inside).then_some(ends)
}

/// A third of the image width on the bed, to two digits \[mm\]. `None` where the middle of the
/// image does not see the bed.
pub fn typical_bead_mm(covariance: &CalibrationCovariance) -> Option<f64> {
    let [width, height] = covariance.image_size_px().map(f64::from);
    let map = covariance.surface(Mm::ZERO);
    let end = |part: f64| map.to_mm(ImagePoint::new(part * width, height / 2.0));
    let third = (end(2.0 / 3.0)? - end(1.0 / 3.0)?).norm();
    // Rounded to two digits.
    let unit = 10_f64.powf(third.log10().floor() - 1.0);
    Some((third / unit).round() * unit)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::plane::OnBed;
    use crate::calibration::synthetic::{self, board, poses};
    use crate::calibration::{next_view, solve};

    fn covariance() -> (solve::Solution, CalibrationCovariance) {
        let mut turn = 0.0_f64;
        // Not noise, but a residual that the model cannot fit.
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
        (solution, covariance)
    }

    #[test]
    fn a_width_is_known_better_where_boards_were_seen() {
        let (_, covariance) = covariance();
        let map = WidthMap::of(&covariance, 40.0, Mm::ZERO);
        let (least, most) = map.range_mm().unwrap();
        let worst = map.worst_where_seen_mm.unwrap();
        assert!(least <= worst && worst < most, "{least} {worst} {most}");
        assert_eq!(map.cells.len(), 192);
        // A corner of the image has no room for a bead about its middle.
        assert_eq!(map.cells[0], None);
        let height = covariance.camera_height_mm();
        assert!((map.mm_per_mm_height - 40.0 / height).abs() < 1e-9);
        let wide = WidthMap::of(&covariance, 4000.0, Mm::ZERO);
        assert_eq!((wide.range_mm(), wide.worst_where_seen_mm), (None, None));
    }

    #[test]
    fn the_proposed_image_brings_the_predicted_gain() {
        let (solution, covariance) = covariance();
        let heights = [Mm::ZERO, Mm::constant(20.0)];
        let next = next_view::best(&board(), &solution, &covariance, 40.0, &heights).unwrap();
        let (before, after) = next.relative_sigma;
        // Its initial uncertainty is that of the maps.
        let worst = heights
            .map(|height| WidthMap::of(&covariance, 40.0, height).worst_where_seen_mm.unwrap())
            .into_iter()
            .fold(0.0, f64::max);
        assert!((before / (worst / 40.0) - 1.0).abs() < 1e-3, "{before} {worst}");
        assert!(after < 0.97 * before && after > 0.3 * before, "{next:?}");
        assert!(next.to_string().starts_with("the board "), "{next}");
    }
}
