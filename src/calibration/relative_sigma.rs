//! Relative standard deviation of a width due to a calibration, over a part of the image.

use nalgebra::Vector2;

use super::covariance::{CalibrationCovariance, DerivedValue};
use crate::core::{ImagePoint, Mm};

/// Width of the bead as a fraction of the side of that part. A choice: a usual bead.
const BEAD_FRACTION: f64 = 1.0 / 3.0;
/// Positions of such beads along each side.
const POSITIONS_PER_SIDE: u32 = 5;
/// Highest surface as a fraction of the height of the camera above the bed.
const MAX_SURFACE_FRACTION: f64 = 0.05;

/// Relative standard deviation of a width where boards were seen: the largest of a bead that
/// fills a third of that part of the image, along either axis, anywhere in it, on the bed and
/// on a surface at a twentieth of the height of the camera. The largest and not a mean, because
/// a gauge stays at one position, and so does its error. `None` where no such bead is seen on
/// the surface.
pub fn where_seen(covariance: &CalibrationCovariance) -> Option<f64> {
    largest(covariance, &readings(covariance))
}

/// Largest relative standard deviation of the widths of beads.
pub fn largest(covariance: &CalibrationCovariance, readings: &[DerivedValue]) -> Option<f64> {
    let fraction = |reading: &DerivedValue| covariance.sigma(reading) / reading.value;
    readings.iter().map(fraction).filter(|fraction| fraction.is_finite()).reduce(f64::max)
}

fn readings(covariance: &CalibrationCovariance) -> Vec<DerivedValue> {
    let beads = beads_where_seen(covariance).into_iter();
    beads.filter_map(|(ends, height)| covariance.width(ends, height)).collect()
}

/// Ends of beads all over the part of the image where boards were seen, on the bed and on the
/// highest surface.
pub fn beads_where_seen(covariance: &CalibrationCovariance) -> Vec<([ImagePoint; 2], Mm)> {
    let above = Mm::new(MAX_SURFACE_FRACTION * covariance.camera_height_mm()).unwrap_or(Mm::ZERO);
    let on = |height| beads(covariance.seen_px()).map(move |ends| (ends, height));
    [Mm::ZERO, above].into_iter().flat_map(on).collect()
}

/// Ends of these beads within a part of the image, as far from its boundary along the bead as
/// across it.
fn beads([from, to]: [ImagePoint; 2]) -> impl Iterator<Item = [ImagePoint; 2]> {
    let size = to - from;
    let position = |i: u32| {
        BEAD_FRACTION / 2.0
            + (1.0 - BEAD_FRACTION) * f64::from(i) / f64::from(POSITIONS_PER_SIDE - 1)
    };
    let middles = (0..POSITIONS_PER_SIDE * POSITIONS_PER_SIDE).map(move |i| {
        from + size.component_mul(&Vector2::new(
            position(i % POSITIONS_PER_SIDE),
            position(i / POSITIONS_PER_SIDE),
        ))
    });
    let halves =
        [Vector2::new(size.x, 0.0), Vector2::new(0.0, size.y)].map(|s| s * (BEAD_FRACTION / 2.0));
    middles.flat_map(move |middle| halves.map(|half| [middle - half, middle + half]))
}
