//! The bead's local width along a gauge, caliper line by caliper line.

use nalgebra::Vector2;

use crate::calibration::SurfaceMap;
use crate::core::SurfacePoint;
use crate::numeric::number::to_f64;
use crate::vision::width::Caliper;

/// Largest fraction of the lines that may be missing: they are interpolated.
const MAX_MISSING: f64 = 0.2;
/// Fewest lines that show roughness.
const MIN_LINES: usize = 8;

/// Local widths of one frame, evenly spaced along the bead. Each is the mean over its
/// own part of the gauge, which ends where the next one's begins.
#[derive(Debug, Clone, PartialEq)]
pub struct LocalWidths {
    /// Widths normal to the bead's axis \[mm\].
    pub widths_mm: Vec<f64>,
    /// Distance of neighbours along the bead \[mm\].
    pub spacing_mm: f64,
    /// Variance of one width by the measurement's own noise \[mm²\].
    pub noise_mm2: f64,
    /// Smoothing along the bead that the noise has passed too, as the standard deviation
    /// of a Gaussian, beside the mean over a width's own part \[mm\].
    pub filter_mm: f64,
    /// Smoothing along the bead that only the bead has passed: the lens's \[mm\].
    pub blur_mm: f64,
}

/// Smoothing that the calipers' positions have passed along the bead \[px\]; see [`LocalWidths`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CaliperFilter {
    /// Smoothing of the measurement.
    pub filter_px: f64,
    /// Smoothing of the lens.
    pub blur_px: f64,
    /// Fraction of each edge's variance that differs from line to line; the rest moves the whole
    /// edge, and is not noise of a local width.
    pub noise_fractions: [f64; 2],
    /// Distance of caliper lines.
    pub line_px: f64,
}

/// A line on which both edges were found.
struct Section {
    number: usize,
    middle: SurfacePoint,
    across: Vector2<f64>,
    noise_mm2: f64,
}

impl LocalWidths {
    /// Local widths of a frame from its caliper lines, of `lines` in all. `None` where too many are
    /// missing, or their noise is not known.
    pub fn read(
        calipers: impl Iterator<Item = Caliper>,
        lines: usize,
        filter: CaliperFilter,
        surface: &SurfaceMap,
    ) -> Option<Self> {
        let sections: Vec<Section> = calipers
            .filter_map(|caliper| Section::of(&caliper, filter.noise_fractions, surface))
            .collect();
        let missing = to_f64(lines - sections.len().min(lines));
        if sections.len() < MIN_LINES || missing > MAX_MISSING * to_f64(lines) {
            return None;
        }
        let axis = axis(&sections)?;
        let (first, last) = (sections.first()?, sections.last()?);
        let length_mm = (last.middle - first.middle).dot(&axis);
        let spacing_mm = length_mm / to_f64(last.number - first.number);
        let mm_per_px = spacing_mm / filter.line_px;
        let normal = Vector2::new(-axis.y, axis.x);
        let noise_mm2 = sections.iter().map(|section| section.noise_mm2).sum::<f64>();
        Some(Self {
            widths_mm: fill(lines, &sections, |section| section.across.dot(&normal).abs()),
            spacing_mm,
            noise_mm2: noise_mm2 / to_f64(sections.len()),
            filter_mm: filter.filter_px * mm_per_px,
            blur_mm: filter.blur_px * mm_per_px,
        })
    }

    /// Length of the gauge along the bead \[mm\].
    pub fn gauge_mm(&self) -> f64 {
        self.spacing_mm * to_f64(self.widths_mm.len())
    }
}

impl Section {
    fn of(caliper: &Caliper, fractions: [f64; 2], surface: &SurfaceMap) -> Option<Self> {
        let (left, right) = (caliper.left?, caliper.right?);
        let (from, to) = (surface.to_mm(left.at)?, surface.to_mm(right.at)?);
        let across = to - from;
        let mm_per_px = across.norm() / (right.at - left.at).norm();
        let sigmas = (left.sigma_px?, right.sigma_px?);
        let noise_px2 = fractions[0] * sigmas.0.powi(2) + fractions[1] * sigmas.1.powi(2);
        let noise_mm2 = noise_px2 * mm_per_px * mm_per_px;
        let middle = nalgebra::center(&from, &to);
        noise_mm2.is_finite().then_some(Self { number: caliper.number, middle, across, noise_mm2 })
    }
}

/// The straight axis of the bead: the line through the middles of both halves.
fn axis(sections: &[Section]) -> Option<Vector2<f64>> {
    let middle = |part: &[Section]| {
        let sum: Vector2<f64> = part.iter().map(|section| section.middle.coords).sum();
        sum / to_f64(part.len())
    };
    let (before, after) = sections.split_at(sections.len() / 2);
    (middle(after) - middle(before)).try_normalize(f64::MIN_POSITIVE)
}

/// A value for each line; those of missing lines are interpolated between their neighbours.
fn fill(lines: usize, sections: &[Section], value: impl Fn(&Section) -> f64) -> Vec<f64> {
    let mut next = 0;
    let at = |line: usize| {
        while next < sections.len() && sections[next].number < line {
            next += 1;
        }
        match (next.checked_sub(1).map(|k| &sections[k]), sections.get(next)) {
            (_, Some(here)) if here.number == line => value(here),
            (Some(before), Some(after)) => {
                let part = to_f64(line - before.number) / to_f64(after.number - before.number);
                value(before) + part * (value(after) - value(before))
            }
            (Some(end), None) | (None, Some(end)) => value(end),
            (None, None) => 0.0,
        }
    };
    (0..lines).map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::ImagePoint;
    use crate::vision::width::CaliperPoint;

    /// A bead of 40 px that slants, whose lines 3 and 4 are missing.
    fn slanted(slope: f64) -> Vec<Caliper> {
        let position =
            |x: f64, y: f64| Some(CaliperPoint { at: ImagePoint::new(x, y), sigma_px: Some(0.1) });
        let caliper = |number: usize| {
            let y = 4.0 * to_f64(number);
            Caliper { number, left: position(slope * y, y), right: position(40.0 + slope * y, y) }
        };
        (0..20).filter(|number| !(3..5).contains(number)).map(caliper).collect()
    }

    const FILTER: CaliperFilter =
        CaliperFilter { filter_px: 2.5, blur_px: 1.5, noise_fractions: [1.0, 0.5], line_px: 4.0 };

    #[test]
    fn widths_are_normal_to_the_axis_and_missing_ones_are_filled() {
        let surface = SurfaceMap::from_scale(0.5);
        let slope: f64 = 0.2;
        let widths = LocalWidths::read(slanted(slope).into_iter(), 20, FILTER, &surface).unwrap();
        let cosine = 1.0 / (1.0 + slope * slope).sqrt();
        assert_eq!(widths.widths_mm.len(), 20);
        assert!(widths.widths_mm.iter().all(|width| (width - 20.0 * cosine).abs() < 1e-9));
        assert!((widths.spacing_mm - 2.0 / cosine).abs() < 1e-9);
        assert!((widths.filter_mm - 1.25 / cosine).abs() < 1e-9);
        assert!((widths.noise_mm2 - 1.5 * 0.05_f64.powi(2)).abs() < 1e-12);
    }

    #[test]
    fn a_frame_of_which_too_much_is_missing_tells_nothing() {
        let surface = SurfaceMap::from_scale(1.0);
        let few = slanted(0.0).into_iter().take(12);
        assert_eq!(LocalWidths::read(few, 20, FILTER, &surface), None);
    }
}
