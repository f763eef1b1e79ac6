//! Position of a bead in the image: from positions along and across the bead to pixels.
//!
//! The nozzle is beyond the top of the image for a vertical bead and beyond
//! its right side for a horizontal one, so that the left edge of the bead, seen
//! in the direction of travel, is the left or the upper one in the image.

use nalgebra::Vector2;

use super::bead_path::BeadPath;
use crate::calibration::SurfaceMap;
use crate::core::{ImagePoint, Roi, SurfacePoint};
use crate::numeric::number::to_f64;
use crate::vision::{BeadAxis, Gauge};

/// Positions on the surface by their distance along the bead \[mm\], counted from
/// the middle of the gauge in the direction of travel, and across it, positive
/// to the right.
#[derive(Debug, Clone, Copy)]
pub struct BeadView {
    map: SurfaceMap,
    origin: SurfacePoint,
    along: Vector2<f64>,
    across: Vector2<f64>,
    axis: BeadAxis,
    bend: BeadPath,
    /// Length along the bead of one pixel in the middle of the gauge \[mm\].
    pub pixel_mm: f64,
}

/// The middle of the gauge \[px\].
pub fn gauge_middle(roi: &Roi) -> ImagePoint {
    let middle = |first: usize, count: usize| to_f64(first) + (to_f64(count) - 1.0) / 2.0;
    ImagePoint::new(middle(roi.x, roi.width), middle(roi.y, roi.height))
}

impl BeadView {
    /// The bead runs through the middle of the gauge, shifted sideways by `lateral_mm`, in the
    /// direction of the gauge's axis on the surface. With a positive `slant_deg` its position
    /// across the gauge grows with its position along it, as in a measurement's slant. `None` if
    /// the middle of the gauge does not see the surface.
    pub fn new(map: SurfaceMap, gauge: &Gauge, slant_deg: f64, lateral_mm: f64) -> Option<Self> {
        let middle = gauge_middle(&gauge.roi);
        let mm_per_px = map.mm_per_px(middle)?;
        let (ahead, right, turn) = match gauge.axis {
            BeadAxis::Vertical => (Vector2::new(0.0, -1.0), Vector2::new(1.0, 0.0), -slant_deg),
            BeadAxis::Horizontal => (Vector2::new(1.0, 0.0), Vector2::new(0.0, 1.0), slant_deg),
        };
        let (ahead_mm, right_mm) = (mm_per_px * ahead, mm_per_px * right);
        let straight = ahead_mm.try_normalize(0.0)?;
        let normal = Vector2::new(-straight.y, straight.x);
        let sideways = if normal.dot(&right_mm) < 0.0 { -normal } else { normal };
        let (sin, cos) = libm::sincos(turn.to_radians());
        let along = straight * cos + sideways * sin;
        let across = sideways * cos - straight * sin;
        let origin = map.to_mm(middle)? + across * lateral_mm;
        let (axis, pixel_mm) = (gauge.axis, ahead_mm.norm());
        Some(Self { map, origin, along, across, axis, bend: BeadPath::Straight, pixel_mm })
    }

    /// The view of a bead whose path bends at the middle of the gauge.
    pub fn bent(self, bend: BeadPath) -> Self {
        Self { bend, ..self }
    }

    /// The pixel of a position; `None` behind the camera, and too far around a curve.
    pub fn px(&self, along_mm: f64, across_mm: f64) -> Option<AxisPoint> {
        let position = self.bend.position(along_mm, across_mm)?;
        let px =
            self.map.to_px(self.origin + self.along * position.x + self.across * position.y)?;
        (px.x.is_finite() && px.y.is_finite()).then(|| self.axis_point(px))
    }

    /// Distance along the bead of the surface point at a pixel \[mm\]; `None` if it sees no
    /// surface.
    pub fn along_mm(&self, px: ImagePoint) -> Option<f64> {
        let position = self.map.to_mm(px)? - self.origin;
        Some(
            self.bend.along_mm(Vector2::new(position.dot(&self.along), position.dot(&self.across))),
        )
    }

    fn axis_point(&self, px: ImagePoint) -> AxisPoint {
        match self.axis {
            BeadAxis::Vertical => AxisPoint { run: px.y, cross: px.x },
            BeadAxis::Horizontal => AxisPoint { run: px.x, cross: px.y },
        }
    }

    /// Image coordinates of a point given along and across the gauge's axis.
    pub fn image_point(&self, position: AxisPoint) -> ImagePoint {
        match self.axis {
            BeadAxis::Vertical => ImagePoint::new(position.cross, position.run),
            BeadAxis::Horizontal => ImagePoint::new(position.run, position.cross),
        }
    }

    /// 1 if `run` grows in the direction of travel, else −1.
    pub fn run_sign(&self) -> f64 {
        match self.axis {
            BeadAxis::Vertical => -1.0,
            BeadAxis::Horizontal => 1.0,
        }
    }
}

/// Pixels of the image in the gauge's own directions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GaugeExtent {
    /// Along the gauge's axis: the rows of a vertical bead.
    pub run: usize,
    /// Across it: the columns of a vertical bead.
    pub cross: usize,
}

/// A point of the image in the gauge's own directions \[px\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxisPoint {
    /// Along the gauge's axis: the row of a vertical bead.
    pub run: f64,
    /// Across it: the column of a vertical bead.
    pub cross: f64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::{Mm, WidthRange};
    use crate::vision::Polarity;

    fn gauge(axis: BeadAxis) -> Gauge {
        Gauge::new(
            Roi { x: 10, y: 20, width: 101, height: 51 },
            axis,
            Polarity::Bright,
            WidthRange { min: Mm::ZERO, max: Mm::constant(50.0) },
        )
    }

    #[test]
    fn travel_is_up_or_to_the_right_with_the_left_edge_on_its_left() {
        let map = SurfaceMap::from_scale(0.5);
        let up = BeadView::new(map, &gauge(BeadAxis::Vertical), 0.0, 0.0).unwrap();
        let position = up.px(2.0, -1.0).unwrap();
        assert_eq!(up.image_point(position), ImagePoint::new(60.0 - 2.0, 45.0 - 4.0));
        let right = BeadView::new(map, &gauge(BeadAxis::Horizontal), 0.0, 0.0).unwrap();
        let position = right.px(2.0, -1.0).unwrap();
        assert_eq!(right.image_point(position), ImagePoint::new(60.0 + 4.0, 45.0 - 2.0));
    }

    #[test]
    fn a_slant_turns_the_bead_and_a_shift_is_normal_to_it() {
        let map = SurfaceMap::from_scale(1.0);
        let view = BeadView::new(map, &gauge(BeadAxis::Vertical), -10.0, 3.0).unwrap();
        let (sin, cos) = 10_f64.to_radians().sin_cos();
        let position = view.px(0.0, 0.0).unwrap();
        assert!((position.cross - (60.0 + 3.0 * cos)).abs() < 1e-12);
        assert!((position.run - (45.0 + 3.0 * sin)).abs() < 1e-12);
        let ahead = view.px(100.0, 0.0).unwrap();
        assert!((ahead.cross - position.cross - 100.0 * sin).abs() < 1e-12);
        assert!((ahead.run - position.run + 100.0 * cos).abs() < 1e-12);
    }
}
