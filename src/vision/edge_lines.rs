//! The method of Shojaei Barjuei et al. 2022, section 2.1.1, as a baseline: an
//! edge detector, the two edge lines of the layer in the region of interest,
//! and the distance between their midpoints, eq. (1)–(3).
//!
//! The paper leaves open which detector and which lines; here it is Canny's
//! detector and the probabilistic Hough transform. It knows whole pixels only
//! and no standard deviation of its own; [`SIGMA_PX`] stands for that.

use crate::bridge::{EdgeSegment, EdgeSettings, canny_hough};
use crate::calibration::SurfaceMap;
use crate::core::{Frame, ImagePoint, Mm, WidthRange};
use crate::numeric::number::{to_count, to_f64};

use super::gauge::{Gauge, GaugeView, Polarity};
use super::reject::Reject;
use super::width::{Hints, WidthMeasurement};

/// Standard deviation of the distance of two lines of whole pixels \[px\]. Derived: rounding leaves
/// √(2/12) = 0.41 px; the lines are pieced together, which leaves a little more.
const SIGMA_PX: f64 = 0.5;
/// Steepest edge line against the gauge's axis, in pixels across for each
/// along.
const MAX_SLOPE: f64 = 0.45;
/// Distance at the gauge's middle below which two lines are one edge \[px\].
const SAME_EDGE_PX: f64 = 4.0;
/// Fraction of the gauge that an edge line must cover.
const MIN_COVERAGE: f64 = 0.3;

/// An edge line across the gauge: its ends on the gauge's first and last row.
#[derive(Debug, Clone, Copy, PartialEq)]
struct EdgeLine {
    first: f64,
    last: f64,
    coverage: f64,
}

impl EdgeLine {
    fn middle(&self) -> f64 {
        f64::midpoint(self.first, self.last)
    }
}

/// Measures a frame with the paper's method. Appends the edge points to the
/// lists, for images of them.
pub fn measure(
    gauge: &Gauge,
    frame: &Frame,
    surface: &SurfaceMap,
    (left_px, right_px): (&mut Vec<ImagePoint>, &mut Vec<ImagePoint>),
) -> Result<WidthMeasurement, Reject> {
    let refused = |got| Reject::NoPair { got, need: MIN_COVERAGE };
    let view = GaugeView::new(gauge.roi, gauge.axis);
    let length = to_f64(view.along);
    let settings = EdgeSettings {
        blur_sigma_px: 1.5,
        thresholds: [4.0 * gauge.min_contrast_grey, 10.0 * gauge.min_contrast_grey],
        votes: 30,
        shortest_px: length * 0.1,
        longest_gap_px: length * 0.1,
    };
    let segments = canny_hough(frame, gauge.roi, &settings).map_err(|_| refused(0.0))?;
    let lines = edge_lines(view, &segments);
    let (left, right) = best_pair(gauge, surface, frame, &lines).ok_or(refused(0.0))?;
    for (line, points) in [(left, left_px), (right, right_px)] {
        points.extend([view.to_image(line.first, 0.0), view.to_image(line.last, length - 1.0)]);
    }
    // Eq. (1), (2): the midpoints of the two lines. Eq. (3): their distance.
    let [m1, m2] = [left, right].map(|line| view.to_image(line.middle(), (length - 1.0) / 2.0));
    let on_surface = |px| surface.to_mm(px).ok_or(Reject::OffSurface);
    let distance = (on_surface(m2)? - on_surface(m1)?).norm();
    let width = Mm::new(distance).map_err(|_| Reject::OffSurface)?;
    let per_px = distance / (m2 - m1).norm().max(1e-9);
    let slope = ((left.last - left.first) + (right.last - right.first)) / (2.0 * length);
    Ok(WidthMeasurement {
        width,
        sigma: Mm::new(SIGMA_PX * per_px).map_err(|_| Reject::OffSurface)?,
        left: m1,
        right: m2,
        slant_rad: slope.atan(),
        hints: Hints { used_fraction: left.coverage.min(right.coverage), ..Hints::default() },
    })
}

/// Lines along the bead, carried on to the gauge's ends; pieces of the same
/// edge are one line with their mean position.
fn edge_lines(view: GaugeView, segments: &[EdgeSegment]) -> Vec<EdgeLine> {
    let length = to_f64(view.along);
    let mut lines: Vec<EdgeLine> = Vec::new();
    for segment in segments {
        let [(u0, v0), (u1, v1)] = [segment.from, segment.to].map(|at| view.from_image(at));
        let run = v1 - v0;
        let slope = (u1 - u0) / run;
        if run.abs() < 2.0 || slope.abs() > MAX_SLOPE {
            continue;
        }
        let (first, last) = (u0 - slope * v0, u0 + slope * (length - 1.0 - v0));
        let covered = run.abs() / length;
        let new = EdgeLine { first, last, coverage: covered };
        let same =
            lines.iter_mut().find(|line| (line.middle() - new.middle()).abs() < SAME_EDGE_PX);
        match same {
            Some(line) => {
                let sum = line.coverage + covered;
                line.first = (line.first * line.coverage + new.first * covered) / sum;
                line.last = (line.last * line.coverage + new.last * covered) / sum;
                line.coverage = sum;
            }
            None => lines.push(new),
        }
    }
    for line in &mut lines {
        line.coverage = line.coverage.min(1.0);
    }
    lines
}

/// The pair of lines that covers most of the gauge, within the range of widths
/// and with the bead's polarity.
fn best_pair(
    gauge: &Gauge,
    surface: &SurfaceMap,
    frame: &Frame,
    lines: &[EdgeLine],
) -> Option<(EdgeLine, EdgeLine)> {
    let view = GaugeView::new(gauge.roi, gauge.axis);
    let middle = (to_f64(view.along) - 1.0) / 2.0;
    let grey = frame.to_grey8();
    let mut best: Option<(f64, EdgeLine, EdgeLine)> = None;
    for left in lines.iter().filter(|line| line.coverage >= MIN_COVERAGE) {
        for right in lines.iter().filter(|line| line.coverage >= MIN_COVERAGE) {
            if right.middle() <= left.middle() {
                continue;
            }
            let m1 = surface.to_mm(view.to_image(left.middle(), middle))?;
            let m2 = surface.to_mm(view.to_image(right.middle(), middle))?;
            let width = (m2 - m1).norm();
            let WidthRange { min, max } = gauge.width_range;
            if !(min.get()..=max.get()).contains(&width)
                || !polarity_fits(gauge, frame, &grey, [*left, *right])
            {
                continue;
            }
            let covered = left.coverage + right.coverage;
            if best.is_none_or(|(most, ..)| covered > most) {
                best = Some((covered, *left, *right));
            }
        }
    }
    best.map(|(_, left, right)| (left, right))
}

/// Whether the gauge's middle row is brighter between the lines than beside
/// them, or darker, as the bead is.
fn polarity_fits(gauge: &Gauge, frame: &Frame, grey: &[u8], [left, right]: [EdgeLine; 2]) -> bool {
    /// Distance from an edge line at which the level is read \[px\]: beyond the blur.
    const BESIDE_PX: f64 = 6.0;
    let (roi, view) = (gauge.roi, GaugeView::new(gauge.roi, gauge.axis));
    let middle = ((to_f64(view.along) - 1.0) / 2.0).round();
    let level = |across: f64| -> Option<f64> {
        let at = view.to_image(across.round(), middle);
        let (x, y) = (to_count(at.x), to_count(at.y));
        let inside =
            (roi.x..roi.x + roi.width).contains(&x) && (roi.y..roi.y + roi.height).contains(&y);
        inside.then(|| f64::from(grey[y * frame.width() + x]))
    };
    let inner = [left.middle() + BESIDE_PX, right.middle() - BESIDE_PX].map(level);
    let outer = [left.middle() - BESIDE_PX, right.middle() + BESIDE_PX].map(level);
    let steps = [inner[0].zip(outer[0]), inner[1].zip(outer[1])];
    steps.iter().flatten().all(|(inner, outer)| match gauge.polarity {
        Polarity::Bright => inner > outer,
        Polarity::Dark => inner < outer,
        Polarity::Any => true,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::{Pixels, Roi, Size, Stamp};
    use crate::vision::MeasureMethod;
    use crate::vision::gauge::BeadAxis;

    fn bar(from: usize, to: usize) -> Frame {
        let values = (0..100usize)
            .flat_map(|_| {
                (0..160usize).map(move |x| if (from..to).contains(&x) { 150 } else { 60 })
            })
            .collect();
        Frame::new(0, Stamp::START, Size::new(160, 100), Pixels::Grey8(values)).unwrap()
    }

    fn gauge() -> Gauge {
        Gauge {
            method: MeasureMethod::EdgeLines,
            ..Gauge::new(
                Roi { x: 10, y: 5, width: 140, height: 90 },
                BeadAxis::Vertical,
                Polarity::Bright,
                WidthRange { min: Mm::constant(2.0), max: Mm::constant(20.0) },
            )
        }
    }

    #[test]
    fn the_distance_of_the_midpoints_is_the_width_to_a_pixel() {
        let surface = SurfaceMap::from_scale(0.126_582);
        let (mut left, mut right) = (Vec::new(), Vec::new());
        let found = measure(&gauge(), &bar(50, 110), &surface, (&mut left, &mut right)).unwrap();
        assert!((found.width.get() - 60.0 * 0.126_582).abs() < 2.0 * 0.126_582, "{found:?}");
        assert_eq!((left.len(), right.len()), (2, 2));
    }

    #[test]
    fn a_dark_bead_is_not_a_bright_one() {
        let surface = SurfaceMap::from_scale(0.126_582);
        let dark = Gauge { polarity: Polarity::Dark, ..gauge() };
        let found = measure(&dark, &bar(50, 110), &surface, (&mut Vec::new(), &mut Vec::new()));
        assert_eq!(found.unwrap_err().status(), "no_pair");
    }
}
